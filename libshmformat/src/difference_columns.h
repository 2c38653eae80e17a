// The value columns of a segment whose cells are shifts: one for the coordinates, one for each
// static array.
// spec: "Values as differences"
#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include "container/format.h"
#include "shm/schema.h"
#include "values/difference_column.h"

namespace shm {

/// Column 0 is geometry, the others the static arrays in schema order.
std::vector<DifferenceColumn> difference_columns(const Schema& schema);

/// The codec of their streams, and the reverse.
container::Codec stream_codec(BulkCodec codec);
std::optional<BulkCodec> bulk_codec(container::Codec codec);

}  // namespace shm
