#include "tool/commands/convert.h"

#include <CLI/CLI.hpp>

#include "base/failure.h"
#include "formats/formats.h"
#include "tool/commands/options.h"
#include "tool/input.h"
#include "tool/report.h"
#include "transfer/translate.h"

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
  add_translation(*command, strict, step);
  return command;
}

ExitCode ConvertCommand::write(ToolInput& in) {
  const Format& target = output_format(output, format);
  ProgressLine line(quiet);
  Spool spool(spool_directory(*this), spool_memory(*this));
  line.show("reading " + input);
  const auto mesh = in.open(spool, line.callback(), threads);
  std::optional<Translation> translation;
  if (is_foreign(mesh->info(), target)) {
    translation.emplace(*mesh, std::string(target.name), *target.capabilities, step, spool);
  } else if (step) {
    wrong_use("--step needs a mesh from another format than that of OUT; both are " +
              std::string(target.name));
  }
  MeshSource& written = translation ? translation->mesh() : *mesh;
  if (translation && !translation->losses().empty()) {
    line.wipe();
    report_losses(translation->losses(), output);
    if (strict) return kIncomplete;
  }
  line.show("writing " + output);
  write_mesh(written, output, target, spool);
  line.wipe();
  print(*this, output + ": " + counts_text(written.info()) + "\n");
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
                  "  shm decompress rotor.e.shm -o rotor.e\n"
                  "  shm decompress part.shm -o part.out --format vtk");
  command->add_option("IN", input, ".shm file, - for standard input")->required()->type_name("");
  command->add_option("-o,--output", output, "File to write")->required()->type_name("OUT");
  add_force(*command, *this);
  add_format(*command, format);
  add_translation(*command, strict, step);
  add_threads(*command, threads, "Decode segments");
  return command;
}

ExitCode DecompressCommand::run() {
  ToolInput in(*this);
  in.require_shm();
  return write(in);
}

}  // namespace shm::converters
