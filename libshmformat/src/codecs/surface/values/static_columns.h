// The columns of static values in a segment, in the order of the schema.
// spec: "Value columns"
#pragma once

#include <algorithm>
#include <cstdint>
#include <vector>

#include "codecs/shared/group_parts.h"
#include "codecs/surface/values/value_column.h"

namespace shm {

/// Calls visit(info, blocks, traits) with the constructor arguments of each ValueColumn of static
/// values: first geometry, then the static arrays in schema order.
template <class Visit>
void for_each_static_column(const Schema& schema, Visit&& visit) {
  ColumnTraits traits{.repeats = false, .earlier_values = schema.earlier_values, .copies = true};
  visit(coordinates_info(schema), std::vector<std::uint32_t>(), traits);
  traits.repeats = true;
  // Number of components that may still have tables
  std::uint32_t room = kMostTableComponentsInAll - 3;
  for (const ArrayInfo& info : schema.arrays) {
    if (info.per_step) continue;
    traits.tables = info.components <= std::min(kMostTableComponents, room);
    if (traits.tables) room -= info.components;
    visit(info, info.blocks, traits);
  }
}

}  // namespace shm
