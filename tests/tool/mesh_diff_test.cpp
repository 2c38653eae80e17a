// Tests of the differences between two meshes. Each kind of change must be found at the correct
// position, and no other differences may be reported, even if vertices and cells are in another
// order.
#include "compare/mesh_diff.h"

#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <limits>
#include <map>
#include <set>

#include "base/failure.h"
#include "base/stored_value.h"
#include "compare/mesh_match.h"
#include "compare/point_tree.h"
#include "compare/values.h"
#include "mesh/cell_keys.h"
#include "mesh/cell_rotations.h"
#include "mesh/coding_order.h"
#include "support/memory_mesh.h"
#include "tool/diff_report.h"

namespace shm::converters {
namespace {

MeshDiff diff(MeshSource& a, MeshSource& b, const DiffOptions& options = {}) {
  Spool spool(::testing::TempDir());
  return diff_meshes(a, b, options, spool);
}

DiffOptions within(const Accuracy& accuracy) {
  DiffOptions options;
  options.tolerance.fields = options.tolerance.coordinates = accuracy;
  return options;
}

DiffOptions matching(DiffOptions options = {}) {
  options.match = true;
  return options;
}

std::string words(const MeshDiff& result) { return diff_text({"A", "B", "exact", false}, result); }

template <class T>
void set_value(std::vector<std::byte>& bytes, std::size_t index, T value) {
  std::memcpy(bytes.data() + index * sizeof(T), &value, sizeof(T));
}

// Returns the same mesh with vertices and cells in another order, and with the corners of cells
// rotated.
MemoryMesh in_another_order(const MemoryMesh& mesh, unsigned seed, bool turned = true) {
  std::mt19937 random(seed);
  MemoryMesh other = mesh;
  const auto shuffled = [&](std::size_t size) {  // new positions by old positions
    std::vector<std::size_t> place(size);
    std::iota(place.begin(), place.end(), 0);
    std::shuffle(place.begin(), place.end(), random);
    return place;
  };
  const auto move = [](const std::vector<std::byte>& values,
                       const std::vector<std::size_t>& place) {
    std::vector<std::byte> moved(values.size());
    const std::size_t stride = place.empty() ? 0 : values.size() / place.size();
    for (std::size_t i = 0; i < place.size(); ++i)
      std::memcpy(moved.data() + place[i] * stride, values.data() + i * stride, stride);
    return moved;
  };
  const auto vertex = shuffled(mesh.mesh.vertices), cell = shuffled(mesh.cells.size());
  other.points = move(mesh.points, vertex);
  for (std::size_t c = 0; c < cell.size(); ++c) {
    const CellShape shape = mesh.mesh.schema.blocks[mesh.cell_blocks[c]].shape;
    const auto& old = mesh.cells[c];
    auto& fresh = other.cells[cell[c]];
    fresh = old;
    const auto& turns = rotations_of(shape, old.size());
    if (turned && !turns.empty()) {
      const Rotation& turn = turns[random() % turns.size()];
      for (std::size_t i = 0; i < old.size(); ++i) fresh[i] = old[turn[i]];
    }
    if (turned && rotates_by_counting(shape))
      std::rotate(fresh.begin(), fresh.begin() + static_cast<std::ptrdiff_t>(random() % old.size()),
                  fresh.end());
    for (auto& v : fresh) v = vertex[v];
    other.cell_blocks[cell[c]] = mesh.cell_blocks[c];
  }
  for (std::size_t a = 0; a < mesh.arrays.size(); ++a) {
    std::vector<std::size_t> place = vertex;
    if (mesh.mesh.schema.arrays[a].location == Location::cell) {
      std::vector<std::size_t>
          covered;  // new numbers of the cells that the array covers, in the old cell order
      for (std::size_t c = 0; c < cell.size(); ++c)
        if (mesh.mesh.schema.array_covers(a, mesh.cell_blocks[c])) covered.push_back(cell[c]);
      std::vector<std::size_t> ranks = covered;
      std::sort(ranks.begin(), ranks.end());
      place.clear();
      for (const std::size_t c : covered)
        place.push_back(static_cast<std::size_t>(std::lower_bound(ranks.begin(), ranks.end(), c) -
                                                 ranks.begin()));
    }
    for (std::size_t s = 0; s < mesh.arrays[a].size(); ++s)
      other.arrays[a][s] = move(mesh.arrays[a][s], place);
  }
  for (Extra& extra : other.mesh.extras) {
    Renumbering to;
    to.vertices = vertex.size();
    to.cells = cell.size();
    to.vertex = [&](std::uint64_t v) { return vertex[v]; };
    to.cell = [&](std::uint64_t c) { return cell[c]; };
    extra = renumbered(std::move(extra), to);
  }
  return other;
}

TEST(StoredValue, ExactMeansBitsOrTheSameNumber) {
  const auto unlike = [](auto a, ScalarType type_a, auto b, ScalarType type_b,
                         const Likeness& likeness) {
    return distance_of_unlike(reinterpret_cast<const std::byte*>(&a), type_a,
                              reinterpret_cast<const std::byte*>(&b), type_b, likeness);
  };
  constexpr auto kDouble = ScalarType::float64, kFloat = ScalarType::float32;
  constexpr auto kLong = ScalarType::int64, kUnsigned = ScalarType::uint64;
  const double nan = std::numeric_limits<double>::quiet_NaN();
  const double inf = std::numeric_limits<double>::infinity();
  const Likeness exact, tolerant{true, 0.5};
  EXPECT_EQ(unlike(0.0, kDouble, -0.0, kDouble, exact), 0.0);
  EXPECT_FALSE(unlike(0.0, kDouble, -0.0f, kFloat, exact));
  EXPECT_FALSE(unlike(0.0, kDouble, -0.0, kDouble, tolerant));
  EXPECT_EQ(unlike(nan, kDouble, -nan, kDouble, exact), 0.0);
  EXPECT_FALSE(unlike(nan, kDouble, -nan, kDouble, tolerant));
  EXPECT_EQ(unlike(nan, kDouble, 1.0, kDouble, tolerant), inf);
  EXPECT_EQ(unlike(inf, kDouble, -inf, kDouble, tolerant), inf);
  EXPECT_FALSE(unlike(inf, kDouble, inf, kDouble, tolerant));
  EXPECT_FALSE(unlike(1.0, kDouble, 1.5, kDouble, tolerant));
  EXPECT_TRUE(unlike(1.0, kDouble, std::nextafter(1.5, 2.0), kDouble, tolerant));
  EXPECT_FALSE(unlike(0.5, kDouble, 0.5f, kFloat, exact));
  EXPECT_TRUE(unlike(0.1, kDouble, 0.1f, kFloat, exact));
  const std::int64_t large = (std::int64_t{1} << 53) + 1;
  EXPECT_TRUE(unlike(large, kLong, 0x1p53, kDouble, exact)) << "the double nearest to it";
  EXPECT_EQ(unlike(large, kLong, large + 3, kLong, exact), 3.0);
  EXPECT_EQ(unlike(std::int64_t{-1}, kLong, ~std::uint64_t{0}, kUnsigned, exact), 0x1p64);
  EXPECT_TRUE(unlike(std::int64_t{1}, kLong, std::int64_t{2}, kLong, Likeness{true, 5}))
      << "integers are not rounded";
  EXPECT_FALSE(unlike(std::int64_t{1}, kLong, 1.25, kDouble, tolerant));
}

TEST(MeshDiff, EqualToItself) {
  MemoryMesh a = rich_mesh(), b = rich_mesh();
  b.most_at_once = 7;
  const MeshDiff plain = diff(a, b);
  EXPECT_TRUE(plain.equal()) << words(plain);
  EXPECT_GT(plain.values_compared, a.mesh.vertices * 3);
  const MeshDiff matched = diff(a, b, matching());
  EXPECT_TRUE(matched.equal()) << words(matched);
  EXPECT_EQ(matched.matched_vertices, a.mesh.vertices);
  EXPECT_EQ(matched.matched_cells, a.cells.size());
}

struct Change {
  const char* kind;
  const char* what;
  std::function<void(MemoryMesh&)> change;
  std::uint64_t element = 0;  // element of the first difference
};

const std::vector<Change>& changes() {
  static const std::vector<Change> all{
      {"coordinates", "coordinates", [](MemoryMesh& m) { m.points[12 * 24 + 8] ^= std::byte{1}; },
       12},
      {"cells", "cells", [](MemoryMesh& m) { std::swap(m.cells[5][0], m.cells[5][1]); }, 5},
      {"type", "coordinates",
       [](MemoryMesh& m) {
         std::vector<float> narrow;
         for (std::size_t at = 0; at < m.points.size(); at += 8)
           narrow.push_back(static_cast<float>(load<double>(m.points.data() + at)));
         m.points = bytes_of(narrow);
         m.mesh.schema.coordinate_type = ScalarType::float32;
       }},
      {"values", "array 'point/tag'", [](MemoryMesh& m) { m.arrays[0][0][9 * 8] ^= std::byte{1}; },
       9},
      {"values", "array 'point/heat'", [](MemoryMesh& m) { m.arrays[2][2][7] ^= std::byte{1}; }, 0},
      {"values", "array 'cell/mark'", [](MemoryMesh& m) { m.arrays[3][0][77] ^= std::byte{1}; },
       77},
      // Element 3 of the array on blocks 0 and 2 belongs to cell 3. Cell 4 is the first wedge.
      {"values", "array 'cell/level'", [](MemoryMesh& m) { m.arrays[4][0][14] ^= std::byte{1}; },
       3},
      {"values", "array 'cell/stress'", [](MemoryMesh& m) { m.arrays[5][1][0] ^= std::byte{1}; },
       4},
      {"only_in_a", "array 'point/tag'",
       [](MemoryMesh& m) {
         m.mesh.schema.arrays.erase(m.mesh.schema.arrays.begin());
         m.arrays.erase(m.arrays.begin());
       }},
      {"only_in_b", "array 'cell/new'",
       [](MemoryMesh& m) {
         m.add_array<double>({"new", Location::cell, ScalarType::float64, 1, false, {}, "", {}},
                             {std::vector<double>(m.cells.size())});
       }},
      {"array", "array 'point/normal'",
       [](MemoryMesh& m) {
         m.mesh.schema.arrays[1].components = 1;
         m.arrays[1][0].resize(m.mesh.vertices * 4);
       }},
      {"block", "block 1", [](MemoryMesh& m) { m.mesh.schema.blocks[1].name = "other"; }},
      {"times", "times", [](MemoryMesh& m) { m.mesh.step_times[1] = 0.26; }, 1},
      {"extra", "extra 'test/title'",
       [](MemoryMesh& m) { m.mesh.extras[2].data[0] = std::byte{'j'}; }},
      {"extra", "extra 'test/picked/cells'",
       [](MemoryMesh& m) { m.mesh.extras[1].data[8] = std::byte{2}; }},
      {"only_in_a", "extra 'test/title'", [](MemoryMesh& m) { m.mesh.extras.pop_back(); }},
  };
  return all;
}

TEST(MeshDiff, FindsEachChangeAndNothingElse) {
  for (const Change& test : changes()) {
    MemoryMesh a = rich_mesh(), b = rich_mesh();
    test.change(b);
    const MeshDiff found = diff(a, b);
    const bool type_only = std::string(test.kind) == "type";  // also rounds
    ASSERT_EQ(found.differences.size(), type_only ? 2u : 1u) << test.what << "\n" << words(found);
    EXPECT_EQ(found.differences[0].kind, test.kind) << words(found);
    EXPECT_EQ(found.differences[0].what, test.what);
    if (found.differences[0].places.empty()) continue;
    EXPECT_EQ(found.differences[0].different, 1u) << words(found);
    EXPECT_EQ(found.differences[0].places[0].a, test.element) << words(found);
  }
}

TEST(MeshDiff, FindsEachChangeInAnotherOrder) {
  for (const Change& test : changes()) {
    MemoryMesh a = rich_mesh(), changed = rich_mesh();
    test.change(changed);
    if (std::string(test.kind) == "type") continue;  // all places differ
    MemoryMesh b = in_another_order(changed, 3);
    const MeshDiff found = diff(a, b, matching());
    ASSERT_EQ(found.differences.size(), 1u) << test.what << "\n" << words(found);
    EXPECT_EQ(found.differences[0].kind, test.kind) << words(found);
    EXPECT_EQ(found.differences[0].what, test.what);
    if (found.differences[0].places.empty()) continue;
    EXPECT_EQ(found.differences[0].places[0].a, test.element) << words(found);
  }
}

TEST(MeshDiff, TellsHowMuchAndWhere) {
  MemoryMesh a = rich_mesh(), b = rich_mesh();
  const std::uint64_t last = a.mesh.vertices - 1;
  set_value(b.arrays[2][1], 20, 11.5);   // 11 in A
  set_value(b.arrays[2][2], last, 1e3);  // the largest
  set_value(b.arrays[2][2], 3, 3.0);     // 3.5 in A
  DiffOptions options;
  options.limit = 2;
  const MeshDiff found = diff(a, b, options);
  ASSERT_EQ(found.differences.size(), 1u) << words(found);
  const Finding& heat = found.differences[0];
  EXPECT_EQ(heat.different, 3u);
  EXPECT_EQ(heat.compared, 3 * a.mesh.vertices);
  const double value = static_cast<double>(last) * 0.5 + 2;
  EXPECT_EQ(heat.largest, 1e3 - value);
  EXPECT_EQ(heat.relative, (1e3 - value) / value) << "values run from 0";
  ASSERT_EQ(heat.places.size(), 2u);
  const DiffPlace& place = heat.places[0];
  EXPECT_EQ(place.element, "vertex");
  EXPECT_EQ(place.a, last);
  EXPECT_EQ(place.step_a, 2u);
  EXPECT_EQ(place.time, 0.5);
  EXPECT_EQ(place.value_b, "1000");
  ASSERT_TRUE(place.where);
  for (std::size_t c = 0; c < 3; ++c)
    EXPECT_EQ((*place.where)[c], load<double>(a.points.data() + last * 24 + c * 8));
  EXPECT_EQ(heat.places[1].a, 20u);
}

TEST(MeshDiff, OtherCountsAreToldAndWhatIsLeftCompared) {
  MemoryMesh a = rich_mesh(), b = rich_mesh();
  b.add_point(7, 7, 7);
  for (const std::size_t array : {0u, 1u, 2u})
    for (auto& step : b.arrays[array]) step.resize(step.size() + b.mesh.array_stride(array));
  MeshDiff found = diff(a, b);
  EXPECT_EQ(found.differences[0].kind, "count");
  EXPECT_GT(found.values_compared, 0u) << "cell arrays";
  found = diff(a, b, matching());
  ASSERT_EQ(found.differences.size(), 2u) << words(found);
  EXPECT_EQ(found.differences[1].kind, "unmatched");
  EXPECT_EQ(found.differences[1].what, "vertices of B");
  EXPECT_EQ(found.differences[1].places[0].b, a.mesh.vertices);
}

TEST(MeshDiff, Tolerances) {
  MemoryMesh a = rich_mesh(), b = rich_mesh();
  const double range = static_cast<double>(a.mesh.vertices - 1) * 0.5 + 2;
  set_value(b.arrays[2][0], 0, 1e-3 * range);
  EXPECT_TRUE(diff(a, b, within(Accuracy::absolute(1e-3 * range))).equal());
  EXPECT_FALSE(diff(a, b, within(Accuracy::absolute(0.99e-3 * range))).equal());
  EXPECT_TRUE(diff(a, b, within(Accuracy::relative(1e-3))).equal());
  EXPECT_FALSE(diff(a, b, within(Accuracy::relative(0.99e-3))).equal());
  DiffOptions options = within(Accuracy::absolute(1e-9));
  options.tolerance.named = {{"heat", Accuracy::relative(1e-3)}};
  EXPECT_TRUE(diff(a, b, options).equal());
  options.tolerance.named = {{"point/heat", {}}};
  EXPECT_FALSE(diff(a, b, options).equal());
  options = {};
  options.ignored = {"heat"};
  EXPECT_TRUE(diff(a, b, options).equal());
  options.ignored = {};
  options.only = {"tag", "mark"};
  EXPECT_TRUE(diff(a, b, options).equal());
  options.only = {"heat"};
  EXPECT_FALSE(diff(a, b, options).equal());
  for (const auto set : {&DiffOptions::only, &DiffOptions::ignored}) {
    DiffOptions wrong;
    wrong.*set = {"no such"};
    EXPECT_THROW(diff(a, b, wrong), Failure);
  }
}

// A relative tolerance of coordinates is relative to the longest side of the bounding box of A.
TEST(MeshDiff, RelativeTolerancesOfCoordinates) {
  MemoryMesh a = grid_mesh(4, 4, 4), b = grid_mesh(4, 4, 4);
  const std::size_t at = 5 * 24;
  const double x = load<double>(a.points.data() + at);
  set_value(b.points, 15, x + .003);
  ValueRange range(3);
  range.add(a.points.data(), a.mesh.vertices, ScalarType::float64);
  const double relative = .003 / range.largest_side();
  EXPECT_TRUE(diff(a, b, within(Accuracy::relative(relative * 1.01))).equal());
  EXPECT_FALSE(diff(a, b, within(Accuracy::relative(relative * .99))).equal());
  EXPECT_NEAR(diff(a, b).differences[0].relative.value(), relative, relative / 100);
}

TEST(MeshDiff, CornersOfDifferentCellsAreListed) {
  const MemoryMesh a = grid_mesh(2, 2, 2);
  MemoryMesh b = a;
  std::swap(b.cells[5][0], b.cells[5][1]);
  const auto corners = [](const MemoryMesh& mesh) {
    std::string text;
    for (const std::uint64_t corner : mesh.cells[5])
      text += (text.empty() ? "corners (" : " ") + std::to_string(corner);
    return text + ")";
  };
  MemoryMesh one = a;
  const MeshDiff found = diff(one, b);
  ASSERT_EQ(found.differences.size(), 1u) << words(found);
  EXPECT_EQ(found.differences[0].places[0].value_a, corners(a));
  EXPECT_EQ(found.differences[0].places[0].value_b, corners(b));
}

TEST(MeshDiff, RolesAndExtrasCanBeLeftOut) {
  MemoryMesh a = rich_mesh(), b = rich_mesh();
  b.arrays[0][0][0] ^= std::byte{1};
  b.mesh.extras[2].data[0] ^= std::byte{1};
  EXPECT_EQ(diff(a, b).differences.size(), 2u);
  DiffOptions options;
  options.with_roles = options.with_extras = false;
  EXPECT_TRUE(diff(a, b, options).equal());
  options = {};
  options.ignored = {"test/title", "tag"};
  EXPECT_TRUE(diff(a, b, options).equal());
  options.ignored = {"test", "tag"};
  EXPECT_TRUE(diff(a, b, options).equal()) << "everything below a path is ignored";
}

TEST(MeshDiff, StepsOfEqualTimesBelongTogether) {
  MemoryMesh a = rich_mesh(), b = rich_mesh();
  b.mesh.step_times.erase(b.mesh.step_times.begin() + 1);
  for (const std::size_t array : {2u, 5u}) b.arrays[array].erase(b.arrays[array].begin() + 1);
  const MeshDiff found = diff(a, b);
  ASSERT_EQ(found.differences.size(), 2u) << words(found);
  EXPECT_EQ(found.differences[0].kind, "steps");
  EXPECT_EQ(found.differences[1].kind, "only_in_a");
  EXPECT_EQ(found.differences[1].places[0].a, 1u);
}

// Both meshes have a single step. As in files of different formats, one mesh has a vector array,
// and the other mesh has its components as separate arrays.
TEST(MeshDiff, BetweenFormats) {
  MemoryMesh a = grid_mesh(3, 2, 2), b = grid_mesh(3, 2, 2);
  a.mesh.schema.source_format = "vtk";
  b.mesh.schema.source_format = "exodus";
  const std::size_t n = a.mesh.vertices;
  b.mesh.step_times = {0};
  std::vector<float> vectors;
  std::vector<std::vector<double>> parts(3);
  for (std::size_t i = 0; i < 3 * n; ++i) {
    vectors.push_back(static_cast<float>(i) / 8);
    parts[i % 3].push_back(static_cast<double>(i) / 8);
  }
  a.add_array<float>({"v", Location::point, ScalarType::float32, 3, false, {}, "", {}}, {vectors});
  for (std::size_t c = 0; c < 3; ++c)
    b.add_array<double>(
        {std::string("v_") + "xyz"[c], Location::point, ScalarType::float64, 1, true, {}, "", {}},
        {parts[c]});
  b.add_array<std::int32_t>({"map", Location::point, ScalarType::int32, 1, false, {}, "b:map", {}},
                            {std::vector<std::int32_t>(n)});
  b.add_extra<std::uint8_t>("exodus/title", ScalarType::uint8, Reference::nothing, {1});
  for (const bool swapped : {false, true}) {
    MemoryMesh &x = swapped ? b : a, &y = swapped ? a : b;
    MeshDiff found = diff(x, y);
    EXPECT_TRUE(found.equal()) << words(found);
    EXPECT_EQ(found.values_compared, 6 * n);
    EXPECT_FALSE(found.notes.empty());
  }
  set_value(b.arrays[1][0], 5, 100.0);
  const MeshDiff found = diff(a, b);
  ASSERT_EQ(found.differences.size(), 1u);
  EXPECT_EQ(found.differences[0].what, "array 'point/v'");
  EXPECT_EQ(found.differences[0].places[0].a, 5u);
  EXPECT_EQ(found.differences[0].places[0].component, 1u);
}

// In the format of mesh `a`, an array is stored on some of the blocks only. In the format of mesh
// `b`, every array has values for all cells, so the cells of all other blocks have fill values.
TEST(MeshDiff, ValuesOfSomeBlocksAgainstAll) {
  MemoryMesh a = grid_mesh(2, 1, 1), b = grid_mesh(2, 1, 1);
  for (MemoryMesh* mesh : {&a, &b}) {
    mesh->add_block(CellShape::hexahedron, 8, 2);
    mesh->add_cell(1, mesh->cells[0]);
  }
  a.mesh.schema.source_format = "exodus";
  b.mesh.schema.source_format = "vtk";
  a.add_array<double>({"s", Location::cell, ScalarType::float64, 1, false, {1}, "", {}}, {{5.0}});
  const double nan = std::numeric_limits<double>::quiet_NaN();
  b.add_array<double>({"s", Location::cell, ScalarType::float64, 1, false, {}, "", {}},
                      {{nan, 0.0, 5.0}});
  b.add_array<std::int32_t>({"BlockId", Location::cell, ScalarType::int32, 1, false, {}, "", {}},
                            {{1, 1, 2}});
  EXPECT_TRUE(diff(a, b).equal()) << words(diff(a, b));
  EXPECT_TRUE(diff(b, a).equal()) << words(diff(b, a));
  set_value(b.arrays[0][0], 1, 7.0);
  set_value(b.arrays[1][0], 2, std::int32_t{3});
  for (const MeshDiff& found : {diff(a, b), diff(b, a), diff(a, b, matching())}) {
    ASSERT_EQ(found.differences.size(), 2u) << words(found);
    EXPECT_EQ(found.differences[0].places[0].a, 1u);
    EXPECT_EQ(found.differences[1].what, "array 'cell/BlockId'");
    EXPECT_EQ(found.differences[1].places[0].a, 2u);
  }
}

TEST(MeshDiff, JsonSaysTheSame) {
  MemoryMesh a = rich_mesh(), b = rich_mesh();
  set_value(b.arrays[2][0], 4, std::numeric_limits<double>::infinity());
  const std::string json = diff_json({"a.e", "b.e", "exact", false}, diff(a, b));
  for (const char* part : {"\"equal\": false", "\"kind\": \"values\"", "\"different\": 1",
                           "\"largest_difference\": null", "\"value_b\": \"inf\"", "\"step_a\": 0"})
    EXPECT_NE(json.find(part), std::string::npos) << part << "\n" << json;
}

// --- matching ------------------------------------------------------------------------------------

TEST(MeshMatch, AnyOrder) {
  const MemoryMesh rich = rich_mesh();
  for (const unsigned seed : {1u, 2u, 3u}) {
    MemoryMesh a = rich, b = in_another_order(rich, seed);
    EXPECT_FALSE(diff(a, b).equal());
    const MeshDiff found = diff(a, b, matching());
    EXPECT_TRUE(found.equal()) << words(found);
  }
}

// Returns a copy of a mesh of hexahedra in which only cells of the same group share vertices. A
// group consists of `cells_together` consecutive cells. Up to eight vertices are therefore at the
// same point.
MemoryMesh torn(const MemoryMesh& mesh, std::uint64_t cells_together, double gap = 0) {
  MemoryMesh apart;
  apart.mesh.schema.source_format = "test";
  apart.add_block(CellShape::hexahedron, 8);
  std::map<std::pair<std::uint64_t, std::uint64_t>, std::uint64_t> number;
  std::vector<double> values;
  for (std::size_t c = 0; c < mesh.cells.size(); ++c) {
    std::vector<std::uint64_t> corners;
    for (const std::uint64_t v : mesh.cells[c]) {
      const auto [place, fresh] = number.try_emplace({c / cells_together, v}, apart.mesh.vertices);
      if (fresh) {
        const std::byte* xyz = mesh.points.data() + v * 24;
        const double off = gap * static_cast<double>(c / cells_together % 3);
        apart.add_point(load<double>(xyz) + off, load<double>(xyz + 8), load<double>(xyz + 16));
        values.push_back(static_cast<double>(values.size()));
      }
      corners.push_back(place->second);
    }
    apart.add_cell(0, corners);
  }
  apart.add_array<double>({"u", Location::point, ScalarType::float64, 1, false, {}, "", {}},
                          {values});
  return apart;
}

TEST(MeshMatch, CoincidentVerticesGoWithTheirCells) {
  for (const std::uint64_t together : {1u, 4u, 16u, 32u}) {
    MemoryMesh a = torn(grid_mesh(4, 4, 4), together), b = in_another_order(a, 7);
    const MeshDiff found = diff(a, b, matching());
    EXPECT_TRUE(found.equal()) << together << "\n" << words(found);
    EXPECT_EQ(found.matched_vertices, a.mesh.vertices);
  }
}

// The mesh contains two complete copies of a grid at the same place, which differ only in their
// values. All cells of one copy must be matched with cells of a single copy in the other mesh.
TEST(MeshMatch, CopiesStayWhole) {
  const MemoryMesh grid = grid_mesh(5, 4, 3);
  MemoryMesh a = grid;
  const std::uint64_t n = grid.mesh.vertices;
  for (std::uint64_t v = 0; v < n; ++v) {
    const std::byte* xyz = grid.points.data() + v * 24;
    a.add_point(load<double>(xyz), load<double>(xyz + 8), load<double>(xyz + 16));
  }
  for (auto cell : grid.cells) {
    for (auto& v : cell) v += n;
    a.add_cell(0, cell);
  }
  MemoryMesh b = in_another_order(a, 9);
  const MeshDiff found = diff(a, b, matching());
  EXPECT_TRUE(found.equal()) << words(found);
}

TEST(MeshMatch, MovedVertexIsFoundByItsCells) {
  MemoryMesh a = grid_mesh(4, 4, 4), b = in_another_order(a, 5);
  for (std::uint64_t v = 0; v < b.mesh.vertices; ++v) {
    if (std::memcmp(b.points.data() + v * 24, a.points.data() + 31 * 24, 24) != 0) continue;
    set_value(b.points, v * 3, 77.0);
  }
  const MeshDiff found = diff(a, b, matching());
  ASSERT_EQ(found.differences.size(), 1u) << words(found);
  EXPECT_EQ(found.differences[0].kind, "coordinates");
  EXPECT_EQ(found.differences[0].different, 1u);
  EXPECT_EQ(found.differences[0].places[0].a, 31u);
}

TEST(MeshMatch, MissingCellAndInvertedCell) {
  MemoryMesh a = grid_mesh(4, 4, 4), b = grid_mesh(4, 4, 4);
  b.cells.pop_back();
  b.cell_blocks.pop_back();
  --b.mesh.block_cells[0];
  std::swap(b.cells[9][0], b.cells[9][2]);
  b = in_another_order(b, 6);
  const MeshDiff found = diff(a, b, matching());
  std::set<std::string> whats;
  for (const Finding& finding : found.differences) whats.insert(finding.kind + " " + finding.what);
  EXPECT_TRUE(whats.contains("unmatched cells of A") && whats.contains("cells cells"))
      << words(found);
  EXPECT_FALSE(whats.contains("unmatched cells of B") || whats.contains("unmatched vertices of A"))
      << words(found);
  for (const Finding& finding : found.differences) {
    if (finding.kind == "cells") {
      EXPECT_EQ(finding.places[0].a, 9u);
    }
  }
}

TEST(MeshMatch, WithinATolerance) {
  MemoryMesh a = torn(grid_mesh(5, 5, 5), 25);
  MemoryMesh b = in_another_order(a, 8);
  std::mt19937 random(4);
  for (std::size_t i = 0; i < b.points.size() / 8; ++i)
    set_value(b.points, i,
              load<double>(b.points.data() + i * 8) +
                  1e-7 * (static_cast<double>(random() % 2001) / 1000 - 1));
  for (const double bound : {1.5e-7, 1e-3, 0.2}) {  // the largest bound exceeds the cell size
    const MeshDiff found = diff(a, b, matching(within(Accuracy::absolute(bound))));
    EXPECT_TRUE(found.equal()) << bound << "\n" << words(found);
  }
  EXPECT_FALSE(diff(a, b, matching(within(Accuracy::absolute(1e-9)))).equal());
}

TEST(MeshMatch, AllAtOnePlaceAndEmpty) {
  MemoryMesh a = grid_mesh(6, 6, 6), b, empty;
  std::fill(a.points.begin(), a.points.end(), std::byte{0});
  b = a;
  const MeshDiff found = diff(a, b, matching());
  EXPECT_EQ(found.matched_vertices, a.mesh.vertices);
  EXPECT_TRUE(diff(empty, empty, matching()).equal());
  EXPECT_FALSE(diff(a, empty, matching()).equal());
}

TEST(MeshMatch, SecondOrderNodesFollowTheirCells) {
  const struct {
    CellShape shape;
    std::uint32_t nodes;
  } kinds[] = {{CellShape::hexahedron, 20},  {CellShape::hexahedron, 27}, {CellShape::wedge, 15},
               {CellShape::wedge, 18},       {CellShape::pyramid, 13},    {CellShape::pyramid, 14},
               {CellShape::tetrahedron, 10}, {CellShape::quad, 8},        {CellShape::quad, 9},
               {CellShape::triangle, 6},     {CellShape::triangle, 7},    {CellShape::line, 3}};
  MemoryMesh a;
  std::mt19937 random(12);
  for (const auto& kind : kinds) {
    const std::uint32_t block =
        a.add_block(kind.shape, kind.nodes, a.mesh.schema.blocks.size() + 1);
    for (int cell = 0; cell < 5; ++cell) {
      std::vector<std::uint64_t> nodes;
      for (std::uint32_t i = 0; i < kind.nodes; ++i) {
        nodes.push_back(a.mesh.vertices);
        a.add_point(static_cast<double>(random() % 7), static_cast<double>(random() % 5),
                    static_cast<double>(random() % 1000));
      }
      a.add_cell(block, nodes);
    }
  }
  MemoryMesh b = in_another_order(a, 2);
  const MeshDiff found = diff(a, b, matching());
  EXPECT_TRUE(found.equal()) << words(found);
}

TEST(CellTurns, AsManyAsThereAreAndNoneInsideOut) {
  const struct {
    CellShape shape;
    std::size_t nodes, turns;
    std::vector<std::array<int, 3>> corners;
  } kinds[] = {
      {CellShape::hexahedron,
       8,
       24,
       {{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 1, 0}, {0, 0, 1}, {1, 0, 1}, {1, 1, 1}, {0, 1, 1}}},
      {CellShape::tetrahedron, 4, 12, {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}}},
      {CellShape::wedge, 6, 6, {{0, 0, 0}, {0, 1, 0}, {1, 0, 0}, {0, 0, 1}, {0, 1, 1}, {1, 0, 1}}},
      {CellShape::pyramid, 5, 4, {{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 1, 0}, {0, 0, 1}}},
  };
  for (const auto& kind : kinds) {
    const auto& turns = rotations_of(kind.shape, kind.nodes);
    EXPECT_EQ(turns.size(), kind.turns);
    for (std::size_t i = 0; i < turns.size(); ++i)
      for (std::size_t k = 0; k < i; ++k) EXPECT_NE(turns[i], turns[k]);
    // Picks four corners that are not in one plane. They determine the orientation of a cell.
    const std::size_t pick[4] = {0, 1, kind.nodes == 4 ? 2u : 3u, kind.nodes - 1};
    const auto volume = [&](const Rotation& turn) {
      int edge[3][3];
      for (std::size_t e = 0; e < 3; ++e)
        for (std::size_t d = 0; d < 3; ++d)
          edge[e][d] = kind.corners[turn[pick[e + 1]]][d] - kind.corners[turn[pick[0]]][d];
      return edge[0][0] * (edge[1][1] * edge[2][2] - edge[1][2] * edge[2][1]) -
             edge[0][1] * (edge[1][0] * edge[2][2] - edge[1][2] * edge[2][0]) +
             edge[0][2] * (edge[1][0] * edge[2][1] - edge[1][1] * edge[2][0]);
    };
    for (const Rotation& turn : turns) EXPECT_GT(volume(turn) * volume(turns.front()), 0);
  }
  for (const auto& [shape, nodes] :
       {std::pair{CellShape::hexahedron, 27u}, {CellShape::wedge, 18u}, {CellShape::quad, 9u}})
    for (const Rotation& turn : rotations_of(shape, nodes)) {
      EXPECT_EQ(turn.size(), nodes);
      EXPECT_EQ(std::set<std::uint8_t>(turn.begin(), turn.end()).size(), nodes);
    }
  EXPECT_TRUE(rotations_of(CellShape::line, 2).empty());
}

TEST(CellTurns, LeastRotation) {
  std::mt19937 random(1);
  for (int trial = 0; trial < 500; ++trial) {
    std::vector<std::uint64_t> names(1 + random() % 9);
    for (auto& name : names) name = random() % 3;
    const auto rotated = [&](std::size_t by) {
      auto list = names;
      std::rotate(list.begin(), list.begin() + static_cast<std::ptrdiff_t>(by), list.end());
      return list;
    };
    const auto least = rotated(least_rotation(names));
    for (std::size_t by = 0; by < names.size(); ++by) EXPECT_LE(least, rotated(by));
  }
}

TEST(PointTree, AsLookingAtAllPoints) {
  std::mt19937 random(3);
  std::vector<PlainPoint> points;
  for (int i = 0; i < 400; ++i)
    points.push_back({static_cast<double>(random() % 12), static_cast<double>(random() % 9),
                      i % 50 == 0 ? 1.7e308 : static_cast<double>(random() % 5)});
  const PointTree tree(points);
  for (int trial = 0; trial < 300; ++trial) {
    const PlainPoint place{static_cast<double>(random() % 120) / 10,
                           static_cast<double>(random() % 90) / 10, 2.25};
    const double radius = static_cast<double>(random() % 30) / 10;
    std::set<std::uint32_t> near, found;
    std::optional<std::uint32_t> nearest;
    for (std::uint32_t i = 0; i < points.size(); ++i) {
      const double distance = distance_between(points[i], place);
      if (distance > radius) continue;
      near.insert(i);
      if (!nearest || distance < distance_between(points[*nearest], place)) nearest = i;
    }
    tree.visit_near(place, radius, [&](std::uint32_t i) { return found.insert(i).second; });
    EXPECT_EQ(found, near);
    EXPECT_EQ(tree.nearest(place, radius), nearest);
  }
}

}  // namespace
}  // namespace shm::converters
