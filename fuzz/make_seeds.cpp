// Writes the seeds of fuzz_decoder: make_seeds DIR. One small file for each feature of the
// format, behind the byte that says the piece sizes.
#include <cstdio>
#include <fstream>
#include <string>

#include "../tests/feature_files.h"

int main(int count, char** words) {
  if (count != 2) {
    std::fputs("usage: make_seeds DIR\n", stderr);
    return 2;
  }
  char pieces = 0;
  for (const shm::FeatureFile& feature : shm::feature_files()) {
    std::ofstream out(std::string(words[1]) + "/" + feature.name, std::ios::binary);
    out.put(pieces++);
    out.write(reinterpret_cast<const char*>(feature.bytes.data()),
              static_cast<std::streamsize>(feature.bytes.size()));
    if (!out.flush()) {
      std::fprintf(stderr, "cannot write to %s\n", words[1]);
      return 1;
    }
  }
  return 0;
}
