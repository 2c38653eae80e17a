// BundleChunk: the values of a step_values chunk that contains a bundle.
// spec: "Step values", "Bundles"
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "base/errors.h"
#include "codecs/bundles/bundle.h"
#include "codecs/shared/codec_id.h"
#include "format/format.h"
#include "shm/schema.h"

namespace shm {

class BundleChunk {
 public:
  /// Reads a bundle. `parts` are the headers of its chunk, `bytes` the rest of the payload. Fails
  /// with ErrorCode::corrupt if the data is damaged. Errors contain no offset.
  static Result<BundleChunk> read(const Schema& schema, std::span<const container::StepPart> parts,
                                  std::span<const std::byte> bytes);

  /// Returns the number of pairs of an array and a step. Pairs are in the order of their steps;
  /// those of one step are in the order of their arrays.
  std::size_t pairs() const { return arrays_.size() * static_cast<std::size_t>(steps_); }
  /// Returns the header of a pair. Its field `codec` is Codec::bundle.
  container::StepHeader header(std::size_t pair) const;
  /// Returns the values of a pair, packed.
  std::vector<std::byte> values(std::size_t pair) const {
    return bundle_->values(pair % arrays_.size(), pair / arrays_.size());
  }
  /// Returns the pair of this array and step, or nullopt if the bundle does not contain it.
  std::optional<std::size_t> find(std::uint32_t array, std::uint64_t step) const;

 private:
  std::vector<container::StepHeader> arrays_;  // headers of all arrays at the first step
  std::uint64_t steps_ = 0;
  std::optional<Bundle> bundle_;
};

/// Returns the share of the bytes of a bundle that counts for the nth of its `arrays` arrays.
constexpr std::uint64_t share_of_bundle(std::uint64_t bytes, std::uint64_t arrays,
                                        std::uint64_t nth) {
  return bytes / arrays + (nth < bytes % arrays ? 1 : 0);
}

/// Calls visit(array, bytes) for each array of a bundle. `bytes` is the array's share of the bytes
/// of the bundle.
template <class Visit>
void for_each_share(std::span<const container::StepPart> parts, Visit&& visit) {
  std::uint64_t arrays = 0, nth = 0;
  for (const container::StepPart& part : parts) arrays += part.header.arrays;
  for (const container::StepPart& part : parts)
    for (std::uint32_t a = 0; a < part.header.arrays; ++a, ++nth)
      visit(part.header.array + a, share_of_bundle(parts[0].bytes, arrays, nth));
}

}  // namespace shm
