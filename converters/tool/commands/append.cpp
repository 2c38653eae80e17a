#include "tool/commands/append.h"

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cstdio>
#include <nlohmann/json.hpp>
#include <utility>

#include "archive/parity.h"
#include "base/failure.h"
#include "base/output_file.h"
#include "formats/formats.h"
#include "interface/format.h"
#include "order/cell_order_file.h"
#include "series/open_series.h"
#include "tool/input.h"
#include "tool/progress_line.h"
#include "tool/report.h"
#include "tool/running/options.h"
#include "tool/step_choice.h"
#include "transfer/conversion.h"

namespace shm::converters {
namespace {

void copy_to(OutputFile& output, const std::string& path) {
  const auto file = unwrap(FileRandomSource::open(path), path);
  unwrap(output.sink().copy(*file, 0, file->size()), path);
  output.commit();
}

// Returns the size of the parity as a fraction of the file size, or nothing if the file has no
// parity. Throws Failure if the file is damaged, because parity that is computed from damaged bytes
// cannot repair the damage.
std::optional<double> parity_to_renew(const std::string& path, const Progress& progress) {
  const auto file = unwrap(FileRandomSource::open(path), path);
  const auto parity = is_whole_file(*file) ? nullptr : ProtectedFile::open(*file);
  if (!parity) return std::nullopt;
  parity->check(progress);
  if (!parity->damaged_blocks().empty())
    throw Failure(Error{.code = ErrorCode::corrupt,
                        .detail = "is damaged; its parity may repair it: shm repair",
                        .section = "parity",
                        .file = path});
  return parity->share();
}

// Returns the schema, counts and time values of the .shm file at `path` if it was made from a
// series of files that had the same format as `more`, the mesh to append. Otherwise returns
// nothing.
std::optional<MeshInfo> series_with(const std::string& path, const MeshInfo& more) {
  const Format* format = format_named(more.schema.source_format);
  if (format == nullptr || !holds_one_step(more, *format, true)) return std::nullopt;
  MeshInfo info = summarize_shm(path).info;
  const bool is_series = !info.step_times.empty() && !source_format(info).describes_steps(info) &&
                         info.schema.source_format == format->name;
  return is_series ? std::optional(std::move(info)) : std::nullopt;
}

}  // namespace

CLI::App* AppendCommand::add_to(CLI::App& tool) {
  CLI::App* command = add_command(
      tool, *this, "append",
      "Add time steps of the same mesh to a .shm file, after its last step. FILE is always\n"
      "complete, either without the new steps or with all of them. Existing data is copied, not\n"
      "encoded again",
      "  shm append run.shm run.e                  the steps of run.e later than the last one in "
      "run.shm\n"
      "  shm append run.shm run.e-s002             output of a restarted run\n"
      "  shm append run.shm run.e --step 4 --step 5\n"
      "  shm append run.shm state7.vtu --time 0.7  one step, from a file that has no time");
  command->add_option("FILE", input, ".shm file with time steps")->required()->type_name("");
  command
      ->add_option("SOURCE", source,
                   mesh_file_text() +
                       ", with the same vertices and cells,\nnumbered as in FILE or as in the mesh "
                       "that FILE was made from, and the same arrays")
      ->required()
      ->type_name("");
  command->add_option("-o,--output", output, "File to write (default: FILE)")->type_name("OUT.shm");
  add_force(*command, *this);
  auto* chosen =
      command
          ->add_option("--step", steps,
                       "Step of SOURCE to append: N (from 0), first, last, or A:B for the steps A "
                       "to B - 1,\nregardless of time. May be repeated (default: all steps later "
                       "than the last one in FILE)")
          ->allow_extra_args(false)
          ->type_name("N|first|last|A:B");
  command->add_flag("--all", all, "Append all steps of SOURCE, regardless of their times")
      ->excludes(chosen);
  command
      ->add_option(
          "--time", time,
          "Time of a SOURCE without time steps (default: its field data TIME or TimeValue)")
      ->type_name("T");
  command
      ->add_option("--key-steps", key_steps,
                   "Make at least one of any N consecutive new steps independent of other steps, "
                   "as compress\ndoes (default: the largest distance between key steps in FILE, "
                   "but at least 8)")
      ->check(whole_number(1, ~std::uint32_t{0}))
      ->type_name("N");
  command->add_option("--level", level, "Level of compression, as for shm compress")
      ->check(one_of({"fast", "default", "best"}))
      ->type_name("fast|default|best");
  command
      ->add_option("--cell-order", cell_order,
                   "Cell order file that was used to compress FILE with --order free")
      ->type_name("FILE");
  command->add_flag("--strict", strict,
                    "Write nothing (exit code 6) if data of SOURCE other than its steps would be "
                    "left out.\nSuch data is listed on standard error in any case");
  add_threads(*command, threads, "Decode segments");
  command->add_flag("--json", json, "Print steps and sizes as JSON");
  return command;
}

AppendHow AppendCommand::how(const MeshInfo& info, const Progress& progress) const {
  AppendHow wanted;
  wanted.all = all;
  // A source without time steps counts as one step.
  const std::uint64_t count = std::max<std::uint64_t>(info.step_times.size(), 1);
  for (const std::string& words : steps) {
    const StepRange range = steps_named(words, count, "SOURCE");
    for (std::uint64_t step = range.first; step < range.end; ++step) wanted.steps.push_back(step);
  }
  wanted.time = time;
  wanted.strict = strict;
  wanted.options.level = level_of(level);
  wanted.options.key_steps = key_steps;
  wanted.threads = threads;
  wanted.progress = progress;
  return wanted;
}

std::string AppendCommand::json_of(const AppendOutcome& outcome) const {
  nlohmann::json fields;
  fields["file"] = input;
  fields["source"] = source;
  fields["output"] = output;
  fields["appended_steps"] = outcome.steps;
  fields["step_times"] = outcome.times;
  if (outcome.sizes) {
    fields["bytes"] = outcome.sizes->total_bytes;
    fields["streams"] = outcome.sizes->streams;
  }
  return json_text(fields);
}

std::string AppendCommand::text_of(const AppendOutcome& outcome) const {
  if (outcome.steps.empty())
    return input + ": " + source + " has no later time step; nothing to do\n";
  const std::size_t fresh = outcome.steps.size(), in_all = outcome.times.size();
  return output + ": " + std::to_string(fresh) + (fresh == 1 ? " time step" : " time steps") +
         " added, " + std::to_string(in_all) + " in all, " +
         std::to_string(outcome.sizes->total_bytes) + " bytes\n";
}

ExitCode AppendCommand::report_differences(const AppendOutcome& outcome) const {
  std::fprintf(stderr, "shm: %s does not contain the mesh of %s:\n", source.c_str(), input.c_str());
  for (const std::string& difference : outcome.differences)
    std::fprintf(stderr, "shm:   %s\n", difference.c_str());
  return kDifferent;
}

Places AppendCommand::places() {
  if (output.empty()) return {};  // the file is changed in place
  Places places{files_of(source), output, true};
  places.inputs.insert(places.inputs.end(), {input, cell_order});
  return places;
}

ExitCode AppendCommand::run() {
  if (output == "-" && json)
    wrong_use("--json and the .shm file cannot both go to standard output");
  require_shm(input);
  require_no_archive(input);
  if (output.empty()) output = input;
  ProgressLine line(*this);
  Spool spool(spool_directory(*this), spool_memory(*this), mesh_limits(*this));
  line.show("reading " + source);
  ToolInput in(*this, source);
  auto mesh = in.open(spool, line.callback(), threads);
  if (const auto series = series_with(input, mesh->info())) {
    if (mesh->info().step_times.empty()) {
      mesh = series_of_one(std::move(mesh), {source, time}, spool);
      time.reset();
    }
    mesh = stepped_like(std::move(mesh), *series);
  }
  AppendHow wanted = how(mesh->info(), line.callback());
  std::optional<CellSequence> given_order;
  if (!cell_order.empty())
    wanted.cell_order = &given_order.emplace(read_cell_order(cell_order, mesh->info().cells()));
  const auto share = parity_to_renew(input, line.callback());
  OutputFile file(output, spool_directory(*this));
  const AppendOutcome outcome = append_steps(input, *mesh, file.sink(), wanted, spool);
  line.wipe();
  if (!outcome.differences.empty()) return report_differences(outcome);
  report_losses(outcome.losses, output);
  if (outcome.sizes) {
    if (share) protect(file, *share, line.callback());
    file.commit();
  } else if (!outcome.losses.empty())
    return kIncomplete;
  else if (output != input)
    copy_to(file, input);  // SOURCE has no new steps: the output is a copy of the file.
  if (json)
    std::fputs(json_of(outcome).c_str(), stdout);
  else
    print(*this, text_of(outcome));
  return kDone;
}

}  // namespace shm::converters
