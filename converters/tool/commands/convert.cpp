#include "tool/commands/convert.h"

#include <CLI/CLI.hpp>
#include <filesystem>
#include <system_error>

#include "base/failure.h"
#include "base/unpacked.h"
#include "files/mesh_files.h"
#include "formats/formats.h"
#include "series/open_series.h"
#include "series/step_files.h"
#include "tool/commands/split.h"
#include "tool/input.h"
#include "tool/output_name.h"
#include "tool/progress_line.h"
#include "tool/removal.h"
#include "tool/report.h"
#include "tool/running/options.h"
#include "transfer/conversion.h"

namespace shm::converters {

CLI::App* ConvertCommand::add_to(CLI::App& tool) {
  CLI::App* command = add_command(
      tool, *this, "convert", "Convert a mesh from any known format to another one",
      "  shm convert part.msh part.e\n"
      "  shm convert part.e part.dat --format vtk\n"
      "  shm convert run.e 'run_%04d.vtu'           one file per time step\n"
      "  shm convert 'run_%04d.vtu' run.e           and back\n"
      "  shm convert run.e run.pvd                  the same, with the times of the steps\n"
      "  shm convert run.e last.vtk --step last");
  command->add_option("IN", input, mesh_file_text())->required()->type_name("");
  command->add_option("OUT", output, output_text())->required()->type_name("");
  add_force(*command, *this);
  add_format(*command, format);
  add_strict(*command, strict);
  add_steps(*command, steps);
  add_part(*command, *this);
  return command;
}

ExitCode ConvertCommand::write(ToolInput& in) {
  if (remove && (steps.time || !steps.words.empty()))
    wrong_use("--rm needs an output with all time steps; --step and --time select some of them");
  const StepFiles step_files(output, format);
  ProgressLine line(*this);
  Spool spool(spool_directory(*this), spool_memory(*this), mesh_limits(*this));
  line.expect({{"decoding", 1}, {"writing", 1}}, in.bytes());
  line.show("reading " + input);
  const Format* const named = format_of_name(output);
  if (step_files.is_one_file() && named != nullptr && named->name != step_files.format().name &&
      !in.is_stream() && in.is_shm() && !is_archive(in.path())) {
    // Check the output name before the file is decoded, because decoding may take a long time.
    const MeshInfo info = in.summarize(line.callback()).info;
    check_output_name(output, step_files.format(), info, steps.in(info.step_times));
  }
  const auto mesh = in.open(spool, line.callback(), threads);
  return step_files.is_one_file() ? write_one(*mesh, step_files.format(), spool, line)
                                  : write_each(*mesh, step_files, spool, line);
}

// Lists on standard error the data that the output would lack. Returns true if there is such data
// and --strict was given, so that nothing may be written.
bool ConvertCommand::stops_for(const LossList& losses, ProgressLine& line) const {
  if (losses.empty()) return false;
  line.wipe();
  report_losses(losses, output);
  return strict;
}

ExitCode ConvertCommand::write_one(MeshSource& mesh, const Format& target, Spool& spool,
                                   ProgressLine& line) {
  const auto chosen = steps.in(mesh.info().step_times);
  if (chosen && chosen->size() > 1 && holds_one_step(mesh.info(), target, true))
    wrong_use("--step " + steps.words + " selects " + std::to_string(chosen->size()) +
              " steps, but a file of format " + std::string(target.name) +
              " holds one step; a name such as out_%04d writes one file per step");
  // No conversion is needed if the mesh came from the target format, has at most one time step, and
  // the user did not select a step.
  std::optional<Conversion> conversion;
  if (chosen || is_foreign(mesh.info(), target) || mesh.info().step_times.size() > 1)
    conversion.emplace(mesh, target, chosen, spool);
  const LossList losses = conversion ? conversion->losses() : LossList();
  check_output_name(output, target, mesh.info(), chosen, losses);
  if (stops_for(losses, line)) return kIncomplete;
  std::optional<WatchedMesh> watched;
  MeshSource* written = conversion ? &conversion->mesh() : &mesh;
  if (const Progress progress = line.callback())
    written = &watched.emplace(*written, progress, "writing");
  write_mesh(*written, output, target, spool);
  if (keeps_attributes) keep_attributes(input, output);
  if (remove) remove_input(losses, line);
  line.wipe();
  print(*this, output + ": " + counts_text(written->info()) + "\n");
  return kDone;
}

// Implements --rm: removes the input if no data was lost, otherwise throws Failure.
void ConvertCommand::remove_input(const LossList& losses, ProgressLine& line) {
  if (!losses.empty())
    throw Failure(ErrorCode::output, "is not removed: " + output + " lacks the data listed above",
                  input);
  remove_source(input, output, *this, line.callback());
}

// Writes one file per time step. Before it writes the first file, it determines which data any of
// the files would lack.
ExitCode ConvertCommand::write_each(MeshSource& mesh, const StepFiles& step_files, Spool& spool,
                                    ProgressLine& line) {
  MeshInfo info = mesh.info();
  const StepRange range = steps_in_files(info, steps.in(info.step_times));
  LossList losses;
  LossCollector all(&losses);
  for (std::uint64_t step = range.first; step < range.end; ++step) {
    Spool own(spool.directory(), spool.memory_budget(), spool.limits());
    const Conversion conversion(mesh, step_files.format(), step_in_file(info, step), own);
    for (const std::string& loss : conversion.losses()) all.add(loss);
  }
  if (stops_for(losses, line)) return kIncomplete;
  step_files.begin();
  for (std::uint64_t step = range.first; step < range.end; ++step) {
    line.show("writing", step - range.first, range.size());
    // Each file has its own spool (temporary storage), whose disk space is freed when the file is
    // complete.
    Spool own(spool.directory(), spool.memory_budget(), spool.limits());
    Conversion conversion(mesh, step_files.format(), step_in_file(info, step), own);
    write_mesh(conversion.mesh(), step_files.file(step), step_files.format(), own);
  }
  step_files.finish(info, range, spool);
  if (remove) remove_input(losses, line);
  line.wipe();
  if (!info.step_times.empty()) info.step_times.resize(range.size());
  print(*this, step_files.files(range) + ": " + counts_text(info) + "\n");
  return kDone;
}

Places ConvertCommand::places() {
  const StepFiles step_files(output, format);
  return {files_of(input), output, step_files.format().name == "shm", step_files.files_there()};
}

ExitCode ConvertCommand::run() {
  ToolInput in(*this);
  return write(in);
}

CLI::App* DecompressCommand::add_to(CLI::App& tool) {
  CLI::App* command =
      add_command(tool, *this, "decompress",
                  "Write the mesh of a .shm file in its source format or another one",
                  "  shm decompress rotor.e.shm               writes rotor.e\n"
                  "  shm decompress *.shm -o restored         writes each mesh to folder restored\n"
                  "  shm decompress part.shm -o part.out --format vtk");
  add_files(*command, *this, ".shm file, - for standard input");
  add_output(*command, *this,
             output_text() +
                 ". OUT may also be a folder\n(default: IN without .shm, in the source format of "
                 "IN)",
             "OUT");
  add_removal(*command, *this);
  add_format(*command, format);
  add_strict(*command, strict);
  add_steps(*command, steps);
  add_part(*command, *this);
  return command;
}

bool DecompressCommand::is_to_split() const {
  std::error_code none;
  return part.empty() && is_archive(input) && ArchiveFile(input).members().size() > 1 &&
         std::filesystem::is_directory(output, none);
}

Places DecompressCommand::places() {
  splits_ = is_to_split();
  if (splits_) return {{input}, std::nullopt};
  if (to_stdout && format.empty() && input != "-" && is_shm(input) && !is_archive(input))
    format = summarize_shm(input).info.schema.source_format;
  return ConvertCommand::places();
}

bool DecompressCommand::is_for(const Format* of_file) const {
  return of_file != nullptr && of_file->name == "shm";
}

// Returns the name of an output with one file per time step. For VTU files, it is the name of a
// .pvd collection. For other formats, it is a file name with %04d for the step number.
std::string DecompressCommand::name_of_series(const std::string& name, const Format& written) {
  constexpr std::string_view kCollection = ".pvd";
  if (name.ends_with(kCollection)) return name;
  const std::string extension(written.extensions[0]);
  const std::string stem =
      name.ends_with(extension) ? name.substr(0, name.size() - extension.size()) : name;
  return written.name == "vtu" ? stem + std::string(kCollection) : stem + "_%04d" + extension;
}

// Returns the default output for an archive. If the archive has only one member, or --part chooses
// a member, it is the file for this member. Otherwise it is the folder to which all members are
// written.
std::string DecompressCommand::output_of_archive(const std::string& path) const {
  const std::filesystem::path folder = std::filesystem::path(path).parent_path();
  const ArchiveFile archive(path);
  if (part.empty() && archive.members().size() > 1)
    return (folder.empty() ? std::filesystem::path(".") : folder) / "";
  const ArchiveMember& member = part_of(archive.members(), part, path);
  const std::filesystem::path name(member.name);
  return (folder / (was_packed(member) ? name.stem() : name)).string();
}

// Returns the default output path: IN without .shm. If the rest of the name does not end in an
// extension of the output format, the usual extension of the format is added.
std::string DecompressCommand::output_beside(const std::string& path) const {
  constexpr std::string_view kExtension = ".shm";
  std::string name = unpacked_name(path);
  if (name.size() > kExtension.size() && name.ends_with(kExtension))
    name.resize(name.size() - kExtension.size());
  if (is_archive(path)) return output_of_archive(path);
  const bool is_readable = path != "-" && unpacked_name(path) == path;
  const Format* written = format_named(format);
  if (written == nullptr && is_readable) {
    require_shm(path);
    const MeshInfo info = summarize_shm(path).info;
    written = format_named(info.schema.source_format);
    const bool is_series =
        written != nullptr && info.step_times.size() > 1 && holds_one_step(info, *written, false);
    if (is_series) return name_of_series(name, *written);
  }
  const Format* const named = format_of_name(name);
  if (path != "-" && name != path && named != nullptr && (written == nullptr || named == written))
    return name;
  if (path == "-" || written == nullptr || written->name == "shm")
    wrong_use("-o must name the output; " + path + " does not show which format it was made from");
  return name + std::string(written->extensions[0]);
}

ExitCode DecompressCommand::run() {
  if (splits_) {
    if (remove) wrong_use("--rm does not remove archives");
    SplitCommand split;
    static_cast<CommonOptions&>(split) = *this;
    split.directory = output;
    split.threads = threads;
    return split.run();
  }
  keeps_attributes = part.empty();
  ToolInput in(*this);
  in.require_shm();
  return write(in);
}

}  // namespace shm::converters
