// Step values: one stepped array at one step, group by group.
// Two codecs, the smaller wins: `columns` predicts each value over the mesh, from its neighbours and
// perhaps from the step before; `shuffled_zstd` sorts the bytes by significance and leaves them to
// zstd.
// spec: "Step values"
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "container/format.h"
#include "topology_replay.h"

namespace shm {

/// Arrays of more components are left to zstd: columns cost memory each.
inline constexpr std::uint32_t kMostStepComponents = 1024;
/// Values may refer to the step before if one step of all stepped arrays takes no more than this,
/// which both sides hold.
inline constexpr std::uint64_t kMostReferenceBytes = std::uint64_t{1} << 27;

/// `elements`: how many each array has, by array.
bool steps_may_refer(const Schema& schema, std::span<const std::uint64_t> elements);

struct StepBytes {
  container::Codec codec = container::Codec::columns;
  std::vector<std::byte> bytes;
};

/// The values of one array at one step through `columns`.
template <class Coder>
class StepColumn {
 public:
  /// `schema` is borrowed.
  StepColumn(const Schema& schema, std::uint32_t array) : schema_(&schema), array_(array) {}

  /// Before each group in columns. It goes on with what the group before has left, if that is of the
  /// same segment. False if it cannot, because only one of both refers to another step.
  bool begin(std::uint32_t segment, bool refers);
  /// After a group that was coded otherwise: the next one starts afresh.
  void forget() { column_.reset(); }

  /// Encoding. `values`: those of the group's elements; `reference`: theirs at the reference step,
  /// or empty.
  std::vector<std::byte> encode(const GroupElements& elements, std::span<const std::byte> values,
                                std::span<const std::byte> reference) requires(!Coder::kDecodes);
  /// Decoding. Nothing for damaged data.
  std::optional<std::vector<std::byte>> decode(
      const GroupElements& elements, std::span<const std::byte> bytes,
      std::span<const std::byte> reference) requires(Coder::kDecodes);

 private:
  const TiledItems& items(const GroupElements& elements) const {
    return schema_->arrays[array_].location == Location::point ? elements.vertices : elements.cells;
  }

  const Schema* schema_;
  std::uint32_t array_;
  std::optional<ValueColumn<Coder>> column_;
  std::uint32_t segment_ = 0;
  bool refers_ = false;
};

extern template class StepColumn<RangeEncoder>;
extern template class StepColumn<RangeDecoder>;

/// `values`: whole elements in host order.
std::vector<std::byte> shuffle_and_compress(const ArrayInfo& info,
                                            std::span<const std::byte> values);
/// `count` elements; nothing when the bytes are damaged.
std::optional<std::vector<std::byte>> decompress_shuffled(const ArrayInfo& info,
                                                          std::span<const std::byte> bytes,
                                                          std::uint64_t count);

}  // namespace shm
