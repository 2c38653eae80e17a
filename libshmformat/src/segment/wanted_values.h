// Which values of a group a reader wants. Cells and numbers are always decoded.
#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include "container/format.h"

namespace shm {

struct WantedValues {
  bool geometry = true;
  std::optional<std::vector<bool>> arrays{};  ///< by array of the schema; nothing: all

  static WantedValues none() { return {false, std::vector<bool>()}; }
  bool all() const { return geometry && !arrays; }
  bool includes_array(std::uint32_t array) const {
    return !arrays || (array < arrays->size() && (*arrays)[array]);
  }
  bool include(const container::StreamEntry& stream) const {
    if (stream.kind == container::StreamKind::geometry) return geometry;
    return stream.kind != container::StreamKind::array || includes_array(stream.array);
  }
};

}  // namespace shm
