#include "pipeline/mesh_encoder.h"

#include <algorithm>
#include <string>
#include <utility>

#include "base/errors.h"
#include "base/lists.h"
#include "codecs/registry.h"
#include "format/schema.h"

namespace shm {

MeshEncoder::MeshEncoder(const Schema& schema, const WriteOptions& options, GroupSink sink)
    : schema_(&schema),
      options_(options),
      sink_(std::move(sink)),
      cell_data_bytes_(cell_data_bytes(schema)),
      vertices_(schema),
      cutter_(options_),
      queue_(schema, options_, [this](EncodedGroup& group) { return give_out(group); }),
      totals_(totals_of_nothing(schema)) {
  if (schema.delay > 0) delayed_.emplace(schema.delay);
  for (const BlockInfo& block : schema.blocks) ends_others_.push_back(has_grid(block));
}

void MeshEncoder::begin_part(const SegmentStart& start) {
  start_ = start;
  queue_.begin_segment(start);
  coded_cells_ = totals_.cells = start.first_cell;
  own_vertices_ = start.first_vertex;
  holds_groups_ = has_stream_numbers();
}

// --- in the caller's order

Result<void> MeshEncoder::add_vertex(std::uint64_t number, std::span<const std::byte> xyz,
                                     std::span<const std::byte> data) {
  const std::size_t bytes = vertices_.value_bytes();
  if (xyz.size() != vertices_.xyz_bytes() || data.size() != bytes - vertices_.xyz_bytes())
    return misuse("vertex " + std::to_string(number) + " has " +
                      std::to_string(xyz.size() + data.size()) +
                      " bytes of values, the schema has " + std::to_string(bytes),
                  "mesh");
  if (vertices_.add(number, xyz.data(), data.data()) == kNone)
    return misuse("vertex " + std::to_string(number) + " is added twice", "mesh");
  return {};
}

Result<void> MeshEncoder::add_imported_vertex(std::uint64_t number, std::span<const std::byte> xyz,
                                              std::span<const std::byte> data) {
  if (start_.segment == 0) return misuse("the first segment cannot import vertices", "mesh");
  if (auto status = add_vertex(number, xyz, data); !status) return status;
  const std::uint32_t entry = vertices_.find(number);
  vertices_.mark_imported(entry);
  cutter_.add_import();
  if (has_stream_numbers()) vertices_.set_ticket(entry, stream_numbers_.new_imported());
  return {};
}

Result<void> MeshEncoder::add_unused_vertex(std::uint64_t number, std::span<const std::byte> xyz,
                                            std::span<const std::byte> data) {
  if (auto status = add_vertex(number, xyz, data); !status) return status;
  return code_unused(vertices_.find(number));
}

Result<void> MeshEncoder::add_cell(std::uint32_t block, std::span<const std::uint64_t> corners,
                                   std::uint64_t last_use, std::span<const std::byte> data,
                                   std::span<const std::uint64_t> other_last_uses) {
  if (block >= schema_->blocks.size()) return misuse("cell of an unknown block", "mesh");
  const BlockInfo& info = schema_->blocks[block];
  if (info.nodes_per_cell != 0 ? corners.size() != info.nodes_per_cell
                               : corners.size() > kMaxNodesPerCell)
    return misuse("cell with " + std::to_string(corners.size()) + " corners in a block of " +
                      std::to_string(info.nodes_per_cell),
                  "mesh");
  if (data.size() != cell_data_bytes_[block])
    return misuse("cell with " + std::to_string(data.size()) + " bytes of data, the schema has " +
                      std::to_string(cell_data_bytes_[block]),
                  "mesh");
  if (!ends_others_[block]) other_last_uses = {};
  for (const auto& [numbers, entries] :
       {std::pair(corners, &cell_entries_), std::pair(other_last_uses, &other_entries_)}) {
    entries->resize(numbers.size());
    for (std::size_t i = 0; i < numbers.size(); ++i) {
      const std::uint32_t entry = vertices_.find(numbers[i]);
      if (entry == kNone)
        return misuse("cell uses vertex " + std::to_string(numbers[i]) +
                          ", which was never added or has already had its last use",
                      "mesh");
      (*entries)[i] = entry;
    }
  }
  return enter_cell(block, cell_entries_, last_use, data);
}

/// Adds a cell whose vertices are given by their entries in the vertex table.
Result<void> MeshEncoder::enter_cell(std::uint32_t block, std::span<const std::uint32_t> entries,
                                     std::uint64_t last_use, std::span<const std::byte> data) {
  const VertexTable::Uses uses = vertices_.use(entries, start_.segment);
  bool may_give = uses.first_in_segment;
  if (cutter_.is_due(block, totals_.cells)) {
    if (auto status = cut(); !status) return status;
    may_give = true;
  }
  const std::size_t markable = std::min<std::size_t>(entries.size(), kMaxLastUse);
  if (markable < kMaxLastUse) last_use &= (std::uint64_t{1} << markable) - 1;
  std::uint64_t ended = vertices_.end(entries, last_use);
  for (const std::uint32_t entry : other_entries_) ended += vertices_.end(entry) ? 1 : 0;
  cutter_.add_cell(block, uses.introduced, ended);
  ++totals_.block_cells[block];
  const std::uint64_t number = totals_.cells++;
  if (!delayed_) return code(number, block, entries, data, may_give, last_use);
  return delay(number, block, entries, data);
}

/// Adds the cell to the delay buffer. If the buffer then exceeds its capacity, removes the next
/// cell from the buffer and codes that cell.
Result<void> MeshEncoder::delay(std::uint64_t number, std::uint32_t block,
                                std::span<const std::uint32_t> entries,
                                std::span<const std::byte> data) {
  vertices_.begin_waiting(entries);
  std::optional<DelayBuffer::Corners> corners;
  if (is_hexahedral(schema_->blocks[block])) {
    corners.emplace();
    for (std::size_t i = 0; i < 8; ++i) (*corners)[i] = vertices_.number(entries[i]);
  }
  delayed_->push(number, block, entries, data, corners);
  return delayed_->is_overfull() ? code_waiting() : Result<void>();
}

Result<void> MeshEncoder::code_waiting() {
  const DelayBuffer::Cell& cell = delayed_->pop();
  vertices_.end_waiting(cell.entries);
  return code(cell.number, cell.block, cell.entries, cell.data, true, ~std::uint64_t{0});
}

Result<void> MeshEncoder::code_all_waiting() {
  while (delayed_ && !delayed_->empty())
    if (auto status = code_waiting(); !status) return status;
  return {};
}

/// Ends the current segment and begins the next one. All waiting cells belong to the segment that
/// ends.
Result<void> MeshEncoder::cut() {
  if (auto status = code_all_waiting(); !status) return status;
  if (auto status = queue_.end_segment(); !status) return status;
  if (delayed_) delayed_->begin_segment();
  ++start_.segment;
  start_.first_cell = coded_cells_;
  start_.first_vertex = own_vertices_;
  queue_.begin_segment(start_);
  cutter_.begin_segment();
  return {};
}

Result<void> MeshEncoder::end() {
  if (auto status = code_all_waiting(); !status) return status;
  // Encodes the remaining vertices, which no cell has used, in ascending order of their numbers.
  for (const std::uint32_t entry : vertices_.unused())
    if (auto status = code_unused(entry); !status) return status;
  if (auto status = queue_.end_segment(); !status) return status;
  if (auto status = catch_up(); !status) return status;
  // Frees all data that is needed only for adding cells, so that coding of steps can use the
  // memory.
  vertices_ = VertexTable(*schema_);
  let_go(free_handles_);
  delayed_.reset();
  queue_.let_go();
  return {};
}

// --- passing data to the current segment, in coding order

Result<void> MeshEncoder::code(std::uint64_t number, std::uint32_t block,
                               std::span<const std::uint32_t> entries,
                               std::span<const std::byte> data, bool may_give,
                               std::uint64_t may_end) {
  SegmentPiece& piece = queue_.piece();
  SegmentPiece::Cell cell;
  cell.number = number;
  cell.block = block;
  cell.nodes = static_cast<std::uint32_t>(entries.size());
  const std::size_t vertices_before = piece.vertices.size();
  if (may_give)
    for (std::uint32_t e : entries)
      if (!vertices_.is_in_segment(e, start_.segment)) give_vertex(piece, e);
  cell.new_vertices = static_cast<std::uint32_t>(piece.vertices.size() - vertices_before);
  const auto end_ticket = [&](std::uint32_t ticket) {
    if (ticket != kNone) stream_numbers_.end_ticket(ticket, coded_cells_);
  };
  if (may_end != 0) cell.last_use = vertices_.free_ended(entries, may_end, end_ticket);
  if (ends_others_[block] && entries.size() > kMaxLastUse) {
    const std::size_t before = piece.other_last_uses.size();
    vertices_.free_other_ended(entries, piece.other_last_uses, end_ticket);
    cell.other_last_uses = static_cast<std::uint32_t>(piece.other_last_uses.size() - before);
  }
  piece.cells.push_back(cell);
  piece.nodes.append(entries.data(), entries.size());
  piece.cell_data.append(data.data(), data.size());
  ++coded_cells_;
  return queue_.added();
}

/// Passes a vertex to the encoder of the current segment. Precondition: the vertex has not been
/// passed to this segment yet.
void MeshEncoder::give_vertex(SegmentPiece& piece, std::uint32_t entry) {
  SegmentPiece::Vertex vertex = vertices_.put_into_segment(entry, start_.segment);
  if (!vertex.imported) {
    ++own_vertices_;
    if (has_stream_numbers())
      vertices_.set_ticket(entry, vertex.ticket = stream_numbers_.new_ticket());
  }
  piece.vertices.push_back(vertex);
  piece.vertex_values.append(vertices_.values(entry), vertices_.value_bytes());
}

/// Does the same as give_vertex() for a fed vertex. Returns the vertex, which the caller adds to
/// the piece.
SegmentPiece::Vertex MeshEncoder::feed_vertex(std::uint64_t number, FedVertex& vertex) {
  SegmentPiece::Vertex given;
  given.number = number;
  given.imported = vertex.segment != kNone;
  if (!given.imported) {
    ++own_vertices_;
    if (free_handles_.empty()) {
      vertex.handle = handles_++;
    } else {
      vertex.handle = free_handles_.back();
      free_handles_.pop_back();
    }
    if (has_stream_numbers()) vertex.ticket = stream_numbers_.new_ticket();
  }
  vertex.segment = start_.segment;
  given.handle = vertex.handle;
  given.ticket = vertex.ticket;
  return given;
}

Result<void> MeshEncoder::code_unused(std::uint32_t entry) {
  SegmentPiece& piece = queue_.piece();
  SegmentPiece::Cell cell;
  cell.block = SegmentPiece::kUnused;
  cell.new_vertices = 1;
  piece.cells.push_back(cell);
  SegmentPiece::Vertex vertex;
  vertex.number = vertices_.number(entry);
  vertex.handle = entry;
  piece.vertices.push_back(vertex);
  ++own_vertices_;
  piece.vertex_values.append(vertices_.values(entry), vertices_.value_bytes());
  vertices_.free_unused(entry);
  return queue_.added();
}

// --- groups, in file order

Result<void> MeshEncoder::give_out(EncodedGroup& group) {
  if (options_.coding_order != nullptr) report_order(group);
  if (!holds_groups_) return finish_group(group);
  held_.push_back(std::move(group));
  let_go(held_.back().cell_numbers);
  return {};
}

Result<void> MeshEncoder::give_out_part(std::span<const std::uint64_t> numbers) {
  if (numbers.size() != imported())
    return misuse("there are " + std::to_string(imported()) + " imported vertices, but " +
                      std::to_string(numbers.size()) + " numbers are given",
                  "mesh");
  stream_numbers_.set_imported(numbers);
  holds_groups_ = false;
  for (EncodedGroup& group : held_) {
    if (auto status = finish_group(group); !status) return status;
    group = EncodedGroup();
  }
  let_go(held_);
  return {};
}

Result<void> MeshEncoder::finish_group(EncodedGroup& group) {
  if (group.segment != last_segment_ || totals_.segments == 0) {
    last_segment_ = group.segment;
    ++totals_.segments;
    if (has_stream_numbers()) stream_numbers_.begin_segment();
  }
  if (has_stream_numbers()) stream_numbers_.complete(group);
  const container::GroupHeader& header = group.header;
  totals_.vertices += header.vertices;
  totals_.imported_vertices += header.imported_vertices;
  totals_.hexahedra += group.hexahedra;
  totals_.max_active_vertices = std::max(totals_.max_active_vertices, header.max_active_vertices);
  return sink_(group);
}

/// Reports each vertex and each cell of the group to the caller, in coding order.
void MeshEncoder::report_order(const EncodedGroup& group) const {
  for (const EncodedGroup::Vertex& vertex : group.own) options_.coding_order->vertex(vertex.number);
  for (std::uint64_t cell : group.cell_numbers) options_.coding_order->cell(cell);
}

// --- options

namespace {

/// Returns the highest StepReference that the options allow. A trend needs two earlier steps, and
/// neither may come before the most recent key step.
StepReference most_referred(const Schema& schema, const WriteOptions& options) {
  if (!has_steps(schema) || options.key_steps > 2) return StepReference::base;
  return options.key_steps == 2 ? StepReference::before : StepReference::nothing;
}

Result<void> check_options(const Schema& schema, const WriteOptions& options) {
  if (options.group_cells < 1 || options.group_cells > container::kMaxGroupCells)
    return misuse("group_cells must be 1 to 2^20", "options");
  if (options.level > Level::best) return misuse("unknown level", "options");
  const auto check_codec = [&](ConnectivityCodec name) -> Result<void> {
    if (name == ConnectivityCodec::automatic) return {};
    const CellCodec* codec = find_codec(name);
    if (codec == nullptr) return misuse("unknown connectivity codec", "options");
    if (!codec->takes(schema))
      return misuse("codec " + std::string(codec->word) + " needs " + std::string(codec->needs),
                    "options");
    return {};
  };
  if (auto status = check_codec(options.connectivity); !status) return status;
  for (ConnectivityCodec name : options.segment_connectivity)
    if (auto status = check_codec(name); !status) return status;
  if (!(options.restart_budget >= 0)) return misuse("restart_budget must be 0 or more", "options");
  if (options.key_steps < 1) return misuse("key_steps must be 1 or more", "options");
  if (!std::is_sorted(options.segment_starts.begin(), options.segment_starts.end()))
    return misuse("segment_starts must ascend", "options");
  return {};
}

}  // namespace

Result<Schema> schema_of_file(Schema schema, const WriteOptions& options) {
  if (auto status = check_schema(schema); !status) return status.error();
  if (auto status = check_options(schema, options); !status) return status.error();
  schema.step_references = std::min(schema.step_references, most_referred(schema, options));
  schema.earlier_values = true;
  return schema;
}

}  // namespace shm
