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

// Largest size of a file in a page. In base64 the file is a string of the browser, which may have
// 2^29 characters.
inline constexpr std::uint64_t kMostInPage = std::uint64_t{256} << 20;

// Returns the page without a file: the page at `path`, or the one installed or built with this
// program. Throws Failure: misuse if there is none, corrupt if it has no place for a file.
std::string empty_page(const std::string& path);

// Writes a .shm file into a page.
class FileInPage final : public ByteSink {
 public:
  // `page`: from empty_page(); borrowed, like `out`. `name`: display name of the file; any bytes.
  FileInPage(const std::string& page, const std::string& name, ByteSink& out);

  // ErrorCode::over_limit: the file exceeds kMostInPage.
  Result<void> write(std::span<const std::byte> bytes) override;
  // Writes the rest of the page. Call this once, after the last byte of the file.
  Result<void> finish();
  std::uint64_t bytes() const { return bytes_; }         // of the file
  std::uint64_t page_bytes() const { return written_; }  // of the page including the file

 private:
  Result<void> put(std::string_view text);

  const std::string& page_;
  std::string head_;  // part of the page before the file; empty once that is written
  ByteSink& out_;
  std::uint64_t bytes_ = 0, written_ = 0;
  std::vector<std::byte> rest_;  // incomplete group of three bytes, which become four characters
};

}  // namespace shm::converters
