// NumberedName: the name of a file for each step, with the number of the step in it, as printf
// takes it: out_%d.vtu, out_%04d.vtu.
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
  // Nothing where the last part of `path` has no %d; %% is a percent sign where it has one. Throws
  // Failure (misuse) where it has another % or two of them.
  static std::optional<NumberedName> of(const std::string& path);
  // `before`, the number with zeros before it to so many digits, `behind`.
  NumberedName(std::string before, std::size_t width, std::string behind)
      : before_(std::move(before)), width_(width), behind_(std::move(behind)) {}

  std::string at(std::uint64_t number) const;

  struct File {
    std::uint64_t number;
    std::string path;
  };
  // Those that are there, in the order of their numbers.
  std::vector<File> files() const;

 private:
  std::string before_;
  std::size_t width_ = 0;
  char fill_ = '0';
  std::string behind_;
};

}  // namespace shm::converters
