#include "tool/shown/page.h"

#include <algorithm>
#include <cstdint>
#include <filesystem>
#include <fstream>
#include <optional>
#include <sstream>
#include <string_view>
#include <system_error>
#include <utility>

#include "base/failure.h"
#include "tool/support.h"

namespace shm::converters {
namespace {

// Placeholder that the .shm file replaces. It occurs exactly once in bindings/web/page/index.html.
constexpr std::string_view kPlace =
    R"(<script type="application/octet-stream" id="file" data-name=""></script>)";
constexpr std::string_view kNameEnd = R"("></script>)", kFileEnd = "</script>";

constexpr std::uintmax_t kMostPage = 16 << 20;

// Returns the contents of a file, or nothing if the file does not exist.
std::optional<std::string> text_of(const std::filesystem::path& path) {
  std::error_code none;
  if (!std::filesystem::is_regular_file(path, none) ||
      std::filesystem::file_size(path, none) > kMostPage)
    return std::nullopt;
  std::ifstream file(path, std::ios::binary);
  std::ostringstream text;
  text << file.rdbuf();
  if (!file) return std::nullopt;
  return text.str();
}

std::string found_page() {
  std::error_code none;
  const auto program = std::filesystem::read_symlink("/proc/self/exe", none);
  const auto above = program.parent_path().parent_path();
  for (const char* place : {"share/shmformat/shm.html", "web/shm.html"})
    if (auto text = text_of(above / place)) return *std::move(text);
  wrong_use("the page shm.html was not built with this shm, or is not installed beside it in " +
            (above / "share/shmformat").string() + "; --page names one");
}

void add_base64(std::span<const std::byte> bytes, std::string& out) {
  constexpr std::string_view kDigits =
      "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
  for (std::size_t at = 0; at < bytes.size(); at += 3) {
    const auto byte = [&](std::size_t i) {
      return at + i < bytes.size() ? std::to_integer<std::uint32_t>(bytes[at + i]) : 0U;
    };
    const std::uint32_t three = byte(0) << 16 | byte(1) << 8 | byte(2);
    for (unsigned digit = 0; digit < 4; ++digit)
      out += at + digit > bytes.size() ? '=' : kDigits[three >> (18 - 6 * digit) & 63];
  }
}

}  // namespace

std::string empty_page(const std::string& path) {
  std::string page;
  if (path.empty()) {
    page = found_page();
  } else {
    auto text = text_of(path);
    if (!text) wrong_use("--page " + path + ": cannot be read, or is not a page");
    page = *std::move(text);
  }
  const std::size_t place = page.find(kPlace);
  if (place == std::string::npos || page.find(kPlace, place + 1) != std::string::npos)
    throw Failure(Error{.code = ErrorCode::corrupt,
                        .detail = "it has no place for a file",
                        .section = "page",
                        .file = path});
  return page;
}

FileInPage::FileInPage(const std::string& page, const std::string& name, ByteSink& out)
    : page_(page), out_(out) {
  head_ = page.substr(0, page.find(kPlace) + kPlace.size() - kNameEnd.size());
  head_ += escaped_markup(printable(name)) + "\">";
}

Result<void> FileInPage::put(std::string_view text) {
  written_ += text.size();
  return out_.write(std::as_bytes(std::span(text)));
}

Result<void> FileInPage::write(std::span<const std::byte> bytes) {
  if (bytes.size() > kMostInPage - bytes_)
    return Error{.code = ErrorCode::over_limit,
                 .detail = "a page can contain a file of at most " + std::to_string(kMostInPage) +
                           " bytes, but this file is larger"};
  bytes_ += bytes.size();
  std::string text = std::move(head_);
  head_.clear();
  constexpr std::size_t kPiece = 3 << 16;
  while (!bytes.empty()) {
    const std::size_t room = kPiece - rest_.size();
    const auto piece = bytes.first(std::min(room, bytes.size()));
    bytes = bytes.subspan(piece.size());
    rest_.insert(rest_.end(), piece.begin(), piece.end());
    const std::size_t whole = rest_.size() / 3 * 3;
    add_base64(std::span(rest_).first(whole), text);
    rest_.erase(rest_.begin(), rest_.begin() + static_cast<std::ptrdiff_t>(whole));
    if (auto done = put(text); !done) return done;
    text.clear();
  }
  return text.empty() ? Result<void>() : put(text);
}

Result<void> FileInPage::finish() {
  std::string text = std::move(head_);
  add_base64(rest_, text);
  rest_.clear();
  text += kFileEnd;
  text += std::string_view(page_).substr(page_.find(kPlace) + kPlace.size());
  return put(text);
}

}  // namespace shm::converters
