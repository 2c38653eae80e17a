#include "tool/commands/info.h"

#include <CLI/CLI.hpp>
#include <cstdio>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "archive/archive_files.h"
#include "base/failure.h"
#include "tool/commands/options.h"
#include "tool/info_report.h"
#include "tool/input.h"
#include "tool/progress_line.h"
#include "tool/report.h"

namespace shm::converters {

CLI::App* InfoCommand::add_to(CLI::App& tool) {
  CLI::App* command =
      add_command(tool, *this, "info",
                  "List what a mesh holds, and with -v where the bytes of a .shm file go.\n"
                  "Of a .shm file heads alone are read, unless --ranges wants its values;\n"
                  "shm verify checks all of it.",
                  "  shm info rotor.e.shm\n"
                  "  shm info rotor.e.shm -v                  the coder's view, too\n"
                  "  shm info rotor.e.shm --json | jq .streams");
  add_files(*command, *this, ".shm file (or any mesh, without sizes); of several a line each");
  command->add_flag("-v,--verbose", verbose,
                    "Order, codecs, segments and the bytes of each stream of a .shm file, too");
  command->add_flag("--ranges", ranges, "Read all values, and show the range of each array");
  command->add_flag("--json", json, "Print as JSON; all keys are there without -v");
  return command;
}

std::string InfoCommand::of_mesh(ToolInput& in, ProgressLine& line) {
  const auto report = [&](const MeshInfo& info, const Totals* totals, InfoExtent extent) {
    if (!json && is_one_of_many && !verbose) return input + ": " + counts_text(info) + "\n";
    const InfoReport all{input, info, totals, std::move(extent)};
    return json ? info_json(all) : info_text(all, verbose);
  };
  line.expect({{"decoding", 1}, {"measuring", 1}}, file_bytes(in.path()));
  std::optional<FileSummary> summary;
  if (in.is_shm()) summary = in.summarize(line.callback());
  const Totals* const totals = summary ? &summary->totals : nullptr;
  if (summary && (!ranges || in.is_stream())) {
    if (ranges) wrong_use("--ranges needs a file that can be read twice; " + input + " is a pipe");
    const auto box =
        in.is_stream() ? std::nullopt : box_of_index(in.path(), totals->trailing_bytes);
    return report(summary->info, totals, {box, {}});
  }
  Spool spool(spool_directory(*this), spool_memory(*this));
  const auto mesh = in.open(spool, line.callback());
  InfoExtent extent = measure_extent(*mesh, ranges, line.callback());
  return report(summary ? summary->info : mesh->info(), totals, std::move(extent));
}

ExitCode InfoCommand::run() {
  ProgressLine line(*this);
  std::string text;
  ToolInput in(*this);
  if (!in.is_stream() && !in.is_series() && is_archive(in.path())) {
    ArchiveFile archive(in.path());
    std::vector<MemberSummary> members;
    for (const ArchiveMember& member : archive.members())
      members.push_back({member.name, archive.summarize(member)});
    text = (json ? archive_json : archive_text)(input, members);
  } else {
    text = of_mesh(in, line);
  }
  line.wipe();
  std::fputs(text.c_str(), stdout);
  return kDone;
}

}  // namespace shm::converters
