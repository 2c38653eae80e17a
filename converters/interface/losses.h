// Losses: the data of a mesh that the target format cannot represent. They are listed before
// anything is written, so that nothing is dropped silently.
#pragma once

#include <cstdint>
#include <set>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "mesh/chosen_steps.h"
#include "mesh/mesh_source.h"

namespace shm::converters {

using Keys = std::set<std::string>;  // keys of extras

// Each entry is text for a terminal, for example "side set 3 'inlet'" or "QA records".
using LossList = std::vector<std::string>;

// Collects losses without duplicates.
class LossCollector {
 public:
  // `losses` must outlive this object; null: losses are not collected.
  explicit LossCollector(LossList* losses) : losses_(losses) {}
  void add(std::string loss) {
    if (losses_ != nullptr && listed_.insert(loss).second) losses_->push_back(std::move(loss));
  }

 private:
  LossList* losses_;
  std::set<std::string> listed_;
};

// Returns the keys of the extras that are lost. Keys in `used`, and keys that start with an entry
// of `known`, are not included.
LossList losses_by_key(const MeshInfo& info, const Keys& used,
                       std::span<const std::string_view> known = {});

// Returns text such as "time steps 0 to 7 of 9", which lists the lost steps when a file of `format`
// contains only the step `kept`.
std::string lost_steps(std::uint64_t steps, StepRange kept, const std::string& format);

std::string quoted(std::string_view text);  // returns " 'T'" for the text T

}  // namespace shm::converters
