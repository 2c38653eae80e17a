// ValueColumn: an array in step with the mesh: its components one after the other, tile by tile,
// into one bitstream a group.
// spec: "Value columns"
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <vector>

#include "bytes/codec.h"
#include "values/copied_elements.h"
#include "values/earlier_values.h"
#include "values/mode_choice.h"
#include "values/scalar_column.h"
#include "values/value_predictor.h"

namespace shm {

/// Elements of a group, tile by tile.
struct TiledItems {
  std::vector<Neighbourhood> items;
  std::vector<std::uint32_t> blocks;       ///< of cells: their element block; of vertices: empty
  std::vector<std::size_t> tile_begin{0};  ///< first item of each tile
  /// Of each tile: elements that are not covered, and were left out since no covered one looks at
  /// them; modulo 2^64, since some may stand in a later tile. Empty: none were.
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

// Columns with tables alone have matches, mixed bits and lists of earlier values, which take up to
// 3 MB of each component: arrays of so many components, and of all static arrays so many. Frozen:
// part of the format.
inline constexpr std::uint32_t kMostTableComponents = 16, kMostTableComponentsInAll = 64;

struct EncodedColumn {
  Codec codec = Codec::columns;
  std::vector<std::byte> bytes;
};

/// In which domain a component would be coded, and about what it would take.
struct DomainChoice {
  DomainPlan plan;
  double bits = 0;          ///< of the group, with the table
  double sampled_bits = 0;  ///< of an element of the sample, without earlier values
};

/// How far the styles of a level look at most: what a finder must see before any style is chosen.
inline constexpr Reach farthest_reach(Level level) {
  return level == Level::fast ? Reach::lattice : Reach::farther;
}

struct ColumnTraits {
  bool repeats = true;  ///< values may repeat so that zstd is better, as coordinates do not
  bool tables = true;   ///< it has some, unless it has too many components
  /// Values may be recalled, and have partners, where it has tables.
  bool earlier_values = true;
  /// Elements of several components may be copies of earlier ones, where values may be recalled and
  /// are not quantized.
  bool copies = false;
};

template <class Coder>
class ValueColumn {
 public:
  /// `blocks`: those whose elements have a value, ascending; empty: all elements have.
  [[gnu::cold]] ValueColumn(const ArrayInfo& info, std::vector<std::uint32_t> blocks,
                            const ColumnTraits& traits = {});

  /// Whether its groups may be in this codec.
  bool takes(Codec codec) const {
    return codec == Codec::columns || codec == Codec::shuffled_zstd ||
           (codec == Codec::mixed_columns && has_tables_);
  }

  /// Before a group that names these slots, where groups before may have been left out. `all`:
  /// slots of all elements, where some are left out.
  void make_room(std::uint32_t slots, std::uint32_t all = 0);
  /// Before the first element: all groups will come with a reference.
  void use_reference();
  /// Decoding, before the first element: what it keeps by slot takes of this memory, which is
  /// borrowed. Where that is refused, decode_tile() fails.
  void use_memory(ColumnMemory& memory) {
    memory_ = &memory;
    for (auto& column : columns_) column.state().use_memory(memory);
  }
  /// Encoding: nothing is kept of groups that are not in a codec of columns.
  void see_own_groups_only() { sees_other_groups_ = false; }

  // `reference`: what the values of the covered elements refer to, as these are; or null.
  /// Encoding: all values of a group, of the covered elements in order, `stride` bytes apart.
  EncodedColumn encode(const TiledItems& elements, const std::byte* values, std::size_t stride,
                       Level level, const std::byte* reference = nullptr);
  /// Encoding: about the bytes that encode() would return; the column is as it was. `choices`, by
  /// component: on input empty, or what was found for the same values among other neighbours, which
  /// makes it cheap.
  std::uint64_t about_bytes(const TiledItems& elements, const std::byte* values, std::size_t stride,
                            std::vector<DomainChoice>& choices);
  /// Encoding: just the bytes that encode() would return; the column is as it was.
  std::uint64_t bytes_if_coded(const TiledItems& elements, const std::byte* values,
                               std::size_t stride, Level level);

  /// Decoding. `bytes` are borrowed until the next call; they may unpack to `limit` bytes. False
  /// for damaged data, and for a codec that it does not take.
  bool begin_group(Codec codec, std::span<const std::byte> bytes, std::uint64_t limit);
  /// How far the neighbourhoods of the group must look. After begin_group().
  Reach reach() const { return codec_ == Codec::shuffled_zstd ? Reach::lattice : style_.reach; }
  /// The values of the elements of the next tile, packed, appended to `out`.
  bool decode_tile(const TiledItems::Tile& tile, std::vector<std::byte>& out,
                   const std::byte* reference = nullptr);

 private:
  using Bits = std::vector<std::vector<std::uint64_t>>;  // by component

  std::size_t covered_count(const TiledItems& elements) const;
  /// By component, of `count` elements that stand `stride` bytes apart.
  Bits bits_of(const std::byte* values, std::size_t stride, std::size_t count) const;
  std::vector<std::byte> packed(const std::byte* values, std::size_t stride,
                                std::size_t count) const;
  /// Nothing, and nothing is kept, where components would change their domains too often.
  std::optional<std::vector<std::byte>> encode_predicted(const TiledItems& elements, Bits& bits,
                                                         const Bits& reference, Level level);
  /// The same, with copies where back_ has any.
  std::optional<std::vector<std::byte>> encode_as_told(const TiledItems& elements, Bits& bits,
                                                       const Bits& reference, Level level);
  /// Encoding: for each covered element how far back one stands that it may copy; empty where few
  /// can.
  std::vector<std::uint32_t> copies_among(const TiledItems& elements, const Bits& bits);
  /// Of a component the values that no copies take.
  std::vector<std::uint64_t> coded_ones(std::span<const std::uint64_t> bits) const;
  /// Nothing before the group that comes can be copied.
  void forget_history();
  void keep_history(std::size_t component, std::span<const std::uint64_t> bits);
  /// Values that another codec has coded.
  void keep_values(const TiledItems& elements, const Bits& bits);
  /// What a group begins with: the style, then the domain of each component. `plans` when encoding.
  bool code_head(Coder& coder, ColumnStyle style, std::span<const DomainPlan> plans,
                 std::uint64_t most_entries);
  std::size_t size_with(const ColumnStyle& style, std::span<const Neighbourhood> first_tile,
                        const Bits& bits, const Bits& reference, std::span<const DomainPlan> plans);
  ColumnStyle choose_style(std::span<const Neighbourhood> first_tile, const Bits& bits,
                           const Bits& reference, std::span<const DomainPlan> plans, Level level);
  /// Numbers of the classes of these elements in a style, in classes_.
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
  /// Those of the tile that are covered; the others take the last state.
  std::span<const Neighbourhood> covered(const TiledItems::Tile& tile);
  /// The same to try something with these columns: nothing is counted.
  std::span<const Neighbourhood> covered_to_try(const TiledItems::Tile& tile,
                                                std::span<ScalarColumn<Coder>> columns);

  /// What coding a group changes.
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
  std::vector<std::uint32_t> blocks_;  // that have values; empty: all
  bool repeats_, has_tables_, has_earlier_values_, has_copies_, sees_other_groups_ = true;
  std::size_t width_;
  std::vector<ScalarColumn<Coder>> columns_;
  const ColumnMemory* memory_ = nullptr;       // decoding, if it is bounded
  std::vector<const CodedTile*> coded_tiles_;  // of the components before the one at hand
  std::vector<Neighbourhood> covered_;
  std::vector<std::uint64_t> bits_, reference_bits_;
  Coder coder_;
  ColumnStyle style_;
  ClassNumbers class_numbers_;
  std::vector<std::uint16_t> classes_;  // of the tile at hand
  std::vector<DomainPlan> plans_;       // encoding: of the group before
  std::uint32_t groups_ = 0;            // encoded so far
  TreeModel<2> reach_;
  AdaptiveBit matches_, copies_;
  CopiedElements<Coder> copied_;
  std::vector<std::uint32_t> back_;  // encoding: of the group; decoding: of the tile; or empty
  Bits history_;                     // what may be copied, where there are copies
  Codec codec_ = Codec::columns;
  std::vector<std::byte> unpacked_;  // decoding shuffled_zstd: values of the group, packed
  std::size_t unpacked_at_ = 0;
};

extern template class ValueColumn<SplitEncoder>;
extern template class ValueColumn<SplitDecoder>;

}  // namespace shm
