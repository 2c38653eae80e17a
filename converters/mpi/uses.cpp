#include "mpi/uses.h"

#include <algorithm>

#include "mesh/vertex_compaction.h"

namespace shm::converters {
namespace {

struct VertexUse {
  std::uint64_t number = 0, first = 0, last = 0;
};

// For each vertex of this part, finds the first and the last cell of the part that use it.
std::vector<VertexUse> uses_in(MeshSource& mesh, const CellRange& range, PartUses& out) {
  std::vector<VertexUse> uses;
  for_cells(mesh, range, [&](const CellBatch& batch, std::uint64_t first_cell) {
    for (std::size_t i = 0; i < batch.size(); ++i) {
      const std::uint64_t cell = first_cell + i;
      ++out.block_cells.at(batch.blocks[i]);
      for (const std::uint64_t v : batch.cell(i)) {
        require_vertex(cell, v, mesh.info().vertices);
        const std::uint32_t index = out.vertices.find_or_add(v);
        if (index == uses.size()) uses.push_back({v, cell, cell});
        uses[index].last = cell;
      }
    }
  });
  return uses;
}

// For each vertex number that this rank owns, the first and the last cell of the whole mesh that
// use the vertex.
class OwnedUses {
 public:
  explicit OwnedUses(const NumberOwners& owners)
      : base_(owners.first()), uses_(owners.count(), VertexUse{0, kNeverUsed, 0}) {}
  void take(const VertexUse& use) {
    VertexUse& known = uses_[use.number - base_];
    known.first = std::min(known.first, use.first);
    known.last = std::max(known.last, use.last);
  }
  VertexUse of(std::uint64_t number) const { return uses_[number - base_]; }
  std::vector<std::uint64_t> unused() const {
    std::vector<std::uint64_t> numbers;
    for (std::size_t i = 0; i < uses_.size(); ++i)
      if (uses_[i].first == kNeverUsed) numbers.push_back(base_ + i);
    return numbers;
  }

 private:
  std::uint64_t base_;
  std::vector<VertexUse> uses_;
};

// Collective. Collects the vertex numbers of all ranks, and returns them in ascending order on rank
// `rank`. Ranks send their numbers in pieces of bounded size.
std::vector<std::uint64_t> collect(Ranks& ranks, const std::vector<std::uint64_t>& numbers,
                                   std::size_t rank) {
  // Maximum number of vertex numbers that all ranks together send in one round.
  constexpr std::size_t kAtOnce = std::size_t{1} << 17;
  const std::size_t piece = std::max<std::size_t>(kAtOnce / ranks.size(), 1);
  std::vector<std::uint64_t> all;
  const std::uint64_t rounds = ranks.largest((numbers.size() + piece - 1) / piece);
  for (std::uint64_t round = 0; round < rounds; ++round) {
    std::vector<std::vector<std::uint64_t>> to(ranks.size());
    const std::size_t begin = std::min<std::size_t>(round * piece, numbers.size());
    const std::size_t end = std::min(begin + piece, numbers.size());
    to[rank].assign(numbers.begin() + static_cast<std::ptrdiff_t>(begin),
                    numbers.begin() + static_cast<std::ptrdiff_t>(end));
    for (const auto& part : ranks.exchange(to)) all.insert(all.end(), part.begin(), part.end());
  }
  std::sort(all.begin(), all.end());
  return all;
}

}  // namespace

std::uint32_t VertexTable::find_or_add(std::uint64_t number) {
  if (2 * numbers_.size() >= slots_.size()) grow();
  std::uint32_t& slot = slots_[slot_of(number)];
  if (slot == kAbsent) {
    if (numbers_.size() == kAbsent)
      throw Failure(ErrorCode::over_limit,
                    "a rank has more than 2^32 - 1 vertices: use more ranks");
    slot = static_cast<std::uint32_t>(numbers_.size());
    numbers_.push_back(number);
  }
  return slot;
}

void VertexTable::grow() {
  slots_.assign(std::max<std::size_t>(2 * slots_.size(), 1024), kAbsent);
  for (std::uint32_t i = 0; i < numbers_.size(); ++i) slots_[slot_of(numbers_[i])] = i;
}

PartUses find_uses(Ranks& ranks, MeshSource& mesh, const CellRange& range, std::size_t last_rank) {
  PartUses out;
  out.block_cells.resize(mesh.info().block_cells.size());
  std::vector<VertexUse> uses;
  ranks.together([&] { uses = uses_in(mesh, range, out); });

  NumberOwners owners(ranks, mesh.info().vertices);
  std::optional<OwnedUses> owned;
  ranks.together([&] { owned.emplace(owners); });
  owners.send(uses, [&](const VertexUse& use) { owned->take(use); });
  uses = std::vector<VertexUse>();
  const auto known = owners.ask<VertexUse>(out.vertices.numbers(),
                                           [&](std::uint64_t number) { return owned->of(number); });
  for (const VertexUse& use : known) {
    out.last.push_back(use.last);
    out.imported.push_back(use.first < range.first);
    out.own += use.first < range.first ? 0 : 1;
  }
  out.unused = collect(ranks, owned->unused(), last_rank);
  return out;
}

}  // namespace shm::converters
