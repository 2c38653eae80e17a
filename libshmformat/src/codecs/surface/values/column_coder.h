// The coders of an array. Each group of the array is one bitstream. In a group, tiles are coded one
// after another; in a tile, components are coded one after another.
//   ComponentCoder  codes one component. For each value it computes a prediction from the
//                   neighbourhood (value_predictor.h), codes the residual (column_models.h), and
//                   stores the restored value (column_state.h)
//   ColumnCoder     the components of an array, and the data that they share
//   ColumnDecoder   decodes the groups of an array
// ComponentCoder and ColumnCoder contain the same code for both directions. When encoding, they
// code decisions that the caller has made: domains, style, copies, and the modes of each tile
// (plan/column_planner.h).
// spec: "Value columns"
#pragma once

#include <algorithm>
#include <array>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <memory>
#include <optional>
#include <span>
#include <utility>
#include <vector>

#include "codecs/shared/codec_id.h"
#include "codecs/shared/neighbourhood.h"
#include "codecs/shared/value_domain.h"
#include "codecs/surface/values/column_models.h"
#include "codecs/surface/values/column_state.h"
#include "codecs/surface/values/copied_elements.h"
#include "codecs/surface/values/value_predictor.h"
#include "entropy/models.h"
#include "entropy/range_coder.h"

namespace shm {

/// The elements of one group. They are divided into tiles.
struct TiledItems {
  std::vector<Neighbourhood> items;
  std::vector<std::uint32_t> blocks;       ///< element block of each cell; empty for vertices
  std::vector<std::size_t> tile_begin{0};  ///< first item of each tile

  /// The items may omit elements that the array does not cover, if the prediction of no covered
  /// element depends on them. For each tile: the number of omitted elements, modulo 2^64. The
  /// number is negative if the items of the tile include elements of an earlier tile. The list is
  /// empty if no elements were omitted.
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
// If earlier values may be used, arrays with at least this number of components may name the source
// of each component. Frozen: part of the format.
inline constexpr std::size_t kFewestWithSources = 4;

struct ColumnTraits {
  /// True if values may repeat so often that zstd compresses them better than predictions do; false
  /// for coordinates
  bool repeats = true;
  bool tables = true;  ///< true if the column may have match tables, bit mixing and a value
                       ///< history; false if there are too many components

  /// For columns with tables: true if values may be predicted from earlier values of similar
  /// magnitude (recalled values and partners, see column_state.h).
  bool earlier_values = true;
  /// True if elements may be copies of earlier elements. Copies are possible only if the array has
  /// several components, is not quantized, and its values may be recalled.
  bool copies = false;
};

/// The coding options that the encoder chooses for one array in one group.
struct ColumnStyle {
  Reach reach = Reach::farther;  ///< distance at which neighbours are used
  bool matches = true;           ///< whether predictions use matches and other components
  bool mixes = false;            ///< whether residuals are coded with mixed bits
  bool copies = false;           ///< true if elements may be coded as copies of earlier elements
  /// For each component: the earlier component whose values may predict its values. If the list is
  /// empty, this is the previous component.
  std::vector<std::uint8_t> sources;

  std::size_t source_of(std::size_t component) const {
    return sources.empty() ? component - 1 : sources[component];
  }
  /// Returns a bit mask of the neighbours that this style uses. The bits are those of
  /// Neighbourhood::known.
  std::uint32_t known() const {
    constexpr std::uint32_t kNearest = Neighbourhood::kLattice | 7 * Neighbourhood::kThird;
    constexpr std::uint32_t kToBeyond = kNearest | 7 * Neighbourhood::kBeyond;
    if (reach == Reach::lattice) return kNearest;
    return reach == Reach::beyond ? kToBeyond : kToBeyond | 7 * Neighbourhood::kFarther;
  }
};

// --- encoding: the decisions that are coded

/// An element, with all data from which its value is predicted.
struct ElementInputs {
  std::array<double, kFeatures> state{};
  std::optional<std::int64_t> index;  ///< index of the value in the domain; nothing if the value is
                                      ///< an escape
  std::uint32_t known = 0, of_class = 0;
  bool has_partner = false;
  bool copied = false;   ///< true if the element is a copy of an earlier element; copies are not
                         ///< predicted
  double reference = 0;  ///< state of the element's reference
};
/// The inputs of several elements.
struct InputsOfElements {
  std::vector<ElementInputs> elements;
  /// For each element: its features (inputs of the prediction) minus the features of its reference
  /// value. Empty without reference values
  std::vector<std::array<double, kFeatures>> differences;
};

/// Number of residuals coded in a class, and their total length in bits.
struct CodedResiduals {
  double count = 0, bits = 0;
};

/// The plan for the encoding of one component of a tile. It contains references to the caller's
/// data.
struct TilePlan {
  std::span<const ClassModes> modes;  ///< by class
  /// Inputs of the predictions of all elements of the tile, if the caller has computed them;
  /// otherwise null. If the inputs have been computed, the states of the component have already
  /// been updated with the values of the tile.
  const InputsOfElements* inputs = nullptr;
  std::span<CodedResiduals>
      coded;  ///< for each class: counters of residuals, which the coder updates; may be empty
};

// --- one component

template <class Coder>
class ComponentCoder {
 public:
  /// `earlier_values`: see ColumnTraits::earlier_values.
  ComponentCoder(std::shared_ptr<const ArrayInfo> info, std::size_t component, bool earlier_values)
      : state_(std::move(info), component), models_(earlier_values ? kPartnerMode : kStayMode) {}

  /// Sets the style of the current group and of all later groups.
  void set_style(const ColumnStyle& style) {
    style_ = style;
    state_.use_matches(style.matches);
  }
  const ColumnStyle& style() const { return style_; }

  /// Begins a group. `wanted`: the domain that the encoder codes; the decoder ignores it and reads
  /// the domain from the stream. `before`: the components before this component, which must have
  /// begun the group. `most_entries`: largest allowed number of entries of a table. Returns false
  /// if the data is damaged, for example if a table is too large or the domain changes too often.
  bool begin_group(Coder& coder, const DomainAndTable& wanted,
                   std::span<const ComponentCoder<Coder>> before, std::uint64_t most_entries);
  /// Begins a tile. Returns false if the tile needs more memory than the memory budget allows.
  bool begin_tile(const ColumnTile& tile) {
    if (!state_.begin_tile(tile)) return false;
    models_.begin_tile(tile.classes);
    return true;
  }
  /// Codes the values of the tile. `bits`: the bits of the values. The decoder ignores `plan` and
  /// reads the modes from the stream. Returns false if the data is damaged.
  bool code_tile(Coder& coder, const ColumnTile& tile, std::span<std::uint64_t> bits,
                 const TilePlan& plan = {});
  /// Returns the values and residual sizes of the most recent tile.
  const CodedTile& coded_tile() const { return state_.coded_tile(); }

  const ArrayInfo& info() const { return state_.info(); }
  /// Returns the state of the column, from which later elements are predicted.
  ColumnState& state() { return state_; }
  const ColumnModels<Coder>& models() const { return models_; }
  /// Returns the rank table of the group. The table is empty if indices are coded directly instead
  /// of as ranks.
  std::span<const std::int64_t> table() const { return table_; }
  /// Returns indices that the decoder already knows. The entries of a rank table in this domain are
  /// predicted from them. `before`: see begin_group().
  std::vector<std::int64_t> known_entries(const ValueDomain& domain,
                                          std::span<const ComponentCoder<Coder>> before) const;

 private:
  /// The result of coding one value.
  struct CodedValue {
    double state = 0.0;
    ResidualSize size = 0;
    bool second = false;    // whether the second mode predicted the value
    bool recalled = false;  // whether an earlier value predicted the value
  };
  struct Prediction {
    double state = 0.0;
    std::int64_t index = 0;
    bool second = false;
  };

  /// Function objects that return the state of a feature of an element, and the difference from the
  /// state of the same feature in the reference values. They do not depend on the space of the
  /// component, so predictions are compiled once for all spaces.
  struct StateAt {
    ComponentCoder* coder;
    const TileElement* element;
    double operator()(std::uint32_t feature) const;
  };
  struct DifferenceAt {
    StateAt at;
    double reference;
    double operator()(std::uint32_t feature) const;
  };

  template <class Space>
  bool code_values(Coder& coder, const Space& space, const ColumnTile& tile,
                   std::span<std::uint64_t> bits);
  template <class Space, class Predict>
  std::optional<CodedValue> code_value(Coder& coder, const Space& space, const TileElement& element,
                                       const Predict& predict, std::uint64_t& bits);
  template <class Space, class Predict>
  Prediction code_prediction(Coder& coder, const Space& space, const TileElement& element,
                             const Predict& predict, std::int64_t actual);
  template <class Space, class Predict>
  std::optional<std::int64_t> code_index(Coder& coder, const Space& space,
                                         const TileElement& element, const Predict& predict,
                                         std::int64_t actual, CodedValue& value);
  template <class Space>
  bool code_recalled(Coder& coder, const Space& space, const TileElement& element,
                     const Prediction& expected, std::int64_t& index, CodedValue& value);
  template <class Space>
  bool code_bits(Coder& coder, const Space& space, std::int64_t index, std::uint64_t& bits);

  /// Encoding: returns true if the plan of the tile contains the inputs of the tile's elements.
  bool has_inputs() const {
    if constexpr (Coder::kDecodes) return false;
    return plan_.inputs != nullptr;
  }
  const ElementInputs& inputs(std::size_t i) const { return plan_.inputs->elements[i]; }
  /// Encoding: counts a residual. `length`: its length in bits.
  void count_residual(std::uint32_t of_class, std::uint32_t length) {
    if constexpr (Coder::kDecodes) return;
    if (plan_.coded.empty()) return;
    plan_.coded[of_class].count += 1;
    plan_.coded[of_class].bits += length;
  }

  ColumnStyle style_;
  // Rank table of the group; empty if indices are coded directly instead of as ranks
  std::vector<std::int64_t> table_;
  ColumnState state_;
  ColumnModels<Coder> models_;
  TilePlan plan_;  // encoding: plan of the current tile
};

extern template class ComponentCoder<SplitEncoder>;
extern template class ComponentCoder<SplitDecoder>;

// --- all components

template <class Coder>
class ColumnCoder {
 public:
  /// `blocks`: element blocks that the array covers, in ascending order; if the list is empty, the
  /// array covers all blocks.
  [[gnu::cold]] ColumnCoder(const ArrayInfo& info, std::vector<std::uint32_t> blocks,
                            const ColumnTraits& traits);

  const ArrayInfo& info() const { return *info_; }
  bool has_tables() const { return has_tables_; }
  /// See ColumnTraits::earlier_values.
  bool has_earlier_values() const { return has_earlier_values_; }
  bool has_copies() const { return has_copies_; }
  /// The next two functions return the size in bytes of one component of an element, and of a whole
  /// element.
  std::size_t scalar_width() const { return width_; }
  std::size_t element_bytes() const { return width_ * info_->components; }
  std::span<ComponentCoder<Coder>> components() { return components_; }
  /// Returns the style of the current group.
  const ColumnStyle& style() const { return style_; }

  /// Allocates memory for `slots` slots. If groups have been skipped, call it before the next
  /// group. `all`: number of slots that would be needed if no elements were omitted.
  void make_room(std::uint32_t slots, std::uint32_t all);
  /// Declares that every group has reference values. Call it before the first element.
  void use_reference();

  bool covers(std::uint32_t block) const {
    return blocks_.empty() || std::binary_search(blocks_.begin(), blocks_.end(), block);
  }
  /// Returns the elements of a tile that the array covers. Each element that is not covered
  /// receives the state of the element before it.
  std::span<const Neighbourhood> covered(const TiledItems::Tile& tile);
  /// Returns the elements of a tile that the array covers. Calls skip(item) for each element that
  /// is not covered.
  template <class Skip>
  std::span<const Neighbourhood> covered(const TiledItems::Tile& tile, Skip&& skip) {
    if (blocks_.empty()) return tile.items;
    covered_.clear();
    for (std::size_t i = 0; i < tile.items.size(); ++i) {
      if (covers(tile.blocks[i]))
        covered_.push_back(tile.items[i]);
      else
        skip(tile.items[i]);
    }
    return covered_;
  }

  /// Codes the head of a group: first the style, then the domain of each component. `domains`: used
  /// only when encoding. Returns false if the data is damaged.
  bool code_head(Coder& coder, const ColumnStyle& style, std::span<const DomainAndTable> domains,
                 std::uint64_t most_entries);
  /// Begins a tile. Determines the classes of its elements, and codes which elements are copies.
  /// `back`: one entry for each element; see ColumnTile::back. Returns false if the data is
  /// damaged.
  bool begin_tile(Coder& coder, std::span<const Neighbourhood> items,
                  std::span<std::uint32_t> back);
  /// Returns the tile of a component. Call it after all components before this component have been
  /// coded.
  ColumnTile tile_of(std::size_t component, std::span<const Neighbourhood> items,
                     std::span<const std::uint64_t> reference, std::span<const std::uint32_t> back);
  /// Codes one component of the current tile. See ComponentCoder::code_tile().
  bool code_tile(Coder& coder, std::size_t component, const ColumnTile& tile,
                 std::span<std::uint64_t> bits, const TilePlan& plan = {});

  /// Returns the class of each of these elements. `known`: the bits of Neighbourhood::known that
  /// distinguish classes. The result is valid until the next call.
  TileClasses classify(std::span<const Neighbourhood> items, std::uint32_t known);
  ClassNumbers& class_numbers() { return class_numbers_; }

  /// Values of the elements that may be copied, one list for each component. Empty if the column
  /// has no copies.
  using History = std::vector<std::vector<std::uint64_t>>;
  const History& history() const { return history_; }
  /// Removes all elements from the history, so that they cannot be copied.
  void forget_history();

 private:
  bool code_sources(Coder& coder, const std::vector<std::uint8_t>& wanted);
  void keep_history(std::size_t component, std::span<const std::uint64_t> bits);

  std::shared_ptr<const ArrayInfo> info_;
  std::vector<std::uint32_t> blocks_;  // covered blocks; empty: all blocks
  bool has_tables_, has_earlier_values_, has_copies_;
  std::size_t width_;
  std::vector<ComponentCoder<Coder>> components_;
  ColumnStyle style_;
  TreeModel<2> reach_;
  AdaptiveBit matches_, copies_, has_sources_;
  TreeModel<4> source_;
  ClassNumbers class_numbers_;
  CopiedElements<Coder> copied_;
  History history_;

  // Data of the current tile
  std::vector<Neighbourhood> covered_;
  std::vector<std::uint16_t> classes_;
  std::vector<const CodedTile*> coded_tiles_;  // of the components before the current component
};

extern template class ColumnCoder<SplitEncoder>;
extern template class ColumnCoder<SplitDecoder>;

/// Decodes the groups of an array.
class ColumnDecoder {
 public:
  /// See ColumnCoder.
  [[gnu::cold]] ColumnDecoder(const ArrayInfo& info, std::vector<std::uint32_t> blocks,
                              const ColumnTraits& traits = {})
      : column_(info, std::move(blocks), traits) {}

  /// Returns true if `codec` is allowed for groups of this column.
  bool takes(Codec codec) const {
    return codec == Codec::columns || codec == Codec::shuffled_zstd ||
           (codec == Codec::mixed_columns && column_.has_tables());
  }

  /// Allocates memory for slots, see ColumnCoder.
  void make_room(std::uint32_t slots, std::uint32_t all = 0) { column_.make_room(slots, all); }
  /// Declares that every group has reference values. Call it before the first element.
  void use_reference() { column_.use_reference(); }
  /// Sets the memory budget for data that the column stores by slot. If the budget is exhausted,
  /// decode_tile() fails. `memory` must outlive the column. Call it before the first element.
  void use_memory(ColumnMemory& memory);

  /// Begins a group. `bytes`: the data of the group; they must stay valid until the next call.
  /// `limit`: largest unpacked size in bytes. Returns false if the data is damaged, or if `codec`
  /// is not allowed for groups of this column.
  bool begin_group(Codec codec, std::span<const std::byte> bytes, std::uint64_t limit);
  /// Returns the reach that the neighbourhoods of the group must have (how distant the neighbours
  /// are). Call it after begin_group().
  Reach reach() const {
    return codec_ == Codec::shuffled_zstd ? Reach::lattice : column_.style().reach;
  }
  /// Decodes the next tile and appends the values of its covered elements to `out` without gaps.
  /// `reference`: the reference values of these elements, in the same layout as the values; null if
  /// none exist.
  bool decode_tile(const TiledItems::Tile& tile, std::vector<std::byte>& out,
                   const std::byte* reference = nullptr);

 private:
  bool copy_unpacked(std::span<const Neighbourhood> items, std::vector<std::byte>& out);

  ColumnCoder<SplitDecoder> column_;
  const ColumnMemory* memory_ = nullptr;  // memory budget, if memory is bounded
  SplitDecoder coder_;
  Codec codec_ = Codec::columns;
  std::vector<std::byte> unpacked_;  // shuffled_zstd: values of the group, packed
  std::size_t unpacked_at_ = 0;
  // Data of the current tile
  std::vector<std::uint64_t> bits_, reference_bits_;
  std::vector<std::uint32_t> back_;  // see ColumnTile::back
};

}  // namespace shm
