// NumberOwners: distributes information about vertices or cells among the ranks. With n ranks, the
// numbers of all vertices or cells are divided into n equal ranges, and rank r owns range r.
// Information about a vertex or cell is sent to the owner of its number, and requested from this
// owner. Messages have a bounded size.
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "exodus/parts/ranks.h"

namespace shm::converters {

class NumberOwners {
 public:
  // `ranks` is borrowed.
  NumberOwners(Ranks& ranks, std::uint64_t numbers)
      : ranks_(&ranks),
        numbers_(numbers),
        run_(std::max<std::uint64_t>((numbers + ranks.size() - 1) / ranks.size(), 1)),
        batch_(std::max<std::size_t>(kBatch / ranks.size(), 256)) {}

  // Returns the first number of the range that this rank owns.
  std::uint64_t first() const { return std::min<std::uint64_t>(run_ * ranks_->rank(), numbers_); }
  std::uint64_t count() const {
    return std::min<std::uint64_t>(run_ * (ranks_->rank() + 1), numbers_) - first();
  }

  // Collective. Sends each item to the owner of the item's number, which calls take(item).
  // Precondition: item.number < numbers for each item. Within a batch, an owner receives the items
  // of rank 0 first, then those of rank 1 and so on; items of one rank keep their order.
  template <class Item, class Take>
  void send(const std::vector<Item>& items, Take&& take) {
    in_batches(items.size(), [&](std::size_t begin, std::size_t end) {
      std::vector<std::vector<Item>> to(ranks_->size());
      for (std::size_t i = begin; i < end; ++i) to[owner(items[i].number)].push_back(items[i]);
      for (const auto& part : ranks_->exchange(to))
        for (const Item& item : part) take(item);
    });
  }

  // Collective. Returns one reply for each of `numbers`: the result of answer(number), which is
  // called on the owner of the number.
  template <class Reply, class Answer>
  std::vector<Reply> ask(const std::vector<std::uint64_t>& numbers, Answer&& answer) {
    std::vector<Reply> replies(numbers.size());
    in_batches(numbers.size(), [&](std::size_t begin, std::size_t end) {
      std::vector<std::vector<std::uint64_t>> to(ranks_->size());
      std::vector<std::vector<std::size_t>> places(ranks_->size());
      for (std::size_t i = begin; i < end; ++i) {
        to[owner(numbers[i])].push_back(numbers[i]);
        places[owner(numbers[i])].push_back(i);
      }
      const auto asked = ranks_->exchange(to);
      std::vector<std::vector<Reply>> back(ranks_->size());
      for (std::size_t r = 0; r < asked.size(); ++r)
        for (const std::uint64_t number : asked[r]) back[r].push_back(answer(number));
      const auto got = ranks_->exchange(back);
      for (std::size_t r = 0; r < got.size(); ++r)
        for (std::size_t i = 0; i < got[r].size(); ++i) replies[places[r][i]] = got[r][i];
    });
    return replies;
  }

  // owner() returns the rank that owns a number. end_of() returns the end of the range that a rank
  // owns.
  std::size_t owner(std::uint64_t number) const { return static_cast<std::size_t>(number / run_); }
  std::uint64_t end_of(std::size_t rank) const {
    return std::min<std::uint64_t>(run_ * (rank + 1), numbers_);
  }

 private:
  // Maximum number of items in one batch, summed over all ranks.
  static constexpr std::size_t kBatch = std::size_t{1} << 20;

  // Calls round(begin, end) for each batch of items. All ranks make the same number of calls: the
  // number of batches of the rank with the most items. On a rank with fewer items, the final
  // batches are empty.
  template <class Round>
  void in_batches(std::size_t items, Round&& round) {
    const std::uint64_t rounds = ranks_->largest((items + batch_ - 1) / batch_);
    for (std::uint64_t i = 0; i < rounds; ++i) {
      const std::size_t begin = std::min<std::size_t>(static_cast<std::size_t>(i) * batch_, items);
      round(begin, std::min(begin + batch_, items));
    }
  }

  Ranks* ranks_;
  std::uint64_t numbers_, run_;
  std::size_t batch_;
};

}  // namespace shm::converters
