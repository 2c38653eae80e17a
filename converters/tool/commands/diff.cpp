#include "tool/commands/diff.h"

#include <CLI/CLI.hpp>
#include <cstdio>
#include <memory>
#include <utility>

#include "accuracy/lossy.h"
#include "base/failure.h"
#include "compare/mesh_diff.h"
#include "series/open_series.h"
#include "tool/diff_report.h"
#include "tool/input.h"
#include "tool/progress_line.h"
#include "tool/running/options.h"

namespace shm::converters {
namespace {

std::unique_ptr<MeshSource> open_named(ToolInput& in, Spool& spool, const Progress& progress) {
  try {
    return in.open(spool, progress);
  } catch (const Failure& failure) {
    Error error = failure.error();
    if (error.file.empty() && error.code != ErrorCode::misuse) error.file = in.path();
    throw Failure(std::move(error));
  }
}

constexpr const char* kDiffDescription =
    "Compare two meshes of any formats: list each difference with its size and location";

constexpr const char* kDiffExamples =
    "  shm diff old.e new.e                     exact; exit code 1 if they differ\n"
    "  shm diff old.e new.e --rel 1e-6 --ignore exodus/variable/qa_records\n"
    "  shm diff old.e new.e --abs 1e-9 --array T:rel=0.01 --array coordinates:lossless\n"
    "  shm diff part.msh part.e --match         in any order of vertices and cells\n"
    "  shm diff a.vtk b.vtk --json | jq '.differences[] | {what, different, places}'\n"
    "\n"
    "Exact comparison: numbers of the same type are equal if all their bits are equal (-0.0 is\n"
    "not 0.0); numbers of different types are equal if their values are equal. With a tolerance,\n"
    "NaN equals NaN, -0.0 equals 0.0, and integers must be identical. If the formats differ, only\n"
    "data that both formats can store is compared: mesh, fields and times; a different number\n"
    "type is then only a note. Vertices, cells and steps are numbered from 0.\n"
    "\n"
    "JSON: equal, tolerance, match, a and b (file, format, vertices, cells, blocks, arrays, "
    "steps),\n"
    "matched_vertices, matched_cells, values_compared, values_different, differences, notes. Each\n"
    "difference and note has kind (count, block, type, array, steps, times, coordinates, cells,\n"
    "values, extra, only_in_a, only_in_b, unmatched, not_compared, format), what, a, b (as text),\n"
    "compared, different, largest_difference, largest_relative (null: not finite, or no range), "
    "and\n"
    "places, the largest difference first: element, a, b (numbers), where (x y z), step_a, "
    "step_b,\n"
    "time, component, value_a, value_b, difference.";

}  // namespace

CLI::App* DiffCommand::add_to(CLI::App& tool) {
  CLI::App* const command = add_command(tool, *this, "diff", kDiffDescription, kDiffExamples);
  command->add_option("A", input, "A mesh of any known format")->required()->type_name("");
  command->add_option("B", b, "The mesh to compare A with")->required()->type_name("");
  command
      ->add_option(
          "--abs", abs,
          "Treat coordinates, times and floating-point values that differ by at most E as equal")
      ->type_name("E");
  command
      ->add_option("--rel", rel,
                   "Like --abs, but the bound of an array is E times its range in A over all "
                   "components, blocks\nand steps, and the bound of coordinates is E times the "
                   "longest side of the bounding box")
      ->type_name("E");
  command
      ->add_option("--array", arrays,
                   "Tolerance of one array, or of coordinates, overriding the options above: "
                   "NAME:abs=E,\nNAME:rel=E or NAME:lossless (exact). If several arrays have that "
                   "name, write LOCATION/NAME,\ne.g. point/NAME (locations: point, cell, global, "
                   "node_set, side_set, element_set). May be\nrepeated")
      ->allow_extra_args(false)
      ->type_name("NAME:HOW");
  command->add_option("--only", only, "Compare no arrays other than this one. May be repeated")
      ->allow_extra_args(false)
      ->type_name("NAME");
  command
      ->add_option("--ignore", ignored,
                   "Ignore an array, coordinates, or an extra (or all extras below a path). May be "
                   "repeated")
      ->allow_extra_args(false)
      ->type_name("NAME");
  command->add_flag("--match", match,
                    "Allow any order of vertices and cells, and rotated cells (needs memory):\n"
                    "vertices are matched by position, cells by their vertices");
  command->add_flag("--no-maps", no_maps,
                    "Ignore arrays that are specific to one format: number maps, attributes, tags");
  command->add_flag("--no-extras", no_extras,
                    "Ignore all data except mesh and arrays: sets, titles, names, field data");
  command
      ->add_option("--limit", limit,
                   "Number of locations to list per difference, the largest first (default: 3)")
      ->check(whole_number(0))
      ->type_name("N");
  add_part(*command, *this);
  command->add_flag("--json", json, "Print the report as JSON");
  return command;
}

ExitCode DiffCommand::run() {
  if (abs && rel) wrong_use("--abs and --rel exclude each other");
  DiffOptions options;
  DiffRun as_asked{input, b, "exact", match};
  if (abs) as_asked.tolerance = "abs=" + *abs;
  if (rel) as_asked.tolerance = "rel=" + *rel;
  if (abs || rel)
    options.tolerance.fields = parse_accuracy(as_asked.tolerance, abs ? "--abs" : "--rel");
  options.tolerance.coordinates = options.tolerance.fields;
  for (const std::string& text : arrays) {
    options.tolerance.named.push_back(parse_named_accuracy(text, "--array"));
    as_asked.tolerance += " " + text;
  }
  options.match = match;
  options.with_roles = !no_maps;
  options.with_extras = !no_extras;
  options.only = only;
  options.ignored = ignored;
  options.limit = limit;
  ProgressLine line(*this);
  // With --match the memory limit of the spool is higher, because positions and values are read in
  // random order.
  Spool spool(spool_directory(*this), spool_memory(*this, match), mesh_limits(*this));
  line.show("reading " + input);
  const auto part_in = [&](const std::string& path) {
    return is_archive(path) ? part : std::string();
  };
  if (!part.empty() && part_in(input).empty() && part_in(b).empty())
    wrong_use("--part needs an archive; neither A nor B is one");
  ToolInput in_a(*this, input, part_in(input)), in_b(*this, b, part_in(b));
  const auto mesh_a = open_named(in_a, spool, line.callback());
  const auto mesh_b = open_named(in_b, spool, line.callback());
  const MeshDiff diff = diff_meshes(*mesh_a, *mesh_b, options, spool, line.callback());
  line.wipe();
  if (json)
    std::fputs(diff_json(as_asked, diff).c_str(), stdout);
  else
    print(*this, diff_text(as_asked, diff));
  return diff.equal() ? kDone : kDifferent;
}

}  // namespace shm::converters
