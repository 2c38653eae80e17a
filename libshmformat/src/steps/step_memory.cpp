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

StepMemory::StepMemory(StepStore& store, StepReference most, std::uint64_t bytes) {
  const std::size_t recent = std::min<std::size_t>(static_cast<std::size_t>(most), 2);
  recent_.reserve(recent);
  for (std::size_t i = 0; i < recent; ++i) recent_.emplace_back(store, bytes);
  if (most == StepReference::base) base_.emplace(store, bytes);
}

Result<void> StepMemory::take(std::uint64_t offset, std::span<const std::byte> values,
                              bool is_base) {
  if (recent_.empty()) return {};
  if (offset == 0) ++steps_;
  if (auto status = recent_step(steps_ - 1).write(offset, values); !status) return status;
  return is_base && base_ ? base_->write(offset, values) : Result<void>();
}

Result<void> StepMemory::take_base(std::span<const std::byte> values) {
  return base_ ? base_->write(0, values) : Result<void>();
}

Result<ReferenceValues> StepMemory::reference(StepReference kind, const ArrayInfo& info,
                                              std::uint64_t offset, std::size_t bytes) {
  if (kind == StepReference::nothing) return ReferenceValues();
  const auto only = [](Result<std::span<const std::byte>> values) -> Result<ReferenceValues> {
    if (!values) return values.error();
    return ReferenceValues{*values, {}};
  };
  if (kind == StepReference::base) return only(base_->read(offset, bytes));
  // Number of steps that are stored completely.
  const std::uint64_t complete = steps_ - (offset == 0 ? 0 : 1);
  const auto last = recent_step(complete - 1).read(offset, bytes);
  if (!last || kind == StepReference::before) return only(last);
  const auto before = recent_step(complete).read(offset, bytes);
  if (!before) return before.error();
  go_on(info.type, *last, *before, trend_);
  return ReferenceValues{trend_, *last};
}

StepMemory memory_of(StepStore& store, const ArrayInfo& array, std::uint64_t elements,
                     StepReference most) {
  if (!array.per_step || most == StepReference::nothing) return {};
  const std::uint64_t stride = scalar_bytes(array.type) * array.components;
  constexpr std::uint64_t kMost = ~std::uint64_t{0};
  return StepMemory(store, most, elements > kMost / stride ? kMost : elements * stride);
}

}  // namespace shm
