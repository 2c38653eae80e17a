#include "codecs/surface/plan/column_planner.h"

#include <algorithm>
#include <array>
#include <bit>
#include <utility>

#include "base/lists.h"
#include "base/packing.h"
#include "codecs/shared/shuffled_zstd.h"
#include "codecs/surface/plan/domain_choice.h"

namespace shm {
namespace {

// Far neighbours are used if they reduce the size by more than 1/kWorthFarShare. Domains are chosen
// again after kGroupsKept groups.
constexpr std::size_t kWorthFarShare = 20;
constexpr std::uint32_t kGroupsKept = 8;
constexpr int kQuickZstd = 9;
// Copies are tried if at least one in kFewestCopies elements can be a copy of an earlier element.
constexpr std::size_t kFewestCopies = 8;
/// At level best, a group of at most kFewElements elements is also coded without mixing, since the
/// weights of mixing need more values to adapt.
constexpr std::size_t kFewElements = 64;

// --- copies

/// Returns a number that combines the kind of an element and, for a vertex of a hexahedron, which
/// of the eight corners it is. An element can be a copy only of an element with the same kind and
/// corner.
std::uint8_t kind_and_corner_of(const Neighbourhood& item) {
  return static_cast<std::uint8_t>((item.corner | item.kind << 3) & 63);
}

/// A list of elements with consecutive numbers: first the elements of the history (the elements
/// just before the group), then the elements of the group.
class Elements {
 public:
  Elements(std::span<const std::vector<std::uint64_t>> bits,
           std::span<const std::vector<std::uint64_t>> history)
      : bits_(bits), history_(history), before_(history.empty() ? 0 : history[0].size()) {}

  std::size_t before() const { return before_; }
  std::size_t size() const { return before_ + bits_[0].size(); }
  bool are_equal(std::size_t one, std::size_t other) const {
    for (std::size_t c = 0; c < bits_.size(); ++c)
      if (at(c, one) != at(c, other)) return false;
    return true;
  }
  std::uint64_t hash(std::size_t i) const {
    std::uint64_t sum = 0;
    for (std::size_t c = 0; c < bits_.size(); ++c) {
      sum = (sum ^ at(c, i)) * 0x9e3779b97f4a7c15u;
      sum ^= sum >> 29;
    }
    return sum;
  }

 private:
  std::uint64_t at(std::size_t c, std::size_t i) const {
    return i < before_ ? history_[c][i] : bits_[c][i - before_];
  }

  std::span<const std::vector<std::uint64_t>> bits_, history_;
  std::size_t before_;
};

/// Returns, for each element, the index of the next element with the same kind and corner. For the
/// last such element, returns its own index. `kinds`: the kind and corner of
/// each element, as kind_and_corner_of() returns them.
std::vector<std::uint32_t> next_alike(std::span<const std::uint8_t> kinds) {
  constexpr std::size_t kPlaces = 64;
  std::vector<std::uint32_t> next(kinds.size());
  std::array<std::uint32_t, kPlaces> last;
  last.fill(kNone);
  for (auto i = static_cast<std::uint32_t>(kinds.size()); i-- > 0;) {
    std::uint32_t& next_of_kind = last[kinds[i] % kPlaces];
    next[i] = next_of_kind == kNone ? i : next_of_kind;
    next_of_kind = i;
  }
  return next;
}

/// For each element of the group, finds an earlier element with the same bits, and returns the
/// distance to it. The distance is at most `farthest`; it is 0 if no such element is found.
/// `kinds`: the kind and corner of each element. If the most recent distance for the same kind and
/// corner leads to an equal element, that distance is returned. Otherwise the result is the
/// distance that remains valid for the longest run of elements with the same kind and corner.
/// `bits`, `history`: one list for each component. `history` contains the elements just before the
/// first element of the group.
std::vector<std::uint32_t> find_copies(std::span<const std::uint8_t> kinds,
                                       std::span<const std::vector<std::uint64_t>> bits,
                                       std::span<const std::vector<std::uint64_t>> history,
                                       std::uint32_t farthest) {
  constexpr std::uint32_t kLongestRun = 32, kMostLooks = 16;
  const Elements all(bits, history);
  std::vector<std::uint32_t> back(kinds.size()), wanted(kinds.size());
  const std::vector<std::uint32_t> next = next_alike(kinds);
  // Hash chains of earlier elements; the most recent element is the first in a chain.
  std::vector<std::uint32_t> heads(std::bit_ceil(all.size() + 1), kNone), chain(all.size());
  for (std::size_t i = 0; i < all.size(); ++i) {
    std::uint32_t& head = heads[static_cast<std::size_t>(all.hash(i)) & (heads.size() - 1)];
    chain[i] = head;
    head = static_cast<std::uint32_t>(i);
    if (i < all.before()) continue;
    const std::size_t item = i - all.before();
    const auto is_copy = [&](std::uint32_t by) { return by <= i && all.are_equal(i, i - by); };
    std::uint32_t& found = back[item];
    if (wanted[item] > 0 && is_copy(wanted[item])) {
      found = wanted[item];
    } else {
      std::uint32_t longest = 0, looks = 0;
      for (std::uint32_t earlier = chain[i]; earlier != kNone && looks < kMostLooks;
           earlier = chain[earlier], ++looks) {
        const auto by = static_cast<std::uint32_t>(i - earlier);
        if (by > farthest) break;
        if (!is_copy(by)) continue;
        std::uint32_t run = 1;
        for (std::size_t like = item; run < kLongestRun && next[like] != like; ++run) {
          like = next[like];
          const std::size_t element = like + all.before();
          if (!all.are_equal(element, element - by)) break;
        }
        if (run <= longest) continue;
        longest = run;
        found = by;
      }
    }
    if (next[item] != item) wanted[next[item]] = found > 0 ? found : wanted[item];
  }
  return back;
}

}  // namespace

ColumnPlanner::ColumnPlanner(const ArrayInfo& info, std::vector<std::uint32_t> blocks,
                             const ColumnTraits& traits)
    : repeats_(traits.repeats),
      column_(info, std::move(blocks), traits),
      watches_(info.components) {}

// --- groups

EncodedColumn ColumnPlanner::encode(const TiledItems& elements, const std::byte* values,
                                    std::size_t stride, Level level, const std::byte* reference) {
  if (level != Level::best || !column_.has_tables() || covered_count(elements) > kFewElements)
    return encode_at(elements, values, stride, level, reference);
  State before = state();
  EncodedColumn mixed = encode_at(elements, values, stride, Level::best, reference);
  State after = state();
  restore(std::move(before));
  EncodedColumn plain = encode_at(elements, values, stride, Level::standard, reference);
  if (plain.bytes.size() < mixed.bytes.size()) return plain;
  restore(std::move(after));
  return mixed;
}

/// Encodes a group as `level` requires.
EncodedColumn ColumnPlanner::encode_at(const TiledItems& elements, const std::byte* values,
                                       std::size_t stride, Level level,
                                       const std::byte* reference) {
  const std::size_t count = covered_count(elements), width = column_.scalar_width();
  Bits bits = bits_of(values, stride, count);
  const Bits references = bits_of(reference, stride, reference == nullptr ? 0 : count);
  const Codec codec =
      level == Level::best && column_.has_tables() ? Codec::mixed_columns : Codec::columns;

  // Zstd is better for runs and repetitions of values. Try zstd if a quick pass suggests that the
  // values consist mostly of runs and repetitions.
  Bits rounded;
  const auto stored = [&]() -> const Bits& { return stored_bits(bits, rounded); };
  const std::vector<std::byte> planes = level == Level::best || repeats_
                                            ? shuffled(packed(stored()), width)
                                            : std::vector<std::byte>();
  const std::size_t quick = planes.empty() ? 0 : zstd_compress(planes, 1).size();
  const bool may_repeat = !planes.empty() && (level == Level::best || quick * 6 < planes.size());
  std::optional<State> before;
  if (may_repeat) before = state();
  auto predicted = encode_predicted(elements, bits, references, level);
  if (!predicted)
    return under_zstd(elements, stored(),
                      pack_shuffled(shuffled(packed(stored()), width), kQuickZstd));
  EncodedColumn coded{codec, std::move(*predicted)};
  if (!may_repeat || (level != Level::best && quick > 2 * coded.bytes.size())) return coded;
  std::vector<std::byte> bytes = pack_shuffled(planes, level == Level::fast ? kQuickZstd : 19);
  if (bytes.size() >= coded.bytes.size()) return coded;
  restore(std::move(*before));
  return under_zstd(elements, stored(), std::move(bytes));
}

/// Codes the contents `bytes` with the codec shuffled_zstd, updates the state of the column, and
/// returns the coded group.
EncodedColumn ColumnPlanner::under_zstd(const TiledItems& elements, const Bits& bits,
                                        std::vector<std::byte> bytes) {
  column_.forget_history();
  if (sees_other_groups_) keep_values(elements, bits);
  return {Codec::shuffled_zstd, std::move(bytes)};
}

/// Updates the state of the column with the values of a group that was not coded with predictions,
/// since the values of later groups are predicted from this state.
void ColumnPlanner::keep_values(const TiledItems& elements, const Bits& bits) {
  std::size_t offset = 0;
  for_each_tile(elements, [&](const TiledItems::Tile& tile) {
    const auto own = column_.covered(tile);
    for (std::size_t c = 0; c < bits.size(); ++c)
      column_.components()[c].state().keep_values(own,
                                                  std::span(bits[c]).subspan(offset, own.size()));
    offset += own.size();
  });
}

std::size_t ColumnPlanner::covered_count(const TiledItems& elements) const {
  if (elements.blocks.empty()) return elements.items.size();
  return static_cast<std::size_t>(
      std::count_if(elements.blocks.begin(), elements.blocks.end(),
                    [&](std::uint32_t block) { return column_.covers(block); }));
}

/// Returns the bits of the values of `count` elements, one list for each component.
auto ColumnPlanner::bits_of(const std::byte* values, std::size_t stride, std::size_t count) const
    -> Bits {
  const std::size_t width = column_.scalar_width();
  Bits bits(column_.info().components);
  for (std::size_t c = 0; c < bits.size(); ++c) {
    bits[c].resize(count);
    for (std::size_t i = 0; i < count; ++i)
      bits[c][i] = load_scalar(values + i * stride + c * width, width);
  }
  return bits;
}

/// Returns the values as shuffled_zstd stores them. Values of quantized arrays are rounded, so that
/// all codecs restore the same values; `rounded` then receives them.
auto ColumnPlanner::stored_bits(const Bits& bits, Bits& rounded) const -> const Bits& {
  const ArrayInfo& info = column_.info();
  if (!info.quantization.lossy()) return bits;
  if (!rounded.empty()) return rounded;
  rounded = bits;
  for (std::size_t c = 0; c < bits.size(); ++c) round_quantized(info, c, rounded[c]);
  return rounded;
}

/// Returns values, packed without gaps.
std::vector<std::byte> ColumnPlanner::packed(const Bits& bits) const {
  const std::size_t width = column_.scalar_width(), bytes = column_.element_bytes();
  std::vector<std::byte> out(bits[0].size() * bytes);
  for (std::size_t c = 0; c < bits.size(); ++c)
    for (std::size_t i = 0; i < bits[c].size(); ++i)
      store_scalar(out.data() + i * bytes + c * width, bits[c][i], width);
  return out;
}

// --- predicted groups

/// Encodes a group with predictions. If the domains of components would change too often, returns
/// nothing and leaves the column unchanged.
std::optional<std::vector<std::byte>> ColumnPlanner::encode_predicted(const TiledItems& elements,
                                                                      Bits& bits,
                                                                      const Bits& reference,
                                                                      Level level) {
  back_ = copies_among(elements, bits);
  if (back_.empty()) return encode_with_back(elements, bits, reference, level);
  // Encode the group with copies and without copies. Copies need flags, and only the sizes show
  // whether copies save more than their flags cost.
  State before = state();
  const std::vector<DomainAndTable> domains = domains_;
  auto with_copies = encode_with_back(elements, bits, reference, level);
  if (!with_copies) return with_copies;
  State after = state();
  std::vector<DomainAndTable> its_domains = std::exchange(domains_, domains);
  restore(std::move(before));
  --groups_;
  back_.clear();
  auto without = encode_with_back(elements, bits, reference, level);
  if (without && without->size() <= with_copies->size()) return without;
  if (!without) ++groups_;
  restore(std::move(after));
  domains_ = std::move(its_domains);
  return with_copies;
}

/// Returns, for each element that the array covers, the distance to an earlier element with the
/// same value, or 0 if none exists. Returns an empty list if too few elements can be copies.
std::vector<std::uint32_t> ColumnPlanner::copies_among(const TiledItems& elements,
                                                       const Bits& bits) const {
  if (!column_.has_copies()) return {};
  std::vector<std::uint8_t> kinds;
  for (std::size_t i = 0; i < elements.items.size(); ++i)
    if (elements.blocks.empty() || column_.covers(elements.blocks[i]))
      kinds.push_back(kind_and_corner_of(elements.items[i]));
  auto back = find_copies(kinds, bits, column_.history(), CopiedElements<SplitEncoder>::kFarthest);
  const auto none = static_cast<std::size_t>(std::count(back.begin(), back.end(), 0u));
  if ((back.size() - none) * kFewestCopies < back.size() || back.empty()) back.clear();
  return back;
}

/// Does the same as encode_predicted(), using the copies listed in back_.
std::optional<std::vector<std::byte>> ColumnPlanner::encode_with_back(const TiledItems& elements,
                                                                      Bits& bits,
                                                                      const Bits& reference,
                                                                      Level level) {
  const auto components = column_.components();
  // Find the first tile with covered elements.
  std::vector<Neighbourhood> first;
  for_each_tile(elements, [&](const TiledItems::Tile& tile) {
    if (!first.empty()) return;
    const auto own = column_.covered(tile, [&](const Neighbourhood& item) {
      for (auto& component : components) component.state().stand_in(item);
    });
    first.assign(own.begin(), own.end());
  });
  // Trials assign numbers to classes that may never be coded, so save the class numbers.
  const ClassNumbers numbers = column_.class_numbers();
  std::vector<DomainAndTable> domains;
  for (std::size_t c = 0; c < components.size(); ++c)
    domains.push_back(choose_domain(c, elements, bits[c], reference[c], level));
  for (std::size_t c = 0; c < components.size(); ++c)
    if (!components[c].state().may_change_to(domains[c].domain, kMostMovesForEach / 2)) {
      column_.class_numbers() = numbers;
      return std::nullopt;
    }
  const ColumnStyle style = choose_style(first, bits, reference, domains, level);
  column_.class_numbers() = numbers;
  column_.code_head(coder_, style, domains, bits[0].size());
  style_ = column_.style();
  domains_ = std::move(domains);
  ++groups_;

  std::size_t offset = 0;
  for_each_tile(elements, [&](const TiledItems::Tile& tile) {
    const auto own = column_.covered(tile);
    if (!own.empty()) encode_tile(own, offset, bits, reference, level == Level::fast);
    offset += own.size();
  });
  return coder_.finish();
}

/// Encodes a tile. `items`: its elements. `offset`: position of the tile's first element in the
/// group. `hurries`: see ModeWatch.
void ColumnPlanner::encode_tile(std::span<const Neighbourhood> items, std::size_t offset,
                                Bits& bits, const Bits& reference, bool hurries) {
  const auto own_back = part_of(back_, offset, items.size());
  std::vector<std::uint32_t> back(own_back.begin(), own_back.end());
  column_.begin_tile(coder_, items, back);
  for (std::size_t c = 0; c < bits.size(); ++c) {
    ComponentCoder<SplitEncoder>& component = column_.components()[c];
    const auto values = std::span(bits[c]).subspan(offset, items.size());
    const ColumnTile tile =
        column_.tile_of(c, items, part_of(reference[c], offset, items.size()), back);
    component.begin_tile(tile);
    column_.code_tile(coder_, c, tile, values,
                      tiles_.plan(component, tile, values, &watches_[c], hurries));
  }
}

// --- domains and styles

/// Chooses a domain as described in domain_choice.h.
DomainAndTable ColumnPlanner::choose_domain(std::size_t component, const TiledItems& elements,
                                            const std::vector<std::uint64_t>& bits,
                                            const std::vector<std::uint64_t>& reference,
                                            Level level) {
  const ArrayInfo& info = column_.info();
  DomainChooser chooser(column_, {elements, style_, back_});
  const std::vector<std::uint64_t> coded = chooser.coded(bits);
  // The domain of the previous group usually suits this group, too.
  if (level != Level::best && groups_ % kGroupsKept != 0 && domains_[component].table.empty() &&
      still_fits(info, component, domains_[component].domain, coded))
    return domains_[component];
  auto candidates = domain_candidates(info, component, coded);
  if (coded.empty() || (candidates.size() == 1 && !column_.has_earlier_values()))
    return std::move(candidates[0]);
  return chooser.choose(component, bits, reference, std::move(candidates));
}

/// Returns the source of each component: the first component with equal values, otherwise the
/// previous component. Returns nothing if these are the previous components only.
std::vector<std::uint8_t> ColumnPlanner::sources_of(const Bits& bits) const {
  std::vector<std::uint8_t> sources;
  if (!column_.has_earlier_values() || bits.size() < kFewestWithSources) return sources;
  bool differ = false;
  for (std::size_t c = 0; c < bits.size(); ++c) {
    const auto own = bits.begin() + static_cast<std::ptrdiff_t>(c);
    const auto equal = static_cast<std::size_t>(std::find(bits.begin(), own, *own) - bits.begin());
    sources.push_back(
        static_cast<std::uint8_t>(equal < c ? equal : std::max<std::size_t>(c, 1) - 1));
    differ = differ || sources[c] + std::size_t{1} < c;
  }
  if (!differ) sources.clear();
  return sources;
}

/// Returns the style of the group: whether far neighbours and matches are used for prediction. Both
/// take time. At level `best` they are used, and at level `fast` they are not. At other levels,
/// they are used if they save enough bytes in the first tile, and always in the first group of a
/// mesh, since the first tile of that group is not typical.
ColumnStyle ColumnPlanner::choose_style(std::span<const Neighbourhood> first_tile, const Bits& bits,
                                        const Bits& reference,
                                        std::span<const DomainAndTable> domains, Level level) {
  ColumnStyle full;
  full.mixes = level == Level::best && column_.has_tables();
  full.matches = column_.has_tables();
  full.copies = !back_.empty();
  full.sources = full.matches ? sources_of(bits) : std::vector<std::uint8_t>();
  const ColumnStyle lean{Reach::lattice, false, false, full.copies, {}};
  if (level == Level::fast) return lean;
  if (level == Level::best || groups_ == 0 || first_tile.empty()) return full;
  const std::size_t least = size_with(full, first_tile, bits, reference, domains);
  const std::size_t lean_size = size_with(lean, first_tile, bits, reference, domains);
  return lean_size <= least || (lean_size - least) * kWorthFarShare <= lean_size ? lean : full;
}

/// Returns the size that the first tile would have in the given style. The size does not include
/// the heads of the components (domains and tables).
std::size_t ColumnPlanner::size_with(const ColumnStyle& style,
                                     std::span<const Neighbourhood> first_tile, const Bits& bits,
                                     const Bits& reference,
                                     std::span<const DomainAndTable> domains) {
  const auto components = column_.components();
  const TileClasses classes = column_.classify(first_tile, style.known());
  std::vector<CodedTile> coded(components.size());
  std::vector<const CodedTile*> before;
  SplitEncoder head, body;
  for (std::size_t c = 0; c < components.size(); ++c) {
    Trial component(components[c], first_tile, domains[c].domain);
    component->set_style(style);
    component->begin_group(head, domains[c], components.first(c), bits[c].size());
    const auto own = std::span(bits[c]).first(first_tile.size());
    std::vector<std::uint64_t> values(own.begin(), own.end());
    ColumnTile tile{first_tile, classes, before, part_of(reference[c], 0, values.size()),
                    part_of(back_, 0, values.size())};
    if (c > 0) tile.source = before[style.source_of(c)];
    component->begin_tile(tile);
    component->code_tile(body, tile, values, tiles_.plan(*component, tile, values, nullptr, false));
    coded[c] = component->coded_tile();
    before.push_back(&coded[c]);
  }
  return body.finish().size();
}

// --- sizes

/// Returns an estimate of the encoded size. It ignores copies, since whether elements are copies
/// does not depend on their neighbours.
std::uint64_t ColumnPlanner::about_bytes(const TiledItems& elements, const std::byte* values,
                                         std::size_t stride, std::vector<RatedDomain>& rated) {
  const std::size_t count = covered_count(elements);
  if (count == 0) return 0;
  const Bits bits = bits_of(values, stride, count);
  const ClassNumbers numbers = column_.class_numbers();
  back_.clear();
  DomainChooser chooser(column_, {elements, style_, back_});
  double sum = 0;
  for (std::size_t c = 0; c < bits.size(); ++c) {
    if (c == rated.size())
      rated.push_back(
          chooser.choose(c, bits[c], {}, domain_candidates(column_.info(), c, bits[c])));
    else
      chooser.rescale(rated[c], c, bits[c]);
    sum += rated[c].bits;
  }
  column_.class_numbers() = numbers;
  const auto bytes = static_cast<std::uint64_t>(std::max(sum, 0.0) / 8);
  if (!repeats_) return bytes;
  const auto planes = shuffled(packed(bits_of(values, stride, count)), column_.scalar_width());
  return std::min<std::uint64_t>(bytes, zstd_compress(planes, 1).size());
}

std::uint64_t ColumnPlanner::bytes_if_coded(const TiledItems& elements, const std::byte* values,
                                            std::size_t stride, Level level) {
  State before = state();
  const std::vector<DomainAndTable> domains = domains_;
  const std::uint32_t groups = groups_;
  const std::size_t bytes = encode(elements, values, stride, level).bytes.size();
  restore(std::move(before));
  domains_ = domains;
  groups_ = groups;
  return bytes;
}

}  // namespace shm
