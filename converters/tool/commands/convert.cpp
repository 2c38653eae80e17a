#include "tool/commands/convert.h"

#include <CLI/CLI.hpp>

#include "base/failure.h"
#include "base/unpacked.h"
#include "formats/conversion.h"
#include "formats/formats.h"
#include "tool/commands/options.h"
#include "tool/input.h"
#include "tool/progress_line.h"
#include "tool/removal.h"
#include "tool/report.h"

namespace shm::converters {

CLI::App* ConvertCommand::add_to(CLI::App& tool) {
  CLI::App* command =
      add_command(tool, *this, "convert", "Write a mesh of any known format in another one",
                  "  shm convert part.msh part.e\n"
                  "  shm convert part.e part.dat --format vtk");
  command->add_option("IN", input, mesh_file_text())->required()->type_name("");
  command->add_option("OUT", output, "File to write")->required()->type_name("");
  add_force(*command, *this);
  add_format(*command, format);
  add_strict(*command, strict);
  add_steps(*command, steps);
  return command;
}

ExitCode ConvertCommand::write(ToolInput& in) {
  if (remove && (steps.time || !steps.words.empty()))
    wrong_use("--rm needs a file that gives all back; --step and --time take some of it");
  const Format& target = output_format(output, format);
  ProgressLine line(*this);
  Spool spool(spool_directory(*this), spool_memory(*this));
  line.expect({{"decoding", 1}, {"writing", 1}}, file_bytes(in.path()));
  line.show("reading " + input);
  const auto mesh = in.open(spool, line.callback(), threads);
  const auto chosen = steps.in(mesh->info().step_times);
  if (chosen && chosen->size() > 1 && holds_one_step(mesh->info(), target, true))
    wrong_use("--step " + steps.words + " is " + std::to_string(chosen->size()) +
              " steps, and a file of " + std::string(target.name) + " holds one");
  Conversion conversion(*mesh, target, chosen, spool);
  WatchedMesh watched(conversion.mesh(), line.callback(), "writing");
  if (!conversion.losses().empty()) {
    line.wipe();
    report_losses(conversion.losses(), output);
    if (strict) return kIncomplete;
  }
  write_mesh(watched, output, target, spool);
  if (remove) {
    if (!conversion.losses().empty())
      throw Failure(Error{ErrorCode::output,
                          "is not removed: " + output + " lacks what is listed",
                          {},
                          kNoOffset,
                          input});
    remove_source(input, output, *this, line.callback());
  }
  line.wipe();
  print(*this, output + ": " + counts_text(watched.info()) + "\n");
  return kDone;
}

Places ConvertCommand::places() {
  return {{input}, output, output_format(output, format).name == "shm"};
}

ExitCode ConvertCommand::run() {
  ToolInput in(*this);
  return write(in);
}

CLI::App* DecompressCommand::add_to(CLI::App& tool) {
  CLI::App* command =
      add_command(tool, *this, "decompress", "Write the mesh of a .shm file in another format",
                  "  shm decompress rotor.e.shm               writes rotor.e\n"
                  "  shm decompress *.shm -o restored         each into the folder restored\n"
                  "  shm decompress part.shm -o part.out --format vtk");
  add_files(*command, *this, ".shm file, - for standard input");
  add_output(*command, *this,
             "File to write, or folder for it (default: what IN was made of, under its name "
             "without .shm)",
             "OUT");
  add_removal(*command, *this);
  add_format(*command, format);
  add_strict(*command, strict);
  add_steps(*command, steps);
  return command;
}

Places DecompressCommand::places() {
  if (to_stdout && format.empty() && input != "-" && is_shm(input))
    format = summarize_shm(input).info.schema.source_format;
  return ConvertCommand::places();
}

bool DecompressCommand::is_for(const Format* of_file) const {
  return of_file != nullptr && of_file->name == "shm";
}

// The name of IN without .shm where that names what is written; else with the usual extension.
std::string DecompressCommand::output_beside(const std::string& path) const {
  constexpr std::string_view kExtension = ".shm";
  std::string name = unpacked_name(path);
  if (name.size() > kExtension.size() && name.ends_with(kExtension))
    name.resize(name.size() - kExtension.size());
  const bool is_readable = path != "-" && unpacked_name(path) == path;
  const Format* written = format_named(format);
  if (written == nullptr && is_readable) {
    require_shm(path);
    written = format_named(summarize_shm(path).info.schema.source_format);
  }
  const Format* const named = format_of_name(name);
  if (path != "-" && name != path && named != nullptr && (written == nullptr || named == written))
    return name;
  if (path == "-" || written == nullptr || written->name == "shm")
    wrong_use("-o names the file to write; " + path + " does not show what it was made of");
  return name + std::string(written->extensions[0]);
}

ExitCode DecompressCommand::run() {
  ToolInput in(*this);
  in.require_shm();
  return write(in);
}

}  // namespace shm::converters
