#include "tool/drawing/layout.h"

#include <CLI/CLI.hpp>
#include <filesystem>
#include <optional>
#include <span>
#include <string>
#include <system_error>

#include "base/failure.h"
#include "base/output_file.h"
#include "compression/compress.h"
#include "tool/input.h"
#include "tool/layout.h"
#include "tool/progress_line.h"
#include "tool/running/options.h"

namespace shm::converters {
namespace {

// Returns the fraction of the file size that --order free would save, measured on a sample of the
// mesh. Returns nothing if the mesh is too large for a trial.
std::optional<double> saved_in_free_order(MeshSource& mesh, Spool& spool) {
  constexpr std::uint64_t kMostCells = 1 << 19;
  if (mesh.info().cells() > kMostCells) return std::nullopt;
  NullSink nowhere;
  const CompressOptions how;
  const SizeReport sizes = compress_mesh(mesh, nowhere, how, spool);
  const auto free_bytes = bytes_in_free_order(mesh, how, sizes, spool);
  if (!free_bytes || sizes.total_bytes == 0) return std::nullopt;
  return 1 - static_cast<double>(*free_bytes) / static_cast<double>(sizes.total_bytes);
}

}  // namespace

CLI::App* LayoutCommand::add_to(CLI::App& tool) {
  CLI::App* command = add_command(
      tool, *this, "layout",
      "Draw a diagram of how coherently a mesh is stored: it has a row for each vertex and a\n"
      "column for each cell. A green line in each row runs from the first to the last cell that\n"
      "uses the vertex",
      "  shm layout rotor.e                       writes rotor.e.svg, and prints a verdict\n"
      "  shm layout rotor.e -o rotor.png");
  add_files(*command, *this, mesh_file_text());
  add_output(*command, *this,
             "Picture to write, or folder for pictures (default: IN.svg next to IN)",
             "OUT.svg|OUT.png");
  add_part(*command, *this);
  return command;
}

std::string LayoutCommand::output_beside(const std::string& path) const {
  return path == "-" ? "-" : path + ".svg";
}

Places LayoutCommand::places() {
  std::string extension = std::filesystem::path(output).extension().string();
  std::error_code none;
  const bool is_device =
      std::filesystem::exists(output, none) && !std::filesystem::is_regular_file(output, none);
  if (output != "-" && !is_device && extension != ".svg" && extension != ".png")
    wrong_use("the name of a picture must end in .svg or .png; OUT is " + output);
  if (is_png() && !has_png()) wrong_use("a .png needs librsvg, which is not installed");
  return {{input}, output};
}

bool LayoutCommand::is_png() const { return output.ends_with(".png"); }

ExitCode LayoutCommand::run() {
  ProgressLine line(*this);
  Spool spool(spool_directory(*this), spool_memory(*this), mesh_limits(*this));
  line.expect({{"finding last uses", 1}, {"streaming cells", 2}}, 0);
  line.show("reading " + input);
  ToolInput in(*this);
  const auto mesh = in.open(spool, line.callback());
  const Layout layout = measure_layout(*mesh, spool, line.callback());
  const std::string svg = layout_svg(layout, std::filesystem::path(input).filename().string());
  OutputFile picture(output, spool_directory(*this));
  if (is_png())
    picture.write(png_of_svg(svg));
  else
    picture.write(std::as_bytes(std::span(svg)));
  picture.commit();
  const std::optional<double> saved =
      is_scattered(layout) ? saved_in_free_order(*mesh, spool) : std::nullopt;
  line.wipe();
  print(*this, output + ": width " + std::to_string(layout.width) + " of " +
                   std::to_string(layout.vertices) + " vertices, " + std::to_string(layout.cells) +
                   " cells: " + layout_verdict(layout, saved) + "\n");
  return kDone;
}

}  // namespace shm::converters
