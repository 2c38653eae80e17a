// Tests of legacy VTK files: round trips, comparisons by VTK itself, and hostile files.
#include "vtk/legacy/vtk.h"

#include <gtest/gtest.h>
#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <functional>
#include <iterator>
#include <limits>
#include <map>
#include <string>
#include <utility>
#include <vector>

#include "base/failure.h"
#include "support/sanitized.h"
#include "support/vtk_fixture.h"

namespace shm::converters {
namespace {

constexpr const char* kHead =
    "# vtk DataFile Version 3.0\nsmall\nASCII\nDATASET UNSTRUCTURED_GRID\n";
constexpr const char* kTwoTets =
    "POINTS 5 float\n0 0 0 1 0 0 0 1 0 0 0 1 1 1 1\n"
    "CELLS 2 10\n4 0 1 2 3\n4 1 2 3 4\nCELL_TYPES 2\n10\n10\n";

// Returns a text file that uses everything the format allows: CRLF, blank lines, unusual upper and
// lower case, every kind of attribute.
std::string everything_in_text() {
  std::string text =
      "# vtk DataFile Version 4.2\ntitle  with two blanks\nascii\n\ndataset Unstructured_Grid\n"
      "FIELD FieldData 4\nTIME 1 1 double\n0.5\n\nMETADATA\nINFORMATION 0\n\n"
      "some%20names 1 3 string\na%20b\n\nc%25\nvar 1 2 variant\n6 3\n13 hi%20there\n"
      "empty 1 0 int\n\n"
      "POINTS 5 int\n0 0 0 1 0 0\n\n0 1 0 0 0 1 1 1 1\n"
      "CELLS 3 13\n4 0 1 2 3\n4 1 2 3 4\n2 0 4\nCELL_TYPES 3\n10 10 3\n\n"
      "CELL_DATA 3\n"
      "SCALARS s float 2\nLOOKUP_TABLE lut\n1 2.5 3 -4e-3 nan inf\n"
      "LOOKUP_TABLE lut 2\n0 0 0 1 0.5 0.25 1 1\n"
      "COLOR_SCALARS colors 3\n0 0.5 1 0 0 0 1 1 1\n"
      "FIELD cells 3\nbits 1 3 bit\n0 1 1\nNULL_ARRAY\nshorter 1 2 char\n-1 200\n"
      "POINT_DATA 5\n"
      "VECTORS v%20w double\n1 2 3 4 5 6 7 8 9 10 11 12 13 14 15\n"
      "METADATA\nCOMPONENT_NAMES\nx%20x\n\nz\nINFORMATION 4\n"
      "NAME L2_NORM_RANGE LOCATION vtkDataArray\nDATA 2 3.7 24.3 \n"
      "NAME WORDS LOCATION Test\nDATA 4\nDATA%205\n\n\nthree\n"
      "NAME COUNT LOCATION Test\nDATA 2\nNAME LAST LOCATION Test\nDATA 7\n\n"
      "NORMALS n float\n0 0 1 0 0 1 0 0 1 0 0 1 0 0 1\n"
      "TEXTURE_COORDINATES t 2 float\n0 0 0 1 1 0 1 1 .5 .5\n"
      "TENSORS T short\n";
  for (int i = 0; i < 45; ++i) text += std::to_string(i) + ' ';
  text += "\nTENSORS6 T6 unsigned_short\n";
  for (int i = 0; i < 30; ++i) text += std::to_string(i * 2000) + ' ';
  text +=
      "\nGLOBAL_IDS g vtkIdType\n5 4 3 2 1\nPEDIGREE_IDS p string\na\nb\n\nd\ne\n"
      "EDGE_FLAGS e unsigned_char\n0 1 0 1 255\n"
      "SCALARS long long\nLOOKUP_TABLE default\n-9223372036854775808 1 2 3 9223372036854775807\n"
      "SCALARS long unsigned_long 1\nLOOKUP_TABLE default\n0 1 2 3 18446744073709551615\n";
  return text;
}

std::string binary_points() {
  return "POINTS 5 double\n" + big_endian<double>({0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0, 1, 1, 1, 0.1}) +
         "\n";
}

std::string binary_classic() {
  return "# vtk DataFile Version 4.2\nbinary\nBINARY\nDATASET UNSTRUCTURED_GRID\n"
         "FIELD FieldData 2\nname 1 2 string\n\xC3"
         "abc"
         "\x80\x02"
         "de"
         "\nnumbers 1 0 double\n" +
         binary_points() + "CELLS 2 10\n" +
         big_endian<std::int32_t>({4, 0, 1, 2, 3, 4, 1, 2, 3, 4}) + "\nCELL_TYPES 2\n" +
         big_endian<std::int32_t>({10, 10}) + "\nCELL_DATA 2\nGLOBAL_IDS ids vtkIdType\n" +
         big_endian<std::int32_t>({10, 0x0a0a0a0a}) + "\nFIELD f 2\nbits 9 2 bit\n" +
         std::string("\xAA\x55\x40", 3) + "\nw 1 2 vtktypeint64\n" +
         big_endian<std::int64_t>({-1, std::int64_t{1} << 60}) +
         "\nMETADATA\nINFORMATION 0\n\nPOINT_DATA 5\nCOLOR_SCALARS c 1\n" +
         std::string("\x00\x0a\x20\x80\xff", 5) + "\nLOOKUP_TABLE unused 1\n" +
         std::string("\x01\x02\x03\x04", 4) + "\n";
}

std::string binary_offsets() {
  return "# vtk DataFile Version 5.1\nbinary\nBINARY\nDATASET UNSTRUCTURED_GRID\n" +
         binary_points() + "CELLS 3 8\nOFFSETS vtktypeint64\n" +
         big_endian<std::int64_t>({0, 4, 8}) + "\nCONNECTIVITY vtktypeint32\n" +
         big_endian<std::int32_t>({0, 1, 2, 3, 1, 2, 3, 4}) + "\nCELL_TYPES 2\n" +
         big_endian<std::int32_t>({10, 10}) + "\nPOINT_DATA 5\nVECTORS v float\n" +
         big_endian<float>({0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 13, 14}) + "\n";
}

TEST_F(VtkTest, RecognizesItsFiles) {
  const auto looks = [](const std::string& text) {
    return looks_like_vtk(std::as_bytes(std::span(text)));
  };
  EXPECT_TRUE(looks(kHead));
  EXPECT_FALSE(looks("# vtk DataFile"));
  EXPECT_FALSE(looks("$MeshFormat\n4.1 0 8\n$EndMeshFormat"));
  EXPECT_FALSE(looks(""));
}

TEST_F(VtkTest, EverythingInTextComesBack) {
  const auto mesh = open_text(everything_in_text());
  const Snapshot before = take(*mesh);
  write_vtk(*mesh, path("out.vtk"), spool_);
  expect_same(before, take(*open_vtk(path("out.vtk"), spool_)));
  // If a written file is read and written again, no byte changes.
  write_vtk(*open_vtk(path("out.vtk"), spool_), path("again.vtk"), spool_);
  EXPECT_EQ(file_content(path("out.vtk")), file_content(path("again.vtk")));
}

TEST_F(VtkTest, AnArrayWithSeveralRolesIsOne) {
  const std::string points = kTwoTets + std::string("POINT_DATA 5\n");
  const std::string ones = " float\n1 2 3\n4 5 6\n7 8 9\n10 11 12\n13 14 15\n";
  const std::string others = " float\n1 2 3\n4 5 6\n7 8 9\n10 11 12\n13 14 -15\n";
  const auto arrays = [&](const std::string& data) {
    const auto mesh = open_text(kHead + points + data);
    const Snapshot before = take(*mesh);
    write_vtk(*mesh, path("out.vtk"), spool_);
    expect_same(before, take(*open_vtk(path("out.vtk"), spool_)));
    const std::string written = file_content(path("out.vtk"));
    EXPECT_EQ(written.substr(written.find("POINT_DATA")),
              (points + data).substr(points.find("POINT_DATA")));
    return before.info.schema.arrays.size();
  };
  EXPECT_EQ(arrays("VECTORS v" + ones + "NORMALS v" + ones), 1U);
  EXPECT_EQ(arrays("VECTORS v" + ones + "NORMALS v" + others), 2U);
  EXPECT_EQ(arrays("VECTORS v" + ones + "NORMALS w" + ones), 2U);
  EXPECT_EQ(arrays("VECTORS v" + ones + "VECTORS v" + ones), 2U);  // with one role
}

TEST_F(VtkTest, EverythingInTextMeansWhatItShould) {
  const auto mesh = open_text(everything_in_text());
  const Snapshot all = take(*mesh);
  EXPECT_EQ(all.info.schema.coordinate_type, ScalarType::float64);
  ASSERT_EQ(all.info.schema.blocks.size(), 2U);
  EXPECT_EQ(all.info.schema.blocks[0].shape, CellShape::tetrahedron);
  EXPECT_EQ(all.info.schema.blocks[1].shape, CellShape::line);
  std::map<std::string, std::size_t> index;
  for (std::size_t i = 0; i < all.info.schema.arrays.size(); ++i)
    index[all.info.schema.arrays[i].name] = i;
  EXPECT_EQ(all.info.schema.arrays[index.at("v w")].components, 3U);
  EXPECT_EQ(all.info.schema.arrays[index.at("T6")].type, ScalarType::uint16);
  EXPECT_EQ(as<float>(all.arrays[index.at("s")])[3], -4e-3F);
  EXPECT_TRUE(std::isnan(as<float>(all.arrays[index.at("s")])[4]));
  EXPECT_EQ(as<std::int64_t>(all.arrays[index.at("g")]),
            (std::vector<std::int64_t>{5, 4, 3, 2, 1}));
  EXPECT_EQ(as<std::uint64_t>(all.arrays[index.at("long")])[4],
            std::numeric_limits<std::uint64_t>::max());
  EXPECT_EQ(text_of(find_extra(all.info, "vtk/data/1")), "a%20b\n\nc%25\n");
  EXPECT_EQ(text_of(find_extra(all.info, "vtk/data/2")), "6 3\n13 hi%20there\n");
  const std::string skeleton = text_of(find_extra(all.info, "vtk/skeleton"));
  EXPECT_NE(skeleton.find("4.2\ntitle  with two blanks\nASCII\n"), std::string::npos);
  EXPECT_NE(skeleton.find("|COMPONENT_NAMES\n|x%20x\n|\n|z\n|INFORMATION 4\n"), std::string::npos);
}

// Strings and bits are not numeric data. They nevertheless belong to points and cells, and must be
// renumbered with them.
TEST_F(VtkTest, StringsAndBitsFollowARenumbering) {
  const std::string text =
      std::string(kHead) +
      "POINTS 5 float\n0 0 0 1 0 0 2 0 0 3 0 0 4 0 0\nCELLS 2 10\n4 4 3 2 1\n4 0 1 2 3\n"
      "CELL_TYPES 2\n10 10\nPOINT_DATA 5\nPEDIGREE_IDS names string\nzero\none\n\nzero\nfour%20\n"
      "FIELD f 2\nbits 1 5 bit\n0 1 1 0 0\nvariants 1 5 variant\n6 0\n6 1\n13 two\n6 3\n6 4\n";
  const auto mesh = open_text(text);
  const Snapshot before = take(*mesh);
  EXPECT_EQ(as<std::uint32_t>(before.arrays[0]), (std::vector<std::uint32_t>{0, 1, 2, 0, 3}));
  EXPECT_EQ(text_of(find_extra(before.info, "vtk/strings/0")), "zero\none\n\nfour%20\n");
  write_vtk(*mesh, path("out.vtk"), spool_);
  expect_same(before, take(*open_vtk(path("out.vtk"), spool_)));
  write_vtk(*through_shm(*mesh, Order::stream, spool_), path("out.vtk"), spool_);
  const std::string out = file_content(path("out.vtk"));
  EXPECT_NE(out.find("POINTS 5 float\n4 0 0\n3 0 0\n2 0 0\n1 0 0\n0 0 0\n"), std::string::npos);
  EXPECT_NE(out.find("names string\nfour%20\nzero\n\none\nzero\n"), std::string::npos);
  EXPECT_NE(out.find("bits 1 5 bit\n0\n0\n1\n1\n0\n"), std::string::npos);
  EXPECT_NE(out.find("variants 1 5 variant\n6 4\n6 3\n13 two\n6 1\n6 0\n"), std::string::npos);
}

TEST_F(VtkTest, LineEndsOfWindowsChangeNothing) {
  std::string text = everything_in_text();
  const Snapshot before = take(*open_text(text));
  for (std::size_t at = 0; (at = text.find('\n', at)) != std::string::npos; at += 2)
    text.insert(at, 1, '\r');
  expect_same(before, take(*open_text(text)));
}

TEST_F(VtkTest, BinaryComesBackByteForByte) {
  for (const std::string& bytes : {binary_classic(), binary_offsets()}) {
    write_vtk(*open_text(bytes), path("out.vtk"), spool_);
    const std::string out = file_content(path("out.vtk"));
    write_vtk(*open_vtk(path("out.vtk"), spool_), path("again.vtk"), spool_);
    EXPECT_EQ(out, file_content(path("again.vtk")));
    expect_same(take(*open_text(bytes)), take(*open_vtk(path("out.vtk"), spool_)));
  }
  const Snapshot all = take(*open_text(binary_classic()));
  EXPECT_EQ(as<double>(all.points).back(), 0.1);
  EXPECT_EQ(all.corners, (std::vector<std::uint64_t>{0, 1, 2, 3, 1, 2, 3, 4}));
  EXPECT_EQ(as<std::int32_t>(all.arrays[0]), (std::vector<std::int32_t>{10, 0x0a0a0a0a}));
  EXPECT_EQ(as<std::int64_t>(all.arrays[2])[1], std::int64_t{1} << 60);
  EXPECT_EQ(all.info.schema.arrays[1].name, "bits");
  EXPECT_EQ(as<std::uint8_t>(all.arrays[1]),
            (std::vector<std::uint8_t>{1, 0, 1, 0, 1, 0, 1, 0, 0, 1, 0, 1, 0, 1, 0, 1, 0, 1}));
  EXPECT_EQ(text_of(find_extra(all.info, "vtk/data/0")),
            "\xC3"
            "abc"
            "\x80\x02"
            "de");
}

TEST_F(VtkTest, CellKindsBecomeBlocks) {
  const auto mesh =
      open_text(std::string(kHead) +
                "POINTS 8 float\n0 0 0 1 0 0 1 1 0 0 1 0 0 0 1 1 0 1 1 1 1 0 1 1\n"
                "CELLS 6 61\n8 0 1 3 2 4 5 7 6\n4 0 1 3 2\n3 0 1 2\n8 0 1 2 3 4 5 6 7\n4 4 5 6 7\n"
                "28 5 4 0 1 2 3 4 4 5 6 7 4 0 1 5 4 4 1 2 6 5 6 3 0 4 7 6 2\n"
                "CELL_TYPES 6\n11 8 7 12 7 42\n");
  const Snapshot all = take(*mesh);
  const auto& blocks = all.info.schema.blocks;
  ASSERT_EQ(blocks.size(), 5U);
  EXPECT_EQ(blocks[0], (BlockInfo{11, "", CellShape::hexahedron, 8}));
  EXPECT_EQ(blocks[1], (BlockInfo{8, "", CellShape::quad, 4}));
  EXPECT_EQ(blocks[2], (BlockInfo{7, "", CellShape::polygon, 0}));
  EXPECT_EQ(blocks[3], (BlockInfo{12, "", CellShape::hexahedron, 8}));
  EXPECT_EQ(blocks[4], (BlockInfo{42, "", CellShape::faces, 0}));
  EXPECT_EQ(all.blocks, (std::vector<std::uint32_t>{0, 1, 2, 3, 2, 4}));
  EXPECT_TRUE(std::equal(all.corners.begin(), all.corners.begin() + 8, all.corners.begin() + 15));
  EXPECT_EQ(find_extra(all.info, "vtk/polyhedron/face_sizes"), nullptr);
  EXPECT_EQ(std::vector<std::uint64_t>(all.corners.end() - 7, all.corners.end()),
            (std::vector<std::uint64_t>{3, 0, 4, 7, 6, 2, 3}));
  write_vtk(*mesh, path("out.vtk"), spool_);
  expect_same(all, take(*open_vtk(path("out.vtk"), spool_)));
  EXPECT_NE(file_content(path("out.vtk")).find("\n8 0 1 3 2 4 5 7 6\n4 0 1 3 2\n"),
            std::string::npos);
}

// Some programs write second-order cells with the type of linear cells. The number of nodes then
// determines the real type.
TEST_F(VtkTest, LinearTypesOfSecondOrderAreWhatTheyAre) {
  for (const auto& [type, nodes, shape] :
       {std::tuple(12, 20u, CellShape::hexahedron), std::tuple(13, 15u, CellShape::wedge),
        std::tuple(12, 9u, CellShape::other), std::tuple(11, 20u, CellShape::other)}) {
    std::string text = std::string(kHead) + "POINTS 20 float\n";
    for (int i = 0; i < 20; ++i) text += std::to_string(i) + " 0 0 ";
    text += "\nCELLS 1 " + std::to_string(nodes + 1) + "\n" + std::to_string(nodes);
    for (std::uint32_t i = 0; i < nodes; ++i) text += ' ' + std::to_string(i);
    const auto mesh = open_text(text + "\nCELL_TYPES 1\n" + std::to_string(type) + "\n");
    const Snapshot all = take(*mesh);
    EXPECT_EQ(all.info.schema.blocks.at(0), (BlockInfo{type, "", shape, nodes}));
    write_vtk(*mesh, path("out.vtk"), spool_);
    expect_same(all, take(*open_vtk(path("out.vtk"), spool_)));
  }
}

// A face of a polyhedron may repeat its first point or have no points at all. Such faces are stored
// separately from the cells.
TEST_F(VtkTest, PolyhedraOfOddFacesComeBack) {
  for (const std::string face : {"3 0 1 0", "0"}) {
    const int numbers = face == "0" ? 1 : 4;
    const auto mesh =
        open_text(std::string(kHead) + "POINTS 4 float\n0 0 0 1 0 0 1 1 0 0 1 1\n" + "CELLS 2 " +
                  std::to_string(12 + numbers) + "\n5 1 3 1 2 3\n" + std::to_string(5 + numbers) +
                  " 2 3 0 1 2 " + face + "\nCELL_TYPES 2\n42 42\n");
    const Snapshot all = take(*mesh);
    EXPECT_EQ(all.info.schema.blocks.at(0), (BlockInfo{42, "", CellShape::polyhedron, 0}));
    EXPECT_EQ(as<std::int64_t>(find_extra(all.info, "vtk/polyhedron/face_sizes")->data),
              (std::vector<std::int64_t>{3, 3, numbers - 1}));
    EXPECT_EQ(find_extra(all.info, "vtk/polyhedron/cells")->refers, Reference::cell);
    write_vtk(*mesh, path("out.vtk"), spool_);
    expect_same(all, take(*open_vtk(path("out.vtk"), spool_)));
  }
}

TEST_F(VtkTest, EmptyMeshesAndMeshesWithoutCellsComeBack) {
  const std::string head = kHead;
  for (const std::string& text :
       {head + "POINTS 0 float\n", head + "POINTS 1 double\n1 2 3\n",
        head + "POINTS 0 float\nCELLS 0 0\nCELL_TYPES 0\nPOINT_DATA 0\nSCALARS a int\n"
               "LOOKUP_TABLE default\n"}) {
    const Snapshot before = take(*open_text(text));
    write_vtk(*open_text(text), path("out.vtk"), spool_);
    expect_same(before, take(*open_vtk(path("out.vtk"), spool_)));
  }
}

// Lists of strings may also come from .shm files, and may therefore be damaged.
TEST_F(VtkTest, BentListsOfStringsAreRefused) {
  const auto with_list = [&](const std::string& encoding, const std::string& list) {
    const std::string values = encoding == "ASCII" ? "a\nb\n"
                                                   : "\xC1"
                                                     "a\xC1"
                                                     "b\n";
    const std::string points =
        encoding == "ASCII" ? "0 0 0 1 1 1\n" : big_endian<float>({0, 0, 0, 1, 1, 1}) + "\n";
    const auto mesh = open_text("# vtk DataFile Version 3.0\nsmall\n" + encoding +
                                "\nDATASET UNSTRUCTURED_GRID\nPOINTS 2 float\n" + points +
                                "POINT_DATA 2\nPEDIGREE_IDS p string\n" + values);
    BentExtra bent(*mesh, "vtk/strings/0", list);
    write_vtk(bent, path("out.vtk"), spool_);
  };
  with_list("ASCII", "a\nb\n");
  with_list("BINARY",
            "\xC1"
            "a\xC1"
            "b");
  for (const char* list : {"", "a\n", "a\nb"})
    EXPECT_EQ(code_of([&] { with_list("ASCII", list); }), ErrorCode::corrupt) << list;
  for (const char* list : {"",
                           "\xC1"
                           "a",
                           "\xC1"
                           "a\xC2"
                           "b",
                           "\xC1"
                           "a\x80",
                           "\xC1"
                           "a\x01"})
    EXPECT_EQ(code_of([&] { with_list("BINARY", list); }), ErrorCode::corrupt) << list;
}

// A mesh as the reader of another format might return it. It has blocks with numbers, time steps,
// arrays on some of the blocks, and arrays with roles.
class ForeignMesh : public MeshSource {
 public:
  ForeignMesh() {
    info_.schema.source_format = "exodus";
    info_.schema.blocks = {{100, "hexes", CellShape::hexahedron, 8},
                           {7, "shells", CellShape::quad, 4}};
    const auto add = [&](ArrayInfo array) { info_.schema.arrays.push_back(std::move(array)); };
    add({"temp at nodes", Location::point, ScalarType::float32, 1, true, {}, {}, {}});
    add({"stress", Location::cell, ScalarType::float64, 2, true, {0}, {}, {}});
    add({"material", Location::cell, ScalarType::int32, 1, false, {1}, {}, {}});
    add({"map", Location::point, ScalarType::int32, 1, false, {}, "exodus:node_num_map", {}});
    info_.vertices = 8;
    info_.block_cells = {1, 1};
    info_.step_times = {0.25, 1.5};
  }
  const MeshInfo& info() const override { return info_; }
  void read_points(std::uint64_t first, std::uint64_t count, std::byte* out) override {
    for (std::uint64_t i = first * 3; i < (first + count) * 3; ++i) put<double>(out, double(i));
  }
  bool next_cells(CellBatch& out, std::size_t max_cells) override {
    out.clear();
    for (; out.size() < max_cells && cell_ < 2; ++cell_) {
      out.blocks.push_back(cell_ == 0 ? 1 : 0);
      for (std::uint64_t i = 0; i < (cell_ == 0 ? 4U : 8U); ++i) out.corners.push_back(i);
      out.corner_begin.push_back(out.corners.size());
    }
    return out.size() > 0;
  }
  void rewind_cells() override { cell_ = 0; }
  void read_array(std::size_t array, std::uint64_t step, std::uint64_t first, std::uint64_t count,
                  std::byte* out) override {
    for (std::uint64_t i = first; i < first + count; ++i) {
      if (array == 0) put<float>(out, float(i + 10 * step));
      if (array == 1) put<double>(out, double(step)), put<double>(out, -1);
      if (array == 2) put<std::int32_t>(out, 42);
    }
  }

 private:
  template <class T>
  static void put(std::byte*& out, T value) {
    std::memcpy(out, &value, sizeof value);
    out += sizeof value;
  }
  MeshInfo info_;
  std::uint64_t cell_ = 0;
};

TEST_F(VtkTest, MeshesOfOtherFormatsGetPlainFiles) {
  ForeignMesh mesh;
  write_vtk(mesh, path("out.vtk"), spool_);
  const Snapshot all = take(*open_vtk(path("out.vtk"), spool_));
  EXPECT_TRUE(
      text_of(find_extra(all.info, "vtk/skeleton")).starts_with("4.2\nvtk output\nBINARY\n"));
  EXPECT_EQ(all.blocks, (std::vector<std::uint32_t>{0, 1}));
  EXPECT_EQ(all.info.schema.blocks[0].id, 9);
  EXPECT_EQ(all.info.schema.blocks[1].id, 12);
  std::vector<std::string> names;
  for (const ArrayInfo& array : all.info.schema.arrays) names.push_back(array.name);
  EXPECT_EQ(names, (std::vector<std::string>{"BlockId", "stress", "material", "temp at nodes"}));
  EXPECT_EQ(as<std::int32_t>(all.arrays[0]), (std::vector<std::int32_t>{7, 100}));
  const auto stress = as<double>(all.arrays[1]);
  EXPECT_TRUE(std::isnan(stress[0]) && std::isnan(stress[1]));
  EXPECT_EQ(stress[2], 1);
  EXPECT_EQ(as<std::int32_t>(all.arrays[2]), (std::vector<std::int32_t>{42, 0}));
  EXPECT_EQ(as<float>(all.arrays[3])[3], 13);
  EXPECT_EQ(as<double>(find_extra(all.info, "vtk/data/0")->data), (std::vector<double>{1.5}));
}

// Extras may also come from .shm files. Extras that contradict the mesh must be refused before they
// are used.
class BentMesh : public ForeignMesh {
 public:
  explicit BentMesh(std::vector<std::pair<std::string, std::string>> extras) : bent_(info_of()) {
    bent_.schema.source_format = "vtk";
    for (auto& [key, text] : extras) {
      Extra extra{key, ScalarType::uint8, Reference::nothing, {text.size()}, {}};
      const auto bytes = std::as_bytes(std::span(text));
      extra.data.assign(bytes.begin(), bytes.end());
      if (key.find("skeleton") == std::string::npos) extra.type = ScalarType::int32;
      bent_.extras.push_back(std::move(extra));
    }
  }
  const MeshInfo& info() const override { return bent_; }

 private:
  static MeshInfo info_of() { return ForeignMesh().info(); }
  MeshInfo bent_;
};

TEST_F(VtkTest, BentExtrasAreRefused) {
  const std::string head = "4.2\nt\nBINARY\n";
  const std::string polyhedra = big_endian<std::int32_t>({42 << 24, 42 << 24});
  const std::vector<std::vector<std::pair<std::string, std::string>>> cases = {
      {{"vtk/skeleton", ""}},
      {{"vtk/skeleton", "9.9\nt\nBINARY\n"}},
      {{"vtk/skeleton", head + "NONSENSE\n"}},
      {{"vtk/skeleton", head + "|metadata of nothing\n"}},
      {{"vtk/skeleton", head + "ARRAY x0 name int 1 1\n"}},
      {{"vtk/skeleton", head + "ARRAY x0 name int 99999999999 99999999999\n"},
       {"vtk/data/0", "abcd"}},
      {{"vtk/skeleton", head + "ARRAY x0 name double 1 1\n"}, {"vtk/data/0", "abcd"}},
      {{"vtk/skeleton", head + "ARRAY x0 name int 1 2\n"}, {"vtk/data/0", "abcd"}},
      {{"vtk/cell_types", "abcd"}},
      {{"vtk/cell_types", "abcdefgh"}},
      {{"vtk/cell_types", polyhedra}},
  };
  for (const auto& extras : cases) {
    BentMesh mesh(extras);
    EXPECT_THROW(write_vtk(mesh, path("out.vtk"), spool_), Failure) << extras[0].second;
  }
  BentMesh moved({{"vtk/skeleton", head + "CELL_DATA\nFIELD f 2\nARRAY a0 a int 1 2\n"
                                          "ARRAY a99 a int 1 2\nSCALARS a2 m int 1 2 t\n"}});
  write_vtk(moved, path("out.vtk"),
            spool_);  // arrays that have moved are still written
  EXPECT_EQ(open_vtk(path("out.vtk"), spool_)->info().schema.arrays.size(), 3U);
}

TEST_F(VtkTest, LiesAndNonsenseAreRefused) {
  const std::string head = kHead, tets = std::string(kHead) + kTwoTets;
  const std::string rows = "POINTS 2 float\n0 0 0 1 1 1\nCELLS ";
  const std::string polyhedron = rows + "1 ";
  const std::vector<std::pair<ErrorCode, std::string>> cases = {
      {ErrorCode::truncated, ""},
      {ErrorCode::corrupt, "# vtk DataFile Version x\na\nASCII\n"},
      {ErrorCode::unsupported, "# vtk DataFile Version 6.0\na\nASCII\n"},
      {ErrorCode::corrupt, "# vtk DataFile Version 3.0\na\nEBCDIC\n"},
      {ErrorCode::unsupported, "# vtk DataFile Version 3.0\na\nASCII\nDATASET DIRECTED_GRAPH\n"},
      {ErrorCode::unsupported, "# vtk DataFile Version 3.0\na\nASCII\nFIELD f 0\n"},
      {ErrorCode::corrupt, "# vtk DataFile Version 3.0\na\nASCII\nPOINTS 0 float\n"},
      {ErrorCode::truncated, head},
      {ErrorCode::corrupt, head + "POINTS 18446744073709551615 char\n"},
      {ErrorCode::corrupt, head + "POINTS 18446744073709551616 float\n"},
      {ErrorCode::corrupt, head + "POINTS -1 float\n"},
      {ErrorCode::truncated, head + "POINTS 4000000000000 float\n0 0 0\n"},
      {ErrorCode::unsupported, head + "POINTS 1 string\na\nb\nc\n"},
      {ErrorCode::corrupt, head + "POINTS 1 float\n0 0 x\n"},
      {ErrorCode::truncated, head + "POINTS 1 float\n0 0 0\nCELLS 1 2\n1 0\n"},
      {ErrorCode::corrupt, head + rows + "1 3\n1 0 1\nCELL_TYPES 1\n1\n"},
      {ErrorCode::corrupt, head + rows + "2 2\n1 0\nCELL_TYPES 2\n1 1\n"},
      {ErrorCode::corrupt, head + rows + "1 2\n9 0\nCELL_TYPES 1\n1\n"},
      {ErrorCode::corrupt, head + rows + "1 2\n-9 0\nCELL_TYPES 1\n1\n"},
      {ErrorCode::corrupt, head + rows + "1 2\n1 2\nCELL_TYPES 1\n1\n"},
      {ErrorCode::corrupt, head + rows + "1 2\n1 -1\nCELL_TYPES 1\n1\n"},
      {ErrorCode::corrupt, head + rows + "1 2\n1 0\nCELL_TYPES 1\n256\n"},
      {ErrorCode::corrupt, head + rows + "1 2\n1 0\nCELL_TYPES 2\n1 1\n"},
      {ErrorCode::corrupt, head + polyhedron + "1\n0\nCELL_TYPES 1\n42\n"},
      {ErrorCode::corrupt, head + polyhedron + "2\n1 -1\nCELL_TYPES 1\n42\n"},
      {ErrorCode::corrupt, head + polyhedron + "3\n2 1 9\nCELL_TYPES 1\n42\n"},
      {ErrorCode::corrupt, head + polyhedron + "4\n3 1 1 2\nCELL_TYPES 1\n42\n"},
      {ErrorCode::corrupt, head + polyhedron + "4\n3 1 0 0\nCELL_TYPES 1\n42\n"},
      {ErrorCode::corrupt, tets + "CELL_DATA 3\n"},
      {ErrorCode::corrupt, tets + "POINT_DATA 4\n"},
      {ErrorCode::corrupt, tets + "POINTS 0 float\n"},
      {ErrorCode::corrupt, tets + "NONSENSE\n"},
      {ErrorCode::corrupt, tets + "SCALARS a float\n"},
      {ErrorCode::corrupt, tets + "POINT_DATA 5\nSCALARS a colour\nLOOKUP_TABLE default\n"},
      {ErrorCode::corrupt, tets + "POINT_DATA 5\nSCALARS a int x\nLOOKUP_TABLE default\n"},
      {ErrorCode::corrupt, tets + "POINT_DATA 5\nSCALARS a int 1\n1 2 3 4 5\n"},
      {ErrorCode::truncated, tets + "POINT_DATA 5\nVECTORS a int\n1 2 3 4 5\n"},
      {ErrorCode::corrupt, tets + "POINT_DATA 5\nFIELD f 1\na 9999999999999 9999999999999 int\n"},
      {ErrorCode::truncated, tets + "POINT_DATA 5\nFIELD f 99999999999\na 1 5 int\n1 2 3 4 5\n"},
      {ErrorCode::truncated, tets + "POINT_DATA 5\nLOOKUP_TABLE t 99999999999\n"},
      {ErrorCode::corrupt, tets + "POINT_DATA 5\nEDGE_FLAGS e char\n1 2 3 4 256\n"},
      {ErrorCode::truncated, tets + "POINT_DATA 5\nPEDIGREE_IDS e string\na\nb\n"},
  };
  for (const auto& [code, text] : cases)
    EXPECT_EQ(code_of([&, &bytes = text] { open_text(bytes); }), code) << text;
}

TEST_F(VtkTest, CellsWithTooManyNodesAreNotSupported) {
  std::string text = std::string(kHead) + "POINTS 1 float\n0 0 0\nCELLS 1 65538\n65537";
  for (int i = 0; i < 65537; ++i) text += " 0";
  EXPECT_EQ(code_of([&] { open_text(text + "\nCELL_TYPES 1\n2\n"); }), ErrorCode::unsupported);
}

TEST_F(VtkTest, LyingOffsetsAreRefused) {
  const auto with_offsets = [](const std::vector<std::int64_t>& offsets) {
    std::string bytes = binary_offsets();
    const std::string right = big_endian<std::int64_t>({0, 4, 8});
    return bytes.replace(bytes.find(right), right.size(), big_endian<std::int64_t>(offsets));
  };
  open_text(with_offsets({0, 4, 8}));
  open_text(with_offsets({0, 8, 8}));
  for (const auto& offsets : std::vector<std::vector<std::int64_t>>{
           {1, 4, 8}, {0, 9, 8}, {0, 4, 3}, {0, 4, 7}, {0, 4, 9}, {0, -4, 8}})
    EXPECT_EQ(code_of([&] { open_text(with_offsets(offsets)); }), ErrorCode::corrupt);
}

TEST_F(VtkTest, EveryTruncationIsSurvived) {
  for (const std::string& whole : {everything_in_text(), binary_classic(), binary_offsets()}) {
    const std::size_t types = whole.find("CELL_TYPES");
    for (std::size_t length = 0; length < whole.size(); ++length) {
      const std::string file = write_file("cut.vtk", whole.substr(0, length));
      Spool spool(directory_.string());
      // A file that is cut before the end of CELL_TYPES does not contain a complete mesh. If a text
      // file is cut later, it may still be valid.
      if (length < types && whole.find("CELLS") < length) {
        EXPECT_THROW(open_vtk(file, spool), Failure) << length;
      } else {
        try_to_read(file, spool);
      }
    }
  }
}

TEST_F(VtkTest, TruncatedBinaryDataIsCalledTruncated) {
  const std::string whole = binary_offsets();
  for (const std::size_t missing : {2U, 20U, 59U}) {
    const std::string cut = whole.substr(0, whole.size() - missing);
    EXPECT_EQ(code_of([&] { open_text(cut); }), ErrorCode::truncated) << missing;
  }
}

TEST_F(VtkTest, FlippedBytesAreSurvived) {
  for (const std::string& whole : {everything_in_text(), binary_classic(), binary_offsets()}) {
    for (std::size_t at = 0; at < whole.size(); ++at) {
      for (const int flip : {0x01, 0x10, 0x80}) {
        std::string bent = whole;
        bent[at] = static_cast<char>(bent[at] ^ flip);
        Spool spool(directory_.string());
        try_to_read(write_file("bent.vtk", bent), spool);
      }
    }
  }
}

TEST_F(VtkTest, FullDisksAreReported) {
  if (!fs::exists("/dev/full")) GTEST_SKIP() << "no /dev/full here";
  const auto mesh = open_text(everything_in_text());
  EXPECT_EQ(code_of([&] { write_vtk(*mesh, "/dev/full", spool_); }), ErrorCode::output);
  EXPECT_EQ(code_of([&] { write_vtk(*mesh, path("no/such/folder"), spool_); }), ErrorCode::output);
  EXPECT_EQ(code_of([&] { open_vtk(path("absent.vtk"), spool_); }), ErrorCode::io);
}

TEST_F(VtkTest, VtkAgreesWithWhatWeWriteOfItsSamples) {
  for (const char* version : {"42", "51"}) {
    for (const char* encoding : {"ASCII", "BINARY"}) {
      int status = 0;
      const std::string kind = std::string(version) + ' ' + encoding + ' ';
      if (!run_oracle("--sample " + kind + path("in.vtk"), &status))
        GTEST_SKIP() << "/usr/bin/python3 has no module vtk";
      ASSERT_EQ(status, 0);
      write_vtk(*open_vtk(path("in.vtk"), spool_), path("out.vtk"), spool_);
      ASSERT_TRUE(run_oracle(path("in.vtk") + ' ' + path("out.vtk"), &status));
      EXPECT_EQ(status, 0) << kind;
    }
  }
}

TEST_F(VtkTest, CorpusComesBack) {
  const char* corpus = std::getenv("SHM_CORPUS");
  if (corpus == nullptr || !fs::is_directory(fs::path(corpus) / "vtk"))
    GTEST_SKIP() << "SHM_CORPUS names no folder with meshes";
  for (const auto& file : fs::directory_iterator(fs::path(corpus) / "vtk")) {
    if (!is_sampled(file.path().filename().string())) continue;
    SCOPED_TRACE(file.path().filename().string());
    const auto mesh = open_vtk(file.path().string(), spool_);
    write_vtk(*mesh, path("out.vtk"), spool_);
    expect_same(take(*mesh), take(*open_vtk(path("out.vtk"), spool_)));
    int status = 0;
    const bool asked = run_oracle("'" + file.path().string() + "' " + path("out.vtk"), &status);
    EXPECT_TRUE(!asked || status == 0);
  }
}

}  // namespace
}  // namespace shm::converters
