// Prints the contents of a .shm file, decoded by the library, in the format of item_text.h. The
// Python decoder in spec/ is compared with this output. The exit code is 3 if the file cannot be
// read; standard error states the cause.
#include <cstddef>
#include <cstdio>
#include <fstream>
#include <iterator>
#include <span>
#include <string>

#include "support/item_text.h"

int main(int argc, char** argv) {
  if (argc != 2) {
    std::fprintf(stderr, "shm_text FILE.shm\n");
    return 2;
  }
  std::ifstream in(argv[1], std::ios::binary);
  const std::string bytes{std::istreambuf_iterator<char>(in), {}};
  const auto text = shm::text_of_file(std::as_bytes(std::span(bytes)));
  if (!text) {
    std::fprintf(stderr, "%s: %s\n", argv[1], text.error().message().c_str());
    return 3;
  }
  std::fwrite(text->data(), 1, text->size(), stdout);
  return 0;
}
