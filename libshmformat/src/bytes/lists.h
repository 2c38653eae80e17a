// Lists that grow by an eighth, but small ones by as much again, up to 128 KiB: by slot, for what
// is kept of each vertex or cell of the active surface, and of the elements of a group. So memory
// follows surface and group closely; both stop growing soon.
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <type_traits>
#include <vector>

namespace shm {

/// The slot or place that is not there.
inline constexpr std::uint32_t kNone = 0xffffffffu;

/// The size of a list of `size` once there is room for `slot`, and some more.
inline std::size_t size_with_room(std::size_t size, std::size_t slot) {
  return slot < size ? size : std::max(slot + 1, size + size / 8);
}

/// Makes room for `slot`, and some more.
template <class T>
void make_room(std::vector<T>& list, std::size_t slot) {
  if (slot < list.size()) return;
  const std::size_t size = size_with_room(list.size(), slot);
  list.reserve(size);  // or it would double
  list.resize(size);
}

/// What is kept by slot; new where there was no room for it.
template <class T>
T& at_slot(std::vector<T>& list, std::size_t slot) {
  make_room(list, slot);
  return list[slot];
}

/// Makes room for `count` more elements at the end.
template <class T>
void expect_more(std::vector<T>& list, std::size_t count) {
  constexpr std::size_t kStep = (std::size_t{128} << 10) / sizeof(T);
  const std::size_t size = list.size() + count;
  if (size <= list.capacity()) return;
  const std::size_t step = std::max(list.size() / 8, std::min(list.size(), kStep));
  list.reserve(std::max(size, list.size() + step + 16));
}
/// The same for what is written much more often than it is kept: it grows by half.
template <class T>
void expect_more_soon(std::vector<T>& list, std::size_t count) {
  const std::size_t size = list.size() + count;
  if (size > list.capacity()) list.reserve(std::max(size, list.size() + list.size() / 2 + 16));
}
/// Makes room for `slot`, and for half as many again: of what is given room slot by slot.
template <class T>
void make_room_soon(std::vector<T>& list, std::size_t slot) {
  if (slot < list.size()) return;
  list.resize(std::max(slot + 1, list.size() + list.size() / 2));
}
template <class T>
void push_tightly(std::vector<T>& list, const T& element) {
  expect_more(list, 1);
  list.push_back(element);
}

/// A few bytes, of values, which are eights as a rule: for memcpy() each time is a call.
inline void copy_few(std::byte* to, const std::byte* from, std::size_t count) {
  for (; count >= 8; count -= 8, to += 8, from += 8) std::memcpy(to, from, 8);
  for (; count > 0; --count) *to++ = *from++;
}

/// Numbers or bytes that a few are added to at a time, very often: for a vector each time is a
/// call.
template <class T>
class ShortRuns {
 public:
  static_assert(std::is_trivially_copyable_v<T>);
  std::size_t size() const { return size_; }
  const T* data() const { return room_.data(); }
  const T& operator[](std::size_t i) const { return room_[i]; }
  /// Keeps its memory.
  void clear() { size_ = 0; }
  void append(const T* from, std::size_t count) {
    if (room_.size() - size_ < count) make_room_for(count);
    T* to = room_.data() + size_;
    size_ += count;
    if constexpr (sizeof(T) == 1)
      copy_few(to, from, count);
    else
      for (std::size_t i = 0; i < count; ++i) to[i] = from[i];
  }

 private:
  [[gnu::cold]] void make_room_for(std::size_t count) {
    room_.resize(std::max(size_ + count, 2 * size_ + 64));
  }

  std::vector<T> room_;
  std::size_t size_ = 0;
};

/// Frees its memory, which `list = {}` does not.
template <class T>
void let_go(std::vector<T>& list) {
  std::vector<T>().swap(list);
}

}  // namespace shm
