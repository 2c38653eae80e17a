#include "pipeline/mesh_encoder.h"

#include <algorithm>
#include <bit>
#include <string>

#include "base/binary.h"
#include "base/errors.h"
#include "base/lists.h"
#include "codecs/registry.h"
#include "format/schema.h"

namespace shm {
namespace {

// Cells and bytes of a piece. A piece is large enough that passing it to another thread costs
// little, and small compared with a group.
constexpr std::size_t kPieceCells = 1024;
constexpr std::size_t kPieceBytes = std::size_t{1} << 20;

// Smallest number of cells in a segment that is cut because the restart budget allows it. A segment
// that ends at the beginning of an element block, which is a better place for a cut, needs only
// half of that number.
constexpr std::uint64_t kLeastSegmentCells = 131072;

// Limits on the bytes of the waiting pieces and of the waiting groups, per thread.
constexpr std::size_t kWaitingBytes = std::size_t{64} << 20;

// Bytes of pieces of the first segment that are coded before threads start: some hundred cells.
constexpr std::size_t kAlonePieceBytes = std::size_t{32} << 10;

using Tasks = OrderedTasks<SegmentPiece, EncodedGroup>;

class SegmentTask final : public Tasks::Task {
 public:
  SegmentTask(const Schema& schema, std::uint32_t group_cells, const CodecTrial& trial,
              const SegmentStart& start)
      : schema_(&schema), group_cells_(group_cells), trial_(trial), start_(start) {}

  Result<void> take(SegmentPiece& piece, const Tasks::Emit& emit) override {
    if (!encoder_)
      encoder_ = std::make_unique<ChoosingEncoder>(*schema_, group_cells_, trial_, start_);
    auto result = encoder_->take(piece, done_);
    emit_done(emit);
    return result;
  }
  Result<void> end(const Tasks::Emit& emit) override {
    auto result = encoder_->end(done_);
    emit_done(emit);
    encoder_.reset();
    return result;
  }

 private:
  void emit_done(const Tasks::Emit& emit) {
    for (EncodedGroup& group : done_) {
      const std::size_t bytes = group.bytes();
      emit(std::move(group), bytes);
    }
    done_.clear();
  }

  const Schema* schema_;
  std::uint32_t group_cells_;
  CodecTrial trial_;
  SegmentStart start_;
  std::unique_ptr<ChoosingEncoder> encoder_;
  std::vector<EncodedGroup> done_;
};

}  // namespace

MeshEncoder::MeshEncoder(const Schema& schema, const WriteOptions& options, GroupSink sink)
    : schema_(&schema),
      options_(options),
      sink_(std::move(sink)),
      xyz_bytes_(3 * scalar_bytes(schema.coordinate_type)),
      values_bytes_(xyz_bytes_ + point_data_bytes(schema)),
      cell_data_bytes_(cell_data_bytes(schema)),
      totals_(totals_of_nothing(schema)) {
  if (schema.delay > 0) reorderer_.emplace();
  if (options.threads == 1) return;
  const unsigned threads = thread_count(options.threads);
  if (threads > 1)
    tasks_ = std::make_unique<Tasks>(threads, Tasks::Limits{.in = threads * kWaitingBytes,
                                                            .out = threads * kWaitingBytes,
                                                            .alone = kAlonePieceBytes});
}

void MeshEncoder::begin_part(const SegmentStart& start) {
  start_ = start;
  given_cells_ = totals_.cells = start.first_cell;
  given_vertices_ = start.first_vertex;
  holds_groups_ = schema_->order != Order::keep;
}

Result<void> MeshEncoder::add_vertex(std::uint64_t number, std::span<const std::byte> xyz,
                                     std::span<const std::byte> data) {
  if (xyz.size() != xyz_bytes_ || data.size() != values_bytes_ - xyz_bytes_)
    return misuse("vertex " + std::to_string(number) + " has " +
                      std::to_string(xyz.size() + data.size()) +
                      " bytes of values, the schema has " + std::to_string(values_bytes_),
                  "mesh");
  const std::uint32_t entry = next_entry();
  if (!by_number_.insert(number, entry))
    return misuse("vertex " + std::to_string(number) + " is added twice", "mesh");
  enter_vertex(number, xyz.data(), data.data());
  entries_[entry].named = true;
  return {};
}

std::uint32_t MeshEncoder::enter_vertex(std::uint64_t number, const std::byte* xyz,
                                        const std::byte* data) {
  const std::uint32_t entry = next_entry();
  if (free_entries_.empty()) {
    push_tightly(entries_, Entry());
    push_tightly(in_segment_, kNone);
    expect_more(values_, values_bytes_);
    values_.resize(values_.size() + values_bytes_);
  } else {
    free_entries_.pop_back();
  }
  entries_[entry] = Entry{};
  in_segment_[entry] = kNone;
  entries_[entry].number = number;
  std::byte* values = values_.data() + entry * values_bytes_;
  copy_few(values, xyz, xyz_bytes_);
  copy_few(values + xyz_bytes_, data, values_bytes_ - xyz_bytes_);
  return entry;
}

Result<void> MeshEncoder::add_imported_vertex(std::uint64_t number, std::span<const std::byte> xyz,
                                              std::span<const std::byte> data) {
  if (start_.segment == 0) return misuse("the first segment cannot import vertices", "mesh");
  if (auto status = add_vertex(number, xyz, data); !status) return status;
  const std::uint32_t e = by_number_.find(number);
  in_segment_[e] = 0;  // passed to an earlier segment; it does not matter to which
  entries_[e].used = true;
  ++live_;
  if (schema_->order != Order::keep) foreign_tickets_.push_back(entries_[e].ticket = new_ticket());
  return {};
}

Result<void> MeshEncoder::add_unused_vertex(std::uint64_t number, std::span<const std::byte> xyz,
                                            std::span<const std::byte> data) {
  if (auto status = add_vertex(number, xyz, data); !status) return status;
  return code_unused(by_number_.find(number));
}

Result<void> MeshEncoder::add_cell(std::uint32_t block, std::span<const std::uint64_t> corners,
                                   std::uint64_t last_use, std::span<const std::byte> data) {
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
  cell_entries_.resize(corners.size());
  for (std::size_t i = 0; i < corners.size(); ++i) {
    const std::uint32_t entry = by_number_.find(corners[i]);
    if (entry == kNone)
      return misuse("cell uses vertex " + std::to_string(corners[i]) +
                        ", which was never added or is finalized",
                    "mesh");
    cell_entries_[i] = entry;
  }
  return enter_cell(block, cell_entries_, last_use, data);
}

Result<void> MeshEncoder::enter_cell(std::uint32_t block, std::span<const std::uint32_t> entries,
                                     std::uint64_t last_use, std::span<const std::byte> data) {
  std::uint64_t introduced = 0;
  bool gives = false;  // true: the cell is the first in the segment to use one of its vertices
  for (const std::uint32_t entry : entries) {
    if (in_segment_[entry] == start_.segment) continue;
    gives = true;
    introduced += entries_[entry].used ? 0 : 1;
    entries_[entry].used = true;
  }
  if (cut_is_due(block)) {
    if (auto status = cut(); !status) return status;
    gives = true;
  }

  last_block_ = block;
  ++run_.cells;
  ++totals_.block_cells[block];
  run_.introduced += introduced;
  live_ += introduced;
  const std::size_t markable = std::min<std::size_t>(entries.size(), kMaxLastUse);
  if (markable < kMaxLastUse) last_use &= (std::uint64_t{1} << markable) - 1;
  for (std::uint64_t left = last_use; left != 0; left &= left - 1) {
    Entry& entry = entries_[entries[static_cast<std::size_t>(std::countr_zero(left))]];
    if (entry.ends) continue;
    entry.ends = true;
    // The caller may use the number again from here on, though the vertex may wait for its last
    // cell.
    if (entry.named) by_number_.erase(entry.number);
    --live_;
  }
  const std::uint64_t number = totals_.cells++;
  if (schema_->delay == 0) return code(number, block, entries, data, gives, last_use);
  for (std::uint32_t e : entries) ++entries_[e].waiting;
  return delay(block, entries, number, data);
}

/// Puts the cell into the delay buffer. If the buffer is full, codes the waiting cell that comes
/// next.
Result<void> MeshEncoder::delay(std::uint32_t block, std::span<const std::uint32_t> entries,
                                std::uint64_t number, std::span<const std::byte> data) {
  std::uint32_t handle = static_cast<std::uint32_t>(cells_.size());
  if (free_cells_.empty()) {
    cells_.emplace_back();
  } else {
    handle = free_cells_.back();
    free_cells_.pop_back();
  }
  WaitingCell& cell = cells_[handle];
  cell.block = block;
  cell.number = number;
  cell.data.assign(data.begin(), data.end());
  cell.entries.assign(entries.begin(), entries.end());
  if (is_hexahedral(schema_->blocks[block])) {
    SpiralReorderer::Corners eight{};
    // Passes vertex numbers instead of entries: an entry may soon be reused for another vertex,
    // which would look like a neighbour.
    for (std::size_t i = 0; i < 8; ++i) eight[i] = entries_[cell.entries[i]].number;
    reorderer_->push_hexahedron(handle, eight);
  } else {
    reorderer_->push_other(handle);
  }
  return reorderer_->waiting() <= schema_->delay ? Result<void>() : code_waiting();
}

Result<void> MeshEncoder::code_waiting() {
  const std::uint32_t handle = reorderer_->pop();
  free_cells_.push_back(handle);
  const WaitingCell& cell = cells_[handle];
  for (std::uint32_t e : cell.entries) --entries_[e].waiting;
  return code(cell.number, cell.block, cell.entries, cell.data, true, ~std::uint64_t{0});
}

Result<void> MeshEncoder::code_all_waiting() {
  while (reorderer_ && reorderer_->waiting() > 0)
    if (auto status = code_waiting(); !status) return status;
  return {};
}

// --- segments

/// Returns true if a segment begins before a cell of `block`. The decision depends only on counts
/// of added vertices and cells, so that the same calls produce the same bytes.
bool MeshEncoder::cut_is_due(std::uint32_t block) const {
  if (run_.cells == 0) return false;
  if (!options_.segment_starts.empty())
    return std::binary_search(options_.segment_starts.begin(), options_.segment_starts.end(),
                              totals_.cells);
  if (options_.segment_cells > 0) return run_.cells >= options_.segment_cells;
  if (!(options_.restart_budget > 0)) return false;
  const std::uint64_t least = block != last_block_ ? kLeastSegmentCells / 2 : kLeastSegmentCells;
  return run_.cells >= least && static_cast<double>(live_) <=
                                    options_.restart_budget * static_cast<double>(run_.introduced);
}

/// Returns the codecs to try on the current segment.
CodecTrial MeshEncoder::trial() const {
  const auto& codecs = options_.segment_connectivity;
  const ConnectivityCodec codec =
      codecs.empty() ? options_.connectivity
                     : codecs[std::min<std::size_t>(start_.segment, codecs.size() - 1)];
  CodecTrial trial = trial_for(*schema_, codec, options_.level);
  trial.with_order = schema_->order != Order::keep || options_.coding_order != nullptr;
  return trial;
}

/// Ends the current segment, to which the waiting cells belong.
Result<void> MeshEncoder::cut() {
  if (auto status = code_all_waiting(); !status) return status;
  if (auto status = end_segment(); !status) return status;
  if (reorderer_) reorderer_.emplace();
  ++start_.segment;
  start_.first_cell = given_cells_;
  start_.first_vertex = given_vertices_;
  run_ = {};
  return {};
}

Result<void> MeshEncoder::end() {
  if (auto status = code_all_waiting(); !status) return status;
  // The remaining vertices have not been used by any cell: encodes them in ascending order.
  std::vector<std::uint32_t> unused;
  for (std::uint32_t e = 0; e < entries_.size(); ++e)
    if (!entries_[e].used && by_number_.find(entries_[e].number) == e) unused.push_back(e);
  std::sort(unused.begin(), unused.end(), [&](std::uint32_t a, std::uint32_t b) {
    return entries_[a].number < entries_[b].number;
  });
  for (std::uint32_t entry : unused)
    if (auto status = code_unused(entry); !status) return status;
  if (auto status = end_segment(); !status) return status;
  if (auto status = catch_up(); !status) return status;
  let_go();
  return {};
}

/// Frees all data that only further cells would need, because coding of steps needs memory, too.
void MeshEncoder::let_go() {
  shm::let_go(entries_);
  shm::let_go(in_segment_);
  shm::let_go(values_);
  shm::let_go(free_entries_);
  shm::let_go(cells_);
  shm::let_go(free_cells_);
  by_number_ = NumberMap();
  reorderer_.reset();
  piece_ = SegmentPiece();
  encoder_.reset();
  tasks_.reset();
}

// --- into the current segment, in coding order

Result<void> MeshEncoder::code(std::uint64_t number, std::uint32_t block,
                               std::span<const std::uint32_t> entries,
                               std::span<const std::byte> data, bool may_give,
                               std::uint64_t may_end) {
  SegmentPiece::Cell cell;
  cell.number = number;
  cell.block = block;
  cell.nodes = static_cast<std::uint32_t>(entries.size());
  const std::size_t vertices_before = piece_.vertices.size();
  if (may_give)
    for (std::uint32_t e : entries)
      if (in_segment_[e] != start_.segment) give_vertex(e);
  cell.new_vertices = static_cast<std::uint32_t>(piece_.vertices.size() - vertices_before);
  if (may_end != 0) cell.last_use = end_vertices(entries, may_end);
  piece_.cells.push_back(cell);
  piece_.nodes.append(entries.data(), entries.size());
  piece_.cell_data.append(data.data(), data.size());
  ++given_cells_;
  return piece_is_full() ? pass_piece_on() : Result<void>();
}

/// Releases the vertices at the nodes in `may_end` that later cells do not use. Returns all nodes
/// of the cell at which these vertices occur, as a bit mask.
std::uint64_t MeshEncoder::end_vertices(std::span<const std::uint32_t> entries,
                                        std::uint64_t may_end) {
  const auto markable = entries.first(std::min<std::size_t>(entries.size(), kMaxLastUse));
  std::uint64_t last_use = 0;
  for (; may_end != 0; may_end &= may_end - 1) {
    const auto i = static_cast<std::size_t>(std::countr_zero(may_end));
    if (i >= markable.size()) break;
    const std::uint32_t e = markable[i];
    Entry& entry = entries_[e];
    if ((last_use >> i & 1) != 0 || !entry.ends || entry.waiting != 0) continue;
    for (std::size_t j = 0; j < markable.size(); ++j)
      if (markable[j] == e) last_use |= std::uint64_t{1} << j;
    if (entry.ticket != kNone) ending_tickets_.emplace_back(given_cells_, entry.ticket);
    push_tightly(free_entries_, e);
  }
  return last_use;
}

/// Passes a vertex that is new to the current segment to the encoder of the segment.
void MeshEncoder::give_vertex(std::uint32_t e) {
  Entry& entry = entries_[e];
  SegmentPiece::Vertex vertex;
  vertex.number = entry.number;
  vertex.handle = e;
  vertex.imported = in_segment_[e] != kNone;
  if (!vertex.imported) {
    ++given_vertices_;
    if (schema_->order != Order::keep) entry.ticket = new_ticket();
  }
  vertex.ticket = entry.ticket;
  in_segment_[e] = start_.segment;
  piece_.vertices.push_back(vertex);
  piece_.vertex_values.append(values_.data() + e * values_bytes_, values_bytes_);
}

std::uint32_t MeshEncoder::new_ticket() {
  if (free_tickets_.empty()) {
    free_tickets_.push_back(static_cast<std::uint32_t>(tickets_.size()));
    tickets_.push_back(0);
  }
  const std::uint32_t ticket = free_tickets_.back();
  free_tickets_.pop_back();
  return ticket;
}

Result<void> MeshEncoder::code_unused(std::uint32_t e) {
  SegmentPiece::Cell cell;
  cell.block = SegmentPiece::kUnused;
  cell.new_vertices = 1;
  piece_.cells.push_back(cell);
  SegmentPiece::Vertex vertex;
  vertex.number = entries_[e].number;
  vertex.handle = e;
  piece_.vertices.push_back(vertex);
  ++given_vertices_;
  piece_.vertex_values.append(values_.data() + e * values_bytes_, values_bytes_);
  by_number_.erase(entries_[e].number);
  push_tightly(free_entries_, e);
  return piece_is_full() ? pass_piece_on() : Result<void>();
}

bool MeshEncoder::piece_is_full() const {
  return piece_.cells.size() >= kPieceCells || 4 * piece_.nodes.size() >= kPieceBytes ||
         piece_.vertex_values.size() + piece_.cell_data.size() >= kPieceBytes;
}

Result<void> MeshEncoder::pass_piece_on() {
  if (piece_.empty()) return {};
  const bool begins = !std::exchange(segment_begun_, true);
  if (tasks_) {
    if (begins)
      tasks_->begin(std::make_unique<SegmentTask>(*schema_, options_.group_cells, trial(), start_));
    while (!tasks_->has_room())
      if (auto status = take_finished(Tasks::Wait::for_output_or_room); !status) return status;
    const std::size_t bytes = piece_.bytes();
    tasks_->push(std::move(piece_), bytes);
    piece_ = tasks_->spare();
    piece_.clear();
    return take_finished(Tasks::Wait::no);
  }
  if (begins)
    encoder_ = std::make_unique<ChoosingEncoder>(*schema_, options_.group_cells, trial(), start_);
  const auto status = encoder_->take(piece_, done_);
  piece_.clear();
  if (!status) return status;
  return give_out(done_);
}

Result<void> MeshEncoder::end_segment() {
  if (auto status = pass_piece_on(); !status) return status;
  if (!std::exchange(segment_begun_, false)) return {};
  if (tasks_) {
    tasks_->end();
    return {};
  }
  if (auto status = encoder_->end(done_); !status) return status;
  return give_out(done_);
}

Result<void> MeshEncoder::catch_up() {
  if (auto status = pass_piece_on(); !status) return status;
  return tasks_ ? take_finished(Tasks::Wait::for_output) : Result<void>();
}

/// Writes the groups that threads have finished. With for_output, waits for all groups of the
/// pieces passed on so far.
Result<void> MeshEncoder::take_finished(Tasks::Wait wait) {
  while (true) {
    auto group = tasks_->next(wait);
    if (!group) return group.error();
    if (!*group) return {};
    if (auto status = give_out(**group); !status) return status;
    if (wait == Tasks::Wait::for_output_or_room) wait = Tasks::Wait::no;
  }
}

// --- groups, in order

Result<void> MeshEncoder::give_out(std::vector<EncodedGroup>& groups) {
  for (EncodedGroup& group : groups)
    if (auto status = give_out(group); !status) return status;
  groups.clear();
  return {};
}

Result<void> MeshEncoder::give_out(EncodedGroup& group) {
  if (options_.coding_order != nullptr) report_order(group);
  if (!holds_groups_) return finish_group(group);
  held_.push_back(std::move(group));
  shm::let_go(held_.back().cell_numbers);
  return {};
}

Result<void> MeshEncoder::give_out_part(std::span<const std::uint64_t> numbers) {
  if (numbers.size() != foreign_tickets_.size())
    return misuse("there are " + std::to_string(foreign_tickets_.size()) +
                      " imported vertices, but " + std::to_string(numbers.size()) +
                      " numbers are given",
                  "mesh");
  for (std::size_t i = 0; i < numbers.size(); ++i) tickets_[foreign_tickets_[i]] = numbers[i];
  holds_groups_ = false;
  for (EncodedGroup& group : held_) {
    if (auto status = finish_group(group); !status) return status;
    group = EncodedGroup();
  }
  shm::let_go(held_);
  return {};
}

Result<void> MeshEncoder::finish_group(EncodedGroup& group) {
  container::GroupHeader& header = group.header;
  if (group.segment != segment_given_out_ || totals_.segments == 0) {
    segment_given_out_ = group.segment;
    ++totals_.segments;
    import_numbers_ = {};
  }
  if (schema_->order != Order::keep) {
    number_vertices(group);
    code_import_numbers(group);
  }
  totals_.vertices += header.vertices;
  totals_.imported_vertices += header.imported_vertices;
  totals_.hexahedra += group.hexahedra;
  totals_.max_active_vertices = std::max(totals_.max_active_vertices, header.max_active_vertices);
  return sink_(group.segment, header, group.streams);
}

/// Stores, by ticket, the stream numbers of the vertices that the group owns.
void MeshEncoder::number_vertices(EncodedGroup& group) {
  for (std::size_t i = 0; i < group.own.size(); ++i)
    if (group.own[i].ticket != kNone) tickets_[group.own[i].ticket] = group.header.first_vertex + i;
}

/// Adds a stream with the stream numbers of the vertices that the group imports; earlier groups own
/// these vertices.
void MeshEncoder::code_import_numbers(EncodedGroup& group) {
  using container::StreamKind;
  container::GroupHeader& header = group.header;
  for (const EncodedGroup::Import& import : group.imports) {
    import_numbers_.code(import_coder_, import.stencil, import.slot, tickets_[import.ticket]);
  }
  const std::uint64_t cells_done = header.first_cell + header.cells;
  for (; !ending_tickets_.empty() && ending_tickets_.front().first < cells_done;
       ending_tickets_.pop_front())
    free_tickets_.push_back(ending_tickets_.front().second);
  const std::vector<std::byte> bytes = import_coder_.finish();
  if (bytes.empty()) return;
  container::StreamEntry entry;
  entry.kind = StreamKind::vertex_numbers;
  entry.codec = container::Codec::predictive;
  entry.bytes = bytes.size();
  entry.checksum = checksum(bytes);
  std::size_t index = 0;
  while (index < header.streams.size() && header.streams[index].kind < entry.kind) ++index;
  const auto place = static_cast<std::ptrdiff_t>(index);
  header.streams.insert(header.streams.begin() + place, entry);
  group.streams.insert(group.streams.begin() + place, bytes);
}

/// Reports each vertex and cell of the group to the caller, in coding order.
void MeshEncoder::report_order(const EncodedGroup& group) const {
  for (const EncodedGroup::Vertex& vertex : group.own) options_.coding_order->vertex(vertex.number);
  for (std::uint64_t cell : group.cell_numbers) options_.coding_order->cell(cell);
}

// --- options

namespace {

/// Returns the furthest reference that the options allow. A trend needs two earlier steps since the
/// last key step, including the key step.
StepReference most_referred(const Schema& schema, const WriteOptions& options) {
  if (!has_steps(schema) || options.key_steps > 2) return StepReference::trend;
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
