// BigArray: an array of numbers that is held in memory, or in a Spool if it may be large.
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <utility>
#include <vector>

#include "base/spool.h"

namespace shm::converters {

template <class T>
class BigArray {
 public:
  // Creates an array of `size` zeros. `spool` is borrowed. If `spool` is null, the array is in
  // memory.
  explicit BigArray(Spool* spool = nullptr, std::uint64_t size = 0) : size_(size) {
    if (spool != nullptr)
      paged_ = std::make_unique<PagedArray>(*spool, sizeof(T));
    else
      held_.resize(size);
  }
  explicit BigArray(std::vector<T> values) : held_(std::move(values)), size_(held_.size()) {}

  std::uint64_t size() const { return size_; }
  T get(std::uint64_t index) const {
    return paged_ ? paged_->template get<T>(index) : held_[index];
  }
  T operator[](std::uint64_t index) const { return get(index); }
  void set(std::uint64_t index, const T& value) {
    if (paged_)
      paged_->set(index, value);
    else
      held_[index] = value;
  }
  void push_back(const T& value) {
    if (paged_)
      paged_->set(size_, value);
    else
      held_.push_back(value);
    ++size_;
  }
  // Removes the last element and returns it. The array must not be empty. If the array is in a
  // spool, its pages are not freed.
  T pop_back() {
    const T value = get(--size_);
    if (!paged_) held_.pop_back();
    return value;
  }
  void reserve(std::uint64_t size) {
    if (!paged_) held_.reserve(size);
  }
  // Moves the array into a vector in memory.
  operator std::vector<T>() && {
    if (!paged_) return std::move(held_);
    std::vector<T> all(size_);
    paged_->read(0, size_, reinterpret_cast<std::byte*>(all.data()));
    return all;
  }

 private:
  std::vector<T> held_;
  std::unique_ptr<PagedArray> paged_;  // null if the elements are in held_
  std::uint64_t size_;
};

}  // namespace shm::converters
