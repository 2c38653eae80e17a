// ColumnPlanner: encodes the groups of one array. It chooses the codec, domains, style and copies
// of each group, and the modes of each tile. ColumnCoder then codes these choices and the values.
// spec: "Value columns"
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <utility>
#include <vector>

#include "codecs/shared/codec_id.h"
#include "codecs/shared/value_domain.h"
#include "codecs/surface/plan/mode_choice.h"
#include "codecs/surface/values/column_coder.h"

namespace shm {

struct EncodedColumn {
  Codec codec = Codec::columns;
  std::vector<std::byte> bytes;
};

/// Returns the largest reach (distance of neighbours) that can be used for prediction at this
/// level. Neighbourhoods must be found up to this reach, because the reach that is used is chosen
/// later.
inline constexpr Reach farthest_reach(Level level) {
  return level == Level::fast ? Reach::lattice : Reach::farther;
}

class ColumnPlanner {
 public:
  /// `blocks`: element blocks that the array covers, in ascending order; if the list is empty, the
  /// array covers all blocks.
  [[gnu::cold]] ColumnPlanner(const ArrayInfo& info, std::vector<std::uint32_t> blocks,
                              const ColumnTraits& traits = {});

  /// Allocates memory for slots, see ColumnCoder.
  void make_room(std::uint32_t slots, std::uint32_t all = 0) { column_.make_room(slots, all); }
  /// Declares that every group has reference values. Call it before the first element.
  void use_reference() { column_.use_reference(); }
  /// After this call, groups coded with shuffled_zstd do not change the state of the column.
  void see_own_groups_only() { sees_other_groups_ = false; }

  // `values`: the values of the covered elements of a group, in order. `stride`: number of bytes
  // from an element to the next.

  /// Encodes a group. `reference`: the reference values of the covered elements, in the same layout
  /// as the values; null if the group has no reference values.
  EncodedColumn encode(const TiledItems& elements, const std::byte* values, std::size_t stride,
                       Level level, const std::byte* reference = nullptr);
  /// Returns the estimated size in bytes of the result of encode(), without changing the column.
  /// `rated`: the result has one entry for each component. Pass an empty list in the first call. In
  /// later calls for the same values with different neighbourhoods, pass the previous result, which
  /// makes the estimate faster.
  std::uint64_t about_bytes(const TiledItems& elements, const std::byte* values, std::size_t stride,
                            std::vector<RatedDomain>& rated);
  /// Returns the exact size in bytes of the result of encode(), without changing the column.
  std::uint64_t bytes_if_coded(const TiledItems& elements, const std::byte* values,
                               std::size_t stride, Level level);

 private:
  using Bits = std::vector<std::vector<std::uint64_t>>;  // bits of values, by component and element

  EncodedColumn encode_at(const TiledItems& elements, const std::byte* values, std::size_t stride,
                          Level level, const std::byte* reference);
  std::size_t covered_count(const TiledItems& elements) const;
  Bits bits_of(const std::byte* values, std::size_t stride, std::size_t count) const;
  const Bits& stored_bits(const Bits& bits, Bits& rounded) const;
  std::vector<std::byte> packed(const Bits& bits) const;
  EncodedColumn under_zstd(const TiledItems& elements, const Bits& bits,
                           std::vector<std::byte> bytes);
  std::optional<std::vector<std::byte>> encode_predicted(const TiledItems& elements, Bits& bits,
                                                         const Bits& reference, Level level);
  std::optional<std::vector<std::byte>> encode_with_back(const TiledItems& elements, Bits& bits,
                                                         const Bits& reference, Level level);
  void encode_tile(std::span<const Neighbourhood> items, std::size_t offset, Bits& bits,
                   const Bits& reference, bool hurries);
  std::vector<std::uint32_t> copies_among(const TiledItems& elements, const Bits& bits) const;
  DomainAndTable choose_domain(std::size_t component, const TiledItems& elements,
                               const std::vector<std::uint64_t>& bits,
                               const std::vector<std::uint64_t>& reference, Level level);
  ColumnStyle choose_style(std::span<const Neighbourhood> first_tile, const Bits& bits,
                           const Bits& reference, std::span<const DomainAndTable> domains,
                           Level level);
  std::vector<std::uint8_t> sources_of(const Bits& bits) const;
  std::size_t size_with(const ColumnStyle& style, std::span<const Neighbourhood> first_tile,
                        const Bits& bits, const Bits& reference,
                        std::span<const DomainAndTable> domains);
  void keep_values(const TiledItems& elements, const Bits& bits);

  /// The data that encoding a group changes. They are restored before the group is encoded again.
  struct State {
    ColumnCoder<SplitEncoder> column;
    std::vector<ModeWatch> watches;
  };
  State state() const { return {column_, watches_}; }
  void restore(State&& state) {
    column_ = std::move(state.column);
    watches_ = std::move(state.watches);
  }

  bool repeats_, sees_other_groups_ = true;
  ColumnCoder<SplitEncoder> column_;
  SplitEncoder coder_;
  std::vector<ModeWatch> watches_;  // by component
  TilePlanner tiles_;

  ColumnStyle style_;                    // style of the most recently encoded group
  std::vector<DomainAndTable> domains_;  // domains of the previous group, by component
  std::uint32_t groups_ = 0;             // number of groups encoded so far
  std::vector<std::uint32_t>
      back_;  // copies in the current group, see ColumnTile::back; empty if the group has no copies
};

}  // namespace shm
