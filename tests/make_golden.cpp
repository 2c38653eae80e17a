// Makes golden files: make_golden DIR writes NAME.shm and its readable twin NAME.txt for each
// feature of the format into DIR. Run by hand when a format version is new; a file that is there
// already is never overwritten, because what old versions wrote must be read for ever.
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <string>
#include <vector>

#include "feature_files.h"
#include "item_text.h"
#if __has_include("parity.h")
#include "parity_file.h"
#endif

namespace {

/// False when it cannot be written; true also when it was there.
bool write_new(const std::filesystem::path& path, const char* bytes, std::size_t size) {
  if (std::filesystem::exists(path)) {
    std::printf("kept  %s\n", path.c_str());
    return true;
  }
  std::ofstream out(path, std::ios::binary);
  out.write(bytes, static_cast<std::streamsize>(size));
  std::printf("wrote %s\n", path.c_str());
  return static_cast<bool>(out.flush());
}

}  // namespace

int main(int count, char** words) {
  if (count != 2) {
    std::fputs("usage: make_golden DIR\n", stderr);
    return 2;
  }
  std::vector<shm::FeatureFile> files = shm::feature_files();
  files.push_back(shm::archive_file());
#if __has_include("parity.h")
  if (shm::converters::has_parity_codes()) files.push_back(shm::parity_file());
#endif
  for (const shm::FeatureFile& feature : files) {
    const std::filesystem::path path = std::filesystem::path(words[1]) / feature.name;
    const auto text = shm::text_of_file(feature.bytes);
    if (!text) {
      std::fprintf(stderr, "%s: %s\n", feature.name.c_str(), text.error().message().c_str());
      return 1;
    }
    if (!write_new(path.string() + ".shm", reinterpret_cast<const char*>(feature.bytes.data()),
                   feature.bytes.size()) ||
        !write_new(path.string() + ".txt", text->data(), text->size()))
      return 1;
  }
  return 0;
}
