#include "segment_encoder.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <string>
#include <utility>

#include "bytes/checksum.h"
#include "scalar_value.h"

namespace shm {
namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();
constexpr std::array<double, 6> kEmptyBox = {kInfinity,  kInfinity,  kInfinity,
                                             -kInfinity, -kInfinity, -kInfinity};

}  // namespace

SegmentEncoder::SegmentEncoder(const Schema& schema, const SegmentOptions& options,
                               const SegmentStart& start)
    : schema_(&schema),
      group_cells_(options.group_cells),
      codec_(options.codec),
      level_(options.level),
      has_values_(options.values),
      start_(start),
      streams_(schema, start),
      xyz_bytes_(3 * scalar_bytes(schema.coordinate_type)),
      values_bytes_(xyz_bytes_ + point_data_bytes(schema)),
      cell_data_bytes_(cell_data_bytes(schema)),
      range_of_array_(schema.arrays.size()),
      cell_values_(streams_.values().columns()),
      next_cell_(start.first_cell),
      next_vertex_(start.first_vertex) {
  streams_.connectivity().set_codec(codec_);
  streams_.values().expect_level(level_);
  for (const ArrayInfo& info : schema.arrays) {
    if (!info.per_step) continue;
    std::uint64_t& most = info.location == Location::point ? vertex_step_bytes_ : cell_step_bytes_;
    most = std::max<std::uint64_t>(most, scalar_bytes(info.type) * info.components);
  }
  start_group();
}

void SegmentEncoder::start_group() {
  group_ = {};
  group_.segment = start_.segment;
  group_.header.first_cell = next_cell_;
  group_.header.first_vertex = next_vertex_;
  group_.header.box = kEmptyBox;
  for (std::uint32_t a = 0; a < schema_->arrays.size(); ++a) {
    if (schema_->arrays[a].per_step) continue;
    range_of_array_[a] = group_.ranges.size();
    const std::size_t n = schema_->arrays[a].components;
    group_.ranges.push_back(
        {a, std::vector<double>(n, kInfinity), std::vector<double>(n, -kInfinity)});
  }
}

Result<void> SegmentEncoder::take(const SegmentPiece& piece, std::vector<EncodedGroup>& done) {
  Place at;
  for (const SegmentPiece::Cell& cell : piece.cells) {
    const container::GroupHeader& group = group_.header;
    introduce(piece, at.vertex, cell.new_vertices);
    if (cell.block == SegmentPiece::kLoose) {
      code_loose(piece, at.vertex);
      if (group.vertices >= kFullGroupVertices || holds_full_bytes()) flush_group(done);
    } else {
      if (group.loose_vertices > 0) flush_group(done);  // they stand last in their group
      if (!code_cell(piece, cell, at))
        return Error{ErrorCode::misuse,
                     "cell " + std::to_string(cell.number) +
                         " cannot be coded: two vertices have the same number",
                     "mesh",
                     kNoOffset,
                     {}};
      at.data += cell_data_bytes_[cell.block];
      if (group.cells >= group_cells_ || holds_full_bytes()) flush_group(done);
    }
    at.vertex += cell.new_vertices;
    at.node += cell.nodes;
  }
  return {};
}

void SegmentEncoder::end(std::vector<EncodedGroup>& done) {
  const container::GroupHeader& group = group_.header;
  if (group.cells + group.vertices + group.imported_vertices > 0) flush_group(done);
}

void SegmentEncoder::introduce(const SegmentPiece& piece, std::size_t first, std::size_t count) {
  for (std::size_t i = first; i < first + count; ++i) {
    const std::uint32_t handle = piece.vertices[i].handle;
    if (handle >= handles_.size())
      handles_.resize(std::max<std::size_t>(std::size_t{handle} + 1, handles_.size() * 2));
    handles_[handle] = {piece.vertices[i].number, kNone, static_cast<std::uint32_t>(i)};
  }
}

bool SegmentEncoder::code_cell(const SegmentPiece& piece, const SegmentPiece::Cell& cell,
                               const Place& at) {
  const auto nodes = std::span(piece.nodes).subspan(at.node, cell.nodes);
  topology_.block = cell.block;
  topology_.slots.resize(cell.nodes);
  topology_.numbers.assign(nodes.begin(), nodes.end());
  topology_.last_use.resize(cell.nodes);
  for (std::size_t i = 0; i < nodes.size(); ++i) {
    topology_.slots[i] = handles_[nodes[i]].slot;
    if (i < 8) topology_.original[i] = handles_[nodes[i]].number;
    topology_.last_use[i] = i < kMaxLastUse && (cell.last_use >> i & 1) != 0 ? 1 : 0;
  }
  if (tile_ends_.before(true, group_.header.decoded_bytes)) streams_.values().begin_tile();
  if (!streams_.code_cell(topology_)) return false;
  if (has_values_)
    streams_.values().begin_cell(topology_, streams_.connectivity().surface().active_vertices());
  code_new_vertices(piece, at);
  streams_.code_cell_number(cell.number);
  group_.cell_numbers.push_back(cell.number);
  if (has_values_) {
    take_cell_data(piece, cell.block, at.data);
    streams_.values().end_cell(topology_);
  }
  note_active();
  group_.header.decoded_bytes += cell_data_bytes_[cell.block] + 8 * nodes.size();
  ++group_.header.cells;
  group_.hexahedra += topology_.hexahedral ? 1 : 0;
  streams_.finish_cell(topology_);
  return true;
}

void SegmentEncoder::code_new_vertices(const SegmentPiece& piece, const Place& at) {
  if (start_.segment > 0) streams_.begin_new_vertices(topology_);
  const auto handle_at = [&](std::uint32_t position) -> Handle& {
    return handles_[piece.nodes[at.node + topology_.stored_position(position)]];
  };
  std::uint64_t number = 0;
  streams_.code_vertex_numbers(topology_, [&](std::uint32_t position) -> std::uint64_t& {
    number = piece.vertices[handle_at(position).vertex].number;
    return number;
  });
  for (std::uint32_t position : topology_.new_positions) {
    const std::uint32_t slot = topology_.slots[position];
    Handle& handle = handle_at(position);
    const SegmentPiece::Vertex& vertex = piece.vertices[handle.vertex];
    if (start_.segment > 0) {
      streams_.code_import(topology_, position, vertex.imported);
      if (vertex.imported && schema_->order != Order::keep)
        group_.imports.push_back(
            {vertex.ticket, slot, streams_.import_stencil(topology_, position)});
    }
    if (has_values_) streams_.values().add_vertex(topology_, position);
    take_vertex(piece, handle.vertex);
    handle.slot = slot;
  }
}

void SegmentEncoder::code_loose(const SegmentPiece& piece, std::size_t vertex) {
  if (tile_ends_.before(false, group_.header.decoded_bytes)) streams_.values().begin_tile();
  const std::uint32_t slot = streams_.connectivity().add_loose_vertex();
  std::uint64_t number = piece.vertices[vertex].number;
  streams_.code_loose_number(slot, number);
  if (has_values_) streams_.values().add_loose_vertex(slot);
  take_vertex(piece, vertex);
  ++group_.header.loose_vertices;
  note_active();
  streams_.connectivity().remove_loose_vertex(slot);
}

void SegmentEncoder::take_vertex(const SegmentPiece& piece, std::size_t index) {
  const SegmentPiece::Vertex& vertex = piece.vertices[index];
  const std::byte* values = piece.vertex_values.data() + index * values_bytes_;
  if (has_values_) vertex_values_.insert(vertex_values_.end(), values, values + values_bytes_);
  const std::byte* at = values + xyz_bytes_;
  for (std::uint32_t a = 0; a < schema_->arrays.size(); ++a) {
    const ArrayInfo& info = schema_->arrays[a];
    if (info.per_step || info.location != Location::point) continue;
    widen_range(a, at);
    at += scalar_bytes(info.type) * info.components;
  }
  container::GroupHeader& group = group_.header;
  for (std::size_t c = 0; c < 3; ++c) {
    const double v = scalar_value(schema_->coordinate_type, values, c);
    if (!std::isfinite(v)) continue;
    group.box[c] = std::min(group.box[c], v);
    group.box[3 + c] = std::max(group.box[3 + c], v);
  }
  group.decoded_bytes += values_bytes_;
  if (vertex.imported) {
    ++group.imported_vertices;
  } else {
    ++group.vertices;
    group_.born.push_back({vertex.number, vertex.ticket});
  }
}

void SegmentEncoder::take_cell_data(const SegmentPiece& piece, std::uint32_t block,
                                    std::size_t begin) {
  const std::byte* at = piece.cell_data.data() + begin;
  for (std::size_t column = 1; column < streams_.values().columns(); ++column) {
    const std::uint32_t a = streams_.values().array_of(column);
    const ArrayInfo& info = schema_->arrays[a];
    if (info.location != Location::cell || !schema_->array_covers(a, block)) continue;
    widen_range(a, at);
    const std::size_t bytes = scalar_bytes(info.type) * info.components;
    cell_values_[column].insert(cell_values_[column].end(), at, at + bytes);
    at += bytes;
  }
}

EncodedColumn SegmentEncoder::encode_column(std::size_t column) {
  ValueStreams<SplitEncoder>& values = streams_.values();
  if (column == 0) return values.encode(0, vertex_values_.data(), values_bytes_, level_);
  const ArrayInfo& info = schema_->arrays[values.array_of(column)];
  if (info.location == Location::cell)
    return values.encode(column, cell_values_[column].data(),
                         scalar_bytes(info.type) * info.components, level_);
  std::size_t at = xyz_bytes_;
  for (std::uint32_t a = 0; a < values.array_of(column); ++a) {
    const ArrayInfo& before = schema_->arrays[a];
    if (!before.per_step && before.location == Location::point)
      at += scalar_bytes(before.type) * before.components;
  }
  return values.encode(column, vertex_values_.data() + at, values_bytes_, level_);
}

bool SegmentEncoder::holds_full_bytes() const {
  const container::GroupHeader& group = group_.header;
  return group.decoded_bytes >= kFullGroupBytes ||
         group.vertices * vertex_step_bytes_ >= kFullGroupBytes ||
         group.cells * cell_step_bytes_ >= kFullGroupBytes;
}

void SegmentEncoder::note_active() {
  const std::uint64_t active = streams_.connectivity().surface().active_vertices();
  group_.header.max_active_vertices = std::max(group_.header.max_active_vertices, active);
}

void SegmentEncoder::widen_range(std::uint32_t a, const std::byte* element) {
  const ArrayInfo& info = schema_->arrays[a];
  container::ArrayRange& range = group_.ranges[range_of_array_[a]];
  for (std::size_t c = 0; c < info.components; ++c) {
    const double v = scalar_value(info.type, element, c);
    if (!std::isfinite(v)) continue;
    range.minimum[c] = std::min(range.minimum[c], v);
    range.maximum[c] = std::max(range.maximum[c], v);
  }
}

void SegmentEncoder::flush_group(std::vector<EncodedGroup>& done) {
  using container::StreamKind;
  const auto names = MeshStreams<RangeEncoder>::list(*schema_);
  for (std::size_t s = 0; s < names.size(); ++s) {
    const bool values = streams_.holds_values(s);
    if (values && !has_values_) continue;
    EncodedColumn column;
    if (values) column = encode_column(streams_.column_of(s));
    std::vector<std::byte> bytes = values ? std::move(column.bytes) : streams_.coders()[s].finish();
    container::StreamEntry entry;
    entry.kind = names[s].kind;
    entry.array = names[s].array;
    // An absent stream reads as zeros; it is there to tell its codec where that may be another one.
    const bool tells = values ? column.codec != ColumnCodec::predicted
                              : entry.kind == StreamKind::connectivity && group_.header.cells > 0;
    if (bytes.empty() && !tells) continue;
    entry.codec = values                                     ? stream_codec(column.codec)
                  : entry.kind >= StreamKind::vertex_numbers ? container::Codec::predictive
                                                             : stream_codec(codec_);
    const auto needs = [&](StreamKind kind) { entry.needs |= 1u << static_cast<unsigned>(kind); };
    if (entry.kind != StreamKind::connectivity) needs(StreamKind::connectivity);
    const bool by_corner =
        entry.kind == StreamKind::vertex_numbers && schema_->order == Order::keep;
    if (by_corner || values ||
        entry.kind == StreamKind::imports)  // in stored order, and along stored axes
      needs(StreamKind::corner_order);
    entry.bytes = bytes.size();
    entry.checksum = checksum(bytes);
    group_.header.streams.push_back(entry);
    group_.streams.push_back(std::move(bytes));
  }
  streams_.values().clear();
  vertex_values_.clear();
  for (auto& values : cell_values_) values.clear();
  tile_ends_ = {};
  next_cell_ += group_.header.cells;
  next_vertex_ += group_.header.vertices;
  done.push_back(std::move(group_));
  start_group();
}

}  // namespace shm
