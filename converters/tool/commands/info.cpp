#include "tool/commands/info.h"

#include <CLI/CLI.hpp>
#include <cstdio>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "archive/archive_files.h"
#include "base/failure.h"
#include "tool/info_report.h"
#include "tool/input.h"
#include "tool/progress_line.h"
#include "tool/report.h"
#include "tool/running/options.h"

namespace shm::converters {
namespace {

// If a mesh needs at most this number of bytes in memory, its values are read even without
// --ranges, because reading them takes no noticeable time.
constexpr std::uint64_t kSmallBytes = std::uint64_t{8} << 20;

}  // namespace

CLI::App* InfoCommand::add_to(CLI::App& tool) {
  CLI::App* command = add_command(
      tool, *this, "info",
      "List the contents of a mesh; with -v also the size of each stream of a .shm file.\n"
      "For a large .shm file only headers are read, unless --ranges asks for its values.\n"
      "shm verify checks the whole file.",
      "  shm info rotor.e.shm\n"
      "  shm info rotor.e.shm -v                  also codecs, segments and streams\n"
      "  shm info rotor.e.shm --json | jq .streams");
  add_files(*command, *this,
            ".shm file, or mesh of another format (sizes of streams are then not reported).\n"
            "If there are several files, each file gets one line");
  command->add_flag(
      "-v,--verbose", verbose,
      "Also list order, codecs, segments, and the size of each stream in bytes (.shm files)");
  command->add_flag(
      "--ranges", ranges,
      "Read all values and show the range of each array; without --json this is the default\n"
      "for meshes of up to 8 MB");
  command->add_flag("--json", json, "Print as JSON, with all keys even without -v");
  return command;
}

bool InfoCommand::is_small(const MeshInfo& info) const {
  return !json && !is_one_of_many && bytes_of_mesh(info).all() <= kSmallBytes;
}

// Returns the bounding box and the value ranges of a small mesh. If the values cannot be read, the
// rest of the report is still printed. This is not an error, because the user did not request
// ranges.
InfoExtent InfoCommand::extent_of_small(ToolInput& in, const FileSummary& summary,
                                        ProgressLine& line) const {
  try {
    Spool spool(spool_directory(*this), spool_memory(*this), mesh_limits(*this));
    return measure_extent(*in.open(spool, line.callback()), true, line.callback());
  } catch (const Failure&) {
    InfoExtent extent{box_of_index(in.path(), summary.totals.trailing_bytes), {}};
    extent.is_unreadable = true;
    return extent;
  }
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
    if (in.is_stream()) return report(summary->info, totals, {});
    if (is_small(summary->info))
      return report(summary->info, totals, extent_of_small(in, *summary, line));
    return report(summary->info, totals, {box_of_index(in.path(), totals->trailing_bytes), {}});
  }
  Spool spool(spool_directory(*this), spool_memory(*this), mesh_limits(*this));
  const auto mesh = in.open(spool, line.callback());
  InfoExtent extent = measure_extent(*mesh, ranges || is_small(mesh->info()), line.callback());
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
