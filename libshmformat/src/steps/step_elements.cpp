#include "steps/step_elements.h"

#include <algorithm>
#include <numeric>
#include <tuple>
#include <utility>

#include "base/errors.h"
#include "base/lists.h"
#include "codecs/shared/digest.h"

namespace shm {
namespace {

/// Divisor that defines "few elements": an array covers few elements if it has at most 1 / kFew of
/// all elements.
constexpr std::uint64_t kFew = 4;
/// Memory in bytes that is always allowed for the elements of arrays that cover few elements, even
/// if the memory limit is lower.
constexpr std::size_t kLeastKept = std::size_t{1} << 20;
/// Maximum number of covers (sets of elements that arrays cover) that are built in one pass over
/// the groups. The number is limited because each cover needs memory for each slot. The first pass
/// builds one cover. The number then doubles from pass to pass, because a caller that needs several
/// covers usually needs all of them.
constexpr std::size_t kMostCoversAtOnce = 16;

/// Block number that GroupElements assigns to vertices that are not imported.
constexpr std::uint32_t kOwn[] = {0};

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
    return std::tie(schema.arrays[a].location, schema.arrays[a].blocks, schema.arrays[a].elements);
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
  const auto found = std::lower_bound(
      groups.begin(), groups.end(), group,
      [](const OfGroup& of_group, std::size_t number) { return of_group.group < number; });
  return static_cast<std::size_t>(found - groups.begin());
}

void StepElements::make_dense(Cover& cover) {
  cover.is_sparse = false;
  let_go(cover.sparse);
}

void StepElements::expect(std::uint32_t array, std::uint64_t elements) {
  Cover& entry = cover(array);
  entry.array = array;
  const ArrayInfo& info = schema_->arrays[array];
  if (!is_on_mesh(info.location)) {
    entry.groups.clear();
    if (elements > 0) entry.groups.push_back({0, elements});
    entry.counted = ~std::size_t{0};
    return;
  }
  // If elements of this cover have already been counted but `sparse` has not been built, an earlier
  // step has found that the cover has too many elements to be sparse. The cover then stays dense,
  // even if `elements` is smaller at a later step.
  if (entry.made || entry.counted > 0 || info.components > kMostStepComponents) return;
  const bool covers_all = !of_points(entry) && info.blocks.empty();
  const std::uint64_t all =
      of_points(entry) ? topology_->vertices_in_all() : topology_->cells_in_all();
  entry.is_sparse = !covers_all && elements <= all / kFew;
}

Result<void> StepElements::count_up_to(Cover& cover, std::size_t group) {
  if (cover.is_sparse && !cover.made)
    if (auto status = make_sparse((*numbers_of_covers_)[cover.array]); !status) return status;
  for (; cover.counted <= group; ++cover.counted) {
    const auto count = topology_->count(cover.array, cover.counted);
    if (!count) return count.error();
    if (*count > 0) cover.groups.push_back({static_cast<std::uint32_t>(cover.counted), *count});
  }
  return {};
}

Result<const StepElements::OfGroup*> StepElements::nth_group(std::uint32_t array, std::size_t nth,
                                                             std::size_t last) {
  Cover& entry = cover(array);
  while (entry.groups.size() <= nth && entry.counted <= last)
    if (auto status = count_up_to(entry, entry.counted); !status) return status.error();
  if (nth >= entry.groups.size() || entry.groups[nth].group > last) return nullptr;
  return &entry.groups[nth];
}

Result<std::uint64_t> StepElements::count(std::uint32_t array, std::size_t group) {
  Cover& entry = cover(array);
  if (auto status = count_up_to(entry, group); !status) return status.error();
  const std::size_t nth = entry.nth(group);
  return nth < entry.groups.size() && entry.groups[nth].group == group ? entry.groups[nth].count
                                                                       : 0;
}

Result<ColumnElements> StepElements::elements(std::uint32_t array, std::size_t group) {
  Cover& entry = cover(array);
  if (auto status = count_up_to(entry, group); !status) return status.error();
  if (!entry.is_sparse) {
    const auto elements = topology_->elements(group);
    if (!elements) return elements.error();
    return dense(array, **elements);
  }
  const SparseGroup& sparse = entry.sparse[entry.nth(group)];
  sparse.unfold(covered_blocks(entry).front(), unfolded_);
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

/// Returns the numbers by which digests identify the elements of an array in a group: those of the
/// vertices or cells. Elements on no vertex and no cell are numbered from 0.
Result<std::span<const std::uint64_t>> StepElements::numbers(std::uint32_t array, std::size_t group,
                                                             std::uint64_t first,
                                                             std::size_t count) {
  const ArrayInfo& info = schema_->arrays[array];
  const bool keeps = schema_->order == Order::keep;
  if (info.location == Location::point && keeps) return topology_->vertex_numbers(group);
  if (info.location == Location::cell && ((keeps && schema_->delay > 0) || !info.blocks.empty())) {
    const auto all = elements(array, group);
    if (!all) return all.error();
    return all->numbers;
  }
  const container::GroupHeader& header = topology_->header_of(group);
  if (info.location == Location::point) first = header.first_vertex;
  if (info.location == Location::cell) first = header.first_cell;
  numbers_.resize(count);
  std::iota(numbers_.begin(), numbers_.end(), first);
  return std::span<const std::uint64_t>(numbers_);
}

Result<std::uint64_t> StepElements::digest(std::uint32_t array, std::uint64_t step,
                                           std::size_t group, std::uint64_t first,
                                           std::span<const std::byte> values) {
  const ArrayInfo& info = schema_->arrays[array];
  const std::size_t stride = scalar_bytes(info.type) * info.components;
  const auto of = numbers(array, group, first, values.size() / stride);
  if (!of) return of.error();
  if (of->size() != values.size() / stride)
    return corrupt("the number of values differs from the number of elements", "step values");
  return digest_of_values(DigestKeys::of_array(array, step), *of, values.data(), stride, info.type,
                          info.components);
}

/// Reads all groups once, and builds the cover `wanted` and some covers that will probably be
/// needed next. If a cover needs too much memory, it is not stored. For each step of its arrays,
/// the mesh is then decoded again, as it is for arrays that cover many elements.
Result<void> StepElements::make_sparse(std::uint32_t wanted) {
  std::vector<Making> all;
  for (auto next = covers_.find(wanted); next != covers_.end() && all.size() < made_at_once_;
       ++next) {
    Cover& next_cover = next->second;
    if (!next_cover.is_sparse || next_cover.made) continue;
    next_cover.made = true;
    all.push_back({&next_cover, SparseGroupBuilder(covered_blocks(next_cover), next_cover.sparse)});
  }
  made_at_once_ = std::min(2 * made_at_once_, kMostCoversAtOnce);
  Result<void> status;
  for (std::size_t g = 0; status && g < topology_->groups(); ++g) status = add_group(g, all);
  for (const auto& [cover, maker] : all) {
    if (!status) make_dense(*cover);
    if (cover->is_sparse) kept_bytes_ += maker.bytes();
  }
  topology_->release();
  return status;
}

Result<void> StepElements::add_group(std::size_t group, std::span<Making> all) {
  const auto elements = topology_->elements(group);
  if (!elements) return elements.error();
  const bool ends = group + 1 == groups() || segment_of(group + 1) != segment_of(group);
  const std::size_t most = std::max(topology_->most_kept(), kLeastKept);
  std::size_t bytes = kept_bytes_;
  for (auto& [cover, maker] : all) {
    if (!cover->is_sparse) continue;
    if (auto status = count_up_to(*cover, group); !status) return status;
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
