// The list of cell codecs. For each codec, the list contains its name, its id in files, the meshes
// that it accepts, and functions that create its encoders and decoders. codecs/README.md explains
// when each codec is used.
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
  /// Family of the codec. The folder codecs/FAMILY contains the segment encoder and the group
  /// decoder of the family.
  enum class Family : std::uint8_t { surface, shifts, patterns } family;
  /// Maximum memory, in bytes, that the decoder needs per active vertex. The reader compares the
  /// total for all active vertices with ReadLimits::max_active_bytes.
  std::uint64_t active_vertex_bytes;
  /// Returns true if the codec can encode meshes with this schema.
  bool (*takes)(const Schema& schema);
  /// Description of the meshes that the codec accepts, for messages; empty if the codec accepts all
  /// meshes
  std::string_view needs;
};

std::span<const CellCodec> cell_codecs();
/// The next two functions search the list for the codec with this name or id. They return null if
/// the list does not contain it.
const CellCodec* find_codec(ConnectivityCodec name);
const CellCodec* find_codec(Codec id);

/// Returns the name of the codec that encoded the cells of a group. Returns nothing if the group
/// has no cells or if the codec is unknown.
std::optional<ConnectivityCodec> codec_of_cells(const container::GroupHeader& header);

/// Returns an encoder that uses `options.codec`. Precondition: the list contains the codec, and the
/// codec accepts the schema.
std::unique_ptr<SegmentEncoder> make_segment_encoder(const Schema& schema, SegmentOptions options,
                                                     const SegmentStart& start);

/// Returns a decoder for a segment. `header` is the header of the first group of the segment.
Result<std::unique_ptr<GroupDecoder>> make_group_decoder(const Schema& schema,
                                                         const SegmentStart& start,
                                                         const DecodedParts& parts,
                                                         CellBytes cell_bytes,
                                                         const container::GroupHeader& header);

/// Returns an error if the group header states more active vertices than `limits` allows. `file`:
/// number of bytes from the beginning of the file to the end of the group. The text of the error
/// does not name the group.
Result<void> check_active(const container::GroupHeader& header, const ReadLimits& limits,
                          std::uint64_t file);

}  // namespace shm
