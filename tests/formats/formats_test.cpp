// Tests that formats are found by name, and that output files appear only when they are complete.
#include "formats/formats.h"
#include "files/mesh_files.h"

#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <iterator>
#include <string>

#include "base/failure.h"
#include "base/output_file.h"
#include "support/memory_mesh.h"
#include "support/temporary_folder.h"

namespace shm::converters {
namespace {

std::string format_by_name(const char* path) {
  const Format* format = format_of_name(path);
  return format == nullptr ? "" : std::string(format->name);
}

TEST(Formats, ByName) {
  EXPECT_EQ(format_by_name("a.e"), "exodus");
  EXPECT_EQ(format_by_name("dir.vtk/a.EXO"), "exodus");
  EXPECT_EQ(format_by_name("out.e.4.0"), "exodus");
  EXPECT_EQ(format_by_name("out.e-s002"), "exodus");
  EXPECT_EQ(format_by_name("out.e-s002.4.1"), "exodus");
  EXPECT_EQ(format_by_name("a.g"), "exodus");
  EXPECT_EQ(format_by_name("a.gen"), "exodus");
  EXPECT_EQ(format_by_name("a.b.vtk"), "vtk");
  EXPECT_EQ(format_by_name("a.vtu"), "vtu");
  EXPECT_EQ(format_by_name("a.msh"), "gmsh");
  EXPECT_EQ(format_by_name("a.e.shm"), "shm");
  EXPECT_EQ(format_by_name("a"), "");
  EXPECT_EQ(format_by_name("a.4"), "");
  EXPECT_EQ(format_by_name("a.e-"), "");
  EXPECT_EQ(format_by_name("a.e-sx"), "");
  EXPECT_EQ(format_by_name("a.vtk.gz"), "");
  EXPECT_EQ(format_by_name("a.vtk."), "");
  EXPECT_EQ(format_by_name("dir.vtk/a"), "");
  EXPECT_EQ(format_by_name(""), "");
}

TEST(Formats, ContentCountsBeforeName) {
  const TemporaryFolder folder;
  const std::string vtk = folder / "mesh.vtk", odd = folder / "mesh.msh";
  MemoryMesh mesh = grid_mesh(2, 2, 2);
  mesh.mesh.schema.source_format = "";
  Spool spool(folder.path().string());
  write_mesh(mesh, vtk, *format_named("vtk"), spool);
  std::filesystem::rename(vtk, odd);
  EXPECT_EQ(format_of_file(odd)->name, "vtk");
  EXPECT_EQ(open_mesh(odd, spool)->info().schema.source_format, "vtk");
}

class OutputFileTest : public ::testing::Test {
 protected:
  long files() const {
    return std::distance(std::filesystem::directory_iterator(directory_),
                         std::filesystem::directory_iterator());
  }
  std::string text() const {
    std::ifstream in(path_);
    return {std::istreambuf_iterator<char>(in), {}};
  }
  static void put(OutputFile& file, const std::string& words) {
    file.write(std::as_bytes(std::span(words)));
  }
  TemporaryFolder folder_;
  std::string directory_ = folder_.path().string(), path_ = folder_ / "out.txt";
};

TEST_F(OutputFileTest, AppearsWithCommitOnly) {
  {
    OutputFile file(path_);
    put(file, "half");
    EXPECT_FALSE(std::filesystem::exists(path_));
  }
  EXPECT_EQ(files(), 0);
  OutputFile file(path_);
  put(file, "whole");
  file.commit();
  EXPECT_EQ(text(), "whole");
  EXPECT_EQ(files(), 1);
}

TEST_F(OutputFileTest, FailedRunLeavesTheOldFile) {
  std::ofstream(path_) << "old";
  {
    OutputFile file(path_);
    put(file, "new");
  }
  EXPECT_EQ(text(), "old");
  EXPECT_EQ(files(), 1);
}

TEST_F(OutputFileTest, WrittenByName) {
  OutputFile file(path_);
  std::ofstream(file.temporary()) << "named";
  EXPECT_EQ(OutputFile::folder_of(file.temporary()), directory_);
  EXPECT_EQ(OutputFile::folder_of(path_), directory_);
  file.commit();
  EXPECT_EQ(text(), "named");
  EXPECT_EQ(files(), 1);
}

TEST_F(OutputFileTest, NowhereToWrite) {
  try {
    OutputFile file(directory_ + "/no/out.txt");
    FAIL();
  } catch (const Failure& failure) {
    EXPECT_EQ(failure.error().code, ErrorCode::output);
    EXPECT_EQ(failure.error().file, directory_ + "/no/out.txt");
  }
}

}  // namespace
}  // namespace shm::converters
