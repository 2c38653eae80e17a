#include "tool/commands/info.h"

#include <CLI/CLI.hpp>
#include <cstdio>
#include <string>
#include <vector>

#include "archive/archive_files.h"
#include "tool/commands/options.h"
#include "tool/input.h"
#include "tool/progress_line.h"
#include "tool/report.h"

namespace shm::converters {

CLI::App* InfoCommand::add_to(CLI::App& tool) {
  CLI::App* command =
      add_command(tool, *this, "info",
                  "List what a mesh holds and where the bytes of a .shm file go.\n"
                  "Of a .shm file heads alone are read; shm verify reads all of it.",
                  "  shm info rotor.e.shm\n"
                  "  shm info rotor.e.shm --json | jq .streams");
  add_files(*command, *this, ".shm file (or any mesh, without sizes); of several a line each");
  command->add_flag("--json", json, "Print as JSON");
  return command;
}

ExitCode InfoCommand::run() {
  ProgressLine line(*this);
  std::string text;
  ToolInput in(*this);
  if (!in.is_stream() && is_archive(in.path())) {
    ArchiveFile archive(in.path());
    std::vector<MemberSummary> members;
    for (const ArchiveMember& member : archive.members())
      members.push_back({member.name, archive.summarize(member)});
    text = (json ? archive_json : archive_text)(input, members);
  } else if (in.is_shm()) {
    const FileSummary summary = in.summarize(line.callback());
    text = !json && is_one_of_many
               ? input + ": " + counts_text(summary.info) + "\n"
               : (json ? info_json : info_text)(input, summary.info, &summary.totals);
  } else {
    Spool spool(spool_directory(*this), spool_memory(*this));
    const auto mesh = in.open(spool, line.callback());
    text = (json ? info_json : info_text)(input, mesh->info(), nullptr);
  }
  line.wipe();
  std::fputs(text.c_str(), stdout);
  return kDone;
}

}  // namespace shm::converters
