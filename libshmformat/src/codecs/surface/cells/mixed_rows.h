// Mixed rows: makes the same decisions as RowHexahedra, but codes each decision with a mix of
// several predictions. Files are smaller than with RowHexahedra, and coding is slower.
// spec: "Mixed rows"
#pragma once

#include "codecs/surface/cells/row_hexahedra.h"
#include "entropy/mixing.h"

namespace shm {

template <class Coder>
class MixedRows {
 public:
  /// The arguments are those of the constructor of RowHexahedra.
  explicit MixedRows(ActiveSurface& surface, const OpenFaces* open = nullptr)
      : rows_(surface, open) {}

  // The functions are those of RowHexahedra.
  bool code(Coder& symbols, Coder& corner_order, const StoredCell& stored, CellTopology& cell,
            bool order_matters) {
    symbols_.use(symbols);
    corner_order_.use(corner_order);
    return rows_.code(symbols_, corner_order_, stored, cell, order_matters);
  }
  void code_last_use(Coder& symbols, CellTopology& cell) {
    symbols_.use(symbols);
    rows_.code_last_use(symbols_, cell);
  }

 private:
  using Rows = RowHexahedra<MixingCoder<Coder>>;

  MixingCoder<Coder> symbols_{Rows::kQuestions}, corner_order_{Rows::kQuestions};
  Rows rows_;
};

}  // namespace shm
