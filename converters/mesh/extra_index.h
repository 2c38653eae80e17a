// ExtraIndex: looks up extras by key. A mesh may have very many extras, so code that looks up more
// than a few of them should build an index.
#pragma once

#include <map>
#include <string_view>
#include <vector>

#include "shm/schema.h"

namespace shm::converters {

// Borrows the extras. If several extras share a key, the first one is found.
class ExtraIndex {
 public:
  ExtraIndex() = default;
  explicit ExtraIndex(const std::vector<Extra>& extras) { add(extras); }
  void add(const std::vector<Extra>& extras) {
    for (const Extra& extra : extras) by_key_.emplace(extra.key, &extra);
  }
  // Returns null if no extra has this key.
  const Extra* find(std::string_view key) const {
    const auto found = by_key_.find(key);
    return found == by_key_.end() ? nullptr : found->second;
  }

 private:
  std::map<std::string_view, const Extra*> by_key_;
};

}  // namespace shm::converters
