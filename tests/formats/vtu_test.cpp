// Tests of VTU files: round trips, comparisons with VTK's own reader, and hostile files.
#include "vtk/xml/vtu.h"
#include "files/mesh_files.h"

#include <gtest/gtest.h>
#include <unistd.h>

#include <chrono>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <string>
#include <vector>

#include "base/failure.h"
#include "formats/formats.h"
#include "mesh/mesh_source.h"
#include "support/memory_mesh.h"
#include "support/temporary_folder.h"
#include "vtk/legacy/vtk.h"
#include "vtk/xml/codec.h"
#include "vtk/xml_words.h"

namespace shm::converters {
namespace {

namespace fs = std::filesystem;

std::string replaced(std::string text, const std::string& from, const std::string& to) {
  const std::size_t at = text.find(from);
  EXPECT_NE(at, std::string::npos) << from;
  if (at != std::string::npos) text.replace(at, from.size(), to);
  return text;
}

std::string text_of(const Extra* extra) {
  if (extra == nullptr) return "(absent)";
  return {reinterpret_cast<const char*>(extra->data.data()), extra->data.size()};
}

template <class T>
std::vector<T> array_of(MeshSource& mesh, std::size_t array, std::uint64_t step = 0) {
  const std::uint64_t count = mesh.info().array_elements(array);
  std::vector<T> values(count * mesh.info().schema.arrays[array].components);
  mesh.read_array(array, step, 0, count, reinterpret_cast<std::byte*>(values.data()));
  return values;
}

// Returns all data of a mesh as bytes.
std::vector<std::byte> all_of(MeshSource& mesh) {
  const MeshInfo& info = mesh.info();
  std::vector<std::byte> all(info.vertices * 3 * scalar_bytes(info.schema.coordinate_type));
  mesh.read_points(0, info.vertices, all.data());
  const auto add = [&](const auto& values) {
    const auto* bytes = reinterpret_cast<const std::byte*>(values.data());
    all.insert(all.end(), bytes, bytes + values.size() * sizeof values[0]);
  };
  mesh.rewind_cells();
  for (CellBatch batch; mesh.next_cells(batch, 7);) {
    add(batch.blocks);
    add(batch.corners);
  }
  for (std::size_t a = 0; a < info.schema.arrays.size(); ++a) {
    const std::uint64_t steps = info.schema.arrays[a].per_step ? info.step_times.size() : 1;
    std::vector<std::byte> values(info.array_elements(a) * info.array_stride(a));
    for (std::uint64_t s = 0; s < steps; ++s) {
      mesh.read_array(a, s, 0, info.array_elements(a), values.data());
      add(values);
    }
  }
  return all;
}

// A VTU file with two tetrahedra and inline data. Tests replace %FIELD% and the other placeholders.
constexpr const char* kPlain = R"(<?xml version="1.0"?>
<VTKFile type="UnstructuredGrid" version="0.1" byte_order="LittleEndian">
  <!-- made by hand -->
  <UnstructuredGrid>
    <Piece NumberOfPoints="5" NumberOfCells="2">
      <PointData Scalars="t">
        <DataArray type="Float32" Name="t" format="ascii">0 .5 1e3 -1 nan</DataArray>
      </PointData>
      <CellData>
        <DataArray type="Int16" Name="c &amp; &lt;d&gt; &#252;" NumberOfComponents="2">1 -2 3 +4</DataArray>
      </CellData>
      <Points>
        <DataArray type="Float64" NumberOfComponents="3" format="ascii">
          0 0 0  1 0 0  0 1 0  0 0 1  1 1 1
        </DataArray>
      </Points>
      <Cells>
        <DataArray type="Int32" Name="connectivity" format="ascii">0 1 2 3 1 2 3 4</DataArray>
        <DataArray type="Int32" Name="offsets" format="ascii">4 8</DataArray>
        <DataArray type="UInt8" Name="types" format="ascii">10 10</DataArray>
      </Cells>
    </Piece>
  </UnstructuredGrid>
</VTKFile>
)";

class VtuTest : public FolderTest {
 protected:
  std::unique_ptr<MeshSource> open_text(const std::string& bytes) {
    return open_vtu(write_file("in.vtu", bytes), spool_);
  }
  // Converts a file to .shm and back.
  void round_trip(const std::string& from, const std::string& to) {
    const auto mesh = open_mesh(from, spool_);
    write_mesh(*mesh, path("packed.shm"), *format_named("shm"), spool_);
    const auto packed = open_mesh(path("packed.shm"), spool_);
    write_mesh(*packed, to, *format_named("vtu"), spool_);
  }
  // Reads `text` and writes it again. Checks that the written file contains the same mesh, and
  // returns the file.
  std::string round_trip_text(const std::string& text) {
    round_trip(write_file("in.vtu", text), path("back.vtu"));
    const auto before = open_vtu(path("in.vtu"), spool_),
               after = open_vtu(path("back.vtu"), spool_);
    EXPECT_EQ(before->info().schema, after->info().schema);
    EXPECT_EQ(before->info().extras, after->info().extras);
    EXPECT_EQ(all_of(*before), all_of(*after));
    return file_content(path("back.vtu"));
  }
  void expect_failure(const std::string& text, ErrorCode code, const std::string& words) {
    try {
      const auto mesh = open_text(text);
      all_of(*mesh);
      ADD_FAILURE() << "read without an error; expected: " << words;
    } catch (const Failure& failure) {
      EXPECT_EQ(failure.error().code, code) << failure.what();
      EXPECT_NE(std::string(failure.what()).find(words), std::string::npos) << failure.what();
    }
  }
  // Returns true if the file can be read completely, and false if reading it throws Failure. Any
  // other exception is a bug and makes the test fail.
  bool readable(const std::string& bytes) {
    try {
      Spool spool(fs::temp_directory_path().string());
      const auto mesh = open_vtu(write_file("in.vtu", bytes), spool);
      all_of(*mesh);
      return true;
    } catch (const Failure&) {
      return false;
    }
  }
  bool has_oracle() {
    static const bool available =
        std::system(SHM_PYTHON " -c 'import vtk, numpy' >/dev/null 2>&1") == 0;
    return available;
  }
  int oracle(const std::string& arguments) {
    const std::string script = std::string(SHM_SOURCE_DIR) + "/tests/support/vtu_oracle.py";
    const int result = std::system((SHM_PYTHON " '" + script + "' " + arguments).c_str());
    return WIFEXITED(result) ? WEXITSTATUS(result) : -1;
  }

  Spool spool_{fs::temp_directory_path().string(), std::size_t{1} << 20};
};

TEST_F(VtuTest, ReadsWhatStandsInTheFile) {
  const auto mesh = open_text(kPlain);
  const MeshInfo& info = mesh->info();
  EXPECT_EQ(info.schema.source_format, "vtu");
  EXPECT_EQ(info.vertices, 5u);
  ASSERT_EQ(info.schema.blocks.size(), 1u);
  EXPECT_EQ(info.schema.blocks[0].shape, CellShape::tetrahedron);
  EXPECT_EQ(info.block_cells[0], 2u);
  ASSERT_EQ(info.schema.arrays.size(), 2u);
  EXPECT_EQ(info.schema.arrays[0].name, "t");
  EXPECT_EQ(info.schema.arrays[1].name, "c & <d> ü");
  EXPECT_EQ(info.schema.arrays[1].type, ScalarType::int16);
  EXPECT_EQ(array_of<std::int16_t>(*mesh, 1), (std::vector<std::int16_t>{1, -2, 3, 4}));
  EXPECT_EQ(array_of<float>(*mesh, 0)[2], 1000);
  const std::string skeleton = text_of(find_extra(info, "vtu/skeleton"));
  EXPECT_NE(skeleton.find("<?shm-values a1?>"), std::string::npos) << skeleton;
  EXPECT_NE(skeleton.find("<!-- made by hand -->"), std::string::npos);
}

TEST_F(VtuTest, TextComesBack) {
  const std::string back = round_trip_text(kPlain);
  for (const char* part : {"version=\"0.1\"", "Name=\"c &amp; &lt;d&gt; ü\"", "Scalars=\"t\"",
                           "<!-- made by hand -->", "1000"})
    EXPECT_NE(back.find(part), std::string::npos) << part;
  EXPECT_EQ(back.find("offset="), std::string::npos);
}

TEST_F(VtuTest, KnowsItsFiles) {
  const auto looks = [](const std::string& text) {
    return looks_like_vtu(std::as_bytes(std::span(text.data(), text.size())));
  };
  EXPECT_TRUE(looks(kPlain));
  EXPECT_TRUE(looks("\n<VTKFile type="));
  EXPECT_TRUE(looks("\xef\xbb\xbf<?xml version=\"1.0\"?><VTKFile>"));
  EXPECT_FALSE(looks("<html>"));
  EXPECT_FALSE(looks("# vtk DataFile Version 2.0 <VTKFile"));
  EXPECT_FALSE(looks(""));
}

TEST_F(VtuTest, EveryEncodingOfVtkComesBackEqualToVtk) {
  if (!has_oracle()) GTEST_SKIP() << "needs python3-vtk9";
  fs::create_directory(directory_ / "a");
  fs::create_directory(directory_ / "b");
  ASSERT_EQ(oracle("--samples '" + path("a") + "' 2>/dev/null"), 0);
  std::size_t files = 0;
  for (const auto& entry : fs::directory_iterator(directory_ / "a")) {
    const std::string name = entry.path().filename().string();
    SCOPED_TRACE(name);
    ASSERT_NO_THROW(round_trip(path("a/" + name), path("b/" + name)));
    ++files;
  }
  EXPECT_EQ(files, 65u);
  EXPECT_EQ(oracle("--all '" + path("a") + "' '" + path("b") + "'"), 0);
}

// --- pieces

std::string piece(int points, int cells, const std::string& data, const std::string& types) {
  std::string text = "<Piece NumberOfPoints=\"" + std::to_string(points) + "\" NumberOfCells=\"" +
                     std::to_string(cells) + "\">" + data +
                     "<Points><DataArray type=\"Float32\" NumberOfComponents=\"3\">";
  for (int i = 0; i < 3 * points; ++i) text += std::to_string(i) + ' ';
  text += "</DataArray></Points><Cells><DataArray type=\"Int64\" Name=\"connectivity\">";
  for (int i = 0; i < points; ++i) text += std::to_string(i) + ' ';
  text += "</DataArray><DataArray type=\"Int64\" Name=\"offsets\">";
  for (int i = 1; i <= cells; ++i) text += std::to_string(points / cells * i) + ' ';
  return text + "</DataArray><DataArray type=\"UInt8\" Name=\"types\">" + types +
         "</DataArray></Cells></Piece>";
}
std::string grid_of(const std::string& pieces, const std::string& attributes = "version=\"1.0\"") {
  return "<VTKFile type=\"UnstructuredGrid\" byte_order=\"LittleEndian\" " + attributes +
         "><UnstructuredGrid>" + pieces + "</UnstructuredGrid></VTKFile>";
}
std::string point_array(const std::string& name, const std::string& values,
                        const std::string& type = "Int32") {
  return "<DataArray type=\"" + type + "\" Name=\"" + name + "\">" + values + "</DataArray>";
}

TEST_F(VtuTest, PiecesComeBackAsTheyWere) {
  const auto data = [](const std::string& arrays) {
    return "<PointData>" + arrays + "</PointData>";
  };
  const std::string text = grid_of(
      piece(4, 1, data(point_array("p", "1 2 3 4") + point_array("only", "7 8 9 10")), "10") +
      piece(0, 0, data(point_array("p", "")), "") +
      piece(6, 2, data(point_array("p", "5 6 7 8 9 10")), "5 5"));
  const auto mesh = open_text(text);
  EXPECT_EQ(mesh->info().vertices, 10u);
  ASSERT_EQ(mesh->info().schema.arrays.size(),
            1u);  // only one piece has the array "only"
  EXPECT_EQ(array_of<std::int32_t>(*mesh, 0),
            (std::vector<std::int32_t>{1, 2, 3, 4, 5, 6, 7, 8, 9, 10}));
  CellBatch batch;
  mesh->rewind_cells();
  ASSERT_TRUE(mesh->next_cells(batch, 10));
  EXPECT_EQ(batch.corners, (std::vector<std::uint64_t>{0, 1, 2, 3, 4, 5, 6, 7, 8, 9}));
  const std::string back = round_trip_text(text);
  for (const char* part :
       {"NumberOfPoints=\"4\"", "NumberOfPoints=\"0\"", "NumberOfPoints=\"6\"", "Name=\"only\""})
    EXPECT_NE(back.find(part), std::string::npos) << part;
  if (!has_oracle()) GTEST_SKIP() << "the rest needs python3-vtk9";
  // For an array that is missing in some piece, VTK returns undefined values. Such an array is
  // therefore removed before the file is compared with VTK.
  round_trip_text(replaced(text, point_array("only", "7 8 9 10"), ""));
  EXPECT_EQ(oracle("'" + path("in.vtu") + "' '" + path("back.vtu") + "'"), 0);
}

TEST_F(VtuTest, GridsWithoutPiecesPointsOrCells) {
  round_trip_text(grid_of(""));
  round_trip_text(grid_of(piece(0, 0, "", "")));
  round_trip_text(grid_of("<Piece NumberOfPoints=\"0\" NumberOfCells=\"0\"/>"));
  round_trip_text(
      grid_of("<Piece NumberOfPoints=\"1\" NumberOfCells=\"0\"><Points><DataArray type=\"Int32\" "
              "NumberOfComponents=\"3\">1 2 3</DataArray></Points></Piece>"));
}

// --- polyhedra

std::string tetrahedra(const std::string& attributes, const std::string& faces) {
  return grid_of(
      "<Piece NumberOfPoints=\"5\" NumberOfCells=\"2\"><Points><DataArray "
      "type=\"Float32\" NumberOfComponents=\"3\">0 0 0 1 0 0 0 1 0 0 0 1 1 1 1"
      "</DataArray></Points><Cells>" +
          point_array("connectivity", "3 2 1 0 1 2 3 4", "Int64") +
          point_array("offsets", "4 8", "Int64") + point_array("types", "42 42", "UInt8") + faces +
          "</Cells></Piece>",
      attributes);
}
const char* const kTwoPolyhedra =
    "4 3 0 1 2 3 0 1 3 3 0 2 3 3 1 2 3 4 3 1 2 3 3 1 2 4 3 1 3 4 3 2 3 4";

TEST_F(VtuTest, PolyhedraAsStreamsOfFaces) {
  const std::string text =
      tetrahedra("version=\"1.0\"", point_array("faces", kTwoPolyhedra, "Int64") +
                                        point_array("faceoffsets", "17 34", "Int64"));
  const auto mesh = open_text(text);
  EXPECT_EQ(mesh->info().schema.blocks.at(0).shape, CellShape::faces);
  // The point list of the first polyhedron is not in the order in which its faces use the points.
  // It can therefore not be computed from the faces and is stored as an extra.
  ASSERT_NE(find_extra(mesh->info(), "vtu/polyhedron/points"), nullptr);
  EXPECT_EQ(find_extra(mesh->info(), "vtu/polyhedron/points")->shape.at(0), 4u);
  const std::string back = round_trip_text(text);
  EXPECT_NE(back.find("3 2 1 0 1 2"), std::string::npos) << back;
  if (!has_oracle()) GTEST_SKIP() << "the rest needs python3-vtk9";
  EXPECT_EQ(oracle("'" + path("in.vtu") + "' '" + path("back.vtu") + "'"), 0);
}

TEST_F(VtuTest, PointsOfPolyhedraAscendAsVtkHasThem) {
  const std::string text = grid_of(
      "<Piece NumberOfPoints=\"5\" NumberOfCells=\"2\"><Points><DataArray "
      "type=\"Float32\" NumberOfComponents=\"3\">0 0 0 1 0 0 0 1 0 0 0 1 1 1 1"
      "</DataArray></Points><Cells>" +
          point_array("connectivity", "0 1 2 3 1 2 3 4", "Int64") +
          point_array("offsets", "4 8", "Int64") + point_array("types", "42 42", "UInt8") +
          point_array("faces",
                      "4 3 3 1 2 3 0 1 3 3 0 2 3 3 1 2 0 4 3 4 2 3 3 1 2 4 3 1 3 4 3 1 2 3",
                      "Int64") +
          point_array("faceoffsets", "17 34", "Int64") + "</Cells></Piece>",
      "version=\"1.0\"");
  const auto mesh = open_text(text);
  EXPECT_NE(find_extra(mesh->info(), "vtu/polyhedron/ascending"), nullptr);
  EXPECT_EQ(find_extra(mesh->info(), "vtu/polyhedron/points"), nullptr);
  const std::string back = round_trip_text(text);
  EXPECT_NE(back.find("0 1 2 3 1 2"), std::string::npos) << back;
  if (!has_oracle()) GTEST_SKIP() << "the rest needs python3-vtk9";
  EXPECT_EQ(oracle("'" + path("in.vtu") + "' '" + path("back.vtu") + "'"), 0);
}

TEST_F(VtuTest, PolyhedraAsListsOfFaces) {
  const auto tables = [](const std::string& ids, const std::string& ends, const std::string& faces,
                         const std::string& face_ends) {
    return tetrahedra("version=\"2.3\"", point_array("face_connectivity", faces, "Int64") +
                                             point_array("face_offsets", face_ends, "Int64") +
                                             point_array("polyhedron_to_faces", ids, "Int64") +
                                             point_array("polyhedron_offsets", ends, "Int64"));
  };
  const std::string own =
      tables("0 1 2 3 4 5 6 7", "4 8", "0 1 2 0 1 3 0 2 3 1 2 3 1 2 3 1 2 4 1 3 4 2 3 4",
             "3 6 9 12 15 18 21 24");
  std::string back = round_trip_text(own);
  EXPECT_NE(back.find("0 1 2 3 4 5"), std::string::npos) << back;
  EXPECT_NE(back.find("3 6 9 12 15 18"), std::string::npos) << back;
  EXPECT_EQ(find_extra(open_text(own)->info(), "vtu/data/0"), nullptr);
  // In this file, two polyhedra refer to the same entry of the face table. The writer cannot
  // recompute such tables from the cells, so they are stored unchanged as an extra.
  const std::string shared = tables(
      "0 1 2 3 3 4 5 6", "4 8", "0 1 2 0 1 3 0 2 3 1 2 3 1 2 4 1 3 4 2 3 4", "3 6 9 12 15 18 21");
  back = round_trip_text(shared);
  EXPECT_NE(back.find("0 1 2 3 3 4"), std::string::npos) << back;
  EXPECT_NE(find_extra(open_text(shared)->info(), "vtu/data/0"), nullptr);
  expect_failure(tables("0 1 2 9", "4 4", "0 1 2", "3"), ErrorCode::corrupt, "names face 1 of 1");
  expect_failure(tables("0", "1 0", "0 1 2", "3"), ErrorCode::corrupt,
                 "the end of the faces of cell 1 is out of range");
  expect_failure(tables("0", "1 1", "0 1 2", "4"), ErrorCode::corrupt,
                 "the end of face 0 is out of range");
}

TEST_F(VtuTest, BrokenPolyhedra) {
  const auto with = [](const std::string& faces, const std::string& ends) {
    return tetrahedra("version=\"1.0\"", point_array("faces", faces, "Int64") +
                                             point_array("faceoffsets", ends, "Int64"));
  };
  expect_failure(tetrahedra("version=\"1.0\"", ""), ErrorCode::corrupt, "no arrays of faces");
  expect_failure(with("4 3 0 1", "17 34"), ErrorCode::corrupt,
                 "the end of the faces of cell 0 is out of range");
  expect_failure(with("9 3 0 1 2", "5 5"), ErrorCode::corrupt, "impossible number of faces");
  expect_failure(with("1 9 0 1 2", "5 5"), ErrorCode::corrupt, "beyond its end");
  expect_failure(with("1 3 0 1 9 1 3 0 1 2", "5 10"), ErrorCode::corrupt, "point");
  expect_failure(with("", "-1 -1"), ErrorCode::corrupt,
                 "the end of the faces of cell 0 is out of range");
}

// --- other formats

TEST_F(VtuTest, MeshesOfOtherFormatsAreWrittenAppendedAndCompressed) {
  MemoryMesh mesh = grid_mesh(3, 2, 2);
  mesh.mesh.schema.source_format = "";
  write_mesh(mesh, path("grid.vtu"), *format_named("vtu"), spool_);
  const std::string text = file_content(path("grid.vtu"));
  for (const char* part : {"version=\"1.0\"", "header_type=\"UInt64\"", "vtkZLibDataCompressor",
                           "<AppendedData encoding=\"raw\">"})
    EXPECT_NE(text.find(part), std::string::npos) << part;
  const auto back = open_vtu(path("grid.vtu"), spool_);
  EXPECT_EQ(back->info().vertices, mesh.info().vertices);
  EXPECT_EQ(back->info().cells(), mesh.info().cells());
  if (!has_oracle()) GTEST_SKIP() << "the rest needs python3-vtk9";
  write_mesh(mesh, path("grid.vtk"), *format_named("vtk"), spool_);
  EXPECT_EQ(oracle("--data '" + path("grid.vtu") + "' '" + path("grid.vtk") + "'"), 0);
}

TEST_F(VtuTest, LegacyFilesAndBack) {
  if (!has_oracle()) GTEST_SKIP() << "needs python3-vtk9";
  const std::string legacy = std::string(SHM_SOURCE_DIR) + "/tests/support/vtk_oracle.py";
  const auto run = [&](const std::string& arguments) {
    return std::system((SHM_PYTHON " '" + legacy + "' " + arguments).c_str());
  };
  for (const char* form : {"42 ASCII", "42 BINARY", "51 BINARY"}) {
    SCOPED_TRACE(form);
    ASSERT_EQ(run(std::string("--sample ") + form + " '" + path("a.vtk") + "'"), 0);
    write_mesh(*open_mesh(path("a.vtk"), spool_), path("b.vtu"), *format_named("vtu"), spool_);
    write_mesh(*open_mesh(path("b.vtu"), spool_), path("c.vtk"), *format_named("vtk"), spool_);
    EXPECT_EQ(oracle("--legacy '" + path("a.vtk") + "' '" + path("b.vtu") + "'"), 0);
    EXPECT_EQ(oracle("--legacy '" + path("b.vtu") + "' '" + path("c.vtk") + "'"), 0);
  }
}

// --- hostile files

TEST_F(VtuTest, EntitiesAreNeverResolved) {
  expect_failure(replaced(kPlain, "<VTKFile ",
                          "<!DOCTYPE a [<!ENTITY x \"xxxxxxxx\"><!ENTITY y \"&x;&x;&x;&x;\">]>"
                          "<VTKFile "),
                 ErrorCode::unsupported, "DOCTYPE");
  expect_failure(
      replaced(kPlain, "<VTKFile ", "<!DOCTYPE a SYSTEM \"file:///etc/passwd\"><VTKFile "),
      ErrorCode::unsupported, "DOCTYPE");
  expect_failure(replaced(kPlain, "Scalars=\"t\"", "Scalars=\"&x;\""), ErrorCode::corrupt, "XML");
}

TEST_F(VtuTest, WrongHeads) {
  const auto with = [](const char* from, const char* to) { return replaced(kPlain, from, to); };
  expect_failure(with("\"UnstructuredGrid\"", "\"PolyData\""), ErrorCode::unsupported, "PolyData");
  expect_failure(with("version=\"0.1\"", "version=\"3.0\""), ErrorCode::unsupported, "beyond 2");
  expect_failure(with("LittleEndian", "MiddleEndian"), ErrorCode::corrupt, "byte order");
  expect_failure(with("byte_order", "compressor=\"x\" byte_order"), ErrorCode::unsupported,
                 "compressor 'x'");
  expect_failure(with("byte_order", "header_type=\"UInt8\" byte_order"), ErrorCode::corrupt,
                 "not a header type");
  expect_failure(replaced(kPlain, "version=\"1.0\"?", "version=\"1.0\" encoding=\"UTF-16\"?"),
                 ErrorCode::unsupported, "utf-16");
}

TEST_F(VtuTest, WrongArrays) {
  const auto with = [](const char* from, const char* to) { return replaced(kPlain, from, to); };
  expect_failure(with("0 .5 1e3 -1 nan", "0 .5 1e3 -1"), ErrorCode::truncated, "has 4 values");
  expect_failure(with("0 .5 1e3", "0 x 1e3"), ErrorCode::corrupt, "'x' is not a valid number");
  expect_failure(with("4 8<", "4 9<"), ErrorCode::truncated, "offsets end at 9");
  expect_failure(with("4 8<", "4 3<"), ErrorCode::corrupt, "less than before");
  expect_failure(with("4 8<", "4 9223372036854775807<"), ErrorCode::corrupt, "not a valid number");
  expect_failure(with("10 10", "10"), ErrorCode::truncated, "1 types for 2 cells");
  expect_failure(with("1 2 3 4</DataArray>", "1 2 3 5</DataArray>"), ErrorCode::corrupt,
                 "point 5 of 5");
  expect_failure(with("1 2 3 4</DataArray>", "1 2 3 -1</DataArray>"), ErrorCode::corrupt,
                 "point -1");
  expect_failure(with("NumberOfPoints=\"5\"", "NumberOfPoints=\"-5\""), ErrorCode::corrupt,
                 "is not a valid value");
  expect_failure(with("NumberOfPoints=\"5\"", "NumberOfPoints=\"999999999999999\""),
                 ErrorCode::truncated, "values");
  expect_failure(with("NumberOfPoints=\"5\"", "NumberOfPoints=\"18446744073709551615\""),
                 ErrorCode::corrupt, "more points");
  expect_failure(with("format=\"ascii\">0 .5", "format=\"appended\" offset=\"0\">0 .5"),
                 ErrorCode::truncated, "appended");
  expect_failure(with("type=\"Float64\"", "type=\"String\""), ErrorCode::unsupported,
                 "coordinates");
}

TEST_F(VtuTest, MarkupIsBounded) {
  std::string deep;
  for (int i = 0; i < 100000; ++i) deep += "<a>";
  expect_failure(replaced(kPlain, "<UnstructuredGrid>", deep), ErrorCode::unsupported, "64 deep");
  std::string wide;
  for (int i = 0; i < 1100000; ++i) wide += "<a/>";
  expect_failure(replaced(kPlain, "<UnstructuredGrid>", "<UnstructuredGrid>" + wide),
                 ErrorCode::unsupported, "markup");
  expect_failure(replaced(kPlain, "made by hand", std::string(6 << 20, 'x')),
                 ErrorCode::unsupported, "longer than 4 MiB");
}

std::string base64(const std::vector<std::uint32_t>& words, const std::string& rest = {}) {
  std::string text;
  std::string bytes(reinterpret_cast<const char*>(words.data()), words.size() * 4);
  vtu::append_base64(text, reinterpret_cast<const std::byte*>(bytes.data()), bytes.size());
  vtu::append_base64(text, reinterpret_cast<const std::byte*>(rest.data()), rest.size());
  return text;
}

TEST_F(VtuTest, LyingHeadersOfCompressedArrays) {
  const auto with = [](const std::string& values) {
    return replaced(
        replaced(replaced(kPlain, "byte_order", "compressor=\"vtkZLibDataCompressor\" byte_order"),
                 "format=\"ascii\">0 .5", "format=\"binary\">0 .5"),
        "0 .5 1e3 -1 nan", values);
  };
  // The data is five floats. Each block is a zlib stream.
  const std::vector<std::byte> zeros(20);
  const auto packed = vtu::compress(vtu::Compressor::zlib, zeros.data(), zeros.size());
  const std::string block(reinterpret_cast<const char*>(packed.data()), packed.size());
  const auto size = static_cast<std::uint32_t>(block.size());
  EXPECT_TRUE(readable(with(base64({1, 20, 0, size}, block))));
  EXPECT_TRUE(readable(with(base64({1, 64, 20, size}, block))));
  expect_failure(with(base64({1, 64, 0, size}, block)), ErrorCode::corrupt, "decompressed");
  expect_failure(with(base64({1, 16, 0, size}, block)), ErrorCode::corrupt, "decompressed");
  expect_failure(with(base64({1, 16, 20, size}, block)), ErrorCode::corrupt, "impossible size");
  expect_failure(with(base64({1, 0, 0, size}, block)), ErrorCode::corrupt, "impossible size");
  expect_failure(with(base64({0xffffffff, 32768, 0, size}, block)), ErrorCode::corrupt,
                 "more than the file can hold");
  expect_failure(with(base64({1, 0xffffffff, 0, size}, block)), ErrorCode::unsupported, "64 MiB");
  expect_failure(with(base64({1, 20, 0, 0xffffffff}, block)), ErrorCode::corrupt,
                 "impossible compressed size");
  expect_failure(with(base64({1, 20, 0, size + 9}, block)), ErrorCode::truncated, "within block 0");
  expect_failure(with(base64({1, 20})), ErrorCode::truncated, "header");
  expect_failure(with(base64({0, 0, 0})), ErrorCode::truncated, "has 0 values");
}

TEST_F(VtuTest, BombsStayWithinTheirBlocks) {
  // The array has five floats. Its first compressed block has 64 KiB and unpacks to 64 MiB of
  // zeros. The five floats are in the first block, so no other block is read.
  const std::vector<std::byte> zeros(vtu::kMostBlockBytes);
  const auto packed = vtu::compress(vtu::Compressor::zlib, zeros.data(), zeros.size());
  const std::string block(reinterpret_cast<const char*>(packed.data()), packed.size());
  const std::string text = replaced(
      replaced(replaced(kPlain, "byte_order", "compressor=\"vtkZLibDataCompressor\" byte_order"),
               "format=\"ascii\">0 .5", "format=\"binary\">0 .5"),
      "0 .5 1e3 -1 nan",
      base64({2, 1U << 26, 0, static_cast<std::uint32_t>(block.size()), 1}, block + "x"));
  const auto mesh = open_text(text);
  EXPECT_EQ(array_of<float>(*mesh, 0), std::vector<float>(5, 0));
}

TEST_F(VtuTest, EveryTruncationAndEveryFlippedByteIsAMeshOrAFailure) {
  std::vector<std::string> files = {kPlain};
  MemoryMesh mesh = grid_mesh(2, 1, 1);
  mesh.mesh.schema.source_format = "";
  write_mesh(mesh, path("grid.vtu"), *format_named("vtu"), spool_);
  files.push_back(file_content(path("grid.vtu")));
  files.push_back(tetrahedra("version=\"1.0\"", point_array("faces", kTwoPolyhedra, "Int64") +
                                                    point_array("faceoffsets", "17 34", "Int64")));
  for (const std::string& file : files) {
    const std::size_t end = file.find("</AppendedData>");
    const std::size_t needed = std::min(end, file.rfind("</VTKFile>"));
    for (std::size_t size = 0; size < file.size(); ++size) {
      const bool read = readable(file.substr(0, size));
      EXPECT_FALSE(read && size < needed - 3) << size << " of " << file.size();
    }
    for (std::size_t at = 0; at < file.size(); ++at) {
      std::string flipped = file;
      flipped[at] = static_cast<char>(flipped[at] ^ (1 << at % 8));
      readable(flipped);
    }
  }
}

TEST_F(VtuTest, BrokenSkeletonsAreFailures) {
  const auto mesh = open_text(kPlain);
  MemoryMesh copy = grid_mesh(1, 1, 1);
  copy.mesh.schema.source_format = "vtu";
  const std::string valid = text_of(find_extra(mesh->info(), "vtu/skeleton"));
  const auto write_with = [&](const std::string& skeleton) {
    Extra extra{"vtu/skeleton", ScalarType::uint8, Reference::nothing, {skeleton.size()}, {}};
    const auto bytes = std::as_bytes(std::span(skeleton));
    extra.data.assign(bytes.begin(), bytes.end());
    copy.mesh.extras = {extra};
    write_vtu(copy, path("out.vtu"), spool_);
  };
  // The skeleton (the XML of a VTU file without its numbers) belongs to another mesh. The writer
  // must not write those pieces and arrays of the skeleton that do not fit this mesh.
  write_with(valid);
  EXPECT_EQ(open_vtu(path("out.vtu"), spool_)->info().vertices, 8u);
  EXPECT_THROW(write_with(""), Failure);
  EXPECT_THROW(write_with("<VTKFile/>"), Failure);
  EXPECT_THROW(write_with(valid.substr(0, valid.size() / 2)), Failure);
  EXPECT_THROW(write_with(replaced(valid, "byte_order", "compressor=\"x\" byte_order")), Failure);
  for (std::size_t at = 0; at < valid.size(); ++at) {
    std::string flipped = valid;
    flipped[at] = static_cast<char>(flipped[at] ^ 1);
    try {
      write_with(flipped);
    } catch (const Failure&) {
    }
  }
}

}  // namespace
}  // namespace shm::converters
