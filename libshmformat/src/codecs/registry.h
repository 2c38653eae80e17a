// The list of codecs of cells: how callers and files call each of them, which meshes it takes, and
// how its encoders and decoders are made. codecs/README.md says which one is used when.
// spec: "Group"
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <string_view>

#include "codecs/shared/codec_id.h"
#include "codecs/shared/group_decoder.h"
#include "codecs/shared/segment_encoder.h"
#include "shm/limits.h"
#include "shm/schema.h"

namespace shm {

struct CellCodec {
  ConnectivityCodec name;
  Codec id;
  std::string_view word;
  /// The folder below codecs/ whose segment encoder and group decoder it uses.
  enum class Family : std::uint8_t { surface, shifts, patterns } family;
  /// Largest memory of an active vertex while decoding, in bytes (ReadLimits::max_active_bytes).
  std::uint64_t active_vertex_bytes;
  /// Returns true if a mesh with this schema can be in the codec.
  bool (*takes)(const Schema& schema);
  std::string_view needs;  ///< for messages: the meshes that it takes; empty: all
};

std::span<const CellCodec> cell_codecs();
/// Return null for a codec that is not in the list.
const CellCodec* find_codec(ConnectivityCodec name);
const CellCodec* find_codec(Codec id);

/// Returns the name of the codec of a group's cells; nothing if it has no cells or the codec is
/// unknown.
std::optional<ConnectivityCodec> codec_of_cells(const container::GroupHeader& header);

/// Returns the encoder for `options.codec`, which must be in the list and take the schema.
std::unique_ptr<SegmentEncoder> make_segment_encoder(const Schema& schema, SegmentOptions options,
                                                     const SegmentStart& start);

/// Returns the decoder of a segment whose first group has this header.
Result<std::unique_ptr<GroupDecoder>> make_group_decoder(const Schema& schema,
                                                         const SegmentStart& start,
                                                         const DecodedParts& parts,
                                                         CellBytes cell_bytes,
                                                         const container::GroupHeader& header);

/// Checks that the limits allow the number of active vertices in this header. `file`: bytes of the
/// file up to the end of the group. The error names no place.
Result<void> check_active(const container::GroupHeader& header, const ReadLimits& limits,
                          std::uint64_t file);

}  // namespace shm
