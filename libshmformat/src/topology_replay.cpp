#include "topology_replay.h"

#include <algorithm>
#include <string>
#include <utility>

#include "mesh_streams.h"

namespace shm {
namespace {

/// Neighbourhoods of a whole mesh are kept while they take less than this.
constexpr std::size_t kMostKept = std::size_t{64} << 20;

}  // namespace

/// What the coders of a segment carry from group to group.
struct TopologyReplay::Segment {
  Segment(const Schema& schema, bool of_cells) : connectivity(schema), finder(of_cells) {}

  Connectivity<RangeDecoder> connectivity;
  VertexNumbers<RangeDecoder> numbers;
  ImportFlags<RangeDecoder> imports;
  NeighbourFinder finder;
  std::vector<std::uint64_t> number;  // by vertex slot, where they are said
  CellTopology cell;
  bool codec_known = false;
  std::uint32_t slots = 0;
};

/// A group while it is told again.
class TopologyReplay::Replayed {
 public:
  Replayed(const TopologyReplay& replay, Segment& segment, const Group& group, GroupElements& out)
      : replay_(&replay),
        segment_(&segment),
        group_(&group),
        out_(&out),
        symbols_(group.connectivity),
        corner_order_(group.corner_order),
        numbers_(group.vertex_numbers),
        imports_(group.imports) {}

  /// False when the bytes are damaged, or the neighbourhoods are too many.
  bool run() {
    out_->vertices.clear();
    out_->cells.clear();
    for (std::uint32_t c = 0; c < group_->cells; ++c)
      if (!cell()) return false;
    while (own_ < group_->vertices)
      if (!loose()) return false;
    out_->slots = segment_->slots;
    return own_ == group_->vertices;
  }

 private:
  bool cell();
  bool loose();
  void new_vertices();
  void begin_element(bool is_cell);
  void add_vertex(const Neighbourhood& item, bool imported);
  bool is_small() const { return out_->bytes() <= replay_->most_bytes_; }
  std::uint64_t& number_of(std::uint32_t slot) {
    auto& numbers = segment_->number;
    if (slot >= numbers.size())
      numbers.resize(std::max<std::size_t>(std::size_t{slot} + 1, numbers.size() * 2));
    return numbers[slot];
  }

  const TopologyReplay* replay_;
  Segment* segment_;
  const Group* group_;
  GroupElements* out_;
  RangeDecoder symbols_, corner_order_, numbers_, imports_;
  std::uint64_t own_ = 0;
  TileEnds tile_ends_;
  std::uint64_t bytes_ = 0;  // of corners and static values
};

bool TopologyReplay::Replayed::cell() {
  begin_element(true);
  CellTopology& it = segment_->cell;
  Connectivity<RangeDecoder>& connectivity = segment_->connectivity;
  if (!connectivity.code_cell(symbols_, corner_order_, it)) return false;
  const Schema& schema = *replay_->schema_;
  const bool as_stored = schema.corner_order || schema.blocks[it.block].nodes_per_cell != 8;
  segment_->finder.begin_cell(it, as_stored, connectivity.surface().active_vertices());
  new_vertices();
  if (replay_->of_cells_) {
    out_->cells.items.push_back(segment_->finder.cell(it, Reach::farther));
    out_->cells.blocks.push_back(it.block);
    segment_->slots = std::max(segment_->slots, out_->cells.items.back().self + 1);
  }
  segment_->finder.end_cell(it);
  bytes_ += 8 * it.slots.size() + replay_->cell_bytes_[it.block];
  connectivity.finish_cell(it);
  return is_small();
}

void TopologyReplay::Replayed::new_vertices() {
  const CellTopology& it = segment_->cell;
  // Numbers matter only to a coder that says hexahedra by them.
  if (segment_->connectivity.says_numbers())
    code_vertex_numbers(segment_->connectivity, segment_->numbers, numbers_, it,
                        [&](std::uint32_t p) -> std::uint64_t& { return number_of(it.slots[p]); });
  const bool may_import = group_->segment > 0;
  if (may_import) segment_->imports.begin_cell(it);
  for (std::uint32_t position : it.new_positions)
    add_vertex(segment_->finder.vertex(it, position, Reach::farther),
               may_import && segment_->imports.code(imports_, it, position, false));
}

void TopologyReplay::Replayed::add_vertex(const Neighbourhood& item, bool imported) {
  bytes_ += replay_->vertex_bytes_;
  own_ += imported ? 0 : 1;
  if (!replay_->of_vertices_) return;
  out_->vertices.items.push_back(item);
  if (group_->segment > 0) out_->vertices.blocks.push_back(imported ? 1 : 0);
  segment_->slots = std::max(segment_->slots, item.self + 1);
}

bool TopologyReplay::Replayed::loose() {
  begin_element(false);
  Connectivity<RangeDecoder>& connectivity = segment_->connectivity;
  const std::uint32_t slot = connectivity.add_loose_vertex();
  if (replay_->schema_->order == Order::keep) segment_->numbers.code_loose(numbers_, slot, 0);
  add_vertex(segment_->finder.loose(slot), false);
  connectivity.remove_loose_vertex(slot);
  return is_small();
}

/// Tiles are those of the static arrays.
void TopologyReplay::Replayed::begin_element(bool is_cell) {
  if (!tile_ends_.before(is_cell, bytes_)) return;
  out_->vertices.tile_begin.push_back(out_->vertices.items.size());
  out_->cells.tile_begin.push_back(out_->cells.items.size());
}

// --- groups

TopologyReplay::TopologyReplay(const Schema& schema, std::uint64_t most_bytes)
    : schema_(&schema),
      most_bytes_(most_bytes),
      vertex_bytes_(3 * scalar_bytes(schema.coordinate_type) + point_data_bytes(schema)),
      cell_bytes_(cell_data_bytes(schema)) {
  for (const ArrayInfo& info : schema.arrays)
    if (info.per_step) (info.location == Location::point ? of_vertices_ : of_cells_) = true;
}
TopologyReplay::~TopologyReplay() = default;

void TopologyReplay::add_group(std::uint32_t segment, const container::GroupHeader& header,
                               std::span<const std::span<const std::byte>> streams) {
  using container::StreamKind;
  if (!of_vertices_ && !of_cells_) return;
  Group& group = groups_.emplace_back();
  group.segment = segment;
  group.cells = header.cells;
  group.vertices = header.vertices;
  bool by_number = false;
  for (std::size_t s = 0; s < header.streams.size() && s < streams.size(); ++s) {
    const auto keep = [&](std::vector<std::byte>& to) {
      to.assign(streams[s].begin(), streams[s].end());
    };
    switch (header.streams[s].kind) {
      case StreamKind::connectivity:
        group.codec = header.streams[s].codec;
        by_number = schema_->order == Order::keep && group.codec == container::Codec::replay;
        keep(group.connectivity);
        break;
      case StreamKind::corner_order: keep(group.corner_order); break;
      case StreamKind::vertex_numbers:
        if (by_number || group.cells == 0) keep(group.vertex_numbers);
        break;
      case StreamKind::imports: keep(group.imports); break;
      default: break;
    }
  }
}

Result<std::uint64_t> TopologyReplay::count(std::uint32_t array, std::size_t group) {
  if (schema_->arrays[array].location == Location::point) return groups_[group].vertices;
  if (!groups_[group].counted)
    if (auto good = elements(group); !good) return good.error();
  std::uint64_t cells = 0;
  for (const auto& [block, count] : groups_[group].block_cells)
    if (schema_->array_covers(array, block)) cells += count;
  return cells;
}

Result<const GroupElements*> TopologyReplay::elements(std::size_t group) {
  if (group < kept_.size()) return &kept_[group];
  const std::uint32_t segment = groups_[group].segment;
  if (has_elements_ && group + 1 == next_) return &elements_;
  if (!segment_ || next_ > group || groups_[next_].segment != segment ||
      groups_[next_ - 1].segment != segment) {
    next_ = group;  // back or on to the first group of its segment
    while (next_ > 0 && groups_[next_ - 1].segment == segment) --next_;
  }
  while (next_ <= group)
    if (auto good = replay_next(); !good) return good.error();
  return group < kept_.size() ? &kept_[group] : &elements_;
}

Result<void> TopologyReplay::replay_next() {
  const std::size_t number = next_++;
  Group& group = groups_[number];
  if (number == 0 || groups_[number - 1].segment != group.segment)
    segment_ = std::make_unique<Segment>(*schema_, of_cells_);
  bool good = true;
  if (group.codec && !std::exchange(segment_->codec_known, true)) {
    const auto codec = connectivity_codec(*group.codec);
    good = codec && *codec != ConnectivityCodec::shifts;  // which know no neighbours
    if (good) segment_->connectivity.set_codec(*codec);
  }
  has_elements_ = good && Replayed(*this, *segment_, group, elements_).run();
  if (!has_elements_) {
    segment_.reset();
    const bool damaged = elements_.bytes() <= most_bytes_;
    return Error{damaged ? ErrorCode::corrupt : ErrorCode::over_limit,
                 "group " + std::to_string(number) +
                     (damaged ? " cannot be told again"
                              : " has more elements than " + std::to_string(most_bytes_) +
                                    " bytes tell the neighbourhoods of"),
                 "step values",
                 kNoOffset,
                 {}};
  }
  if (!std::exchange(group.counted, true))
    for (std::uint32_t block : elements_.cells.blocks) ++group.block_cells[block];
  if (keeps_ && number == kept_.size()) keep();
  return {};
}

/// Keeps the elements of the group, or, when they are too many by now, none at all.
void TopologyReplay::keep() {
  kept_bytes_ += elements_.bytes();
  keeps_ = kept_bytes_ <= kMostKept;
  if (keeps_) {
    kept_.push_back(std::move(elements_));
    has_elements_ = false;
  } else {
    kept_ = {};
  }
}

}  // namespace shm
