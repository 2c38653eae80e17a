// Tests of the boundary surface through the C interface. The surface must equal the surface that
// the C++ library returns, for whole files and for pieces. Invalid calls must return errors.
#include <gtest/gtest.h>

#include <algorithm>
#include <cstddef>
#include <cstring>
#include <map>
#include <set>
#include <string>
#include <vector>

#include "bindings/c_interface.h"
#include "shm/boundary_surface.h"
#include "support/golden_files.h"

namespace shm {
namespace {

struct WantedArrays {
  std::vector<std::uint32_t> arrays;
  std::vector<std::uint64_t> steps;

  shmf_boundary_options options() const {
    shmf_boundary_options own{};
    own.struct_size = sizeof own;
    own.arrays = arrays.data();
    own.steps = steps.empty() ? nullptr : steps.data();
    own.array_count = arrays.size();
    return own;
  }
  BoundaryOptions of_library() const {
    BoundaryOptions own;
    for (std::size_t i = 0; i < arrays.size(); ++i)
      own.arrays.push_back({arrays[i], steps.empty() ? 0 : steps[i]});
    return own;
  }
};

CBoundary found(shmf_file* file, const WantedArrays& wanted = {},
                const shmf_run_options* run = nullptr) {
  shmf_error why{};
  shmf_boundary* boundary = nullptr;
  const shmf_boundary_options options = wanted.options();
  EXPECT_EQ(shmf_find_boundary(file, &options, run, &boundary, &why), SHMF_OK) << why.message;
  return CBoundary(boundary);
}

/// Converts a boundary surface from the type of the C interface to that of the C++ library.
BoundarySurface seen(const shmf_boundary* boundary, std::size_t arrays) {
  shmf_surface told{};
  told.struct_size = sizeof told;
  EXPECT_EQ(shmf_get_surface(boundary, &told, nullptr), SHMF_OK);
  BoundarySurface surface;
  surface.coordinate_type = static_cast<ScalarType>(told.coordinate_type);
  const auto copy = [](auto& to, const void* from, std::uint64_t count) {
    to.resize(count);
    if (count > 0) std::memcpy(to.data(), from, count * sizeof to[0]);
  };
  copy(surface.vertex_numbers, told.vertex_numbers, told.vertices);
  copy(surface.xyz, told.xyz, told.vertices * 3 * scalar_bytes(surface.coordinate_type));
  copy(surface.face_begin, told.face_begin, told.faces + 1);
  copy(surface.corners, told.face_corners, told.corners);
  copy(surface.cell_numbers, told.cell_numbers, told.faces);
  copy(surface.blocks, told.cell_blocks, told.faces);
  copy(surface.sides, told.sides, told.faces);
  surface.arrays.resize(arrays);
  for (std::size_t i = 0; i < arrays; ++i)
    copy(surface.arrays[i], told.array_values[i], told.array_bytes[i]);
  surface.left_out = told.left_out;
  return surface;
}

BoundarySurface expected(std::span<const std::byte> bytes, const WantedArrays& wanted = {}) {
  MemoryRandomSource source(bytes);
  const auto surface = read_boundary(source, wanted.of_library());
  EXPECT_TRUE(surface) << surface.error().message();
  return surface ? *surface : BoundarySurface();
}

const WantedArrays kAll{{0, 1, 2, 3, 4, 5, 5}, {0, 0, 0, 1, 2, 0, 2}};

TEST(CBoundary, IsWhatTheLibraryFinds) {
  for (const Order order : {Order::keep, Order::stream}) {
    const Bytes bytes = two_blocks_file(order, 50);
    const File file = opened(bytes);
    const CBoundary whole = found(file.get(), kAll);
    EXPECT_TRUE(seen(whole.get(), 7) == expected(bytes, kAll));
    EXPECT_GT(seen(whole.get(), 7).face_count(), 100u);
    // Finds the boundary without options.
    shmf_boundary* plain = nullptr;
    ASSERT_EQ(shmf_find_boundary(file.get(), nullptr, nullptr, &plain, nullptr), SHMF_OK);
    const CBoundary owner(plain);
    EXPECT_TRUE(seen(plain, 0) == expected(bytes));
  }
}

TEST(CBoundary, OfEveryGoldenFileIsWhatTheLibraryFinds) {
  for (const auto& path : golden_files()) {
    SCOPED_TRACE(path);
    const std::string bytes = content(path);
    const File file = opened(bytes_of(bytes));
    ASSERT_TRUE(file);
    if (shmf_is_archive(file.get()) != 0) continue;
    const CBoundary boundary = found(file.get());
    ASSERT_TRUE(boundary);
    EXPECT_TRUE(seen(boundary.get(), 0) == expected(bytes_of(bytes)));
  }
}

/// Returns the faces that belong to exactly one of the cells from `first` up to but excluding
/// `end`. Each face is a pair of a cell number and a set of vertices.
std::multiset<std::pair<std::uint64_t, std::set<std::uint64_t>>> counted(const Mesh& mesh,
                                                                         std::uint64_t first,
                                                                         std::uint64_t end) {
  const std::vector<std::vector<std::size_t>> hexahedron = {
      {0, 1, 5, 4}, {1, 2, 6, 5}, {2, 3, 7, 6}, {0, 4, 7, 3}, {0, 3, 2, 1}, {4, 5, 6, 7}};
  const std::vector<std::vector<std::size_t>> wedge = {
      {0, 1, 4, 3}, {1, 2, 5, 4}, {0, 3, 5, 2}, {0, 2, 1}, {3, 4, 5}};
  std::map<std::set<std::uint64_t>, std::vector<std::uint64_t>> cells;
  for (std::uint64_t c = first; c < end; ++c)
    for (const auto& side : mesh.cell_blocks[c] == 1 ? wedge : hexahedron) {
      std::set<std::uint64_t> vertices;
      for (const std::size_t at : side) vertices.insert(mesh.corners[mesh.corner_begin[c] + at]);
      cells[vertices].push_back(c);
    }
  std::multiset<std::pair<std::uint64_t, std::set<std::uint64_t>>> faces;
  for (const auto& [vertices, owners] : cells)
    if (owners.size() == 1) faces.emplace(owners[0], vertices);
  return faces;
}

TEST(CBoundary, OfSelectedCells) {
  const Bytes bytes = two_blocks_file(Order::keep, 50);
  MemorySource source(bytes);
  const auto mesh = read_mesh(source);
  ASSERT_TRUE(mesh);
  const File file = opened(bytes);
  shmf_selection selection{};
  selection.struct_size = sizeof selection;
  for (const auto& [first, end] :
       {std::pair<std::uint64_t, std::uint64_t>(30, 140), {0, mesh->cell_count()}}) {
    selection.first_cell = first;
    selection.end_cell = end;
    ASSERT_EQ(shmf_select(file.get(), &selection, nullptr, nullptr, nullptr), SHMF_OK);
    const CBoundary boundary = found(file.get(), kAll);
    const BoundarySurface surface = seen(boundary.get(), 7);
    std::multiset<std::pair<std::uint64_t, std::set<std::uint64_t>>> faces;
    for (std::size_t f = 0; f < surface.face_count(); ++f) {
      std::set<std::uint64_t> vertices;
      for (std::uint64_t i = surface.face_begin[f]; i < surface.face_begin[f + 1]; ++i)
        vertices.insert(surface.vertex_numbers[surface.corners[i]]);
      faces.emplace(surface.cell_numbers[f], vertices);
    }
    EXPECT_EQ(faces, counted(*mesh, first, end));
    for (std::size_t v = 0; v < surface.vertex_count(); ++v) {
      const std::uint64_t number = surface.vertex_numbers[v];
      EXPECT_EQ(std::memcmp(&surface.xyz[v * 24], &mesh->xyz[number * 24], 24), 0);
      EXPECT_EQ(std::memcmp(&surface.arrays[0][v * 8], &mesh->arrays[0][number * 8], 8), 0);
      EXPECT_EQ(std::memcmp(&surface.arrays[3][v * 16], &mesh->steps[3][1][number * 16], 16), 0);
    }
    for (std::size_t f = 0; f < surface.face_count(); ++f) {
      const std::uint64_t number = surface.cell_numbers[f];
      EXPECT_EQ(surface.blocks[f], mesh->cell_blocks[number]);
      EXPECT_EQ(std::memcmp(&surface.arrays[1][f * 16], &mesh->arrays[1][number * 16], 16), 0);
      EXPECT_EQ(std::memcmp(&surface.arrays[4][f * 8], &mesh->steps[4][2][number * 8], 8), 0);
    }
    // A piece that contains all cells has the same boundary as the file.
    EXPECT_TRUE(first != 0 || surface == expected(bytes, kAll));
  }
}

TEST(CBoundary, OfADamagedFileIsThatOfWhatIsLeft) {
  Bytes bytes = two_blocks_file(Order::keep, 50);
  MemorySource source(bytes);
  const auto mesh = read_mesh(source);
  ASSERT_TRUE(mesh);
  bytes[bytes.size() / 3] ^= std::byte{1};
  shmf_boundary* none = nullptr;
  EXPECT_NE(shmf_find_boundary(opened(bytes).get(), nullptr, nullptr, &none, nullptr), SHMF_OK);
  EXPECT_EQ(none, nullptr);
  const File file = opened(bytes, true);
  const CBoundary boundary = found(file.get(), {{1}, {}});
  const BoundarySurface surface = seen(boundary.get(), 1);
  EXPECT_GT(surface.face_count(), 100u);
  EXPECT_FALSE(surface == expected(two_blocks_file(Order::keep, 50), {{1}, {}}));
  for (std::size_t f = 0; f < surface.face_count(); ++f)
    ASSERT_LT(surface.cell_numbers[f], mesh->cell_count());
}

TEST(CBoundary, RefusesWhatMakesNoSense) {
  const Bytes bytes = two_blocks_file();
  const File file = opened(bytes);
  const auto status_of = [&](const shmf_boundary_options& options, const std::string& word) {
    shmf_boundary* boundary = nullptr;
    shmf_error why{};
    const auto status = shmf_find_boundary(file.get(), &options, nullptr, &boundary, &why);
    EXPECT_EQ(boundary, nullptr);
    EXPECT_NE(std::string(why.message).find(word), std::string::npos) << why.message;
    return status;
  };
  EXPECT_EQ(status_of(WantedArrays{{0, 6}, {}}.options(), "no array 6"), SHMF_MISUSE);
  EXPECT_EQ(status_of(WantedArrays{{3}, {3}}.options(), "no values at step 3"), SHMF_MISUSE);
  auto options = WantedArrays{{0}, {}}.options();
  options.arrays = nullptr;
  EXPECT_EQ(status_of(options, "NULL"), SHMF_MISUSE);
  options = WantedArrays().options();
  options.max_bytes = 1000;
  EXPECT_EQ(status_of(options, "1000 bytes"), SHMF_OVER_LIMIT);
  options.struct_size = 0;
  EXPECT_EQ(status_of(options, "struct_size"), SHMF_MISUSE);
  // A caller that was compiled with an older header passes an options struct with fewer members.
  options = WantedArrays().options();
  options.max_bytes = 1;
  options.struct_size = offsetof(shmf_boundary_options, max_bytes);
  shmf_boundary* made = nullptr;
  ASSERT_EQ(shmf_find_boundary(file.get(), &options, nullptr, &made, nullptr), SHMF_OK);
  const CBoundary boundary(made);
  EXPECT_EQ(shmf_find_boundary(file.get(), nullptr, nullptr, nullptr, nullptr), SHMF_MISUSE);
  EXPECT_EQ(shmf_find_boundary(nullptr, nullptr, nullptr, &made, nullptr), SHMF_MISUSE);
  EXPECT_EQ(made, nullptr);
  EXPECT_EQ(shmf_get_surface(boundary.get(), nullptr, nullptr), SHMF_MISUSE);
  shmf_surface surface{};
  EXPECT_EQ(shmf_get_surface(boundary.get(), &surface, nullptr), SHMF_MISUSE);
  surface.struct_size = sizeof surface;
  EXPECT_EQ(shmf_get_surface(nullptr, &surface, nullptr), SHMF_MISUSE);
  shmf_boundary_free(nullptr);
}

TEST(CBoundary, TellsHowFarItIsAndStops) {
  const Bytes bytes = two_blocks_file(Order::keep, 50);
  const File file = opened(bytes);
  shmf_run_options run{};
  run.struct_size = sizeof run;
  run.threads = 2;
  std::vector<double> told;
  run.context = &told;
  run.progress = [](void* context, double done) {
    static_cast<std::vector<double>*>(context)->push_back(done);
    return 0;
  };
  const CBoundary boundary = found(file.get(), kAll, &run);
  EXPECT_TRUE(seen(boundary.get(), 7) == expected(bytes, kAll));
  ASSERT_GT(told.size(), 2u);
  EXPECT_TRUE(std::is_sorted(told.begin(), told.end()));
  EXPECT_EQ(told.back(), 1);
  run.progress = [](void*, double) { return 1; };
  shmf_boundary* none = nullptr;
  EXPECT_EQ(shmf_find_boundary(file.get(), nullptr, &run, &none, nullptr), SHMF_CANCELLED);
  EXPECT_EQ(none, nullptr);
}

}  // namespace
}  // namespace shm
