// make_asking DIR [SHEET...]: writes the asking files of asking_files.h (small files that try to
// make a reader allocate much memory) as DIR/NAME.shm, for tests of whole programs. Some of these
// files, called sheets, take long to create, so only the sheets named as arguments are written.
// Without arguments, the program prints the names of the sheets.
#include <algorithm>
#include <filesystem>
#include <fstream>
#include <iostream>

#include "hostile/asking_files.h"

namespace {

// Replaces the spaces in the name of an asking file, so that it can be part of a file name.
std::string file_name(std::string name) {
  std::replace(name.begin(), name.end(), ' ', '_');
  return name;
}

bool write(const std::filesystem::path& folder, const std::string& name, const shm::Bytes& bytes) {
  std::ofstream out(folder / (file_name(name) + ".shm"), std::ios::binary);
  out.write(reinterpret_cast<const char*>(bytes.data()),
            static_cast<std::streamsize>(bytes.size()));
  return static_cast<bool>(out.flush());
}

}  // namespace

int main(int count, char** words) {
  if (count == 1) {
    for (const auto& [name, make] : shm::asking_sheets()) std::cout << file_name(name) << '\n';
    return 0;
  }
  for (const shm::AskingFile& file : shm::asking_files())
    if (!write(words[1], file.name, file.bytes)) return 1;
  for (const auto& [name, make] : shm::asking_sheets())
    if (std::find(words + 2, words + count, file_name(name)) != words + count &&
        !write(words[1], name, make()))
      return 1;
  return 0;
}
