// Functions for vectors that grow in small steps. Many lists are indexed by slot. They contain data
// of the vertices and cells of the active surface, or of the elements of a group. While such a list
// is small, growing doubles its size, but adds at most 128 KiB. A large list grows by an eighth.
// The lists therefore need only a little more memory than their contents. The contents stop growing
// early in a file, because the active surface and the groups do.
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <type_traits>
#include <vector>

namespace shm {

/// Invalid slot or index, which means "none".
inline constexpr std::uint32_t kNone = 0xffffffffu;

/// Returns the size to which a list of `size` elements must grow so that index `slot` is valid:
/// `size` if `slot` is already valid, otherwise at least an eighth more than `size`.
inline std::size_t size_with_room(std::size_t size, std::size_t slot) {
  return slot < size ? size : std::max(slot + 1, size + size / 8);
}

/// Grows the list until `slot` is a valid index. If the list grows, it grows by at least an eighth.
template <class T>
void make_room(std::vector<T>& list, std::size_t slot) {
  if (slot < list.size()) return;
  const std::size_t size = size_with_room(list.size(), slot);
  list.reserve(size);  // resize() alone would double the capacity
  list.resize(size);
}

/// Returns the element at `slot`, growing the list if necessary.
template <class T>
T& at_slot(std::vector<T>& list, std::size_t slot) {
  make_room(list, slot);
  return list[slot];
}

/// Reserves memory for `count` more elements at the end of the list.
template <class T>
void expect_more(std::vector<T>& list, std::size_t count) {
  constexpr std::size_t kStep = (std::size_t{128} << 10) / sizeof(T);
  const std::size_t size = list.size() + count;
  if (size <= list.capacity()) return;
  const std::size_t step = std::max(list.size() / 8, std::min(list.size(), kStep));
  list.reserve(std::max(size, list.size() + step + 16));
}
/// Reserves memory for `count` more elements at the end of the list. Unlike expect_more(),
/// increases the capacity by at least half. Suits short-lived lists that are appended to often.
template <class T>
void expect_more_soon(std::vector<T>& list, std::size_t count) {
  const std::size_t size = list.size() + count;
  if (size > list.capacity()) list.reserve(std::max(size, list.size() + list.size() / 2 + 16));
}
/// Grows the list until `slot` is a valid index. If the list grows, it grows by at least half.
/// Suits lists whose slots are added one by one.
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

/// Copies a small number of bytes, usually a multiple of eight. memcpy() with a variable size would
/// be a function call each time.
inline void copy_few(std::byte* to, const std::byte* from, std::size_t count) {
  for (; count >= 8; count -= 8, to += 8, from += 8) std::memcpy(to, from, 8);
  for (; count > 0; --count) *to++ = *from++;
}

/// A list of numbers or bytes to which short runs are appended very often. Unlike
/// std::vector::insert(), append() is usually inlined.
template <class T>
class ShortRuns {
 public:
  static_assert(std::is_trivially_copyable_v<T>);
  std::size_t size() const { return size_; }
  const T* data() const { return room_.data(); }
  const T& operator[](std::size_t i) const { return room_[i]; }
  /// Removes all elements, and keeps the memory for reuse.
  void clear() { size_ = 0; }
  /// Appends `count` elements, whose values the caller must set. The pointer is valid until the
  /// next call.
  T* append(std::size_t count) {
    if (room_.size() - size_ < count) make_room_for(count);
    size_ += count;
    return room_.data() + (size_ - count);
  }
  void append(const T* from, std::size_t count) {
    T* const to = append(count);
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

/// Removes all elements and frees their memory, which `list = {}` does not.
template <class T>
void let_go(std::vector<T>& list) {
  std::vector<T>().swap(list);
}

}  // namespace shm
