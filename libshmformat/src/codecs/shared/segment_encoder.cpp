#include "codecs/shared/segment_encoder.h"

#include <algorithm>
#include <string>
#include <utility>

#include "base/binary.h"
#include "base/errors.h"
#include "base/lists.h"
#include "codecs/shared/codec_id.h"
#include "codecs/shared/group_digest.h"
#include "codecs/shared/special_values.h"
#include "format/schema.h"

namespace shm {

void SegmentSize::add(container::StreamKind kind, std::uint64_t bytes) {
  using container::StreamKind;
  // Approximate size in bytes of a stream's entry in the group header
  constexpr std::uint64_t kStreamHeadBytes = 8;
  const bool of_values = kind == StreamKind::geometry || kind == StreamKind::array;
  const bool of_topology = kind == StreamKind::connectivity || kind == StreamKind::corner_order ||
                           kind == StreamKind::vertex_numbers;
  (of_values ? values : of_topology ? topology : besides) += bytes;
  (of_values ? values : besides) += kStreamHeadBytes;
}

SegmentEncoder::SegmentEncoder(const Schema& schema, const SegmentOptions& options,
                               const SegmentStart& start)
    : schema_(&schema),
      options_(options),
      start_(start),
      values_(schema),
      next_cell_(start.first_cell),
      next_vertex_(start.first_vertex) {
  for (const ArrayInfo& info : schema.arrays) {
    if (!info.per_step || !is_on_mesh(info.location)) continue;
    std::uint64_t& most = info.location == Location::point ? vertex_step_bytes_ : cell_step_bytes_;
    most = std::max<std::uint64_t>(most, scalar_bytes(info.type) * info.components);
  }
  if (options.with_digest && options.values) digest_ = std::make_unique<GroupDigest>(schema);
  begin_group();
}

SegmentEncoder::~SegmentEncoder() = default;

Result<void> SegmentEncoder::take(const SegmentPiece& piece, std::vector<EncodedGroup>& done) {
  Place place;
  for (const SegmentPiece::Cell& cell : piece.cells) {
    if (cell.block == SegmentPiece::kUnused) {
      encode_unused(piece, place.vertex);
      ++group_.header.unused_vertices;
    } else {
      if (group_.header.unused_vertices > 0)
        end_group(done);  // unused vertices come last in a group
      if (!encode_cell(piece, cell, place))
        return misuse("cell " + std::to_string(cell.number) +
                          " cannot be encoded: two vertices have the same number",
                      "mesh");
      if (options_.values) values_.add_cell(cell.block, piece.cell_data.data() + place.data);
      if (options_.with_order) group_.cell_numbers.push_back(cell.number);
      if (digest_)
        digest_->add_cell(cell, piece.nodes_of(cell, place.node), next_cell_ + group_.header.cells,
                          group_.late_nodes);
      place.data += values_.cell_bytes(cell.block);
      group_.header.decoded_bytes += values_.cell_bytes(cell.block) + 8 * cell.nodes;
      ++group_.header.cells;
      group_.hexahedra += is_hexahedral(schema_->blocks[cell.block]) ? 1 : 0;
    }
    place.node += cell.nodes;
    place.vertex += cell.new_vertices;
    place.other_last_use += cell.other_last_uses;
    if (is_full()) end_group(done);
  }
  return {};
}

void SegmentEncoder::take_vertex(const SegmentPiece& piece, std::size_t index) {
  const SegmentPiece::Vertex& vertex = piece.vertices[index];
  if (options_.values)
    values_.add_vertex(piece.vertex_values.data() + index * values_.vertex_bytes());
  container::GroupHeader& group = group_.header;
  if (digest_) digest_->add_vertex(vertex, next_vertex_ + group.vertices);
  group.decoded_bytes += values_.vertex_bytes();
  if (vertex.imported) {
    ++group.imported_vertices;
  } else {
    ++group.vertices;
    if (options_.with_order) group_.own.push_back({vertex.number, vertex.ticket});
  }
}

void SegmentEncoder::note_active(std::uint64_t active) {
  group_.header.max_active_vertices = std::max(group_.header.max_active_vertices, active);
}

void SegmentEncoder::add_stream(container::StreamEntry entry, std::vector<std::byte> bytes) {
  entry.bytes = bytes.size();
  entry.checksum = checksum(bytes);
  group_.header.streams.push_back(entry);
  group_.streams.push_back(std::move(bytes));
}

auto SegmentEncoder::values_of(std::size_t column) const -> ColumnValues {
  ColumnValues own{values_.values(column), values_.stride(column)};
  if (column == 0) return own;
  const ArrayInfo& info = schema_->arrays[values_.array(column)];
  const std::size_t count = values_.count(column);
  const auto special = SpecialValues::find(info, own.values, own.stride, count);
  if (!special) return own;
  own.special = special->encode();
  own.copy = plain_values(info, own.values, own.stride, count);
  own.values = own.copy.data();
  own.stride = own.copy.size() / count;
  return own;
}

void SegmentEncoder::add_values(std::size_t column, const ColumnValues& values, Codec codec,
                                std::vector<std::byte> bytes) {
  container::StreamEntry entry;
  entry.kind = column == 0 ? container::StreamKind::geometry : container::StreamKind::array;
  entry.array = column == 0 ? 0 : values_.array(column);
  entry.codec = values.special.empty() ? codec : with_special_values(codec);
  bytes.insert(bytes.begin(), values.special.begin(), values.special.end());
  add_stream(entry, std::move(bytes));
}

bool SegmentEncoder::is_full() const {
  const container::GroupHeader& group = group_.header;
  return group.cells >= options_.group_cells || group.decoded_bytes >= kFullGroupBytes ||
         group.vertices * vertex_step_bytes_ >= kFullGroupBytes ||
         group.cells * cell_step_bytes_ >= kFullGroupBytes ||
         group.vertices >= kManyGroupVertices ||
         (group.unused_vertices > 0 && group.vertices >= kFullGroupVertices);
}

void SegmentEncoder::begin_group() {
  group_.segment = start_.segment;
  group_.header.first_cell = next_cell_;
  group_.header.first_vertex = next_vertex_;
}

void SegmentEncoder::end_group(std::vector<EncodedGroup>& done) {
  encode_streams();
  for (const container::StreamEntry& entry : group_.header.streams)
    finished_.add(entry.kind, entry.bytes);
  group_.header.box = values_.box();
  if (digest_) {
    group_.header.version = container::with_digest(group_.header.version, true);
    group_.header.digest = digest_->finish(values_);
  }
  values_.clear();
  tile_ends_ = {};
  next_cell_ += group_.header.cells;
  next_vertex_ += group_.header.vertices;
  done.push_back(std::exchange(group_, group_like(group_)));
  begin_group();
}

SegmentSize SegmentEncoder::size() {
  SegmentSize size = finished_;
  if (has_group()) add_size_at_hand(size);
  return size;
}

void SegmentEncoder::end(std::vector<EncodedGroup>& done) {
  if (has_group()) end_group(done);
}

bool SegmentEncoder::has_group() const {
  const container::GroupHeader& group = group_.header;
  return group.cells + group.vertices + group.imported_vertices > 0;
}

}  // namespace shm
