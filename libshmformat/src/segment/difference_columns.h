// The value columns of a segment whose cells are shifts: one for the coordinates, one for each
// static array.
// spec: "Values as differences"
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <vector>

#include "container/format.h"
#include "segment/value_streams.h"
#include "shifts/difference_column.h"
#include "shm/schema.h"

namespace shm {

/// Column 0 is geometry, the others the static arrays in schema order.
std::vector<DifferenceColumn> difference_columns(const Schema& schema);

/// The same columns over neighbourhoods; none in place of those that must not be in differences:
/// either takes memory by number, whatever there is of numbers.
template <class Coder>
std::vector<std::unique_ptr<ValueColumn<Coder>>> predicted_columns(
    const Schema& schema, std::span<const DifferenceColumn> columns) {
  std::vector<std::unique_ptr<ValueColumn<Coder>>> predicted;
  for_each_static_column(schema, [&](const auto&... what) {
    const bool may_be = columns[predicted.size()].takes(BulkCodec::differences);
    predicted.push_back(may_be ? std::make_unique<ValueColumn<Coder>>(what...) : nullptr);
  });
  return predicted;
}

/// The codec of their streams, and the reverse.
container::Codec stream_codec(BulkCodec codec);
std::optional<BulkCodec> bulk_codec(container::Codec codec);

}  // namespace shm
