// Tests conversions between legacy VTK and VTU of meshes whose extras are inconsistent, as in a
// hostile .shm file. A conversion must either throw Failure or write a readable file.
// vtk_files_test.py checks valid extras with VTK.
#include <gtest/gtest.h>

#include <string>

#include "files/mesh_files.h"
#include "formats/formats.h"
#include "support/vtk_fixture.h"
#include "vtk/between/vtk_from_vtu.h"
#include "vtk/between/vtu_from_vtk.h"
#include "vtk/xml/vtu.h"

namespace shm::converters {
namespace {

// A file with two polyhedra. In addition to points and cells, it contains one item of each kind
// that legacy VTK supports.
const char* const kLegacy = R"(# vtk DataFile Version 4.2
a title
ASCII
DATASET UNSTRUCTURED_GRID
FIELD FieldData 3
TIME 1 1 double
2.5
words 1 2 string
a
b
flags 1 3 bit
1 0 1
POINTS 5 int
0 0 0 1 0 0 0 1 0 0 0 1 1 1 1
METADATA
COMPONENT_NAMES
x

z

CELLS 2 36
17 4 3 0 1 2 3 0 1 3 3 0 2 3 3 1 2 3
17 4 3 1 2 3 3 1 2 4 3 1 3 4 3 2 3 4
CELL_TYPES 2
42 42
POINT_DATA 5
SCALARS t float 1
LOOKUP_TABLE default
1 2 3 4 5
METADATA
INFORMATION 1
NAME UNITS_LABEL LOCATION vtkDataArray
DATA m/s

SCALARS t float 1
LOOKUP_TABLE table
1 2 3 4 5
LOOKUP_TABLE table 1
0 0 0 1
FIELD more 3
bits 1 5 bit
0 1 0 1 1
names 1 5 string
p
q
p

r
few 1 3 int
1 2 3
)";

class VtkFamilyTest : public VtkTest {
 protected:
  // Writes the mesh to a file in the other of the two formats. The file must be readable.
  void write_other(MeshSource& mesh) {
    const bool legacy = mesh.info().schema.source_format == "vtk";
    const std::string out = path(legacy ? "out.vtu" : "out.vtk");
    write_mesh(mesh, out, *format_named(legacy ? "vtu" : "vtk"), spool_);
    take(*open_mesh(out, spool_));
  }
  // Replaces the extra `key` with `text`, and writes the mesh in the other format. Returns true if
  // the written file can be read, or false if Failure is thrown.
  bool writes_with(MeshSource& mesh, const std::string& key, const std::string& text) {
    BentExtra bent(mesh, key, text);
    try {
      (mesh.info().schema.source_format == "vtk" ? vtu::losses_in_vtu
                                                 : vtk::losses_in_vtk)(bent.info());
      write_other(bent);
      return true;
    } catch (const Failure& failure) {
      EXPECT_FALSE(failure.error().detail.empty());
      return false;
    }
  }
  // Tests many variants of each text extra: with one changed byte, truncated at each position, or
  // with one line repeated.
  void bend_all(MeshSource& mesh) {
    std::size_t readable = 0, refused = 0;
    const auto try_it = [&](const std::string& key, const std::string& text) {
      ++(writes_with(mesh, key, text) ? readable : refused);
    };
    for (const Extra& extra : mesh.info().extras) {
      if (extra.type != ScalarType::uint8) continue;
      SCOPED_TRACE(extra.key);
      const std::string text = text_of(&extra);
      for (std::size_t at = 0; at < text.size(); ++at) {
        for (const int flip : {1, 16, '0' ^ '9'}) {
          std::string other = text;
          other[at] = static_cast<char>(other[at] ^ flip);
          try_it(extra.key, other);
        }
        try_it(extra.key, text.substr(0, at));
        const std::size_t end = text.find('\n', at);
        if ((at == 0 || text[at - 1] == '\n') && end != std::string::npos)
          try_it(extra.key, text.substr(0, end + 1) + text.substr(at));
      }
    }
    EXPECT_GT(readable, 100u);
    EXPECT_GT(refused, 100u);
  }
};

TEST_F(VtkFamilyTest, BentExtrasOfLegacyFiles) { bend_all(*open_text(kLegacy)); }

TEST_F(VtkFamilyTest, BentExtrasOfXmlFiles) {
  write_other(*open_text(kLegacy));
  bend_all(*open_vtu(path("out.vtu"), spool_));
}

// The extra declares such a large number of component names that a list of them could not be
// created in reasonable time.
TEST_F(VtkFamilyTest, ImpossibleNumbersOfComponents) {
  const auto mesh = open_text(kLegacy);
  std::string skeleton = text_of(find_extra(mesh->info(), "vtk/skeleton"));
  const std::size_t at = skeleton.find("TIME double 1 1");
  ASSERT_NE(at, std::string::npos) << skeleton;
  skeleton.replace(at, 15, "TIME double 4611686018427387904 4\n|COMPONENT_NAMES\n|a");
  EXPECT_FALSE(writes_with(*mesh, "vtk/skeleton", skeleton));
  write_other(*mesh);
  const auto xml = open_vtu(path("out.vtu"), spool_);
  skeleton = text_of(find_extra(xml->info(), "vtu/skeleton"));
  const std::size_t name = skeleton.find("Name=\"TimeValue\"");
  ASSERT_NE(name, std::string::npos) << skeleton;
  skeleton.insert(name, "NumberOfComponents=\"4611686018427387904\" ComponentName1=\"a\" ");
  EXPECT_TRUE(writes_with(*xml, "vtu/skeleton", skeleton));
}

TEST_F(VtkFamilyTest, SkeletonsThatAreNone) {
  const auto mesh = open_text(kLegacy);
  write_other(*mesh);
  EXPECT_FALSE(writes_with(*mesh, "vtk/skeleton", "nothing"));
  EXPECT_FALSE(writes_with(*open_vtu(path("out.vtu"), spool_), "vtu/skeleton", "<VTKFile/>"));
}

}  // namespace
}  // namespace shm::converters
