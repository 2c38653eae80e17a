#include "segment/difference_columns.h"

namespace shm {

std::vector<DifferenceColumn> difference_columns(const Schema& schema) {
  std::vector<DifferenceColumn> columns;
  std::uint32_t room = kMostDifferenceRings;
  const auto add = [&](const ArrayInfo& info) {
    const bool may_differ = info.components < room;
    if (may_differ) room -= info.components + 1;
    columns.emplace_back(info, may_differ);
  };
  add(coordinates_info(schema));
  for (const ArrayInfo& info : schema.arrays)
    if (!info.per_step) add(info);
  return columns;
}

container::Codec stream_codec(BulkCodec codec) {
  return codec == BulkCodec::differences ? container::Codec::differences
                                         : container::Codec::shuffled_zstd;
}

std::optional<BulkCodec> bulk_codec(container::Codec codec) {
  if (codec == container::Codec::differences) return BulkCodec::differences;
  if (codec == container::Codec::shuffled_zstd) return BulkCodec::shuffled_zstd;
  return std::nullopt;
}

}  // namespace shm
