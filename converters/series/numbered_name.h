// NumberedName: the name of a series of files, one for each step. It contains the number of the
// step in printf notation: out_%d.vtu, out_%04d.vtu.
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
  // Parses a name. Returns nothing if the last part of `path` has no %d. In a name with %d, %%
  // represents a percent sign. Throws Failure (misuse) if there is any other % or a second %d.
  static std::optional<NumberedName> of(const std::string& path);
  // A name consists of `before`, the number, which is padded with zeros to `width` digits, and
  // `behind`.
  NumberedName(std::string before, std::size_t width, std::string behind)
      : before_(std::move(before)), width_(width), behind_(std::move(behind)) {}

  std::string at(std::uint64_t number) const;

  struct File {
    std::uint64_t number;
    std::string path;
  };
  // Returns the existing files of the series in the order of their numbers.
  std::vector<File> files() const;

 private:
  std::string before_;
  std::size_t width_ = 0;
  char fill_ = '0';
  std::string behind_;
};

}  // namespace shm::converters
