// Packs and unpacks messages between the ranks of a program. A message is a sequence of plain
// values, packed as bytes. in_rounds() exchanges messages between all ranks.
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

// Reads the values in a message that a Packer has packed. The values must be read in the order in
// which they were written.
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
  // Returns the bytes that one call to put_bytes() wrote. The result is a view of the message.
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

// Collective. Exchanges data in rounds until no rank has more data. In each round, every rank calls
// fill(to), which appends the next data for each rank r to to[r], and returns false if no data
// remains for further rounds. Then every rank calls take(bytes) once for the data from each rank,
// in order of the ranks. fill() and take() must not communicate with other ranks. If one of them
// throws on any rank, throws SharedFailure on all ranks.
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
