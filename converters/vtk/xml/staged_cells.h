// StagedCells: stores the cells of a mesh in a spool, and produces from them the arrays of <Cells>
// (connectivity, offsets, ...) for each <Piece> of a VTU file.
#pragma once

#include <cstdint>
#include <functional>
#include <span>
#include <string_view>

#include "base/spool.h"
#include "vtk/xml/cells.h"
#include "vtk/xml/plan.h"

namespace shm::converters::vtu {

class StagedCells {
 public:
  // Reads all cells once and stores them in `spool`.
  StagedCells(VtuPlan& plan, Spool& spool);

  // count() returns the number of values in the array `name` (kConnectivity, ...) of a piece.
  // numbers() passes these values to `take` in order.
  using Take = std::function<void(std::span<const std::int64_t>)>;
  std::uint64_t count(std::string_view name, const PieceRange& piece);
  void numbers(std::string_view name, const PieceRange& piece, const Take& take);

 private:
  // Calls head(cell, faces) for each cell of a piece, where `faces` is the number of faces, or -1
  // if the cell is not a polyhedron. After each call to head(), calls face(points) for each face of
  // that cell.
  void faces_of(const PieceRange& piece,
                const std::function<void(std::uint64_t, std::int64_t)>& head,
                const std::function<void(std::span<const std::int64_t>)>& face);
  void ends(PagedArray& all, const PieceRange& piece, const Take& take);
  void face_numbers(std::string_view name, const PieceRange& piece, const Take& take);
  std::int64_t begin_of(PagedArray& all, std::uint64_t cell) {
    return cell == 0 ? 0 : all.get<std::int64_t>(cell - 1);
  }

  PagedArray nodes_, node_ends_, types_;
  // Face streams of all polyhedra, and the end position of the stream of each cell. Both are empty
  // if the mesh has no polyhedra.
  PagedArray streams_, stream_ends_;
  bool polyhedra_;
};

}  // namespace shm::converters::vtu
