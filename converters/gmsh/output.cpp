#include "gmsh/output.h"

#include <cerrno>
#include <cstring>

#include "base/failure.h"

namespace shm::converters {
namespace {
constexpr std::size_t kBufferBytes = std::size_t{1} << 18;
}

GmshOutput::GmshOutput(const std::string& path, GmshEncoding encoding)
    : path_(path), encoding_(encoding), file_(std::fopen(path.c_str(), "wb")) {
  if (file_ == nullptr) fail("cannot create");
  std::setvbuf(file_, nullptr, _IONBF, 0);  // unbuffered, because buffer_ is the buffer
  buffer_.reserve(kBufferBytes + 4096);
}

GmshOutput::~GmshOutput() {
  if (file_ != nullptr) std::fclose(file_);
}

void GmshOutput::fail(const char* what) const {
  throw Failure(ErrorCode::output, std::string(what) + ": " + std::strerror(errno), path_);
}

void GmshOutput::flush() {
  if (std::fwrite(buffer_.data(), 1, buffer_.size(), file_) != buffer_.size()) fail("cannot write");
  buffer_.clear();
}

void GmshOutput::text(std::string_view content) {
  buffer_ += content;
  if (buffer_.size() >= kBufferBytes) flush();
}

template <class T>
void GmshOutput::put(T value) {
  if (binary()) {
    if (encoding_.swapped) value = swap_bytes(value);
    char bytes[sizeof(T)];
    std::memcpy(bytes, &value, sizeof(T));
    text({bytes, sizeof(T)});
    return;
  }
  char digits[40];
  digits[0] = ' ';
  const char* end = std::to_chars(digits + 1, digits + sizeof(digits), value).ptr;
  const char* begin = line_begun_ ? digits : digits + 1;
  text({begin, static_cast<std::size_t>(end - begin)});
  line_begun_ = true;
}

void GmshOutput::integer32(std::int64_t value) {
  const auto narrow = static_cast<std::int32_t>(value);
  if (narrow != value)
    throw Failure(ErrorCode::unsupported,
                  "the number " + std::to_string(value) +
                      " does not fit into 32 bits, the size "
                      "of such numbers in this version of the format",
                  path_);
  put(narrow);
}

void GmshOutput::integer64(std::int64_t value) { put(value); }
void GmshOutput::real(double value) { put(value); }

void GmshOutput::end_line() {
  if (binary()) return;
  text("\n");
  line_begun_ = false;
}

void GmshOutput::end_of_data() {
  if (binary()) text("\n");
}

void GmshOutput::close() {
  flush();
  std::FILE* file = file_;
  file_ = nullptr;
  if (std::fclose(file) != 0) fail("cannot write");
}

}  // namespace shm::converters
