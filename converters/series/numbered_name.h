// NumberedName: the name of a series of files with one file per time step, such as out_%d.vtu or
// out_%04d.vtu. %d or %04d, as in printf(), represents the number of the step.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace shm::converters {

class NumberedName {
 public:
  // Parses a name. Returns nothing if the last component of `path` does not contain %d (or %04d and
  // the like). In a name that contains %d, %% represents a percent sign. Throws Failure (misuse) if
  // the name contains any other % or a second %d.
  static std::optional<NumberedName> of(const std::string& path);
  // A file name consists of `before`, the number of the step padded with zeros to `width` digits,
  // and `behind`.
  NumberedName(std::string before, std::size_t width, std::string behind)
      : before_(std::move(before)), width_(width), behind_(std::move(behind)) {}

  std::string at(std::uint64_t number) const;

  struct File {
    std::uint64_t number;
    std::string path;
  };
  // Returns the existing files of the series, sorted by number.
  std::vector<File> files() const;

 private:
  std::string before_;
  std::size_t width_ = 0;
  char fill_ = '0';
  std::string behind_;
};

}  // namespace shm::converters
