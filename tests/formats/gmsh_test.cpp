// Tests of Gmsh MSH files. All data that Gmsh reads from a file is restored, and no file crashes
// the reader. If SHM_CORPUS is set, every file of its folder gmsh/ is converted to .shm and back.
// If Gmsh for Python is installed, Gmsh itself compares source and result.
#include "gmsh/gmsh.h"

#include <gtest/gtest.h>
#include <unistd.h>

#include <algorithm>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <map>
#include <numeric>
#include <sstream>

#include "base/failure.h"
#include "gmsh/types.h"
#include "support/sanitized.h"

namespace shm::converters {
namespace {

namespace fs = std::filesystem;

// A complete mesh in memory. Tests compare it, change it, and pass it to a writer.
struct MemoryMesh final : MeshSource {
  MemoryMesh() = default;
  explicit MemoryMesh(MeshSource& source) : info_(source.info()) {
    points.resize(info_.vertices * 3 * scalar_bytes(info_.schema.coordinate_type));
    source.read_points(0, info_.vertices, points.data());
    source.rewind_cells();
    CellBatch batch;
    while (source.next_cells(batch, 7)) {
      for (std::size_t i = 0; i < batch.size(); ++i) {
        blocks.push_back(batch.blocks[i]);
        cells.emplace_back(batch.cell(i).begin(), batch.cell(i).end());
      }
    }
    for (std::size_t a = 0; a < info_.schema.arrays.size(); ++a) {
      const std::size_t steps = info_.schema.arrays[a].per_step ? info_.step_times.size() : 1;
      arrays.emplace_back(steps);
      for (std::size_t s = 0; s < steps; ++s) {
        arrays[a][s].resize(info_.array_elements(a) * info_.array_stride(a));
        source.read_array(a, s, 0, info_.array_elements(a), arrays[a][s].data());
      }
    }
  }

  const MeshInfo& info() const override { return info_; }
  void read_points(std::uint64_t first, std::uint64_t count, std::byte* out) override {
    const std::size_t each = 3 * scalar_bytes(info_.schema.coordinate_type);
    if (count > 0) std::memcpy(out, points.data() + first * each, count * each);
  }
  bool next_cells(CellBatch& out, std::size_t max_cells) override {
    out.clear();
    for (; out.size() < max_cells && at_ < cells.size(); ++at_) {
      out.blocks.push_back(blocks[at_]);
      out.corners.insert(out.corners.end(), cells[at_].begin(), cells[at_].end());
      out.corner_begin.push_back(out.corners.size());
    }
    return out.size() > 0;
  }
  void rewind_cells() override { at_ = 0; }
  void read_array(std::size_t array, std::uint64_t step, std::uint64_t first, std::uint64_t count,
                  std::byte* out) override {
    const std::size_t each = info_.array_stride(array);
    if (count > 0) std::memcpy(out, arrays[array][step].data() + first * each, count * each);
  }

  std::size_t array_named(const std::string& name) const {
    for (std::size_t a = 0; a < info_.schema.arrays.size(); ++a)
      if (info_.schema.arrays[a].name == name) return a;
    ADD_FAILURE() << "no array " << name;
    return 0;
  }
  template <class T>
  std::vector<T> values(const std::string& name, std::size_t step = 0) const {
    const auto& bytes = arrays[array_named(name)][step];
    std::vector<T> all(bytes.size() / sizeof(T));
    if (!all.empty()) std::memcpy(all.data(), bytes.data(), bytes.size());
    return all;
  }
  std::vector<double> xyz(std::uint64_t vertex) const {
    std::vector<double> p(3);
    std::memcpy(p.data(), points.data() + vertex * 24, 24);
    return p;
  }
  const Extra* extra(const std::string& key) const {
    for (const Extra& e : info_.extras)
      if (e.key == key) return &e;
    return nullptr;
  }
  void set_text(const std::string& key, const std::string& text) {
    std::erase_if(info_.extras, [&](const Extra& e) { return e.key == key; });
    Extra e{key, ScalarType::uint8, Reference::nothing, {text.size()}, {}};
    e.data.resize(text.size());
    std::memcpy(e.data.data(), text.data(), text.size());
    info_.extras.push_back(std::move(e));
  }

  MeshInfo info_;
  std::vector<std::byte> points;
  std::vector<std::uint32_t> blocks;
  std::vector<std::vector<std::uint64_t>> cells;
  std::vector<std::vector<std::vector<std::byte>>> arrays;  // [array][step]

 private:
  std::size_t at_ = 0;
};

void expect_same(const MemoryMesh& a, const MemoryMesh& b) {
  EXPECT_EQ(a.info_.schema, b.info_.schema);
  EXPECT_EQ(a.info_.vertices, b.info_.vertices);
  EXPECT_EQ(a.info_.block_cells, b.info_.block_cells);
  EXPECT_EQ(a.info_.step_times, b.info_.step_times);
  ASSERT_EQ(a.info_.extras.size(), b.info_.extras.size());
  for (std::size_t i = 0; i < a.info_.extras.size(); ++i)
    EXPECT_EQ(a.info_.extras[i], b.info_.extras[i]) << a.info_.extras[i].key;
  EXPECT_TRUE(a.points == b.points);
  EXPECT_TRUE(a.blocks == b.blocks);
  EXPECT_TRUE(a.cells == b.cells);
  EXPECT_TRUE(a.arrays == b.arrays);
}

class GmshTest : public ::testing::Test {
 protected:
  GmshTest() {
    static int number = 0;
    folder_ = fs::temp_directory_path() /
              ("gmsh_test_" + std::to_string(::getpid()) + "_" + std::to_string(number++));
    fs::create_directories(folder_);
  }
  ~GmshTest() override { fs::remove_all(folder_); }

  std::string path(const std::string& name) const { return (folder_ / name).string(); }
  std::string save(const std::string& content, const std::string& name = "in.msh") const {
    fs::remove(path(name));  // some file systems flush a file when it is overwritten, which is slow
    std::ofstream(path(name), std::ios::binary) << content;
    return path(name);
  }
  static std::string load(const std::string& file) {
    std::ostringstream content;
    content << std::ifstream(file, std::ios::binary).rdbuf();
    return content.str();
  }
  MemoryMesh open(const std::string& file) const {
    Spool spool(folder_.string());
    return MemoryMesh(*open_gmsh(file, spool));
  }
  MemoryMesh open_text(const std::string& content) const { return open(save(content)); }
  MemoryMesh written(MeshSource& mesh, const std::string& name = "out.msh") const {
    write_gmsh(mesh, path(name));
    return open(path(name));
  }
  void expect_round_trip(const std::string& content) const {
    MemoryMesh first = open_text(content);
    expect_same(first, written(first));
  }
  ErrorCode error_of(const std::string& content) const {
    try {
      open_text(content);
    } catch (const Failure& failure) {
      EXPECT_EQ(failure.error().file, path("in.msh"));
      EXPECT_FALSE(failure.error().detail.empty());
      return failure.error().code;
    }
    ADD_FAILURE() << "opened";
    return ErrorCode::misuse;
  }
  // Converts an MSH file to a binary MSH file of the given byte order. Returns its contents.
  std::string in_binary(const std::string& content, bool big) const {
    MemoryMesh mesh = open_text(content);
    std::string format;
    for (const std::byte b : mesh.extra("gmsh/mesh_format")->data) format += static_cast<char>(b);
    format[format.find(" 0 ") + 1] = '1';
    mesh.set_text("gmsh/mesh_format", format);
    mesh.set_text("gmsh/byte_order", big ? "big" : "little");
    write_gmsh(mesh, path("binary.msh"));
    return load(path("binary.msh"));
  }

  fs::path folder_;
};

const std::string kVersion1 =
    "$NOD\n9\n1 0 0 0\n2 1 0 0\n3 1 1 0\n4 0 1 0\n5 0 0 1\n6 1 0 1\n7 1 1 1\n8 0 1 1\n20 2 .5 "
    "5e-1\n"
    "$ENDNOD\n$ELM\n3\n1 5 7 1 8 1 2 3 4 5 6 7 8\n2 3 8 2 4 1 2 3 4\n9 7 7 1 5 2 3 7 6 "
    "20\n$ENDELM\n";

// A mesh with alternating blocks, partitions, tags with gaps, a view with two steps, and a view
// that covers only some of the nodes.
const std::string kVersion2 =
    "$MeshFormat\n2.2 0 8\n$EndMeshFormat\n$Comments\nanything $ at all\n$EndComments\n"
    "$PhysicalNames\n2\n2 5 \"skin of it\"\n3 7 \"body\"\n$EndPhysicalNames\n"
    "$Nodes\n8\n10 0 0 0\n2 1 0 0\n3 1 1 0\n4 0 1 0\n5000000 0 0 0.1\n6 1 0 1\n7 1 1 1\n8 0 1 1\n"
    "$EndNodes\n$Elements\n4\n"
    "1 3 2 5 1 10 2 3 4\n5 5 4 7 1 1 3 10 2 3 4 5000000 6 7 8\n3 3 4 5 1 1 2 5000000 6 7 8\n"
    "4 2 2 5 1 10 2 3\n$EndElements\n"
    "$Periodic\n1\n2 1 1\nAffine 1 0 0 0 0 1 0 0 0 0 1 1 0 0 0 1\n2\n5000000 10\n6 "
    "2\n$EndPeriodic\n"
    "$NodeData\n1\n\"temperature\"\n1\n0.5\n3\n0\n1\n8\n10 1\n2 2\n3 3\n4 4\n5000000 5\n6 6\n7 7\n"
    "8 8\n$EndNodeData\n"
    "$NodeData\n1\n\"temperature\"\n1\n1.5\n3\n1\n1\n8\n8 18\n2 12\n3 13\n4 14\n5000000 15\n6 16\n"
    "7 17\n10 11\n$EndNodeData\n"
    "$NodeData\n1\n\"sparse\"\n1\n0\n3\n0\n3\n2\n7 0.1 0.2 -0\n2 1e-320 inf nan\n$EndNodeData\n"
    "$ElementData\n1\n\"of the hexahedron\"\n1\n0\n3\n0\n1\n1\n5 3.25\n$EndElementData\n"
    "$ElementNodeData\n1\n\"corners\"\n1\n0\n3\n0\n1\n1\n5 8 1 2 3 4 5 6 7 8\n$EndElementNodeData\n"
    "$ElementNodeData\n1\n\"odd\"\n1\n0\n4\n0\n1\n2\n1\n5 8 1 2 3 4 5 6 7 8\n4 3 1 2 3\n"
    "$EndElementNodeData\n";

const std::string kVersion40 =
    "$MeshFormat\n4 0 8\n$EndMeshFormat\n$Entities\n0 0 1 1\n3 0 0 0 1 1 0 0 0\n"
    "1 0 0 0 1 1 1 1 7 1 3\n$EndEntities\n"
    "$Nodes\n2 8\n3 2 1 4\n1 0 0 0 0 0\n2 1 0 0 1 0\n3 1 1 0 1 1\n4 0 1 0 0 1\n1 3 0 4\n5 0 0 1\n"
    "6 1 0 1\n7 1 1 1\n8 0 1 1\n$EndNodes\n"
    "$Elements\n2 2\n3 2 3 1\n1 1 2 3 4 \n1 3 5 1\n2 1 2 3 4 5 6 7 8 \n$EndElements\n"
    "$Periodic\n2\n2 3 3\n1\n1 5\n2 1 1\nAffine 1 0 0 0 0 1 0 0 0 0 1 1 0 0 0 1\n1\n2 6\n"
    "$EndPeriodic\n$GhostElements\n1\n2 1 2 2 3\n$EndGhostElements\n";

const std::string kVersion41 =
    "$MeshFormat\n4.1 0 8\n$EndMeshFormat\n$PhysicalNames\n1\n3 7 \"body\"\n$EndPhysicalNames\n"
    "$Entities\n1 0 1 1\n4 0 0 0 0\n3 0 0 0 1 1 0 0 0\n1 0 0 0 1 1 1 1 7 1 3\n$EndEntities\n"
    "$Nodes\n3 8 1 8\n0 4 0 0\n2 3 1 4\n1\n2\n3\n4\n0 0 0 0 0\n1 0 0 1 0\n1 1 0 1 1\n0 1 0 0 1\n"
    "3 1 0 4\n5\n6\n7\n8\n0 0 1\n1 0 1\n1 1 1\n0 1 1\n$EndNodes\n"
    "$Elements\n2 2 3 9\n2 3 3 1\n3 1 2 3 4 \n3 1 5 1\n9 1 2 3 4 5 6 7 8 \n$EndElements\n"
    "$Periodic\n1\n2 3 3\n0\n1\n1 5\n$EndPeriodic\n"
    "$GhostElements\n1\n9 1 2 2 3\n$EndGhostElements\n"
    "$ElementData\n1\n\"e\"\n1\n0\n3\n0\n1\n2\n3 1.5\n9 2.5\n$EndElementData\n";

TEST_F(GmshTest, KnowsItsFiles) {
  const auto looks = [](std::string_view text) {
    return looks_like_gmsh(std::as_bytes(std::span(text.data(), text.size())));
  };
  for (const std::string& file : {kVersion1, kVersion2, kVersion40, kVersion41})
    EXPECT_TRUE(looks(file));
  EXPECT_TRUE(looks("$Comments\nhello\n$EndComments\n$MeshFormat\n2.2 0 8\n"));
  EXPECT_FALSE(looks(""));
  EXPECT_FALSE(looks("# vtk DataFile Version 3.0"));
  EXPECT_FALSE(looks("$ sudo make $MeshFormat"));
}

TEST_F(GmshTest, ReadsVersion1) {
  const MemoryMesh mesh = open_text(kVersion1);
  EXPECT_EQ(mesh.info_.vertices, 9u);
  ASSERT_EQ(mesh.info_.schema.blocks.size(), 3u);
  EXPECT_EQ(mesh.info_.schema.blocks[0].shape, CellShape::hexahedron);
  EXPECT_EQ(mesh.info_.schema.blocks[2].shape, CellShape::pyramid);
  EXPECT_EQ(mesh.cells[2], (std::vector<std::uint64_t>{1, 2, 6, 5, 8}));
  EXPECT_EQ(mesh.xyz(8), (std::vector<double>{2, 0.5, 0.5}));
  EXPECT_EQ(mesh.values<std::int64_t>("gmsh:node_tag").back(), 20);
  EXPECT_EQ(mesh.values<std::int64_t>("gmsh:element_tag"), (std::vector<std::int64_t>{1, 2, 9}));
  expect_round_trip(kVersion1);
}

TEST_F(GmshTest, ReadsVersion2) {
  const MemoryMesh mesh = open_text(kVersion2);
  ASSERT_EQ(mesh.info_.schema.blocks.size(), 4u);  // quads with and without partitions differ
  EXPECT_EQ(mesh.blocks, (std::vector<std::uint32_t>{0, 1, 2, 3}));
  EXPECT_EQ(mesh.info_.schema.blocks[0].name, "skin of it");
  EXPECT_EQ(mesh.info_.schema.blocks[1].name, "body");
  EXPECT_EQ(mesh.cells[2], (std::vector<std::uint64_t>{4, 5, 6, 7}));
  EXPECT_EQ(mesh.values<std::int32_t>("gmsh:tag_3"), (std::vector<std::int32_t>{3, 2}));
  EXPECT_EQ(mesh.info_.step_times, (std::vector<double>{0.5, 1.5}));
  EXPECT_EQ(mesh.values<double>("temperature", 0), (std::vector<double>{1, 2, 3, 4, 5, 6, 7, 8}));
  EXPECT_EQ(mesh.values<double>("temperature", 1),
            (std::vector<double>{11, 12, 13, 14, 15, 16, 17, 18}));
  EXPECT_EQ(mesh.values<double>("of the hexahedron"), std::vector<double>{3.25});
  const ArrayInfo& corners = mesh.info_.schema.arrays[mesh.array_named("corners")];
  EXPECT_EQ(corners.components, 8u);
  EXPECT_EQ(corners.role, "gmsh:element_node_data");
  EXPECT_EQ(corners.blocks, std::vector<std::uint32_t>{1});
  const Extra* links = mesh.extra("gmsh/section/5/nodes");
  ASSERT_NE(links, nullptr);
  EXPECT_EQ(links->refers, Reference::vertex);
  expect_round_trip(kVersion2);
}

TEST_F(GmshTest, ReadsVersion4) {
  for (const std::string& file : {kVersion40, kVersion41}) {
    const MemoryMesh mesh = open_text(file);
    ASSERT_EQ(mesh.info_.schema.blocks.size(), 2u);
    EXPECT_EQ(mesh.info_.schema.blocks[0].id, 3);
    EXPECT_EQ(mesh.info_.schema.blocks[1].id, 1);
    EXPECT_EQ(mesh.cells[1], (std::vector<std::uint64_t>{0, 1, 2, 3, 4, 5, 6, 7}));
    EXPECT_EQ(mesh.values<double>("gmsh:node_parameters")[9], 0);
    EXPECT_EQ(mesh.values<double>("gmsh:node_parameters")[10], 1);
    expect_round_trip(file);
  }
  const MemoryMesh mesh = open_text(kVersion41);
  EXPECT_EQ(mesh.info_.schema.blocks[1].name, "body");
  EXPECT_EQ(mesh.values<double>("e"), (std::vector<double>{1.5, 2.5}));
  EXPECT_NE(mesh.extra("gmsh/section/6/cells"), nullptr);
  EXPECT_NE(mesh.extra("gmsh/section/5/links"), nullptr);
  const MemoryMesh old = open_text(kVersion40);
  EXPECT_NE(old.extra("gmsh/section/4/links"), nullptr);
  EXPECT_NE(old.extra("gmsh/section/5/cells"), nullptr);
}

TEST_F(GmshTest, BinaryIsTheSameInEitherByteOrder) {
  for (const std::string& file : {kVersion2, kVersion40, kVersion41}) {
    MemoryMesh text = open_text(file);
    for (const bool big : {false, true}) {
      const std::string binary = in_binary(file, big);
      MemoryMesh mesh = open_text(binary);
      // The binary file contains $Entities as ASCII text. The reader does not read block names from
      // that text, so the test copies the names.
      for (std::size_t b = 0; b < mesh.info_.schema.blocks.size(); ++b)
        if (file != kVersion2) mesh.info_.schema.blocks[b].name = text.info_.schema.blocks[b].name;
      EXPECT_EQ(mesh.info_.vertices, text.info_.vertices);
      EXPECT_TRUE(mesh.points == text.points);
      EXPECT_TRUE(mesh.cells == text.cells);
      EXPECT_TRUE(mesh.arrays == text.arrays);
      EXPECT_EQ(mesh.info_.schema, text.info_.schema);
      expect_round_trip(binary);
      MemoryMesh again = open_text(binary);
      write_gmsh(again, path("again.msh"));
      EXPECT_EQ(load(path("again.msh")), binary);
    }
  }
}

TEST_F(GmshTest, PolygonsOfVersion2) {
  expect_round_trip(
      "$MeshFormat\n2.2 0 8\n$EndMeshFormat\n$Nodes\n5\n1 0 0 0\n2 1 0 0\n3 1 1 0\n4 0 1 0\n5 0 0 "
      "1\n"
      "$EndNodes\n$Elements\n3\n1 34 2 0 1 5 1 2 3 4 5\n2 34 2 0 1 3 1 2 3\n3 15 0 5\n"
      "$EndElements\n");
}

TEST_F(GmshTest, ParametricNodesOfVersion2) {
  const std::string file =
      "$MeshFormat\n2.2 0 8\n$EndMeshFormat\n$ParametricNodes\n4\n1 0 0 0 0 1\n2 1 0 0 1 3 0.25\n"
      "3 1 1 0 2 9 0.5 0.75\n4 0 1 0 3 1\n$EndParametricNodes\n$Elements\n1\n1 4 2 0 1 1 2 3 4\n"
      "$EndElements\n";
  const MemoryMesh mesh = open_text(file);
  EXPECT_EQ(mesh.values<double>("gmsh:node_parameters"),
            (std::vector<double>{0, 0, 0, 0.25, 0, 0, 0.5, 0.75, 0, 0, 0, 0}));
  expect_round_trip(file);
  expect_round_trip(in_binary(file, false));
}

TEST_F(GmshTest, ManyCombinationsOfTags) {
  std::string nodes =
      "$MeshFormat\n2.2 0 8\n$EndMeshFormat\n$Nodes\n3\n1 0 0 0\n2 1 0 0\n3 0 1 0\n"
      "$EndNodes\n$Elements\n3000\n";
  for (int i = 0; i < 3000; ++i)
    nodes += std::to_string(i + 1) + (i % 3 == 0 ? " 1 2 " : " 1 3 ") + std::to_string(i % 50) +
             ' ' + std::to_string(i) + (i % 3 == 0 ? "" : " 1") + " 1 2\n";
  nodes += "$EndElements\n";
  const MemoryMesh mesh = open_text(nodes);
  EXPECT_EQ(mesh.info_.schema.blocks.size(), 2u);
  EXPECT_EQ(mesh.values<std::int32_t>("gmsh:tag_1")[2999], 2999);
  EXPECT_EQ(mesh.values<std::int32_t>("gmsh:tag_2").size(), 2000u);
  expect_round_trip(nodes);
}

// The reader does not interpret some sections. They may refer to nodes and elements by tag.
// Therefore every node and element keeps its tag in every order.
TEST_F(GmshTest, TagsStayWhereOthersMayNameThem) {
  const std::string mesh =
      "$MeshFormat\n2.2 0 8\n$EndMeshFormat\n$Nodes\n3\n1 0 0 0\n2 1 0 0\n3 0 1 0\n$EndNodes\n"
      "$Elements\n2\n1 2 2 0 1 1 2 3\n2 1 2 0 1 1 2\n$EndElements\n";
  const std::string list = "1\n\"a\"\n1\n0\n3\n0\n1\n1\n";
  const auto names_tags = [](const MemoryMesh& read) {
    for (const ArrayInfo& array : read.info_.schema.arrays)
      if (array.role == "gmsh:node_tag") return true;
    return false;
  };
  for (const std::string& harmless :
       {std::string(), std::string("$Comments\n1 2 3\n$EndComments\n"),
        "$NodeData\n" + list + "2 1.5\n$EndNodeData\n"}) {
    EXPECT_FALSE(names_tags(open_text(mesh + harmless))) << harmless;
    expect_round_trip(mesh + harmless);
  }
  for (const std::string& naming :
       {std::string("$MyOwn\n1 2 3\n$EndMyOwn\n"), "$NodeData\n" + list + "7 1.5\n$EndNodeData\n",
        std::string("$Periodic\n1\n1 2 3\n1\n2 9\n$EndPeriodic\n")}) {
    const MemoryMesh read = open_text(mesh + naming);
    ASSERT_TRUE(names_tags(read)) << naming;
    EXPECT_EQ(read.values<std::int64_t>("gmsh:node_tag"), (std::vector<std::int64_t>{1, 2, 3}));
    EXPECT_EQ(read.values<std::int64_t>("gmsh:element_tag"), (std::vector<std::int64_t>{1, 2}));
    expect_round_trip(mesh + naming);
  }
  // The polygon is divided into two parts. The fifth tag of each part is the number of the polygon,
  // its parent.
  const std::string parts =
      "$MeshFormat\n2.2 0 8\n$EndMeshFormat\n$Nodes\n3\n1 0 0 0\n2 1 0 0\n3 0 1 0\n$EndNodes\n"
      "$Elements\n2\n1 34 2 0 1 3 1 2 3\n2 68 5 0 1 0 1 1 1 2 3\n$EndElements\n";
  EXPECT_TRUE(names_tags(open_text(parts)));
  expect_round_trip(parts);
}

TEST_F(GmshTest, TextBetweenSections) {
  const std::string file =
      "$MeshFormat\n2.2 0 8\n$EndMeshFormat\n# made by hand\n\n// twice\n$Nodes\n1\n1 0 0 0\n"
      "$EndNodes\n$Elements\n0\n$EndElements\nlast words\n";
  expect_round_trip(file);
  MemoryMesh mesh = open_text(file);
  write_gmsh(mesh, path("out.msh"));
  EXPECT_EQ(load(path("out.msh")), file);
}

TEST_F(GmshTest, ReadsWindowsLines) {
  std::string file = kVersion41;
  for (std::size_t at = 0; (at = file.find('\n', at)) != std::string::npos; at += 2)
    file.insert(at, "\r");
  expect_round_trip(file);
}

// The nodes of a second-order element are in VTK's order: corners, then midpoints of the edges in
// VTK's order.
TEST_F(GmshTest, SecondOrderNodesStandInVtkOrder) {
  const std::vector<std::pair<int, int>> hexahedron = {{0, 1}, {1, 2}, {2, 3}, {3, 0},
                                                       {4, 5}, {5, 6}, {6, 7}, {7, 4},
                                                       {0, 4}, {1, 5}, {2, 6}, {3, 7}};
  const std::vector<std::pair<int, int>> wedge = {{0, 1}, {1, 2}, {2, 0}, {3, 4}, {4, 5},
                                                  {5, 3}, {0, 3}, {1, 4}, {2, 5}};
  const std::vector<std::pair<int, int>> tetrahedron = {{0, 1}, {1, 2}, {2, 0},
                                                        {0, 3}, {1, 3}, {2, 3}};
  const std::vector<std::pair<int, int>> pyramid = {{0, 1}, {1, 2}, {2, 3}, {3, 0},
                                                    {0, 4}, {1, 4}, {2, 4}, {3, 4}};
  // Edges in the order of Gmsh's documentation.
  const std::vector<std::pair<int, int>> of_gmsh_hexahedron = {{0, 1}, {0, 3}, {0, 4}, {1, 2},
                                                               {1, 5}, {2, 3}, {2, 6}, {3, 7},
                                                               {4, 5}, {4, 7}, {5, 6}, {6, 7}};
  const std::vector<std::pair<int, int>> of_gmsh_wedge = {{0, 1}, {0, 2}, {0, 3}, {1, 2}, {1, 4},
                                                          {2, 5}, {3, 4}, {3, 5}, {4, 5}};
  const std::vector<std::pair<int, int>> of_gmsh_tetrahedron = {{0, 1}, {1, 2}, {2, 0},
                                                                {3, 0}, {2, 3}, {1, 3}};
  const std::vector<std::pair<int, int>> of_gmsh_pyramid = {{0, 1}, {0, 3}, {0, 4}, {1, 2},
                                                            {1, 4}, {2, 3}, {2, 4}, {3, 4}};
  using Edge = std::pair<int, int>;
  const auto check = [](int type, std::size_t corners, const auto& gmsh, const auto& vtk) {
    const GmshType known = gmsh_type(type);
    ASSERT_GE(known.nodes, corners + vtk.size());
    for (std::size_t e = 0; e < vtk.size(); ++e) {
      const std::size_t place = known.permutation[corners + e] - corners;
      const Edge edge = vtk[e], turned = {edge.second, edge.first};
      EXPECT_TRUE(gmsh[place] == edge || gmsh[place] == turned) << "type " << type << " " << e;
    }
  };
  for (const int type : {17, 12}) check(type, 8, of_gmsh_hexahedron, hexahedron);
  for (const int type : {18, 13}) check(type, 6, of_gmsh_wedge, wedge);
  for (const int type : {19, 14}) check(type, 5, of_gmsh_pyramid, pyramid);
  check(11, 4, of_gmsh_tetrahedron, tetrahedron);
  for (int type = 1; type <= 140; ++type) {  // each is a valid permutation
    const auto permutation = gmsh_type(type).permutation;
    std::vector<bool> seen(permutation.size());
    for (const std::uint16_t p : permutation) seen.at(p) = true;
    EXPECT_EQ(std::count(seen.begin(), seen.end(), false), 0) << type;
  }
}

// Gmsh ignores misspelt end markers. The message names them.
TEST_F(GmshTest, NamesMisspeltEndMarkers) {
  for (const auto& [right, wrong] :
       {std::pair{"$EndElements", "$EndElement"}, std::pair{"$EndNodes", "$ENDNOD"},
        std::pair{"$EndElementNodeData", "$ElementEndNodeData"},
        std::pair{"$EndComments", "$EndComment"}}) {
    std::string content = kVersion2;
    const std::string marker = std::string(right) + "\n";
    for (std::size_t at = content.find(marker); at != std::string::npos;
         at = content.find(marker, at + 1))
      content.replace(at, marker.size(), std::string(wrong) + "\n");
    try {
      open_text(content);
      ADD_FAILURE() << wrong;
    } catch (const Failure& failure) {
      EXPECT_NE(failure.error().detail.find(wrong), std::string::npos) << failure.error().detail;
      EXPECT_NE(failure.error().detail.find(right), std::string::npos) << failure.error().detail;
    }
  }
}

// The written file contains the same mesh even if the vertices, cells and references arrive in
// reverse order.
TEST_F(GmshTest, FollowsARenumbering) {
  for (const std::string& file : {kVersion2, kVersion40, kVersion41}) {
    const MemoryMesh source = open_text(file);
    MemoryMesh turned = source;
    const std::uint64_t n = source.info_.vertices, m = source.cells.size();
    for (std::uint64_t v = 0; v < n; ++v)
      std::copy_n(source.points.begin() + static_cast<std::ptrdiff_t>(24 * (n - 1 - v)), 24,
                  turned.points.begin() + static_cast<std::ptrdiff_t>(24 * v));
    std::reverse(turned.cells.begin(), turned.cells.end());
    std::reverse(turned.blocks.begin(), turned.blocks.end());
    for (auto& cell : turned.cells)
      for (auto& corner : cell) corner = n - 1 - corner;
    for (std::size_t a = 0; a < source.arrays.size(); ++a) {
      const std::size_t each = source.info_.array_stride(a);
      for (auto& bytes : turned.arrays[a]) {
        const auto old = bytes;
        for (std::size_t i = 0; i < old.size(); i += each)
          std::copy_n(old.begin() + static_cast<std::ptrdiff_t>(i), each,
                      bytes.begin() + static_cast<std::ptrdiff_t>(old.size() - each - i));
      }
    }
    for (Extra& e : turned.info_.extras) {
      const std::uint64_t count = e.refers == Reference::vertex ? n : m;
      for (std::size_t i = 0; e.refers != Reference::nothing && i < e.data.size(); i += 8) {
        std::int64_t place;
        std::memcpy(&place, e.data.data() + i, 8);
        place = static_cast<std::int64_t>(count) - 1 - place;
        std::memcpy(e.data.data() + i, &place, 8);
      }
    }
    const MemoryMesh result = written(turned);
    const auto shape_of = [](const MemoryMesh& mesh) {  // properties that do not depend on numbers
      std::map<std::pair<std::int64_t, CellShape>, std::vector<std::vector<std::vector<double>>>>
          all;
      for (std::size_t c = 0; c < mesh.cells.size(); ++c) {
        const BlockInfo& block = mesh.info_.schema.blocks[mesh.blocks[c]];
        auto& list = all[{block.id, block.shape}].emplace_back();
        for (const std::uint64_t corner : mesh.cells[c]) list.push_back(mesh.xyz(corner));
      }
      for (auto& [key, list] : all) std::sort(list.begin(), list.end());
      return all;
    };
    EXPECT_EQ(shape_of(result), shape_of(source));
    const auto pairs = [](const MemoryMesh& mesh) {
      std::vector<std::vector<double>> points;
      for (const Extra& e : mesh.info_.extras) {
        for (std::size_t i = 0; e.refers == Reference::vertex && i < e.data.size(); i += 8) {
          std::uint64_t place;
          std::memcpy(&place, e.data.data() + i, 8);
          points.push_back(mesh.xyz(place));
        }
      }
      return points;
    };
    EXPECT_EQ(pairs(result), pairs(source));
    if (file == kVersion2) continue;
    const auto entities = [](const MemoryMesh& mesh) {
      std::map<std::vector<double>, std::int32_t> entity_at;
      const auto rows = mesh.values<std::int32_t>("gmsh:node_entity");
      for (std::size_t v = 0; v < rows.size(); ++v) entity_at[mesh.xyz(v)] = rows[v];
      return entity_at;
    };
    EXPECT_EQ(entities(result), entities(source));
  }
}

// Returns a mesh as the reader of another format might return it. Cell shapes alternate, and the
// mesh has names, steps, and arrays of many kinds.
MemoryMesh foreign_mesh() {
  MemoryMesh mesh;
  mesh.info_.schema.source_format = "vtk";
  mesh.info_.schema.coordinate_type = ScalarType::float32;
  mesh.info_.schema.blocks = {{12, "solid", CellShape::hexahedron, 8},
                              {7, "", CellShape::polygon, 0},
                              {12, "", CellShape::hexahedron, 20}};
  mesh.info_.block_cells = {2, 2, 1};
  mesh.info_.vertices = 24;
  mesh.info_.step_times = {0.25, 1.0 / 3};
  const auto put = [](std::vector<std::byte>& out, auto value) {
    const auto* bytes = reinterpret_cast<const std::byte*>(&value);
    out.insert(out.end(), bytes, bytes + sizeof(value));
  };
  for (int i = 0; i < 72; ++i) put(mesh.points, static_cast<float>(i) / 7);
  const auto range = [](std::uint64_t first, std::uint64_t count) {
    std::vector<std::uint64_t> all(count);
    std::iota(all.begin(), all.end(), first);
    return all;
  };
  mesh.cells = {range(0, 8), range(3, 4), range(2, 20), range(9, 3), range(12, 8)};
  mesh.blocks = {0, 1, 2, 1, 0};
  const auto add = [&](ArrayInfo info, int elements) {
    mesh.info_.schema.arrays.push_back(info);
    auto& steps = mesh.arrays.emplace_back(info.per_step ? 2 : 1);
    for (std::size_t s = 0; s < steps.size(); ++s)
      for (int i = 0; i < elements * static_cast<int>(info.components); ++i) {
        if (info.type == ScalarType::int16)
          put(steps[s], static_cast<std::int16_t>(i - 3));
        else
          put(steps[s], i + 100.0 * static_cast<double>(s));
      }
  };
  add({"two", Location::point, ScalarType::int16, 2, false, {}, "", {}}, 24);
  add({"moving", Location::point, ScalarType::float64, 3, true, {}, "", {}}, 24);
  add({"some", Location::cell, ScalarType::float64, 1, true, {1, 2}, "", {}}, 3);
  add({"wide", Location::cell, ScalarType::float64, 11, false, {}, "", {}}, 5);
  add({"map", Location::cell, ScalarType::float64, 1, false, {}, "exodus:elem_num_map", {}}, 5);
  return mesh;
}

TEST_F(GmshTest, WritesMeshesOfOtherFormats) {
  MemoryMesh source = foreign_mesh();
  const MemoryMesh mesh = written(source, "foreign.msh");
  EXPECT_EQ(mesh.info_.vertices, 24u);
  EXPECT_EQ(mesh.xyz(23)[2], static_cast<double>(71.0f / 7));
  ASSERT_EQ(mesh.cells.size(), 5u);
  const auto tags = mesh.values<std::int64_t>("gmsh:element_tag");
  for (std::size_t c = 0; c < 5; ++c) {
    const auto original = static_cast<std::size_t>(tags[c] - 1);
    EXPECT_EQ(mesh.cells[c], source.cells[original]);
    const BlockInfo& block = mesh.info_.schema.blocks[mesh.blocks[c]];
    EXPECT_EQ(block.name, source.blocks[original] == 0 ? "solid" : "");
    if (original == 1) {
      EXPECT_EQ(block.shape, CellShape::quad);
    }
    if (original == 3) {
      EXPECT_EQ(block.shape, CellShape::triangle);
    }
    EXPECT_EQ(mesh.values<double>("wide [10]")[c], static_cast<double>(11 * original + 10));
  }
  EXPECT_EQ(mesh.info_.step_times, source.info_.step_times);
  EXPECT_EQ(mesh.values<double>("moving", 1), source.values<double>("moving", 1));
  const auto two = mesh.values<double>("two");
  ASSERT_EQ(two.size(), 72u);
  EXPECT_EQ(two[0], -3);
  EXPECT_EQ(two[1], -2);
  EXPECT_EQ(two[2], 0);
  EXPECT_EQ(mesh.values<double>("some", 1).size(), 3u);
  for (const ArrayInfo& array : mesh.info_.schema.arrays) EXPECT_NE(array.name, "map");
  write_gmsh(source, path("foreign2.msh"));
  EXPECT_EQ(load(path("foreign.msh")), load(path("foreign2.msh")));
}

TEST_F(GmshTest, SaysWhatItCannotWrite) {
  MemoryMesh mesh = foreign_mesh();
  mesh.info_.schema.blocks[2].shape = CellShape::other;
  try {
    write_gmsh(mesh, path("out.msh"));
    FAIL();
  } catch (const Failure& failure) {
    EXPECT_EQ(failure.error().code, ErrorCode::unsupported);
  }
  MemoryMesh fine = foreign_mesh();
  try {
    write_gmsh(fine, "/dev/full");
    FAIL();
  } catch (const Failure& failure) {
    EXPECT_EQ(failure.error().code, ErrorCode::output);
  }
  try {
    write_gmsh(fine, path("no such folder/out.msh"));
    FAIL();
  } catch (const Failure& failure) {
    EXPECT_EQ(failure.error().code, ErrorCode::output);
  }
}

TEST_F(GmshTest, EmptyMeshes) {
  expect_round_trip("$MeshFormat\n4.1 0 8\n$EndMeshFormat\n");
  expect_round_trip(
      "$MeshFormat\n4.1 0 8\n$EndMeshFormat\n$Nodes\n0 0 0 0\n$EndNodes\n$Elements\n"
      "0 0 0 0\n$EndElements\n");
  expect_round_trip(
      "$MeshFormat\n2.2 0 8\n$EndMeshFormat\n$Nodes\n0\n$EndNodes\n$Elements\n0\n"
      "$EndElements\n");
  expect_round_trip(
      "$MeshFormat\n2.2 0 8\n$EndMeshFormat\n$NodeData\n1\n\"a\"\n1\n0\n3\n0\n1\n2\n"
      "5 1.5\n7 2.5\n$EndNodeData\n");
  MemoryMesh empty;
  empty.info_.schema.source_format = "vtk";
  EXPECT_EQ(written(empty).info_.vertices, 0u);
}

TEST_F(GmshTest, NamesWhatIsWrong) {
  const std::string head = "$MeshFormat\n2.2 0 8\n$EndMeshFormat\n";
  const std::string nodes = head + "$Nodes\n2\n1 0 0 0\n2 1 0 0\n$EndNodes\n";
  EXPECT_EQ(error_of(""), ErrorCode::corrupt);
  EXPECT_EQ(error_of("hello\n"), ErrorCode::corrupt);
  EXPECT_EQ(error_of("$MeshFormat\n3 1 8\n$EndMeshFormat\n"), ErrorCode::unsupported);
  EXPECT_EQ(error_of("$MeshFormat\n4.1 2 8\n$EndMeshFormat\n"), ErrorCode::corrupt);
  EXPECT_EQ(error_of("$MeshFormat\n4.1 1 4\n$EndMeshFormat\n"), ErrorCode::unsupported);
  EXPECT_EQ(error_of(head + "$Nodes\n2\n1 0 0 0\n"), ErrorCode::corrupt);
  EXPECT_EQ(error_of(head + "$Nodes\n1\n1 0 0 0\n"), ErrorCode::truncated);
  EXPECT_EQ(error_of(head + "$Nodes\n1\n1 0 0 zero\n$EndNodes\n"), ErrorCode::corrupt);
  EXPECT_EQ(error_of(head + "$Nodes\n1\n1 0 0 0\n2 0 0 0\n$EndNodes\n"), ErrorCode::corrupt);
  EXPECT_EQ(error_of(nodes + "$Elements\n1\n1 1 0 1 3\n$EndElements\n"), ErrorCode::corrupt);
  EXPECT_EQ(error_of(nodes + "$Elements\n1\n1 76 0 1 2\n$EndElements\n"), ErrorCode::unsupported);
  EXPECT_EQ(error_of(nodes + "$Comments\n"), ErrorCode::truncated);
  EXPECT_THROW(open(path("missing.msh")), Failure);
}

// Opens, reads and writes a file with arbitrary contents. The only allowed exception is Failure.
bool survives(const std::string& file, const std::string& out) {
  try {
    Spool spool(fs::path(file).parent_path().string());
    MemoryMesh mesh(*open_gmsh(file, spool));
    fs::remove(out);
    write_gmsh(mesh, out);
    return true;
  } catch (const Failure&) {
    return false;
  }
}

// A count that is too large for the size of the file is refused before memory is allocated for its
// elements.
TEST_F(GmshTest, LyingCounts) {
  const std::string v2 = "$MeshFormat\n2.2 0 8\n$EndMeshFormat\n";
  const std::string v4 = "$MeshFormat\n4.1 0 8\n$EndMeshFormat\n";
  const std::string nodes = "$Nodes\n2\n1 0 0 0\n2 1 0 0\n$EndNodes\n";
  const std::string nodes4 = "$Nodes\n1 2 1 2\n1 1 0 2\n1\n2\n0 0 0\n1 0 0\n$EndNodes\n";
  for (const std::string huge :
       {"4000000000", "9223372036854775807", "18446744073709551615", "-1", "1e9"}) {
    for (const std::string& file :
         {v2 + "$Nodes\n" + huge + "\n1 0 0 0\n$EndNodes\n",
          v2 + nodes + "$Elements\n" + huge + "\n1 1 0 1 2\n$EndElements\n",
          v2 + nodes + "$Elements\n1\n1 1 " + huge + " 1 2\n$EndElements\n",
          v2 + nodes + "$Elements\n1\n1 34 0 " + huge + " 1 2\n$EndElements\n",
          v2 + nodes + "$ElementNodeData\n1\n\"a\"\n1\n0\n3\n0\n1\n1\n1 " + huge +
              " 5\n$EndElementNodeData\n",
          v4 + "$Nodes\n" + huge + " 1 1 1\n1 1 0 1\n1\n0 0 0\n$EndNodes\n",
          v4 + "$Nodes\n1 " + huge + " 1 1\n1 1 0 1\n1\n0 0 0\n$EndNodes\n",
          v4 + "$Nodes\n1 1 1 1\n1 1 0 " + huge + "\n1\n0 0 0\n$EndNodes\n",
          v4 + nodes4 + "$Elements\n1 1 1 1\n1 1 1 " + huge + "\n1 1 2\n$EndElements\n",
          v4 + nodes4 + "$Elements\n1 " + huge + " 1 1\n1 1 1 1\n1 1 2\n$EndElements\n",
          v4 + nodes4 + "$Elements\n" + huge + " 1 1 1\n1 1 1 1\n1 1 2\n$EndElements\n"}) {
      EXPECT_THROW(open_text(file), Failure) << file;
    }
    // If the header of a section has an unknown form, the section is kept unchanged. This is not an
    // error.
    for (const std::string& file :
         {v2 + nodes + "$NodeData\n" + huge + "\n$EndNodeData\n",
          v2 + nodes + "$NodeData\n1\n\"a\"\n1\n0\n3\n0\n1\n" + huge + "\n1 5\n$EndNodeData\n"})
      survives(save(file), path("out.msh"));
    // These sections are kept in memory unchanged. A huge count in such a section does no harm,
    // because no memory is allocated for more entries than the section can contain.
    expect_round_trip(v4 + nodes4 + "$Periodic\n" + huge + "\n1 1 1\n0\n1\n1 2\n$EndPeriodic\n");
    expect_round_trip(v4 + nodes4 + "$Entities\n" + huge + " 0 0 0\n$EndEntities\n");
    expect_round_trip(v4 + "$PhysicalNames\n" + huge + "\n1 1 \"a\"\n$EndPhysicalNames\n");
  }
}

TEST_F(GmshTest, TruncationIsNoticed) {
  for (const std::string& text : {kVersion1, kVersion2, kVersion40, kVersion41}) {
    std::vector<std::string> files = {text};
    if (text != kVersion1) files.push_back(in_binary(text, true));
    for (const std::string& file : files) {
      std::size_t opened = 0;
      for (std::size_t length = 0; length < file.size(); length += every(3))
        opened += survives(save(file.substr(0, length)), path("out.msh")) ? 1 : 0;
      EXPECT_LT(opened, 40u);  // only cuts between sections
    }
  }
}

TEST_F(GmshTest, DamageIsSurvived) {
  for (const std::string& text : {kVersion1, kVersion2, kVersion40, kVersion41}) {
    std::vector<std::string> files = {text};
    if (text != kVersion1) files.push_back(in_binary(text, false));
    for (const std::string& file : files) {
      for (std::size_t at = 0; at < file.size(); at += 5 * every(3)) {
        for (const char c : {'\0', '9', '-', static_cast<char>(file[at] ^ 0x80)}) {
          std::string damaged = file;
          damaged[at] = c;
          survives(save(damaged), path("out.msh"));
        }
      }
    }
  }
}

// The extras contradict the mesh, as they may in a damaged .shm file.
TEST_F(GmshTest, DamagedExtrasAreRefused) {
  for (const std::string& file : {kVersion1, kVersion2, kVersion41}) {
    const MemoryMesh whole = open_text(file);
    for (std::size_t e = 0; e < whole.info_.extras.size(); ++e) {
      MemoryMesh mesh = whole;
      mesh.info_.extras.erase(mesh.info_.extras.begin() + static_cast<std::ptrdiff_t>(e));
      try {
        write_gmsh(mesh, path("out.msh"));
      } catch (const Failure&) {
      }
      for (std::size_t at = 0; at < whole.info_.extras[e].data.size(); ++at) {
        mesh = whole;
        mesh.info_.extras[e].data[at] ^= std::byte{0x81};
        try {
          write_gmsh(mesh, path("out.msh"));
        } catch (const Failure&) {
        }
      }
    }
  }
}

TEST_F(GmshTest, CorpusMakesTheRoundTrip) {
  const char* corpus = std::getenv("SHM_CORPUS");
  if (corpus == nullptr || !fs::is_directory(fs::path(corpus) / "gmsh"))
    GTEST_SKIP() << "SHM_CORPUS is not set to a folder with gmsh/";
#if defined(SHM_PYTHON) && defined(SHM_SOURCE_DIR)
  const std::string oracle = "'" SHM_PYTHON "' '" SHM_SOURCE_DIR "/tests/support/gmsh_oracle.py' ";
  const bool ask_gmsh = std::system("'" SHM_PYTHON "' -c 'import gmsh' 2>/dev/null") == 0;
#else
  const std::string oracle;
  const bool ask_gmsh = false;
#endif
  std::size_t files = 0;
  for (const auto& entry : fs::directory_iterator(fs::path(corpus) / "gmsh")) {
    if (entry.path().extension() != ".msh") continue;
    ++files;
    if (!is_sampled(entry.path().filename().string())) continue;
    SCOPED_TRACE(entry.path().string());
    MemoryMesh source = open(entry.path().string());
    expect_same(source, written(source));
    if (!ask_gmsh) continue;
    const std::string command =
        oracle + "'" + entry.path().string() + "' '" + path("out.msh") + "'";
    EXPECT_EQ(std::system(command.c_str()), 0);
  }
  EXPECT_GT(files, 0u);
}

}  // namespace
}  // namespace shm::converters
