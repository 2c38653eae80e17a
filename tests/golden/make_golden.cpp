// Creates golden files. `make_golden DIR FAULTY_DIR` writes two files into DIR for each feature of
// the format: NAME.shm, and the same contents as text in NAME.txt. It writes the faulty files
// 001.shm and so on into FAULTY_DIR, with list.txt, which describes the fault of each file. Run
// this program by hand after adding a format version or a faulty file. Existing files are never
// overwritten, because every later version of the library must still read the golden files and
// refuse the faulty files.
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <string>
#include <vector>

#include "support/faulty_files.h"
#include "support/feature_files.h"
#include "support/item_text.h"
#ifdef SHM_WITH_PARITY
#include "support/parity_file.h"
#endif

namespace {

/// Writes the file unless it already exists. Returns false if it cannot be written.
bool write_new(const std::filesystem::path& path, const char* bytes, std::size_t size) {
  if (std::filesystem::exists(path)) {
    std::printf("kept  %s\n", path.string().c_str());
    return true;
  }
  std::ofstream out(path, std::ios::binary);
  out.write(bytes, static_cast<std::streamsize>(size));
  std::printf("wrote %s\n", path.string().c_str());
  return static_cast<bool>(out.flush());
}

bool write_new(const std::filesystem::path& path, const std::vector<std::byte>& bytes) {
  return write_new(path, reinterpret_cast<const char*>(bytes.data()), bytes.size());
}

/// Writes the new faulty files and adds their lines to list.txt. Existing lines must not change.
bool write_faulty(const std::filesystem::path& folder) {
  std::string list;
  {
    std::ifstream in(folder / "list.txt", std::ios::binary);
    list.assign(std::istreambuf_iterator<char>(in), {});
  }
  std::string all;
  int number = 0;
  for (const shm::FaultyFile& file : shm::faulty_files()) {
    char name[16];
    std::snprintf(name, sizeof name, "%03d", ++number);
    all += std::string(name) + ' ' + shm::word_of(file.code) + ' ' + file.sentence + '\n';
    if (!write_new(folder / (std::string(name) + ".shm"), file.bytes)) return false;
  }
  if (!all.starts_with(list)) {
    std::fputs("list.txt is not the beginning of the new list of faulty files\n", stderr);
    return false;
  }
  std::ofstream out(folder / "list.txt", std::ios::binary);
  out << all;
  return static_cast<bool>(out.flush());
}

}  // namespace

int main(int count, char** words) {
  if (count != 3) {
    std::fputs("usage: make_golden DIR FAULTY_DIR\n", stderr);
    return 2;
  }
  std::vector<shm::FeatureFile> files = shm::feature_files(true);
  files.push_back(shm::archive_file());
#ifdef SHM_WITH_PARITY
  if (shm::converters::has_parity_codes()) files.push_back(shm::parity_file());
#endif
  for (const shm::FeatureFile& feature : files) {
    const std::filesystem::path path = std::filesystem::path(words[1]) / feature.name;
    const auto text = shm::text_of_file(feature.bytes);
    if (!text) {
      std::fprintf(stderr, "%s: %s\n", feature.name.c_str(), text.error().message().c_str());
      return 1;
    }
    if (!write_new(path.string() + ".shm", feature.bytes) ||
        !write_new(path.string() + ".txt", text->data(), text->size()))
      return 1;
  }
  return write_faulty(words[2]) ? 0 : 1;
}
