// Orders cells along a Hilbert curve.
#include <cstring>
#include <limits>
#include <string>

#include "base/external_sorter.h"
#include "mesh/mesh_points.h"
#include "order/cell_orders.h"
#include "order/hilbert_curve.h"

namespace shm::converters {
namespace {

struct Keyed {
  std::uint64_t key;
  std::uint32_t cell;
};

}  // namespace

CellList hilbert_order(const Cells& cells, MeshSource& mesh, Spool* spool, std::size_t sort_bytes) {
  const CurveGrid grid(mesh);
  BigArray<CurvePlace> places(spool, mesh.info().vertices);
  for_each_point(mesh, [&](std::uint64_t vertex, const std::array<double, 3>& point) {
    places.set(vertex, grid.place(point));
  });
  const std::string directory = spool != nullptr ? spool->directory() : std::string();
  if (spool == nullptr) sort_bytes = std::numeric_limits<std::size_t>::max() / 2;
  // Sort by cell number before sorting by position, so that cells with equal positions on the curve
  // stay in the mesh's order.
  ExternalSorter by_number(directory, sizeof(Keyed), sort_bytes / 2);
  for (std::uint32_t cell = 0; cell < cells.size(); ++cell) {
    std::array<std::uint64_t, 3> sum{};
    const auto corners = cells.cell(cell);
    for (const std::uint32_t v : corners) {
      const CurvePlace place = places[v];
      for (std::size_t c = 0; c < 3; ++c) sum[c] += place[c];
    }
    CurvePlace centre{};
    for (std::size_t c = 0; c < 3 && !corners.empty(); ++c)
      centre[c] = static_cast<std::uint32_t>(sum[c] / corners.size());
    const Keyed keyed{along_curve(centre), cell};
    by_number.add(cells.number_of(cell), reinterpret_cast<const std::byte*>(&keyed));
  }
  ExternalSorter sorted(directory, sizeof(std::uint32_t), sort_bytes / 2);
  std::uint64_t key;
  const std::byte* record;
  while (by_number.next(key, record)) {
    Keyed keyed{};
    std::memcpy(&keyed, record, sizeof keyed);
    sorted.add(keyed.key, reinterpret_cast<const std::byte*>(&keyed.cell));
  }
  CellList order(spool);
  order.reserve(cells.size());
  while (sorted.next(key, record)) {
    std::uint32_t cell;
    std::memcpy(&cell, record, sizeof cell);
    order.push_back(cell);
  }
  return order;
}

}  // namespace shm::converters
