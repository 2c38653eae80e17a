// The list of cell codecs: the name and the file id of each codec, the meshes that it accepts, and
// functions that create its encoders and decoders. codecs/README.md explains when each codec is
// used.
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
  /// The family of codecs, which is also the folder below codecs/ with the segment encoder and the
  /// group decoder of this codec.
  enum class Family : std::uint8_t { surface, shifts, patterns } family;
  /// Largest memory per active vertex while decoding, in bytes (compared with
  /// ReadLimits::max_active_bytes).
  std::uint64_t active_vertex_bytes;
  /// Returns true if the codec can encode meshes with this schema.
  bool (*takes)(const Schema& schema);
  /// The meshes that the codec accepts, as text for messages; empty if it accepts all meshes
  std::string_view needs;
};

std::span<const CellCodec> cell_codecs();
/// The next two functions return the codec with this name or id; null if the list does not contain
/// it.
const CellCodec* find_codec(ConnectivityCodec name);
const CellCodec* find_codec(Codec id);

/// Returns the name of the codec that encoded the cells of a group; nothing if the group has no
/// cells or the codec is unknown.
std::optional<ConnectivityCodec> codec_of_cells(const container::GroupHeader& header);

/// Returns an encoder for `options.codec`. The codec must be in the list and accept the schema.
std::unique_ptr<SegmentEncoder> make_segment_encoder(const Schema& schema, SegmentOptions options,
                                                     const SegmentStart& start);

/// Returns the decoder of a segment whose first group has this header.
Result<std::unique_ptr<GroupDecoder>> make_group_decoder(const Schema& schema,
                                                         const SegmentStart& start,
                                                         const DecodedParts& parts,
                                                         CellBytes cell_bytes,
                                                         const container::GroupHeader& header);

/// Returns an error if the number of active vertices in this group header exceeds the limit.
/// `file`: size in bytes of the file up to the end of the group. The error does not name the group.
Result<void> check_active(const container::GroupHeader& header, const ReadLimits& limits,
                          std::uint64_t file);

}  // namespace shm
