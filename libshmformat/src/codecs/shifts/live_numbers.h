// LiveNumbers: the set of the numbers of live vertices. Each number has a flag that states whether
// the vertex is imported. The numbers are stored in words with one bit for each of 64 consecutive
// numbers. The words are in a hash table with open addressing. Consecutive numbers therefore share
// a cache line; an isolated number needs 64 to 128 bytes.
#pragma once

#include <algorithm>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "base/number_map.h"

namespace shm {

class LiveNumbers {
 public:
  enum class State : std::uint8_t { dead, own, imported };

  State state(std::uint64_t number) const {
    const Word& word = word_at(number >> 6);
    if ((word.live >> (number & 63) & 1) == 0) return State::dead;
    return (word.imported >> (number & 63) & 1) != 0 ? State::imported : State::own;
  }
  /// Returns true if the vertex number is live. `hint`: index in the table at which the search
  /// begins, usually the index found for a nearby number. The hint may have any value; the function
  /// updates it.
  bool is_live(std::uint64_t number, std::size_t& hint) const {
    const Word& word = words_[hint & mask_];
    if (word.live != 0 && word.number == number >> 6) return (word.live >> (number & 63) & 1) != 0;
    hint = place_of(number >> 6);
    return (words_[hint].live >> (number & 63) & 1) != 0;
  }
  /// Adds a number. Returns false if it is already live.
  bool add(std::uint64_t number, bool imported) {
    const std::uint64_t bit = std::uint64_t{1} << (number & 63);
    if ((word_at(number >> 6).live & bit) != 0) return false;
    Word& word = add_bits(number >> 6, bit);
    if (imported) word.imported |= bit;
    return true;
  }
  /// Removes a number, if it is live. Returns its state before the removal.
  State remove(std::uint64_t number) {
    const State was = state(number);
    remove_bits(number >> 6, std::uint64_t{1} << (number & 63));
    return was;
  }

  // A run: the state of up to 64 consecutive numbers. Bit i belongs to number first + i. The last
  // number of a run must be less than 2^64.

  struct Run {
    std::uint64_t live = 0, imported = 0;
  };
  Run run(std::uint64_t first, std::uint32_t length) const {
    const auto [word, place, rest] = split(first);
    Run run = {word_at(word).live >> place, word_at(word).imported >> place};
    if (rest < length) {
      run.live |= word_at(word + 1).live << rest;
      run.imported |= word_at(word + 1).imported << rest;
    }
    return {run.live & ones(length), run.imported & ones(length)};
  }
  /// Adds a run of consecutive numbers. Precondition: no number of the run is live.
  void add_run(std::uint64_t first, std::uint32_t length) {
    const auto [word, place, rest] = split(first);
    add_bits(word, ones(std::min(length, rest)) << place);
    if (rest < length) add_bits(word + 1, ones(length - rest));
  }
  /// Removes a run of consecutive numbers. If a number is not live, it is ignored.
  void remove_run(std::uint64_t first, std::uint32_t length) {
    const auto [word, place, rest] = split(first);
    remove_bits(word, ones(std::min(length, rest)) << place);
    if (rest < length) remove_bits(word + 1, ones(length - rest));
  }

  std::uint64_t count() const { return count_; }
  /// Returns the live numbers that are not imported, in no particular order.
  std::vector<std::uint64_t> own() const {
    std::vector<std::uint64_t> numbers;
    for (const Word& word : words_)
      for (std::uint64_t bit = 0; bit < 64; ++bit)
        if (((word.live & ~word.imported) >> bit & 1) != 0)
          numbers.push_back(word.number << 6 | bit);
    return numbers;
  }

 private:
  struct Word {
    std::uint64_t number = 0;  // first vertex number of the word, divided by 64
    std::uint64_t live = 0;    // one bit for each live number; 0 if the entry is free
    std::uint64_t imported = 0;
    std::uint64_t unused = 0;  // padding to 32 bytes
  };
  std::size_t home(std::uint64_t number) const {
    return static_cast<std::size_t>(scatter_(number)) & mask_;
  }
  /// Returns the index in the table of the word with this number. If the table does not contain the
  /// word, returns the index at which to insert it.
  std::size_t place_of(std::uint64_t number) const {
    std::size_t i = home(number);
    while (words_[i].live != 0 && words_[i].number != number) i = (i + 1) & mask_;
    return i;
  }
  const Word& word_at(std::uint64_t number) const { return words_[place_of(number)]; }

  static std::uint64_t ones(std::uint32_t count) {
    return count >= 64 ? ~std::uint64_t{0} : (std::uint64_t{1} << count) - 1;
  }
  /// The position of a vertex number in the words: the number of its word, the bit within the word,
  /// and the count of bits from this bit to the end of the word.
  struct Split {
    std::uint64_t word;
    std::uint32_t place, rest;
  };
  static Split split(std::uint64_t number) {
    const auto place = static_cast<std::uint32_t>(number & 63);
    return {number >> 6, place, 64 - place};
  }
  Word& add_bits(std::uint64_t number, std::uint64_t bits) {
    if (2 * used_ >= mask_) grow();
    Word& word = words_[place_of(number)];
    if (word.live == 0) {
      word = {number, 0, 0, 0};
      ++used_;
    }
    word.live |= bits;
    count_ += static_cast<std::uint64_t>(std::popcount(bits));
    return word;
  }
  void remove_bits(std::uint64_t number, std::uint64_t bits) {
    const std::size_t place = place_of(number);
    Word& word = words_[place];
    bits &= word.live;
    if (bits == 0) return;
    word.live &= ~bits;
    word.imported &= ~bits;
    count_ -= static_cast<std::uint64_t>(std::popcount(bits));
    if (word.live == 0) close(place);
  }
  /// Removes the free entry `hole` from the probe sequences: moves later words into the gap, closer
  /// to the entries that their hashes select.
  void close(std::size_t hole) {
    --used_;
    for (std::size_t i = (hole + 1) & mask_; words_[i].live != 0; i = (i + 1) & mask_) {
      if (((i - home(words_[i].number)) & mask_) < ((i - hole) & mask_)) continue;
      words_[hole] = words_[i];
      words_[i] = {};
      hole = i;
    }
  }
  void grow() {
    std::vector<Word> old(words_.size() * 2);
    old.swap(words_);
    mask_ = words_.size() - 1;
    for (const Word& word : old)
      if (word.live != 0) words_[place_of(word.number)] = word;
  }

  std::vector<Word> words_ = std::vector<Word>(64);
  std::size_t mask_ = 63;
  Scatter scatter_;
  std::size_t used_ = 0;
  std::uint64_t count_ = 0;
};

}  // namespace shm
