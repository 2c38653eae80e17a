// Tests of reading and writing Exodus files: all contents are restored, meshes read from other
// formats become valid Exodus files, and damaged files are refused.
#include "exodus/exodus.h"

#include <exodusII.h>
#include <gtest/gtest.h>
#include <netcdf.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <string>
#include <vector>

#include "base/failure.h"
#include "support/exodus_oracle.h"
#include "support/memory_mesh.h"
#include "support/sanitized.h"
#include "support/temporary_folder.h"

namespace shm::converters {
namespace {

namespace fs = std::filesystem;

bool have_ncdump() {
  return std::system("ncdump >/dev/null 2>&1 -k /dev/null; test $? -ne 127") == 0;
}

std::vector<fs::path> corpus() {
  std::vector<fs::path> files;
  const char* folder = std::getenv("SHM_CORPUS");
  if (folder == nullptr || !fs::exists(fs::path(folder) / "exodus")) return files;
  for (const auto& entry : fs::directory_iterator(fs::path(folder) / "exodus"))
    files.push_back(entry.path());
  std::sort(files.begin(), files.end());
  return files;
}

void round_trip(const std::string& from, const std::string& to) {
  Spool spool(fs::path(to).parent_path().string());
  const auto mesh = open_exodus(from, spool);
  write_exodus(*mesh, to);
}

template <class T>
std::vector<T> array_values(MeshSource& mesh, std::size_t array, std::uint64_t step = 0) {
  const MeshInfo& info = mesh.info();
  std::vector<T> values(info.array_elements(array) * info.schema.arrays[array].components);
  mesh.read_array(array, step, 0, info.array_elements(array),
                  reinterpret_cast<std::byte*>(values.data()));
  return values;
}

std::size_t array_named(const MeshInfo& info, const std::string& name) {
  for (std::size_t a = 0; a < info.schema.arrays.size(); ++a)
    if (info.schema.arrays[a].name == name) return a;
  ADD_FAILURE() << "no array " << name;
  return 0;
}

// Returns all cells as pairs of a block and a list of corners.
using Cells = std::vector<std::pair<std::uint32_t, std::vector<std::uint64_t>>>;
Cells all_cells(MeshSource& mesh, std::size_t piece = 1000) {
  Cells cells;
  CellBatch batch;
  mesh.rewind_cells();
  while (mesh.next_cells(batch, piece))
    for (std::size_t i = 0; i < batch.size(); ++i)
      cells.push_back({batch.blocks[i], {batch.cell(i).begin(), batch.cell(i).end()}});
  return cells;
}

#define EX(call) ASSERT_GE((call), 0) << #call
#define NC(call) ASSERT_EQ((call), NC_NOERR) << #call

constexpr std::array<double, 12> kX{0, 1, 1, 0, 0, 1, 1, 0, 2, 2, 2, 2};
constexpr std::array<double, 12> kY{0, 0, 1, 1, 0, 0, 1, 1, 0, 1, 0, 1};
constexpr std::array<double, 12> kZ{0, 0, 0, 0, 1, 1, 1, 1, 0, 0, 1, 1};

// Writes an Exodus file with two hexahedra, a null block, polygons and polyhedra, and all kinds of
// sets, maps and variables. `mode` is an argument of ex_create.
void make_rich_file(const std::string& path, int mode) {
  SCOPED_TRACE(path);
  ex_opts(0);
  int memory = 8, file = 8;
  const int id = ex_create(path.c_str(), EX_CLOBBER | mode, &memory, &file);
  ASSERT_GE(id, 0);
  ex_set_int64_status(id, EX_ALL_INT64_API | (mode & EX_ALL_INT64_DB));
  ex_set_max_name_length(id, 80);
  ex_init_params init{};
  std::strcpy(init.title, "all sorts\tof 100% things");
  init.num_dim = 3;
  init.num_nodes = 12;
  init.num_elem = 5;
  init.num_elem_blk = 4;
  init.num_face = 6;
  init.num_face_blk = 1;
  init.num_edge = 2;
  init.num_edge_blk = 1;
  init.num_node_sets = 2;
  init.num_side_sets = 1;
  init.num_elem_sets = 1;
  init.num_edge_sets = 1;
  init.num_node_maps = 1;
  init.num_elem_maps = 1;
  EX(ex_put_init_ext(id, &init));
  EX(ex_put_coord(id, kX.data(), kY.data(), kZ.data()));
  // All axis names are written, because text that was never written has no defined value in
  // netCDF-4 files.
  char axis[] = "x", none[] = "";
  char* axes[3] = {axis, axis, none};
  EX(ex_put_coord_names(id, axes));

  const std::int64_t faces[24] = {1, 4, 3, 2, 5, 6, 7, 8, 1, 2, 6, 5,
                                  2, 3, 7, 6, 3, 4, 8, 7, 4, 1, 5, 8};
  const int face_sizes[6] = {4, 4, 4, 4, 4, 4};
  EX(ex_put_block(id, EX_FACE_BLOCK, 50, "NSIDED", 6, 24, 0, 0, 0));
  EX(ex_put_entity_count_per_polyhedra(id, EX_FACE_BLOCK, 50, face_sizes));
  EX(ex_put_conn(id, EX_FACE_BLOCK, 50, faces, nullptr, nullptr));
  EX(ex_put_block(id, EX_EDGE_BLOCK, 60, "EDGE2", 2, 2, 0, 0, 0));
  const std::int64_t edges[4] = {1, 2, 2, 3};
  EX(ex_put_conn(id, EX_EDGE_BLOCK, 60, edges, nullptr, nullptr));

  const std::int64_t hexes[16] = {1, 2, 3, 4, 5, 6, 7, 8, 2, 9, 10, 3, 6, 11, 12, 7};
  EX(ex_put_block(id, EX_ELEM_BLOCK, 7, "hex", 2, 8, 0, 0, 2));
  EX(ex_put_conn(id, EX_ELEM_BLOCK, 7, hexes, nullptr, nullptr));
  const double attributes[4] = {1.5, -0.0, 2.5, 1e300};
  EX(ex_put_attr(id, EX_ELEM_BLOCK, 7, attributes));
  char first_name[] = "thickness", second_name[] = "twist";
  char* attribute_names[2] = {first_name, second_name};
  EX(ex_put_attr_names(id, EX_ELEM_BLOCK, 7, attribute_names));
  EX(ex_put_block(id, EX_ELEM_BLOCK, 3, "QUAD", 0, 0, 0, 0, 0));
  const int polygon_sizes[2] = {3, 5};
  const std::int64_t polygons[8] = {1, 2, 3, 4, 5, 6, 7, 8};
  EX(ex_put_block(id, EX_ELEM_BLOCK, 20, "nsided", 2, 8, 0, 0, 0));
  EX(ex_put_entity_count_per_polyhedra(id, EX_ELEM_BLOCK, 20, polygon_sizes));
  EX(ex_put_conn(id, EX_ELEM_BLOCK, 20, polygons, nullptr, nullptr));
  const int polyhedron_sizes[1] = {6};
  const std::int64_t polyhedron[6] = {1, 2, 3, 4, 5, 6};
  EX(ex_put_block(id, EX_ELEM_BLOCK, 21, "nfaced", 1, 0, 0, 6, 0));
  EX(ex_put_entity_count_per_polyhedra(id, EX_ELEM_BLOCK, 21, polyhedron_sizes));
  EX(ex_put_conn(id, EX_ELEM_BLOCK, 21, nullptr, nullptr, polyhedron));
  EX(ex_put_name(id, EX_ELEM_BLOCK, 7,
                 "a block with a long name, longer than the old thirty-two characters"));

  const std::int64_t set_nodes[3] = {12, 1, 5};
  const double factors[3] = {0.25, 0.5, 0.75};
  EX(ex_put_set_param(id, EX_NODE_SET, 100, 3, 3));
  EX(ex_put_set(id, EX_NODE_SET, 100, set_nodes, nullptr));
  EX(ex_put_set_dist_fact(id, EX_NODE_SET, 100, factors));
  EX(ex_put_set_param(id, EX_NODE_SET, 101, 0, 0));
  EX(ex_put_name(id, EX_NODE_SET, 100, "corner nodes"));
  const std::int64_t set_cells[2] = {2, 1}, set_sides[2] = {6, 4};
  EX(ex_put_set_param(id, EX_SIDE_SET, 200, 2, 0));
  EX(ex_put_set(id, EX_SIDE_SET, 200, set_cells, set_sides));
  EX(ex_put_set_param(id, EX_ELEM_SET, 300, 2, 0));
  EX(ex_put_set(id, EX_ELEM_SET, 300, set_cells, nullptr));
  EX(ex_put_set_param(id, EX_EDGE_SET, 400, 2, 0));
  EX(ex_put_set(id, EX_EDGE_SET, 400, set_cells, set_sides));
  EX(ex_put_prop(id, EX_NODE_SET, 100, "colour", 42));

  std::vector<std::int64_t> map(12);
  for (std::size_t i = 0; i < 12; ++i) map[i] = 1000 - static_cast<std::int64_t>(i);
  EX(ex_put_id_map(id, EX_NODE_MAP, map.data()));
  EX(ex_put_id_map(id, EX_ELEM_MAP, map.data()));
  EX(ex_put_num_map(id, EX_NODE_MAP, 1, map.data()));
  EX(ex_put_num_map(id, EX_ELEM_MAP, 2, map.data()));

  char* unnamed[1] = {none};
  for (const ex_entity_type kind : {EX_EDGE_BLOCK, EX_FACE_BLOCK, EX_SIDE_SET, EX_EDGE_SET,
                                    EX_ELEM_SET, EX_NODE_MAP, EX_ELEM_MAP})
    EX(ex_put_names(id, kind, unnamed));

  char u[] = "displacement_x", v[] = "T", s[] = "stress", never[] = "never", g[] = "energy";
  char* nodal[2] = {u, v};
  char* element[2] = {s, never};
  char* global[1] = {g};
  EX(ex_put_variable_param(id, EX_NODAL, 2));
  EX(ex_put_variable_names(id, EX_NODAL, 2, nodal));
  EX(ex_put_variable_param(id, EX_GLOBAL, 1));
  EX(ex_put_variable_names(id, EX_GLOBAL, 1, global));
  EX(ex_put_variable_param(id, EX_ELEM_BLOCK, 2));
  EX(ex_put_variable_names(id, EX_ELEM_BLOCK, 2, element));
  int truth[8] = {1, 0, 0, 0, 1, 0, 0, 0};
  EX(ex_put_truth_table(id, EX_ELEM_BLOCK, 4, 2, truth));
  EX(ex_put_variable_param(id, EX_SIDE_SET, 1));
  EX(ex_put_variable_names(id, EX_SIDE_SET, 1, global));
  for (int step = 1; step <= 3; ++step) {
    const double time = step / 3.0;
    EX(ex_put_time(id, step, &time));
    std::vector<double> values(12);
    for (std::size_t i = 0; i < 12; ++i) values[i] = static_cast<double>(i) * step / 7;
    EX(ex_put_var(id, step, EX_NODAL, 1, 1, 12, values.data()));
    EX(ex_put_var(id, step, EX_NODAL, 2, 1, 12, kX.data()));
    EX(ex_put_var(id, step, EX_ELEM_BLOCK, 1, 7, 2, values.data()));
    EX(ex_put_var(id, step, EX_ELEM_BLOCK, 1, 20, 2, values.data() + 2));
    EX(ex_put_var(id, step, EX_GLOBAL, 1, 1, 1, values.data() + 5));
    EX(ex_put_var(id, step, EX_SIDE_SET, 1, 200, 2, values.data() + 3));
  }
  char code[] = "maker", version[] = "1.0", date[] = "today", hour[] = "noon";
  char* qa[1][4] = {{code, version, date, hour}};
  EX(ex_put_qa(id, 1, qa));
  char line[] = "one line of information";
  char* lines[1] = {line};
  EX(ex_put_info(id, 1, lines));
  EX(ex_close(id));

  // Adds items that newer versions of libexodusii write: an assembly, and attributes with unusual
  // values.
  int nc = -1, dimension = -1, variable = -1;
  NC(nc_open(path.c_str(), NC_WRITE, &nc));
  NC(nc_redef(nc));
  NC(nc_def_dim(nc, "num_entity_assembly1", 2, &dimension));
  NC(nc_def_var(nc, "assembly_entity1", NC_INT, 1, &dimension, &variable));
  const int blocks[2] = {7, 20};
  NC(nc_put_att_text(nc, variable, "_name", 8, "assembly"));
  const double odd[3] = {-0.0, std::nan(""), 1e-310};
  NC(nc_put_att_double(nc, NC_GLOBAL, "odd", NC_DOUBLE, 3, odd));
  NC(nc_put_att_text(nc, NC_GLOBAL, "empty", 0, ""));
  NC(nc_enddef(nc));
  NC(nc_put_var_int(nc, variable, blocks));
  NC(nc_close(nc));
}

TEST(Exodus, KnowsItsFiles) {
  const auto looks = [](std::string_view text) {
    return looks_like_exodus(std::as_bytes(std::span(text.data(), text.size())));
  };
  EXPECT_TRUE(looks({"CDF\x01....", 8}));
  EXPECT_TRUE(looks({"CDF\x02", 4}));
  EXPECT_TRUE(looks({"CDF\x05", 4}));
  EXPECT_TRUE(looks("\x89HDF\r\n\x1a\n"));
  EXPECT_FALSE(looks({"CDF\x03", 4}));
  EXPECT_FALSE(looks("CD"));
  EXPECT_FALSE(looks("# vtk DataFile Version 5.1"));
  EXPECT_FALSE(looks(""));
}

TEST(Exodus, CorpusComesBackEqual) {
  const auto files = corpus();
  if (files.empty() || !have_ncdump()) GTEST_SKIP() << "needs SHM_CORPUS and ncdump";
  TemporaryFolder folder;
  for (const fs::path& file : files) {
    if (!is_sampled(file.filename().string())) continue;
    const std::string copy = folder / file.filename().string();
    ASSERT_NO_THROW(round_trip(file.string(), copy)) << file;
    EXPECT_TRUE(equal_files(file.string(), copy));
    fs::remove(copy);
  }
}

class RichFile : public testing::TestWithParam<int> {};
INSTANTIATE_TEST_SUITE_P(Kinds, RichFile,
                         testing::Values(EX_NORMAL_MODEL, EX_LARGE_MODEL, EX_NETCDF4,
                                         EX_NETCDF4 | EX_NOCLASSIC | EX_ALL_INT64_DB));

TEST_P(RichFile, ComesBackEqual) {
  if (!have_ncdump()) GTEST_SKIP() << "needs ncdump";
  TemporaryFolder folder;
  ASSERT_NO_FATAL_FAILURE(make_rich_file(folder / "rich.e", GetParam()));
  ASSERT_NO_THROW(round_trip(folder / "rich.e", folder / "copy.e"));
  EXPECT_TRUE(equal_files(folder / "rich.e", folder / "copy.e"));
}

TEST_P(RichFile, IsUnderstood) {
  TemporaryFolder folder;
  ASSERT_NO_FATAL_FAILURE(make_rich_file(folder / "rich.e", GetParam()));
  Spool spool(folder / ".");
  const auto mesh = open_exodus(folder / "rich.e", spool);
  const MeshInfo& info = mesh->info();
  EXPECT_EQ(info.vertices, 12U);
  EXPECT_EQ(info.block_cells, (std::vector<std::uint64_t>{2, 0, 2, 1}));
  EXPECT_EQ(info.schema.blocks[0],
            (BlockInfo{7, "a block with a long name, longer than the old thirty-two characters",
                       CellShape::hexahedron, 8}));
  EXPECT_EQ(info.schema.blocks[2], (BlockInfo{20, "", CellShape::polygon, 0}));
  EXPECT_EQ(info.schema.blocks[3], (BlockInfo{21, "", CellShape::faces, 0}));
  for (const std::size_t piece : {1, 2, 1000}) {
    const Cells cells = all_cells(*mesh, piece);
    ASSERT_EQ(cells.size(), 5U);
    EXPECT_EQ(cells[1], (Cells::value_type{0, {1, 8, 9, 2, 5, 10, 11, 6}}));
    EXPECT_EQ(cells[2], (Cells::value_type{2, {0, 1, 2}}));
    EXPECT_EQ(cells[3], (Cells::value_type{2, {3, 4, 5, 6, 7}}));
    EXPECT_EQ(cells[4].second.size(), 30U);
    EXPECT_EQ(cells[4].second[1], 3U);
    EXPECT_EQ(cells[4].second[4], 0U);
  }
  std::vector<double> xyz(6);
  mesh->read_points(8, 2, reinterpret_cast<std::byte*>(xyz.data()));
  EXPECT_EQ(xyz, (std::vector<double>{2, 0, 0, 2, 1, 0}));

  EXPECT_EQ(info.step_times, (std::vector<double>{1 / 3.0, 2 / 3.0, 1}));
  const std::size_t stress = array_named(info, "stress");
  EXPECT_EQ(info.schema.arrays[stress].blocks, (std::vector<std::uint32_t>{0, 2}));
  EXPECT_EQ(array_values<double>(*mesh, stress, 2),
            (std::vector<double>{0, 3 / 7.0, 6 / 7.0, 9 / 7.0}));
  double one = 0;
  mesh->read_array(stress, 1, 2, 1, reinterpret_cast<std::byte*>(&one));
  EXPECT_EQ(one, 4 / 7.0);
  EXPECT_EQ(array_values<double>(*mesh, array_named(info, "displacement_x"), 1)[11], 22 / 7.0);
  const std::size_t attribute = array_named(info, "attrib1");
  EXPECT_EQ(info.schema.arrays[attribute].role, "exodus:attribute");
  EXPECT_EQ(array_values<double>(*mesh, attribute), (std::vector<double>{1.5, 0, 2.5, 1e300}));
  EXPECT_EQ(info.schema.arrays[array_named(info, "node_num_map")].role, "exodus:node_num_map");

  const Extra* nodes = find_extra(info, "mesh/node_set/0/members");
  ASSERT_NE(nodes, nullptr);
  EXPECT_EQ(nodes->refers, Reference::vertex);
  EXPECT_EQ(nodes->shape, (std::vector<std::uint64_t>{3}));
  const Extra* cells = find_extra(info, "mesh/side_set/0/members");
  ASSERT_NE(cells, nullptr);
  EXPECT_EQ(cells->refers, Reference::cell);
  const Extra* name = find_extra(info, "mesh/node_set/0/name");
  ASSERT_NE(name, nullptr);
  EXPECT_EQ(name->data.size(), std::strlen("corner nodes"));
}

TEST(Exodus, PlanarAndSingleFilesComeBackEqual) {
  if (!have_ncdump()) GTEST_SKIP() << "needs ncdump";
  TemporaryFolder folder;
  for (int dimension = 1; dimension <= 2; ++dimension) {
    const std::string path = folder / "flat.e";
    int memory = 4, file = 4;
    const int id = ex_create(path.c_str(), EX_CLOBBER, &memory, &file);
    ASSERT_GE(id, 0);
    EX(ex_put_init(id, "flat", dimension, 4, 2, 2, 0, 0));
    const float x[4] = {0, 1, 1, 0}, y[4] = {0, 0, 1, 1};
    EX(ex_put_coord(id, x, dimension > 1 ? y : nullptr, nullptr));
    // The test changes the ids of the two blocks: first both to the same number, then to 0 and -3.
    const int bars[2] = {1, 2}, more[2] = {3, 4};
    EX(ex_put_block(id, EX_ELEM_BLOCK, 5, "BAR  ", 1, 2, 0, 0, 0));
    EX(ex_put_block(id, EX_ELEM_BLOCK, 6, "bEAm2", 1, 2, 0, 0, 0));
    EX(ex_put_conn(id, EX_ELEM_BLOCK, 5, bars, nullptr, nullptr));
    EX(ex_put_conn(id, EX_ELEM_BLOCK, 6, more, nullptr, nullptr));
    EX(ex_close(id));
    for (const std::array<int, 2>& ids : {std::array{5, 5}, std::array{0, -3}}) {
      int nc = -1, table = -1;
      NC(nc_open(path.c_str(), NC_WRITE, &nc));
      NC(nc_inq_varid(nc, "eb_prop1", &table));
      NC(nc_put_var_int(nc, table, ids.data()));
      NC(nc_close(nc));
      ASSERT_NO_THROW(round_trip(path, folder / "copy.e"));
      EXPECT_TRUE(equal_files(path, folder / "copy.e"));
      Spool spool(folder / ".");
      const auto mesh = open_exodus(path, spool);
      EXPECT_EQ(mesh->info().schema.coordinate_type, ScalarType::float32);
      EXPECT_EQ(mesh->info().schema.blocks[1].id, ids[1]);
      EXPECT_EQ(all_cells(*mesh)[1], (Cells::value_type{1, {2, 3}}));
      std::vector<float> xyz(12);
      mesh->read_points(0, 4, reinterpret_cast<std::byte*>(xyz.data()));
      EXPECT_EQ(xyz[7], dimension > 1 ? 1.0F : 0.0F);
    }
  }
}

TEST(Exodus, Cdf5ComesBackEqual) {
  if (!have_ncdump()) GTEST_SKIP() << "needs ncdump";
  TemporaryFolder folder;
  ASSERT_NO_FATAL_FAILURE(make_rich_file(folder / "rich.e", EX_LARGE_MODEL));
  const std::string command =
      "nccopy -k cdf5 '" + (folder / "rich.e") + "' '" + (folder / "five.e") + "' 2>/dev/null";
  if (std::system(command.c_str()) != 0) GTEST_SKIP() << "needs nccopy";
  ASSERT_NO_THROW(round_trip(folder / "five.e", folder / "copy.e"));
  EXPECT_TRUE(equal_files(folder / "five.e", folder / "copy.e"));
}

// The mid nodes of edges and faces must be near the midpoints of the edges and faces of the VTK
// cell.
TEST(Exodus, SecondOrderNodesAreInVtkOrder) {
  constexpr std::array<std::array<int, 2>, 12> kEdges{{{0, 1},
                                                       {1, 2},
                                                       {2, 3},
                                                       {3, 0},
                                                       {4, 5},
                                                       {5, 6},
                                                       {6, 7},
                                                       {7, 4},
                                                       {0, 4},
                                                       {1, 5},
                                                       {2, 6},
                                                       {3, 7}}};
  constexpr std::array<std::array<int, 4>, 6> kFaces{
      {{0, 3, 7, 4}, {1, 2, 6, 5}, {0, 1, 5, 4}, {3, 2, 6, 7}, {0, 1, 2, 3}, {4, 5, 6, 7}}};
  std::uint64_t edges = 0, faces = 0;
  for (const fs::path& file : corpus()) {
    Spool spool("");
    const auto mesh = open_exodus(file.string(), spool);
    const MeshInfo& info = mesh->info();
    if (info.schema.coordinate_type != ScalarType::float64) continue;
    const auto point = [&](std::uint64_t vertex) {
      std::array<double, 3> xyz{};
      mesh->read_points(vertex, 1, reinterpret_cast<std::byte*>(xyz.data()));
      return xyz;
    };
    const auto off_middle = [&](const auto& corners, const std::vector<std::uint64_t>& cell,
                                std::uint64_t node) {
      std::array<double, 3> middle{};
      for (const int corner : corners)
        for (std::size_t c = 0; c < 3; ++c)
          middle[c] += point(cell[static_cast<std::size_t>(corner)])[c] / double(corners.size());
      const auto at = point(node), a = point(cell[static_cast<std::size_t>(corners[0])]);
      return std::hypot(at[0] - middle[0], at[1] - middle[1], at[2] - middle[2]) /
             std::hypot(a[0] - middle[0], a[1] - middle[1], a[2] - middle[2]);
    };
    std::size_t checked = 0;
    CellBatch batch;
    while (checked < 50 && mesh->next_cells(batch, 100)) {
      for (std::size_t i = 0; i < batch.size() && checked < 50; ++i) {
        const BlockInfo& block = info.schema.blocks[batch.blocks[i]];
        if (block.shape != CellShape::hexahedron || block.nodes_per_cell < 20) continue;
        const std::vector<std::uint64_t> cell(batch.cell(i).begin(), batch.cell(i).end());
        ++checked;
        for (std::size_t e = 0; e < 12; ++e, ++edges)
          EXPECT_LT(off_middle(kEdges[e], cell, cell[8 + e]), 0.5) << file << " edge " << e;
        for (std::size_t f = 0; f < 6 && block.nodes_per_cell == 27; ++f, ++faces)
          EXPECT_LT(off_middle(kFaces[f], cell, cell[20 + f]), 0.5) << file << " face " << f;
      }
    }
  }
  if (edges == 0) GTEST_SKIP() << "needs SHM_CORPUS";
  EXPECT_GT(faces, 0U);
}

// Returns a mesh as the reader of another format might return it. The cells of two blocks
// alternate, polygons have different numbers of corners, and arrays have many types.
MemoryMesh foreign_mesh() {
  MemoryMesh mesh;
  mesh.mesh.schema.source_format = "vtk";
  const std::uint32_t hexahedra = mesh.add_block(CellShape::hexahedron, 8, -4),
                      quads = mesh.add_block(CellShape::quad, 4, 9),
                      polygons = mesh.add_block(CellShape::polygon, 0, 9),
                      others = mesh.add_block(CellShape::other, 0, 1);
  for (BlockInfo& block : mesh.mesh.schema.blocks) block.name.clear();
  for (std::size_t i = 0; i < 12; ++i) mesh.add_point(kX[i], kY[i], kZ[i]);
  mesh.add_cell(hexahedra, {0, 1, 2, 3, 4, 5, 6, 7});
  mesh.add_cell(quads, {0, 1, 2, 3});
  mesh.add_cell(others, {1, 2});
  mesh.add_cell(polygons, {0, 1, 2});
  mesh.add_cell(hexahedra, {1, 8, 9, 2, 5, 10, 11, 6});
  mesh.add_cell(quads, {4, 5, 6, 7});
  mesh.add_cell(polygons, {4, 5, 6, 7, 0});
  mesh.add_cell(others, {1, 2, 3});
  mesh.add_cell(others, {4, 5});
  mesh.add_array<std::int32_t>({"number", Location::cell, ScalarType::int32, 1, false},
                               {{0, 1, 2, 3, 4, 5, 6, 7, 8}});
  mesh.add_array<float>({"partial", Location::cell, ScalarType::float32, 3, false, {0, 2}},
                        {{0, 1, 2, 30, 31, 32, 40, 41, 42, 60, 61, 62}});
  std::vector<std::vector<double>> steps(2, std::vector<double>(12));
  for (std::size_t i = 0; i < 12; ++i) steps[1][i] = std::sqrt(double(i));
  mesh.mesh.step_times = {0.5, 0.75};
  mesh.add_array<double>({"heat", Location::point, ScalarType::float64, 1, true}, steps);
  mesh.add_array<std::int64_t>(
      {"tag", Location::point, ScalarType::int64, 1, false, {}, "gmsh:node_tag"},
      {std::vector<std::int64_t>(12)});
  return mesh;
}

TEST(Exodus, WritesMeshesOfOtherFormats) {
  TemporaryFolder folder;
  MemoryMesh mesh = foreign_mesh();
  write_exodus(mesh, folder / "foreign.e");
  Spool spool(folder / ".");
  const auto copy = open_exodus(folder / "foreign.e", spool);
  const MeshInfo& info = copy->info();
  // The first blocks contain the hexahedra, quads and polygons. The other cells follow, with one
  // block for each number of nodes.
  EXPECT_EQ(info.block_cells, (std::vector<std::uint64_t>{2, 2, 2, 2, 1}));
  std::vector<std::int64_t> ids;
  for (const BlockInfo& block : info.schema.blocks) ids.push_back(block.id);
  EXPECT_EQ(ids, (std::vector<std::int64_t>{10, 9, 11, 1, 12}));
  EXPECT_EQ(info.schema.blocks[2].shape, CellShape::polygon);
  const std::array<std::size_t, 9> order{0, 4, 1, 5, 3, 6, 2, 8, 7};
  const Cells cells = all_cells(*copy);
  for (std::size_t i = 0; i < order.size(); ++i)
    EXPECT_EQ(cells[i].second, mesh.cells[order[i]]) << i;
  for (std::uint64_t step = 0; step < 2; ++step) {
    const auto numbers = array_values<double>(*copy, array_named(info, "number"), step);
    for (std::size_t i = 0; i < order.size(); ++i) EXPECT_EQ(numbers[i], double(order[i]));
  }
  EXPECT_EQ(array_values<double>(*copy, array_named(info, "partial_y"), 1),
            (std::vector<double>{1, 41, 31, 61}));
  EXPECT_EQ(array_values<double>(*copy, array_named(info, "heat"), 1)[7], std::sqrt(7.0));
  EXPECT_EQ(info.step_times, (std::vector<double>{0.5, 0.75}));
  for (const ArrayInfo& array : info.schema.arrays) EXPECT_NE(array.name, "tag");
}

TEST(Exodus, WritesSameBytesAgain) {
  TemporaryFolder folder;
  MemoryMesh mesh = foreign_mesh();
  write_exodus(mesh, folder / "a.e");
  write_exodus(mesh, folder / "b.e");
  std::ifstream a(folder / "a.e"), b(folder / "b.e");
  EXPECT_EQ(std::string(std::istreambuf_iterator(a), {}),
            std::string(std::istreambuf_iterator(b), {}));
}

// Writes polyhedra, given as lists of face numbers that start at 1, and their faces, given as lists
// of node numbers.
using Lists = std::vector<std::vector<std::int64_t>>;
void make_polyhedra(const std::string& path, const Lists& faces, const Lists& cells) {
  ex_opts(0);
  int memory = 8, file = 8;
  const int id = ex_create(path.c_str(), EX_CLOBBER | EX_LARGE_MODEL, &memory, &file);
  ASSERT_GE(id, 0);
  ex_set_int64_status(id, EX_ALL_INT64_API);
  ex_init_params init{};
  init.num_dim = 3;
  init.num_nodes = 12;
  init.num_elem = static_cast<std::int64_t>(cells.size());
  init.num_elem_blk = 1;
  init.num_face = static_cast<std::int64_t>(faces.size());
  init.num_face_blk = 1;
  EX(ex_put_init_ext(id, &init));
  EX(ex_put_coord(id, kX.data(), kY.data(), kZ.data()));
  const auto put = [&](ex_entity_type type, const char* name, const Lists& lists) {
    std::vector<int> sizes;
    std::vector<std::int64_t> all;
    for (const auto& list : lists) {
      sizes.push_back(static_cast<int>(list.size()));
      all.insert(all.end(), list.begin(), list.end());
    }
    const auto total = static_cast<std::int64_t>(all.size());
    const bool of_faces = type == EX_FACE_BLOCK;
    EX(ex_put_block(id, type, 5, name, static_cast<std::int64_t>(lists.size()),
                    of_faces ? total : 0, 0, of_faces ? 0 : total, 0));
    EX(ex_put_entity_count_per_polyhedra(id, type, 5, sizes.data()));
    EX(ex_put_conn(id, type, 5, of_faces ? all.data() : nullptr, nullptr,
                   of_faces ? nullptr : all.data()));
  };
  put(EX_FACE_BLOCK, "nsided", faces);
  put(EX_ELEM_BLOCK, "nfaced", cells);
  EX(ex_close(id));
}

// The mesh consists of two hexahedra that share face 4. Each test case describes their faces in a
// different irregular way.
TEST(Exodus, FacesOfPolyhedraComeBack) {
  const Lists faces = {{1, 4, 3, 2},  {5, 6, 7, 8},    {1, 2, 6, 5},  {2, 3, 7, 6},
                       {3, 4, 8, 7},  {4, 1, 5, 8},    {2, 3, 10, 9}, {6, 7, 12, 11},
                       {2, 9, 11, 6}, {9, 10, 12, 11}, {10, 3, 7, 12}};
  const Lists cells = {{1, 2, 3, 4, 5, 6}, {4, 7, 8, 9, 10, 11}};
  const auto changed = [](Lists lists, std::size_t at, std::vector<std::int64_t> list) {
    lists[at] = std::move(list);
    return lists;
  };
  Lists unused = faces, turned = faces, shared_first = faces;
  unused.push_back({1, 2, 3});
  std::reverse(turned.begin(), turned.end());
  std::rotate(shared_first.begin(), shared_first.begin() + 3, shared_first.begin() + 4);
  struct Case {
    Lists faces, cells;
    CellShape shape;
    bool numbers, shared;  // the expected extras
  };
  const std::vector<Case> cases = {
      {faces, cells, CellShape::faces, false, false},
      {turned, {{11, 10, 9, 8, 7, 6}, {8, 5, 4, 3, 2, 1}}, CellShape::faces, true, false},
      {shared_first, {{2, 3, 4, 1, 5, 6}, {1, 7, 8, 9, 10, 11}}, CellShape::faces, false, true},
      {unused, cells, CellShape::polyhedron, false, false},
      {changed(faces, 10, faces[0]), cells, CellShape::polyhedron, false, false},
      {changed(faces, 0, {1, 4, 1, 2}), cells, CellShape::polyhedron, false, false},
      {changed(faces, 0, {1, 1}), cells, CellShape::polyhedron, false, false},
      {changed(faces, 2, {7}), cells, CellShape::faces, false, false},
      {faces, {{1, 2, 3, 4, 5, 6, 6}, {4, 7, 8, 9, 10, 11}}, CellShape::faces, false, false},
      {faces, {{1, 2, 3, 4, 5, 6}, {}}, CellShape::polyhedron, false, false},
  };
  TemporaryFolder folder;
  Spool spool(folder / ".");
  for (std::size_t i = 0; i < cases.size(); ++i) {
    SCOPED_TRACE(i);
    ASSERT_NO_FATAL_FAILURE(make_polyhedra(folder / "a.e", cases[i].faces, cases[i].cells));
    const auto mesh = open_exodus(folder / "a.e", spool);
    EXPECT_EQ(mesh->info().schema.blocks.at(0).shape, cases[i].shape);
    EXPECT_EQ(find_extra(mesh->info(), "exodus/face_numbers") != nullptr, cases[i].numbers);
    EXPECT_EQ(find_extra(mesh->info(), "exodus/shared_faces_first") != nullptr, cases[i].shared);
    ASSERT_NO_THROW(round_trip(folder / "a.e", folder / "b.e"));
    std::ifstream a(folder / "a.e"), b(folder / "b.e");
    EXPECT_EQ(std::string(std::istreambuf_iterator(a), {}),
              std::string(std::istreambuf_iterator(b), {}));
  }
}

TEST(Exodus, RefusesPolyhedraOfOtherFormats) {
  TemporaryFolder folder;
  MemoryMesh mesh = foreign_mesh();
  mesh.mesh.schema.blocks[3].shape = CellShape::polyhedron;
  EXPECT_THROW(write_exodus(mesh, folder / "foreign.e"), Failure);
}

TEST(Exodus, SideSetsFollowCellsThatLeftTheirBlock) {
  TemporaryFolder folder;
  MemoryMesh first = foreign_mesh();
  write_exodus(first, folder / "first.e");
  int id = -1, dimension = -1, table = -1, members = -1, sides = -1;
  NC(nc_open((folder / "first.e").c_str(), NC_WRITE, &id));
  NC(nc_redef(id));
  NC(nc_def_dim(id, "num_side_sets", 1, &dimension));
  NC(nc_def_var(id, "ss_prop1", NC_INT, 1, &dimension, &table));
  NC(nc_def_dim(id, "num_side_ss1", 3, &dimension));
  NC(nc_def_var(id, "elem_ss1", NC_INT, 1, &dimension, &members));
  NC(nc_def_var(id, "side_ss1", NC_INT, 1, &dimension, &sides));
  NC(nc_enddef(id));
  const int number = 4, cells[3] = {2, 3, 9}, side[3] = {1, 1, 1};
  NC(nc_put_var_int(id, table, &number));
  NC(nc_put_var_int(id, members, cells));
  NC(nc_put_var_int(id, sides, side));
  NC(nc_close(id));

  // Opens the mesh and exchanges its second and third cells, which are in different blocks.
  Spool spool(folder / ".");
  const auto source = open_exodus(folder / "first.e", spool);
  MemoryMesh moved = copy_of(*source);
  for (std::size_t a = 0; a < moved.arrays.size(); ++a)
    for (std::vector<std::byte>& values : moved.arrays[a])
      if (moved.mesh.schema.arrays[a].name == "number")
        std::swap_ranges(values.begin() + 8, values.begin() + 16, values.begin() + 16);
  std::swap(moved.cells[1], moved.cells[2]);
  std::swap(moved.cell_blocks[1], moved.cell_blocks[2]);
  for (Extra& extra : moved.mesh.extras)
    if (extra.key == "mesh/side_set/0/members") {
      const std::int32_t after[3] = {2, 1, 8};
      std::memcpy(extra.data.data(), after, sizeof after);
    }
  write_exodus(moved, folder / "moved.e");
  if (!have_ncdump()) GTEST_SKIP() << "needs ncdump";
  EXPECT_TRUE(equal_files(folder / "first.e", folder / "moved.e"));
}

void set_bytes(const std::string& path, std::string_view bytes) {
  std::ofstream(path, std::ios::binary)
      .write(bytes.data(), static_cast<std::streamsize>(bytes.size()));
}

// Reads all contents of a mesh.
void read_all(const std::string& path) {
  Spool spool("");
  const auto mesh = open_exodus(path, spool);
  const MeshInfo& info = mesh->info();
  all_cells(*mesh);
  std::vector<std::byte> values(info.vertices * 24);
  mesh->read_points(0, info.vertices, values.data());
  for (std::size_t a = 0; a < info.schema.arrays.size(); ++a) {
    values.resize(info.array_elements(a) * info.array_stride(a));
    const std::uint64_t steps = info.schema.arrays[a].per_step ? info.step_times.size() : 1;
    for (std::uint64_t step = 0; step < std::min<std::uint64_t>(steps, 4); ++step)
      mesh->read_array(a, step, 0, info.array_elements(a), values.data());
  }
}

TEST(Exodus, RefusesTruncatedClassicFiles) {
  TemporaryFolder folder;
  ASSERT_NO_FATAL_FAILURE(make_rich_file(folder / "rich.e", EX_LARGE_MODEL));
  const std::string bytes = file_content(folder / "rich.e");
  // The last bytes may be padding.
  for (std::size_t size = 0; size + 4 < bytes.size(); size += size < 6000 ? 5 : 17) {
    set_bytes(folder / "cut.e", bytes.substr(0, size));
    EXPECT_THROW(read_all(folder / "cut.e"), Failure) << size;
  }
  set_bytes(folder / "cut.e", bytes.substr(0, bytes.size() - 100));
  try {
    read_all(folder / "cut.e");
    ADD_FAILURE() << "the missing byte was not detected";
  } catch (const Failure& failure) {
    EXPECT_EQ(failure.error().code, ErrorCode::truncated);
    EXPECT_EQ(failure.error().file, folder / "cut.e");
    EXPECT_NE(failure.error().section.find("variable"), std::string::npos);
  }
}

TEST(Exodus, RefusesTruncatedNetcdf4Files) {
  TemporaryFolder folder;
  ASSERT_NO_FATAL_FAILURE(make_rich_file(folder / "rich.e", EX_NETCDF4));
  const std::string bytes = file_content(folder / "rich.e");
  for (std::size_t size = 0; size < bytes.size(); size += bytes.size() / 50) {
    set_bytes(folder / "cut.e", bytes.substr(0, size));
    EXPECT_THROW(read_all(folder / "cut.e"), Failure) << size;
  }
}

TEST(Exodus, SurvivesDamagedClassicFiles) {
  TemporaryFolder folder;
  ASSERT_NO_FATAL_FAILURE(make_rich_file(folder / "rich.e", EX_NORMAL_MODEL));
  const std::string bytes = file_content(folder / "rich.e");
  for (std::size_t at = 0; at < bytes.size(); at += at < 6000 ? 5 : 17) {
    std::string damaged = bytes;
    damaged[at] = static_cast<char>(damaged[at] ^ (at % 3 == 0 ? 0xff : 1 << at % 8));
    set_bytes(folder / "damaged.e", damaged);
    try {
      read_all(folder / "damaged.e");
    } catch (const Failure&) {
    }
  }
}

TEST(Exodus, RefusesOtherNetcdfFiles) {
  TemporaryFolder folder;
  int id = -1, dimension = -1;
  NC(nc_create((folder / "other.nc").c_str(), NC_CLOBBER, &id));
  NC(nc_def_dim(id, "time", 3, &dimension));
  NC(nc_close(id));
  Spool spool("");
  EXPECT_THROW(open_exodus(folder / "other.nc", spool), Failure);
  EXPECT_THROW(open_exodus(folder / "missing.e", spool), Failure);
}

TEST(Exodus, RefusesDamagedStructure) {
  TemporaryFolder folder;
  ASSERT_NO_FATAL_FAILURE(make_rich_file(folder / "rich.e", EX_LARGE_MODEL));
  Spool spool(folder / ".");
  const auto source = open_exodus(folder / "rich.e", spool);
  MemoryMesh mesh = copy_of(*source);
  EXPECT_NO_THROW(write_exodus(mesh, folder / "copy.e"));
  const std::vector<Extra> whole = mesh.mesh.extras;
  for (std::size_t i = 0; i < whole[0].data.size(); i += every(3)) {
    mesh.mesh.extras[0].data[i] ^= std::byte{1};
    try {
      write_exodus(mesh, folder / "copy.e");
    } catch (const Failure&) {
    }
    mesh.mesh.extras[0].data[i] ^= std::byte{1};
  }
  for (std::size_t i = 1; i < whole.size(); ++i) {
    mesh.mesh.extras = whole;
    if (whole[i].key.rfind("/name") == whole[i].key.size() - 5) continue;
    mesh.mesh.extras[i].data.clear();
    EXPECT_THROW(write_exodus(mesh, folder / "copy.e"), Failure) << whole[i].key;
    // The extras "/id" and "/factors" are optional. Without them, the id of a set is its position
    // in the list of sets, and all its distribution factors are 1.
    if (whole[i].key.starts_with("mesh/") &&
        (whole[i].key.ends_with("/id") || whole[i].key.ends_with("/factors")))
      continue;
    mesh.mesh.extras.erase(mesh.mesh.extras.begin() + static_cast<std::ptrdiff_t>(i));
    EXPECT_THROW(write_exodus(mesh, folder / "copy.e"), Failure) << whole[i].key;
  }
}

}  // namespace
}  // namespace shm::converters
