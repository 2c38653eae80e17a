// Embeds a .shm file in the web page that shows a mesh in a browser (bindings/web/page).
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "shm/io.h"

namespace shm::converters {

// Largest size in bytes of a .shm file in a page. The browser stores the file as one base64 string,
// and a string may have at most 2^29 characters.
inline constexpr std::uint64_t kMostInPage = std::uint64_t{256} << 20;

// Returns the page without a .shm file. If `path` is empty, returns the page that was installed or
// built with this program. Throws Failure: misuse if the page cannot be read, corrupt if the page
// does not contain exactly one placeholder for a file.
std::string empty_page(const std::string& path);

// Writes a .shm file into a page.
class FileInPage final : public ByteSink {
 public:
  // `page` must be a result of empty_page(). Borrows `page` and `out`. `name` is the name of the
  // file that the page displays. It may contain any bytes.
  FileInPage(const std::string& page, const std::string& name, ByteSink& out);

  // Writes the next bytes of the file. Returns ErrorCode::over_limit if the file exceeds
  // kMostInPage.
  Result<void> write(std::span<const std::byte> bytes) override;
  // Writes the rest of the page. Call this once, after write() has been called for all bytes of the
  // file.
  Result<void> finish();
  std::uint64_t bytes() const { return bytes_; }  // size of the file so far

  // Size of the page so far, including the file.
  std::uint64_t page_bytes() const { return written_; }

 private:
  Result<void> put(std::string_view text);

  const std::string& page_;
  std::string head_;  // part of the page before the .shm file; cleared when it has been written
  ByteSink& out_;
  std::uint64_t bytes_ = 0, written_ = 0;
  // Up to two bytes that are not yet encoded, because base64 encodes groups of three bytes as four
  // characters.
  std::vector<std::byte> rest_;
};

}  // namespace shm::converters
