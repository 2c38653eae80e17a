// Tests of AVS UCD files: how their contents are interpreted, round trips, and reports of damage.
#include "ucd/ucd.h"

#include <gtest/gtest.h>

#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <string>

#include "base/failure.h"
#include "compare/compare.h"
#include "support/memory_mesh.h"

namespace shm::converters {
namespace {

const std::string kAll =
    "# made by hand\n# with two comments\n"
    "10 8 4 2 2\n"
    "1 0 0 0\n20 1 0 0\n3 1 1 0\n4 0 1 0\n5 0 0 1\n6 1 0 1\n7 1 1 1\n8 0 1 1.1234567890123\n"
    "9 2 2 2\n10 -3e-05 3 3\n"
    "1 1 pt 3\n2 1 line 1 20\n3 1 tri 1 20 3\n4 -7 quad 1 20 3 4\n5 1 tet 1 20 3 5\n"
    "6 1 pyr 9 1 20 3 4\n17 2 prism 1 20 3 5 6 7\n17 2 hex 1 20 3 4 5 6 7 8\n"
    "2 1 3\nstress, lb/in**2\nvelocity vector\n"
    "1 1 2 3 4\n20 5 6 7 8.5\n3 9 9 9 9\n4 1 1 1 1\n5 2 2 2 2\n6 3 3 3 3\n7 4 4 4 4\n8 5 5 5 5\n"
    "9 6 6 6 6\n10 7 7 7 4e+10\n"
    "2 1 1\na, none\nb,x\n"
    "1 1 -1\n2 2 -2\n3 3 -3\n4 4 -4\n5 5 -5\n6 6 -6\n17 7 -7\n17 8 -8\n"
    "2 1 1\ntemp, K\npress, Pa\n1.0 2.0\n";

class UcdTest : public ::testing::Test {
 protected:
  UcdTest() : spool_(::testing::TempDir()) {
    const auto* test = ::testing::UnitTest::GetInstance()->current_test_info();
    path_ = ::testing::TempDir() + "ucd_test_" + test->name() + ".inp";
  }
  ~UcdTest() override { std::filesystem::remove(path_); }

  std::unique_ptr<MeshSource> open(const std::string& text) {
    std::ofstream(path_, std::ios::binary) << text;
    return open_ucd(path_, spool_);
  }
  std::string written(MeshSource& mesh) {
    write_ucd(mesh, path_);
    std::ifstream in(path_, std::ios::binary);
    return {std::istreambuf_iterator<char>(in), {}};
  }
  void expect_refused(const std::string& text, const std::string& cause,
                      ErrorCode code = ErrorCode::corrupt) {
    try {
      open(text);
      ADD_FAILURE() << "taken: " << cause;
    } catch (const Failure& failure) {
      EXPECT_EQ(failure.error().code, code) << failure.what();
      EXPECT_NE(std::string(failure.what()).find(cause), std::string::npos) << failure.what();
    }
  }

  Spool spool_;
  std::string path_;
};

std::vector<double> values(MeshSource& mesh, std::size_t array) {
  std::vector<double> out(mesh.info().array_elements(array) *
                          mesh.info().schema.arrays[array].components);
  mesh.read_array(array, 0, 0, mesh.info().array_elements(array),
                  reinterpret_cast<std::byte*>(out.data()));
  return out;
}

TEST_F(UcdTest, KnowsItsFiles) {
  const auto looks = [](const std::string& text) {
    return looks_like_ucd(std::as_bytes(std::span(text)));
  };
  EXPECT_TRUE(looks(kAll));
  EXPECT_TRUE(looks("8 1 0 0 0\r\n1 0 0 0\n"));
  EXPECT_FALSE(looks("# vtk DataFile Version 3.0\n1 2 3 4 5\n"));
  EXPECT_FALSE(looks("8 1 0 0\n"));
  EXPECT_FALSE(looks("$MeshFormat\n"));
  EXPECT_FALSE(looks(""));
}

TEST_F(UcdTest, ComesBackAsItWas) { EXPECT_EQ(written(*open(kAll)), kAll); }

TEST_F(UcdTest, MeansWhatItShould) {
  const auto mesh = open(kAll);
  const MeshInfo& info = mesh->info();
  EXPECT_EQ(info.vertices, 10u);
  EXPECT_EQ(info.cells(), 8u);
  ASSERT_EQ(info.schema.blocks.size(), 8u);
  EXPECT_EQ(info.schema.blocks[3].id, -7);
  EXPECT_EQ(info.schema.blocks[7].shape, CellShape::hexahedron);
  CellBatch cells;
  ASSERT_TRUE(mesh->next_cells(cells, 100));
  const std::vector<std::uint64_t> pyramid = {0, 1, 2, 3, 8};
  EXPECT_TRUE(std::equal(pyramid.begin(), pyramid.end(), cells.cell(5).begin()));
  ASSERT_EQ(info.schema.arrays.size(), 6u);
  EXPECT_EQ(info.schema.arrays[1].name, "velocity vector");
  EXPECT_EQ(info.schema.arrays[1].components, 3u);
  EXPECT_EQ(values(*mesh, 1)[3 * 1 + 2], 8.5);
  EXPECT_EQ(values(*mesh, 3), (std::vector<double>{-1, -2, -3, -4, -5, -6, -7, -8}));
  EXPECT_EQ(info.schema.arrays[4].role, "ucd:node_id");
  EXPECT_EQ(info.schema.arrays[5].role, "ucd:cell_id");
}

TEST_F(UcdTest, ValuesMayComeInAnyOrder) {
  const auto mesh = open("2 1 1 0 0\n1 0 0 0\n5 1 1 1\n1 0 line 1 5\n1 1\na, b\n5 50\n1 10\n");
  EXPECT_EQ(values(*mesh, 0), (std::vector<double>{10, 50}));
}

TEST_F(UcdTest, ManyMaterials) {
  std::string text = "2 1500 0 0 0\n1 0 0 0\n2 1 1 1\n";
  for (int i = 1; i <= 1500; ++i)
    text += std::to_string(i) + " " + std::to_string(7 * i) + " line 1 2\n";
  const auto mesh = open(text);
  EXPECT_EQ(mesh->info().schema.blocks.size(), 1u);
  EXPECT_EQ(written(*mesh), text);
}

TEST_F(UcdTest, MeshesOfOtherFormats) {
  MemoryMesh mesh = grid_mesh(2, 2, 2);
  mesh.mesh.schema.source_format = "exodus";
  const std::string text = written(mesh);
  const auto back = open(text);
  EXPECT_EQ(back->info().vertices, 27u);
  EXPECT_EQ(back->info().cells(), 8u);
}

TEST_F(UcdTest, SaysWhatItCannotWrite) {
  MemoryMesh mesh = grid_mesh(1, 1, 1);
  mesh.mesh.schema.blocks[0].shape = CellShape::other;
  try {
    written(mesh);
    FAIL();
  } catch (const Failure& failure) {
    EXPECT_EQ(failure.error().code, ErrorCode::unsupported);
  }
}

TEST_F(UcdTest, NamesWhatIsWrong) {
  const std::string valid = "2 1 0 0 0\n1 0 0 0\n2 1 1 1\n1 0 line 1 2\n";
  EXPECT_EQ(written(*open(valid)), valid);
  expect_refused("\x07 binary", "binary", ErrorCode::unsupported);
  expect_refused("2 1 0 0 0\n1 0 0 0\n1 1 1 1\n1 0 line 1 1\n", "two nodes");
  expect_refused("2 1 0 0 0\n1 0 0 0\n2 1 1 1\n1 0 line 1 3\n", "unknown node 3");
  expect_refused("2 1 0 0 0\n1 0 0 0\n2 1 1 1\n1 0 loop 1 2\n", "'loop'");
  expect_refused("2 1 0 0 0\n1 0 0 0\n2 1 1 x\n1 0 line 1 2\n", "nodes");
  expect_refused("2 1 2 0 0\n1 0 0 0\n2 1 1 1\n1 0 line 1 2\n1 1\na, b\n1 1\n2 1\n", "components");
  expect_refused("2 1 1 0 0\n1 0 0 0\n2 1 1 1\n1 0 line 1 2\n1 1\na, b\n1 1\n3 1\n",
                 "values for number 3");
  expect_refused("2 1 1 0 0\n1 0 0 0\n2 1 1 1\n1 0 line 1 2\n1 1\na, b\n1 1\n1 1\n", "twice");
  expect_refused("99999999999 1 0 0 0\n1 0 0 0\n", "nodes", ErrorCode::corrupt);
  expect_refused("2 99999999999999 0 0 0\n1 0 0 0\n2 1 1 1\n1 0 line 1 2\n", "cells");
}

TEST_F(UcdTest, EveryTruncationIsSurvived) {
  const std::size_t data_end = kAll.find("2 1 1\ntemp");
  for (std::size_t size = 0; size < kAll.size(); ++size) {
    try {
      open(kAll.substr(0, size));
      EXPECT_GE(size + 4, data_end) << "taken: " << size << " bytes";
    } catch (const Failure&) {
    }
  }
}

TEST_F(UcdTest, VtkAgrees) {
  const auto oracle = [](const std::string& a, const std::string& b) {
    const std::string command =
        std::string(SHM_PYTHON) + " " SHM_SOURCE_DIR "/tests/support/ucd_oracle.py " + a + " " + b;
    return std::system(command.c_str());
  };
  std::string plain = kAll;  // VTK requires unique numbers
  plain.replace(plain.find("17 2 hex"), 2, "18");
  plain.replace(plain.rfind("17 8"), 2, "18");
  plain.replace(plain.find("velocity vector\n"), 15, "velocity vector, m/s");
  plain.replace(plain.find("b,x"), 3, "b, x");
  const std::string source = path_ + ".source";
  std::ofstream(source, std::ios::binary) << plain;
  written(*open(plain));
  EXPECT_EQ(oracle(source, path_), 0);
  plain.replace(plain.find("8.5"), 3, "8.6");
  std::ofstream(source, std::ios::binary) << plain;
  EXPECT_NE(oracle(source, path_), 0);
  std::filesystem::remove(source);
}

}  // namespace
}  // namespace shm::converters
