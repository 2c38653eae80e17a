#include "steps/step_elements.h"

#include <algorithm>
#include <tuple>
#include <utility>

#include "bytes/lists.h"

namespace shm {
namespace {

/// Elements are few where they are one in so many.
constexpr std::uint64_t kFew = 4;
/// So much may be kept of them in any case.
constexpr std::size_t kLeastKept = std::size_t{1} << 20;
/// So many covers are made at once, whose arrays by slot take memory each: the first time one, then
/// twice as many each time, since who asks for many asks for all.
constexpr std::size_t kMostCoversAtOnce = 16;

constexpr std::uint32_t kOwn[] = {0};  // GroupElements: the block of vertices that are not imported

}  // namespace

struct StepElements::Making {
  Cover* cover;
  SparseGroupBuilder maker;
};

CoverNumbers cover_numbers(const Schema& schema) {
  auto numbers = std::make_shared<std::vector<std::uint32_t>>(schema.arrays.size());
  std::vector<std::uint32_t> arrays;
  for (std::uint32_t a = 0; a < schema.arrays.size(); ++a)
    if (schema.arrays[a].per_step) arrays.push_back(a);
  const auto covers = [&](std::uint32_t a) {
    return std::tie(schema.arrays[a].location, schema.arrays[a].blocks);
  };
  std::stable_sort(arrays.begin(), arrays.end(),
                   [&](std::uint32_t a, std::uint32_t b) { return covers(a) < covers(b); });
  for (std::size_t i = 1; i < arrays.size(); ++i)
    (*numbers)[arrays[i]] =
        (*numbers)[arrays[i - 1]] + (covers(arrays[i]) == covers(arrays[i - 1]) ? 0 : 1);
  return numbers;
}

StepElements::StepElements(const Schema& schema, StepTopology& topology, CoverNumbers covers)
    : schema_(&schema), topology_(&topology), numbers_of_covers_(std::move(covers)) {}

std::span<const std::uint32_t> StepElements::covered_blocks(const Cover& cover) const {
  if (of_points(cover)) return kOwn;
  return schema_->arrays[cover.array].blocks;
}

std::size_t StepElements::Cover::nth(std::size_t group) const {
  const auto found =
      std::lower_bound(groups.begin(), groups.end(), group,
                       [](const OfGroup& it, std::size_t number) { return it.group < number; });
  return static_cast<std::size_t>(found - groups.begin());
}

void StepElements::make_dense(Cover& cover) {
  cover.is_sparse = false;
  let_go(cover.sparse);
}

void StepElements::expect(std::uint32_t array, std::uint64_t elements) {
  Cover& it = cover(array);
  it.array = array;
  const ArrayInfo& info = schema_->arrays[array];
  // Groups that were counted before are those of a dense cover; that stays as it is, whatever is
  // expected of a later step.
  if (it.made || it.counted > 0 || info.components > kMostStepComponents) return;
  const bool covers_all = !of_points(it) && info.blocks.empty();
  const std::uint64_t all =
      of_points(it) ? topology_->vertices_in_all() : topology_->cells_in_all();
  it.is_sparse = !covers_all && elements <= all / kFew;
}

Result<void> StepElements::count_up_to(Cover& it, std::size_t group) {
  if (it.is_sparse && !it.made)
    if (auto good = make_sparse((*numbers_of_covers_)[it.array]); !good) return good;
  for (; it.counted <= group; ++it.counted) {
    const auto count = topology_->count(it.array, it.counted);
    if (!count) return count.error();
    if (*count > 0) it.groups.push_back({static_cast<std::uint32_t>(it.counted), *count});
  }
  return {};
}

Result<const StepElements::OfGroup*> StepElements::nth_group(std::uint32_t array, std::size_t nth,
                                                             std::size_t last) {
  Cover& it = cover(array);
  while (it.groups.size() <= nth && it.counted <= last)
    if (auto good = count_up_to(it, it.counted); !good) return good.error();
  if (nth >= it.groups.size() || it.groups[nth].group > last) return nullptr;
  return &it.groups[nth];
}

Result<std::uint64_t> StepElements::count(std::uint32_t array, std::size_t group) {
  Cover& it = cover(array);
  if (auto good = count_up_to(it, group); !good) return good.error();
  const std::size_t nth = it.nth(group);
  return nth < it.groups.size() && it.groups[nth].group == group ? it.groups[nth].count : 0;
}

Result<ColumnElements> StepElements::elements(std::uint32_t array, std::size_t group) {
  Cover& it = cover(array);
  if (auto good = count_up_to(it, group); !good) return good.error();
  if (!it.is_sparse) {
    const auto elements = topology_->elements(group);
    if (!elements) return elements.error();
    return dense(array, **elements);
  }
  const SparseGroup& sparse = it.sparse[it.nth(group)];
  sparse.unfold(covered_blocks(it).front(), unfolded_);
  return ColumnElements{&unfolded_, sparse.slots, sparse.all_slots, sparse.numbers};
}

ColumnElements StepElements::dense(std::uint32_t array, const GroupElements& all) {
  if (of_points(cover(array))) return {&all.vertices, all.slots, 0, all.vertex_numbers};
  if (schema_->arrays[array].blocks.empty()) return {&all.cells, all.slots, 0, all.cell_numbers};
  numbers_.clear();
  Coverage covers(schema_->arrays[array].blocks);
  for (std::size_t c = 0; c < all.cell_numbers.size(); ++c)
    if (covers(all.cells.blocks[c])) numbers_.push_back(all.cell_numbers[c]);
  return {&all.cells, all.slots, 0, numbers_};
}

/// All groups once, for this cover and for some of those that will be asked for next. A cover of
/// which too much would be kept is decoded with the mesh, as those of many elements.
Result<void> StepElements::make_sparse(std::uint32_t wanted) {
  std::vector<Making> all;
  for (auto next = covers_.find(wanted); next != covers_.end() && all.size() < made_at_once_;
       ++next) {
    Cover& it = next->second;
    if (!it.is_sparse || it.made) continue;
    it.made = true;
    all.push_back({&it, SparseGroupBuilder(covered_blocks(it), it.sparse)});
  }
  made_at_once_ = std::min(2 * made_at_once_, kMostCoversAtOnce);
  Result<void> good;
  for (std::size_t g = 0; good && g < topology_->groups(); ++g) good = add_group(g, all);
  for (const auto& [cover, maker] : all) {
    if (!good) make_dense(*cover);
    if (cover->is_sparse) kept_bytes_ += maker.bytes();
  }
  topology_->release();
  return good;
}

Result<void> StepElements::add_group(std::size_t group, std::span<Making> all) {
  const auto elements = topology_->elements(group);
  if (!elements) return elements.error();
  const bool ends = group + 1 == groups() || segment_of(group + 1) != segment_of(group);
  const std::size_t most = std::max(topology_->most_kept(), kLeastKept);
  std::size_t bytes = kept_bytes_;
  for (auto& [cover, maker] : all) {
    if (!cover->is_sparse) continue;
    if (auto good = count_up_to(*cover, group); !good) return good;
    if (!cover->groups.empty() && cover->groups.back().group == group)
      maker.add_group(of_points(*cover) ? (*elements)->vertices : (*elements)->cells,
                      (*elements)->slots,
                      of_points(*cover) ? (*elements)->vertex_numbers : (*elements)->cell_numbers);
    if (ends) maker.end_segment();
    if (bytes + maker.bytes() > most)
      make_dense(*cover);
    else
      bytes += maker.bytes();
  }
  return {};
}

}  // namespace shm
