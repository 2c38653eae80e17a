#include "tool/commands/join.h"

#include <CLI/CLI.hpp>
#include <cstdio>

#include "archive/archive_files.h"
#include "base/output_file.h"
#include "tool/commands/options.h"
#include "tool/progress_line.h"
#include "tool/report.h"

namespace shm::converters {

CLI::App* JoinCommand::add_to(CLI::App& tool) {
  CLI::App* command = add_command(
      tool, *this, "join",
      "Put several meshes into one .shm file: the pieces of a decomposed mesh, the files of a\n"
      "restarted run. .shm files go in as they are, others are compressed",
      "  shm join -o rotor.shm rotor.e.4.0 rotor.e.4.1 rotor.e.4.2 rotor.e.4.3\n"
      "  shm join -o run.shm run.e run.e-s002 run.e-s003\n"
      "  shm join -o rounded.shm a.e.shm b.e.shm     made by shm compress, with its options");
  command->add_option("IN", inputs, "Files of format " + format_names())->required()->type_name("");
  command->add_option("-o,--output", output, "File to write")->required()->type_name("OUT.shm");
  add_force(*command, *this);
  add_order(*command, order);
  add_level(*command, level);
  add_threads(*command, threads, "Encode segments");
  command->add_flag("--json", json, "Print the sizes as JSON");
  return command;
}

Places JoinCommand::places() { return {inputs, output, true}; }

ExitCode JoinCommand::run() {
  CompressOptions how;
  how.order = order_of(order);
  how.level = level_of(level);
  how.threads = threads;
  ProgressLine line(*this);
  how.progress = line.callback();
  OutputFile archive(output, spool_directory(*this));
  ByteSink& sink = archive.sink();
  const auto members = join_files(inputs, sink, how, spool_directory(*this), spool_memory(*this));
  archive.commit();
  line.wipe();
  const std::uint64_t bytes = file_bytes(output);
  if (json)
    std::fputs(join_json(output, bytes, members).c_str(), stdout);
  else
    print(*this, join_text(output, bytes, members));
  return kDone;
}

}  // namespace shm::converters
