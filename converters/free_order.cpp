#include "free_order.h"

#include <algorithm>
#include <limits>
#include <numeric>
#include <string>
#include <utility>

#include "reordered_mesh.h"
#include "sample_mesh.h"

namespace shm::converters {
namespace {

constexpr std::uint32_t kSampleCells = 1 << 16;
constexpr std::uint64_t kSampleBytes = std::uint64_t{256} << 20;  // its values, roughly

// Orders no larger than the best by more than this part count as equally small, and the one that
// needs the fewest vertices at once is taken.
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

// A sample of a mesh, coded in any order.
class OrderTrials {
 public:
  OrderTrials(MeshSource& mesh, const CellTable& cells, const CellGraph& graph)
      : picked_(sample_of_cells(graph, sample_size(mesh.info()))),
        sample_(mesh, cells, picked_),
        steps_(mesh.info().step_times.size()) {}

  bool is_whole(const CellTable& cells) const { return picked_.size() == cells.size(); }

  // As if the sample were all there is.
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

  // In an order of the whole mesh.
  Trial trial_of_whole(const CellOrdering& ordering, const CellSequence& whole,
                       const TrialCoder& code) {
    constexpr std::uint32_t kAbsent = ~std::uint32_t{0};
    CellSequence place(whole.size(), kAbsent), order;
    for (std::uint32_t i = 0; i < picked_.size(); ++i) place[picked_[i]] = i;
    for (const std::uint32_t cell : whole)
      if (place[cell] != kAbsent) order.push_back(place[cell]);
    return trial(ordering, order, code);
  }

  double bytes_as_is(const TrialCoder& code) {
    return bytes_of_all_steps(code(sample_), sample_.info(), steps_);
  }

 private:
  Trial trial(const CellOrdering& ordering, const CellSequence& order, const TrialCoder& code) {
    ReorderedMesh ordered(sample_, sample_.cells(), order);
    const SizeReport sizes = code(ordered);
    return {ordering, bytes_of_all_steps(sizes, sample_.info(), steps_), sizes.max_active_vertices};
  }

  CellSequence picked_;
  SampleMesh sample_;
  std::size_t steps_;
};

}  // namespace

std::vector<CellOrdering> cell_orderings(const CellTable& cells) {
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
    graph_.emplace(*cells_, progress_);
    cut_ = false;
  }
  if (within_blocks && !cut_) graph_->cut_between_blocks();
  cut_ = within_blocks;
  return *graph_;
}

CellSequence CellOrderer::operator()(const CellOrdering& ordering) {
  if (progress_) progress_("ordering cells", 0, 1);
  const bool cut = ordering.within_blocks;
  switch (ordering.kind) {
    case CellOrdering::Kind::stored: break;
    case CellOrdering::Kind::breadth_first:
      return with_others_in_place(*cells_, breadth_first_order(graph(cut)));
    case CellOrdering::Kind::swept:
      return with_others_in_place(*cells_, swept_order(graph(cut), ordering.layers_along));
    case CellOrdering::Kind::enclosed_first:
      return with_others_in_place(*cells_, enclosed_first_order(graph(cut)));
    case CellOrdering::Kind::hilbert: return hilbert_order(*cells_, *mesh_);
  }
  CellSequence same(cells_->size());
  std::iota(same.begin(), same.end(), 0u);
  return same;
}

std::optional<CellSequence> find_free_order(MeshSource& mesh, const CellTable& cells,
                                            const TrialCoder& code, const Progress& progress) {
  CellOrderer whole(cells, mesh, progress);
  OrderTrials trials(mesh, cells, whole.graph());
  const Trial first = trials.best(code, progress);
  if (first.ordering.kind == CellOrdering::Kind::stored) return std::nullopt;
  CellSequence order = whole(first.ordering);
  if (trials.is_whole(cells) || first.ordering.kind != CellOrdering::Kind::swept) return order;
  // Which axis is long a sample cannot tell: the others are tried over the whole mesh.
  Trial best = trials.trial_of_whole(first.ordering, order, code);
  for (CellOrdering other = first.ordering; const int along : {0, 1, 2}) {
    if (along == first.ordering.layers_along) continue;
    other.layers_along = static_cast<std::uint8_t>(along);
    CellSequence candidate = whole(other);
    const Trial trial = trials.trial_of_whole(other, candidate, code);
    if (best_of({best, trial}).ordering.layers_along != along) continue;
    best = trial;
    order = std::move(candidate);
  }
  return order;
}

double share_in_free_order(MeshSource& mesh, const CellTable& cells, const TrialCoder& code,
                           const TrialCoder& code_as_is) {
  OrderTrials trials(mesh, cells, CellGraph(cells));
  return trials.best(code, {}).bytes / std::max(trials.bytes_as_is(code_as_is), 1.0);
}

}  // namespace shm::converters
