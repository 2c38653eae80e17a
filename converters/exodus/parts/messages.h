// Messages that the ranks of a program send each other: sequences of plain values, packed as bytes.
// Also contains in_rounds(), in which every rank sends such messages to every rank.
#pragma once

#include <cstddef>
#include <cstdint>
#include <cstring>
#include <optional>
#include <span>
#include <string>
#include <type_traits>
#include <utility>
#include <vector>

#include "exodus/parts/ranks.h"

namespace shm::converters {

class Packer {
 public:
  template <class T>
  void put(const T& value) {
    static_assert(std::is_trivially_copyable_v<T>);
    append(std::as_bytes(std::span(&value, 1)));
  }
  void put_bytes(std::span<const std::byte> some) {
    put(std::uint64_t{some.size()});
    append(some);
  }
  void put_text(const std::string& text) { put_bytes(std::as_bytes(std::span(text))); }
  std::vector<std::byte> bytes;

 private:
  void append(std::span<const std::byte> some) {
    bytes.insert(bytes.end(), some.begin(), some.end());
  }
};

// Reads the values of a message that a Packer has written, in the same order.
class Unpacker {
 public:
  explicit Unpacker(std::span<const std::byte> bytes) : left_(bytes) {}
  bool empty() const { return left_.empty(); }
  template <class T>
  T get() {
    T value;
    std::memcpy(&value, take(sizeof value).data(), sizeof value);
    return value;
  }
  // Returns bytes that were packed together. The result is valid as long as the bytes of the
  // message.
  std::span<const std::byte> get_bytes() { return take(get<std::uint64_t>()); }
  std::string get_text() {
    const auto text = get_bytes();
    return {reinterpret_cast<const char*>(text.data()), text.size()};
  }
  std::span<const std::byte> take(std::size_t size) {
    const auto taken = left_.first(size);
    left_ = left_.subspan(size);
    return taken;
  }

 private:
  std::span<const std::byte> left_;
};

// Runs work(), unless `error` already contains an error. If work() throws, stores the error in
// `error`.
template <class Work>
void attempt(std::optional<Error>& error, Work&& work) {
  if (error) return;
  try {
    work();
  } catch (...) {
    error = current_error();
  }
}

// Collective. Exchanges data in rounds until no rank has more data. fill(to) appends the next data
// for each rank r to to[r], and returns false if there is no more data. take(bytes) receives the
// data of one rank; it is called in the order of ranks. Neither function may communicate with other
// ranks. Throws SharedFailure if one of them threw.
template <class Fill, class Take>
void in_rounds(Ranks& ranks, Fill&& fill, Take&& take) {
  std::optional<Error> error;
  for (;;) {
    std::vector<std::vector<std::byte>> to(ranks.size());
    bool more = false;
    attempt(error, [&] { more = fill(to); });
    ranks.agree(error);
    if (ranks.largest(more ? 1 : 0) == 0) return;
    const auto from = ranks.exchange(to);
    attempt(error, [&] {
      for (const auto& bytes : from) take(std::span<const std::byte>(bytes));
    });
  }
}

}  // namespace shm::converters
