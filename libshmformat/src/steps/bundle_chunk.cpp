#include "steps/bundle_chunk.h"

#include <algorithm>

namespace shm {

static_assert(container::kBundleCodec == Codec::bundle);

Result<BundleChunk> BundleChunk::read(const Schema& schema,
                                      std::span<const container::StepPart> parts,
                                      std::span<const std::byte> bytes) {
  BundleChunk chunk;
  chunk.steps_ = parts[0].header.steps;
  std::vector<BundleArray> arrays;
  for (const container::StepPart& part : parts)
    for (std::uint32_t a = 0; a < part.header.arrays; ++a) {
      container::StepHeader header = part.header;
      header.array += a;
      header.arrays = 1;
      header.steps = 1;
      if (header.array >= schema.arrays.size() || !schema.arrays[header.array].per_step)
        return corrupt("does not belong to a stepped array", "step values");
      chunk.arrays_.push_back(header);
      arrays.push_back({&schema.arrays[header.array], header.count});
    }
  chunk.bundle_ = Bundle::read(bytes, arrays, chunk.steps_);
  if (!chunk.bundle_) return corrupt("the bundle is invalid", "step values");
  return chunk;
}

container::StepHeader BundleChunk::header(std::size_t pair) const {
  container::StepHeader header = arrays_[pair % arrays_.size()];
  header.step += pair / arrays_.size();
  header.reference_step = header.step;
  return header;
}

std::optional<std::size_t> BundleChunk::find(std::uint32_t array, std::uint64_t step) const {
  const auto found = std::lower_bound(arrays_.begin(), arrays_.end(), array,
                                      [](const container::StepHeader& header,
                                         std::uint32_t wanted) { return header.array < wanted; });
  if (found == arrays_.end() || found->array != array || step < found->step ||
      step - found->step >= steps_)
    return std::nullopt;
  return static_cast<std::size_t>(step - found->step) * arrays_.size() +
         static_cast<std::size_t>(found - arrays_.begin());
}

}  // namespace shm
