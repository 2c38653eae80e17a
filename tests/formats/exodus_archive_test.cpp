// Tests of Exodus files that are compressed to .shm and decompressed. Independent programs compare
// the result with the source. In Order::keep, netCDF finds no difference. In the other orders,
// libexodusii reads the same mesh.
#include <gtest/gtest.h>
#include <netcdf.h>

#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <functional>
#include <random>
#include <string>

#include "base/failure.h"
#include "compression/compress.h"
#include "compression/decompress.h"
#include "exodus/exodus.h"
#include "shm/io.h"
#include "support/exodus_files.h"
#include "support/exodus_oddities.h"
#include "support/exodus_oracle.h"
#include "support/temporary_folder.h"

namespace shm::converters {
namespace {

namespace fs = std::filesystem;

// Converts a source to .shm and back to the format of the source, as the tool does.
void archive_and_restore(const std::string& from, const std::string& to,
                         const CompressOptions& options = {}) {
  Spool spool(fs::path(to).parent_path().string());
  MemorySink sink;
  compress_mesh(*open_exodus(from, spool), sink, options, spool);
  MemorySource source(sink.bytes);
  StagedMesh restored(source, "test.shm", spool);
  write_exodus(restored, to);
}

#define NC(call) ASSERT_EQ((call), NC_NOERR) << #call

TEST(ExodusArchive, EverythingComesBackEqual) {
  TemporaryFolder folder;
  const std::string path = folder / "all.e", copy = folder / "copy.e", again = folder / "again.e";
  const std::vector<exodus_files::Options> kinds{
      {EX_NORMAL_MODEL, 4, 32},
      {EX_LARGE_MODEL, 8, 33},
      {EX_NETCDF4, 8, 255, 4, true},
      {EX_NETCDF4 | EX_NOCLASSIC | EX_ALL_INT64_DB, 4, 80, 1, false},
      {EX_NETCDF4 | EX_ALL_INT64_DB, 8, 32, 0, false, 0},
      {EX_LARGE_MODEL, 4, 32, 0, false, 0}};
  for (const auto& options : kinds) {
    SCOPED_TRACE(options.mode);
    exodus_files::Maker(path, options);
    ASSERT_FALSE(HasFailure());
    ASSERT_NO_THROW(archive_and_restore(path, copy));
    EXPECT_TRUE(equal_files(path, copy));
    ASSERT_NO_THROW(archive_and_restore(path, again));
    EXPECT_TRUE(file_content(copy) == file_content(again));
  }
}

TEST(ExodusArchive, WhatTheManualDoesNotNameComesBackEqual) {
  TemporaryFolder folder;
  const std::string path = folder / "odd.e", copy = folder / "copy.e", again = folder / "again.e";
  for (const int mode : {EX_NORMAL_MODEL, EX_LARGE_MODEL, EX_NETCDF4, EX_NETCDF4 | EX_NOCLASSIC}) {
    SCOPED_TRACE(mode);
    exodus_files::Maker(path, {mode, 8, 32});
    exodus_files::add_oddities(path);
    ASSERT_FALSE(HasFailure());
    ASSERT_NO_THROW(archive_and_restore(path, copy));
    EXPECT_TRUE(equal_files(path, copy));
    ASSERT_NO_THROW(archive_and_restore(path, again));
    EXPECT_TRUE(file_content(copy) == file_content(again));
  }
}

// Creates a valid netCDF-4 Exodus file, and calls `define` to add an item that cannot be converted.
// Returns the error with which opening the file fails.
Error refusal(const std::string& path, const std::function<void(int)>& define) {
  exodus_files::Maker(path, {EX_NETCDF4 | EX_NOCLASSIC, 8, 32});
  int id = -1;
  EXPECT_EQ(nc_open(path.c_str(), NC_WRITE, &id), NC_NOERR);
  define(id);
  EXPECT_EQ(nc_close(id), NC_NOERR);
  Spool spool(fs::path(path).parent_path().string());
  try {
    open_exodus(path, spool);
  } catch (const Failure& failure) {
    return failure.error();
  }
  ADD_FAILURE() << "not refused";
  return {};
}

TEST(ExodusArchive, GroupsAndTypesOfUsersAreRefusedByName) {
  TemporaryFolder folder;
  int made = -1;
  const Error groups = refusal(folder / "groups.e", [&](int id) {
    EXPECT_EQ(nc_def_grp(id, "first mesh", &made), NC_NOERR);
    EXPECT_EQ(nc_def_grp(id, "second mesh", &made), NC_NOERR);
  });
  EXPECT_EQ(groups.code, ErrorCode::unsupported);
  EXPECT_NE(groups.detail.find("'first mesh', 'second mesh'"), std::string::npos) << groups.detail;
  const Error types = refusal(folder / "types.e", [&](int id) {
    EXPECT_EQ(nc_def_opaque(id, 4, "colours", &made), NC_NOERR);
    EXPECT_EQ(nc_def_vlen(id, "lists", NC_INT, &made), NC_NOERR);
  });
  EXPECT_EQ(types.code, ErrorCode::unsupported);
  EXPECT_NE(types.detail.find("'colours', 'lists'"), std::string::npos) << types.detail;
}

// A set and the variable on this set are larger than the maximum size of an extra, so each is
// stored in several extras. The members of the set are renumbered.
TEST(ExodusArchive, LargeVariablesAreCarriedInParts) {
  TemporaryFolder folder;
  const std::string path = folder / "large.e", copy = folder / "copy.e";
  constexpr std::int64_t kMembers = 5'000'000;
  int memory = 8, file = 8;
  const int id = ex_create(path.c_str(), EX_CLOBBER | EX_LARGE_MODEL, &memory, &file);
  ASSERT_GE(id, 0);
  const double xyz[3] = {0, 1, 2}, time = 0;
  std::vector<int> members(kMembers, 2);
  std::vector<double> values(kMembers);
  members.front() = 1;
  members.back() = 3;
  values.back() = 4.5;
  char name[] = "load";
  char* names[1] = {name};
  EXPECT_GE(ex_put_init(id, "large", 3, 3, 0, 0, 1, 0), 0);
  EXPECT_GE(ex_put_coord(id, xyz, xyz, xyz), 0);
  EXPECT_GE(ex_put_set_param(id, EX_NODE_SET, 1, kMembers, 0), 0);
  EXPECT_GE(ex_put_set(id, EX_NODE_SET, 1, members.data(), nullptr), 0);
  EXPECT_GE(ex_put_variable_param(id, EX_NODE_SET, 1), 0);
  EXPECT_GE(ex_put_variable_names(id, EX_NODE_SET, 1, names), 0);
  for (int step = 1; step <= 2; ++step) {
    EXPECT_GE(ex_put_time(id, step, &time), 0);
    EXPECT_GE(ex_put_var(id, step, EX_NODE_SET, 1, 1, kMembers, values.data()), 0);
  }
  EXPECT_GE(ex_close(id), 0);
  Spool spool(folder / ".");
  std::size_t parts = 0;
  const auto mesh = open_exodus(path, spool);
  for (const Extra& extra : mesh->info().extras) {
    EXPECT_LE(extra.data.size(), std::size_t{40} << 20) << extra.key;
    if (extra.refers == Reference::vertex) ++parts;
  }
  EXPECT_EQ(parts, 2u);
  ASSERT_NO_THROW(archive_and_restore(path, copy));
  EXPECT_TRUE(file_content(path) == file_content(copy));
}

// Some of these files are nearly empty; others declare values that were never written.
TEST(ExodusArchive, SparseAndSmallFilesComeBackEqual) {
  TemporaryFolder folder;
  const std::string path = folder / "small.e", copy = folder / "copy.e";
  struct Kind {
    int mode;
    int variables;  // record variables
    nc_type type;
  };
  for (const Kind& kind :
       {Kind{0, 0, NC_INT}, Kind{0, 1, NC_BYTE}, Kind{0, 3, NC_SHORT},
        Kind{NC_64BIT_OFFSET, 1, NC_SHORT}, Kind{NC_64BIT_DATA, 3, NC_UINT64},
        Kind{NC_NETCDF4, 2, NC_DOUBLE}, Kind{NC_NETCDF4 | NC_CLASSIC_MODEL, 2, NC_FLOAT}}) {
    SCOPED_TRACE(testing::Message() << kind.mode << " " << kind.variables);
    int id = -1, dimension = -1, used[2], variable = -1;
    NC(nc_create(path.c_str(), NC_CLOBBER | kind.mode, &id));
    NC(nc_def_dim(id, "num_dim", 3, &dimension));
    const bool sparse = (kind.mode & NC_NETCDF4) != 0;
    if (kind.variables > 0) {
      NC(nc_def_dim(id, "time_step", NC_UNLIMITED, &used[0]));
      NC(nc_def_dim(id, "num_nodes", sparse ? 20'000 : 5, &used[1]));
    }
    for (int v = 0; v < kind.variables; ++v) {
      NC(nc_def_var(id, ("record" + std::to_string(v)).c_str(), kind.type, 2, used, &variable));
      if (v == 0) {
        NC(nc_put_att(id, variable, "_FillValue", kind.type, 1,
                      "\x40\x41\x42\x43\x44\x45\x46\x47"));
      }
      if (sparse) {
        NC(nc_def_var_deflate(id, variable, 1, 1, 1));
      }
    }
    NC(nc_enddef(id));
    const std::vector<double> values{0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 13, 14};
    const std::size_t start[2] = {0, 0}, count[2] = {3, 5};
    if (kind.variables > 0) {
      NC(nc_put_vara_double(id, variable, start, count, values.data()));
    }
    NC(nc_close(id));
    ASSERT_NO_THROW(archive_and_restore(path, copy));
    EXPECT_TRUE(equal_files(path, copy));
  }
}

// The values of the variable are never written. In a file of this size, 100 steps of unwritten
// values are allowed, and 1000 steps are refused.
TEST(ExodusArchive, UnwrittenValuesHaveABound) {
  TemporaryFolder folder;
  for (const std::size_t steps : {100, 1000}) {
    int id = -1, dimension = -1, used[2], variable = -1;
    NC(nc_create((folder / "sparse.e").c_str(), NC_CLOBBER | NC_NETCDF4, &id));
    NC(nc_def_dim(id, "num_dim", 3, &dimension));
    NC(nc_def_dim(id, "time_step", steps, &used[0]));
    NC(nc_def_dim(id, "num_nodes", 1'000'000, &used[1]));
    NC(nc_def_var(id, "never", NC_DOUBLE, 2, used, &variable));
    NC(nc_def_var_deflate(id, variable, 1, 1, 1));
    NC(nc_close(id));
    Spool spool(folder / ".");
    if (steps == 100)
      EXPECT_EQ(open_exodus(folder / "sparse.e", spool)->info().schema.arrays.size(), 1u);
    else
      EXPECT_THROW(open_exodus(folder / "sparse.e", spool), Failure);
  }
}

// Compares two lists of sentences that describe two files. If the lists differ, the failure shows
// the sentences that only one of them contains.
testing::AssertionResult same_mesh(const std::string& a, const std::string& b) {
  const exodus_files::Teller exodus_a(a), exodus_b(b);
  std::vector<std::string> only;
  const auto compare = [&](const std::multiset<std::string>& x,
                           const std::multiset<std::string>& y) {
    EXPECT_GT(x.size(), 500u);
    std::set_symmetric_difference(x.begin(), x.end(), y.begin(), y.end(), std::back_inserter(only));
  };
  compare(exodus_a.sentences, exodus_b.sentences);
  compare(exodus_files::told_by_netcdf(a), exodus_files::told_by_netcdf(b));
  if (only.empty()) return testing::AssertionSuccess();
  auto failure = testing::AssertionFailure() << only.size() << " differences:";
  for (std::size_t i = 0; i < std::min<std::size_t>(only.size(), 8); ++i)
    failure << "\n" << only[i];
  return failure;
}

TEST(ExodusArchive, EverythingFollowsNodesAndElementsThatMove) {
  TemporaryFolder folder;
  const std::string path = folder / "all.e", copy = folder / "copy.e";
  exodus_files::Maker(path, {EX_LARGE_MODEL, 8, 32});
  exodus_files::add_oddities(path);
  CompressOptions stream, delayed, free, shuffled;
  stream.order = delayed.order = Order::stream;
  delayed.delay = 20;
  free.order = shuffled.order = Order::free;
  CellSequence cells(161);
  std::iota(cells.begin(), cells.end(), 0);
  std::shuffle(cells.begin(), cells.end(), std::mt19937(3));
  shuffled.cell_order = &cells;
  for (const CompressOptions* options : {&stream, &delayed, &free, &shuffled}) {
    SCOPED_TRACE(testing::Message() << order_name(options->order) << " " << *options->delay);
    ASSERT_NO_THROW(archive_and_restore(path, copy, *options));
    EXPECT_TRUE(same_mesh(path, copy));
    EXPECT_FALSE(equal_files(path, copy));
  }
}

}  // namespace
}  // namespace shm::converters
