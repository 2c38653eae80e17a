#include "tool/drawing/preview.h"

#include <CLI/CLI.hpp>
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <string_view>
#include <vector>

#include "base/failure.h"
#include "base/output_file.h"
#include "base/text_input.h"
#include "picture/picture.h"
#include "picture/png.h"
#include "tool/input.h"
#include "tool/progress_line.h"
#include "tool/report.h"
#include "tool/running/options.h"
#include "tool/shown/boundary.h"
#include "tool/shown/shown_boundary.h"

namespace shm::converters {
namespace {

// --- values of options

// Parses exactly N finite numbers separated by commas. Returns nothing if the text has any other
// form.
template <std::size_t N>
std::optional<std::array<double, N>> numbers_of(std::string_view text) {
  std::array<double, N> numbers{};
  for (std::size_t i = 0; i < N; ++i) {
    const std::size_t comma = text.find(',');
    if ((comma == std::string_view::npos) != (i + 1 == N) ||
        !TextInput::parse(text.substr(0, comma), numbers[i]) || !std::isfinite(numbers[i]))
      return std::nullopt;
    if (comma != std::string_view::npos) text.remove_prefix(comma + 1);
  }
  return numbers;
}

void set_size(const std::string& text, PictureOptions& options) {
  const std::size_t x = text.find('x');
  const auto is_size = [](std::uint32_t pixels) {
    return pixels >= kLeastPixels && pixels <= kMostPixels;
  };
  if (x == std::string::npos ||
      !TextInput::parse(std::string_view(text).substr(0, x), options.width) ||
      !TextInput::parse(std::string_view(text).substr(x + 1), options.height) ||
      !is_size(options.width) || !is_size(options.height))
    wrong_use("--size " + text + ": must be WxH, each " + std::to_string(kLeastPixels) + " to " +
              std::to_string(kMostPixels) + " pixels");
}

PictureOptions picture_options(const PreviewCommand& command) {
  PictureOptions options;
  options.edges = command.edges;
  if (!command.size.empty()) set_size(command.size, options);
  if (!command.up.empty()) options.up = static_cast<std::size_t>(command.up[0] - 'x');
  if (command.view.empty()) return options;
  options.view = numbers_of<3>(command.view);
  if (!options.view || *options.view == Vector{0, 0, 0})
    wrong_use("--view " + command.view + ": must be three numbers, X,Y,Z, not all of them 0");
  return options;
}

std::optional<HalfSpace> half_space(const std::string& text) {
  if (text.empty()) return std::nullopt;
  const std::size_t colon = text.find(':');
  const auto normal = numbers_of<3>(std::string_view(text).substr(0, colon));
  const auto most = colon == std::string::npos
                        ? std::nullopt
                        : numbers_of<1>(std::string_view(text).substr(colon + 1));
  if (!normal || !most)
    wrong_use("--clip " + text + ": must be X,Y,Z:D, which keeps x*X + y*Y + z*Z <= D");
  return HalfSpace{*normal, most->front()};
}

// --- reports

std::string preview_json(const PreviewCommand& command, const ShownBoundary& shown,
                         const Picture& picture, std::size_t bytes) {
  return dump({{"input", command.input},
               {"output", command.output},
               {"output_bytes", bytes},
               {"width", picture.image.width},
               {"height", picture.image.height},
               {"covered_pixels", picture.covered},
               {"vertices", shown.boundary.vertex_count()},
               {"faces", shown.only_points ? 0 : shown.boundary.face_count()},
               {"faces_skipped", picture.skipped},
               {"cells_left_out", shown.boundary.left_out},
               {"array", array_json(shown, picture.range)}});
}

std::string preview_text(const PreviewCommand& command, const ShownBoundary& shown,
                         const Picture& picture) {
  std::string text = command.output + ": " + std::to_string(picture.image.width) + " x " +
                     std::to_string(picture.image.height) + " pixels, " +
                     std::to_string(picture.covered) + " of them covered by " +
                     (shown.only_points ? plural(shown.boundary.face_count(), "vertex", "vertices")
                                        : plural(shown.boundary.face_count(), "face", "faces"));
  if (picture.skipped > 0) text += " (" + std::to_string(picture.skipped) + " not drawn)";
  if (shown.array) {
    text += "; " + printable(shown.array->name);
    if (shown.array->step) text += " at step " + std::to_string(*shown.array->step);
    text += picture.range ? " from " + legend_number(picture.range->least) + " to " +
                                legend_number(picture.range->greatest)
                          : " has no finite values";
  }
  return text + "\n";
}

std::string legend_name(const ArrayChoice& array) {
  return array.step ? array.name + " @ " + std::to_string(*array.step) : array.name;
}

}  // namespace

CLI::App* PreviewCommand::add_to(CLI::App& tool) {
  CLI::App* command = add_command(
      tool, *this, "preview",
      "Draw a mesh as seen from outside: faces that belong to only one cell, flat cells, lines\n"
      "and points. A mesh without these is drawn as its vertices. Colours show the element\n"
      "blocks, or the values of an array",
      "  shm preview rotor.e.shm                  writes rotor.e.shm.png\n"
      "  shm preview rotor.e -o rotor.png --array temperature@last\n"
      "  shm preview rotor.e.shm -o cut.png --clip 1,0,0:0.5 --array point/v --size 1600x1200\n"
      "\n"
      "JSON: input, output, output_bytes, width, height, covered_pixels (of the mesh), vertices,\n"
      "faces, faces_skipped (without an area, or with a vertex that is not finite), "
      "cells_left_out\n"
      "(of unknown shape), array (name, location, step, least, greatest; or null).");
  add_files(*command, *this, mesh_file_text());
  add_output(*command, *this,
             "Picture to write, or folder for pictures (default: IN.png next to IN)", "OUT.png");
  command->add_option("--size", size, "Pixels across and down, 16 to 4096 (default: 1024x768)")
      ->type_name("WxH");
  command
      ->add_option("--view", view,
                   "Direction from the mesh to the viewer (default: from the front, above and the "
                   "right,\n1,-2,1; along the normal for a mesh in a plane)")
      ->type_name("X,Y,Z");
  command->add_option("--up", up, "Axis that points up in the picture (default: z)")
      ->check(one_of({"x", "y", "z"}))
      ->type_name("x|y|z");
  command
      ->add_option(
          "--array", array,
          "Array to show as colours, with a legend: NAME, point/NAME or cell/NAME; v means "
          "v_x, v_y and\nv_z. Vectors are shown by their length. @STEP is a time step: N (from "
          "0), first or last\n(default: last)")
      ->type_name("NAME[@STEP]");
  command
      ->add_option("--clip", clip,
                   "Draw only cells whose centre satisfies x*X + y*Y + z*Z <= D, to see the inside")
      ->type_name("X,Y,Z:D");
  command->add_flag(
      "--edges", edges,
      "Draw edges around all faces (default: only around faces that are several pixels wide)");
  add_part(*command, *this);
  command->add_flag("--json", json, "Print the report as JSON");
  return command;
}

std::string PreviewCommand::output_beside(const std::string& path) const {
  return path == "-" ? "-" : path + ".png";
}

Places PreviewCommand::places() {
  constexpr std::array<std::string_view, 7> kOthers = {".svg",  ".jpg", ".jpeg", ".gif",
                                                       ".webp", ".pdf", ".shm"};
  if (!can_make_png()) wrong_use("a picture needs libpng; this shm was built without libpng");
  const std::string extension = std::filesystem::path(output).extension().string();
  if (std::find(kOthers.begin(), kOthers.end(), extension) != kOthers.end())
    wrong_use("the name of a picture must end in .png; OUT is " + output);
  if (output == "-" && json) wrong_use("--json and the picture cannot both go to standard output");
  (void)picture_options(*this);
  (void)half_space(clip);
  return {{input}, output, true};
}

ExitCode PreviewCommand::run() {
  ProgressLine line(*this);
  Spool spool(spool_directory(*this), spool_memory(*this), mesh_limits(*this));
  line.show("reading " + input);
  ToolInput in(*this);
  ShownBoundary shown = shown_boundary(*this, in, spool, line,
                                       {.array = array,
                                        .kept = half_space(clip),
                                        .points_instead = true,
                                        .threads = threads,
                                        .next = "drawing"});
  shown.find_inner_edges();
  const Surface surface = shown.surface();
  std::vector<double> values;
  std::optional<Colouring> colouring;
  if (shown.array) {
    values = values_of(shown);
    colouring =
        Colouring{legend_name(*shown.array), shown.array->location == Location::point, values};
  }
  const Picture picture = unwrap(draw_picture(surface, picture_options(*this),
                                              colouring ? &*colouring : nullptr, line.callback()),
                                 input);
  const std::vector<std::byte> png = unwrap(png_of(picture.image), output);
  OutputFile file(output, spool_directory(*this));
  file.write(png);
  file.commit();
  line.wipe();
  if (shown.boundary.left_out > 0)
    print_remark("not in " + output + ": " + plural(shown.boundary.left_out, "cell", "cells") +
                 " of unknown shape");
  if (json)
    std::fputs(preview_json(*this, shown, picture, png.size()).c_str(), stdout);
  else
    print(*this, preview_text(*this, shown, picture));
  return kDone;
}

}  // namespace shm::converters
