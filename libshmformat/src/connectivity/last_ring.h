// LastRing: the last of a sequence, as many as a power of two, by how long ago they came.
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <vector>

namespace shm {

template <class T>
class LastRing {
 public:
  /// How many there are.
  std::uint64_t kept() const { return kept_; }
  /// The one `distance` before the next. Any distance is safe once there is one; those from 1 to
  /// kept() have a meaning.
  const T& operator[](std::uint64_t distance) const { return ring_[place(sequence_ - distance)]; }
  /// The place of the next one. A full ring that is narrower than `least` becomes twice as wide;
  /// else the oldest one leaves.
  T& push(std::uint64_t least) {
    if (kept_ == ring_.size() && ring_.size() < std::max(least, kFirst))
      widen(std::max<std::size_t>(2 * ring_.size(), kFirst));
    T& it = ring_[place(sequence_++)];
    kept_ = std::min<std::uint64_t>(kept_ + 1, ring_.size());
    return it;
  }
  /// Becomes as wide as another, with as many that are nothing.
  template <class Other>
  void begin_as(const LastRing<Other>& other) {
    ring_.assign(other.ring_.size(), T{});
    sequence_ = other.sequence_;
    kept_ = other.kept_;
  }

 private:
  template <class>
  friend class LastRing;
  static constexpr std::uint64_t kFirst = 64;

  std::size_t place(std::uint64_t sequence) const {
    return static_cast<std::size_t>(sequence) & (ring_.size() - 1);
  }
  void widen(std::size_t size) {
    std::vector<T> wider(size);
    for (std::uint64_t n = 1; n <= kept_; ++n)
      wider[static_cast<std::size_t>(sequence_ - n) & (size - 1)] = (*this)[n];
    ring_ = std::move(wider);
  }

  std::vector<T> ring_;
  std::uint64_t sequence_ = 0, kept_ = 0;
};

}  // namespace shm
