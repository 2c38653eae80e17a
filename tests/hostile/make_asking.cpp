// make_asking DIR: writes files that ask for much, NAME.shm each, for tests of whole programs.
#include <filesystem>
#include <fstream>

#include "hostile/asking_files.h"

int main(int count, char** words) {
  if (count != 2) return 2;
  for (const shm::AskingFile& file : shm::asking_files()) {
    std::string name = file.name + ".shm";
    std::replace(name.begin(), name.end(), ' ', '_');
    std::ofstream out(std::filesystem::path(words[1]) / name, std::ios::binary);
    out.write(reinterpret_cast<const char*>(file.bytes.data()),
              static_cast<std::streamsize>(file.bytes.size()));
    if (!out.flush()) return 1;
  }
  return 0;
}
