// Step values: a piece of one array at one time step, coded without the mesh.
// Two codecs, the smaller wins: `local` predicts each value from the one before with the
// predictive coder; `shuffled_zstd` sorts the bytes by significance and leaves them to zstd.
// spec: "Step values"
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "container/format.h"
#include "shm/schema.h"

namespace shm {

struct StepBytes {
  container::Codec codec = container::Codec::local;
  std::vector<std::byte> bytes;
};

/// `values`: whole elements of `info` in host order.
StepBytes encode_step_values(const ArrayInfo& info, std::span<const std::byte> values);
/// `count` elements; nothing when the bytes are damaged or the codec is unknown.
std::optional<std::vector<std::byte>> decode_step_values(const ArrayInfo& info,
                                                         container::Codec codec,
                                                         std::span<const std::byte> bytes,
                                                         std::uint32_t count);

}  // namespace shm
