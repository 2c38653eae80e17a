#include "codecs/patterns/pattern_group_decoder.h"

#include <algorithm>
#include <bit>
#include <string>
#include <utility>

#include "base/errors.h"
#include "base/lists.h"

namespace shm {

using container::StreamKind;

namespace {

/// Number of cells per block. A block is smaller than a tile (the unit in which a Reader returns
/// cells), so that it stays in a fast cache. Decoded values do not depend on the block size.
constexpr std::uint64_t kBlockCells = 1024;

}  // namespace

PatternGroupDecoder::PatternGroupDecoder(const Schema& schema, const SegmentStart& start,
                                         const DecodedParts& parts, CellBytes cell_bytes)
    : GroupDecoder(schema, start, parts, std::move(cell_bytes)),
      patterns_(schema, schema.order == Order::keep, may_import(), start.first_vertex),
      finder_(schema),
      columns_(term_columns(schema)) {}

// --- streams

Result<void> PatternGroupDecoder::begin_streams(std::optional<ConnectivityCodec> codec) {
  if (!codec) return corrupt("connectivity: missing");
  next_column_ = 0;
  import_coder_ = RangeDecoder(std::span<const std::byte>());
  for (TermColumn& column : columns_) column.begin_empty_group();
  return {};
}

Result<void> PatternGroupDecoder::begin_plain_stream(const container::StreamEntry& entry,
                                                     Codec codec,
                                                     std::span<const std::byte> bytes) {
  const auto place = static_cast<std::size_t>(&entry - header_->streams.data());
  // This bound prevents an overflow in sums of sizes, even if the caller has set a very large
  // limit.
  const std::uint64_t decoded_bytes = std::min(header_->decoded_bytes, std::uint64_t{1} << 56);
  if (entry.kind == StreamKind::connectivity) {
    if (place != 0) return wrong_stream(entry);
    // decoded_bytes counts 8 bytes per node and at least 12 bytes per vertex, so decoded_bytes / 8
    // limits the number of nodes. A stored vertex number needs at most 10 bytes.
    if (patterns_.begin_group(bytes, header_->cells, decoded_bytes / 8, 10 * decoded_bytes,
                              scratch_.unpacking))
      return {};
    return corrupt("connectivity: cannot be unpacked");
  }
  if (entry.kind != StreamKind::vertex_numbers)
    return begin_column(entry, codec, bytes, decoded_bytes);
  if (place != 1 || !numbered_by_order() || !may_import()) return wrong_stream(entry);
  if (codec != container::Codec::predictive) return unknown_codec(entry);
  import_coder_ = RangeDecoder(bytes);
  return {};
}

Result<void> PatternGroupDecoder::begin_column(const container::StreamEntry& entry, Codec codec,
                                               std::span<const std::byte> bytes,
                                               std::uint64_t decoded_bytes) {
  const std::size_t column = column_of(entry);
  if (column >= columns() || column < next_column_) return wrong_stream(entry);
  if (!columns_[column].takes(codec)) return unknown_codec(entry);
  next_column_ = column + 1;
  if (columns_[column].begin_group(codec, bytes, decoded_bytes, scratch_)) return {};
  return corrupt((column == 0 ? "geometry" : array_stream_name(*schema_, entry.array)) +
                 ": cannot be unpacked");
}

bool PatternGroupDecoder::is_used_up() const {
  return patterns_.at_end() && std::all_of(columns_.begin(), columns_.end(),
                                           [](const auto& column) { return column.at_end(); });
}

std::vector<std::uint64_t> PatternGroupDecoder::alive() const {
  std::vector<std::uint64_t> numbers;
  for (std::uint32_t slot = 0; slot < patterns_.slot_count(); ++slot)
    if (patterns_.is_own(slot)) numbers.push_back(patterns_.number(slot));
  return numbers;
}

// --- cells and vertices

Result<void> PatternGroupDecoder::decode_elements(DecodedBlock& decoded) {
  terms_.clear();
  const std::uint64_t bytes_before = done_.bytes;
  if (auto status = decode_cells(decoded); !status) return status;
  while (done_.cells == header_->cells && done_.own < header_->vertices &&
         done_.bytes - bytes_before < kTileBytes) {
    const auto number = patterns_.next_unused();
    if (!number || done_.unused == header_->unused_vertices || !has_room_for_bytes(vertex_bytes_))
      return corrupt("an unused vertex is invalid");
    ++done_.unused;
    terms_.push_back({patterns_.slot_count(), 0, {}});
    add_vertex(*number, false, decoded);
    done_.active = std::max(done_.active, patterns_.live() + 1);
  }
  return has_room_for_bytes(0) ? Result<void>()
                               : corrupt("unpacks to more bytes than its header states");
}

Result<void> PatternGroupDecoder::decode_cells(DecodedBlock& decoded) {
  MeshBlock& block = decoded.mesh;
  const std::uint64_t bytes_before = done_.bytes;
  const std::size_t most = make_room_for_cells(kBlockCells, patterns_.stride(), block);
  std::size_t cells = 0;
  for (; cells < most && done_.bytes - bytes_before < kTileBytes; ++cells)
    if (!decode_cell(decoded, cells))
      return corrupt("connectivity: cell " + std::to_string(block.first_cell + cells) +
                     " is invalid");
  keep_cells(cells, block);
  return {};
}

bool PatternGroupDecoder::decode_cell(DecodedBlock& decoded, std::size_t index) {
  MeshBlock& block = decoded.mesh;
  const auto corners = static_cast<std::size_t>(block.corner_begin[index]);
  std::uint64_t* const numbers = block.corners.data() + corners;
  const PatternCell* const cell = patterns_.next_cell(
      numbers, [&](PatternHistory::Vertex& vertex) { return import_vertex(vertex); });
  if (cell == nullptr) return false;
  if (cell->introduced != 0 && !add_vertices(*cell, numbers, decoded)) return false;
  done_.bytes += 8 * cell->slots.size() + (*cell_bytes_)[cell->block];
  finder_.add_cell(*cell, terms_);
  done_.active = std::max(done_.active, patterns_.live());
  if (done_.active > header_->max_active_vertices) return false;
  patterns_.end_cell([&](std::uint64_t number) { decoded.finalized_imports.push_back(number); });
  block.vertices_before_cell[index] = block.vertex_numbers.size();
  block.cell_numbers[index] = header_->first_cell + done_.cells;
  block.cell_blocks[index] = cell->block;
  block.last_use[index] = cell->last_use;
  block.corner_begin[index + 1] = corners + cell->slots.size();
  ++done_.cells;
  return has_room_for_bytes(0);
}

/// Reads the global number of an imported vertex. Called only if vertices are numbered in coding
/// order.
bool PatternGroupDecoder::import_vertex(PatternHistory::Vertex& vertex) {
  if (!parts_.vertex_numbers) return true;
  vertex.number = import_numbers_.code(import_coder_, {}, 0, 0);
  return vertex.number < start_.first_vertex;
}

/// Adds to the block the vertices that the cell introduces. `numbers`: vertex numbers of the cell,
/// indexed by node.
bool PatternGroupDecoder::add_vertices(const PatternCell& cell, const std::uint64_t* numbers,
                                       DecodedBlock& decoded) {
  for (std::uint64_t left = cell.introduced; left != 0; left &= left - 1) {
    const auto node = static_cast<std::size_t>(std::countr_zero(left));
    const bool imported = (cell.imports >> node & 1) != 0;
    if (!has_room_for_vertex(imported) || !has_room_for_bytes(vertex_bytes_)) return false;
    add_vertex(numbers[node], imported, decoded);
  }
  return true;
}

// --- values

bool PatternGroupDecoder::decode_column(std::size_t column, const MeshBlock& block,
                                        std::vector<std::byte>& out) {
  TermColumn::Elements elements;
  if (of_cells(column)) {
    elements.count = static_cast<std::size_t>(
        std::count_if(block.cell_blocks.begin(), block.cell_blocks.end(),
                      [&](std::uint32_t b) { return schema_->array_covers(array_of(column), b); }));
  } else {
    elements = {terms_, terms_.size(), patterns_.slot_count() + 1};
  }
  return columns_[column].decode(elements, out, scratch_);
}

}  // namespace shm
