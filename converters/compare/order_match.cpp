#include "compare/order_match.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <utility>
#include <vector>

namespace shm::converters {
namespace {

// Computes fingerprints of cells that are independent of vertex numbers and rotations. The
// fingerprint of a cell depends on its block and, for each of its vertices, on the first cell that
// uses the vertex. Cells that differ in this data rarely have equal fingerprints.
class Fingerprints {
 public:
  Fingerprints(std::uint64_t vertices, Spool* spool) : birth_(spool, vertices) {}
  template <class Corners>
  std::uint64_t next(std::uint32_t block, const Corners& corners) {
    ++cells_;
    std::uint64_t sum = mixed(~std::uint64_t{block});
    for (const auto v : corners) {
      std::uint32_t birth = birth_[v];
      if (birth == 0) birth_.set(v, birth = cells_);
      sum += mixed(birth);
    }
    return sum;
  }

 private:
  // The finalizer of MurmurHash3 (Austin Appleby, public domain).
  static std::uint64_t mixed(std::uint64_t x) {
    x = (x ^ x >> 33) * 0xff51afd7ed558ccdu;
    x = (x ^ x >> 33) * 0xc4ceb9fe1a85ec53u;
    return x ^ x >> 33;
  }
  BigArray<std::uint32_t> birth_;  // for each vertex, 1 + the index of the first cell that uses it
  std::uint32_t cells_ = 0;
};

BigArray<std::uint64_t> fingerprints_of(MeshSource& mesh, Spool* spool) {
  BigArray<std::uint64_t> list(spool);
  Fingerprints fingerprints(mesh.info().vertices, spool);
  CellBatch batch;
  for (mesh.rewind_cells(); mesh.next_cells(batch, kCellsAtOnce);)
    for (std::size_t i = 0; i < batch.size(); ++i)
      list.push_back(fingerprints.next(batch.blocks[i], batch.cell(i)));
  return list;
}

// Position of a cell: for each axis, the sum of the coordinates of its corners. The sum of their
// absolute values determines the tolerance for rounding errors.
struct Centre {
  std::array<double, 3> sum{}, magnitude{};
};

template <class Corners>
Centre centre_of(MeshSource& mesh, const Corners& corners) {
  const ScalarType type = mesh.info().schema.coordinate_type;
  Centre centre;
  std::array<std::byte, 3 * sizeof(double)> xyz;
  for (const auto v : corners) {
    mesh.read_points(v, 1, xyz.data());
    for (std::size_t c = 0; c < 3; ++c) {
      float narrow;
      double wide;
      std::memcpy(&narrow, xyz.data() + c * sizeof narrow, sizeof narrow);
      std::memcpy(&wide, xyz.data() + c * sizeof wide, sizeof wide);
      const double value = type == ScalarType::float32 ? static_cast<double>(narrow) : wide;
      centre.sum[c] += value;
      centre.magnitude[c] += std::fabs(value);
    }
  }
  return centre;
}

// Positions of a sample of the cells of a mesh.
class Landmarks {
 public:
  explicit Landmarks(MeshSource& mesh)
      : error_(mesh.info().schema.coordinate_quantization.max_error(
            mesh.info().schema.coordinate_type)) {
    const std::uint64_t every = mesh.info().cells() / kLandmarks + 1;
    CellBatch batch;
    std::uint64_t number = 0;
    for (mesh.rewind_cells(); mesh.next_cells(batch, kCellsAtOnce);)
      for (std::size_t i = 0; i < batch.size(); ++i, ++number)
        if (number % every == 0) centres_.emplace_back(number, centre_of(mesh, batch.cell(i)));
  }

  // Returns true if the cells of `source`, in the order `order`, have the stored positions. The
  // sums of coordinates may differ by rounding errors. Sums that are not finite are not compared.
  bool found_in(MeshSource& source, const Cells& cells, const CellList& order) const {
    constexpr double kRounding = 1e-12;
    return std::all_of(centres_.begin(), centres_.end(), [&](const auto& landmark) {
      const auto corners = cells.cell(order[landmark.first]);
      const Centre here = centre_of(source, corners);
      for (std::size_t c = 0; c < 3; ++c) {
        const double off = std::fabs(here.sum[c] - landmark.second.sum[c]);
        const double allowed =
            error_ * static_cast<double>(corners.size()) + kRounding * here.magnitude[c];
        if (off > allowed) return false;
      }
      return true;
    });
  }

 private:
  static constexpr std::uint64_t kLandmarks = 512;
  double error_;
  std::vector<std::pair<std::uint64_t, Centre>> centres_;
};

bool fits(const Cells& cells, const CellList& order, const BigArray<std::uint64_t>& wanted,
          Spool* spool) {
  Fingerprints fingerprints(cells.vertices(), spool);
  for (std::uint64_t i = 0; i < order.size(); ++i) {
    const std::uint32_t cell = order[i];
    if (fingerprints.next(cells.block(cell), cells.cell(cell)) != wanted[i]) return false;
  }
  return true;
}

}  // namespace

std::optional<CellList> matching_order(const Cells& cells, MeshSource& source, MeshSource& restored,
                                       std::size_t skipped, const Progress& progress,
                                       const SearchRoom& room) {
  const auto wanted = fingerprints_of(restored, room.spool);
  if (wanted.size() != cells.size()) return std::nullopt;
  const Landmarks landmarks(restored);
  CellOrderer orderer(cells, source, progress, room);
  for (const CellOrdering& ordering : cell_orderings(cells)) {
    CellList order = orderer(ordering);
    if (fits(cells, order, wanted, room.spool) && landmarks.found_in(source, cells, order) &&
        skipped-- == 0)
      return order;
  }
  return std::nullopt;
}

}  // namespace shm::converters
