// Losses: descriptions of the data of a mesh that the target format cannot represent. The tool
// lists the losses before it writes anything, so that no data is dropped silently.
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

// A list of lost data. Each entry is text for a terminal, for example "side set 3 'inlet'" or "QA
// records".
using LossList = std::vector<std::string>;

// Collects losses without duplicates.
class LossCollector {
 public:
  // `losses` must outlive this object. If it is null, losses are not collected.
  explicit LossCollector(LossList* losses) : losses_(losses) {}
  void add(std::string loss) {
    if (losses_ != nullptr && listed_.insert(loss).second) losses_->push_back(std::move(loss));
  }

 private:
  LossList* losses_;
  std::set<std::string> listed_;
};

// Returns the keys of the extras (data other than mesh and arrays) that are lost: all keys except
// those in `used` and those that start with an entry of `known`.
LossList losses_by_key(const MeshInfo& info, const Keys& used,
                       std::span<const std::string_view> known = {});

// Describes the time steps that are lost when a file of `format` contains only the steps `kept`,
// for example "time steps 0 to 7 of 9". `steps` is the number of all steps.
std::string lost_steps(std::uint64_t steps, StepRange kept, const std::string& format);

std::string quoted(std::string_view text);  // returns " 'T'" for the text T

}  // namespace shm::converters
