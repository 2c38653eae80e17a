// Tests of the skeleton, a text that describes the structure of an Exodus file. The text is
// restored unchanged, and it is the same for files that differ only in numbers. Texts that older
// versions wrote are still read correctly.
#include <gtest/gtest.h>
#include <netcdf.h>

#include <random>
#include <string>
#include <vector>

#include "base/failure.h"
#include "exodus/layout.h"
#include "exodus/skeleton.h"
#include "support/memory_mesh.h"

namespace shm::converters::exodus {
namespace {

const Place kPlace{"mesh.shm", ErrorCode::corrupt};

Variable variable(std::string name, std::vector<std::size_t> dimensions) {
  return {std::move(name), NC_INT, std::move(dimensions), {}, {}};
}

Skeleton with_sets(std::size_t first, std::size_t sets) {
  Skeleton skeleton;
  skeleton.dimensions.push_back({"num_nodes", 8, false});
  for (std::size_t i = 0; i < first; ++i)
    skeleton.dimensions.push_back({std::string(i + 1, 'x'), 2, false});
  for (std::size_t i = 1; i <= sets; ++i)
    skeleton.dimensions.push_back({"num_side_ss" + std::to_string(i), 9, false});
  for (std::size_t i = 1; i <= sets; ++i)
    for (const char* list : {"elem_ss", "side_ss"})
      skeleton.variables.push_back(variable(list + std::to_string(i), {first + i}));
  return skeleton;
}

std::string text_of_variables(const Skeleton& skeleton) {
  const std::string text = to_text(skeleton);
  return text.substr(text.find("\nV\t") + 1);
}

TEST(ExodusSkeleton, TextIsAsDocumented) {
  EXPECT_EQ(to_text(with_sets(0, 2)),
            "K\tclassic\nD\tnum_nodes\t8\nD\tnum_side_ss#\t9\nD\tnum_side_ss#\t9\n"
            "V\telem_ss#\tint\tnum_side_ss#\nV\tside_ss#\tint\tnum_side_ss#\n"
            "V\telem_ss#\tint\tnum_side_ss#\nV\tside_ss#\tint\tnum_side_ss#\n");
}

TEST(ExodusSkeleton, VariablesHaveTheSameLinesWhereverTheirDimensionsStand) {
  EXPECT_EQ(text_of_variables(with_sets(0, 12)), text_of_variables(with_sets(5, 12)));
}

TEST(ExodusSkeleton, OddNamesComeBack) {
  Skeleton skeleton;
  std::vector<std::size_t> all;
  for (const char* name : {"",
                           "#",
                           "##",
                           "1",
                           "0",
                           "01",
                           "#1",
                           "1#",
                           "%",
                           "%23",
                           "%2",
                           "x1",
                           "x2",
                           "x#",
                           "x4",
                           "x5",
                           "x05",
                           "x6",
                           "x1y1",
                           "x1y2",
                           "x2y3",
                           "x18446744073709551615",
                           "x18446744073709551616",
                           "x18446744073709551615y1",
                           "x7",
                           "\t1",
                           "\t2",
                           "\n10",
                           "a\x01"
                           "9",
                           "\x7f",
                           "gr\xc3\xb6\xc3\x9f"
                           "e",
                           "123456789012345678901234567890",
                           "123456789012345678901234567890y",
                           "K",
                           "+"}) {
    all.push_back(all.size());
    skeleton.dimensions.push_back({name, all.size(), all.size() % 7 == 0});
  }
  for (const Dimension& dimension : skeleton.dimensions)
    skeleton.variables.push_back(variable(dimension.name, all));
  skeleton.variables.push_back(variable("of none", {}));
  for (int kind = 0; kind < 5; ++kind) {
    skeleton.kind = static_cast<Kind>(kind);
    EXPECT_EQ(from_text(to_text(skeleton), kPlace), skeleton);
  }
}

TEST(ExodusSkeleton, NamesOfAnyCharactersComeBack) {
  std::mt19937 random(7);
  for (int round = 0; round < 300; ++round) {
    Skeleton skeleton;
    for (int i = 0; i < 20; ++i) {
      std::string name;
      for (std::size_t left = random() % 6; left > 0; --left) name += "0129ax#%\t"[random() % 9];
      if (skeleton.find_dimension(name) < 0) skeleton.dimensions.push_back({name, 1, false});
      skeleton.variables.push_back(variable(name, {random() % skeleton.dimensions.size()}));
    }
    EXPECT_EQ(from_text(to_text(skeleton), kPlace), skeleton) << to_text(skeleton);
  }
}

constexpr const char* kOldText =
    "N\tnetcdf4\nD\tn\t3\nD\tside#\t4\tunlimited\nA\ttitle\tchar\ta%"
    "09b\nV\tx1\tint\t1\t0\nS\t1\t0\t"
    "0\t1\t3\nA\tID\tdouble\t0.5\nV\tx#\tint\t0\n";

TEST(ExodusSkeleton, OldTextIsReadAsItWas) {
  const Skeleton skeleton = from_text(kOldText, kPlace);
  EXPECT_EQ(skeleton.kind, Kind::netcdf4);
  ASSERT_EQ(skeleton.dimensions.size(), 2u);
  EXPECT_EQ(skeleton.dimensions[1], (Dimension{"side#", 4, true}));
  ASSERT_EQ(skeleton.variables.size(), 2u);
  EXPECT_EQ(skeleton.variables[0].dimensions, (std::vector<std::size_t>{1, 0}));
  EXPECT_EQ(skeleton.variables[1].name, "x#");
  EXPECT_EQ(from_text(to_text(skeleton), kPlace), skeleton);
}

TEST(ExodusSkeleton, OldFilesHaveTheTextOfNewOnes) {
  MeshInfo info;
  info.schema.source_format = "exodus";
  info.extras = {text_extra("exodus/skeleton", kOldText)};
  translate_old_extras(info);
  const std::string text = to_text(from_text(kOldText, kPlace));
  EXPECT_EQ(text_of_extra(info.extras[0]), text);
  translate_old_extras(info);
  EXPECT_EQ(text_of_extra(info.extras[0]), text);
  info.extras = {text_extra("exodus/skeleton", "N\tclassic\nV\tx\tint\t0\n")};
  translate_old_extras(info);
  EXPECT_EQ(text_of_extra(info.extras[0]), "N\tclassic\nV\tx\tint\t0\n");
}

TEST(ExodusSkeleton, DamagedTextIsRefused) {
  for (const char* text :
       {"K\n", "K\tunknown\n", "K\tclassic\tmore\n", "D\tn\t1\nK\tclassic\n",
        "K\tclassic\nN\tclassic\n", "N\tclassic\nK\tclassic\n", "K\tclassic\nD\n",
        "K\tclassic\nD\tn\n", "K\tclassic\nV\n", "K\tclassic\nD\tn\t1\nV\tx\n",
        "K\tclassic\nD\tn\t1\nV\tx\tint\t0\n", "K\tclassic\nD\tn\t1\nV\tx\tint\tm\n",
        "K\tclassic\nD\tn1\t1\nV\tx\tint\tn#\n", "K\tclassic\nD\tn1\t1\nV\tx2\tint\tn#\n",
        "K\tclassic\nV\tx\tint\tn\nD\tn\t1\n", "K\tclassic\nD\tn\t1\nD\tn\t2\n",
        "K\tclassic\nD\tn#\t1\nD\tn1\t2\n", "K\tclassic\nD\tn%2\t1\n",
        "K\tclassic\nD\tn\t1\nV\tx\tint\t\n"}) {
    try {
      from_text(text, kPlace);
      ADD_FAILURE() << text;
    } catch (const Failure& failure) {
      EXPECT_EQ(failure.error().code, ErrorCode::corrupt) << text;
      EXPECT_NE(failure.error().message().find("is invalid"), std::string::npos) << text;
    }
  }
}

// A damaged file may request that a long number be inserted many times. The text would become far
// larger than any valid skeleton.
TEST(ExodusSkeleton, LongNumbersStandForThemselvesOnly) {
  const std::string digits(50000, '7'), marks(50000, '#');
  EXPECT_THROW(from_text("K\tclassic\nD\tn\t1\nV\tx" + digits + "\tint\t" + marks + "\n", kPlace),
               Failure);
  const Skeleton skeleton =
      from_text("K\tclassic\nD\tn18446744073709551614\t1\nD\tn#\t1\nD\t" + marks + "\t1\n", kPlace);
  EXPECT_EQ(skeleton.dimensions[1].name, "n18446744073709551615");
  EXPECT_EQ(skeleton.dimensions[2].name, std::string(50000, '1'));
}

TEST(ExodusSkeleton, OldTextDoesNotGrowWithoutBound) {
  std::string text = "N\tclassic\nD\t" + std::string(100000, 'x') + "\t1\nV\tv\tint";
  for (int i = 0; i < 100000; ++i) text += "\t0";
  EXPECT_THROW(from_text(text + "\n", kPlace), Failure);
}

// The variable has a long name and a million dimensions. The time to read each dimension must not
// depend on the length of the name.
TEST(ExodusSkeleton, LongNamesOfManyDimensionsAreRead) {
  const std::string name(1000000, 'x'), dimensions(1000000, '\t');
  const Skeleton skeleton =
      from_text("K\tclassic\nD\t\t1\nV\t" + name + "\tint" + dimensions + "\n", kPlace);
  EXPECT_EQ(skeleton.variables[0].dimensions.size(), 1000000u);
}

}  // namespace
}  // namespace shm::converters::exodus
