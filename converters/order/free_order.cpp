#include "order/free_order.h"

#include <algorithm>
#include <limits>
#include <string>
#include <utility>

#include "order/reordered_mesh.h"
#include "order/sample_mesh.h"

namespace shm::converters {
namespace {

constexpr std::uint32_t kSampleCells = 1 << 16;
// Approximate maximum size of the values of a sample, in bytes.
constexpr std::uint64_t kSampleBytes = std::uint64_t{256} << 20;

// Orders are considered equally good if their encoded size exceeds the smallest size by at most
// this fraction. Among these orders, the order with the fewest active vertices is chosen.
constexpr double kNegligible = 1.0 / 256;

std::uint32_t sample_size(const MeshInfo& info) {
  std::uint64_t stride = 1;
  for (std::size_t a = 0; a < info.schema.arrays.size(); ++a)
    stride += info.array_stride(a) * (info.schema.arrays[a].per_step ? 3 : 1);
  const std::uint64_t most = std::max<std::uint64_t>(kSampleBytes / stride, 4096);
  return static_cast<std::uint32_t>(std::min<std::uint64_t>(kSampleCells, most));
}

struct Trial {
  CellOrdering ordering;
  double bytes = 0;
  std::uint64_t width = 0;
};

Trial best_of(const std::vector<Trial>& trials) {
  double least = std::numeric_limits<double>::max();
  for (const Trial& trial : trials) least = std::min(least, trial.bytes);
  const Trial* best = nullptr;
  for (const Trial& trial : trials)
    if (trial.bytes <= least * (1 + kNegligible) && (best == nullptr || trial.width < best->width))
      best = &trial;
  return *best;
}

// A sample of a mesh. Encodes its cells in several orders and compares the sizes.
class OrderTrials {
 public:
  OrderTrials(MeshSource& mesh, const CellGraph& graph)
      : cells_(&graph.cells()),
        picked_(sample_of_cells(graph, mesh, sample_size(mesh.info()))),
        sample_(mesh, picked_),
        steps_(mesh.info().step_times.size()) {}

  bool is_whole() const { return picked_.size() == cells_->size(); }

  // Computes each order from the sample alone, without the rest of the mesh, and encodes the sample
  // in this order. Returns the best trial.
  Trial best(const TrialCoder& code, const Progress& progress) {
    CellOrderer orderer(sample_.cells(), sample_);
    std::vector<Trial> trials;
    const std::vector<CellOrdering> orderings = cell_orderings(sample_.cells());
    for (const CellOrdering& ordering : orderings) {
      trials.push_back(trial(ordering, orderer(ordering), code));
      if (progress) progress("trying orders", trials.size(), orderings.size());
    }
    return best_of(trials);
  }

  // Encodes the sample with its cells in the same order as in `whole`, an order of the whole mesh.
  Trial trial_of_whole(const CellOrdering& ordering, const CellList& whole,
                       const TrialCoder& code) {
    std::vector<bool> is_picked(cells_->size(), false);
    for (const std::uint32_t number : picked_) is_picked[number] = true;
    CellSequence order;
    for (std::uint64_t position = 0; position < whole.size(); ++position) {
      const std::uint32_t number = cells_->number_of(whole[position]);
      if (!is_picked[number]) continue;
      const auto place = std::lower_bound(picked_.begin(), picked_.end(), number);
      order.push_back(static_cast<std::uint32_t>(place - picked_.begin()));
    }
    return trial(ordering, CellList(std::move(order)), code);
  }

  double bytes_as_is(const TrialCoder& code) {
    return bytes_of_all_steps(code(sample_), sample_.info(), steps_);
  }

 private:
  Trial trial(const CellOrdering& ordering, const CellList& order, const TrialCoder& code) {
    ReorderedMesh ordered(sample_, sample_.cells(), order);
    const SizeReport sizes = code(ordered);
    return {ordering, bytes_of_all_steps(sizes, sample_.info(), steps_), sizes.max_active_vertices};
  }

  const Cells* cells_;
  CellSequence picked_;  // numbers that the cells of the sample have in the mesh, ascending
  SampleMesh sample_;
  std::size_t steps_;
};

}  // namespace

std::vector<CellOrdering> cell_orderings(const Cells& cells) {
  using Kind = CellOrdering::Kind;
  std::vector<CellOrdering> list = {{}};
  bool any = false;
  for (std::uint32_t cell = 0; cell < cells.size() && !any; ++cell) any = cells.is_hexahedron(cell);
  for (const bool within_blocks : {false, true}) {
    if (!any || (within_blocks && cells.one_block())) break;
    for (const int along : {2, 1, 0})
      list.push_back({Kind::swept, static_cast<std::uint8_t>(along), within_blocks});
    list.push_back({Kind::enclosed_first, 0, within_blocks});
    list.push_back({Kind::breadth_first, 0, within_blocks});
  }
  if (!any) list.push_back({Kind::hilbert, 0, false});
  return list;
}

const CellGraph& CellOrderer::graph(bool within_blocks) {
  if (!graph_ || (cut_ && !within_blocks)) {
    graph_.reset();
    if (room_.spool != nullptr)
      graph_spool_ = std::make_unique<Spool>(room_.spool->directory(), room_.memory / 2);
    graph_.emplace(*cells_, progress_, graph_spool_.get(), room_.memory / 2);
    cut_ = false;
  }
  if (within_blocks && !cut_) graph_->cut_between_blocks();
  cut_ = within_blocks;
  return *graph_;
}

CellList CellOrderer::operator()(const CellOrdering& ordering) {
  if (progress_) progress_("ordering cells", 0, 1);
  if (room_.spool == nullptr) return order(ordering, nullptr);
  using Kind = CellOrdering::Kind;
  if (ordering.kind != Kind::stored && ordering.kind != Kind::hilbert)
    // Build the graph first, because it needs memory that `scratch` occupies later.
    graph(ordering.within_blocks);
  Spool scratch(room_.spool->directory(), room_.memory / 2);
  const CellList made = order(ordering, &scratch);
  CellList kept(room_.spool);
  for (std::uint64_t position = 0; position < made.size(); ++position)
    kept.push_back(made[position]);
  return kept;
}

CellList CellOrderer::order(const CellOrdering& ordering, Spool* scratch) {
  const bool cut = ordering.within_blocks;
  const auto with_others = [&](CellList hexahedra) {
    return with_others_in_place(*cells_, std::move(hexahedra), scratch, room_.memory / 4);
  };
  switch (ordering.kind) {
    case CellOrdering::Kind::stored: break;
    case CellOrdering::Kind::breadth_first:
      return with_others(breadth_first_order(graph(cut), scratch));
    case CellOrdering::Kind::swept:
      return with_others(swept_order(graph(cut), ordering.layers_along, scratch));
    case CellOrdering::Kind::enclosed_first:
      return with_others(enclosed_first_order(graph(cut), scratch));
    case CellOrdering::Kind::hilbert:
      return hilbert_order(*cells_, *mesh_, scratch, room_.memory / 2);
  }
  CellList same(scratch);
  same.reserve(cells_->size());
  for (std::uint32_t number = 0; number < cells_->size(); ++number)
    same.push_back(cells_->with_number(number));
  return same;
}

std::optional<CellList> find_free_order(MeshSource& mesh, const Cells& cells, MeshSource& located,
                                        const TrialCoder& code, const Progress& progress,
                                        const SearchRoom& room) {
  CellOrderer whole(cells, located, progress, room);
  OrderTrials trials(mesh, whole.graph());
  const Trial first = trials.best(code, progress);
  if (first.ordering.kind == CellOrdering::Kind::stored) return std::nullopt;
  CellList order = whole(first.ordering);
  if (trials.is_whole() || first.ordering.kind != CellOrdering::Kind::swept) return order;
  // The best order of the sample has layers along one axis, e.g. the longest axis of the sample.
  // This need not be the best choice for the whole mesh, because the sample may have different
  // proportions. Therefore the order of the whole mesh is computed with layers along each of the
  // three axes, and these orders are compared on the sample.
  Trial best = trials.trial_of_whole(first.ordering, order, code);
  for (CellOrdering other = first.ordering; const int along : {0, 1, 2}) {
    if (along == first.ordering.layers_along) continue;
    other.layers_along = static_cast<std::uint8_t>(along);
    CellList candidate = whole(other);
    const Trial trial = trials.trial_of_whole(other, candidate, code);
    if (best_of({best, trial}).ordering.layers_along != along) continue;
    best = trial;
    order = std::move(candidate);
  }
  return order;
}

double share_in_free_order(MeshSource& mesh, const CellTable& cells, const TrialCoder& code,
                           const TrialCoder& code_as_is) {
  OrderTrials trials(mesh, CellGraph(cells));
  return trials.best(code, {}).bytes / std::max(trials.bytes_as_is(code_as_is), 1.0);
}

}  // namespace shm::converters
