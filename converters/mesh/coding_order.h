// CodingOrderLog: records the order in which a Writer codes vertices and cells. The order of step
// values, and the new numbers of a mesh in Order::stream, are derived from this order.
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
  // Throws the exception that occurred inside a Writer call, where no exception may be thrown.
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

// Determines the order of step values of cell arrays if cells are coded out of file order. For each
// set of covered blocks, this is a list of element numbers (ranks among the covered cells in file
// order) in coding order.
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

// Tables that convert old numbers to new numbers. An empty table means that the numbers do not
// change.
struct Renumbering {
  std::function<std::uint64_t(std::uint64_t)> vertex, cell;
  std::uint64_t vertices = 0, cells = 0;
};
// Returns `extra` with its references converted to new numbers. Negative references, and references
// to vertices or cells that do not exist, are not changed.
Extra renumbered(Extra extra, const Renumbering& to);

}  // namespace shm::converters
