// ColumnPlanner: encodes the groups of one array. It decides how each group is coded: in which
// codec, domains and style, with which copies, and with which modes in each tile. ColumnCoder then
// codes these decisions and the values.
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

/// Returns the largest reach of any style at this level. The finder of neighbourhoods needs a reach
/// before a style is chosen.
inline constexpr Reach farthest_reach(Level level) {
  return level == Level::fast ? Reach::lattice : Reach::farther;
}

class ColumnPlanner {
 public:
  /// `blocks`: element blocks that the array covers, ascending; empty: all blocks.
  [[gnu::cold]] ColumnPlanner(const ArrayInfo& info, std::vector<std::uint32_t> blocks,
                              const ColumnTraits& traits = {});

  /// Allocates memory for slots, see ColumnCoder.
  void make_room(std::uint32_t slots, std::uint32_t all = 0) { column_.make_room(slots, all); }
  /// Declares that every group has a reference. Call it before the first element.
  void use_reference() { column_.use_reference(); }
  /// Makes the state of the column independent of groups in shuffled_zstd.
  void see_own_groups_only() { sees_other_groups_ = false; }

  // `values`: the values of the covered elements of a group in order. `stride`: distance in bytes
  // between consecutive elements.

  /// Encodes a group. `reference`: reference values of the covered elements, with the same layout
  /// as the values; or null.
  EncodedColumn encode(const TiledItems& elements, const std::byte* values, std::size_t stride,
                       Level level, const std::byte* reference = nullptr);
  /// Returns the estimated size in bytes of the data that encode() would return. The column does
  /// not change. `rated`: by component; empty on input, or the result for the same values with
  /// other neighbourhoods, which makes the estimate fast.
  std::uint64_t about_bytes(const TiledItems& elements, const std::byte* values, std::size_t stride,
                            std::vector<RatedDomain>& rated);
  /// Returns the exact size in bytes of the data that encode() would return. The column does not
  /// change.
  std::uint64_t bytes_if_coded(const TiledItems& elements, const std::byte* values,
                               std::size_t stride, Level level);

 private:
  using Bits = std::vector<std::vector<std::uint64_t>>;  // bits of values, by component and element

  std::size_t covered_count(const TiledItems& elements) const;
  Bits bits_of(const std::byte* values, std::size_t stride, std::size_t count) const;
  std::vector<std::byte> packed(const std::byte* values, std::size_t stride,
                                std::size_t count) const;
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
  std::size_t size_with(const ColumnStyle& style, std::span<const Neighbourhood> first_tile,
                        const Bits& bits, const Bits& reference,
                        std::span<const DomainAndTable> domains);
  void keep_values(const TiledItems& elements, const Bits& bits);

  /// The data that coding a group changes, as far as another attempt needs it as before.
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

  ColumnStyle style_;                    // style of the group encoded last
  std::vector<DomainAndTable> domains_;  // domains of the previous group, by component
  std::uint32_t groups_ = 0;             // number of groups encoded so far
  std::vector<std::uint32_t>
      back_;  // see ColumnTile::back, for the current group; empty: no copies
};

}  // namespace shm
