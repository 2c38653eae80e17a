#include "codecs/shared/group_decoder.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "base/errors.h"
#include "codecs/shared/codec_id.h"

namespace shm {
namespace {

/// Removes each element for which `marked` is not zero. `stride`: size of an element in bytes.
void remove_marked(std::vector<std::byte>& values, std::span<const std::uint8_t> marked,
                   std::size_t stride) {
  std::size_t to = 0;
  for (std::size_t i = 0; i < marked.size(); ++i) {
    if (marked[i] != 0) continue;
    std::copy_n(values.begin() + static_cast<std::ptrdiff_t>(i * stride), stride,
                values.begin() + static_cast<std::ptrdiff_t>(to));
    to += stride;
  }
  values.resize(to);
}

}  // namespace

GroupDecoder::GroupDecoder(const Schema& schema, const SegmentStart& start, DecodedParts parts,
                           CellBytes cell_bytes)
    : schema_(&schema),
      start_(start),
      parts_(std::move(parts)),
      vertex_bytes_(3 * scalar_bytes(schema.coordinate_type) + point_data_bytes(schema)),
      cell_bytes_(std::move(cell_bytes)) {
  for (std::uint32_t a = 0; a < schema.arrays.size(); ++a)
    if (!schema.arrays[a].per_step) arrays_.push_back(a);
}

Error GroupDecoder::wrong_stream(const container::StreamEntry& entry) {
  return corrupt(container::stream_name(entry.kind) + ": unknown or out of order");
}

Error GroupDecoder::unknown_codec(const container::StreamEntry& entry) {
  return unsupported(container::stream_name(entry.kind) + ": codec " +
                     std::to_string(static_cast<int>(entry.codec)) + " is unknown for this stream");
}

Result<void> GroupDecoder::begin_group(const container::GroupHeader& header,
                                       std::optional<ConnectivityCodec> known) {
  header_ = &header;
  constexpr double kInfinity = std::numeric_limits<double>::infinity();
  done_ = {};
  done_.box.fill({kInfinity, -kInfinity});
  left_out_.clear();
  special_.clear();
  if (const auto codec = container::connectivity_of(header)) {
    if (codec_ && *codec_ != *codec)
      return corrupt("connectivity: its codec differs from that of earlier groups in this segment");
    if (!known) return unknown_codec(header.streams[0]);
  }
  if (auto status = begin_streams(known); !status) return status;
  if (known) codec_ = header.streams[0].codec, codec_name_ = *known;
  return {};
}

Result<void> GroupDecoder::begin_stream(const container::StreamEntry& entry,
                                        std::span<const std::byte> bytes) {
  const std::size_t column = column_of(entry);
  if (!has_special_values(entry.codec) || column == 0 || column == columns())
    return begin_plain_stream(entry, entry.codec, bytes);
  const ArrayInfo& info = schema_->arrays[array_of(column)];
  auto special =
      SpecialValuesDecoder::read(info, bytes, header_->decoded_bytes / scalar_bytes(info.type));
  if (!special)
    return corrupt(array_stream_name(*schema_, entry.array) + ": its special values are invalid");
  special_.insert_or_assign(column, std::move(*special));
  return begin_plain_stream(entry, without_special_values(entry.codec), bytes);
}

Result<void> GroupDecoder::next_block(DecodedBlock& decoded) {
  MeshBlock& block = decoded.mesh;
  decoded.segment = start_;
  decoded.connectivity = codec_name_;
  block.first_vertex = header_->first_vertex + done_.own;
  block.first_cell = header_->first_cell + done_.cells;
  block.arrays.resize(schema_->arrays.size());
  if (auto status = decode_elements(decoded); !status) return status;
  return decode_values(block);
}

/// Appends a vertex number and its import flag to the results. Omits results that the caller did
/// not request.
void GroupDecoder::note_import(std::uint64_t number, bool imported, DecodedBlock& decoded) {
  if (imported) decoded.imported.push_back(number);
  if (!imported || parts_.imported_vertices) decoded.mesh.vertex_numbers.push_back(number);
  if (parts_.imported_vertices)
    decoded.mesh.imported.push_back(imported ? 1 : 0);
  else if (may_import())
    left_out_.push_back(imported ? 1 : 0);
}

void GroupDecoder::add_own_vertices(std::span<const std::uint64_t> numbers, DecodedBlock& decoded) {
  MeshBlock& block = decoded.mesh;
  block.vertex_numbers.insert(block.vertex_numbers.end(), numbers.begin(), numbers.end());
  if (parts_.imported_vertices)
    block.imported.resize(block.imported.size() + numbers.size());
  else if (may_import())
    left_out_.resize(left_out_.size() + numbers.size());
  done_.own += numbers.size();
  done_.bytes += numbers.size() * vertex_bytes_;
}

void GroupDecoder::resize_cells(std::size_t cells, MeshBlock& block) {
  for (auto* list : {&block.vertices_before_cell, &block.cell_numbers, &block.last_use})
    list->resize(cells);
  block.cell_blocks.resize(cells);
  block.corner_begin.resize(cells + 1);
}

std::size_t GroupDecoder::make_room_for_cells(std::uint64_t cells, std::size_t nodes,
                                              MeshBlock& block) const {
  const auto most =
      static_cast<std::size_t>(std::min<std::uint64_t>(header_->cells - done_.cells, cells));
  block.corners.resize(most * nodes);
  resize_cells(most, block);
  block.corner_begin[0] = 0;
  return most;
}

void GroupDecoder::begin_cells(MeshBlock& block) {
  for (auto* list :
       {&block.vertices_before_cell, &block.cell_numbers, &block.last_use, &block.corners})
    list->clear();
  block.cell_blocks.clear();
  block.other_last_uses.clear();
  block.corner_begin.assign(1, 0);
}

void GroupDecoder::keep_cells(std::size_t cells, MeshBlock& block) {
  resize_cells(cells, block);
  block.corners.resize(static_cast<std::size_t>(block.corner_begin[cells]));
}

std::size_t GroupDecoder::column_of(const container::StreamEntry& entry) const {
  if (entry.kind == container::StreamKind::geometry) return 0;
  if (entry.kind != container::StreamKind::array) return columns();
  const auto found = std::lower_bound(arrays_.begin(), arrays_.end(), entry.array);
  return found != arrays_.end() && *found == entry.array
             ? static_cast<std::size_t>(found - arrays_.begin()) + 1
             : columns();
}

std::size_t GroupDecoder::element_bytes(std::size_t column) const {
  if (column == 0) return 3 * scalar_bytes(schema_->coordinate_type);
  const ArrayInfo& info = schema_->arrays[array_of(column)];
  return scalar_bytes(info.type) * info.components;
}

/// Decodes the values of the cells and vertices of the block, column by column.
Result<void> GroupDecoder::decode_values(MeshBlock& block) {
  const bool leaves_out = std::find(left_out_.begin(), left_out_.end(), 1) != left_out_.end();
  for (std::size_t c = 0; c < columns(); ++c) {
    if (!is_wanted(c)) continue;
    std::vector<std::byte>& out = c == 0 ? block.xyz : block.arrays[array_of(c)];
    const auto special = special_.find(c);
    if (!decode_column(c, block, out) ||
        (special != special_.end() && !special->second.restore(out))) {
      if (is_out_of_memory())
        return over_limit(
            "the values of the active vertices and cells need more memory than the limit for "
            "a segment of this size");
      return corrupt((c == 0 ? "geometry" : array_stream_name(*schema_, array_of(c))) +
                     ": its values are invalid or too few");
    }
    if (c == 0) widen_box(out);  // the bounding box includes imported vertices
    if (leaves_out && !of_cells(c)) remove_marked(out, left_out_, element_bytes(c));
  }
  left_out_.clear();
  return {};
}

Result<DecodedBlock::GroupEnd> GroupDecoder::end_group() const {
  if (done_.bytes != header_->decoded_bytes || done_.active != header_->max_active_vertices ||
      done_.unused != header_->unused_vertices || done_.imported != header_->imported_vertices)
    return corrupt("its contents do not match its header");
  const auto has_end = [](const auto& special) { return special.second.at_end(); };
  if (!is_used_up() || !std::all_of(special_.begin(), special_.end(), has_end))
    return corrupt("its streams contain data after the end of the group");
  return DecodedBlock::GroupEnd{done_.imported, done_.active, has_its_box(), {}, 0};
}

void GroupDecoder::widen_box(std::span<const std::byte> xyz) {
  const std::size_t stride = 3 * scalar_bytes(schema_->coordinate_type);
  const auto more = box_of(schema_->coordinate_type, xyz.data(), xyz.size() / stride, stride);
  for (std::size_t c = 0; c < 3; ++c) {
    done_.box[c].minimum = std::min(done_.box[c].minimum, more[c].minimum);
    done_.box[c].maximum = std::max(done_.box[c].maximum, more[c].maximum);
  }
}

/// Returns true if the bounding box in the header matches the decoded coordinates. The header
/// contains the bounding box of the original coordinates; in quantized arrays, the decoded box may
/// therefore differ by the error bound.
bool GroupDecoder::has_its_box() const {
  if (!parts_.geometry) return true;
  const Quantization& rounded = schema_->coordinate_quantization;
  const double by = rounded.lossy() ? rounded.max_error(schema_->coordinate_type) : 0;
  const auto fits = [by](double stated, double found) {
    return stated == found || std::abs(stated - found) <= by;
  };
  for (std::size_t c = 0; c < 3; ++c)
    if (!fits(header_->box[c], done_.box[c].minimum) ||
        !fits(header_->box[3 + c], done_.box[c].maximum))
      return false;
  return true;
}

}  // namespace shm
