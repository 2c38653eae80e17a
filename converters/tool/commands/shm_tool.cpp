// Main program of the tool shm, with the list of its commands. If a command fails, it throws a
// Failure, and run_tool() reports it.
//
// Exit codes:
// - 0: done
// - 1: a difference was found
// - 2: usage error
// - 3: bad or unreadable input
// - 4: the output could not be written
// - 5: a limit was exceeded
// - 6: the output would lack data (--strict)
// - 7: repair salvaged only a part
#include <malloc.h>

#include <csignal>
#include <memory>

#include "base/output_file.h"
#include "tool/commands/append.h"
#include "tool/commands/compress.h"
#include "tool/commands/convert.h"
#include "tool/commands/diff.h"
#include "tool/commands/extract.h"
#include "tool/commands/info.h"
#include "tool/commands/join.h"
#include "tool/commands/repair.h"
#include "tool/commands/split.h"
#include "tool/commands/verify.h"
#include "tool/drawing/layout.h"
#include "tool/drawing/preview.h"
#include "tool/drawing/surface.h"
#include "tool/drawing/view.h"
#include "tool/running/help_texts.h"
#include "tool/running/run_tool.h"

namespace shm::converters {
namespace {

// Returns the commands in the order in which `shm --help` lists them.
Commands commands() {
  Commands all;
  all.push_back(std::make_unique<CompressCommand>());
  all.push_back(std::make_unique<DecompressCommand>());
  all.push_back(std::make_unique<AppendCommand>());
  all.push_back(std::make_unique<ConvertCommand>());
  all.push_back(std::make_unique<VerifyCommand>());
  all.push_back(std::make_unique<DiffCommand>());
  all.push_back(std::make_unique<InfoCommand>());
  all.push_back(std::make_unique<JoinCommand>());
  all.push_back(std::make_unique<SplitCommand>());
  all.push_back(std::make_unique<ExtractCommand>());
  all.push_back(std::make_unique<PreviewCommand>());
  all.push_back(std::make_unique<SurfaceCommand>());
  all.push_back(std::make_unique<ViewCommand>());
  all.push_back(std::make_unique<LayoutCommand>());
  all.push_back(std::make_unique<RepairCommand>());
  all.push_back(std::make_unique<CompletionCommand>());
  all.push_back(std::make_unique<ManualCommand>());
  return all;
}

}  // namespace
}  // namespace shm::converters

int main(int argc, char** argv) {
  // Blocks of memory above this threshold are returned to the system when they are freed, instead
  // of being kept for smaller allocations.
  ::mallopt(M_MMAP_THRESHOLD, 768 * 1024);
  shm::converters::remove_outputs_on_signals();
  std::signal(SIGPIPE, SIG_IGN);  // so that a write to a closed pipe returns an error

  // SIGXFSZ is ignored, so that a write beyond the file size limit returns an error instead of
  // ending the process.
  std::signal(SIGXFSZ, SIG_IGN);
  return shm::converters::run_tool(shm::converters::commands, argc, argv);
}
