// Exodus files through the archive and back: compressed, decompressed, and compared with the source
// by programs that are not ours. In Order::keep netCDF finds no difference; in the other orders
// libexodusii reads the same mesh.
#include <gtest/gtest.h>
#include <netcdf.h>

#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <random>
#include <string>

#include "compress.h"
#include "decompress.h"
#include "exodus.h"
#include "exodus_files.h"
#include "failure.h"
#include "shm/io.h"

namespace shm::converters {
namespace {

namespace fs = std::filesystem;

class TemporaryFolder {
 public:
  TemporaryFolder() {
    std::string name = (fs::temp_directory_path() / "shm-exodus-XXXXXX").string();
    path_ = mkdtemp(name.data());
  }
  ~TemporaryFolder() { fs::remove_all(path_); }
  std::string operator/(const std::string& name) const { return (path_ / name).string(); }

 private:
  fs::path path_;
};

// Whether netCDF's own tools find two files equal; says how they differ.
testing::AssertionResult equal_files(const std::string& a, const std::string& b) {
  const std::string report = b + ".report";
  const std::string command = "python3 '" SHM_SOURCE_DIR "/tests/exodus_oracle.py' '" + a + "' '" +
                              b + "' > '" + report + "' 2>&1";
  if (std::system(command.c_str()) == 0) return testing::AssertionSuccess();
  std::ifstream in(report);
  return testing::AssertionFailure() << a << ":\n" << std::string(std::istreambuf_iterator(in), {});
}

std::string bytes_of(const std::string& path) {
  std::ifstream in(path, std::ios::binary);
  return {std::istreambuf_iterator(in), {}};
}

// Source -> archive -> file of the same format, as the tool does it.
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
    EXPECT_TRUE(bytes_of(copy) == bytes_of(again));
  }
}

// Sentences of one file that the other does not say.
testing::AssertionResult same_mesh(const std::string& a, const std::string& b) {
  const exodus_files::Teller first(a), second(b);
  std::vector<std::string> only;
  std::set_symmetric_difference(first.sentences.begin(), first.sentences.end(),
                                second.sentences.begin(), second.sentences.end(),
                                std::back_inserter(only));
  if (first.sentences.size() < 500) return testing::AssertionFailure() << "too little is told";
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
