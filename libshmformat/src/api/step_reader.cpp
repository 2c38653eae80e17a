// StepReader: finds the chunks of a step through the index, and reads only these chunks.
#include "shm/step_reader.h"

#include <algorithm>
#include <map>
#include <memory>
#include <numeric>
#include <string>
#include <utility>

#include "api/kept_steps.h"
#include "base/errors.h"
#include "format/schema.h"
#include "random/indexed_file.h"
#include "random/indexed_topology.h"
#include "random/segment_steps.h"
#include "random/step_index.h"
#include "steps/step_memory.h"

namespace shm {
namespace {

/// Topology of one segment, and for each stepped array the elements that are in this segment.
struct SegmentMesh {
  SegmentMesh(const Schema& schema, std::uint64_t most_bytes, const ElementNeeds& needs,
              std::size_t most_kept, const CellBytes& cell_bytes)
      : topology(schema, most_bytes, needs, most_kept, cell_bytes) {}

  std::size_t kept_bytes() const {
    return topology.kept_bytes() + (elements ? elements->kept_bytes() : 0);
  }

  StepTopology topology;
  // For each stepped array, its elements in the segment. Created as soon as the topology contains
  // all groups.
  std::optional<StepElements> elements;
};

}  // namespace

class __attribute__((visibility("hidden"))) StepReader::Impl {
 public:
  explicit Impl(std::shared_ptr<IndexedFile> file) : file_(std::move(file)) {}

  /// Opens the index of steps. Precondition: the file is open.
  Result<void> open();
  const IndexedFile& file() const { return *file_; }
  const StepIndex& index() const { return index_; }
  const std::vector<double>& step_times() const { return times_; }
  bool is_stepped(std::uint32_t array) const {
    return array < file_->schema().arrays.size() && file_->schema().arrays[array].per_step;
  }

  Result<std::optional<std::size_t>> find(std::uint32_t array, std::uint64_t step) const;
  Result<void> begin(const StepRequest& request);
  Result<StepValues*> next();

 private:
  void prefetch_parts();
  bool find_segment();
  Result<void> begin_segment();
  HeldSteps& held_steps();
  Result<void> read_group();
  void end_segment();
  Result<SegmentMesh*> mesh_of(std::size_t segment, const ElementNeeds& needs);
  bool numbers_need_mesh() const;
  Result<void> number(const StepIndex::Part& part);

  const ArrayInfo& info() const { return file_->schema().arrays[request_.array]; }
  bool of_points() const { return info().location == Location::point; }

  std::shared_ptr<IndexedFile> file_;
  StepIndex index_;
  std::vector<double> times_;
  StepReference most_ = StepReference::nothing;
  CellBytes cell_bytes_;  // size of a cell's data, indexed by block
  CoverNumbers covers_;
  std::map<std::size_t, SegmentMesh> meshes_;  // meshes in memory, keyed by segment
  std::size_t kept_bytes_ = 0;                 // memory in bytes that meshes_ uses, without mesh_
  // Values kept in memory between requests, keyed by array and segment.
  std::optional<StepStore> store_;
  std::map<std::pair<std::uint32_t, std::size_t>, HeldSteps> held_;
  HeldBundles bundles_;

  // State of the current request.
  StepRequest request_;
  std::size_t wanted_ = 0;  // index of the requested step among the steps of the array
  // Index of the current segment, and end of the range of segments to read.
  std::size_t segment_ = 0, end_segment_ = 0;
  std::optional<SegmentSteps> steps_;  // reader of the steps of the current segment
  SegmentMesh* mesh_ = nullptr;        // mesh of the current segment; null if it is not needed
  std::optional<Error> error_;
  StepValues values_;
};

Result<void> StepReader::Impl::open() {
  auto times = file_->read_step_times();
  if (!times) return times.error();
  times_ = std::move(*times);
  auto index = StepIndex::of(*file_);
  if (!index) return index.error();
  index_ = std::move(*index);
  most_ = file_->schema().step_references;
  store_.emplace(
      kept_steps(file_->limits().max_kept_steps_bytes, file_->limits().temporary_folder));
  cell_bytes_ = std::make_shared<const std::vector<std::size_t>>(cell_data_bytes(file_->schema()));
  covers_ = cover_numbers(file_->schema());
  return {};
}

/// Returns the index of `step` among the array's steps, or nullopt if the array has no elements.
Result<std::optional<std::size_t>> StepReader::Impl::find(std::uint32_t array,
                                                          std::uint64_t step) const {
  if (!is_stepped(array))
    return misuse("array " + std::to_string(array) + " is not a stepped array", "steps");
  const auto& steps = index_.steps(array);
  const auto found = std::lower_bound(
      steps.begin(), steps.end(), step,
      [](const StepIndex::Step& entry, std::uint64_t wanted) { return entry.step < wanted; });
  if (found != steps.end() && found->step == step)
    return std::optional(static_cast<std::size_t>(found - steps.begin()));
  if (index_.elements(array) == 0) return std::optional<std::size_t>();
  return misuse("array '" + file_->schema().arrays[array].name + "' has no values at step " +
                    std::to_string(step),
                "steps");
}

Result<void> StepReader::Impl::begin(const StepRequest& request) {
  error_.reset();
  end_segment();
  segment_ = end_segment_ = 0;
  const auto found = find(request.array, request.step);
  if (request.segment && *request.segment >= file_->segments().size() && is_stepped(request.array))
    return misuse("there is no segment " + std::to_string(*request.segment), "steps");
  if (!found) return found.error();
  request_ = request;
  if (!*found) return {};
  wanted_ = **found;
  segment_ = request.segment.value_or(0);
  end_segment_ = request.segment ? segment_ + 1 : file_->segments().size();
  prefetch_parts();
  return {};
}

/// Announces to the source the chunks of step values that will be read, at most kMostRanges of
/// them.
void StepReader::Impl::prefetch_parts() {
  constexpr std::size_t kMostRanges = 1 << 14;
  const auto& steps = index_.steps(request_.array);
  const std::vector<std::size_t> chain = index_.chain(request_.array, wanted_);
  auto next = chain.begin();
  const auto held = held_.find({request_.array, segment_});
  if (held != held_.end() && held->second.at) {
    const auto at = std::find(chain.begin(), chain.end(), *held->second.at);
    if (at != chain.end()) next = at + 1;
  }
  std::vector<ByteRange> ranges;
  for (; next != chain.end() && ranges.size() < kMostRanges; ++next)
    for (const StepIndex::Part& part : index_.parts(steps[*next], file_->first_group(segment_),
                                                    file_->first_group(end_segment_))) {
      if (!ranges.empty() && ranges.back().offset == part.offset) continue;
      if (ranges.size() == kMostRanges) break;
      ranges.push_back({part.offset, part.bytes});
    }
  file_->source().prefetch(ranges);
}

Result<StepValues*> StepReader::Impl::next() {
  if (error_) return *error_;
  while (segment_ < end_segment_) {
    if (!steps_ && !find_segment()) break;
    if (!steps_)
      if (auto status = begin_segment(); !status) return *(error_ = status.error());
    if (!steps_->at_end()) {
      if (auto status = read_group(); !status) return *(error_ = status.error());
      return &values_;
    }
    end_segment();
    ++segment_;
  }
  return nullptr;
}

/// Advances to the first segment that has elements of the array; this may be the current segment.
/// Returns false if no such segment is left.
bool StepReader::Impl::find_segment() {
  const auto parts = index_.parts(index_.steps(request_.array)[wanted_],
                                  file_->first_group(segment_), file_->first_group(end_segment_));
  segment_ = parts.empty() ? end_segment_ : file_->segment_of(parts.front().group);
  return !parts.empty();
}

Result<void> StepReader::Impl::begin_segment() {
  steps_.emplace(*file_, index_, most_, request_.array, segment_, wanted_, held_steps(), bundles_);
  ElementNeeds needs;
  (of_points() ? needs.vertices : needs.cells) = steps_->needs_mesh();
  (of_points() ? needs.vertex_numbers : needs.cell_numbers) = numbers_need_mesh();
  if (!needs.any()) return {};
  const auto mesh = mesh_of(segment_, needs);
  if (!mesh) return mesh.error();
  mesh_ = *mesh;
  kept_bytes_ -= mesh_->kept_bytes();
  mesh_->elements->expect(request_.array, steps_->elements());
  return {};
}

/// Returns the values of the current array and segment that are kept between requests. If they do
/// not fit into memory, drops those of other arrays and segments.
HeldSteps& StepReader::Impl::held_steps() {
  const std::pair key(request_.array, segment_);
  std::uint64_t bytes = 0;
  if (most_ != StepReference::nothing)
    for (const StepIndex::Part& part :
         index_.parts(index_.steps(request_.array)[wanted_], file_->first_group(segment_),
                      file_->first_group(segment_ + 1)))
      bytes += part.count * scalar_bytes(info().type) * info().components;
  const auto found = held_.find(key);
  if (found != held_.end()) {
    if (found->second.last.capacity() >= bytes) return found->second;
    held_.erase(found);
  }
  if (store_->memory_left() / 2 < bytes) held_.clear();
  return held_.try_emplace(key, *store_, bytes).first->second;
}

void StepReader::Impl::end_segment() {
  steps_.reset();
  if (mesh_ == nullptr) return;
  mesh_->topology.release();
  kept_bytes_ += mesh_->kept_bytes();
  mesh_ = nullptr;
}

Result<void> StepReader::Impl::read_group() {
  const StepIndex::Part part = steps_->next_part();
  auto values = steps_->read_next(mesh_ != nullptr ? &*mesh_->elements : nullptr);
  if (!values) return values.error();
  values_.first = part.first;
  values_.values = std::move(*values);
  values_.numbers.clear();
  return request_.numbers ? number(part) : Result<void>();
}

// --- numbers

bool StepReader::Impl::numbers_need_mesh() const {
  const Schema& schema = file_->schema();
  if (!request_.numbers || !is_on_mesh(info().location)) return false;
  if (of_points()) return schema.order == Order::keep;
  return (schema.order == Order::keep && schema.delay > 0) ||
         (!info().blocks.empty() && info().blocks.size() < schema.blocks.size());
}

Result<void> StepReader::Impl::number(const StepIndex::Part& part) {
  values_.numbers.reserve(static_cast<std::size_t>(part.count));
  if (!numbers_need_mesh()) {
    const container::IndexEntry& group = file_->groups()[part.group];
    const std::uint64_t first = !is_on_mesh(info().location) ? part.first
                                : of_points()                ? group.first_vertex
                                                             : group.first_cell;
    for (std::uint64_t i = 0; i < part.count; ++i) values_.numbers.push_back(first + i);
    return {};
  }
  const auto elements = steps_->elements_of(*mesh_->elements, part);
  if (!elements) return elements.error();
  values_.numbers.assign(elements->numbers.begin(), elements->numbers.end());
  return {};
}

// --- topology

/// Returns the mesh of one segment. Reads only those streams of its groups that are needed.
Result<SegmentMesh*> StepReader::Impl::mesh_of(std::size_t segment, const ElementNeeds& needs) {
  const auto found = meshes_.find(segment);
  ElementNeeds all = needs;
  if (found != meshes_.end()) {
    if (found->second.topology.needs().include(needs)) return &found->second;
    all.add(found->second.topology.needs());
    kept_bytes_ -= found->second.kept_bytes();
    meshes_.erase(found);
  }
  constexpr std::size_t kMost = StepTopology::kMostKept;
  SegmentMesh& mesh = meshes_
                          .try_emplace(segment, file_->schema(), file_->limits().max_group_bytes,
                                       all, kMost - std::min(kept_bytes_, kMost), cell_bytes_)
                          .first->second;
  std::vector<std::size_t> groups(file_->first_group(segment + 1) - file_->first_group(segment));
  std::iota(groups.begin(), groups.end(), file_->first_group(segment));
  file_->prefetch_streams(
      groups, [&](const container::GroupHeader& header, const container::StreamEntry& stream) {
        return mesh.topology.uses(header, stream);
      });
  for (const std::size_t g : groups)
    if (auto status = add_group(*file_, g, mesh.topology); !status) {
      meshes_.erase(segment);
      return status.error();
    }
  mesh.elements.emplace(file_->schema(), mesh.topology, covers_);
  return &mesh;
}

// --- public interface

StepReader::StepReader(std::unique_ptr<Impl> impl) : impl_(std::move(impl)) {}
StepReader::StepReader(StepReader&&) noexcept = default;
StepReader& StepReader::operator=(StepReader&&) noexcept = default;
StepReader::~StepReader() = default;

Result<StepReader> StepReader::open(RandomSource& source, const ReadLimits& limits) {
  auto file = std::make_shared<IndexedFile>(source, limits);
  if (auto status = file->open(); !status) return status.error();
  return of(std::move(file));
}
Result<StepReader> StepReader::open_damaged(RandomSource& source, const ReadLimits& limits) {
  auto file = std::make_shared<IndexedFile>(source, limits);
  if (auto status = file->open_damaged(); !status) return status.error();
  return of(std::move(file));
}
Result<StepReader> StepReader::of(std::shared_ptr<IndexedFile> file) {
  auto impl = std::make_unique<Impl>(std::move(file));
  if (auto status = impl->open(); !status) return status.error();
  return StepReader(std::move(impl));
}
const Schema& StepReader::schema() const { return impl_->file().schema(); }
const std::vector<SegmentInfo>& StepReader::segments() const { return impl_->file().segments(); }
const std::vector<double>& StepReader::step_times() const { return impl_->step_times(); }
std::uint64_t StepReader::elements(std::uint32_t array) const {
  return impl_->is_stepped(array) ? impl_->index().elements(array) : 0;
}
std::vector<std::uint64_t> StepReader::steps(std::uint32_t array) const {
  std::vector<std::uint64_t> steps;
  if (impl_->is_stepped(array))
    for (const StepIndex::Step& entry : impl_->index().steps(array)) steps.push_back(entry.step);
  return steps;
}
Result<void> StepReader::expect(std::uint32_t array, std::uint64_t step) const {
  const auto found = impl_->find(array, step);
  return found ? Result<void>() : found.error();
}
Result<void> StepReader::begin(const StepRequest& request) { return impl_->begin(request); }
Result<StepValues*> StepReader::next() { return impl_->next(); }
Result<std::vector<StepValues>> StepReader::read(const StepRequest& request) {
  if (auto status = impl_->begin(request); !status) return status.error();
  std::vector<StepValues> all;
  while (true) {
    auto values = impl_->next();
    if (!values) return values.error();
    if (*values == nullptr) return all;
    all.push_back(std::move(**values));
  }
}

}  // namespace shm
