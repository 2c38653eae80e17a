// Mesh files designed to be expensive: they must use time and memory in proportion to their size,
// or be refused. If no limit applies, the same work is done on a small and a four times larger
// input (the tests Growth), and hostile_growth_test.py compares the numbers of instructions.
#include <gtest/gtest.h>
#include <netcdf.h>
#include <sys/resource.h>

#include <algorithm>
#include <cstdio>
#include <cstring>
#include <fstream>
#include <functional>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "base/failure.h"
#include "base/spool.h"
#include "compare/field_pairs.h"
#include "compare/mesh_match.h"
#include "compare/pairs.h"
#include "exodus/exodus.h"
#include "formats/formats.h"
#include "gmsh/gmsh.h"
#include "gmsh/groups.h"
#include "interface/losses.h"
#include "mesh/unique_names.h"
#include "sets/set_arrays.h"
#include "sets/transfer_sets.h"
#include "support/memory_mesh.h"
#include "support/temporary_folder.h"
#include "tool/info_report.h"
#include "transfer/joined_arrays.h"
#include "transfer/mesh_sets.h"
#include "transfer/translate.h"
#include "vtk/xml/vtu.h"

// callgrind collects while this function runs and identifies it by name.
extern "C" [[gnu::noinline]] void counted_run(const std::function<void()>& work) { work(); }

namespace shm::converters {
namespace {

// --- measurements

std::uint64_t largest_memory() {  // bytes
  rusage usage{};
  getrusage(RUSAGE_SELF, &usage);
  return static_cast<std::uint64_t>(usage.ru_maxrss) * 1024;
}

template <class Work>
Error failure_of(Work&& work) {
  try {
    work();
  } catch (const Failure& failure) {
    return failure.error();
  }
  return {};
}

template <class Work>
void expect_over_limit(Work&& work, const std::string& words) {
  const Error error = failure_of(work);
  EXPECT_EQ(error.code, ErrorCode::over_limit) << error.message();
  EXPECT_NE(error.message().find(words), std::string::npos) << error.message();
}

// --- inputs

class HostileFiles : public testing::Test {
 protected:
  std::string write(const std::string& name, const std::string& text) const {
    std::ofstream(folder_ / name, std::ios::binary) << text;
    return folder_ / name;
  }
  std::string path(const std::string& name) const { return folder_ / name; }
  const TemporaryFolder folder_;
  Spool spool_{folder_.path()};
};

class Growth : public HostileFiles {
 protected:
  // Does the work that `prepare` returns for an input of size `small`, and for one that is four
  // times larger. Prints a line after each: "counted", the name of the test, the size.
  void grow(std::size_t small,
            const std::function<std::function<void()>(std::size_t)>& prepare) const {
    for (const std::size_t size : {small, 4 * small}) {
      const std::function<void()> work = prepare(size);
      counted_run(work);
      std::printf("counted,%s,%zu\n", testing::UnitTest::GetInstance()->current_test_info()->name(),
                  size);
    }
  }
};

std::string number(std::size_t n) { return std::to_string(n); }

// Returns a file with one hexahedron; `points` and `cells` are inserted between their tags.
std::string vtu_file(std::size_t vertices, const std::string& point_data, const std::string& points,
                     const std::string& cells, const std::string& appended = {},
                     std::size_t count = 1) {
  std::string text = R"(<VTKFile type="UnstructuredGrid" version="1.0" header_type="UInt64">)"
                     R"(<UnstructuredGrid><Piece NumberOfPoints=")" +
                     number(vertices) + "\" NumberOfCells=\"" + number(count) + "\"><PointData>" +
                     point_data + R"(</PointData><Points><DataArray type="Float32" )" + points +
                     "</DataArray></Points><Cells>" + cells + "</Cells></Piece></UnstructuredGrid>";
  if (!appended.empty()) text += "<AppendedData encoding=\"raw\">_" + appended + "</AppendedData>";
  return text + "</VTKFile>";
}
constexpr const char* kEightPoints =
    R"(NumberOfComponents="3" format="ascii">0 0 0 1 0 0 1 1 0 0 1 0 0 0 1 1 0 1 1 1 1 0 1 1)";
constexpr const char* kOneCell =
    R"(<DataArray type="Int64" Name="connectivity" format="ascii">0 1 2 3 4 5 6 7</DataArray>)"
    R"(<DataArray type="Int64" Name="offsets" format="ascii">8</DataArray>)"
    R"(<DataArray type="UInt8" Name="types" format="ascii">12</DataArray>)";

std::string ascii_arrays(std::size_t count) {
  std::string text;
  for (std::size_t i = 0; i < count; ++i)
    text += R"(<DataArray type="Float64" Name="a)" + number(i) +
            R"(" format="ascii">0 1 2 3 4 5 6 7</DataArray>)";
  return text;
}

MemoryMesh one_hexahedron() {
  MemoryMesh mesh;
  for (int i = 0; i < 8; ++i) mesh.add_point(i & 1, i >> 1 & 1, i >> 2);
  mesh.add_cell(mesh.add_block(CellShape::hexahedron, 8), {0, 1, 3, 2, 4, 5, 7, 6});
  return mesh;
}

// Returns sets as the Exodus reader creates them.
MeshInfo with_exodus_sets(std::size_t count) {
  MemoryMesh mesh = one_hexahedron();
  mesh.mesh.schema.source_format = "exodus";
  for (std::size_t i = 0; i < count; ++i) {
    const std::string folder = "mesh/node_set/" + number(i) + "/";
    mesh.add_extra<std::int32_t>(folder + "id", ScalarType::int32, Reference::nothing,
                                 {static_cast<std::int32_t>(i + 1)});
    mesh.add_extra<std::int32_t>(folder + "members", ScalarType::int32, Reference::vertex, {0});
  }
  return mesh.mesh;
}

MeshInfo with_arrays(std::size_t count, bool one_name, bool per_step = false) {
  MemoryMesh mesh = one_hexahedron();
  for (std::size_t i = 0; i < count; ++i) {
    ArrayInfo array;
    array.name = one_name ? "v" : "v" + number(i);
    array.per_step = per_step;
    mesh.mesh.schema.arrays.push_back(array);
  }
  return mesh.mesh;
}

// Returns `count` cells, each in a separate block.
MemoryMesh with_blocks(std::size_t count) {
  MemoryMesh mesh;
  for (int i = 0; i < 8; ++i) mesh.add_point(i & 1, i >> 1 & 1, i >> 2);
  for (std::size_t b = 0; b < count; ++b)
    mesh.add_cell(mesh.add_block(CellShape::hexahedron, 8, static_cast<std::int64_t>(b + 1)),
                  {0, 1, 3, 2, 4, 5, 7, 6});
  return mesh;
}

// Returns a file with one entity that has many physical groups and many blocks.
std::string gmsh_of_many(std::size_t groups, std::size_t blocks) {
  std::string text =
      "$MeshFormat\n4.1 0 8\n$EndMeshFormat\n$Entities\n0 0 0 1\n1 0 0 0 1 1 1 " + number(groups);
  for (std::size_t g = 1; g <= groups; ++g) text += ' ' + number(g);
  text += " 0\n$EndEntities\n$Nodes\n1 8 1 8\n3 1 0 8\n1\n2\n3\n4\n5\n6\n7\n8\n";
  text += "0 0 0\n1 0 0\n1 1 0\n0 1 0\n0 0 1\n1 0 1\n1 1 1\n0 1 1\n$EndNodes\n$Elements\n" +
          number(blocks) + ' ' + number(blocks) + " 1 " + number(blocks) + '\n';
  for (std::size_t b = 1; b <= blocks; ++b) text += "3 1 5 1\n" + number(b) + " 1 2 3 4 5 6 7 8\n";
  return text + "$EndElements\n";
}

// Writes a classic netCDF file of 8 nodes and one block of elements. All definitions come before
// the data.
class ExodusFile {
 public:
  explicit ExodusFile(const std::string& path, std::size_t elements = 1) {
    check(nc_create(path.c_str(), NC_CLOBBER | NC_64BIT_OFFSET, &id_));
    dimension("num_nodes", 8);
    dimension("num_dim", 3);
    dimension("num_elem", elements);
    dimension("num_el_blk", 1);
    elements_ = dimension("num_el_in_blk1", elements);
  }
  int dimension(const std::string& name, std::size_t length) {
    int dimension = -1;
    check(nc_def_dim(id_, name.c_str(), length, &dimension));
    return dimension;
  }
  int integers(const std::string& name, std::vector<int> dimensions) {
    return variable(name, NC_INT, std::move(dimensions));
  }
  int doubles(const std::string& name, std::vector<int> dimensions) {
    return variable(name, NC_DOUBLE, std::move(dimensions));
  }
  void attribute(const std::string& name, const std::string& text, int variable = NC_GLOBAL) {
    check(nc_put_att_text(id_, variable, name.c_str(), text.size(), text.data()));
  }
  void end_definitions() { check(nc_enddef(id_)); }
  void put(int variable, const std::vector<int>& values) {
    check(nc_put_var_int(id_, variable, values.data()));
  }
  void close() { check(nc_close(id_)); }
  int elements() const { return elements_; }

 private:
  static void check(int status) { ASSERT_EQ(status, NC_NOERR) << nc_strerror(status); }
  int variable(const std::string& name, int type, std::vector<int> dimensions) {
    int variable = -1;
    check(nc_def_var(id_, name.c_str(), type, static_cast<int>(dimensions.size()),
                     dimensions.data(), &variable));
    return variable;
  }
  int id_ = -1, elements_ = -1;
};

// --- Exodus

TEST_F(Growth, ManySets) {
  grow(3000, [](std::size_t n) {
    return [info = with_exodus_sets(n), n] {
      Keys used;
      const auto sets = transfer_sets(info, used);
      ASSERT_EQ(sets.size(), n);
      MeshInfo to;
      to.vertices = info.vertices;
      to.extras = set_extras(sets);
      EXPECT_EQ(sets_of_extras(to).size(), n);
    };
  });
}

// A skeleton declares large numbers of factors, ids and status values. The writer derives them only
// from existing sets, so that it allocates nothing of that size.
TEST_F(HostileFiles, WhatFollowsFromSetsIsNoMoreThanTheirMembers) {
  for (const char* variable : {"dist_fact_ss1\tdouble", "ss_status\tint", "ss_prop1\tint"}) {
    MemoryMesh mesh;
    mesh.mesh.schema.source_format = "exodus";
    mesh.mesh.extras.push_back(text_extra(
        "exodus/skeleton", std::string("N\tnetcdf4\nD\tnum_dim\t3\nD\tmany\t1099511627776\nV\t") +
                               variable + "\t1\n"));
    mesh.add_extra<std::int32_t>("mesh/side_set/0/members", ScalarType::int32, Reference::cell,
                                 {0, 0});
    const std::uint64_t before = largest_memory();
    const Error error = failure_of([&] { write_exodus(mesh, path("many.e")); });
    EXPECT_EQ(error.code, ErrorCode::corrupt) << variable;
    EXPECT_NE(error.message().find("has no values for it"), std::string::npos) << error.message();
    EXPECT_LT(largest_memory() - before, std::uint64_t{64} << 20);
  }
}

// Derived data is computed for each variable. Many variables of one name would cause much work for
// few bytes.
TEST_F(HostileFiles, VariablesOfOneNameAreRefused) {
  MemoryMesh mesh;
  mesh.mesh.schema.source_format = "exodus";
  mesh.mesh.extras.push_back(
      text_extra("exodus/skeleton",
                 "N\tnetcdf4\nD\tnum_dim\t3\nD\tn\t2\nV\tdist_fact_ns1\tdouble\t1\n"
                 "V\tdist_fact_ns1\tdouble\t1\n"));
  mesh.add_extra<std::int32_t>("mesh/node_set/0/members", ScalarType::int32, Reference::vertex,
                               {0, 0});
  const Error error = failure_of([&] { write_exodus(mesh, path("twice.e")); });
  EXPECT_EQ(error.code, ErrorCode::corrupt);
  EXPECT_NE(error.message().find("is there twice"), std::string::npos) << error.message();
}

TEST_F(Growth, LossesOfManySets) {
  grow(3000, [](std::size_t n) {
    return [info = with_exodus_sets(n), n] {
      EXPECT_EQ(source_format(info).losses(info, {}).size(), n);
    };
  });
}

TEST_F(HostileFiles, ElementsOfVeryManyAttributesTakeAsMuchMemoryAsTheyHave) {
  ExodusFile file(path("in.e"));
  const int attributes = file.dimension("num_att_in_blk1", 60000);
  const int connect =
      file.integers("connect1", {file.elements(), file.dimension("num_nod_per_el1", 8)});
  file.attribute("elem_type", "HEX8", connect);
  file.doubles("attrib1", {file.elements(), attributes});
  file.end_definitions();
  file.put(connect, {1, 2, 3, 4, 5, 6, 7, 8});
  file.close();
  const auto mesh = open_exodus(path("in.e"), spool_);
  const std::uint64_t before = largest_memory();
  write_exodus(*mesh, path("out.e"));
  EXPECT_LT(largest_memory() - before, std::uint64_t{500} << 20);
}

TEST_F(HostileFiles, AttributesOfExodusFilesAreLimited) {
  ExodusFile file(path("in.e"));
  for (std::size_t i = 0; i <= NC_MAX_ATTRS; ++i) file.attribute("a" + number(i), "x");
  file.close();
  expect_over_limit([&] { open_exodus(path("in.e"), spool_); }, "attributes");
}

// All polyhedra share a face with very many nodes.
TEST_F(HostileFiles, FacesOfExodusPolyhedraMayNotBeSharedByVeryMany) {
  constexpr int kCells = 2000, kNodesOfFace = 60000;
  ExodusFile file(path("in.e"), kCells);
  file.dimension("num_fa_blk", 1);
  const int faces = file.integers("fbconn1", {file.dimension("f", kNodesOfFace)});
  const int sizes = file.integers("fbepecnt1", {file.dimension("num_fa_in_blk1", 1)});
  const int face_numbers = file.integers("facconn1", {file.dimension("n", kCells)});
  const int counts = file.integers("ebepecnt1", {file.elements()});
  file.end_definitions();
  file.put(faces, std::vector<int>(kNodesOfFace, 1));
  file.put(sizes, {kNodesOfFace});
  file.put(face_numbers, std::vector<int>(kCells, 1));
  file.put(counts, std::vector<int>(kCells, 1));
  file.close();
  const auto mesh = open_exodus(path("in.e"), spool_);
  ASSERT_EQ(mesh->info().cells(), kCells);
  CellBatch batch;
  expect_over_limit(
      [&] {
        while (mesh->next_cells(batch, 1000)) {
        }
      },
      "faces belong to");
}

// --- VTU

TEST_F(HostileFiles, SmallArraysTakeNoPages) {
  constexpr std::size_t kArrays = 1000;
  const auto mesh =
      open_vtu(write("in.vtu", vtu_file(8, ascii_arrays(kArrays), kEightPoints, kOneCell)), spool_);
  ASSERT_EQ(mesh->info().schema.arrays.size(), kArrays);
  EXPECT_EQ(spool_.paged_bytes(), 0u);
}

TEST_F(Growth, ManyVtuArrays) {
  grow(4000, [&](std::size_t n) {
    const std::string file = write(number(n), vtu_file(8, ascii_arrays(n), kEightPoints, kOneCell));
    return [this, file, n] {
      Spool spool(folder_.path());
      EXPECT_EQ(open_vtu(file, spool)->info().schema.arrays.size(), n);
    };
  });
}

TEST_F(HostileFiles, ArraysThatShareTheirBytesAreLimited) {
  constexpr std::size_t kVertices = 1 << 15, kArrays = 2200;
  std::string values(12 * kVertices, '\0'), appended(8, '\0'), arrays;
  const std::uint64_t size = values.size();
  std::memcpy(appended.data(), &size, 8);
  for (std::size_t i = 0; i < kArrays; ++i)
    arrays += "<DataArray type=\"Float32\" Name=\"a" + number(i) +
              "\" format=\"appended\" offset=\"0\"/>";
  const std::string file =
      write("in.vtu",
            vtu_file(kVertices, arrays, R"(NumberOfComponents="3" format="appended" offset="0">)",
                     kOneCell, appended + values));
  expect_over_limit([&] { open_vtu(file, spool_); }, "unpack to more bytes");
  EXPECT_LT(spool_.paged_bytes(), std::uint64_t{300} << 20);
}

// All cells have the same face, which has very many points.
TEST_F(HostileFiles, FacesOfVtuPolyhedraMayNotBeSharedByVeryMany) {
  constexpr std::size_t kCells = 4000, kPointsOfFace = 30000;
  const auto list = [](const char* name, const char* type, std::size_t count, auto&& value) {
    std::string text =
        std::string("<DataArray type=\"") + type + "\" Name=\"" + name + "\" format=\"ascii\">";
    for (std::size_t i = 0; i < count; ++i) text += number(value(i)) + ' ';
    return text + "</DataArray>";
  };
  const auto first = [](std::size_t) { return 0; };
  const auto next = [](std::size_t i) { return i + 1; };
  const std::string cells =
      list("connectivity", "Int64", kCells, first) + list("offsets", "Int64", kCells, next) +
      list("types", "UInt8", kCells, [](std::size_t) { return 42; }) +
      list("face_connectivity", "Int64", kPointsOfFace, first) +
      list("face_offsets", "Int64", 1, [](std::size_t) { return kPointsOfFace; }) +
      list("polyhedron_to_faces", "Int64", kCells, first) +
      list("polyhedron_offsets", "Int64", kCells, next);
  const std::string file = write("in.vtu", vtu_file(8, {}, kEightPoints, cells, {}, kCells));
  expect_over_limit([&] { open_vtu(file, spool_); }, "polyhedra");
}

// --- Gmsh

TEST_F(HostileFiles, GroupsOfGmshBlocksAreLimited) {
  const auto mesh = open_gmsh(write("in.msh", gmsh_of_many(3000, 3000)), spool_);
  expect_over_limit([&] { gmsh_groups(mesh->info()); }, "physical groups");
}

TEST_F(Growth, GmshGroupsAndBlocks) {
  grow(1500, [&](std::size_t n) {
    const std::string file = write(number(n), gmsh_of_many(n, n));
    return [this, file, n] {
      Spool spool(folder_.path());
      EXPECT_EQ(open_gmsh(file, spool)->info().schema.blocks.size(), n);
    };
  });
}

TEST_F(Growth, BlocksWrittenToGmsh) {
  grow(3000, [&](std::size_t n) {
    return [this, mesh = with_blocks(n)]() mutable { write_gmsh(mesh, path("out.msh")); };
  });
}

TEST_F(HostileFiles, BlocksOnTheWayToExodusAreLimited) {
  MemoryMesh mesh = with_blocks((1 << 14) + 1);
  expect_over_limit([&] { write_exodus(mesh, path("out.e")); }, "blocks and sets");
}

// --- conversion between formats

TEST_F(Growth, ManyArraysOfOneName) {
  grow(2000, [](std::size_t n) {
    return [n] {
      MemoryMesh mesh;
      mesh.mesh = with_arrays(n, true);
      const JoinedArrays joined(mesh, false, {.block_numbers = true});
      EXPECT_EQ(joined.info().schema.arrays.back().name, "v (" + number(n) + ")");
    };
  });
}

TEST(UniqueNamesTest, FirstNumberThatIsFree) {
  UniqueNames names;
  names.keep(Location::point, "v (3)");
  std::vector<std::string> taken;
  for (int i = 0; i < 4; ++i) taken.push_back(names.take(Location::point, "v"));
  EXPECT_EQ(taken, (std::vector<std::string>{"v", "v (2)", "v (4)", "v (5)"}));
  EXPECT_EQ(names.take(Location::cell, "v"), "v");
  EXPECT_EQ(names.take(Location::point, "v (2)"), "v (2) (2)");
}

TEST_F(HostileFiles, SetsBeyondWhatArraysMayTakeAreLeftOutAndTold) {
  MemoryMesh mesh = one_hexahedron();
  mesh.mesh.vertices = std::uint64_t{1} << 20;
  std::vector<MeshSet> sets(2000);
  for (MeshSet& set : sets) set.members = {0};
  const SetArrays arrays(mesh, sets, spool_);
  const std::size_t kept = arrays.info().schema.arrays.size();
  EXPECT_EQ(kept + arrays.left_out().size(), sets.size());
  EXPECT_EQ(kept, 24u * 64);  // 24 bytes of coordinates per vertex
  EXPECT_NE(arrays.left_out().front().find("too large"), std::string::npos);
}

TEST_F(HostileFiles, ListsOfCellsOfGroupsAreLimited) {
  MemoryMesh mesh = with_blocks(3000);
  std::vector<MeshSet> sets(3000);
  for (MeshSet& set : sets) {
    set.kind = MeshSet::Kind::elements;
    for (std::uint32_t b = 0; b < 3000; ++b) set.blocks.push_back(b);
  }
  expect_over_limit([&] { list_members(mesh, sets); }, "groups");
}

TEST_F(HostileFiles, ArraysOnFewOfManyBlocksMayNotGrowOutOfProportion) {
  constexpr std::uint32_t kMany = 20000;
  MemoryMesh mesh = with_blocks(kMany);
  mesh.mesh.schema.source_format = "exodus";
  for (std::uint32_t b = 0; b < kMany; ++b) {
    ArrayInfo array;
    array.name = "v" + number(b);
    array.location = Location::cell;
    array.blocks = {b};
    mesh.add_array<double>(array, {{1.0}});
  }
  Capabilities capabilities;
  capabilities.block_numbers = true;
  expect_over_limit([&] { Translation(mesh, "VTK", capabilities, {}, spool_); },
                    "covered all blocks");
  capabilities.partial_arrays = true;
  EXPECT_NO_THROW(Translation(mesh, "Gmsh", capabilities, {}, spool_));
}

// --- comparison and reports

TEST_F(Growth, BlocksOfTwoMeshes) {
  grow(4000, [](std::size_t n) {
    return [a = with_blocks(n).mesh, b = with_blocks(n).mesh, n]() mutable {
      std::reverse(b.schema.blocks.begin(), b.schema.blocks.end());
      const BlockPairs pairs = pair_blocks(a, b, true);
      EXPECT_EQ(pairs.class_a[0], pairs.class_b[n - 1]);
    };
  });
}

// Returns a column of cells in which only the lowest layer of vertices has distinct points. All
// other vertices are at one point, which differs between the meshes, so that each matched cell
// leads only to the next.
MemoryMesh column_at(double place, std::size_t cells) {
  MemoryMesh mesh;
  const std::uint32_t block = mesh.add_block(CellShape::hexahedron, 8);
  for (int i = 0; i < 4; ++i) mesh.add_point(i & 1, i >> 1, 0);
  for (std::size_t i = 0; i < 4 * cells; ++i) mesh.add_point(place, place, place);
  for (std::uint64_t v = 0; v < 4 * cells; v += 4)
    mesh.add_cell(block, {v, v + 1, v + 3, v + 2, v + 4, v + 5, v + 7, v + 6});
  return mesh;
}

TEST_F(Growth, MatchingVerticesAtOnePlace) {
  grow(150, [](std::size_t n) {
    return [a = column_at(10, n), b = column_at(20, n), n]() mutable {
      const MatchRules rules{{0}, {0}, 0};
      const MeshMatch match = match_meshes(a, b, rules, {});
      EXPECT_EQ(match.matched_cells, n);
    };
  });
}

TEST_F(Growth, ArraysOfTwoMeshes) {
  grow(2000, [](std::size_t n) {
    return [a = with_arrays(n, false), n] {
      EXPECT_EQ(pair_fields(a, MeshInfo(a), true, false).pairs.size(), n);
    };
  });
}

TEST_F(Growth, ArraysOfOneNameOfTwoMeshes) {
  grow(2000, [](std::size_t n) {
    return [a = with_arrays(n, true), n] {
      EXPECT_EQ(pair_fields(a, MeshInfo(a), true, false).pairs.size(), n);
    };
  });
}

TEST_F(Growth, InfoOfManyArrays) {
  grow(300, [](std::size_t n) {
    return [info = with_arrays(n, false)] {
      Totals totals;
      for (const std::string& name : array_stream_names(info.schema)) totals.streams[name] = 1;
      const InfoReport report{"x.shm", info, &totals, {}};
      EXPECT_FALSE(info_text(report, true).empty());
    };
  });
}

TEST(ArrayStreamNames, AreThoseOfEachArray) {
  Schema schema;
  for (const char* name : {"v", "w", "v", "v"}) {
    ArrayInfo array;
    array.name = name;
    schema.arrays.push_back(array);
  }
  schema.arrays[3].location = Location::cell;
  const std::vector<std::string> names = array_stream_names(schema);
  ASSERT_EQ(names.size(), schema.arrays.size());
  for (std::size_t a = 0; a < names.size(); ++a) EXPECT_EQ(names[a], array_stream_name(schema, a));
  EXPECT_EQ(names[2], "array:point/v#2");
}

}  // namespace
}  // namespace shm::converters
