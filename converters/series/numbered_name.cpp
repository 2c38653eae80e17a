#include "series/numbered_name.h"

#include <algorithm>
#include <filesystem>
#include <system_error>

#include "base/failure.h"
#include "base/text_input.h"

namespace shm::converters {
namespace {

namespace fs = std::filesystem;

constexpr std::string_view kDigits = "0123456789";
// Maximum N in %0Nd. No step number has more digits.
constexpr std::size_t kMostWidth = 20;

// If `text` begins with %d or %0Nd, returns the length of this placeholder, otherwise 0.
std::size_t length_of_number(std::string_view text) {
  const std::size_t end = text.find_first_not_of(kDigits, 1);
  return end != std::string_view::npos && text[end] == 'd' ? end + 1 : 0;
}

}  // namespace

std::optional<NumberedName> NumberedName::of(const std::string& path) {
  const std::size_t slash = path.rfind('/');
  const std::size_t name = slash == std::string::npos ? 0 : slash + 1;
  NumberedName found(path.substr(0, name), 0, {});
  bool any = false, others = false;
  for (std::size_t position = name; position < path.size();) {
    const std::string_view rest = std::string_view(path).substr(position);
    std::string& side = any ? found.behind_ : found.before_;
    const std::size_t length = rest[0] == '%' ? length_of_number(rest) : 0;
    if (length > 0) {
      std::string_view width = rest.substr(1, length - 2);
      others |= any;
      any = true;
      found.fill_ = width.starts_with('0') ? '0' : ' ';
      others |=
          !width.empty() && (!TextInput::parse(width, found.width_) || found.width_ > kMostWidth);
      position += length;
    } else if (rest[0] == '%') {
      others |= !rest.starts_with("%%");
      side += '%';
      position += 2;
    } else {
      side += rest[0];
      ++position;
    }
  }
  if (!any) return std::nullopt;
  if (others)
    wrong_use(path +
              ": a name for a series of files must contain exactly one %d (or %04d and the like), "
              "and %% for each percent sign");
  return found;
}

std::string NumberedName::at(std::uint64_t number) const {
  const std::string digits = std::to_string(number);
  return before_ + std::string(width_ - std::min(width_, digits.size()), fill_) + digits + behind_;
}

std::vector<NumberedName::File> NumberedName::files() const {
  const fs::path folder = fs::path(before_).parent_path();
  std::vector<File> found;
  std::error_code error;
  for (fs::directory_iterator it(folder.empty() ? "." : folder, error), end; !error && it != end;
       it.increment(error)) {
    const std::string path = (folder / it->path().filename()).string();
    if (path.size() <= before_.size() + behind_.size() || !path.starts_with(before_) ||
        !path.ends_with(behind_))
      continue;
    std::string_view digits(path);
    digits.remove_suffix(behind_.size());
    digits.remove_prefix(
        std::min(digits.find_first_not_of(fill_, before_.size()), digits.size() - 1));
    std::uint64_t number = 0;
    if (TextInput::parse(digits, number) && at(number) == path) found.push_back({number, path});
  }
  std::sort(found.begin(), found.end(),
            [](const File& a, const File& b) { return a.number < b.number; });
  return found;
}

}  // namespace shm::converters
