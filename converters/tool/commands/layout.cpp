#include "tool/commands/layout.h"

#include <CLI/CLI.hpp>
#include <filesystem>
#include <span>
#include <string>

#include "base/output_file.h"
#include "tool/commands/options.h"
#include "tool/input.h"
#include "tool/layout.h"
#include "tool/progress_line.h"

namespace shm::converters {

CLI::App* LayoutCommand::add_to(CLI::App& tool) {
  CLI::App* command = add_command(
      tool, *this, "layout",
      "Draw how coherently a mesh is stored: vertices down, cells across, a green line\n"
      "from the first to the last use of each vertex",
      "  shm layout rotor.e -o rotor.svg");
  add_files(*command, *this, mesh_file_text());
  add_output(*command, *this,
             "Picture to write, or folder for pictures (default: IN.svg beside IN)", "OUT.svg");
  return command;
}

std::string LayoutCommand::output_beside(const std::string& path) const {
  return path == "-" ? "-" : path + ".svg";
}

Places LayoutCommand::places() { return {{input}, output}; }

ExitCode LayoutCommand::run() {
  ProgressLine line(*this);
  Spool spool(spool_directory(*this), spool_memory(*this));
  line.show("reading " + input);
  ToolInput in(*this);
  const auto mesh = in.open(spool, line.callback());
  const Layout layout = measure_layout(*mesh, spool, line.callback());
  const std::string svg = layout_svg(layout, std::filesystem::path(input).filename().string());
  OutputFile picture(output, spool_directory(*this));
  picture.write(std::as_bytes(std::span(svg)));
  picture.commit();
  line.wipe();
  print(*this, output + ": width " + std::to_string(layout.width) + " of " +
                   std::to_string(layout.vertices) + " vertices, " + std::to_string(layout.cells) +
                   " cells\n");
  return kDone;
}

}  // namespace shm::converters
