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

/// Returns columns that predict the same values from neighbourhoods. A pointer is null if its
/// column is not requested. The pointer is also null if the column may not be coded as differences,
/// because both kinds of column need memory for each element number, even if there are few
/// elements. `Column`: ColumnPlanner or ColumnDecoder.
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
