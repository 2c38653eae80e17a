// make_asking DIR [large]: writes the files that ask for much memory, each as NAME.shm, for tests
// of whole programs.
#include <filesystem>
#include <fstream>

#include "hostile/asking_files.h"

int main(int count, char** words) {
  if (count != 2 && count != 3) return 2;
  std::vector<shm::AskingFile> files = shm::asking_files();
  if (count == 3)
    for (shm::AskingFile& sheet : shm::asking_sheets()) files.push_back(std::move(sheet));
  for (const shm::AskingFile& file : files) {
    std::string name = file.name + ".shm";
    std::replace(name.begin(), name.end(), ' ', '_');
    std::ofstream out(std::filesystem::path(words[1]) / name, std::ios::binary);
    out.write(reinterpret_cast<const char*>(file.bytes.data()),
              static_cast<std::streamsize>(file.bytes.size()));
    if (!out.flush()) return 1;
  }
  return 0;
}
