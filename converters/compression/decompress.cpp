#include "compression/decompress.h"

#include <sys/stat.h>

#include <algorithm>
#include <cstring>
#include <utility>
#include <variant>

#include "base/failure.h"
#include "formats/formats.h"
#include "interface/format.h"
#include "shm/summary.h"

namespace shm::converters {
namespace {

std::uint64_t file_bytes(const std::string& path) {
  struct stat status {};
  return ::stat(path.c_str(), &status) == 0 && S_ISREG(status.st_mode)
             ? static_cast<std::uint64_t>(status.st_size)
             : 0;
}

// Forwards reads to another source, and reports the number of bytes read so far as progress.
class WatchedSource final : public ByteSource {
 public:
  WatchedSource(ByteSource& source, std::uint64_t total, Progress progress)
      : source_(&source), total_(total), progress_(std::move(progress)) {}
  Result<std::size_t> read(std::span<std::byte> into) override {
    Result<std::size_t> result = source_->read(into);
    if (result) done_ += *result;
    if (progress_) progress_("decoding", done_, total_);
    return result;
  }

 private:
  ByteSource* source_;
  std::uint64_t done_ = 0, total_;
  Progress progress_;
};

}  // namespace

StagedMesh::StagedMesh(ByteSource& source, const std::string& name, Spool& spool,
                       const ReadLimits& limits, const ReadOptions& options)
    : name_(name),
      spool_(&spool),
      points_(spool, 3 * sizeof(double)),
      cells_(spool),
      vertex_numbers_(spool),
      cell_numbers_(spool) {
  Reader reader = unwrap(Reader::open(source, limits, options), name);
  info_.schema = reader.schema();
  info_.block_cells.assign(info_.schema.blocks.size(), 0);
  points_ = PagedArray(spool, 3 * scalar_bytes(info_.schema.coordinate_type));
  for (std::size_t a = 0; a < info_.schema.arrays.size(); ++a)
    arrays_.push_back({PagedArray(spool, info_.array_stride(a)), {}, 0, {}});

  bool ended = false;
  while (Item* item = unwrap(reader.next(), name)) {
    if (const auto* block = std::get_if<MeshBlock>(item)) {
      if (mesh_done_) fail("mesh", "vertices or cells come after step values");
      stage_mesh(*block);
    } else if (const auto* piece = std::get_if<StepPiece>(item)) {
      mesh_done_ = true;
      stage_step(*piece);
    } else if (const auto* times = std::get_if<StepTimes>(item)) {
      info_.step_times.insert(info_.step_times.end(), times->times.begin(), times->times.end());
    } else if (auto* extra = std::get_if<Extra>(item)) {
      info_.extras.push_back(std::move(*extra));
    } else {
      totals_ = std::get<Totals>(*item);
      info_.segment_starts = totals_.segment_starts;
      info_.segment_connectivity = totals_.segment_connectivity;
      ended = true;
    }
  }
  if (!ended) fail("end", "has no totals");
  finish();
}

void StagedMesh::stage_mesh(const MeshBlock& block) {
  for (const std::uint64_t number : block.vertex_numbers) {
    vertices_moved_ |= number != vertex_numbers_.size();
    vertex_numbers_.push_back(number);
  }
  info_.vertices += block.vertex_count();
  points_.append(block.vertex_count(), block.xyz.data());
  for (std::size_t i = 0; i < block.cell_count(); ++i) {
    cells_moved_ |= block.cell_numbers[i] != cell_numbers_.size();
    cell_numbers_.push_back(block.cell_numbers[i]);
    const std::uint64_t begin = block.corner_begin[i];
    cells_.append(block.cell_blocks[i],
                  std::span(block.corners).subspan(begin, block.corner_begin[i + 1] - begin));
    ++info_.block_cells[block.cell_blocks[i]];
  }
  for (std::size_t a = 0; a < arrays_.size(); ++a) {
    if (info_.schema.arrays[a].per_step || block.arrays[a].empty()) continue;
    const std::uint64_t count = block.arrays[a].size() / info_.array_stride(a);
    arrays_[a].values.append(count, block.arrays[a].data());
    arrays_[a].staged += count;
  }
}

void StagedMesh::stage_step(const StepPiece& piece) {
  Array& array = arrays_[piece.array];
  const std::uint64_t elements = info_.array_elements(piece.array);
  const std::uint64_t count = piece.values.size() / info_.array_stride(piece.array);
  const auto place = array.steps.try_emplace(piece.step, array.steps.size()).first->second;
  if (place + 1 != array.steps.size() || array.staged != place * elements + piece.first ||
      count > elements - piece.first)
    fail("array " + info_.schema.arrays[piece.array].name,
         "values of step " + std::to_string(piece.step) + " are out of order");
  array.values.append(count, piece.values.data());
  array.staged += count;
}

void StagedMesh::finish() {
  const std::uint64_t cells = cells_.size();
  if (totals_.vertices != info_.vertices || totals_.cells != cells)
    fail("end", "states " + std::to_string(totals_.vertices) + " vertices and " +
                    std::to_string(totals_.cells) + " cells, but holds " +
                    std::to_string(info_.vertices) + " and " + std::to_string(cells));
  try {
    if (vertices_moved_)
      vertex_positions_ = invert(vertex_numbers_, info_.vertices, "vertex", *spool_);
    if (cells_moved_) cell_positions_ = invert(cell_numbers_, cells, "cell", *spool_);
  } catch (const Failure& failure) {
    fail(failure.error().section, failure.error().detail);
  }
  for (std::size_t a = 0; a < arrays_.size(); ++a) {
    const ArrayInfo& array = info_.schema.arrays[a];
    const std::uint64_t sets = array.per_step ? arrays_[a].steps.size() : 1;
    if (arrays_[a].staged != sets * info_.array_elements(a))
      fail("array " + array.name, "holds " + std::to_string(arrays_[a].staged) + " values, but " +
                                      std::to_string(sets * info_.array_elements(a)) +
                                      " are expected");
    if (array.per_step && !arrays_[a].steps.empty() &&
        arrays_[a].steps.rbegin()->first >= info_.step_times.size())
      fail("array " + array.name, "has values of a step without a time");
  }
  if (cells_moved_) map_partial_arrays();
  translate_old_extras(info_);
  rewind_cells();
}

void StagedMesh::map_partial_arrays() {
  CoveredOrder covered(*this, cell_numbers_, *spool_);
  for (std::size_t a = 0; a < arrays_.size(); ++a) {
    const ArrayInfo& array = info_.schema.arrays[a];
    if (array.location != Location::cell || array.blocks.empty()) continue;
    arrays_[a].positions = std::make_unique<NumberTable>(
        invert(covered.elements(a), info_.array_elements(a), "cell", *spool_));
  }
}

void StagedMesh::read_points(std::uint64_t first, std::uint64_t count, std::byte* out) {
  gather(points_, 0, 3 * scalar_bytes(info_.schema.coordinate_type),
         vertex_positions_ ? &*vertex_positions_ : nullptr, first, count, out);
}

bool StagedMesh::next_cells(CellBatch& out, std::size_t max_cells) {
  out.clear();
  const std::uint64_t count = std::min<std::uint64_t>(max_cells, cells_.size() - next_cell_);
  if (!cell_positions_) {
    cells_.read_run(next_cell_, count, out);
  } else {
    for (std::uint64_t i = 0; i < count; ++i)
      cells_.read(cell_positions_->get(next_cell_ + i), out);
  }
  next_cell_ += count;
  return count > 0;
}

void StagedMesh::read_array(std::size_t array, std::uint64_t step, std::uint64_t first,
                            std::uint64_t count, std::byte* out) {
  const ArrayInfo& info = info_.schema.arrays[array];
  Array& staged = arrays_[array];
  const std::size_t stride = info_.array_stride(array);
  std::uint64_t base = 0;
  if (info.per_step) {
    const auto found = staged.steps.find(step);
    if (found == staged.steps.end()) {  // the file has no values of the array for this step
      std::memset(out, 0, count * stride);
      return;
    }
    base = found->second * info_.array_elements(array);
  }
  NumberTable* positions = nullptr;
  if (info.location == Location::point)
    positions = vertex_positions_ ? &*vertex_positions_ : nullptr;
  else if (cells_moved_ && info.location == Location::cell)
    positions = info.blocks.empty() ? &*cell_positions_ : staged.positions.get();
  gather(staged.values, base, stride, positions, first, count, out);
}

void StagedMesh::gather(PagedArray& values, std::uint64_t base, std::size_t stride,
                        NumberTable* positions, std::uint64_t first, std::uint64_t count,
                        std::byte* out) {
  if (positions == nullptr) return values.read(base + first, count, out);
  // Elements with consecutive numbers are often consecutive in coding order, too. Read elements
  // that are consecutive in both orders in one call.
  for (std::uint64_t i = 0; i < count;) {
    const std::uint64_t begin = positions->get(first + i);
    std::uint64_t run = 1;
    while (i + run < count && positions->get(first + i + run) == begin + run) ++run;
    values.read(base + begin, run, out + i * stride);
    i += run;
  }
}

void StagedMesh::fail(const std::string& section, const std::string& detail) const {
  throw Failure(
      Error{.code = ErrorCode::corrupt, .detail = detail, .section = section, .file = name_});
}

ReadLimits read_limits(const Spool& spool) {
  ReadLimits limits;
  limits.max_unpacked_bytes = spool.memory_budget() / 4;
  limits.max_column_bytes = spool.memory_budget() / 8;
  limits.max_active_bytes = spool.memory_budget() / 4;
  limits.max_kept_steps_bytes = kept_steps_bytes(spool);
  limits.temporary_folder = spool.directory();
  limits.max_vertices = limits.max_cells = spool.limits().most;
  limits.max_decoded_bytes = spool.limits().bytes;
  return limits;
}

std::unique_ptr<StagedMesh> stage_shm(ByteSource& source, const std::string& name,
                                      std::uint64_t total, Spool& spool, const Progress& progress,
                                      unsigned threads, std::uint64_t bytes_of_file) {
  WatchedSource watched(source, total, progress);
  ReadOptions options;
  options.file_bytes = bytes_of_file;
  options.threads = threads;
  options.kept_topology_bytes = kept_topology_bytes(spool);
  ReadLimits limits = read_limits(spool);
  limits.max_active_bytes += ReadLimits::kActiveBytesEach * total;
  return std::make_unique<StagedMesh>(watched, name, spool, limits, options);
}
std::unique_ptr<MeshSource> open_shm(const std::string& path, Spool& spool,
                                     const Progress& progress, unsigned threads) {
  const auto file = unwrap(FileSource::open(path), path);
  const auto anywhere = file->anywhere();
  const auto bytes = anywhere ? bytes_of_file(**anywhere) : Result<std::uint64_t>(0);
  return stage_shm(*file, path, file_bytes(path), spool, progress, threads, bytes ? *bytes : 0);
}
std::unique_ptr<MeshSource> open_shm(const std::string& path, Spool& spool,
                                     const Progress& progress) {
  return open_shm(path, spool, progress, 0);
}

namespace {

FileSummary file_summary(Summary&& summary) {
  FileSummary out;
  out.info.schema = std::move(summary.schema);
  out.info.step_times = std::move(summary.step_times);
  out.info.extras = std::move(summary.extras);
  out.totals = std::move(summary.totals);
  out.info.vertices = out.totals.vertices;
  out.info.segment_starts = out.totals.segment_starts;
  out.info.segment_connectivity = out.totals.segment_connectivity;
  out.info.block_cells = out.totals.block_cells;
  out.info.block_cells.resize(out.info.schema.blocks.size());
  translate_old_extras(out.info);
  return out;
}

}  // namespace

FileSummary summarize_shm(RandomSource& source, const std::string& name) {
  return file_summary(unwrap(read_summary(source), name));
}

FileSummary summarize_shm(const std::string& path) {
  return summarize_shm(*unwrap(FileRandomSource::open(path), path), path);
}

FileSummary summarize_stream(ByteSource& source, const std::string& name,
                             const Progress& progress) {
  WatchedSource watched(source, 0, progress);
  ReadOptions options;
  options.threads = 0;
  // Step values are predicted from neighbouring vertices and cells. If the lists of neighbours fit
  // into 4 MiB, they are derived only once. Otherwise they are derived again for each array and
  // step.
  options.kept_topology_bytes = std::size_t{4} << 20;
  Reader reader = unwrap(Reader::open(watched, {}, options), name);
  Summary summary;
  summary.schema = reader.schema();
  while (Item* item = unwrap(reader.next(), name)) {
    if (const auto* times = std::get_if<StepTimes>(item))
      summary.step_times.insert(summary.step_times.end(), times->times.begin(), times->times.end());
    if (auto* extra = std::get_if<Extra>(item)) summary.extras.push_back(std::move(*extra));
    if (auto* totals = std::get_if<Totals>(item)) summary.totals = std::move(*totals);
  }
  return file_summary(std::move(summary));
}

}  // namespace shm::converters
