// Encoding and decoding of schema and extras, the checks of a schema, the names of its elements,
// and the totals of a mesh with such a schema.
// spec: "Schema", "Extras"
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "base/binary.h"
#include "base/packing.h"
#include "format/format.h"
#include "shm/blocks.h"
#include "shm/limits.h"
#include "shm/schema.h"

namespace shm {

void put(ByteWriter& out, const Schema& schema);
/// Returns the checksum of the bytes that put() writes.
std::uint32_t checksum_of(const Schema& schema);
/// Reads a schema. Fails with ErrorCode::corrupt if the bytes do not encode a schema;
/// check_schema() then checks the values. Fails with ErrorCode::over_limit, before it allocates
/// memory, if the schema has more blocks or arrays than the limits allow, or needs more than
/// max_unpacked_bytes.
Result<void> get(ByteReader& in, Schema& schema, const ReadLimits& limits);
/// Return the memory that the object needs, in bytes.
std::uint64_t bytes_of(const Schema& schema);
std::uint64_t bytes_of(const Extra& extra);
/// Fails with ErrorCode::misuse or over_limit if the schema is invalid; the detail states the
/// reason.
Result<void> check_schema(const Schema& schema, const ReadLimits& limits = {});

/// Returns true if the schema has arrays with time steps.
bool has_steps(const Schema& schema);

// Reading and writing of extras. A chunk of version 0 contains a single extra, a chunk of version 1
// many extras packed together.
// spec: "Extras"

void put(ByteWriter& out, const Extra& extra);
bool get(ByteReader& in, Extra& extra);

/// Returns the payload of a chunk of version 1. Must hold: there are at most kMostExtras extras.
/// With Packing::bounded, integers are not stored as differences, so that no extra needs more
/// memory than its bytes in the blob.
std::vector<std::byte> extras_payload(std::span<const Extra> extras,
                                      Packing packing = Packing::with_dictionary);
/// Returns the payload of a chunk of version 0.
std::vector<std::byte> extra_payload(const Extra& extra);
inline constexpr std::size_t kMostExtras = 65536;

/// Returns the extras of a chunk. Errors have no section and no offset. Fails with
/// ErrorCode::over_limit if the extras need more than `limit` bytes of memory.
Result<std::vector<Extra>> get_extras(std::span<const std::byte> payload, std::uint8_t version,
                                      std::uint64_t limit);

/// Returns the largest permitted size of the unpacked step times, in bytes.
inline std::uint64_t most_bytes_of_times(const ReadLimits& limits) {
  return std::min(limits.max_extra_bytes / 8, limits.max_steps) * 8;
}

// Totals: the part of the index that describes the whole mesh (container::Index without the
// entries). They are summed up group by group or part by part.
// spec: "Index and trailer"

/// Returns the totals of a file without groups.
inline container::Index totals_of_nothing(const Schema& schema) {
  container::Index totals;
  totals.block_cells.resize(schema.blocks.size());
  return totals;
}

/// Returns the number of elements of an array in a mesh with these totals.
inline std::uint64_t elements_of(const Schema& schema, const container::Index& totals,
                                 std::uint32_t array) {
  if (schema.arrays[array].location == Location::point) return totals.vertices;
  std::uint64_t cells = 0;
  for (std::uint32_t b = 0; b < totals.block_cells.size(); ++b)
    if (schema.array_covers(array, b)) cells += totals.block_cells[b];
  return cells;
}

struct ValueRange {
  double minimum, maximum;  ///< +inf and -inf if no value is finite
};
/// Returns the range of `count` scalars, `stride` bytes apart. Integers are rounded to double.
ValueRange range_of(ScalarType type, const std::byte* values, std::size_t count,
                    std::size_t stride);

}  // namespace shm
