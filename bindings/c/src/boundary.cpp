// Implements shmf_find_boundary() and shmf_get_surface(): the boundary surface of the selected
// cells.
#include <algorithm>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "ends.h"
#include "file.h"
#include "shm/boundary_surface.h"
#include "structs.h"

struct shmf_boundary {
  shm::BoundarySurface surface;
  // For each array of `surface`: pointer to its values, and size of these values in bytes.
  std::vector<const void*> values;
  std::vector<std::uint64_t> bytes;
};

namespace shmf {
namespace {

using shm::Result;

Result<shm::BoundaryOptions> options_of(const shmf_boundary_options* options,
                                        const shm::Schema& schema) {
  const auto own = taken_or_default(options, "options");
  if (!own) return own.error();
  if (own->arrays == nullptr && own->array_count > 0) return misuse("the arrays are NULL");
  shm::BoundaryOptions wanted;
  for (std::size_t i = 0; i < own->array_count; ++i) {
    if (own->arrays[i] >= schema.arrays.size())
      return misuse("no array " + std::to_string(own->arrays[i]));
    wanted.arrays.push_back({own->arrays[i], own->steps == nullptr ? 0 : own->steps[i]});
  }
  if (own->max_bytes != 0) wanted.max_bytes = own->max_bytes;
  wanted.subdivide = own->subdivide != 0;
  return wanted;
}

/// Finds the boundary in one pass over the selected cells, then reads each requested step in one
/// more pass.
class BoundaryPass {
 public:
  /// `file` and `options` are borrowed.
  BoundaryPass(shmf_file& file, const shm::BoundaryOptions& options, const shmf_run_options& run)
      : file_(&file), run_(run), watch_(run) {
    for (const shm::BoundaryArray& array : options.arrays)
      (file.schema().arrays[array.array].per_step ? steps_ : static_).push_back(array);
    all_ = static_cast<double>(file.mesh->cells()) * static_cast<double>(1 + steps_.size());
  }

  Result<shm::BoundarySurface> run(shm::BoundaryFinder finder);

 private:
  Result<void> expect_steps();
  Result<void> read_mesh(shm::BoundaryFinder& finder);
  Result<void> read_step(const shm::BoundaryArray& wanted, shm::BoundaryFinder& finder);
  /// Returns true if the whole file is selected. Vertices and cells then keep the numbers that they
  /// have in the file, and time steps can be read without reading the mesh.
  bool is_whole() const { return file_->piece.cells.all() && !file_->damaged; }

  shmf_file* file_;
  shmf_run_options run_;
  Watch watch_;
  std::vector<shm::BoundaryArray> static_, steps_;
  double done_ = 0, all_ = 0;
};

Result<shm::BoundarySurface> BoundaryPass::run(shm::BoundaryFinder finder) {
  if (auto status = expect_steps(); !status) return status.error();
  if (auto status = read_mesh(finder); !status) return status.error();
  done_ = static_cast<double>(file_->mesh->cells());
  for (const shm::BoundaryArray& wanted : steps_) {
    if (auto status = watch_.tell(done_, all_); !status) return status.error();
    if (auto status = read_step(wanted, finder); !status) return status.error();
    done_ += static_cast<double>(file_->mesh->cells());
  }
  if (auto status = watch_.tell(1, 1); !status) return status.error();
  return finder.finish();
}

/// Fails if an array has no values at its requested step. Called before the mesh is read, so that
/// an invalid request fails early.
Result<void> BoundaryPass::expect_steps() {
  if (!is_whole() || steps_.empty()) return {};
  const auto reader = file_->mesh->step_reader();
  if (!reader) return reader.error();
  for (const shm::BoundaryArray& wanted : steps_)
    if (auto status = (*reader)->begin({wanted.array, wanted.step, std::nullopt, false}); !status)
      return status;
  return {};
}

Result<void> BoundaryPass::read_mesh(shm::BoundaryFinder& finder) {
  shm::ExtractRequest request;
  request.cells = file_->piece.cells;
  request.arrays.emplace();
  for (const shm::BoundaryArray& wanted : static_) request.arrays->push_back(wanted.array);
  std::sort(request.arrays->begin(), request.arrays->end());
  request.arrays->erase(std::unique(request.arrays->begin(), request.arrays->end()),
                        request.arrays->end());
  if (auto status = file_->mesh->begin(request, read_options(run_)); !status) return status;
  while (true) {
    const auto block = file_->mesh->next();
    if (!block) return block.error();
    if (*block == nullptr) return {};
    if (auto status = finder.add(**block); !status) return status;
    done_ += static_cast<double>((*block)->cell_count());
    if (auto status = watch_.tell(done_, all_); !status) return status;
  }
}

Result<void> BoundaryPass::read_step(const shm::BoundaryArray& wanted,
                                     shm::BoundaryFinder& finder) {
  shm::StepReader* reader = nullptr;
  if (is_whole()) {
    const auto opened = file_->mesh->step_reader();
    if (!opened) return opened.error();
    reader = *opened;
  }
  auto status = reader != nullptr ? reader->begin({wanted.array, wanted.step, std::nullopt, false})
                                  : file_->mesh->begin_values(wanted.array, wanted.step);
  if (!status) return status;
  // Adds an empty list of values first, so that `finder` knows this array and step even if no
  // values follow. The selection may be empty, and the values of a damaged file may be lost.
  if (auto none = finder.add(wanted.array, wanted.step, shm::StepValues()); !none) return none;
  while (true) {
    const auto values = reader != nullptr ? reader->next() : file_->mesh->next_values();
    if (!values) return values.error();
    if (*values == nullptr) return {};
    if (auto added = finder.add(wanted.array, wanted.step, **values); !added) return added;
  }
}

}  // namespace
}  // namespace shmf

using shm::Result;
using shmf::misuse;

shmf_status shmf_find_boundary(shmf_file* file, const shmf_boundary_options* options,
                               const shmf_run_options* run, shmf_boundary** boundary,
                               shmf_error* error) {
  if (boundary != nullptr) *boundary = nullptr;
  return shmf::with_mesh(file, error, [&]() -> Result<void> {
    if (boundary == nullptr) return misuse("the pointer for the handle is NULL");
    const auto watched = shmf::taken_or_default(run, "run");
    if (!watched) return watched.error();
    const auto wanted = shmf::options_of(options, file->schema());
    if (!wanted) return wanted.error();
    auto finder = shm::BoundaryFinder::create(file->schema(), *wanted);
    if (!finder) return finder.error();
    auto surface = shmf::BoundaryPass(*file, *wanted, *watched).run(std::move(*finder));
    if (!surface) return surface.error();
    auto made = std::make_unique<shmf_boundary>();
    made->surface = std::move(*surface);
    for (const auto& values : made->surface.arrays) {
      made->values.push_back(values.data());
      made->bytes.push_back(values.size());
    }
    *boundary = made.release();
    return {};
  });
}

shmf_status shmf_get_surface(const shmf_boundary* boundary, shmf_surface* surface,
                             shmf_error* error) {
  return shmf::guarded(error, [&]() -> Result<void> {
    if (boundary == nullptr) return misuse("the boundary is NULL");
    const shm::BoundarySurface& from = boundary->surface;
    shmf_surface own{};
    own.vertices = from.vertex_count();
    own.faces = from.face_count();
    own.corners = from.corners.size();
    own.left_out = from.left_out;
    own.vertex_numbers = from.vertex_numbers.data();
    own.xyz = from.xyz.data();
    own.face_begin = from.face_begin.data();
    own.face_corners = from.corners.data();
    own.cell_numbers = from.cell_numbers.data();
    own.cell_blocks = from.blocks.data();
    own.sides = from.sides.data();
    own.array_values = boundary->values.data();
    own.array_bytes = boundary->bytes.data();
    own.coordinate_type = static_cast<std::int32_t>(from.coordinate_type);
    return shmf::give(surface, own, "the surface");
  });
}

void shmf_boundary_free(shmf_boundary* boundary) { delete boundary; }
