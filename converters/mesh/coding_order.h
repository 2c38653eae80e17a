// CodingOrderLog: records the order in which a Writer codes vertices and cells. The values of time
// steps are coded in the same order. With Order::stream, this order also determines the new vertex
// and cell numbers.
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

class CodingOrderLog final : public CodingOrder {
 public:
  explicit CodingOrderLog(Spool& spool, bool with_cells = true)
      : with_cells_(with_cells), vertices_(spool), cells_(spool) {}
  void vertex(std::uint64_t number) override { note(vertices_, number); }
  void cell(std::uint64_t number) override {
    if (with_cells_) note(cells_, number);
  }
  // Throws the exception that occurred in vertex() or cell(), if any. These functions do not throw
  // it themselves, because the Writer that calls them cannot handle exceptions.
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

// Determines the order in which the values of stepped cell arrays are coded if cells are not coded
// in file order. elements() returns the element numbers of an array in coding order. The element
// number of a cell is its rank, in file order, among the cells that the array covers. The result is
// the same for all arrays that cover the same blocks.
class CoveredOrder {
 public:
  // All arguments are borrowed. `cell_order` lists the cell numbers in coding order.
  CoveredOrder(MeshSource& mesh, NumberList& cell_order, Spool& spool)
      : mesh_(&mesh), cell_order_(&cell_order), spool_(&spool) {}
  NumberList& elements(std::size_t array);

 private:
  MeshSource* mesh_;
  NumberList* cell_order_;
  Spool* spool_;
  std::map<std::vector<std::uint32_t>, std::unique_ptr<NumberList>> lists_;
};

// Functions that convert old vertex and cell numbers to new numbers. An empty function means that
// the numbers do not change.
struct Renumbering {
  std::function<std::uint64_t(std::uint64_t)> vertex, cell;
  std::uint64_t vertices = 0, cells = 0;
};
// Returns `extra` with its references (the vertex or cell numbers that it contains) converted to
// new numbers. Negative numbers, and numbers of vertices or cells that do not exist, are not
// changed.
Extra renumbered(Extra extra, const Renumbering& to);

}  // namespace shm::converters
