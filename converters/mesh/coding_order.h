// CodingOrderLog: remembers in which order a Writer codes vertices and cells, and what follows
// from it: the order of step values, and the new numbers of a mesh in Order::stream.
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <exception>
#include <functional>
#include <limits>
#include <map>
#include <memory>
#include <vector>

#include "base/spool.h"
#include "mesh/mesh_source.h"
#include "shm/writer.h"

namespace shm::converters {

// A long list of numbers, written front to back and read in pieces. While the numbers count up from
// 0 they take no room, and 4 bytes each while they fit.
class NumberList {
 public:
  explicit NumberList(Spool& spool)
      : narrow_(spool, sizeof(std::uint32_t)), wide_(spool, sizeof(std::uint64_t)) {}
  void push_back(std::uint64_t number) {
    if (number == size_ && size_ == counted_) {
      counted_ = ++size_;
      return;
    }
    tail_.push_back(number);
    ++size_;
    if (tail_.size() == kTail) flush();
  }
  std::uint64_t size() const { return size_; }
  // `count` numbers from number `first`. Must hold: there are so many.
  void read(std::uint64_t first, std::uint64_t count, std::vector<std::uint64_t>& out) {
    flush();
    out.resize(count);
    std::uint64_t done = 0;
    for (; done < count && first + done < counted_; ++done) out[done] = first + done;
    const std::uint64_t wide_from = counted_ + narrow_.size();
    if (done < count && first + done < wide_from) {
      piece_.resize(std::min(count - done, wide_from - first - done));
      narrow_.read(first + done - counted_, piece_.size(),
                   reinterpret_cast<std::byte*>(piece_.data()));
      std::copy(piece_.begin(), piece_.end(), out.begin() + static_cast<std::ptrdiff_t>(done));
      done += piece_.size();
    }
    if (done < count)
      wide_.read(first + done - wide_from, count - done,
                 reinterpret_cast<std::byte*>(out.data() + done));
  }
  // Calls visit(position, number) for all of them.
  template <class Visit>
  void for_each(Visit&& visit) {
    std::vector<std::uint64_t> piece;
    const std::uint64_t end = size();
    for (std::uint64_t first = 0; first < end; first += piece.size()) {
      read(first, std::min<std::uint64_t>(kTail, end - first), piece);
      for (std::size_t i = 0; i < piece.size(); ++i) visit(first + i, piece[i]);
    }
  }

 private:
  static constexpr std::size_t kTail = 8192;
  void flush() {
    constexpr std::uint64_t kNarrow = std::numeric_limits<std::uint32_t>::max();
    std::size_t done = 0;
    piece_.clear();
    if (wide_.size() == 0)
      for (; done < tail_.size() && tail_[done] <= kNarrow; ++done)
        piece_.push_back(static_cast<std::uint32_t>(tail_[done]));
    narrow_.append(piece_.size(), reinterpret_cast<const std::byte*>(piece_.data()));
    wide_.append(tail_.size() - done, reinterpret_cast<const std::byte*>(tail_.data() + done));
    tail_.clear();
  }

  // One behind the other: what counts up, narrow numbers, and all from the first wide one on.
  std::uint64_t counted_ = 0;
  PagedArray narrow_, wide_;
  std::uint64_t size_ = 0;
  std::vector<std::uint64_t> tail_;   // of these, what has not been sorted in
  std::vector<std::uint32_t> piece_;  // on its way
};

class CodingOrderLog final : public CodingOrder {
 public:
  explicit CodingOrderLog(Spool& spool, bool with_cells = true)
      : with_cells_(with_cells), vertices_(spool), cells_(spool) {}
  void vertex(std::uint64_t number) override { note(vertices_, number); }
  void cell(std::uint64_t number) override {
    if (with_cells_) note(cells_, number);
  }
  // Throws what went wrong inside a Writer call, where nothing may be thrown.
  void check() const {
    if (failure_) std::rethrow_exception(failure_);
  }
  NumberList& vertices() { return vertices_; }
  NumberList& cells() { return cells_; }

 private:
  void note(NumberList& list, std::uint64_t number) {
    if (failure_) return;
    try {
      list.push_back(number);
    } catch (...) {
      failure_ = std::current_exception();
    }
  }
  bool with_cells_;
  NumberList vertices_, cells_;
  std::exception_ptr failure_;
};

// Where step values of cell arrays come from when cells are coded out of file order: for each
// set of covered blocks, the element numbers (ranks among the covered cells in file order) in
// coding order.
class CoveredOrder {
 public:
  // Borrows all three. `cell_order`: cell numbers in coding order.
  CoveredOrder(MeshSource& mesh, NumberList& cell_order, Spool& spool)
      : mesh_(&mesh), cell_order_(&cell_order), spool_(&spool) {}
  NumberList& elements(std::size_t array);

 private:
  MeshSource* mesh_;
  NumberList* cell_order_;
  Spool* spool_;
  std::map<std::vector<std::uint32_t>, std::unique_ptr<NumberList>> lists_;
};

// position[number] for a list of numbers below `size`. Throws corrupt unless the list holds each
// number below `size` exactly once; `what` names them in the complaint.
NumberTable invert(NumberList& order, std::uint64_t size, const char* what, Spool& spool);

// From old numbers to new ones; empty: numbers stay.
struct Renumbering {
  std::function<std::uint64_t(std::uint64_t)> vertex, cell;
  std::uint64_t vertices = 0, cells = 0;
};
// `extra` with its references in new numbers. Negative ones, and those that name nothing, stay.
Extra renumbered(Extra extra, const Renumbering& to);

}  // namespace shm::converters
