// Tests of legacy VTK files with structured and polygonal data: how the files are interpreted,
// round trips that keep the kind of data set, comparisons by VTK itself, and hostile files.
#include <gtest/gtest.h>

#include <array>
#include <numeric>

#include "support/vtk_fixture.h"
#include "vtk/legacy/lattice.h"

namespace shm::converters {
namespace {

std::string head(const std::string& version, const std::string& encoding,
                 const std::string& dataset) {
  return "# vtk DataFile Version " + version + "\nsmall\n" + encoding + "\nDATASET " + dataset +
         "\n";
}

std::string old_image() {
  return head("1.0", "ASCII", "STRUCTURED_POINTS") +
         "ORIGIN 1 2. 3e0\nASPECT_RATIO 0.1 .25 -1\nDIMENSIONS 3 2 2\n"
         "POINT_DATA 12\nSCALARS s float\nLOOKUP_TABLE default\n0 1 2 3 4 5 6 7 8 9 10 11\n"
         "CELL_DATA 2\nVECTORS v int\n1 2 3 4 5 6\n";
}

std::string old_rectilinear() {
  return head("2.0", "ASCII", "RECTILINEAR_GRID") +
         "Z_COORDINATES 2 int\n-1 1\nDIMENSIONS 3 1 2\nX_COORDINATES 3 float\n0.1 1 4\n"
         "FIELD FieldData 1\nTIME 1 1 double\n0.5\n"
         "Y_COORDINATES 1 double\n.3\nMETADATA\nCOMPONENT_NAMES\nnorth\n\n"
         "CELL_DATA 2\nSCALARS s char\nLOOKUP_TABLE t\n1 2\nLOOKUP_TABLE t 1\n0 0 0 1\n";
}

std::string old_grid() {
  return head("3.0", "ASCII", "STRUCTURED_GRID") +
         "DIMENSIONS 2 3 1\nBLANKING 6 unsigned_char\n1 0 1 1 1 1\n"
         "POINTS 6 float\n0 0 0 1 0 0 0 1 0 1 1 0 0 2 0 1 2 0\n"
         "POINT_DATA 6\nSCALARS s long\nLOOKUP_TABLE default\n1 2 3 4 5 6\n";
}

std::string polygons() {
  return head("3.0", "ASCII", "POLYDATA") +
         "POINTS 5 double\n0 0 0 1 0 0 1 1 0 0 1 0 0.5 2 0\n"
         "TRIANGLE_STRIPS 1 6\n5 0 1 3 2 4\nPOLYGONS 3 13\n3 0 1 2\n4 0 1 2 3\n3 2 3 4\n"
         "VERTICES 2 5\n1 4\n2 0 1\nLINES 2 7\n2 0 1\n3 1 2 3\n"
         "CELL_DATA 8\nSCALARS number int\nLOOKUP_TABLE default\n0 1 2 3 4 5 6 7\n";
}

std::string binary_image() {
  return head("4.2", "BINARY", "STRUCTURED_POINTS") +
         "DIMENSIONS 3 2 2\nSPACING 0.1 1 1\nORIGIN 0 0 0\nPOINT_DATA 12\nSCALARS s float\n"
         "LOOKUP_TABLE default\n" +
         big_endian<float>({0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11}) + "\n";
}

std::string binary_rectilinear() {
  return head("5.1", "BINARY", "RECTILINEAR_GRID") +
         "EXTENT 2 4 -1 0 0 0\nX_COORDINATES 3 float\n" + big_endian<float>({0, 0.1F, 4}) +
         "\nY_COORDINATES 2 float\n" + big_endian<float>({1, 2}) + "\nZ_COORDINATES 1 float\n" +
         big_endian<float>({7}) + "\nCELL_DATA 2\nSCALARS s char\n" +
         "LOOKUP_TABLE default\n\x01\x02\n";
}

std::string binary_polygons() {
  return head("5.1", "BINARY", "POLYDATA") + "POINTS 3 float\n" +
         big_endian<float>({0, 0, 0, 1, 0, 0, 1, 1, 0}) + "\nLINES 3 4\nOFFSETS vtktypeint64\n" +
         big_endian<std::int64_t>({0, 2, 4}) + "\nCONNECTIVITY vtktypeint64\n" +
         big_endian<std::int64_t>({0, 1, 1, 2}) + "\nPOLYGONS 2 3\nOFFSETS vtktypeint64\n" +
         big_endian<std::int64_t>({0, 3}) + "\nCONNECTIVITY vtktypeint32\n" +
         big_endian<std::int32_t>({0, 1, 2}) +
         "\nCELL_DATA 3\nSCALARS s char\nLOOKUP_TABLE default\n\x01\x02\x03\n";
}

std::vector<std::string> all_files() {
  return {old_image(),    old_rectilinear(),    old_grid(),       polygons(),
          binary_image(), binary_rectilinear(), binary_polygons()};
}

std::string dataset_of(const std::string& file) {
  const std::string bytes = file_content(file);
  const std::size_t at = bytes.find("DATASET ") + 8;
  return bytes.substr(at, bytes.find('\n', at) - at);
}

TEST_F(VtkTest, StructuredFilesComeBackAsWhatTheyWere) {
  for (const std::string& text : all_files()) {
    SCOPED_TRACE(text.substr(0, 80));
    const auto mesh = open_text(text);
    const Snapshot before = take(*mesh);
    const auto restored = through_shm(*mesh, Order::keep, spool_);
    write_vtk(*restored, path("out.vtk"), spool_);
    const auto again = open_vtk(path("out.vtk"), spool_);
    expect_same(before, take(*again));
    if (text.find("BINARY") != std::string::npos) {
      EXPECT_EQ(file_content(path("out.vtk")), text);
    }
    write_vtk(*again, path("again.vtk"), spool_);
    EXPECT_EQ(file_content(path("out.vtk")), file_content(path("again.vtk")));
  }
}

TEST_F(VtkTest, OldImagesMeanWhatTheyShould) {
  const Snapshot all = take(*open_text(old_image()));
  EXPECT_EQ(all.info.vertices, 12U);
  ASSERT_EQ(all.info.schema.blocks.size(), 1U);
  EXPECT_EQ(all.info.schema.blocks[0], (BlockInfo{12, "", CellShape::hexahedron, 8}));
  EXPECT_EQ(all.corners, (std::vector<std::uint64_t>{0, 1, 4, 3, 6, 7, 10, 9,  //
                                                     1, 2, 5, 4, 7, 8, 11, 10}));
  const auto points = as<double>(all.points);
  EXPECT_EQ(std::vector(points.begin() + 33, points.end()),
            (std::vector<double>{1 + 2 * 0.1, 2 + 0.25, 3 - 1}));
  write_vtk(*open_text(old_image()), path("out.vtk"), spool_);
  EXPECT_TRUE(file_content(path("out.vtk"))
                  .starts_with("# vtk DataFile Version 1.0\nsmall\nASCII\nDATASET "
                               "STRUCTURED_POINTS\nORIGIN 1 2. 3e0\nASPECT_RATIO 0.1 .25 -1\n"
                               "DIMENSIONS 3 2 2\nPOINT_DATA 12\n"));
}

TEST_F(VtkTest, OldRectilinearGridsMeanWhatTheyShould) {
  const Snapshot all = take(*open_text(old_rectilinear()));
  EXPECT_EQ(all.info.schema.coordinate_type, ScalarType::float64);
  EXPECT_EQ(all.corners, (std::vector<std::uint64_t>{0, 1, 4, 3, 1, 2, 5, 4}));
  const auto points = as<double>(all.points);
  EXPECT_EQ(std::vector(points.begin() + 9, points.begin() + 12),
            (std::vector<double>{double{0.1F}, 0.3, 1}));
  EXPECT_EQ(as<std::int32_t>(find_extra(all.info, "vtk/data/0")->data),
            (std::vector<std::int32_t>{-1, 1}));
  EXPECT_EQ(as<float>(find_extra(all.info, "vtk/data/1")->data), (std::vector<float>{0.1F, 1, 4}));
  // If all axes are float32, the points are float32, too.
  EXPECT_EQ(take(*open_text(binary_rectilinear())).info.schema.coordinate_type,
            ScalarType::float32);
}

TEST_F(VtkTest, BlankingIsAnArrayOfThePoints) {
  const Snapshot all = take(*open_text(old_grid()));
  ASSERT_EQ(all.info.schema.arrays.size(), 2U);
  EXPECT_EQ(all.info.schema.arrays[0].name, "BLANKING");
  EXPECT_EQ(as<std::uint8_t>(all.arrays[0]), (std::vector<std::uint8_t>{1, 0, 1, 1, 1, 1}));
}

TEST_F(VtkTest, ExtentsStartWhereTheySay) {
  const Snapshot all = take(*open_text(head("5.1", "ASCII", "STRUCTURED_POINTS") +
                                       "EXTENT 2 3 -1 -1 5 5\nSPACING 0.5 2 3\nORIGIN 1 1 1\n"));
  EXPECT_EQ(as<double>(all.points), (std::vector<double>{2, -1, 16, 2.5, -1, 16}));
  EXPECT_EQ(all.info.schema.blocks[0].shape, CellShape::line);
}

TEST_F(VtkTest, FlatDataBecomeCellsOfFewerDimensions) {
  const auto lattice = [](std::uint64_t x, std::uint64_t y, std::uint64_t z) {
    return *vtk::Lattice::of({x, y, z});
  };
  const auto corners = [](vtk::Lattice of, std::uint64_t cell) {
    const auto found = of.corners(cell);
    return std::vector(found.begin(), found.end());
  };
  using Numbers = std::vector<std::uint64_t>;
  EXPECT_EQ(corners(lattice(3, 4, 1), 3), (Numbers{4, 5, 8, 7}));
  EXPECT_EQ(corners(lattice(3, 1, 4), 3), (Numbers{4, 5, 8, 7}));
  EXPECT_EQ(corners(lattice(1, 3, 4), 3), (Numbers{4, 5, 8, 7}));
  EXPECT_EQ(corners(lattice(1, 5, 1), 2), (Numbers{2, 3}));
  EXPECT_EQ(corners(lattice(1, 1, 1), 0), (Numbers{0}));
  EXPECT_EQ(lattice(1, 1, 1).block().shape, CellShape::vertex);
  EXPECT_EQ(lattice(0, 5, 5).cells(), 0U);
  EXPECT_EQ(lattice(0, 5, 5).points(), 0U);
  EXPECT_FALSE(vtk::Lattice::of({1ULL << 31, 1ULL << 31, 1ULL << 31}));
}

TEST_F(VtkTest, PolygonsAreNumberedAsVtkDoes) {
  const Snapshot all = take(*open_text(polygons()));
  std::vector<std::int64_t> types;
  for (const std::uint32_t block : all.blocks) types.push_back(all.info.schema.blocks[block].id);
  EXPECT_EQ(types, (std::vector<std::int64_t>{1, 2, 3, 4, 5, 9, 5, 6}));
  EXPECT_EQ(all.corners.front(), 4U);
  write_vtk(*open_text(polygons()), path("out.vtk"), spool_);
  EXPECT_EQ(dataset_of(path("out.vtk")), "POLYDATA");
  EXPECT_NE(
      file_content(path("out.vtk")).find("\nTRIANGLE_STRIPS 1 6\n5 0 1 3 2 4\nPOLYGONS 3 13\n"),
      std::string::npos);
}

TEST_F(VtkTest, RenumberedMeshesBecomeUnstructured) {
  for (const std::string& text : {old_image(), old_rectilinear(), old_grid()}) {
    const auto restored = through_shm(*open_text(text), Order::stream, spool_);
    write_vtk(*restored, path("out.vtk"), spool_);
    EXPECT_EQ(dataset_of(path("out.vtk")), "UNSTRUCTURED_GRID");
    const Snapshot all = take(*open_vtk(path("out.vtk"), spool_));
    const MeshInfo before = open_text(text)->info();
    EXPECT_EQ(all.info.vertices, before.vertices);
    EXPECT_EQ(all.info.block_cells, before.block_cells);
    EXPECT_EQ(all.info.schema.arrays.size(), before.schema.arrays.size());
    EXPECT_EQ(find_extra(all.info, "vtk/data/0") != nullptr,
              text == old_rectilinear());  // the extras contain only field data and lookup tables
  }
}

TEST_F(VtkTest, SkeletonsThatDoNotFitAreNotFollowed) {
  const auto written = [&](const std::string& text, const std::string& skeleton) {
    const auto mesh = open_text(text);
    BentExtra pretender(*mesh, "vtk/skeleton", "4.2\nt\nASCII\n" + skeleton);
    write_vtk(pretender, path("out.vtk"), spool_);
    take(*open_vtk(path("out.vtk"), spool_));
    return dataset_of(path("out.vtk"));
  };
  const std::string image = "DATASET STRUCTURED_POINTS\n";
  const std::string places = "ORIGIN 1 2. 3e0\nSPACING 0.1 .25 -1\n";
  EXPECT_EQ(written(old_image(), image + places + "DIMENSIONS 3 2 2\n"), "STRUCTURED_POINTS");
  EXPECT_EQ(written(old_image(), image + "DIMENSIONS 3 2 2\n"), "UNSTRUCTURED_GRID");
  EXPECT_EQ(written(old_image(), image + places + "DIMENSIONS 2 3 2\n"), "UNSTRUCTURED_GRID");
  EXPECT_EQ(written(old_image(), image + places + "DIMENSIONS 12 1 1\n"), "UNSTRUCTURED_GRID");
  EXPECT_EQ(written(old_image(), "DATASET STRUCTURED_GRID\nDIMENSIONS 3 2 2\n"), "STRUCTURED_GRID");
  EXPECT_EQ(written(polygons(),
                    "DATASET POLYDATA\nVERTICES 2\nLINES 2\nPOLYGONS 3\n"
                    "TRIANGLE_STRIPS 1\n"),
            "POLYDATA");
  for (const char* lists : {"", "VERTICES 8\n", "VERTICES 2\nLINES 2\nPOLYGONS 3\n",
                            "VERTICES 18446744073709551615\nLINES 9\n",
                            "VERTICES 2\nLINES 3\nPOLYGONS 2\nTRIANGLE_STRIPS 1\n"})
    EXPECT_EQ(written(polygons(), std::string("DATASET POLYDATA\n") + lists), "UNSTRUCTURED_GRID");
  for (const char* skeleton :
       {"DATASET NONSENSE\n", "DATASET STRUCTURED_POINTS\n",
        "DATASET STRUCTURED_POINTS\nDIMENSIONS 3 2\n",
        "DATASET STRUCTURED_POINTS\nDIMENSIONS 2147483647 2147483647 2147483647\n",
        "DATASET STRUCTURED_GRID\nEXTENT 1 2 3\n", "DATASET RECTILINEAR_GRID\nDIMENSIONS 3 2 2\n",
        "DATASET POLYDATA\nPOLYGONS x\n"})
    EXPECT_EQ(code_of([&] { written(old_image(), skeleton); }), ErrorCode::corrupt) << skeleton;
}

TEST_F(VtkTest, BrokenCountsOfStructuredDataAreRefused) {
  const std::string image = head("3.0", "ASCII", "STRUCTURED_POINTS");
  const std::string grid = head("3.0", "ASCII", "STRUCTURED_GRID");
  const std::string rectilinear = head("3.0", "ASCII", "RECTILINEAR_GRID");
  const std::string lists = head("3.0", "ASCII", "POLYDATA") + "POINTS 2 float\n0 0 0 1 1 1\n";
  const std::string axes = "X_COORDINATES 2 float\n0 1\nY_COORDINATES 1 float\n0\n";
  const std::vector<std::pair<ErrorCode, std::string>> cases = {
      {ErrorCode::truncated, image},
      {ErrorCode::truncated, image + "SPACING 1 1 1\nORIGIN 0 0 0\n"},
      {ErrorCode::truncated, image + "DIMENSIONS 1 1"},
      {ErrorCode::corrupt, image + "DIMENSIONS 1 1 x\n"},
      {ErrorCode::corrupt, image + "DIMENSIONS 1 1 1.5\n"},
      {ErrorCode::corrupt, image + "DIMENSIONS 1 1 -1\n"},
      {ErrorCode::corrupt, image + "DIMENSIONS 2147483648 1 1\n"},
      {ErrorCode::corrupt, image + "DIMENSIONS 2147483647 2147483647 2147483647\n"},
      {ErrorCode::corrupt, image + "DIMENSIONS 2000000 2000000 2\n"},
      {ErrorCode::corrupt, image + "EXTENT 0 -2 0 0 0 0\n"},
      {ErrorCode::corrupt, image + "EXTENT -9223372036854775808 9223372036854775807 0 0 0 0\n"},
      {ErrorCode::corrupt, image + "DIMENSIONS 1 1 1\nDIMENSIONS 1 1 1\n"},
      {ErrorCode::corrupt, image + "DIMENSIONS 1 1 1\nEXTENT 0 0 0 0 0 0\n"},
      {ErrorCode::corrupt, image + "SPACING 1 1 many\nDIMENSIONS 1 1 1\n"},
      {ErrorCode::corrupt, image + "DIMENSIONS 1 1 1\nPOINTS 1 float\n0 0 0\n"},
      {ErrorCode::corrupt, image + "DIMENSIONS 2 1 1\nPOINT_DATA 3\n"},
      {ErrorCode::corrupt, image + "DIMENSIONS 2 1 1\nCELL_DATA 2\n"},
      {ErrorCode::corrupt, image + "POINT_DATA 1\nSCALARS s float\nLOOKUP_TABLE default\n1\n"},
      {ErrorCode::truncated, grid + "DIMENSIONS 1 1 1\n"},
      {ErrorCode::truncated, grid + "POINTS 1 float\n0 0 0\n"},
      {ErrorCode::corrupt, grid + "DIMENSIONS 2 1 1\nPOINTS 1 float\n0 0 0\n"},
      {ErrorCode::corrupt, grid + "POINTS 1 float\n0 0 0\nDIMENSIONS 2 2 2\n"},
      {ErrorCode::corrupt, grid + "BLANKING 1 char\n1\nDIMENSIONS 1 1 1\n"},
      {ErrorCode::corrupt, grid + "DIMENSIONS 1 1 1\nBLANKING 2 char\n1 1\n"},
      {ErrorCode::corrupt, grid + "DIMENSIONS 1 1 1\nBLANKING 1 string\n1\n"},
      {ErrorCode::corrupt, grid + "SPACING 1 1 1\n"},
      {ErrorCode::corrupt, grid + "CELLS 1 2\n1 0\n"},
      {ErrorCode::truncated, rectilinear + "DIMENSIONS 2 1 1\n" + axes},
      {ErrorCode::corrupt,
       rectilinear + "DIMENSIONS 2 1 2\n" + axes + "Z_COORDINATES 1 float\n0\n"},
      {ErrorCode::corrupt, rectilinear + "DIMENSIONS 2 1 1\n" + axes + axes},
      {ErrorCode::unsupported, rectilinear + "X_COORDINATES 1 string\na\n"},
      {ErrorCode::truncated, rectilinear + "X_COORDINATES 99999999999 float\n0\n"},
      {ErrorCode::truncated, head("3.0", "ASCII", "POLYDATA") + "POLYGONS 0 0\n"},
      {ErrorCode::corrupt, lists + "LINES 1 3\n2 0 2\n"},
      {ErrorCode::corrupt, lists + "LINES 2 3\n2 0 1\n"},
      {ErrorCode::corrupt, lists + "LINES 1 3\n2 0 1\nLINES 1 3\n2 0 1\n"},
      {ErrorCode::corrupt, lists + "LINES 1 3\n2 0 1\nCELL_DATA 2\n"},
      {ErrorCode::corrupt, lists + "CELL_TYPES 0\n"},
      {ErrorCode::truncated, lists + "POLYGONS 99999999999 99999999999\n"},
  };
  for (const auto& [code, text] : cases)
    EXPECT_EQ(code_of([&, &bytes = text] { open_text(bytes); }), code) << text;
}

TEST_F(VtkTest, ManyPointsTakeNoMemoryUntilTheyAreRead) {
  const auto mesh = open_text(head("3.0", "ASCII", "STRUCTURED_POINTS") +
                              "DIMENSIONS 1000 1000 1000\nSPACING 1 1 1\nORIGIN 0 0 0\n");
  EXPECT_EQ(mesh->info().vertices, 1000000000U);
  EXPECT_EQ(mesh->info().cells(), 999U * 999U * 999U);
  std::array<double, 3> last{};
  mesh->read_points(999999999, 1, reinterpret_cast<std::byte*>(last.data()));
  EXPECT_EQ(last, (std::array<double, 3>{999, 999, 999}));
}

TEST_F(VtkTest, TruncatedStructuredFilesAreSurvived) {
  for (const std::string& whole : all_files()) {
    for (std::size_t length = 0; length < whole.size(); ++length) {
      Spool spool(directory_.string());
      try_to_read(write_file("cut.vtk", whole.substr(0, length)), spool);
    }
  }
}

TEST_F(VtkTest, FlippedBytesOfStructuredFilesAreSurvived) {
  for (const std::string& whole : all_files()) {
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

TEST_F(VtkTest, VtkAgreesWithWhatWeWriteOfItsStructuredSamples) {
  for (const char* folder : {"in", "out", "cells"}) fs::create_directory(path(folder));
  int status = 0;
  if (!run_oracle("--samples " + path("in"), &status))
    GTEST_SKIP() << "/usr/bin/python3 has no module vtk";
  ASSERT_EQ(status, 0);
  for (const auto& file : fs::directory_iterator(path("in"))) {
    const std::string name = file.path().filename().string();
    SCOPED_TRACE(name);
    const auto mesh = open_vtk(file.path().string(), spool_);
    const auto restored = through_shm(*mesh, Order::keep, spool_);
    write_vtk(*restored, path("out/" + name), spool_);
    if (name.find("BINARY") != std::string::npos) {
      EXPECT_EQ(file_content(path("out/" + name)), file_content(file.path().string()));
    }
    BentExtra plain(*restored, "vtk/skeleton", "4.2\nt\nASCII\n");
    write_vtk(plain, path("cells/" + name), spool_);
  }
  ASSERT_TRUE(run_oracle("--folders " + path("in") + ' ' + path("out"), &status));
  EXPECT_EQ(status, 0);
  ASSERT_TRUE(run_oracle("--cells " + path("in") + ' ' + path("cells"), &status));
  EXPECT_EQ(status, 0);
}

}  // namespace
}  // namespace shm::converters
