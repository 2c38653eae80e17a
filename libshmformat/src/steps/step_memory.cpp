#include "steps/step_memory.h"

#include <algorithm>
#include <bit>
#include <cstring>
#include <limits>

namespace shm {
namespace {

template <class T>
T load_at(std::span<const std::byte> from, std::size_t i) {
  T value{};
  std::memcpy(&value, from.data() + i, sizeof(T));
  return value;
}

template <class T>
void go_on_of_integers(std::span<const std::byte> last, std::span<const std::byte> before,
                       std::span<std::byte> out) {
  for (std::size_t i = 0; i < out.size(); i += sizeof(T)) {
    const auto a = static_cast<std::uint64_t>(load_at<T>(last, i));
    const auto b = static_cast<std::uint64_t>(load_at<T>(before, i));
    const auto next = static_cast<T>(a + (a - b));
    std::memcpy(out.data() + i, &next, sizeof(T));
  }
}

/// Computes the trend of floating-point values, last + (last - before). If the result is not
/// finite, uses `last` instead. The choice between the two is made on their bit patterns as
/// integers, so that the bits of a NaN do not change and no branch is needed.
template <class T, class Bits>
void go_on_of_floats(std::span<const std::byte> last, std::span<const std::byte> before,
                     std::span<std::byte> out) {
  constexpr Bits kInfinity = std::bit_cast<Bits>(std::numeric_limits<T>::infinity());
  for (std::size_t i = 0; i < out.size(); i += sizeof(T)) {
    const T a = load_at<T>(last, i), b = load_at<T>(before, i);
    const auto next = std::bit_cast<Bits>(static_cast<T>(a + (a - b)));
    const Bits kept = (next & kInfinity) == kInfinity ? load_at<Bits>(last, i) : next;
    std::memcpy(out.data() + i, &kept, sizeof(T));
  }
}

}  // namespace

StepReference most_reference(const Schema& schema, std::span<const std::uint64_t> elements) {
  if (schema.step_references == StepReference::nothing) return StepReference::nothing;
  std::uint64_t bytes = 0;
  for (std::size_t a = 0; a < schema.arrays.size(); ++a) {
    const ArrayInfo& info = schema.arrays[a];
    if (!info.per_step) continue;
    if (elements[a] > kMostReferenceBytes)
      return StepReference::nothing;  // avoids an overflow of the product below
    bytes += elements[a] * scalar_bytes(info.type) * info.components;
    if (bytes > kMostReferenceBytes) return StepReference::nothing;
  }
  return std::min(schema.step_references,
                  static_cast<StepReference>(std::clamp<std::uint64_t>(
                      kMostReferenceBytes / std::max<std::uint64_t>(bytes, 1), 1, 3)));
}

StepMemory memory_of(const ArrayInfo& array, StepReference most) {
  return StepMemory(array.per_step ? most : StepReference::nothing);
}

void go_on(ScalarType type, std::span<const std::byte> last, std::span<const std::byte> before,
           std::vector<std::byte>& out) {
  out.resize(last.size());
  switch (type) {
    case ScalarType::int8:
    case ScalarType::uint8: go_on_of_integers<std::uint8_t>(last, before, out); break;
    case ScalarType::int16:
    case ScalarType::uint16: go_on_of_integers<std::uint16_t>(last, before, out); break;
    case ScalarType::int32:
    case ScalarType::uint32: go_on_of_integers<std::uint32_t>(last, before, out); break;
    case ScalarType::int64:
    case ScalarType::uint64: go_on_of_integers<std::uint64_t>(last, before, out); break;
    case ScalarType::float32: go_on_of_floats<float, std::uint32_t>(last, before, out); break;
    case ScalarType::float64: go_on_of_floats<double, std::uint64_t>(last, before, out); break;
  }
}

void StepMemory::take(std::size_t offset, std::span<const std::byte> values, bool is_base) {
  if (most_ == StepReference::nothing) return;
  const auto put = [&](std::vector<std::byte>& to, std::span<const std::byte> from) {
    if (to.size() < offset + from.size()) to.resize(offset + from.size());
    std::copy(from.begin(), from.end(), to.begin() + static_cast<std::ptrdiff_t>(offset));
  };
  if (most_ >= StepReference::trend && last_.size() >= offset + values.size())
    put(before_last_, std::span(last_).subspan(offset, values.size()));
  put(last_, values);
  if (is_base && most_ == StepReference::base) put(base_, values);
}

void StepMemory::take_base(std::span<const std::byte> values) {
  if (most_ == StepReference::base) base_.assign(values.begin(), values.end());
}

std::span<const std::byte> StepMemory::reference(StepReference kind, const ArrayInfo& info,
                                                 std::size_t offset, std::size_t bytes) {
  if (kind == StepReference::nothing) return {};
  if (kind == StepReference::base) return std::span(base_).subspan(offset, bytes);
  const auto last = std::span(last_).subspan(offset, bytes);
  if (kind == StepReference::before) return last;
  go_on(info.type, last, std::span(before_last_).subspan(offset, bytes), trend_);
  return trend_;
}

}  // namespace shm
