#include "codecs/registry.h"

#include <algorithm>
#include <array>
#include <string>
#include <type_traits>
#include <utility>

#include "base/errors.h"
#include "codecs/patterns/pattern_cells.h"
#include "codecs/patterns/pattern_group_decoder.h"
#include "codecs/patterns/pattern_segment_encoder.h"
#include "codecs/shifts/shift_group_decoder.h"
#include "codecs/shifts/shift_segment_encoder.h"
#include "codecs/shifts/shifts.h"
#include "codecs/surface/surface_group_decoder.h"
#include "codecs/surface/surface_segment_encoder.h"
#include "format/schema.h"

namespace shm {
namespace {

using Family = CellCodec::Family;

bool takes_all(const Schema& /*schema*/) { return true; }

/// Returns the table entry of a codec that encodes cells over an active surface.
constexpr CellCodec over_surface(ConnectivityCodec name, Codec id, std::string_view word) {
  return {name, id, word, Family::surface, 288, takes_all, {}};
}

constexpr std::array<CellCodec, 6> kCellCodecs = {{
    over_surface(ConnectivityCodec::paper, Codec::paper, "paper"),
    over_surface(ConnectivityCodec::rows, Codec::rows, "rows"),
    over_surface(ConnectivityCodec::replay, Codec::replay, "replay"),
    over_surface(ConnectivityCodec::mixed, Codec::mixed, "mixed"),
    {ConnectivityCodec::shifts, Codec::shifts, "shifts", Family::shifts, 16, takes_shifts,
     "cells of 1 to 64 nodes, no delay buffer, and stepped arrays of at most 32 components"},
    {ConnectivityCodec::patterns, Codec::patterns, "patterns", Family::patterns, 72, takes_patterns,
     "cells of 1 to 64 nodes and no delay buffer"},
}};

/// Returns the table entry for the codec of the group. If the group has no cells or an unknown
/// codec, returns the first entry; the decoder of this entry reports the unknown codec.
const CellCodec& entry_of(const container::GroupHeader& header) {
  const auto id = container::connectivity_of(header);
  const CellCodec* known = id ? find_codec(*id) : nullptr;
  return known != nullptr ? *known : kCellCodecs[0];
}

}  // namespace

std::span<const CellCodec> cell_codecs() { return kCellCodecs; }

const CellCodec* find_codec(ConnectivityCodec name) {
  const auto found = std::ranges::find(kCellCodecs, name, &CellCodec::name);
  return found == kCellCodecs.end() ? nullptr : &*found;
}

const CellCodec* find_codec(Codec id) {
  const auto found = std::ranges::find(kCellCodecs, id, &CellCodec::id);
  return found == kCellCodecs.end() ? nullptr : &*found;
}

std::string_view codec_name(ConnectivityCodec codec) {
  if (codec == ConnectivityCodec::automatic) return "automatic";
  const CellCodec* known = find_codec(codec);
  return known != nullptr ? known->word : "unknown";
}

std::optional<ConnectivityCodec> codec_of_cells(const container::GroupHeader& header) {
  const auto id = container::connectivity_of(header);
  const CellCodec* known = id ? find_codec(*id) : nullptr;
  return known != nullptr ? std::optional(known->name) : std::nullopt;
}

std::unique_ptr<SegmentEncoder> make_segment_encoder(const Schema& schema, SegmentOptions options,
                                                     const SegmentStart& start) {
  const CellCodec& codec = *find_codec(options.codec);
  options.codec_id = codec.id;
  switch (codec.family) {
    case Family::shifts: return std::make_unique<ShiftSegmentEncoder>(schema, options, start);
    case Family::patterns: return std::make_unique<PatternSegmentEncoder>(schema, options, start);
    case Family::surface: break;
  }
  return std::make_unique<SurfaceSegmentEncoder>(schema, options, start);
}

Result<std::unique_ptr<GroupDecoder>> make_group_decoder(const Schema& schema,
                                                         const SegmentStart& start,
                                                         const DecodedParts& parts,
                                                         CellBytes cell_bytes,
                                                         const container::GroupHeader& header) {
  const CellCodec& codec = entry_of(header);
  if (!codec.takes(schema))
    return unsupported("connectivity: codec " + std::string(codec.word) + " needs " +
                       std::string(codec.needs));
  const auto made = [&]<class Decoder>(std::type_identity<Decoder>) {
    return std::unique_ptr<GroupDecoder>(
        std::make_unique<Decoder>(schema, start, parts, std::move(cell_bytes)));
  };
  switch (codec.family) {
    case Family::shifts: return made(std::type_identity<ShiftGroupDecoder>());
    case Family::patterns: return made(std::type_identity<PatternGroupDecoder>());
    case Family::surface: break;
  }
  return made(std::type_identity<SurfaceGroupDecoder>());
}

Result<void> check_active(const container::GroupHeader& header, const ReadLimits& limits,
                          std::uint64_t file) {
  const std::uint64_t bytes =
      limit_with(limits.max_active_bytes, ReadLimits::kActiveBytesEach, file);
  const std::uint64_t limit =
      std::min(limits.max_active_vertices, bytes / entry_of(header).active_vertex_bytes);
  const std::uint64_t active = header.max_active_vertices;
  if (active <= limit) return {};
  return over_limit("needs " + std::to_string(active) + " active vertices, the limit is " +
                    std::to_string(limit));
}

}  // namespace shm
