// Columns: the values of one array, coded in step with the mesh, each into its own bitstream.
//   VertexColumn  coordinates, point arrays, vertex numbers: spectral prediction from the cell
//   CellColumn    cell arrays: weighted mean of the cells behind the shared faces, second order
// Values pass as raw bytes in host order, all components of one element together.
// source: paper sections 3.2 and 3.3; spec: "Vertex columns", "Cell columns"
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>

#include "coders/cell_topology.h"
#include "coders/stencil.h"
#include "entropy/range_coder.h"
#include "shm/schema.h"

namespace shm {

template <class Coder>
class VertexColumn {
 public:
  virtual ~VertexColumn() = default;
  /// Codes the element at `bytes` of the new vertex `slot`.
  virtual void code(Coder& coder, const Stencil& stencil, std::uint32_t slot, std::byte* bytes) = 0;

  static std::unique_ptr<VertexColumn> create(const ArrayInfo& info);
};

template <class Coder>
class CellColumn {
 public:
  virtual ~CellColumn() = default;
  /// Codes the element at `bytes` of `cell`. Cells whose block the array does not cover are
  /// passed to `skip` instead, so that their neighbours know.
  virtual void code(Coder& coder, const CellTopology& cell, std::byte* bytes) = 0;
  virtual void skip(const CellTopology& cell) = 0;

  static std::unique_ptr<CellColumn> create(const ArrayInfo& info);
};

}  // namespace shm
