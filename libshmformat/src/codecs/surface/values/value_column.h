// ValueColumn: the coder of one array. It codes one component after another, tile by tile, to one
// bitstream per group.
// spec: "Value columns"
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <vector>

#include "codecs/shared/codec_id.h"
#include "codecs/surface/values/copied_elements.h"
#include "codecs/surface/values/earlier_values.h"
#include "codecs/surface/values/mode_choice.h"
#include "codecs/surface/values/scalar_column.h"
#include "codecs/surface/values/value_predictor.h"

namespace shm {

/// The elements of one group, divided into tiles.
struct TiledItems {
  std::vector<Neighbourhood> items;
  std::vector<std::uint32_t> blocks;       ///< element block of each cell; empty for vertices
  std::vector<std::size_t> tile_begin{0};  ///< first item of each tile

  /// Number of uncovered elements per tile that were left out because no covered element depends on
  /// them. Numbers are modulo 2^64, since some of these elements may belong to a later tile. Empty
  /// if no elements were left out.
  std::vector<std::uint64_t> left_out;

  struct Tile {
    std::span<const Neighbourhood> items;
    std::span<const std::uint32_t> blocks;
    std::uint64_t left_out = 0;
  };
  Tile tile(std::size_t t) const {
    const std::size_t begin = tile_begin[t];
    const std::size_t end = t + 1 < tile_begin.size() ? tile_begin[t + 1] : items.size();
    return {std::span(items).subspan(begin, end - begin),
            blocks.empty() ? std::span<const std::uint32_t>()
                           : std::span(blocks).subspan(begin, end - begin),
            left_out.empty() ? 0 : left_out[t]};
  }
  void clear() {
    items.clear();
    blocks.clear();
    left_out.clear();
    tile_begin.assign(1, 0);
  }
};

// Match tables, bit mixing and value history need up to 3 MB per component. They are enabled only
// for arrays with at most 16 components, and for at most 64 components of all static arrays
// together. Frozen: part of the format.
inline constexpr std::uint32_t kMostTableComponents = 16, kMostTableComponentsInAll = 64;

struct EncodedColumn {
  Codec codec = Codec::columns;
  std::vector<std::byte> bytes;
};

/// Returns the largest reach of any style at this level. The finder of neighbourhoods needs a reach
/// before a style is chosen.
inline constexpr Reach farthest_reach(Level level) {
  return level == Level::fast ? Reach::lattice : Reach::farther;
}

struct ColumnTraits {
  /// Whether values may repeat so often that zstd compresses them better; false for coordinates
  bool repeats = true;
  bool tables = true;  ///< whether the column has tables, unless it has too many components

  /// If the column has tables: whether values may be recalled, and elements may have partners.
  bool earlier_values = true;
  /// If values may be recalled and are not quantized: whether elements of several components may be
  /// copies of earlier elements.
  bool copies = false;
};

template <class Coder>
class ValueColumn {
 public:
  /// `blocks`: element blocks that the array covers, ascending; empty: all blocks.
  [[gnu::cold]] ValueColumn(const ArrayInfo& info, std::vector<std::uint32_t> blocks,
                            const ColumnTraits& traits = {});

  /// Returns true if groups of this column may use `codec`.
  bool takes(Codec codec) const {
    return codec == Codec::columns || codec == Codec::shuffled_zstd ||
           (codec == Codec::mixed_columns && has_tables_);
  }

  /// Allocates memory for `slots` slots. Call it before a group that uses them if earlier groups
  /// were left out. `all`: number of slots of all elements, if some elements are left out.
  void make_room(std::uint32_t slots, std::uint32_t all = 0);
  /// Declares that every group has a reference. Call it before the first element.
  void use_reference();
  /// Decoding: sets the memory budget for the slots. `memory` must outlive the column. Call it
  /// before the first element. If the budget refuses memory, decode_tile() fails.
  void use_memory(ColumnMemory& memory) {
    memory_ = &memory;
    for (auto& column : columns_) column.state().use_memory(memory);
  }
  /// Encoding: makes the state of the column independent of groups in shuffled_zstd.
  void see_own_groups_only() { sees_other_groups_ = false; }

  // `reference`: reference values of the covered elements, with the same layout as the values; or
  // null.
  /// Encoding: encodes a group. `values`: the values of its covered elements in order. `stride`:
  /// distance in bytes between consecutive elements.
  EncodedColumn encode(const TiledItems& elements, const std::byte* values, std::size_t stride,
                       Level level, const std::byte* reference = nullptr);
  /// Encoding: returns the estimated size in bytes of the data that encode() would return. The
  /// column does not change. `choices`: by component; empty on input, or the choices for the same
  /// values with other neighbourhoods, which makes the estimate fast.
  std::uint64_t about_bytes(const TiledItems& elements, const std::byte* values, std::size_t stride,
                            std::vector<DomainChoice>& choices);
  /// Encoding: returns the exact size in bytes of the data that encode() would return. The column
  /// does not change.
  std::uint64_t bytes_if_coded(const TiledItems& elements, const std::byte* values,
                               std::size_t stride, Level level);

  /// Decoding: begins a group. `bytes` must stay valid until the next call, and may unpack to at
  /// most `limit` bytes. Returns false if the data is damaged or groups of this column may not use
  /// the codec.
  bool begin_group(Codec codec, std::span<const std::byte> bytes, std::uint64_t limit);
  /// Returns the reach that the neighbourhoods of the group must have. Call it after begin_group().
  Reach reach() const { return codec_ == Codec::shuffled_zstd ? Reach::lattice : style_.reach; }
  /// Decodes the next tile and appends the values of its covered elements, packed, to `out`.
  bool decode_tile(const TiledItems::Tile& tile, std::vector<std::byte>& out,
                   const std::byte* reference = nullptr);

 private:
  using Bits = std::vector<std::vector<std::uint64_t>>;  // bits of values, by component and element

  std::size_t covered_count(const TiledItems& elements) const;
  /// Returns the bits of `count` elements, by component. `stride`: distance in bytes between
  /// consecutive elements.
  Bits bits_of(const std::byte* values, std::size_t stride, std::size_t count) const;
  std::vector<std::byte> packed(const std::byte* values, std::size_t stride,
                                std::size_t count) const;
  /// Encodes a group with predictions. If components would change their domains too often, returns
  /// nothing and leaves the column unchanged.
  std::optional<std::vector<std::byte>> encode_predicted(const TiledItems& elements, Bits& bits,
                                                         const Bits& reference, Level level);
  /// Does the same, with the copies listed in back_.
  std::optional<std::vector<std::byte>> encode_as_told(const TiledItems& elements, Bits& bits,
                                                       const Bits& reference, Level level);
  /// Encoding: returns, for each covered element, the distance to an element of which it may be a
  /// copy; empty if few elements can be copies.
  std::vector<std::uint32_t> copies_among(const TiledItems& elements, const Bits& bits);
  /// Returns the values of a component, except the values of copies.
  std::vector<std::uint64_t> coded_ones(std::span<const std::uint64_t> bits) const;
  /// Makes all elements so far unavailable as sources of copies.
  void forget_history();
  void keep_history(std::size_t component, std::span<const std::uint64_t> bits);
  /// Stores values that were coded in another codec.
  void keep_values(const TiledItems& elements, const Bits& bits);
  /// Codes the head of a group: first the style, then the domain of each component. `plans`: used
  /// for encoding only.
  bool code_head(Coder& coder, ColumnStyle style, std::span<const DomainPlan> plans,
                 std::uint64_t most_entries);
  std::size_t size_with(const ColumnStyle& style, std::span<const Neighbourhood> first_tile,
                        const Bits& bits, const Bits& reference, std::span<const DomainPlan> plans);
  ColumnStyle choose_style(std::span<const Neighbourhood> first_tile, const Bits& bits,
                           const Bits& reference, std::span<const DomainPlan> plans, Level level);
  /// Stores in classes_ the class of each of these elements under this style.
  void classify(std::span<const Neighbourhood> items, const ColumnStyle& style);
  TileClasses tile_classes() const { return {classes_, class_numbers_.families()}; }
  bool code_component(std::size_t component, std::span<const Neighbourhood> items,
                      std::span<std::uint64_t> bits, std::span<const std::uint64_t> reference,
                      std::span<const std::uint32_t> back);
  DomainPlan choose_domain(std::size_t component, const TiledItems& elements,
                           const std::vector<std::uint64_t>& bits,
                           const std::vector<std::uint64_t>& reference, Level level);
  DomainChoice best_domain(std::size_t component, const TiledItems& elements,
                           const std::vector<std::uint64_t>& bits,
                           const std::vector<std::uint64_t>& reference,
                           std::vector<DomainPlan> plans);
  void rescale(DomainChoice& choice, std::size_t component, const TiledItems& elements,
               const std::vector<std::uint64_t>& bits);
  std::vector<EarlierValues::Value> coded_values(const DomainSample& sample,
                                                 const DomainEstimate& estimate) const;
  DomainSample survey(std::size_t component, const TiledItems& elements,
                      const std::vector<std::uint64_t>& bits,
                      const std::vector<std::uint64_t>& reference);
  bool covers(std::uint32_t block) const {
    return blocks_.empty() || std::binary_search(blocks_.begin(), blocks_.end(), block);
  }
  /// Returns the covered elements of a tile. The state of each uncovered element becomes the last
  /// state.
  std::span<const Neighbourhood> covered(const TiledItems::Tile& tile);
  /// Does the same for trial columns, without counting the elements.
  std::span<const Neighbourhood> covered_to_try(const TiledItems::Tile& tile,
                                                std::span<ScalarColumn<Coder>> columns);

  /// The state that coding a group changes.
  struct State {
    std::vector<ScalarColumn<Coder>> columns;
    TreeModel<2> reach;
    AdaptiveBit matches, copies;
    ClassNumbers class_numbers;
    CopiedElements<Coder> copied;
    Bits history;
  };
  State state() const {
    return {columns_, reach_, matches_, copies_, class_numbers_, copied_, history_};
  }
  void restore(State&& state);

  std::shared_ptr<const ArrayInfo> info_;
  std::vector<std::uint32_t> blocks_;  // covered blocks; empty: all blocks
  bool repeats_, has_tables_, has_earlier_values_, has_copies_, sees_other_groups_ = true;
  std::size_t width_;
  std::vector<ScalarColumn<Coder>> columns_;
  const ColumnMemory* memory_ = nullptr;  // decoding: memory budget, if memory is bounded

  // Tiles of the components before the current component
  std::vector<const CodedTile*> coded_tiles_;
  std::vector<Neighbourhood> covered_;
  std::vector<std::uint64_t> bits_, reference_bits_;
  Coder coder_;
  ColumnStyle style_;
  ClassNumbers class_numbers_;
  std::vector<std::uint16_t> classes_;  // classes of the elements of the current tile
  std::vector<DomainPlan> plans_;       // encoding: plans of the previous group, by component
  std::uint32_t groups_ = 0;            // number of groups encoded so far
  TreeModel<2> reach_;
  AdaptiveBit matches_, copies_;
  CopiedElements<Coder> copied_;
  // Distances to sources, by element of the group (encoding) or of the tile (decoding); empty: no
  // copies
  std::vector<std::uint32_t> back_;
  Bits history_;  // values that may be sources of copies, if there are copies
  Codec codec_ = Codec::columns;
  std::vector<std::byte> unpacked_;  // decoding shuffled_zstd: values of the group, packed
  std::size_t unpacked_at_ = 0;
};

extern template class ValueColumn<SplitEncoder>;
extern template class ValueColumn<SplitDecoder>;

}  // namespace shm
