#include "tool/drawing/surface.h"

#include <CLI/CLI.hpp>
#include <cstdio>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <vector>

#include "base/failure.h"
#include "base/output_file.h"
#include "openmesh/surface_file.h"
#include "picture/colours.h"
#include "picture/shown_range.h"
#include "tool/input.h"
#include "tool/progress_line.h"
#include "tool/report.h"
#include "tool/running/options.h"
#include "tool/shown/shown_boundary.h"

namespace shm::converters {
namespace {

// Returns the format given by --format. Without --format, the extension of the output determines
// the format; if the output has no extension, the format is PLY.
SurfaceFormat surface_format_of(const SurfaceCommand& command) {
  if (!command.format.empty()) return *surface_format(command.format);
  const std::string extension = std::filesystem::path(command.output).extension().string();
  if (extension.empty()) return SurfaceFormat::ply;
  const auto format = surface_format(std::string_view(extension).substr(1));
  if (!format)
    wrong_use(
        "the name of a surface file must end in .ply, .stl or .obj, unless --format is given; OUT "
        "is " +
        command.output);
  return *format;
}

std::string surface_json(const SurfaceCommand& command, const ShownBoundary& shown,
                         const WrittenSurface& written, const std::optional<ShownRange>& range,
                         std::uint64_t bytes) {
  Json json = {{"input", command.input},
               {"output", command.output},
               {"output_bytes", bytes},
               {"vertices", written.vertices},
               {"faces", written.faces},
               {"triangles_before", nullptr},
               {"vertices_copied", written.copies},
               {"vertices_rounded", written.rounded},
               {"lines_and_points", written.lines_and_points},
               {"faces_collapsed", written.collapsed},
               {"faces_not_finite", written.not_finite},
               {"cells_left_out", shown.boundary.left_out},
               {"array", array_json(shown, range)}};
  if (written.triangles_before > 0) json["triangles_before"] = written.triangles_before;
  return dump(json);
}

std::string surface_text(const SurfaceCommand& command, const WrittenSurface& written) {
  std::string text = command.output + ": " + plural(written.vertices, "vertex", "vertices") + ", " +
                     plural(written.faces, "face", "faces");
  if (written.triangles_before > written.faces)
    text += " of " + plural(written.triangles_before, "triangle", "triangles");
  if (written.copies > 0)
    text += "; " + plural(written.copies, "vertex", "vertices") + " copied to separate faces";
  if (written.rounded > 0)
    text +=
        "; coordinates of " + plural(written.rounded, "vertex", "vertices") + " rounded to float32";
  return text + "\n";
}

// Lists the parts of the surface that could not be written. The list is printed even with --quiet.
void remark_what_is_missing(const SurfaceCommand& command, const ShownBoundary& shown,
                            const WrittenSurface& written) {
  const auto remark = [&](std::uint64_t count, const std::string& one, const std::string& many,
                          const std::string& why) {
    if (count > 0) print_remark("not in " + command.output + ": " + plural(count, one, many) + why);
  };
  remark(shown.boundary.left_out, "cell", "cells", " of unknown shape");
  remark(written.lines_and_points, "line or point", "lines and points", "");
  remark(written.collapsed, "face", "faces", " with fewer than three different vertices");
  remark(written.not_finite, "face", "faces",
         " with a vertex that is not finite or too far away for float32");
  if (command.decimate && written.faces > *command.decimate)
    print_remark("in " + command.output + ": " + plural(written.faces, "face", "faces") +
                 " are left; no more can be removed");
}

}  // namespace

CLI::App* SurfaceCommand::add_to(CLI::App& tool) {
  CLI::App* command = add_command(
      tool, *this, "surface",
      "Write the boundary of a mesh for programs that only know surfaces: the faces that belong\n"
      "to only one cell, and flat cells, as PLY (with the element block of each face), STL or\n"
      "OBJ. Coordinates are rounded to float32",
      "  shm surface rotor.e.shm                  writes rotor.e.shm.ply\n"
      "  shm surface rotor.e -o rotor.ply --array temperature@last\n"
      "  shm surface rotor.e.shm -o rotor.stl --decimate 20000\n"
      "\n"
      "JSON: input, output, output_bytes, vertices, faces, triangles_before (decimation; or "
      "null),\n"
      "vertices_copied (at edges with more than two faces, or with faces of opposite "
      "orientation),\n"
      "vertices_rounded (to float32), lines_and_points, faces_collapsed (fewer than three "
      "different\nvertices), faces_not_finite, cells_left_out (of unknown shape), array (name, "
      "location,\nstep, least, greatest; or null).");
  add_files(*command, *this, mesh_file_text());
  add_output(*command, *this,
             "File to write, or folder for files\n(default: IN.ply, or IN with the extension of "
             "--format, next to IN)",
             "OUT.ply");
  command->add_option("--format", format, "Format of OUT (default: as its name indicates)")
      ->check(one_of({"ply", "stl", "obj"}))
      ->type_name("ply|stl|obj");
  command
      ->add_option(
          "--array", array,
          "Array to show as colours, in PLY only: NAME, point/NAME or cell/NAME; v means v_x, v_y "
          "and\nv_z. Vectors are shown by their length. @STEP is a time step: N (from 0), first or "
          "last\n(default: "
          "last)")
      ->type_name("NAME[@STEP]");
  command
      ->add_option(
          "--decimate", decimate,
          "Reduce the surface to N triangles, with as little change of its shape as possible")
      ->check(whole_number(1))
      ->type_name("N");
  add_part(*command, *this);
  command->add_flag("--json", json, "Print the report as JSON");
  return command;
}

std::string SurfaceCommand::output_beside(const std::string& path) const {
  return path == "-" ? "-" : path + "." + (format.empty() ? "ply" : format);
}

Places SurfaceCommand::places() {
  if (!can_write_surfaces())
    wrong_use("a surface needs OpenMesh; this shm was built without OpenMesh");
  const SurfaceFormat format_of_output = surface_format_of(*this);
  if (!array.empty() && format_of_output != SurfaceFormat::ply)
    wrong_use("--array needs a .ply file: other surfaces have no colours; OUT is " + output);
  if (output == "-" && json) wrong_use("--json and the surface cannot both go to standard output");
  return {{input}, output, true};
}

ExitCode SurfaceCommand::run() {
  ProgressLine line(*this);
  Spool spool(spool_directory(*this), spool_memory(*this), mesh_limits(*this));
  line.show("reading " + input);
  ToolInput in(*this);
  ShownRequest request;
  request.array = array;
  request.threads = threads;
  request.next = decimate ? "decimating" : "joining faces";
  ShownBoundary shown = shown_boundary(*this, in, spool, line, request);

  std::vector<double> values;
  if (shown.array) values = values_of(shown);
  const bool of_points = shown.array && shown.array->location == Location::point;
  put_in_mesh_order(shown.boundary, of_points, values);

  std::optional<ShownRange> range;
  std::vector<Rgb> colours;
  SurfaceColours coloured;
  SurfaceFileOptions options;
  options.format = surface_format_of(*this);
  options.decimate = decimate;
  if (shown.array) {
    range = range_of(values);
    colours.reserve(values.size());
    for (const double value : values) colours.push_back(value_colour(share_of(value, range)));
    coloured = {of_points, colours};
    options.colours = &coloured;
  }
  OutputFile file(output, spool_directory(*this));
  const WrittenSurface written =
      unwrap(write_surface(shown.surface(), options, file.sink(), line.callback()), output);
  const std::uint64_t bytes = file_bytes(file.temporary());
  file.commit();
  line.wipe();
  remark_what_is_missing(*this, shown, written);
  if (json)
    std::fputs(surface_json(*this, shown, written, range, bytes).c_str(), stdout);
  else
    print(*this, surface_text(*this, written));
  return kDone;
}

}  // namespace shm::converters
