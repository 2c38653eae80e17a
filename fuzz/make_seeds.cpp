// Writes the seeds of the decoder's fuzz targets: make_seeds DIR GOLDEN_DIR. The golden files of all
// versions, and one small file for each feature of the format as it is now, each behind the byte
// that says the piece sizes.
#include <cstdio>
#include <exception>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <string>

#include "../tests/feature_files.h"

namespace {

void write_seed(const std::filesystem::path& path, char pieces, const std::string& bytes) {
  std::ofstream out;
  out.exceptions(std::ios::failbit | std::ios::badbit);
  out.open(path, std::ios::binary);
  out.put(pieces);
  out.write(bytes.data(), static_cast<std::streamsize>(bytes.size()));
}

}  // namespace

int main(int count, char** words) {
  if (count != 3) {
    std::fputs("usage: make_seeds DIR GOLDEN_DIR\n", stderr);
    return 2;
  }
  try {
    const std::filesystem::path folder = words[1];
    char pieces = 0;
    for (const shm::FeatureFile& feature : shm::feature_files())
      write_seed(folder / feature.name, pieces++,
                 {reinterpret_cast<const char*>(feature.bytes.data()), feature.bytes.size()});
    for (const auto& file : std::filesystem::recursive_directory_iterator(words[2])) {
      if (file.path().extension() != ".shm") continue;
      std::ifstream in(file.path(), std::ios::binary);
      const std::string version = file.path().parent_path().filename().string();
      write_seed(folder / (version + "-" + file.path().filename().string()), pieces++,
                 {std::istreambuf_iterator<char>(in), {}});
    }
  } catch (const std::exception& error) {
    std::fprintf(stderr, "make_seeds: %s\n", error.what());
    return 1;
  }
  return 0;
}
