#include "codecs/shifts/shift_segment_encoder.h"

#include <algorithm>
#include <bit>
#include <numeric>
#include <utility>

#include "base/binary.h"
#include "base/lists.h"
#include "codecs/shifts/difference_columns.h"

namespace shm {
namespace {

using container::StreamKind;

// Lags (differences between vertex numbers of a cell) are collected from every kNoteEvery-th cell.
// At most kMostLags different lags are stored, and at most kLagsTried lags are tried.
constexpr std::uint32_t kNoteEvery = 16;
constexpr std::size_t kMostLags = 64;
constexpr std::size_t kLagsTried = 3;
// If a ring is smaller than 2^kFarRingBits places, the encoder enlarges it up to this size, so that
// it covers several layers.
constexpr std::uint32_t kFarRingBits = 15;

template <class Lags>
void note(Lags& lags, std::uint64_t lag, std::uint64_t weight) {
  if (lag == 0 || lag >= kMostPlaces) return;
  for (auto& known : lags)
    if (known.lag == lag) {
      known.weight += weight;
      return;
    }
  if (lags.size() < kMostLags) lags.push_back({lag, weight});
}

/// Returns the kLagsTried lags with the largest weights, in ascending order.
template <class Lags>
std::vector<std::uint32_t> chosen(Lags lags) {
  std::sort(lags.begin(), lags.end(), [](const auto& a, const auto& b) {
    return a.weight != b.weight ? a.weight > b.weight : a.lag < b.lag;
  });
  if (lags.size() > kLagsTried) lags.resize(kLagsTried);
  std::vector<std::uint32_t> ascending;
  for (const auto& noted : lags) ascending.push_back(static_cast<std::uint32_t>(noted.lag));
  std::sort(ascending.begin(), ascending.end());
  return ascending;
}

bool has_static_cell_arrays(const Schema& schema) {
  return std::any_of(schema.arrays.begin(), schema.arrays.end(), [](const ArrayInfo& info) {
    return info.location == Location::cell && !info.per_step;
  });
}

std::uint64_t distance(std::uint64_t a, std::uint64_t b) { return a < b ? b - a : a - b; }

}  // namespace

ShiftSegmentEncoder::ShiftSegmentEncoder(const Schema& schema, const SegmentOptions& options,
                                         const SegmentStart& start)
    : SegmentEncoder(schema, options, start),
      numbered_by_order_(schema.order != Order::keep),
      shifts_(schema, start.segment > 0),
      columns_(difference_columns(schema)),
      decoder_(schema, start.segment > 0),
      neighbours_(schema, true, has_static_cell_arrays(schema)),
      next_own_(start.first_vertex) {
  if (options.values && options.level != Level::fast)
    predicted_ = predicted_columns<ColumnPlanner>(schema, columns_, {});
  for (auto& column : predicted_)
    if (column) column->see_own_groups_only();
  has_rings_ = predicts() || needs_ring(schema);
}

void ShiftSegmentEncoder::encode_unused(const SegmentPiece& piece, std::size_t vertex) {
  begin_element(false);
  const std::uint64_t number = number_of(piece.vertices[vertex]);
  if (!numbered_by_order_) shifts_.add_unused(number);
  take_numbered(piece, vertex, number);
  note_active(active_ + 1);
}

bool ShiftSegmentEncoder::encode_cell(const SegmentPiece& piece, const SegmentPiece::Cell& cell,
                                      const Place& place) {
  begin_element(true);
  const auto nodes = piece.nodes_of(cell, place.node);
  CellMarks marks;
  marks.block = cell.block;
  marks.last_use = cell.last_use;
  corners_.resize(nodes.size());
  std::size_t vertex = place.vertex;
  const std::size_t end = vertex + cell.new_vertices;
  for (std::size_t i = 0; i < nodes.size(); ++i) {
    if (vertex < end && piece.vertices[vertex].handle == nodes[i]) {
      const SegmentPiece::Vertex& added = piece.vertices[vertex];
      at_slot(number_of_, nodes[i]) = number_of(added);
      marks.introduced |= std::uint64_t{1} << i;
      if (added.imported) marks.imports |= std::uint64_t{1} << i;
      take_numbered(piece, vertex++, number_of_[nodes[i]]);
    }
    corners_[i] = number_of_[nodes[i]];
  }
  shifts_.add_cell(marks, corners_);
  cell_blocks_.push_back(cell.block);

  if (group_.header.cells % kNoteEvery == 0) note_lags();
  active_ += cell.new_vertices;
  note_active(active_);
  for (std::uint64_t left = cell.last_use; left != 0; left &= left - 1) {
    const auto i = static_cast<std::size_t>(std::countr_zero(left));
    // True if an earlier corner has the same vertex and both corners are marked as last use
    bool again = false;
    for (std::size_t j = 0; j < i; ++j)
      again = again || (nodes[j] == nodes[i] && (cell.last_use >> j & 1) != 0);
    active_ -= again ? 0 : 1;
  }
  return true;
}

/// Returns the number that shifts use for a new vertex: with Order::keep the number in the source
/// mesh, otherwise the next stream number or import number.
std::uint64_t ShiftSegmentEncoder::number_of(const SegmentPiece::Vertex& vertex) const {
  if (!numbered_by_order_) return vertex.number;
  return vertex.imported ? next_import_ : next_own_;
}

void ShiftSegmentEncoder::take_numbered(const SegmentPiece& piece, std::size_t index,
                                        std::uint64_t number) {
  const SegmentPiece::Vertex& vertex = piece.vertices[index];
  if (options_.values) push_tightly(introduced_, number);
  take_vertex(piece, index);
  ++(vertex.imported ? next_import_ : next_own_);
  if (vertex.imported && numbered_by_order_) group_.imports.push_back({vertex.ticket, 0, {}});
}

// --- lags

void ShiftSegmentEncoder::note_lags() {
  std::uint64_t spread = 0;
  for (std::uint64_t number : corners_) spread = std::max(spread, distance(corners_[0], number));
  ++spreads_[static_cast<std::size_t>(std::bit_width(spread))];
  if (corners_.size() >= 8) {
    for (std::size_t along : {1, 3, 4}) note(lags_, distance(corners_[0], corners_[along]), 1);
  } else {
    for (std::size_t i = 1; i < corners_.size(); ++i)
      note(lags_, distance(corners_[0], corners_[i]), 1);
  }
}

/// Estimates the lengths of rows and layers of cells, and returns them as lags (differences between
/// cell numbers). A lag is the distance from a cell to the previous cell with the same shift. The
/// shift to the first cell of a row rarely occurs within rows, so the lag of such a cell is the
/// length of a row. The same applies to layers.
std::vector<std::uint32_t> ShiftSegmentEncoder::cell_lags() const {
  std::array<std::size_t, 256>
      last{};  // for each symbol: the position of its most recent occurrence, plus 1
  std::vector<Lag> lags;
  const auto symbols = shifts_.symbols();
  for (std::size_t i = 0; i < symbols.size(); ++i) {
    const std::size_t before = std::exchange(last[symbols[i]], i + 1);
    const std::size_t lag = i + 1 - before;
    // A lag n > 1 is the length of a row of n cells, so it counts n times.
    if (before > 0) note(lags, lag, lag == 1 ? 2 : lag);
  }
  return chosen(std::move(lags));
}

// --- groups

void ShiftSegmentEncoder::begin_element(bool is_cell) {
  if (!predicts() || !tile_ends_.before(is_cell, group_.header.decoded_bytes)) return;
  vertices_.tile_begin.push_back(introduced_.size());
  cells_.tile_begin.push_back(cell_blocks_.size());
}

/// Returns the binary logarithm of the ring size. The size is chosen so that for 19 of 20 sampled
/// cells, the ring covers the range of the cell's vertex numbers. A small ring is enlarged so that
/// it also covers the elements two and three layers back.
std::uint32_t ShiftSegmentEncoder::ring_bits() const {
  const std::uint32_t noted = std::accumulate(spreads_.begin(), spreads_.end(), 0u);
  std::uint32_t bits = 1, within = spreads_[0];
  while (bits < spreads_.size() && (within += spreads_[bits]) * 20ull < noted * 19ull) ++bits;
  return std::max(std::min(std::max(bits, std::min(bits + 2, kFarRingBits)),
                           most_ring_bits(group_.header.cells)),
                  neighbours_.ring_bits());
}

void ShiftSegmentEncoder::find_neighbours(std::span<const std::byte> shifts) {
  const container::GroupHeader& group = group_.header;
  neighbours_.begin_group(ring_bits(), group.cells);
  if (!predicts()) return;
  const std::size_t vertices = introduced_.size();
  vertices_.items.reserve(vertices);
  if (has_static_cell_arrays(*schema_)) cells_.items.reserve(group.cells);
  decoder_.begin_group(shifts, group.cells, ~std::uint64_t{0}, unpacking_);
  std::vector<std::uint64_t> numbers(kShiftedCellsAtOnce * decoder_.most_nodes());
  for (std::size_t left = group.cells; left > 0;) {
    const auto [marks, count] =
        decoder_.next_cells(numbers.data(), std::min(left, kShiftedCellsAtOnce));
    // `marks` is null only if memory ran out while the bitstream was written, which made it
    // invalid.
    if (marks == nullptr) return;
    const std::size_t nodes = count * decoder_.nodes(marks->block);
    neighbours_.add_cells(*marks, std::span(numbers).first(nodes), count, vertices_.items,
                          cells_.items);
    left -= count;
  }
  for (std::size_t v = vertices - static_cast<std::size_t>(group.unused_vertices); v < vertices;
       ++v)
    neighbours_.add_unused(introduced_[v], vertices_.items);
  cells_.blocks = cell_blocks_;
}

/// Returns the numbers of the cells that have a value in column `column`.
std::vector<std::uint64_t> ShiftSegmentEncoder::numbers_of_cells(std::size_t column) const {
  std::vector<std::uint64_t> cells;
  for (std::size_t i = 0; i < cell_blocks_.size(); ++i)
    if (schema_->array_covers(values_.array(column), cell_blocks_[i]))
      cells.push_back(group_.header.first_cell + i);
  return cells;
}

void ShiftSegmentEncoder::add_columns() {
  for (std::size_t c = 0; c < columns_.size(); ++c) {
    const auto cells = values_.of_cells(c) ? numbers_of_cells(c) : std::vector<std::uint64_t>();
    const std::span<const std::uint64_t> numbers = values_.of_cells(c) ? cells : introduced_;
    if (!numbers.empty()) add_column(c, numbers);
  }
}

/// Encodes the values of one column. `numbers`: the numbers of the elements that have a value in
/// this column.
void ShiftSegmentEncoder::add_column(std::size_t c, std::span<const std::uint64_t> numbers) {
  const bool of_cells = values_.of_cells(c);
  const ColumnValues own = values_of(c);
  if (predicts() && predicted_[c]) {
    predicted_[c]->make_room(neighbours_.slots());
    auto encoded = predicted_[c]->encode(of_cells ? cells_ : vertices_, own.values, own.stride,
                                         options_.level);
    if (encoded.codec == Codec::shuffled_zstd) columns_[c].forget();
    return add_values(c, own, encoded.codec, std::move(encoded.bytes));
  }
  auto encoded = columns_[c].encode(numbers, own.values, own.stride,
                                    of_cells ? by_cell_ : by_vertex_, scratch_, packing_);
  add_values(c, own, encoded.codec, std::move(encoded.bytes));
}

void ShiftSegmentEncoder::choose_lags() {
  by_vertex_ = chosen(lags_);
  by_cell_ = cell_lags();
}

void ShiftSegmentEncoder::add_size_at_hand(SegmentSize& size) {
  size.add(StreamKind::connectivity, 1 + shifts_.packed(packing_).size());
}

std::uint64_t ShiftSegmentEncoder::values_at_hand(RatedDomains* rated) {
  // Save the state at the beginning of the group. The state is restored below, because the group
  // will be coded again.
  const ShiftDecoder decoder = decoder_;
  const ShiftNeighbours neighbours = neighbours_;
  if (has_rings_) find_neighbours(shifts_.packed(packing_));
  choose_lags();
  std::uint64_t bytes = 0;
  for (std::size_t c = 0; c < columns_.size(); ++c) {
    const bool of_cells = values_.of_cells(c);
    const ColumnValues own = values_of(c);
    if (predicts() && predicted_[c]) {
      ColumnPlanner& column = *predicted_[c];
      column.make_room(neighbours_.slots());
      const TiledItems& elements = of_cells ? cells_ : vertices_;
      bytes += rated ? column.about_bytes(elements, own.values, own.stride, (*rated)[c])
                     : column.bytes_if_coded(elements, own.values, own.stride, options_.level);
      continue;
    }
    const auto numbers = of_cells ? numbers_of_cells(c) : introduced_;
    DifferenceColumn column = columns_[c];
    if (!numbers.empty())
      bytes += column
                   .encode(numbers, own.values, own.stride, of_cells ? by_cell_ : by_vertex_,
                           scratch_, packing_)
                   .bytes.size();
  }
  decoder_ = decoder;
  neighbours_ = neighbours;
  vertices_.items.clear();
  cells_.items.clear();
  cells_.blocks.clear();
  return bytes;
}

void ShiftSegmentEncoder::encode_streams() {
  choose_lags();  // call this before finish(): choose_lags() reads the symbols, which finish()
                  // clears
  const std::vector<std::byte> shifts = shifts_.finish(packing_);
  if (has_rings_) find_neighbours(shifts);
  ByteWriter out;
  out.put_u8(static_cast<std::uint8_t>(has_rings_ ? neighbours_.ring_bits() : 0));
  out.put_bytes(shifts);
  container::StreamEntry connectivity;
  connectivity.kind = StreamKind::connectivity;
  connectivity.codec = container::Codec::shifts;
  add_stream(connectivity, std::move(out.bytes));
  if (options_.values) add_columns();
  introduced_.clear();
  cell_blocks_.clear();
  vertices_.clear();
  cells_.clear();
  lags_.clear();
  spreads_ = {};
}

}  // namespace shm
