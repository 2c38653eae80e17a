// The value columns of a segment coded as shifts: one column for the coordinates, and one for each
// static array.
// spec: "Values as differences"
#pragma once

#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "codecs/shifts/difference_column.h"
#include "codecs/surface/mesh_streams.h"
#include "format/format.h"
#include "shm/schema.h"

namespace shm {

/// Returns the columns. Column 0 is geometry; the following columns are the static arrays in schema
/// order.
std::vector<DifferenceColumn> difference_columns(const Schema& schema);

/// Returns, for each of `columns`, a column that predicts the same values from neighbourhoods. The
/// pointer is null if the column is not to be decoded, or if it has too many components to be coded
/// as differences. The limit on components applies to both kinds of column, because both need
/// memory for each element number even if the array has few elements. `Column`: ColumnPlanner or
/// ColumnDecoder.
template <class Column>
std::vector<std::unique_ptr<Column>> predicted_columns(const Schema& schema,
                                                       std::span<const DifferenceColumn> columns,
                                                       const DecodedParts& parts) {
  std::vector<std::unique_ptr<Column>> predicted;
  const std::vector<bool> included = parts.columns(schema);
  for_each_static_column(schema, [&](const auto&... arguments) {
    const std::size_t c = predicted.size();
    const bool may_be = included[c] && columns[c].takes(Codec::differences);
    predicted.push_back(may_be ? std::make_unique<Column>(arguments...) : nullptr);
  });
  return predicted;
}

}  // namespace shm
