// BoundaryFinder and read_boundary(): pass blocks from a caller, an extractor or a Reader to a
// BoundarySearch.
#include "shm/boundary_surface.h"

#include <algorithm>
#include <string>
#include <utility>
#include <variant>

#include "base/errors.h"
#include "boundary/boundary_search.h"
#include "format/schema.h"

namespace shm {

class __attribute__((visibility("hidden"))) BoundaryFinder::Impl {
 public:
  Impl(const Schema& schema, const BoundaryOptions& options)
      : schema_(schema), search_(schema_, options) {}

  Result<void> add(const MeshBlock& block) {
    if (ended_) return misuse("blocks must come before step values", "boundary");
    return search_.add(block);
  }
  Result<void> add(std::uint32_t array, std::uint64_t step, std::uint64_t first,
                   std::span<const std::byte> values, std::span<const std::uint64_t> numbers);
  Result<BoundarySurface> finish();
  const Schema& schema() const { return schema_; }

 private:
  Result<void> end_mesh();

  const Schema schema_;
  BoundarySearch search_;
  bool ended_ = false, finished_ = false;
};

Result<void> BoundaryFinder::Impl::end_mesh() {
  return std::exchange(ended_, true) ? Result<void>() : search_.end_mesh();
}

Result<void> BoundaryFinder::Impl::add(std::uint32_t array, std::uint64_t step, std::uint64_t first,
                                       std::span<const std::byte> values,
                                       std::span<const std::uint64_t> numbers) {
  if (finished_ || array >= schema_.arrays.size())
    return misuse("array " + std::to_string(array) + " does not exist, or the search is finished",
                  "boundary");
  if (auto status = end_mesh(); !status) return status;
  if (numbers.empty())
    search_.found().fill(array, step, first, values);
  else
    search_.found().fill(array, step, numbers, values);
  return {};
}

Result<BoundarySurface> BoundaryFinder::Impl::finish() {
  if (std::exchange(finished_, true)) return misuse("the search is finished", "boundary");
  if (auto status = end_mesh(); !status) return status.error();
  SurfaceBuilder& found = search_.found();
  const std::size_t unfilled = found.unfilled();
  if (unfilled < found.arrays().size()) {
    const BoundaryArray& array = found.arrays()[unfilled];
    return misuse("array '" + schema_.arrays[array.array].name + "' has no values at step " +
                      std::to_string(array.step),
                  "boundary");
  }
  found.surface().left_out = search_.left_out();
  return std::move(found.surface());
}

BoundaryFinder::BoundaryFinder(std::unique_ptr<Impl> impl) : impl_(std::move(impl)) {}
BoundaryFinder::BoundaryFinder(BoundaryFinder&&) noexcept = default;
BoundaryFinder& BoundaryFinder::operator=(BoundaryFinder&&) noexcept = default;
BoundaryFinder::~BoundaryFinder() = default;

Result<BoundaryFinder> BoundaryFinder::create(const Schema& schema,
                                              const BoundaryOptions& options) {
  for (const BoundaryArray& array : options.arrays)
    if (array.array >= schema.arrays.size() || !is_on_mesh(schema.arrays[array.array].location))
      return misuse("there is no array " + std::to_string(array.array) + " on points or cells",
                    "boundary");
  return BoundaryFinder(std::make_unique<Impl>(schema, options));
}
Result<void> BoundaryFinder::add(const MeshBlock& block) { return impl_->add(block); }
Result<void> BoundaryFinder::add(const StepPiece& piece) {
  return impl_->add(piece.array, piece.step, piece.first, piece.values, {});
}
Result<void> BoundaryFinder::add(std::uint32_t array, std::uint64_t step,
                                 const StepValues& values) {
  return impl_->add(array, step, values.first, values.values, values.numbers);
}
Result<BoundarySurface> BoundaryFinder::finish() { return impl_->finish(); }

namespace {

/// Returns the requested static arrays in ascending order, without duplicates.
std::vector<std::uint32_t> static_arrays_of(const Schema& schema, const BoundaryOptions& options) {
  std::vector<std::uint32_t> arrays;
  for (const BoundaryArray& array : options.arrays)
    if (!schema.arrays[array.array].per_step) arrays.push_back(array.array);
  std::sort(arrays.begin(), arrays.end());
  arrays.erase(std::unique(arrays.begin(), arrays.end()), arrays.end());
  return arrays;
}

/// Returns the requested steps, without duplicates, sorted by array and step. Reading them in this
/// order needs the least work.
std::vector<BoundaryArray> steps_of(const Schema& schema, const BoundaryOptions& options) {
  std::vector<BoundaryArray> steps;
  for (const BoundaryArray& array : options.arrays)
    if (schema.arrays[array.array].per_step) steps.push_back(array);
  const auto key = [](const BoundaryArray& wanted) { return std::pair(wanted.array, wanted.step); };
  std::sort(steps.begin(), steps.end(),
            [&](const auto& a, const auto& b) { return key(a) < key(b); });
  steps.erase(std::unique(steps.begin(), steps.end(),
                          [&](const auto& a, const auto& b) { return key(a) == key(b); }),
              steps.end());
  return steps;
}

Result<void> read_steps(StepReader& reader, const std::vector<BoundaryArray>& steps,
                        BoundaryFinder& finder) {
  for (const BoundaryArray& wanted : steps) {
    if (auto status = reader.begin({wanted.array, wanted.step, {}, false}); !status) return status;
    while (true) {
      const auto values = reader.next();
      if (!values) return values.error();
      if (*values == nullptr) break;
      if (auto status = finder.add(wanted.array, wanted.step, **values); !status) return status;
    }
  }
  return {};
}

/// Counts the elements of the requested steps that have been read from a stream so far.
class AwaitedSteps {
 public:
  AwaitedSteps(const Schema& schema, std::vector<BoundaryArray> steps)
      : schema_(&schema), steps_(std::move(steps)), come_(steps_.size()) {}

  void count(const MeshBlock& block) {
    vertices_ += block.vertex_count();
    block_cells_.resize(schema_->blocks.size());
    for (const std::uint32_t b : block.cell_blocks) ++block_cells_[b];
  }
  void count(const StepPiece& piece) {
    const ArrayInfo& info = schema_->arrays[piece.array];
    for (std::size_t i = 0; i < steps_.size(); ++i)
      if (steps_[i].array == piece.array && steps_[i].step == piece.step)
        come_[i] += piece.values.size() / (scalar_bytes(info.type) * info.components);
  }
  /// Returns true if all elements of the requested steps have been read.
  bool have_come() const {
    for (std::size_t i = 0; i < steps_.size(); ++i)
      if (come_[i] < elements(steps_[i].array)) return false;
    return true;
  }

 private:
  std::uint64_t elements(std::uint32_t array) const {
    return elements_of(*schema_, array, vertices_, block_cells_);
  }

  const Schema* schema_;
  std::vector<BoundaryArray> steps_;
  std::vector<std::uint64_t> come_;
  std::uint64_t vertices_ = 0;
  std::vector<std::uint64_t> block_cells_;
};

}  // namespace

Result<BoundarySurface> read_boundary(RandomSource& source, const BoundaryOptions& options,
                                      const ReadLimits& limits, const ReadOptions& reading) {
  auto mesh = MeshExtractor::open(source, limits);
  if (!mesh) return mesh.error();
  auto finder = BoundaryFinder::create(mesh->schema(), options);
  if (!finder) return finder.error();
  const auto steps = steps_of(mesh->schema(), options);
  StepReader* step_reader = nullptr;
  if (!steps.empty()) {
    const auto opened = mesh->step_reader();
    if (!opened) return opened.error();
    step_reader = *opened;
    // Begin each request once before the mesh is read, to fail early if an array has no values at
    // its step.
    for (const BoundaryArray& wanted : steps)
      if (auto status = step_reader->begin({wanted.array, wanted.step, {}, false}); !status)
        return status.error();
  }
  ExtractRequest request;
  request.arrays = static_arrays_of(mesh->schema(), options);
  if (auto status = mesh->begin(request, reading); !status) return status.error();
  while (true) {
    const auto block = mesh->next();
    if (!block) return block.error();
    if (*block == nullptr) break;
    if (auto status = finder->add(**block); !status) return status.error();
  }
  if (step_reader != nullptr)
    if (auto status = read_steps(*step_reader, steps, *finder); !status) return status.error();
  return finder->finish();
}

Result<BoundarySurface> read_boundary(ByteSource& source, const BoundaryOptions& options,
                                      const ReadLimits& limits, const ReadOptions& reading) {
  auto reader = Reader::open(source, limits, reading);
  if (!reader) return reader.error();
  auto finder = BoundaryFinder::create(reader->schema(), options);
  if (!finder) return finder.error();
  AwaitedSteps steps(reader->schema(), steps_of(reader->schema(), options));
  while (true) {
    const auto item = reader->next();
    if (!item) return item.error();
    if (*item == nullptr) break;
    if (const auto* block = std::get_if<MeshBlock>(*item)) {
      steps.count(*block);
      if (auto status = finder->add(*block); !status) return status.error();
    }
    if (const auto* piece = std::get_if<StepPiece>(*item)) {
      steps.count(*piece);
      if (auto status = finder->add(*piece); !status) return status.error();
      if (steps.have_come()) break;
    }
  }
  return finder->finish();
}

}  // namespace shm
