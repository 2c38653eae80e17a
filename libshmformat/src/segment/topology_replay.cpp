#include "segment/topology_replay.h"

#include <algorithm>
#include <bit>
#include <string>
#include <utility>

#include "bytes/lists.h"
#include "segment/mesh_streams.h"
#include "shifts/shift_neighbours.h"
#include "shifts/shifts.h"

namespace shm {

ReplayWants wants_of_steps(const Schema& schema) {
  ReplayWants wants;
  for (const ArrayInfo& info : schema.arrays)
    if (info.per_step) (info.location == Location::point ? wants.vertices : wants.cells) = true;
  return wants;
}

/// What the coders of a segment carry from group to group.
struct TopologyReplay::Segment {
  /// Where cells are shifts.
  struct Shifts {
    Shifts(const Schema& schema, bool may_import, const ReplayWants& wants)
        : cells(schema, may_import), neighbours(schema, wants.vertices, wants.cells) {}
    ShiftDecoder cells;
    ShiftNeighbours neighbours;
    std::vector<std::uint64_t> numbers;  // of the nodes of the cells at hand
    Zstd zstd;
  };

  Segment(const Schema& schema, bool of_cells, std::uint64_t first_cell)
      : connectivity(schema), cell_numbers(schema, first_cell), finder(of_cells) {}

  Connectivity<RangeDecoder> connectivity;
  VertexNumbers<RangeDecoder> numbers;
  CellNumbers<RangeDecoder> cell_numbers;
  ImportFlags<RangeDecoder> imports;
  NeighbourFinder finder;
  std::unique_ptr<Shifts> shifts;
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
        cell_numbers_(group.cell_numbers),
        numbers_(group.vertex_numbers),
        imports_(group.imports) {}

  /// False when the bytes are damaged, or the neighbourhoods are too many.
  bool run() {
    out_->vertices.clear();
    out_->cells.clear();
    out_->vertex_numbers.clear();
    out_->cell_numbers.clear();
    if (segment_->shifts) return run_shifts();
    for (std::uint32_t c = 0; c < group_->cells; ++c)
      if (!cell()) return false;
    while (own_ < group_->vertices)
      if (!loose()) return false;
    out_->slots = segment_->slots;
    return own_ == group_->vertices && bytes_ == group_->decoded_bytes;
  }

 private:
  bool cell();
  bool loose();
  void new_vertices();
  bool run_shifts();
  bool shifted_cells();
  bool shifted_cell(const CellMarks& marks, std::span<const std::uint64_t> numbers);
  bool shifted_loose();
  void begin_element(bool is_cell);
  void add_vertex(const Neighbourhood& item, std::uint64_t number, bool imported);
  void count_vertex(std::uint64_t number, bool imported);
  const ReplayWants& wants() const { return replay_->wants_; }
  bool finds() const { return wants().vertices || wants().cells; }
  bool keeps_numbers() const { return replay_->schema_->order == Order::keep; }
  bool is_small() const { return out_->bytes() <= replay_->most_bytes_; }
  std::uint64_t& number_of(std::uint32_t slot) { return at_slot(segment_->number, slot); }

  const TopologyReplay* replay_;
  Segment* segment_;
  const Group* group_;
  GroupElements* out_;
  RangeDecoder symbols_, corner_order_, cell_numbers_, numbers_, imports_;
  std::uint64_t own_ = 0;
  std::uint32_t cells_ = 0;  // of shifts
  TileEnds tile_ends_;
  std::uint64_t bytes_ = 0;  // of corners and static values
};

bool TopologyReplay::Replayed::cell() {
  begin_element(true);
  CellTopology& it = segment_->cell;
  Connectivity<RangeDecoder>& connectivity = segment_->connectivity;
  if (!connectivity.code_cell(symbols_, corner_order_, it)) return false;
  const std::uint64_t active = connectivity.surface().active_vertices();
  if (active > group_->max_active_vertices) return false;
  const Schema& schema = *replay_->schema_;
  bytes_ += 8 * it.slots.size() + (*replay_->cell_bytes_)[it.block];
  if (bytes_ + it.new_positions.size() * replay_->vertex_bytes_ > group_->decoded_bytes)
    return false;
  const bool as_stored = schema.corner_order || schema.blocks[it.block].nodes_per_cell != 8;
  if (finds()) segment_->finder.begin_cell(it, as_stored, active);
  new_vertices();
  if (wants().cells) {
    push_tightly(out_->cells.items, segment_->finder.cell(it, Reach::farther));
    segment_->slots = std::max(segment_->slots, out_->cells.items.back().self + 1);
  }
  if (wants().cells || wants().cell_numbers) out_->cells.blocks.push_back(it.block);
  if (wants().cell_numbers)
    out_->cell_numbers.push_back(segment_->cell_numbers.code(cell_numbers_, 0));
  if (finds()) segment_->finder.end_cell(it);
  connectivity.finish_cell(it);
  return is_small();
}

void TopologyReplay::Replayed::new_vertices() {
  const CellTopology& it = segment_->cell;
  // Unless they are asked for, numbers matter only to a coder that says hexahedra by them.
  const bool numbered = wants().vertex_numbers && keeps_numbers();
  if (numbered || segment_->connectivity.codes_numbers())
    code_vertex_numbers(segment_->connectivity, segment_->numbers, numbers_, it,
                        [&](std::uint32_t p) -> std::uint64_t& { return number_of(it.slots[p]); });
  const bool may_import = group_->segment > 0;
  if (may_import) segment_->imports.begin_cell(it);
  // Where vertices are not asked for, the finder looks no farther than cells need.
  const Reach reach = wants().vertices ? Reach::farther : Reach::lattice;
  for (std::uint32_t position : it.new_positions)
    add_vertex(finds() ? segment_->finder.vertex(it, position, reach) : Neighbourhood(),
               numbered ? number_of(it.slots[position]) : group_->first_vertex + own_,
               may_import && segment_->imports.code(imports_, it, position, false));
}

void TopologyReplay::Replayed::add_vertex(const Neighbourhood& item, std::uint64_t number,
                                          bool imported) {
  count_vertex(number, imported);
  if (!wants().vertices) return;
  push_tightly(out_->vertices.items, item);
  segment_->slots = std::max(segment_->slots, item.self + 1);
}

void TopologyReplay::Replayed::count_vertex(std::uint64_t number, bool imported) {
  bytes_ += replay_->vertex_bytes_;
  own_ += imported ? 0 : 1;
  if (wants().vertex_numbers && !imported) out_->vertex_numbers.push_back(number);
  if (wants().vertices && group_->segment > 0) out_->vertices.blocks.push_back(imported ? 1 : 0);
}

bool TopologyReplay::Replayed::loose() {
  if (bytes_ + replay_->vertex_bytes_ > group_->decoded_bytes) return false;
  begin_element(false);
  Connectivity<RangeDecoder>& connectivity = segment_->connectivity;
  const std::uint32_t slot = connectivity.add_loose_vertex();
  std::uint64_t number = group_->first_vertex + own_;
  if (keeps_numbers()) number = segment_->numbers.code_loose(numbers_, slot, 0);
  add_vertex(finds() ? segment_->finder.isolated(slot) : Neighbourhood(), number, false);
  connectivity.remove_loose_vertex(slot);
  return is_small();
}

// --- cells that are shifts

bool TopologyReplay::Replayed::run_shifts() {
  Segment::Shifts& shifts = *segment_->shifts;
  ByteReader in(group_->connectivity);
  const std::uint8_t ring_bits = in.get_u8();
  if (!in.ok() || (finds() && ring_bits == 0) ||
      !shifts.neighbours.begin_group(ring_bits, group_->cells))
    return false;
  // As a SegmentDecoder allows it.
  const std::uint64_t most = 3 * std::min(group_->decoded_bytes, std::uint64_t{1} << 56) +
                             64 * std::uint64_t{group_->cells};
  if (!shifts.cells.begin_group(in.get_bytes(in.left()), group_->cells, most, shifts.zstd))
    return false;
  for (cells_ = 0; cells_ < group_->cells;)
    if (!shifted_cells()) return false;
  while (own_ < group_->vertices)
    if (!shifted_loose()) return false;
  if (finds()) out_->slots = shifts.neighbours.slots();
  return own_ == group_->vertices && bytes_ == group_->decoded_bytes && shifts.cells.at_end();
}

/// Some that are said alike.
bool TopologyReplay::Replayed::shifted_cells() {
  Segment::Shifts& shifts = *segment_->shifts;
  shifts.numbers.resize(kShiftedCellsAtOnce * shifts.cells.most_nodes());
  const auto [marks, count] = shifts.cells.next_cells(
      shifts.numbers.data(), std::min<std::size_t>(group_->cells - cells_, kShiftedCellsAtOnce));
  if (marks == nullptr) return false;
  const std::size_t nodes = shifts.cells.nodes(marks->block);
  for (std::size_t c = 0; c < count; ++c)
    if (!shifted_cell(*marks, std::span(shifts.numbers).subspan(c * nodes, nodes))) return false;
  return is_small();
}

bool TopologyReplay::Replayed::shifted_cell(const CellMarks& marks,
                                            std::span<const std::uint64_t> numbers) {
  begin_element(true);
  segment_->shifts->neighbours.add_cells(marks, numbers, 1, out_->vertices.items,
                                         out_->cells.items);
  for (std::uint64_t left = marks.introduced; left != 0; left &= left - 1) {
    const auto i = static_cast<std::size_t>(std::countr_zero(left));
    count_vertex(numbers[i], (marks.imports >> i & 1) != 0);
  }
  if (wants().cells || wants().cell_numbers) out_->cells.blocks.push_back(marks.block);
  if (wants().cell_numbers) out_->cell_numbers.push_back(group_->first_cell + cells_);
  ++cells_;
  bytes_ += 8 * numbers.size() + (*replay_->cell_bytes_)[marks.block];
  return bytes_ <= group_->decoded_bytes;
}

bool TopologyReplay::Replayed::shifted_loose() {
  if (bytes_ + replay_->vertex_bytes_ > group_->decoded_bytes) return false;
  begin_element(false);
  const auto number = keeps_numbers() ? segment_->shifts->cells.next_isolated()
                                      : std::optional(group_->first_vertex + own_);
  if (!number) return false;
  segment_->shifts->neighbours.add_isolated(*number, out_->vertices.items);
  count_vertex(*number, false);
  return is_small();
}

/// Tiles are those of the static arrays.
void TopologyReplay::Replayed::begin_element(bool is_cell) {
  if (!tile_ends_.before(is_cell, bytes_)) return;
  out_->vertices.tile_begin.push_back(out_->vertices.items.size());
  out_->cells.tile_begin.push_back(out_->cells.items.size());
}

// --- groups

TopologyReplay::TopologyReplay(const Schema& schema, std::uint64_t most_bytes,
                               const ReplayWants& wants, std::size_t most_kept,
                               CellBytes cell_bytes)
    : schema_(&schema),
      most_bytes_(most_bytes),
      wants_(wants),
      most_kept_(most_kept),
      vertex_bytes_(3 * scalar_bytes(schema.coordinate_type) + point_data_bytes(schema)),
      cell_bytes_(cell_bytes != nullptr
                      ? std::move(cell_bytes)
                      : std::make_shared<const std::vector<std::size_t>>(cell_data_bytes(schema))) {
}
TopologyReplay::~TopologyReplay() = default;

bool TopologyReplay::needs(const container::GroupHeader& header,
                           const container::StreamEntry& stream) const {
  using container::StreamKind;
  const bool keep = schema_->order == Order::keep;
  const container::StreamEntry* const first = header.streams.data();
  switch (stream.kind) {
    case StreamKind::connectivity:
    case StreamKind::corner_order:
    case StreamKind::imports: return true;
    case StreamKind::cell_numbers: return wants_.cell_numbers && keep && schema_->delay > 0;
    case StreamKind::vertex_numbers:
      // A group without cells does not tell whether its segment says hexahedra by numbers.
      return keep && (wants_.vertex_numbers || header.cells == 0 ||
                      (first->kind == StreamKind::connectivity &&
                       first->codec == container::Codec::replay));
    default: return false;
  }
}

void TopologyReplay::add_group(std::uint32_t segment, const container::GroupHeader& header,
                               std::span<const std::span<const std::byte>> streams) {
  using container::StreamKind;
  if (!wants_.any()) return;
  Group& group = groups_.emplace_back();
  group.segment = segment;
  group.cells = header.cells;
  group.first_cell = header.first_cell;
  group.first_vertex = header.first_vertex;
  group.vertices = header.vertices;
  group.max_active_vertices = header.max_active_vertices;
  group.decoded_bytes = header.decoded_bytes;
  cells_in_all_ += header.cells;
  vertices_in_all_ += header.vertices + header.imported_vertices;
  for (std::size_t s = 0; s < header.streams.size() && s < streams.size(); ++s) {
    const container::StreamEntry& entry = header.streams[s];
    if (entry.kind == StreamKind::connectivity) group.codec = entry.codec;
    if (!needs(header, entry)) continue;
    std::vector<std::byte>& to = entry.kind == StreamKind::connectivity     ? group.connectivity
                                 : entry.kind == StreamKind::corner_order   ? group.corner_order
                                 : entry.kind == StreamKind::cell_numbers   ? group.cell_numbers
                                 : entry.kind == StreamKind::vertex_numbers ? group.vertex_numbers
                                                                            : group.imports;
    to.assign(streams[s].begin(), streams[s].end());
  }
}

Result<std::uint64_t> TopologyReplay::count(std::uint32_t array, std::size_t group) {
  if (schema_->arrays[array].location == Location::point) return groups_[group].vertices;
  if (schema_->arrays[array].blocks.empty()) return groups_[group].cells;
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
    segment_ = std::make_unique<Segment>(*schema_, wants_.cells, group.first_cell);
  bool good = true;
  if (group.codec && !std::exchange(segment_->codec_known, true)) {
    const auto codec = connectivity_codec(*group.codec);
    // As a SegmentDecoder takes them: shifts are not for all schemas.
    good = codec && (*codec != ConnectivityCodec::shifts || takes_shifts(*schema_));
    if (good && *codec == ConnectivityCodec::shifts)
      segment_->shifts = std::make_unique<Segment::Shifts>(*schema_, group.segment > 0, wants_);
    else if (good)
      segment_->connectivity.set_codec(*codec);
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

void TopologyReplay::rest() {
  segment_.reset();
  elements_ = {};
  has_elements_ = false;
}

/// At least so much is told of all groups.
std::uint64_t TopologyReplay::expected_bytes() const {
  const std::uint64_t cell = (wants_.cells ? sizeof(Neighbourhood) : 0) +
                             (wants_.cell_numbers ? sizeof(std::uint64_t) : 0);
  const std::uint64_t vertex = (wants_.vertices ? sizeof(Neighbourhood) : 0) +
                               (wants_.vertex_numbers ? sizeof(std::uint64_t) : 0);
  std::uint64_t bytes = 0;
  for (const Group& group : groups_) {
    bytes += group.cells * cell;
    // A lying group may state more vertices than there can be numbers.
    if (vertex > 0 && group.vertices > most_kept_) return group.vertices;
    bytes += group.vertices * vertex;
    if (bytes > most_kept_) break;
  }
  return bytes;
}

/// Keeps the elements of the group; none at all when they are, or will be, too many.
void TopologyReplay::keep() {
  if (kept_.empty()) keeps_ = expected_bytes() <= most_kept_;
  kept_bytes_ += elements_.bytes();
  keeps_ = keeps_ && kept_bytes_ <= most_kept_;
  if (keeps_) {
    kept_.push_back(std::move(elements_));
    has_elements_ = false;
  } else {
    let_go(kept_);
  }
}

}  // namespace shm
