#include "segment/mesh_streams.h"

#include <algorithm>
#include <array>

namespace shm {
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
    CodecPair{ConnectivityCodec::shifts, container::Codec::shifts},
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

container::Codec stream_codec(ColumnCodec codec) {
  switch (codec) {
    case ColumnCodec::predicted: break;
    case ColumnCodec::mixed: return container::Codec::mixed_columns;
    case ColumnCodec::shuffled_zstd: return container::Codec::shuffled_zstd;
  }
  return container::Codec::columns;
}

std::optional<ColumnCodec> column_codec(container::Codec codec) {
  for (ColumnCodec it : {ColumnCodec::predicted, ColumnCodec::mixed, ColumnCodec::shuffled_zstd})
    if (stream_codec(it) == codec) return it;
  return std::nullopt;
}

std::size_t point_data_bytes(const Schema& schema) {
  std::size_t bytes = 0;
  for (const ArrayInfo& info : schema.arrays)
    if (info.location == Location::point && !info.per_step)
      bytes += scalar_bytes(info.type) * info.components;
  return bytes;
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
      values_(schema),
      cell_numbers_(schema, start.first_cell) {
  streams_.resize(list(schema).size());
  imports_stream_ = streams_.size() - 1;
}

template class MeshStreams<RangeEncoder>;
template class MeshStreams<RangeDecoder>;

}  // namespace shm
