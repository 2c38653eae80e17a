#include "codecs/shifts/shift_group_decoder.h"

#include <algorithm>
#include <bit>
#include <string>
#include <utility>

#include "base/errors.h"
#include "codecs/shifts/difference_columns.h"

namespace shm {

using container::StreamKind;

namespace {

bool has_bit(std::uint64_t mask, std::size_t i) { return (mask >> i & 1) != 0; }

/// Calls visit(position) for each bit set in `mask`.
template <class Visit>
void for_each_bit(std::uint64_t mask, Visit&& visit) {
  for (; mask != 0; mask &= mask - 1) visit(static_cast<std::size_t>(std::countr_zero(mask)));
}

}  // namespace

ShiftGroupDecoder::ShiftGroupDecoder(const Schema& schema, const SegmentStart& start,
                                     const DecodedParts& parts, CellBytes cell_bytes)
    : GroupDecoder(schema, start, parts, std::move(cell_bytes)),
      names_imports_(numbered_by_order() && parts.vertex_numbers),
      shifts_(schema, may_import()),
      columns_(difference_columns(schema)),
      neighbours_(schema,
                  parts.vertex_neighbourhoods || parts.includes_values_of(schema, Location::point),
                  parts.cell_neighbourhoods || parts.includes_values_of(schema, Location::cell)),
      next_own_(start.first_vertex) {
  for (std::size_t b = 0; b < schema.blocks.size(); ++b)
    most_cell_bytes_ =
        std::max(most_cell_bytes_,
                 (*cell_bytes_)[b] + schema.blocks[b].nodes_per_cell * (8 + vertex_bytes_));
}

// --- streams

Result<void> ShiftGroupDecoder::begin_streams(std::optional<ConnectivityCodec> codec) {
  if (!codec) return corrupt("connectivity: missing");
  next_column_ = 0;
  import_coder_ = RangeDecoder(std::span<const std::byte>());
  for (DifferenceColumn& column : columns_) column.begin_empty_group();
  is_predicted_.assign(columns_.size(), 0);
  return {};
}

Result<void> ShiftGroupDecoder::begin_plain_stream(const container::StreamEntry& entry, Codec codec,
                                                   std::span<const std::byte> bytes) {
  const auto place = static_cast<std::size_t>(&entry - header_->streams.data());
  // Limit decoded_bytes, so that later sums of sizes cannot overflow even if the caller has set a
  // very large limit.
  const std::uint64_t decoded_bytes = std::min(header_->decoded_bytes, std::uint64_t{1} << 56);
  if (entry.kind == StreamKind::connectivity)
    return place == 0 ? begin_connectivity(bytes, decoded_bytes) : wrong_stream(entry);
  if (entry.kind != StreamKind::vertex_numbers)
    return begin_column(entry, codec, bytes, decoded_bytes);
  if (place != 1 || !numbered_by_order() || !may_import()) return wrong_stream(entry);
  if (codec != container::Codec::predictive) return unknown_codec(entry);
  import_coder_ = RangeDecoder(bytes);
  return {};
}

Result<void> ShiftGroupDecoder::begin_connectivity(std::span<const std::byte> bytes,
                                                   std::uint64_t decoded_bytes) {
  ByteReader in(bytes);
  const std::uint8_t bits = in.get_u8();
  has_neighbours_ = bits > 0;
  if (!in.ok() || !neighbours_.begin_group(bits, header_->cells) ||
      (!has_neighbours_ &&
       (needs_ring(*schema_) || parts_.vertex_neighbourhoods || parts_.cell_neighbourhoods)))
    return corrupt("connectivity: the size of the ring is invalid");
  if (predicted_.empty() && has_neighbours_)
    predicted_ = predicted_columns<ColumnDecoder>(*schema_, columns_, parts_);
  // Upper bound on the unpacked size of the shifts. They need at most 10 bytes for each node of a
  // cell, which counts 8 bytes in decoded_bytes, and at most 10 bytes for each unused vertex, which
  // counts 12 bytes.
  const std::uint64_t most = 3 * decoded_bytes + 64 * std::uint64_t{header_->cells};
  if (!shifts_.begin_group(in.get_bytes(in.left()), header_->cells, most, zstd_))
    return corrupt("connectivity: cannot be unpacked");
  return {};
}

Result<void> ShiftGroupDecoder::begin_column(const container::StreamEntry& entry, Codec codec,
                                             std::span<const std::byte> bytes,
                                             std::uint64_t decoded_bytes) {
  const std::size_t column = column_of(entry);
  if (column >= columns() || column < next_column_) return wrong_stream(entry);
  const bool predicted = is_predicted(codec);
  const bool is_known = predicted ? has_neighbours_ && predicted_[column] != nullptr &&
                                        predicted_[column]->takes(codec)
                                  : columns_[column].takes(codec);
  if (!is_known) return unknown_codec(entry);
  next_column_ = column + 1;
  is_predicted_[column] = predicted ? 1 : 0;
  if (predicted) predicted_[column]->make_room(neighbours_.slots());
  if (predicted ? predicted_[column]->begin_group(codec, bytes, decoded_bytes)
                : columns_[column].begin_group(codec, bytes, decoded_bytes, zstd_))
    return {};
  return corrupt((column == 0 ? "geometry" : array_stream_name(*schema_, entry.array)) +
                 ": cannot be unpacked");
}

bool ShiftGroupDecoder::is_used_up() const {
  return shifts_.at_end() && std::all_of(columns_.begin(), columns_.end(),
                                         [](const auto& column) { return column.at_end(); });
}

// --- cells and vertices

Result<void> ShiftGroupDecoder::decode_elements(DecodedBlock& decoded) {
  new_numbers_.clear();
  vertex_items_.clear();
  cell_items_.clear();
  const std::uint64_t bytes_before = done_.bytes;
  if (auto status = decode_cells(decoded); !status) return status;
  while (done_.cells == header_->cells && done_.own < header_->vertices &&
         done_.bytes - bytes_before < kTileBytes) {
    const auto number = numbered_by_order() ? std::optional(next_own_) : shifts_.next_unused();
    if (!number || done_.unused == header_->unused_vertices || !introduce(*number, false, decoded))
      return corrupt("an unused vertex is invalid");
    ++done_.unused;
    if (has_neighbours_) neighbours_.add_unused(*number, vertex_items_);
    done_.active = std::max(done_.active, live_.count());
    live_.remove(*number);
  }
  return {};
}

Result<void> ShiftGroupDecoder::decode_cells(DecodedBlock& decoded) {
  MeshBlock& block = decoded.mesh;
  const std::uint64_t bytes_before = done_.bytes;
  const std::size_t most = make_room_for_cells(kTileCells, shifts_.most_nodes(), block);
  std::size_t cells = 0;
  if (most > 0 && schema_->blocks.empty()) return corrupt("connectivity: a cell of no block");
  while (cells < most && done_.bytes - bytes_before < kTileBytes) {
    // Limit the number of cells to the number that certainly fits into the rest of the tile.
    const std::uint64_t left = kTileBytes - (done_.bytes - bytes_before);
    const auto fit = static_cast<std::size_t>(std::max<std::uint64_t>(left / most_cell_bytes_, 1));
    const std::size_t more =
        decode_alike(decoded, cells, std::min({most - cells, kShiftedCellsAtOnce, fit}));
    if (more == 0)
      return corrupt("connectivity: cell " + std::to_string(block.first_cell + cells) +
                     " is invalid");
    cells += more;
  }
  keep_cells(cells, block);
  if (!imports_.empty()) name_imports(block.corners);
  return has_room_for_bytes(0) ? Result<void>()
                               : corrupt("unpacks to more bytes than its header states");
}

/// Decodes cells that have the same shift, at most `most` cells. Stores them in the block from
/// index `cell` on. Returns the number of decoded cells, or 0 if the data is damaged.
std::size_t ShiftGroupDecoder::decode_alike(DecodedBlock& decoded, std::size_t cell,
                                            std::size_t most) {
  MeshBlock& block = decoded.mesh;
  std::size_t corners = static_cast<std::size_t>(block.corner_begin[cell]);
  std::uint64_t* const numbers = block.corners.data() + corners;
  const auto [marks, count] = shifts_.next_cells(numbers, most);
  if (marks == nullptr) return 0;
  const std::size_t nodes = shifts_.nodes(marks->block);
  if (has_neighbours_)
    neighbours_.add_cells(*marks, {numbers, count * nodes}, count, vertex_items_, cell_items_);
  const std::size_t vertices_before = block.vertex_numbers.size();
  const bool at_once = count > 1 && take_run(*marks, {numbers, count * nodes}, count, decoded);
  const std::size_t introduced =
      at_once ? (block.vertex_numbers.size() - vertices_before) / count : 0;
  for (std::size_t i = 0; i < count; ++i, ++cell) {
    if (!at_once && !introduce_and_finalize(*marks, {numbers + i * nodes, nodes}, decoded))
      return 0;
    block.vertices_before_cell[cell] =
        at_once ? vertices_before + (i + 1) * introduced : block.vertex_numbers.size();
    block.cell_numbers[cell] = block.first_cell + cell;
    block.cell_blocks[cell] = marks->block;
    block.last_use[cell] = marks->last_use;
    corners += nodes;
    block.corner_begin[cell + 1] = corners;
  }
  done_.bytes += count * (8 * nodes + (*cell_bytes_)[marks->block]);
  done_.cells += count;
  return count;
}

/// Replaces each import number in `corners` with the stream number of the vertex.
void ShiftGroupDecoder::name_imports(std::vector<std::uint64_t>& corners) {
  for (std::uint64_t& number : corners)
    if (number >= kFirstImport) number = imports_[number];
  for (const std::uint64_t number : finalized_) imports_.remove(number);
  finalized_.clear();
}

/// Counts the vertices that each cell of a run (cells with the same shift) introduces and
/// finalizes. Returns false if the cells must be processed one by one, for example because their
/// vertex numbers do not increase by one from cell to cell. Also returns false if the run is
/// invalid.
bool ShiftGroupDecoder::count_run(const CellMarks& marks, std::span<const std::uint64_t> numbers,
                                  std::size_t count, std::uint64_t& introduced,
                                  std::uint64_t& finalized) {
  const std::size_t nodes = numbers.size() / count;
  const auto first = numbers.first(nodes);
  const auto length = static_cast<std::uint32_t>(count);
  const std::uint64_t all = count == 64 ? ~std::uint64_t{0} : (std::uint64_t{1} << count) - 1;
  introduced = finalized = 0;
  if (marks.imports != 0) return false;
  for (std::size_t i = 0; i < nodes; ++i) {
    if (numbers[nodes + i] != first[i] + 1 || first[i] > ~std::uint64_t{0} - 64) return false;
    LiveNumbers::Run run = live_.run(first[i], length);
    // True if node i is the same vertex as an earlier node, and both nodes are marked as last use
    bool again = false;
    for (std::size_t j = 0; j < nodes; ++j) {
      // The vertex number at each node increases by one per cell. `ahead` cells later, node i
      // therefore is the vertex that node j is now.
      const std::uint64_t ahead = first[j] - first[i];
      if (ahead >= count) continue;
      if (has_bit(marks.introduced, j)) {
        if (j != i && has_bit(marks.introduced, i)) return false;  // the vertex is introduced twice
        run.live |= j == i ? 0 : all << ahead;
      }
      if (has_bit(marks.last_use, j)) {
        if (ahead > 0) return false;  // the vertex would be used after its last use
        again = again || (j < i && has_bit(marks.last_use, i));
      }
    }
    if (has_bit(marks.introduced, i) ? run.live != 0 : (run.live & all) != all) return false;
    if (has_bit(marks.last_use, i) && run.imported != 0) return false;
    if (numbered_by_order() && has_bit(marks.introduced, i) &&
        (introduced > 0 || first[i] != next_own_ || first[i] >= kFirstImport - 64))
      return false;
    introduced += has_bit(marks.introduced, i) ? 1 : 0;
    finalized += has_bit(marks.last_use, i) && !again ? 1 : 0;
  }
  return true;
}

/// Has the same effect as calling introduce_and_finalize() for each of `count` cells (2 to 64), but
/// processes runs of numbers instead of single numbers. The cells must not import vertices, and
/// their vertex numbers must increase by one from cell to cell. If runs cannot be processed or if
/// the cells are invalid, returns false and changes nothing.
bool ShiftGroupDecoder::take_run(const CellMarks& marks, std::span<const std::uint64_t> numbers,
                                 std::size_t count, DecodedBlock& decoded) {
  std::uint64_t introduced, finalized;  // number of vertices of each cell
  if (!count_run(marks, numbers, count, introduced, finalized)) return false;
  const std::uint64_t active =
      live_.count() + introduced +
      (introduced > finalized ? (introduced - finalized) * (count - 1) : 0);
  if (active > header_->max_active_vertices || done_.own + introduced * count > header_->vertices ||
      !has_room_for_bytes(introduced * count * vertex_bytes_))
    return false;
  done_.active = std::max(done_.active, active);
  next_own_ += introduced * count;
  const auto length = static_cast<std::uint32_t>(count);
  for_each_bit(marks.introduced, [&](std::size_t i) { live_.add_run(numbers[i], length); });
  for_each_bit(marks.last_use, [&](std::size_t i) { live_.remove_run(numbers[i], length); });
  const std::size_t before = new_numbers_.size();
  for (std::size_t c = 0; c < count; ++c)
    for_each_bit(marks.introduced, [&](std::size_t i) { new_numbers_.push_back(numbers[i] + c); });
  if (introduced > 0) add_own_vertices(std::span(new_numbers_).subspan(before), decoded);
  return true;
}

/// Introduces the new vertices of a cell, checks that its other vertices are live, and removes the
/// vertices that no later cell uses. Returns false if a vertex is not live, or if the group has
/// more vertices than its header states.
bool ShiftGroupDecoder::introduce_and_finalize(const CellMarks& marks,
                                               std::span<const std::uint64_t> numbers,
                                               DecodedBlock& decoded) {
  for (std::uint64_t left = marks.introduced; left != 0; left &= left - 1) {
    const auto i = static_cast<std::size_t>(std::countr_zero(left));
    if (!introduce(numbers[i], has_bit(marks.imports, i), decoded)) return false;
  }
  for (std::size_t i = 0; i < numbers.size(); ++i)
    if (!has_bit(marks.introduced, i) && !live_.is_live(numbers[i], hints_[i])) return false;
  done_.active = std::max(done_.active, live_.count());
  if (done_.active > header_->max_active_vertices) return false;
  for_each_bit(marks.last_use, [&](std::size_t i) {
    if (live_.remove(numbers[i]) != LiveNumbers::State::imported) return;
    decoded.finalized_imports.push_back(names_imports_ ? imports_[numbers[i]] : numbers[i]);
    if (names_imports_) finalized_.push_back(numbers[i]);
  });
  return true;
}

bool ShiftGroupDecoder::introduce(std::uint64_t number, bool imported, DecodedBlock& decoded) {
  if (!has_room_for_vertex(imported) || !has_room_for_bytes(vertex_bytes_)) return false;
  std::uint64_t& next = imported ? next_import_ : next_own_;
  if (numbered_by_order() && (number != next || (!imported && number >= kFirstImport)))
    return false;
  if (!live_.add(number, imported)) return false;
  ++next;
  new_numbers_.push_back(number);
  if (imported && names_imports_) {
    const std::uint64_t in_shifts = number;
    number = import_numbers_.code(import_coder_, {}, 0, 0);
    if (number >= start_.first_vertex) return false;
    imports_.add(in_shifts, number);
  }
  add_vertex(number, imported, decoded);
  return true;
}

// --- values

bool ShiftGroupDecoder::decode_column(std::size_t column, const MeshBlock& block,
                                      std::vector<std::byte>& out) {
  if (is_predicted_[column] != 0)
    return predicted_[column]->decode_tile(of_cells(column)
                                               ? TiledItems::Tile{cell_items_, block.cell_blocks}
                                               : TiledItems::Tile{vertex_items_, {}},
                                           out);
  if (!of_cells(column)) return columns_[column].decode(new_numbers_, out, scratch_);
  cells_.clear();
  for (std::size_t i = 0; i < block.cell_count(); ++i)
    if (schema_->array_covers(array_of(column), block.cell_blocks[i]))
      cells_.push_back(block.first_cell + i);
  return columns_[column].decode(cells_, out, scratch_);
}

}  // namespace shm
