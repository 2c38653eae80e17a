// Writes the seeds of the fuzz targets into folders below DIR: make_seeds DIR GOLDEN_DIR.
//   shm      the golden files of all versions, and one small file for each feature of the format as
//            it is now, each behind the byte that says the piece sizes
//   calls    some of these with a script of calls behind them (fuzz_calls)
//   archive  archives, behind a byte
// and with converters
//   parity   files with parity
//   exodus, gmsh, ucd, vtk, vtu   some of the feature files in these formats
#include <algorithm>
#include <array>
#include <cstdio>
#include <cstdlib>
#include <exception>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <string>
#include <string_view>
#include <vector>

#include "../tests/feature_files.h"
#ifdef SHM_SEEDS_OF_CONVERTERS
#include "../tests/parity_file.h"
#include "decompress.h"
#include "failure.h"
#include "formats.h"
#include "parity.h"
#include "spool.h"
#endif

namespace {

using std::filesystem::path;

void write(const path& file, const std::string& bytes) {
  std::filesystem::create_directories(file.parent_path());
  std::ofstream out;
  out.exceptions(std::ios::failbit | std::ios::badbit);
  out.open(file, std::ios::binary);
  out.write(bytes.data(), static_cast<std::streamsize>(bytes.size()));
}

std::string text_of(const std::vector<std::byte>& bytes) {
  return {reinterpret_cast<const char*>(bytes.data()), bytes.size()};
}

struct Golden {
  std::string name, bytes;
};
/// Names tell the folders below: "0.1-keep.shm".
std::vector<Golden> golden_files(const path& folder) {
  std::vector<Golden> files;
  for (const auto& file : std::filesystem::recursive_directory_iterator(folder)) {
    if (file.path().extension() != ".shm") continue;
    std::ifstream in(file.path(), std::ios::binary);
    std::string name = std::filesystem::relative(file.path(), folder).generic_string();
    std::replace(name.begin(), name.end(), '/', '-');
    files.push_back({name, {std::istreambuf_iterator<char>(in), {}}});
  }
  std::sort(files.begin(), files.end(), [](auto& a, auto& b) { return a.name < b.name; });
  return files;
}

/// Random calls.
void write_calls(const path& folder, const std::vector<shm::FeatureFile>& features) {
  shm::PlainRandom random(11);
  for (const shm::FeatureFile& feature : features) {
    std::string script;
    for (int i = 0; i < 80; ++i) script += static_cast<char>(random.below(256));
    write(folder / feature.name,
          static_cast<char>(script.size()) + text_of(feature.bytes) + script);
  }
}

#ifdef SHM_SEEDS_OF_CONVERTERS
/// Formats that cannot hold a mesh get no seed of it.
void write_formats(const path& folder, const std::vector<shm::FeatureFile>& features) {
  using namespace shm::converters;
  constexpr std::array<std::string_view, 8> kSome = {
      "one_hexahedron", "mixed_cells",      "every_shape",           "second_order",
      "arrays",         "steps_and_extras", "arrays_on_some_blocks", "shifts_steps"};
  for (const shm::FeatureFile& feature : features) {
    if (std::find(kSome.begin(), kSome.end(), feature.name) == kSome.end()) continue;
    for (const std::string_view name : {"exodus", "gmsh", "ucd", "vtk", "vtu"}) {
      const path file = folder / name / feature.name;
      std::filesystem::create_directories(file.parent_path());
      try {
        Spool spool(std::filesystem::temp_directory_path().string());
        shm::MemorySource source(feature.bytes);
        StagedMesh mesh(source, feature.name, spool);
        write_mesh(mesh, file.string(), *format_named(name), spool);
      } catch (const Failure& failure) {
        std::fprintf(stderr, "no %s of %s: %s\n", std::string(name).c_str(), feature.name.c_str(),
                     failure.what());
      }
    }
  }
}

void write_parity_files(const path& folder, const std::vector<shm::FeatureFile>& features) {
  if (!shm::converters::has_parity_codes()) return;
  const std::string file = text_of(shm::parity_file().bytes);
  write(folder / "segments", file);
  std::string damaged = file;
  std::fill(damaged.begin() + 100, damaged.begin() + 300, '\0');
  write(folder / "damaged", damaged);
  // Several blocks in several stripes.
  std::vector<std::byte> all;
  for (const shm::FeatureFile& feature : features)
    if (all.size() < 9000) all.insert(all.end(), feature.bytes.begin(), feature.bytes.end());
  shm::MemoryRandomSource source(all);
  shm::MemorySink sink;
  shm::converters::ParityShape shape;
  shape.protected_bytes = all.size();
  shape.data = 2;
  shape.parity = 1;
  shm::converters::write_parity(source, shape, sink);
  damaged = text_of(all) + text_of(sink.bytes);
  write(folder / "stripes", damaged);
  std::fill(damaged.begin() + 5000, damaged.begin() + 5100, '\1');
  write(folder / "stripes_damaged", damaged);
}
#endif

void make_seeds(const path& folder, const path& golden) {
  const std::vector<shm::FeatureFile> features = shm::feature_files();
  char pieces = 0;
  for (const shm::FeatureFile& feature : features)
    write(folder / "shm" / feature.name, pieces++ + text_of(feature.bytes));
  for (const Golden& file : golden_files(golden))
    write(folder / (file.name.find("archive") != file.name.npos ? "archive" : "shm") / file.name,
          pieces++ + file.bytes);
  write(folder / "archive" / "two", pieces + text_of(shm::archive_file().bytes));
  write_calls(folder / "calls", features);
#ifdef SHM_SEEDS_OF_CONVERTERS
  write_parity_files(folder / "parity", features);
  write_formats(folder, features);
#endif
}

}  // namespace

int main(int count, char** words) {
  if (count != 3) {
    std::fputs("usage: make_seeds DIR GOLDEN_DIR\n", stderr);
    return 2;
  }
  try {
    make_seeds(words[1], words[2]);
  } catch (const std::exception& error) {
    std::fprintf(stderr, "make_seeds: %s\n", error.what());
    return 1;
  }
  return 0;
}
