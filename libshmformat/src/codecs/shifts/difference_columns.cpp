#include "codecs/shifts/difference_columns.h"

namespace shm {

std::vector<DifferenceColumn> difference_columns(const Schema& schema) {
  std::vector<DifferenceColumn> columns;
  std::uint32_t room = kMostDifferenceRings;
  const auto add = [&](const ArrayInfo& info) {
    const bool may_differ = info.components < room;
    if (may_differ) room -= info.components + 1;
    columns.emplace_back(info, may_differ);
  };
  add(coordinates_info(schema));
  for (const ArrayInfo& info : schema.arrays)
    if (!info.per_step) add(info);
  return columns;
}

}  // namespace shm
