#include "shift_segment_encoder.h"

#include <algorithm>
#include <bit>
#include <utility>

#include "bytes/checksum.h"
#include "difference_columns.h"
#include "front/by_slot.h"

namespace shm {
namespace {

using container::StreamKind;

// Lags are noted at one cell in so many, and so many different ones at most.
constexpr std::uint32_t kNoteEvery = 16;
constexpr std::size_t kMostLags = 64;
constexpr std::size_t kLagsTried = 3;

template <class Lags>
void note(Lags& lags, std::uint64_t lag, std::uint64_t weight) {
  if (lag == 0 || lag >= kMostPlaces) return;
  for (auto& it : lags)
    if (it.lag == lag) {
      it.weight += weight;
      return;
    }
  if (lags.size() < kMostLags) lags.push_back({lag, weight});
}

/// The weightiest, ascending.
template <class Lags>
std::vector<std::uint32_t> chosen(Lags lags) {
  std::sort(lags.begin(), lags.end(), [](const auto& a, const auto& b) {
    return a.weight != b.weight ? a.weight > b.weight : a.lag < b.lag;
  });
  if (lags.size() > kLagsTried) lags.resize(kLagsTried);
  std::vector<std::uint32_t> ascending;
  for (const auto& it : lags) ascending.push_back(static_cast<std::uint32_t>(it.lag));
  std::sort(ascending.begin(), ascending.end());
  return ascending;
}

std::uint64_t distance(std::uint64_t a, std::uint64_t b) { return a < b ? b - a : a - b; }

}  // namespace

ShiftSegmentEncoder::ShiftSegmentEncoder(const Schema& schema, const SegmentOptions& options,
                                         const SegmentStart& start)
    : schema_(&schema),
      group_cells_(options.group_cells),
      has_values_(options.values),
      tells_order_(options.tells_order),
      numbered_by_birth_(schema.order != Order::keep),
      start_(start),
      shifts_(schema, start.segment > 0),
      columns_(difference_columns(schema)),
      values_(schema),
      next_cell_(start.first_cell),
      next_vertex_(start.first_vertex),
      next_own_(start.first_vertex) {
  start_group();
}

void ShiftSegmentEncoder::start_group() {
  group_.segment = start_.segment;
  group_.header.first_cell = next_cell_;
  group_.header.first_vertex = next_vertex_;
}

Result<void> ShiftSegmentEncoder::take(const SegmentPiece& piece, std::vector<EncodedGroup>& done) {
  const container::GroupHeader& group = group_.header;
  std::size_t node = 0, vertex = 0, data = 0;
  for (const SegmentPiece::Cell& cell : piece.cells) {
    if (cell.block == SegmentPiece::kLoose) {
      const std::uint64_t number = number_of(piece.vertices[vertex]);
      if (!numbered_by_birth_) shifts_.add_loose(number);
      take_vertex(piece, vertex, number);
      ++group_.header.loose_vertices;
      group_.header.max_active_vertices = std::max(group.max_active_vertices, active_ + 1);
    } else {
      if (group.loose_vertices > 0) flush_group(done);  // they stand last in their group
      code_cell(piece, cell, std::span(piece.nodes).subspan(node, cell.nodes), vertex);
      if (has_values_) values_.add_cell(cell.block, piece.cell_data.data() + data);
      data += values_.cell_bytes(cell.block);
    }
    node += cell.nodes;
    vertex += cell.new_vertices;
    if (group.cells >= group_cells_ || group.decoded_bytes >= kFullGroupBytes ||
        (group.loose_vertices > 0 && group.vertices >= kFullGroupVertices))
      flush_group(done);
  }
  return {};
}

void ShiftSegmentEncoder::end(std::vector<EncodedGroup>& done) {
  const container::GroupHeader& group = group_.header;
  if (group.cells + group.vertices + group.imported_vertices > 0) flush_group(done);
}

void ShiftSegmentEncoder::code_cell(const SegmentPiece& piece, const SegmentPiece::Cell& cell,
                                    std::span<const std::uint32_t> nodes, std::size_t vertex) {
  CellMarks marks;
  marks.block = cell.block;
  marks.last_use = cell.last_use;
  corners_.resize(nodes.size());
  const std::size_t end = vertex + cell.new_vertices;
  for (std::size_t i = 0; i < nodes.size(); ++i) {
    if (vertex < end && piece.vertices[vertex].handle == nodes[i]) {
      const SegmentPiece::Vertex& born = piece.vertices[vertex];
      at_slot(number_of_, nodes[i]) = number_of(born);
      marks.births |= std::uint64_t{1} << i;
      if (born.imported) marks.imports |= std::uint64_t{1} << i;
      take_vertex(piece, vertex++, number_of_[nodes[i]]);
    }
    corners_[i] = number_of_[nodes[i]];
  }
  shifts_.add_cell(marks, corners_);
  cell_blocks_.push_back(cell.block);
  if (tells_order_) group_.cell_numbers.push_back(cell.number);

  container::GroupHeader& group = group_.header;
  if (group.cells % kNoteEvery == 0) note_lags();
  active_ += cell.new_vertices;
  group.max_active_vertices = std::max(group.max_active_vertices, active_);
  for (std::uint64_t left = cell.last_use; left != 0; left &= left - 1) {
    const auto i = static_cast<std::size_t>(std::countr_zero(left));
    bool again = false;  // a vertex may stand at several corners
    for (std::size_t j = 0; j < i; ++j)
      again = again || (nodes[j] == nodes[i] && (cell.last_use >> j & 1) != 0);
    active_ -= again ? 0 : 1;
  }
  group.decoded_bytes += values_.cell_bytes(cell.block) + 8 * nodes.size();
  ++group.cells;
  const BlockInfo& block = schema_->blocks[cell.block];
  group_.hexahedra += block.shape == CellShape::hexahedron && nodes.size() >= 8 ? 1 : 0;
}

/// The number that a vertex is born with.
std::uint64_t ShiftSegmentEncoder::number_of(const SegmentPiece::Vertex& vertex) const {
  if (!numbered_by_birth_) return vertex.number;
  return vertex.imported ? next_import_ : next_own_;
}

void ShiftSegmentEncoder::take_vertex(const SegmentPiece& piece, std::size_t index,
                                      std::uint64_t number) {
  const SegmentPiece::Vertex& vertex = piece.vertices[index];
  container::GroupHeader& group = group_.header;
  group.decoded_bytes += values_.vertex_bytes();
  if (has_values_) {
    born_.push_back(number);
    values_.add_vertex(piece.vertex_values.data() + index * values_.vertex_bytes());
  }
  if (vertex.imported) {
    ++group.imported_vertices;
    ++next_import_;
    if (numbered_by_birth_) group_.imports.push_back({vertex.ticket, 0, {}});
  } else {
    ++group.vertices;
    ++next_own_;
    if (tells_order_) group_.born.push_back({vertex.number, vertex.ticket});
  }
}

// --- lags

void ShiftSegmentEncoder::note_lags() {
  if (corners_.size() >= 8) {
    for (std::size_t along : {1, 3, 4}) note(lags_, distance(corners_[0], corners_[along]), 1);
  } else {
    for (std::size_t i = 1; i < corners_.size(); ++i)
      note(lags_, distance(corners_[0], corners_[i]), 1);
  }
}

/// Cells of rows and layers: how far from one to the next that was said by the same rare shift.
std::vector<std::uint32_t> ShiftSegmentEncoder::cell_lags() const {
  std::array<std::size_t, 256> last{};  // place + 1
  std::vector<Lag> lags;
  const auto symbols = shifts_.symbols();
  for (std::size_t i = 0; i < symbols.size(); ++i) {
    const std::size_t before = std::exchange(last[symbols[i]], i + 1);
    const std::size_t lag = i + 1 - before;
    if (before > 0) note(lags, lag, lag == 1 ? 2 : lag);  // of a row as much as of all its cells
  }
  return chosen(std::move(lags));
}

// --- groups

void ShiftSegmentEncoder::add_stream(const container::StreamEntry& entry,
                                     std::vector<std::byte> bytes) {
  group_.header.streams.push_back(entry);
  group_.header.streams.back().bytes = bytes.size();
  group_.header.streams.back().checksum = checksum(bytes);
  group_.streams.push_back(std::move(bytes));
}

void ShiftSegmentEncoder::add_columns(std::span<const std::uint32_t> by_vertex,
                                      std::span<const std::uint32_t> by_cell) {
  std::vector<std::uint64_t> cells;
  for (std::size_t c = 0; c < columns_.size(); ++c) {
    const bool of_cells = values_.of_cells(c);
    const std::uint32_t array = values_.array(c);
    if (of_cells) {
      cells.clear();
      for (std::size_t i = 0; i < cell_blocks_.size(); ++i)
        if (schema_->array_covers(array, cell_blocks_[i])) cells.push_back(next_cell_ + i);
    }
    const std::span<const std::uint64_t> numbers = of_cells ? cells : born_;
    if (numbers.empty()) continue;
    auto encoded = columns_[c].encode(numbers, values_.values(c), values_.stride(c),
                                      of_cells ? by_cell : by_vertex, scratch_);
    container::StreamEntry entry;
    entry.kind = c == 0 ? StreamKind::geometry : StreamKind::array;
    entry.array = array;
    entry.codec = stream_codec(encoded.codec);
    entry.needs = 1u << static_cast<unsigned>(StreamKind::connectivity);
    add_stream(entry, std::move(encoded.bytes));
  }
}

void ShiftSegmentEncoder::flush_group(std::vector<EncodedGroup>& done) {
  // Lags of cells are told by their symbols, which go with the stream.
  const std::vector<std::uint32_t> by_cell = cell_lags();
  container::StreamEntry connectivity;
  connectivity.kind = StreamKind::connectivity;
  connectivity.codec = container::Codec::shifts;
  add_stream(connectivity, shifts_.finish(scratch_.zstd));
  if (has_values_) add_columns(chosen(lags_), by_cell);
  group_.header.box = values_.box();
  group_.ranges = values_.ranges();
  values_.clear();
  born_.clear();
  cell_blocks_.clear();
  lags_.clear();
  next_cell_ += group_.header.cells;
  next_vertex_ += group_.header.vertices;
  done.push_back(std::exchange(group_, group_like(group_)));
  start_group();
}

}  // namespace shm
