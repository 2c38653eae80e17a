#include "mesh_streams.h"

#include <algorithm>
#include <array>

namespace shm {
namespace {

ArrayInfo coordinates_info(const Schema& schema) {
  ArrayInfo info;
  info.type = schema.coordinate_type;
  info.components = 3;
  info.quantization = schema.coordinate_quantization;
  return info;
}
ArrayInfo numbers_info() {
  ArrayInfo info;
  info.type = ScalarType::uint64;
  return info;
}

}  // namespace

namespace {

struct CodecPair {
  ConnectivityCodec said;
  container::Codec stream;
};
constexpr std::array kCodecs = {
    CodecPair{ConnectivityCodec::paper, container::Codec::paper},
    CodecPair{ConnectivityCodec::rows, container::Codec::rows},
    CodecPair{ConnectivityCodec::replay, container::Codec::replay},
    CodecPair{ConnectivityCodec::mixed, container::Codec::mixed},
};

}  // namespace

container::Codec stream_codec(ConnectivityCodec codec) {
  return std::find_if(kCodecs.begin(), kCodecs.end(),
                      [&](const CodecPair& it) { return it.said == codec; })
      ->stream;
}

std::optional<ConnectivityCodec> connectivity_codec(container::Codec codec) {
  for (const CodecPair& it : kCodecs)
    if (it.stream == codec) return it.said;
  return std::nullopt;
}

std::vector<std::size_t> cell_data_bytes(const Schema& schema) {
  std::vector<std::size_t> bytes(schema.blocks.size());
  for (std::uint32_t a = 0; a < schema.arrays.size(); ++a) {
    const ArrayInfo& info = schema.arrays[a];
    if (info.per_step || info.location != Location::cell) continue;
    for (std::uint32_t b = 0; b < bytes.size(); ++b)
      if (schema.array_covers(a, b)) bytes[b] += scalar_bytes(info.type) * info.components;
  }
  return bytes;
}

template <class Coder>
auto MeshStreams<Coder>::list(const Schema& schema) -> std::vector<Stream> {
  using container::StreamKind;
  std::vector<Stream> streams = {{StreamKind::connectivity},
                                 {StreamKind::corner_order},
                                 {StreamKind::cell_numbers},
                                 {StreamKind::vertex_numbers},
                                 {StreamKind::geometry}};
  for (std::uint32_t a = 0; a < schema.arrays.size(); ++a)
    if (!schema.arrays[a].per_step) streams.push_back({StreamKind::array, a});
  streams.push_back({StreamKind::imports});
  return streams;
}

template <class Coder>
MeshStreams<Coder>::MeshStreams(const Schema& schema, const SegmentStart& start)
    : schema_(&schema),
      connectivity_(schema),
      import_numbers_(VertexColumn<Coder>::create(numbers_info())),
      geometry_(VertexColumn<Coder>::create(coordinates_info(schema))),
      next_cell_number_(start.first_cell) {
  const auto streams = list(schema);
  streams_.resize(streams.size());
  imports_stream_ = streams.size() - 1;
  for (std::size_t s = kFixed; s < imports_stream_; ++s) {
    const ArrayInfo& info = schema.arrays[streams[s].array];
    if (info.location == Location::point) {
      point_columns_.push_back(VertexColumn<Coder>::create(info));
      point_arrays_.push_back(streams[s].array);
      point_streams_.push_back(s);
      point_data_bytes_ += scalar_bytes(info.type) * info.components;
    } else {
      cell_columns_.push_back(CellColumn<Coder>::create(info));
      cell_arrays_.push_back(streams[s].array);
      cell_streams_.push_back(s);
    }
  }
}

template <class Coder>
void MeshStreams<Coder>::code_vertex(const Stencil& stencil, std::uint32_t slot,
                                     VertexValues& values) {
  geometry_->code(streams_[kGeometry], stencil, slot, values.xyz);
  for (std::size_t i = 0; i < point_columns_.size(); ++i)
    point_columns_[i]->code(streams_[point_streams_[i]], stencil, slot, values.data[i]);
}

template <class Coder>
std::uint64_t MeshStreams<Coder>::code_cell_number(std::uint64_t number) {
  if (schema_->order == Order::keep && schema_->delay > 0) {
    const auto step = static_cast<std::int64_t>(number - next_cell_number_);
    number = next_cell_number_ +
             static_cast<std::uint64_t>(code_signed(streams_[kCellNumbers], cell_number_, step));
  } else {
    number = next_cell_number_;
  }
  next_cell_number_ = number + 1;
  return number;
}

template <class Coder>
void MeshStreams<Coder>::code_cell_values(const CellTopology& cell, std::span<std::byte*> data) {
  for (std::size_t i = 0; i < cell_columns_.size(); ++i) {
    if (schema_->array_covers(cell_arrays_[i], cell.block))
      cell_columns_[i]->code(streams_[cell_streams_[i]], cell, data[i]);
    else
      cell_columns_[i]->skip(cell);
  }
}

template class MeshStreams<RangeEncoder>;
template class MeshStreams<RangeDecoder>;

}  // namespace shm
