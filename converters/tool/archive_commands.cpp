#include "tool/archive_commands.h"

#include <cstdio>
#include <filesystem>
#include <set>
#include <string>
#include <vector>

#include "archive/archive_files.h"
#include "base/failure.h"
#include "base/output_file.h"
#include "compare/compare.h"
#include "formats/formats.h"
#include "tool/report.h"

namespace shm::converters {
namespace {

// The file that a member was made of, in the directory --against.
std::string source_of_member(const ArchiveMember& member, const std::string& directory) {
  const std::filesystem::path path = std::filesystem::path(directory) / member.name;
  return was_packed(member) && !std::filesystem::exists(path)
             ? std::filesystem::path(path).replace_extension().string()
             : path.string();
}

// Where split writes a member.
std::string path_of_member(const ArchiveMember& member, const Options& options) {
  const std::string path = (std::filesystem::path(options.directory) / member.name).string();
  return options.packed && !was_packed(member) ? path + ".shm" : path;
}

}  // namespace

ExitCode verify_archive(const Options& options) {
  if (!options.against.empty() && !std::filesystem::is_directory(options.against))
    wrong_use("--against of an archive is the directory of the files that it was made of");
  if (!options.cell_order.empty()) wrong_use("--cell-order is not for archives");
  ArchiveFile archive(options.input);
  ExitCode code = kDone;
  for (const ArchiveMember& member : archive.members()) {
    ProgressLine line(options.quiet);
    Spool spool(spool_directory(options), spool_memory(options));
    const auto restored = archive.open(member, spool, line.callback(), options.threads);
    const std::string place = archive.place(member);
    if (options.against.empty()) {
      line.wipe();
      if (options.json)
        std::fputs(sound_json(place, restored->info(), {}).c_str(), stdout);
      else
        say(options, place + ": sound, " + counts_text(restored->info()) + "\n");
      continue;
    }
    const std::string against = source_of_member(member, options.against);
    const auto source = open_mesh(against, spool, line.callback());
    const CompareReport report = compare_meshes(*source, *restored, spool, line.callback());
    line.wipe();
    if (options.json)
      std::fputs(compare_json(report, against, place, restored->info()).c_str(), stdout);
    else
      say(options, compare_text(report, against, place));
    if (!report.equal()) code = kDifferent;
  }
  return code;
}

ExitCode run_join(Options& options) {
  CompressOptions how;
  how.order = order_of(options.order);
  how.level = level_of(options.level);
  how.threads = options.threads;
  ProgressLine line(options.quiet);
  how.progress = line.callback();
  OutputFile output(options.output);
  FileSink& sink = output.sink();
  const auto members =
      join_files(options.inputs, sink, how, spool_directory(options), spool_memory(options));
  output.commit();
  line.wipe();
  const std::uint64_t bytes = file_bytes(options.output);
  if (options.json)
    std::fputs(join_json(options.output, bytes, members).c_str(), stdout);
  else
    say(options, join_text(options.output, bytes, members));
  return kDone;
}

ExitCode run_split(Options& options) {
  ArchiveFile archive(options.input);
  std::vector<ArchiveMember> wanted;
  for (const std::string& name : options.members) wanted.push_back(archive.find(name));
  if (wanted.empty()) wanted = archive.members();
  std::set<std::string> taken;
  for (const ArchiveMember& member : wanted)
    if (const std::string path = path_of_member(member, options); !taken.insert(path).second)
      wrong_use("two members would be written to '" + path + "'; name one of them");
  for (const ArchiveMember& member : wanted) {
    ProgressLine line(options.quiet);
    line.show("writing " + member.name);
    const std::string path = path_of_member(member, options);
    if (options.packed || was_packed(member)) {
      archive.copy(member, path);
    } else {
      Spool spool(options.temp.empty() ? options.directory : options.temp, spool_memory(options));
      archive.restore(member, path, spool, line.callback(), options.threads);
    }
    line.wipe();
    say(options, path + "\n");
  }
  return kDone;
}

}  // namespace shm::converters
