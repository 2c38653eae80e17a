// Tests that files of unsupported formats are recognized, and that the message names the format.
// Such files must not be mistaken for files of other formats.
#include "formats/unread_formats.h"
#include "files/mesh_files.h"

#include <gtest/gtest.h>

#include <span>
#include <string>

#include "base/failure.h"
#include "base/spool.h"
#include "support/temporary_folder.h"

namespace shm::converters {
namespace {

struct Sample {
  const char *name, *text, *format;
};
constexpr Sample kSamples[] = {
    {"beam.inp", "** made by a program\n\n*Heading\n beam\n*Node\n1, 0, 0, 0\n", "Abaqus"},
    {"beam.inp", "*NODE, NSET=all\n", "Abaqus"},
    {"wing.dat", "$ a comment\nSOL 101\nCEND\nBEGIN BULK\n", "Nastran"},
    {"wing.bdf", "GRID           1       0     0.0     0.0     0.0\n", "Nastran"},
    {"jet.su2", "% a jet\nNDIME= 3\n", "SU2"},
    {"cube.mesh", "# cube\nMeshVersionFormatted 2\nDimension 3\n", "Medit"},
};

class UnreadFormats : public FolderTest {
 protected:
  std::string refusal_of(const std::string& file) {
    Spool spool(directory_.string());
    try {
      open_mesh(file, spool);
    } catch (const Failure& failure) {
      return failure.error().message();
    }
    return "opened";
  }
};

TEST_F(UnreadFormats, AreCalledWhatTheyAre) {
  for (const Sample& it : kSamples) {
    const std::string text = it.text;
    EXPECT_NE(unread_format(std::as_bytes(std::span(text))).find(it.format), std::string::npos)
        << text;
    const std::string refusal = refusal_of(write_file(it.name, text));
    EXPECT_NE(refusal.find(it.format), std::string::npos) << refusal;
  }
}

TEST_F(UnreadFormats, EmptyFilesAreEmpty) {
  for (const char* name : {"a.vtk", "a.inp", "a.e", "a.shm", "a"})
    EXPECT_NE(refusal_of(write_file(name, "")).find("is empty"), std::string::npos) << name;
}

TEST_F(UnreadFormats, WhatIsReadIsNotAmongThem) {
  for (const std::string text :
       {"# a comment\n3 1 0 0 0\n", "# vtk DataFile Version 3.0\n", "$MeshFormat\n4.1 0 8\n",
        "<?xml version=\"1.0\"?>\n", "CDF\x01", ""})
    EXPECT_EQ(unread_format(std::as_bytes(std::span(text))), "") << text;
}

}  // namespace
}  // namespace shm::converters
