// shm_spatial_sort: sorts the cells of a mesh with CGAL's spatial sorting and writes the cell
// numbers, one per line. `shm compress --order free --cell-order` reads this file. This is a
// separate program because of CGAL's licence. The exit codes are those of shm: 0 done, 2 usage
// error, 3 bad input, 4 output could not be written.
#include <CGAL/Simple_cartesian.h>
#include <CGAL/Spatial_sort_traits_adapter_3.h>
#include <CGAL/hilbert_sort.h>
#include <CGAL/property_map.h>
#include <CGAL/spatial_sort.h>

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <cstdio>
#include <exception>
#include <filesystem>
#include <numeric>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "base/failure.h"
#include "base/output_file.h"
#include "base/spool.h"
#include "files/mesh_files.h"
#include "mesh/cell_table.h"
#include "mesh/mesh_points.h"

namespace shm::converters {
namespace {

using Kernel = CGAL::Simple_cartesian<double>;
using Point = Kernel::Point_3;

constexpr std::size_t kSpoolBytes = std::size_t{256} << 20;

constexpr const char* kUsage =
    "usage: shm_spatial_sort MESH [-o FILE] [--multiscale]\n"
    "Orders the cells of a mesh along a Hilbert curve through their centres (CGAL, median policy)\n"
    "and writes their numbers, one per line, to FILE or standard output.\n"
    "--multiscale: CGAL's spatial_sort, which puts random samples of growing size first.\n"
    "Then: shm compress MESH --order free --cell-order FILE\n";

struct Options {
  std::string input, output = "-";
  bool multiscale = false;
};

std::vector<Point> centres_of(MeshSource& mesh, const CellTable& cells) {
  std::vector<std::array<double, 3>> points(mesh.info().vertices);
  for_each_point(mesh, [&](std::uint64_t vertex, const auto& point) { points[vertex] = point; });
  std::vector<Point> centres;
  centres.reserve(cells.size());
  for (std::uint32_t cell = 0; cell < cells.size(); ++cell) {
    std::array<double, 3> centre{};
    const auto corners = cells.cell(cell);
    const auto count = static_cast<double>(std::max<std::size_t>(corners.size(), 1));
    for (const std::uint32_t v : corners)
      for (std::size_t c = 0; c < 3; ++c) centre[c] += points[v][c] / count;
    centres.emplace_back(centre[0], centre[1], centre[2]);
  }
  return centres;
}

std::vector<std::size_t> sorted_cells(const std::vector<Point>& centres, bool multiscale) {
  using Map = CGAL::Pointer_property_map<Point>::const_type;
  using Traits = CGAL::Spatial_sort_traits_adapter_3<Kernel, Map>;
  std::vector<std::size_t> order(centres.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  const Traits traits{CGAL::make_property_map(centres)};
  if (multiscale)
    CGAL::spatial_sort(order.begin(), order.end(), traits, CGAL::Hilbert_sort_median_policy());
  else
    CGAL::hilbert_sort(order.begin(), order.end(), traits, CGAL::Hilbert_sort_median_policy());
  return order;
}

std::string lines_of(const std::vector<std::size_t>& order) {
  std::string text;
  for (const std::size_t cell : order) text += std::to_string(cell) + '\n';
  return text;
}

[[noreturn]] void fail(ErrorCode code, const std::string& what, const std::string& file = {}) {
  throw Failure(code, what, file);
}

void write_text(const std::string& text, const std::string& path) {
  if (path != "-") {
    OutputFile output(path);
    output.write(std::as_bytes(std::span(text)));
    output.commit();
  } else if (std::fwrite(text.data(), 1, text.size(), stdout) != text.size() ||
             std::fflush(stdout) != 0) {
    fail(ErrorCode::output, "cannot be written", "standard output");
  }
}

void run(const Options& options) {
  Spool spool(std::filesystem::temp_directory_path().string(), kSpoolBytes);
  const auto mesh = open_mesh(options.input, spool);
  const std::optional<CellTable> cells = CellTable::read(*mesh);
  if (!cells) fail(ErrorCode::over_limit, "has too many cells to be ordered", options.input);
  write_text(lines_of(sorted_cells(centres_of(*mesh, *cells), options.multiscale)), options.output);
}

std::optional<Options> options_of(int argc, char** argv) {
  Options options;
  for (int i = 1; i < argc; ++i) {
    const std::string_view word = argv[i];
    if (word == "--multiscale")
      options.multiscale = true;
    else if (word == "-o" && i + 1 < argc)
      options.output = argv[++i];
    else if (options.input.empty() && !word.starts_with("-"))
      options.input = word;
    else
      return std::nullopt;
  }
  if (options.input.empty()) return std::nullopt;
  return options;
}

}  // namespace
}  // namespace shm::converters

int main(int argc, char** argv) {
  using namespace shm::converters;
  const std::optional<Options> options = options_of(argc, argv);
  if (!options) {
    std::fputs(kUsage, stderr);
    return 2;
  }
  remove_outputs_on_signals();
  try {
    run(*options);
    return 0;
  } catch (const Failure& failure) {
    std::fprintf(stderr, "shm_spatial_sort: %s\n", failure.what());
    return failure.error().code == shm::ErrorCode::output ? 4 : 3;
  } catch (const std::exception& error) {
    std::fprintf(stderr, "shm_spatial_sort: %s: %s\n", options->input.c_str(), error.what());
    return 3;
  }
}
