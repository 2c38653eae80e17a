#include "tool/commands/split.h"

#include <CLI/CLI.hpp>
#include <filesystem>
#include <set>

#include "base/failure.h"
#include "tool/progress_line.h"
#include "tool/running/options.h"

namespace shm::converters {

CLI::App* SplitCommand::add_to(CLI::App& tool) {
  CLI::App* command = add_command(
      tool, *this, "split",
      "Restore the files that shm join put into an archive, each in its own format",
      "  shm split rotor.shm -d pieces\n"
      "  shm split run.shm run.e-s002               only this file, into the current folder\n"
      "  shm split run.shm --packed                 as .shm files");
  command->add_option("IN", input, "Archive made by shm join")->required()->type_name("");
  command->add_option("NAME", members, "Members to restore (default: all)")->type_name("");
  command
      ->add_option("-d,--directory", directory, "Directory to write to (default: the current one)")
      ->check(CLI::Validator(CLI::ExistingDirectory).description(""))
      ->type_name("DIR");
  command->add_flag("--packed", packed, "Write .shm files, without decompressing");
  add_force(*command, *this);
  add_threads(*command, threads, "Decode segments");
  return command;
}

// Returns the path of the file to which a member is written.
std::string SplitCommand::path_of(const ArchiveMember& member) const {
  const std::string path = (std::filesystem::path(directory) / member.name).string();
  return packed && !was_packed(member) ? path + ".shm" : path;
}

ExitCode SplitCommand::run() {
  ArchiveFile archive(input);
  std::vector<ArchiveMember> wanted;
  for (const std::string& name : members) wanted.push_back(archive.find(name));
  if (wanted.empty()) wanted = archive.members();
  std::set<std::string> taken;
  for (const ArchiveMember& member : wanted)
    if (const std::string path = path_of(member); !taken.insert(path).second)
      wrong_use("two members would be written to '" + path + "'; name one of them");
  for (const std::string& path : taken) check_places({{input}, path, packed}, force);
  for (const ArchiveMember& member : wanted) {
    ProgressLine line(*this);
    line.show("writing " + member.name);
    const std::string path = path_of(member);
    if (packed || was_packed(member)) {
      archive.copy(member, path);
    } else {
      Spool spool(temp.empty() ? directory : temp, spool_memory(*this), mesh_limits(*this));
      archive.restore(member, path, spool, line.callback(), threads);
    }
    line.wipe();
    print(*this, path + "\n");
  }
  return kDone;
}

}  // namespace shm::converters
