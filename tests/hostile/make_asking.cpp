// make_asking DIR [SHEET...]: writes the files that ask for much memory, each as NAME.shm, for
// tests of whole programs. Sheets take long to create, so it writes only those that are named.
// Without arguments, it prints the names of the sheets.
#include <algorithm>
#include <filesystem>
#include <fstream>
#include <iostream>

#include "hostile/asking_files.h"

namespace {

// Returns the name of an asking file as part of a file name.
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
