// Decodes a .shm file with the library and prints its contents in the format of item_text.h. Tests
// compare the output of the Python decoder in spec/ with this output. If the file cannot be read,
// the program reports the cause on standard error and ends with exit code 3.
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
