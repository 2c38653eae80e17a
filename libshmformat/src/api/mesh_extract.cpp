// MeshExtractor: reads the segments that may contain requested elements, and copies these elements.
#include "shm/mesh_extract.h"

#include <algorithm>
#include <limits>
#include <set>
#include <span>
#include <string>
#include <utility>

#include "base/errors.h"
#include "pipeline/mesh_decoder.h"
#include "random/indexed_file.h"
#include "random/piece_picker.h"
#include "random/piece_request.h"

namespace shm {
namespace {

template <class Real>
std::vector<std::byte> nans(std::size_t count) {
  const std::vector<Real> values(count, std::numeric_limits<Real>::quiet_NaN());
  const auto bytes = std::as_bytes(std::span(values));
  return {bytes.begin(), bytes.end()};
}

std::vector<std::byte> lost_values(ScalarType type, std::size_t count) {
  if (type == ScalarType::float32) return nans<float>(count);
  if (type == ScalarType::float64) return nans<double>(count);
  return std::vector<std::byte>(scalar_bytes(type) * count);
}

bool has(const std::vector<std::uint64_t>& numbers, std::uint64_t number) {
  return std::binary_search(numbers.begin(), numbers.end(), number);
}

}  // namespace

class __attribute__((visibility("hidden"))) MeshExtractor::Impl {
 public:
  Impl(RandomSource& source, const ReadLimits& limits)
      : file_(std::make_shared<IndexedFile>(source, limits)) {}

  Result<void> open();
  Result<void> open_damaged() { return file_->open_damaged(); }
  IndexedFile& file() { return *file_; }
  Result<StepReader*> steps();

  Result<void> begin(const ExtractRequest& request, const ReadOptions& options);
  Result<MeshBlock*> next();
  /// Returns the vertex or cell numbers of the piece, or an empty list before begin().
  const std::vector<std::uint64_t>& numbers(
      const std::vector<std::uint64_t>& (PiecePicker::*of)()) {
    return picker_ ? ((*picker_).*of)() : no_numbers_;
  }
  Result<void> begin_values(std::uint32_t array, std::uint64_t step);
  Result<StepValues*> next_values();

 private:
  /// The groups of a segment that may contain requested elements.
  struct Groups {
    std::size_t next = 0, end = 0;
    std::size_t end_box = 0;  // end of the range of groups that may have vertices in the box
  };

  const Schema& schema() const { return file_->schema(); }

  // Functions that read the mesh.
  void want(const ExtractRequest& request);
  void prefetch_visits();
  Result<MeshBlock*> next_part();
  Result<std::optional<DecodingQueue::Output>> next_output();
  DecodedParts parts_of(std::size_t segment) const;
  void fill_lost(MeshBlock& block, std::size_t segment) const;
  Groups groups_of(std::size_t segment) const;
  Result<bool> add_next_group();
  Result<bool> begin_visit();
  template <class Visit>
  Result<void> walk(std::size_t segment, Visit&& visit);
  Result<bool> has_any(std::size_t segment);
  bool needs_no_more() const;
  /// Returns true if all requested elements have been found.
  bool has_all() const {
    return !request_->wants_unused() && picker_->found() >= request_->expected();
  }

  // Functions that read step values.
  Result<void> find_all_owners();
  Result<void> find_owners(PiecePicker::Imports& left, bool by_box, std::vector<bool>& seen);
  Result<bool> next_segment_values();

  std::shared_ptr<IndexedFile> file_;
  std::optional<StepReader> steps_;

  std::optional<PieceRequest> request_;
  DecodedParts wanted_;
  std::vector<PieceRequest::Visit> visits_;
  std::size_t next_visit_ = 0;
  // State of reading groups.
  std::optional<std::size_t> reading_;  // index of the segment that is being read
  Groups groups_;                       // groups of the segment that is being read
  bool all_read_ = false;
  // True if groups can be read ahead, which means before the blocks of earlier groups have been
  // taken. False if the contents of those blocks determine which groups are needed.
  bool runs_ahead_ = false;
  // Error that occurred while reading ahead. next() reports it after all earlier blocks have been
  // taken.
  std::optional<Error> error_ahead_;

  // State of taking blocks.
  std::optional<std::size_t> segment_;  // segment of the most recent block
  bool in_group_ = false;  // true if the group of the most recent block has further blocks
  std::optional<PiecePicker> picker_;
  const std::vector<std::uint64_t> no_numbers_;
  bool done_ = false;
  std::optional<Error> error_;
  // Queue of groups to decode; declared after file_, which the threads of the queue use.
  std::unique_ptr<DecodingQueue> queue_;

  // State of reading the current step values.
  std::set<std::size_t> owner_segments_;  // segments that own vertices of the piece
  bool owners_known_ = false;
  std::uint32_t array_ = 0;
  std::uint64_t step_ = 0, values_left_ = 0;
  std::vector<std::size_t> value_segments_;
  std::size_t next_value_segment_ = 0;
  bool in_values_ = false;
  bool all_values_ = false;  // true if the values of all elements of the array are returned
  StepValues values_;
};

Result<void> MeshExtractor::Impl::open() {
  if (auto status = file_->open(); !status) return status;
  return file_->expect_totals();
}

Result<StepReader*> MeshExtractor::Impl::steps() {
  if (!steps_) {
    auto reader = StepReader::of(file_);
    if (!reader) return reader.error();
    steps_.emplace(std::move(*reader));
  }
  return &*steps_;
}

// --- the mesh

Result<void> MeshExtractor::Impl::begin(const ExtractRequest& request, const ReadOptions& options) {
  auto checked = PieceRequest::of(request, *file_);
  if (!checked) return checked.error();
  queue_.reset();
  request_.emplace(std::move(*checked));
  want(request);
  wanted_.digest = options.check_digests;
  picker_.emplace(*file_, *request_, wanted_);
  visits_ = request_->visits();
  next_visit_ = 0;
  reading_.reset();
  segment_.reset();
  all_read_ = done_ = in_group_ = false;
  error_ahead_.reset();
  error_.reset();
  owners_known_ = in_values_ = false;
  runs_ahead_ = request_->all() || (!request_->wants_unused() && !request_->box() &&
                                    std::none_of(visits_.begin(), visits_.end(),
                                                 [](const auto& visit) { return visit.probe; }));
  queue_ = std::make_unique<DecodingQueue>(
      schema(), file_->limits(), options,
      [this](std::uint64_t group, const container::GroupHeader& header) {
        return file_->expect_group(static_cast<std::size_t>(group), header);
      });
  prefetch_visits();
  return {};
}

void MeshExtractor::Impl::want(const ExtractRequest& request) {
  wanted_ = {};
  wanted_.imported_vertices = !request_->all();
  wanted_.geometry = request.coordinates || request.cells.box;
  if (!request.arrays) return;
  std::vector<bool> arrays(schema().arrays.size());
  for (const std::uint32_t array : *request.arrays) arrays[array] = true;
  bool all = true;
  for (std::size_t a = 0; a < arrays.size(); ++a)
    all = all && (arrays[a] || schema().arrays[a].per_step);
  if (!all) wanted_.arrays = std::move(arrays);
}

/// Announces to the source the groups that will certainly be read for the requested segments.
void MeshExtractor::Impl::prefetch_visits() {
  std::vector<std::size_t> all;
  for (const PieceRequest::Visit& visit : visits_) {
    if (visit.probe) continue;
    const Groups groups = groups_of(visit.segment);
    for (std::size_t g = groups.next; g < groups.end; ++g) all.push_back(g);
  }
  if (wanted_.has_all_values())
    file_->prefetch_groups(all);
  else
    file_->prefetch_streams(all, [this](const auto&, const container::StreamEntry& stream) {
      return wanted_.includes(stream);
    });
}

Result<MeshBlock*> MeshExtractor::Impl::next() {
  if (error_) return *error_;
  if (done_) return nullptr;
  if (!queue_) return misuse("call begin() first", "piece");
  auto part = next_part();
  if (!part) error_ = part.error();
  return part;
}

Result<MeshBlock*> MeshExtractor::Impl::next_part() {
  while (true) {
    auto output = next_output();
    // If threads have read more than was requested, the surplus blocks and their errors are
    // ignored.
    const bool enough = !in_group_ && has_all();
    if (!output && !enough) return output.error();
    if (enough || !*output) {
      if (error_ahead_ && !enough) return *error_ahead_;
      if (segment_) picker_->end_segment();
      queue_.reset();
      if (auto status = picker_->end_mesh(); !status) return status.error();
      done_ = true;
      return nullptr;
    }
    const std::size_t segment = (*output)->segment;
    if (segment_ != segment) picker_->begin_segment(segment);
    segment_ = segment;
    if (!(*output)->block) {
      picker_->end_segment();
      segment_.reset();
      continue;
    }
    in_group_ = !(*output)->block->group_end;
    MeshBlock& block = (*output)->block->mesh;
    fill_lost(block, segment);
    if (auto status = picker_->pick(block, static_cast<std::size_t>((*output)->group)); !status)
      return status.error();
    MeshBlock& piece = picker_->piece();
    if (piece.vertex_count() > 0 || piece.cell_count() > 0) return &piece;
  }
}

/// Returns the next output of the queue, or nullopt at the end. Reads groups and passes them to the
/// queue as long as the queue accepts them. Does not read ahead if the contents of earlier blocks
/// determine which groups are needed (see runs_ahead_).
Result<std::optional<DecodingQueue::Output>> MeshExtractor::Impl::next_output() {
  using Wait = DecodingQueue::Wait;
  while (true) {
    while (!all_read_ && queue_->wants_group() && (runs_ahead_ || !queue_->is_busy())) {
      const auto more = add_next_group();
      if (!more) error_ahead_ = more.error();
      if (more && *more) continue;
      all_read_ = true;
      if (!error_ahead_) queue_->end();
    }
    const bool may_read = !all_read_ && runs_ahead_;
    auto output = queue_->next(may_read ? Wait::for_output_or_room : Wait::for_output);
    if (!output || *output || all_read_) return output;
  }
}

/// Reads the next group and passes it to the queue. Returns false if all groups have been
/// read.
Result<bool> MeshExtractor::Impl::add_next_group() {
  if (reading_ && (groups_.next == groups_.end || needs_no_more())) reading_.reset();
  if (!reading_) {
    const auto more = begin_visit();
    if (!more || !*more) return more;
  }
  auto chunk = file_->read_group(groups_.next++, parts_of(*reading_));
  if (!chunk) return chunk.error();
  if (auto status = queue_->add_group(std::move(*chunk)); !status) return status.error();
  return true;
}

/// Moves to the next segment that may contain requested elements. Returns false if no such segment
/// exists.
Result<bool> MeshExtractor::Impl::begin_visit() {
  while (next_visit_ < visits_.size()) {
    const PieceRequest::Visit visit = visits_[next_visit_++];
    // If unused vertices are requested, segments without cells are read even after all requested
    // cells have been found.
    if (picker_->found() >= request_->expected() &&
        !(request_->wants_unused() && file_->segments()[visit.segment].cells == 0))
      continue;
    if (visit.probe) {
      const auto any = has_any(visit.segment);
      if (!any) return any.error();
      if (!*any) continue;
    }
    groups_ = groups_of(visit.segment);
    const bool nothing_in_box =
        request_->box() && groups_.next == groups_.end_box && !request_->wants_unused();
    if (groups_.next == groups_.end || nothing_in_box) continue;
    reading_ = visit.segment;
    queue_->begin_segment(visit.segment, file_->segment_number(visit.segment),
                          parts_of(visit.segment));
    return true;
  }
  return false;
}

auto MeshExtractor::Impl::groups_of(std::size_t segment) const -> Groups {
  Groups groups{file_->first_group(segment), file_->first_group(segment + 1), 0};
  while (!request_->wants_unused() && groups.end > groups.next &&
         !request_->may_be_in_group(file_->groups()[groups.end - 1]))
    --groups.end;
  groups.end_box = groups.end;
  while (groups.end_box > groups.next &&
         !request_->may_be_in_box(file_->groups()[groups.end_box - 1].box))
    --groups.end_box;
  return groups;
}

/// Returns the parts to decode in the segment: the requested parts, except arrays that are lost in
/// this segment.
DecodedParts MeshExtractor::Impl::parts_of(std::size_t segment) const {
  const auto lost = file_->lost_arrays(segment);
  DecodedParts parts = wanted_;
  if (lost.empty()) return parts;
  if (!parts.arrays) parts.arrays.emplace(schema().arrays.size(), true);
  for (const std::uint32_t array : lost)
    if (array < parts.arrays->size()) (*parts.arrays)[array] = false;
  return parts;
}

/// Sets requested values that are lost to NaN (floating-point values) or 0 (integers).
void MeshExtractor::Impl::fill_lost(MeshBlock& block, std::size_t segment) const {
  for (const std::uint32_t a : file_->lost_arrays(segment)) {
    if (a >= schema().arrays.size() || schema().arrays[a].per_step || !wanted_.includes_array(a))
      continue;
    const ArrayInfo& info = schema().arrays[a];
    std::size_t elements = block.vertex_count();
    if (info.location == Location::cell)
      elements = static_cast<std::size_t>(
          std::count_if(block.cell_blocks.begin(), block.cell_blocks.end(),
                        [&](std::uint32_t b) { return schema().array_covers(a, b); }));
    block.arrays[a] = lost_values(info.type, elements * info.components);
  }
}

/// Decodes the cells and numbers of a whole segment, without values. Calls visit(block) for each
/// block until `visit` returns false.
template <class Visit>
Result<void> MeshExtractor::Impl::walk(std::size_t segment, Visit&& visit) {
  DecodedParts parts = DecodedParts::without_values();
  parts.imported_vertices = true;
  SegmentDecoder decoder(schema(), file_->limits(), file_->segment_number(segment), parts);
  for (std::size_t g = file_->first_group(segment); g < file_->first_group(segment + 1); ++g) {
    auto chunk = file_->read_group(g, parts);
    if (!chunk) return chunk.error();
    if (auto status = decoder.begin_group(std::move(*chunk)); !status) return status;
    if (auto status = file_->expect_group(g, decoder.group()); !status) return status;
    while (decoder.in_group()) {
      const auto block = decoder.next_block();
      if (!block) return block.error();
      if (!visit(block->mesh)) return {};
    }
  }
  return {};
}

/// Returns true if the segment contains any requested element. The box of the request is ignored.
Result<bool> MeshExtractor::Impl::has_any(std::size_t segment) {
  bool any = false;
  const auto status = walk(segment, [&](const MeshBlock& block) {
    if (request_->of_vertices()) {
      for (std::size_t v = 0; v < block.vertex_count() && !any; ++v)
        any = block.imported[v] == 0 && request_->includes_vertex(block.vertex_numbers[v]);
    } else {
      for (std::size_t c = 0; c < block.cell_count() && !any; ++c)
        any = request_->includes(block.cell_numbers[c], block.cell_blocks[c]);
    }
    return !any;
  });
  if (!status) return status.error();
  return any;
}

/// Returns true if the remaining groups of the segment that is being read cannot contain requested
/// elements.
bool MeshExtractor::Impl::needs_no_more() const {
  if (request_->wants_unused()) return false;
  if (has_all()) return true;
  if (!request_->box() || groups_.next < groups_.end_box) return false;
  return segment_ == reading_ && picker_->waiting_in_box() == 0;
}

// --- steps

/// Finds the segments that own vertices of the piece. The step values of a vertex are stored in the
/// segment that owns it.
Result<void> MeshExtractor::Impl::find_all_owners() {
  if (owners_known_) return {};
  owner_segments_ = picker_->point_segments();
  const auto& segments = file_->segments();
  if (schema().order != Order::keep) {
    for (const auto& [number, import] : picker_->imports()) {
      const auto after = std::upper_bound(
          segments.begin(), segments.end(), number,
          [](std::uint64_t n, const SegmentInfo& segment) { return n < segment.first_vertex; });
      if (after == segments.begin()) continue;  // the owning segment is lost
      owner_segments_.insert(static_cast<std::size_t>(after - segments.begin()) - 1);
    }
    owners_known_ = true;
    return {};
  }
  PiecePicker::Imports left = picker_->imports();
  std::vector<bool> seen(segments.size());
  // Search by bounding box first, unless comparing the boxes of all segments would be slower than
  // reading the segments.
  constexpr std::size_t kMostLooks = std::size_t{1} << 28;
  for (const bool by_box : {true, false}) {
    if (by_box && left.size() > kMostLooks / (segments.size() + 1)) continue;
    if (auto status = find_owners(left, by_box, seen); !status) return status.error();
  }
  owners_known_ = left.empty() || file_->decodable() != nullptr;
  if (owners_known_) return {};
  return corrupt(
      "imports vertex " + std::to_string(left.begin()->first) + ", which no earlier segment has",
      "segment " + std::to_string(left.begin()->second.segment));
}

/// Finds the segments that own the imported vertices. Searches earlier segments, beginning with the
/// nearest. If `by_box` is true, reads only segments whose box contains one of the vertices.
Result<void> MeshExtractor::Impl::find_owners(PiecePicker::Imports& left, bool by_box,
                                              std::vector<bool>& seen) {
  std::size_t segment = 0;
  for (const auto& [number, import] : left) segment = std::max(segment, import.segment);
  while (segment-- > 0 && !left.empty()) {
    const auto box = request_->widened(file_->segments()[segment].box);
    if (seen[segment] || (by_box && std::none_of(left.begin(), left.end(), [&](const auto& entry) {
                            return entry.second.segment > segment && is_in(box, entry.second.point);
                          })))
      continue;
    seen[segment] = true;
    const auto status = walk(segment, [&](const MeshBlock& block) {
      for (std::size_t v = 0; v < block.vertex_count(); ++v)
        if (block.imported[v] == 0 && left.erase(block.vertex_numbers[v]) > 0)
          owner_segments_.insert(segment);
      return !left.empty();
    });
    if (!status) return status;
  }
  return {};
}

Result<void> MeshExtractor::Impl::begin_values(std::uint32_t array, std::uint64_t step) {
  in_values_ = false;
  if (!done_) return misuse("step values can be read only after the mesh", "piece");
  const auto reader = steps();
  if (!reader) return reader.error();
  // fails if the array or the step does not exist
  all_values_ = request_->all() ||
                (array < schema().arrays.size() && !is_on_mesh(schema().arrays[array].location));
  const auto known = all_values_ ? (*reader)->begin({array, step}) : (*reader)->expect(array, step);
  if (!known) return known;
  const bool of_points = schema().arrays[array].location == Location::point;
  array_ = array;
  step_ = step;
  values_left_ = elements_of(schema(), array, picker_->vertex_count(), picker_->block_cells());
  value_segments_.clear();
  next_value_segment_ = 0;
  in_values_ = true;
  if (all_values_) return {};
  if (of_points) {
    if (auto status = find_all_owners(); !status) return status;
    value_segments_.assign(owner_segments_.begin(), owner_segments_.end());
  } else {
    value_segments_.assign(picker_->cell_segments().begin(), picker_->cell_segments().end());
  }
  const auto more = next_segment_values();
  return more ? Result<void>() : more.error();
}

/// Moves to the next segment that contains step values for the piece. Returns false if no such
/// segment exists.
Result<bool> MeshExtractor::Impl::next_segment_values() {
  in_values_ = values_left_ > 0 && next_value_segment_ < value_segments_.size();
  if (!in_values_) return false;
  const std::size_t segment = value_segments_[next_value_segment_++];
  if (auto status = steps_->begin({array_, step_, segment}); !status) return status.error();
  return true;
}

Result<StepValues*> MeshExtractor::Impl::next_values() {
  const ArrayInfo* info = in_values_ ? &schema().arrays[array_] : nullptr;
  while (in_values_) {
    auto values = steps_->next();
    if (!values) return values.error();
    if (*values == nullptr) {
      const auto more = all_values_ ? Result<bool>(in_values_ = false) : next_segment_values();
      if (!more) return more.error();
      continue;
    }
    if (all_values_) {
      values_ = std::move(**values);
      values_.first = 0;
      values_left_ -= std::min<std::uint64_t>(values_left_, values_.numbers.size());
      return &values_;
    }
    const std::size_t stride = scalar_bytes(info->type) * info->components;
    if ((*values)->values.size() != (*values)->numbers.size() * stride)
      return misuse("the step reader has begun another request in the meantime", "piece");
    const auto& members =
        info->location == Location::point ? picker_->vertex_numbers() : picker_->cell_numbers();
    values_ = {};
    for (std::size_t i = 0; i < (*values)->numbers.size(); ++i) {
      if (!has(members, (*values)->numbers[i])) continue;
      values_.numbers.push_back((*values)->numbers[i]);
      const auto from = (*values)->values.begin() + static_cast<std::ptrdiff_t>(i * stride);
      values_.values.insert(values_.values.end(), from, from + static_cast<std::ptrdiff_t>(stride));
    }
    if (values_.numbers.size() > values_left_)
      return corrupt("has values of an element twice", "step values");
    values_left_ -= values_.numbers.size();
    if (!values_.numbers.empty()) return &values_;
  }
  if (info != nullptr && values_left_ > 0 && !file_->decodable())
    return corrupt("lacks values of elements of the piece", "step values");
  return nullptr;
}

// --- public interface

MeshExtractor::MeshExtractor(std::unique_ptr<Impl> impl) : impl_(std::move(impl)) {}
MeshExtractor::MeshExtractor(MeshExtractor&&) noexcept = default;
MeshExtractor& MeshExtractor::operator=(MeshExtractor&&) noexcept = default;
MeshExtractor::~MeshExtractor() = default;

Result<MeshExtractor> MeshExtractor::open(RandomSource& source, const ReadLimits& limits) {
  auto impl = std::make_unique<Impl>(source, limits);
  if (auto status = impl->open(); !status) return status.error();
  return MeshExtractor(std::move(impl));
}
Result<MeshExtractor> MeshExtractor::open_damaged(RandomSource& source, const ReadLimits& limits) {
  auto impl = std::make_unique<Impl>(source, limits);
  if (auto status = impl->open_damaged(); !status) return status.error();
  return MeshExtractor(std::move(impl));
}
const Schema& MeshExtractor::schema() const { return impl_->file().schema(); }
const std::vector<SegmentInfo>& MeshExtractor::segments() const { return impl_->file().segments(); }
std::span<const std::uint32_t> MeshExtractor::lost_arrays(std::size_t segment) const {
  return impl_->file().lost_arrays(segment);
}
std::uint32_t MeshExtractor::segment_number(std::size_t segment) const {
  return impl_->file().segment_number(segment);
}
bool MeshExtractor::had_values(std::uint32_t array, std::uint64_t step) const {
  const DecodableParts* decodable = impl_->file().decodable();
  return decodable != nullptr &&
         (!decodable->has_index || decodable->listed_steps.contains({array, step}));
}
std::uint64_t MeshExtractor::vertices() const { return impl_->file().index().vertices; }
std::uint64_t MeshExtractor::cells() const { return impl_->file().index().cells; }
std::optional<std::uint64_t> MeshExtractor::digest() const {
  const container::Index& index = impl_->file().index();
  return container::has_digest(index.version) ? std::optional(index.digest) : std::nullopt;
}
std::uint64_t MeshExtractor::hexahedra() const { return impl_->file().index().hexahedra; }
std::uint64_t MeshExtractor::step_count() const { return impl_->file().index().steps; }
const std::vector<std::uint64_t>& MeshExtractor::block_cells() const {
  return impl_->file().index().block_cells;
}
Result<std::vector<Extra>> MeshExtractor::extras() { return impl_->file().read_extras(); }
Result<std::vector<double>> MeshExtractor::step_times() {
  const auto reader = impl_->steps();
  if (!reader) return reader.error();
  return (*reader)->step_times();
}
Result<std::vector<std::uint64_t>> MeshExtractor::steps(std::uint32_t array) {
  const auto reader = impl_->steps();
  if (!reader) return reader.error();
  return (*reader)->steps(array);
}
Result<StepReader*> MeshExtractor::step_reader() { return impl_->steps(); }
Result<void> MeshExtractor::begin(const ExtractRequest& request, const ReadOptions& options) {
  return impl_->begin(request, options);
}
Result<MeshBlock*> MeshExtractor::next() { return impl_->next(); }
const std::vector<std::uint64_t>& MeshExtractor::vertex_numbers() const {
  return impl_->numbers(&PiecePicker::vertex_numbers);
}
const std::vector<std::uint64_t>& MeshExtractor::cell_numbers() const {
  return impl_->numbers(&PiecePicker::cell_numbers);
}
Result<void> MeshExtractor::begin_values(std::uint32_t array, std::uint64_t step) {
  return impl_->begin_values(array, step);
}
Result<StepValues*> MeshExtractor::next_values() { return impl_->next_values(); }

}  // namespace shm
