// Schema and extras as bytes, what a schema must satisfy, the names of what stands in it, and
// totals of a mesh of such a schema. spec: "Schema", "Extras"
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "bytes/binary.h"
#include "bytes/packing.h"
#include "container/format.h"
#include "shm/reader.h"
#include "shm/schema.h"

namespace shm {

void put(ByteWriter& out, const Schema& schema);
/// Of what put() writes.
std::uint32_t checksum_of(const Schema& schema);
/// Corrupt when the bytes are no schema; what it means is then checked by check_schema. Over_limit,
/// before there is memory for it, where it has more blocks or arrays than the limits allow, or
/// takes more than their max_unpacked_bytes.
Result<void> get(ByteReader& in, Schema& schema, const ReadLimits& limits);
/// Bytes that they take in memory.
std::uint64_t bytes_of(const Schema& schema);
std::uint64_t bytes_of(const Extra& extra);
/// Fails with what is wrong with a schema, ErrorCode::misuse or over_limit.
Result<void> check_schema(const Schema& schema, const ReadLimits& limits = {});

/// Whether it has arrays with time steps.
bool has_steps(const Schema& schema);

// Extras: one alone in a chunk of version 0, many that are packed together in one of version 1.
// spec: "Extras"

void put(ByteWriter& out, const Extra& extra);
bool get(ByteReader& in, Extra& extra);

/// The payload of a chunk of version 1. Must hold: there are at most kMostExtras. Packing::bounded:
/// no extra takes more in memory than in the blob.
std::vector<std::byte> extras_payload(std::span<const Extra> extras,
                                      Packing packing = Packing::with_dictionary);
/// The payload of a chunk of version 0.
std::vector<std::byte> extra_payload(const Extra& extra);
inline constexpr std::size_t kMostExtras = 65536;

/// Those of a chunk. Errors have no section and no offset; over_limit: they would take more than
/// `limit` bytes.
Result<std::vector<Extra>> get_extras(std::span<const std::byte> payload, std::uint8_t version,
                                      std::uint64_t limit);

/// Of the blob of step times.
inline std::uint64_t most_bytes_of_times(const ReadLimits& limits) {
  return std::min(limits.max_extra_bytes / 8, limits.max_steps) * 8;
}

// Totals: what the index of a file holds of its mesh (container::Index without the chunks), summed
// up group by group, or part by part. spec: "Index and trailer"

/// Of no group yet.
inline container::Index totals_of_nothing(const Schema& schema) {
  container::Index totals;
  totals.block_cells.resize(schema.blocks.size());
  return totals;
}

/// Elements of an array in a mesh of such totals.
inline std::uint64_t elements_of(const Schema& schema, const container::Index& totals,
                                 std::uint32_t array) {
  if (schema.arrays[array].location == Location::point) return totals.vertices;
  std::uint64_t cells = 0;
  for (std::uint32_t b = 0; b < totals.block_cells.size(); ++b)
    if (schema.array_covers(array, b)) cells += totals.block_cells[b];
  return cells;
}

struct ValueRange {
  double minimum, maximum;  ///< infinity and its opposite where nothing is finite
};
/// Of `count` scalars, `stride` bytes apart. Integers are rounded to doubles.
ValueRange range_of(ScalarType type, const std::byte* values, std::size_t count,
                    std::size_t stride);

}  // namespace shm
