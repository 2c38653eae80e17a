// Losses: what a format will not hold of a mesh that came from another one, by name, before
// anything is written. Nothing may go silently.
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

using Keys = std::set<std::string>;  // of extras

// Each for a line on a terminal: "side set 3 'inlet'", "QA records".
using LossList = std::vector<std::string>;

// Collects losses, each once.
class LossCollector {
 public:
  // The list is borrowed; null: nobody asks for it.
  explicit LossCollector(LossList* losses) : losses_(losses) {}
  void add(std::string loss) {
    if (losses_ != nullptr && listed_.insert(loss).second) losses_->push_back(std::move(loss));
  }

 private:
  LossList* losses_;
  std::set<std::string> listed_;
};

// Extras that are not in `used`, by their keys, but for those whose keys start with one of `known`.
LossList losses_by_key(const MeshInfo& info, const Keys& used,
                       std::span<const std::string_view> known = {});

// "time steps 0 to 7 of 9", where a file of `format` holds one, and `kept` is it.
std::string lost_steps(std::uint64_t steps, StepRange kept, const std::string& format);

std::string quoted(std::string_view text);  // " 'T'"

}  // namespace shm::converters
