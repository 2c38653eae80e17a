// The page that shows a mesh in a browser (bindings/web/page), and a .shm file in it.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "shm/io.h"

namespace shm::converters {

// Bytes of a file in a page: as base64 they are a string of the browser, which may have 2^29
// characters.
inline constexpr std::uint64_t kMostInPage = std::uint64_t{256} << 20;

// The page without a file: `path`, or where it is installed, or built, as seen from the program.
// Throws Failure: misuse where there is none, corrupt where it has no place for a file.
std::string empty_page(const std::string& path);

// A .shm file on its way into a page.
class FileInPage final : public ByteSink {
 public:
  // `page`: of empty_page(), borrowed, as `out` is. `name`: of the file, for people; any bytes.
  FileInPage(const std::string& page, const std::string& name, ByteSink& out);

  // ErrorCode::over_limit: more than kMostInPage.
  Result<void> write(std::span<const std::byte> bytes) override;
  // What stands behind the file: once, after the last byte.
  Result<void> finish();
  std::uint64_t bytes() const { return bytes_; }         // of the file
  std::uint64_t page_bytes() const { return written_; }  // with the page

 private:
  Result<void> put(std::string_view text);

  const std::string& page_;
  std::string head_;  // what comes before the file, until that begins
  ByteSink& out_;
  std::uint64_t bytes_ = 0, written_ = 0;
  std::vector<std::byte> rest_;  // of three bytes, which are four characters
};

}  // namespace shm::converters
