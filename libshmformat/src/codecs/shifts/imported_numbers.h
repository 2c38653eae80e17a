// ImportedNumbers: maps the import number (a temporary number) of each live imported vertex to its
// stream number (its number in coding order). The memory is proportional to the number of live
// vertices.
#pragma once

#include <cstdint>
#include <vector>

#include "base/lists.h"
#include "base/number_map.h"

namespace shm {

class ImportedNumbers {
 public:
  bool empty() const { return count_ == 0; }
  /// Returns the stream number that belongs to an import number. Precondition: the map contains
  /// `import`.
  std::uint64_t operator[](std::uint64_t import) const { return numbers_[slots_.find(import)]; }
  /// Adds an entry. Precondition: the map does not contain `import`.
  void add(std::uint64_t import, std::uint64_t number) {
    auto slot = static_cast<std::uint32_t>(numbers_.size());
    if (free_.empty()) {
      numbers_.push_back(number);
    } else {
      slot = free_.back();
      free_.pop_back();
      numbers_[slot] = number;
    }
    slots_.insert(import, slot);
    ++count_;
  }
  /// Removes an entry. Precondition: the map contains `import`.
  void remove(std::uint64_t import) {
    free_.push_back(slots_.find(import));
    slots_.erase(import);
    --count_;
  }

 private:
  NumberMap slots_;
  std::vector<std::uint64_t> numbers_;
  std::vector<std::uint32_t> free_;
  std::uint64_t count_ = 0;
};

}  // namespace shm
