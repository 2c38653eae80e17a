// ExtraIndex: finds extras (data other than mesh and arrays) by key. A mesh may have very many
// extras, so code that searches for more than a few of them should build an index.
#pragma once

#include <map>
#include <string_view>
#include <vector>

#include "shm/schema.h"

namespace shm::converters {

// Index of extras, which are borrowed. If several extras have the same key, the first one is found.
class ExtraIndex {
 public:
  ExtraIndex() = default;
  explicit ExtraIndex(const std::vector<Extra>& extras) { add(extras); }
  void add(const std::vector<Extra>& extras) {
    for (const Extra& extra : extras) by_key_.emplace(extra.key, &extra);
  }
  // Returns the extra with this key, or null if none exists.
  const Extra* find(std::string_view key) const {
    const auto found = by_key_.find(key);
    return found == by_key_.end() ? nullptr : found->second;
  }

 private:
  std::map<std::string_view, const Extra*> by_key_;
};

}  // namespace shm::converters
