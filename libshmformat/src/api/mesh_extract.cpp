// MeshExtractor: walks the segments that may have what is asked for, and picks it.
#include "shm/mesh_extract.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <set>
#include <span>
#include <string>
#include <unordered_set>
#include <utility>

#include "access/held_vertices.h"
#include "access/indexed_file.h"
#include "access/piece_request.h"
#include "bytes/misuse.h"
#include "segment/segment_decoder.h"

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

void empty(MeshBlock& block, std::size_t arrays) {
  block = MeshBlock();
  block.corner_begin.push_back(0);
  block.arrays.resize(arrays);
}

}  // namespace

class __attribute__((visibility("hidden"))) MeshExtractor::Impl {
 public:
  Impl(RandomSource& source, const ReadLimits& limits) : source_(&source), file_(source, limits) {}

  Result<void> open();
  Result<void> open_damaged() { return file_.open_damaged(); }
  IndexedFile& file() { return file_; }
  Result<StepReader*> steps();

  Result<void> begin(const ExtractRequest& request);
  Result<MeshBlock*> next();
  const std::vector<std::uint64_t>& vertex_numbers() const { return vertex_numbers_; }
  const std::vector<std::uint64_t>& cell_numbers() const { return cell_numbers_; }
  Result<void> begin_values(std::uint32_t array, std::uint64_t step);
  Result<StepValues*> next_values();

 private:
  /// A vertex of the piece that an earlier segment owns.
  struct Import {
    std::size_t segment = 0;  // that imports it
    std::array<double, 3> point{};
  };
  using Imports = std::map<std::uint64_t, Import>;  // by number

  const Schema& schema() const { return file_.schema(); }

  // the mesh
  Result<MeshBlock*> next_part();
  WantedValues wanted_of(std::size_t segment) const;
  void fill_lost(MeshBlock& block) const;
  Result<bool> begin_visit();
  Result<void> begin_group(SegmentDecoder& decoder, std::size_t group, const WantedValues& wanted);
  template <class Visit>
  Result<void> walk(std::size_t segment, Visit&& visit);
  Result<bool> has_any(std::size_t segment);
  bool needs_no_more() const;
  Result<void> pick(MeshBlock& block);
  Result<void> take_vertices(const MeshBlock& block, std::size_t& next, std::size_t end);
  Result<void> take_unused(const MeshBlock& block, std::size_t next);
  Result<void> pick_cell(const MeshBlock& block, std::size_t cell);
  void pick_cell_values(const MeshBlock& block, std::size_t cell, bool wanted);
  void give(HeldVertices::Vertex& vertex);
  void end_segment();
  Result<void> finish();

  // steps
  Result<void> find_all_owners();
  Result<void> find_owners(Imports& left, bool by_box, std::vector<bool>& seen);
  Result<bool> next_segment_values();

  RandomSource* source_;
  IndexedFile file_;
  std::optional<StepReader> steps_;

  std::optional<PieceRequest> request_;
  WantedValues wanted_;
  std::vector<PieceRequest::Visit> visits_;
  std::size_t next_visit_ = 0;
  std::uint64_t found_ = 0;                  // of request_->expected()
  std::unique_ptr<SegmentDecoder> decoder_;  // of the segment at hand
  std::size_t segment_ = 0, next_group_ = 0, end_group_ = 0;
  std::size_t end_box_group_ = 0;  // behind the last group with vertices in the box
  std::optional<HeldVertices> held_;
  std::vector<std::uint32_t> cell_arrays_;  // that are wanted
  std::vector<std::size_t> taken_;          // of these: elements of the block at hand
  MeshBlock piece_;
  std::unordered_set<std::uint64_t> shared_;  // given, and other segments may have them too
  bool done_ = false;
  std::optional<Error> error_;

  // what was given
  std::vector<std::uint64_t> vertex_numbers_, cell_numbers_, block_cells_;
  Imports imports_;
  std::set<std::size_t> point_segments_, cell_segments_;
  bool owners_known_ = false;

  // the values at hand
  std::uint32_t array_ = 0;
  std::uint64_t step_ = 0, values_left_ = 0;
  std::vector<std::size_t> value_segments_;
  std::size_t next_value_segment_ = 0;
  bool in_values_ = false;
  StepValues values_;
};

Result<void> MeshExtractor::Impl::open() {
  if (auto good = file_.open(); !good) return good;
  return file_.expect_totals();
}

Result<StepReader*> MeshExtractor::Impl::steps() {
  if (!steps_) {
    auto reader = StepReader::open(*source_, file_.limits(), file_.survivors());
    if (!reader) return reader.error();
    steps_.emplace(std::move(*reader));
  }
  return &*steps_;
}

// --- the mesh

Result<void> MeshExtractor::Impl::begin(const ExtractRequest& request) {
  auto checked = PieceRequest::of(request, file_);
  if (!checked) return checked.error();
  request_.emplace(std::move(*checked));
  wanted_ = {};
  if (request.arrays) {
    wanted_.arrays.emplace(schema().arrays.size());
    for (const std::uint32_t array : *request.arrays) (*wanted_.arrays)[array] = true;
  }
  std::vector<std::uint32_t> point_arrays;
  cell_arrays_.clear();
  for (std::uint32_t a = 0; a < schema().arrays.size(); ++a) {
    const ArrayInfo& info = schema().arrays[a];
    if (!info.per_step && wanted_.includes_array(a))
      (info.location == Location::point ? point_arrays : cell_arrays_).push_back(a);
  }
  held_.emplace(schema(), std::move(point_arrays));
  visits_ = request_->visits();
  next_visit_ = 0;
  found_ = 0;
  decoder_.reset();
  shared_.clear();
  done_ = false;
  error_.reset();
  vertex_numbers_.clear();
  cell_numbers_.clear();
  block_cells_.assign(schema().blocks.size(), 0);
  imports_.clear();
  point_segments_.clear();
  cell_segments_.clear();
  owners_known_ = in_values_ = false;
  return {};
}

Result<MeshBlock*> MeshExtractor::Impl::next() {
  if (!request_) return misuse("begin() comes first", "piece");
  if (error_) return *error_;
  if (done_) return nullptr;
  auto part = next_part();
  if (!part) error_ = part.error();
  return part;
}

Result<MeshBlock*> MeshExtractor::Impl::next_part() {
  while (true) {
    if (decoder_ && decoder_->in_group()) {
      auto block = decoder_->next_block();
      if (!block) return block.error();
      fill_lost(block->mesh);
      if (auto good = pick(block->mesh); !good) return good.error();
      if (piece_.vertex_count() > 0 || piece_.cell_count() > 0) return &piece_;
    } else if (decoder_ && next_group_ < end_group_ && !needs_no_more()) {
      if (auto good = begin_group(*decoder_, next_group_++, wanted_of(segment_)); !good)
        return good.error();
    } else {
      if (decoder_) end_segment();
      const auto more = begin_visit();
      if (!more) return more.error();
      if (*more) continue;
      if (auto good = finish(); !good) return good.error();
      return nullptr;
    }
  }
}

/// The next segment that may have something; false where there is none.
Result<bool> MeshExtractor::Impl::begin_visit() {
  while (next_visit_ < visits_.size()) {
    const PieceRequest::Visit visit = visits_[next_visit_++];
    // Segments without cells are visited for vertices that no cell uses.
    if (found_ >= request_->expected() &&
        !(request_->wants_unused() && file_.segments()[visit.segment].cells == 0))
      continue;
    if (visit.probe) {
      const auto any = has_any(visit.segment);
      if (!any) return any.error();
      if (!*any) continue;
    }
    segment_ = visit.segment;
    next_group_ = file_.first_group(segment_);
    end_group_ = file_.first_group(segment_ + 1);
    while (!request_->wants_unused() && end_group_ > next_group_ &&
           !request_->may_be_in_group(file_.groups()[end_group_ - 1]))
      --end_group_;
    end_box_group_ = end_group_;
    while (end_box_group_ > next_group_ &&
           !request_->may_be_in_box(file_.groups()[end_box_group_ - 1].box))
      --end_box_group_;
    decoder_ = std::make_unique<SegmentDecoder>(
        schema(), file_.limits(), file_.segment_number(segment_),
        request_->all() ? SegmentDecoder::Imports::left_out : SegmentDecoder::Imports::yielded);
    decoder_->want(wanted_of(segment_));
    return true;
  }
  return false;
}

/// What is wanted, and not lost.
WantedValues MeshExtractor::Impl::wanted_of(std::size_t segment) const {
  const auto lost = file_.lost_arrays(segment);
  WantedValues wanted = wanted_;
  if (lost.empty()) return wanted;
  if (!wanted.arrays) wanted.arrays.emplace(schema().arrays.size(), true);
  for (const std::uint32_t array : lost)
    if (array < wanted.arrays->size()) (*wanted.arrays)[array] = false;
  return wanted;
}

/// Wanted values that are lost become NaN, and integers 0.
void MeshExtractor::Impl::fill_lost(MeshBlock& block) const {
  for (const std::uint32_t a : file_.lost_arrays(segment_)) {
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

Result<void> MeshExtractor::Impl::begin_group(SegmentDecoder& decoder, std::size_t group,
                                              const WantedValues& wanted) {
  const container::IndexEntry& entry = file_.groups()[group];
  auto payload = file_.read_group(group, wanted);
  if (!payload) return payload.error();
  if (auto good = decoder.begin_group(std::move(*payload), entry.offset, group); !good) return good;
  return file_.expect_group(group, decoder.group());
}

/// The cells and the numbers of a whole segment, without values, until visit(block) says false.
template <class Visit>
Result<void> MeshExtractor::Impl::walk(std::size_t segment, Visit&& visit) {
  SegmentDecoder decoder(schema(), file_.limits(), file_.segment_number(segment),
                         SegmentDecoder::Imports::yielded);
  const WantedValues none = WantedValues::none();
  decoder.want(none);
  for (std::size_t g = file_.first_group(segment); g < file_.first_group(segment + 1); ++g) {
    if (auto good = begin_group(decoder, g, none); !good) return good;
    while (decoder.in_group()) {
      const auto block = decoder.next_block();
      if (!block) return block.error();
      if (!visit(block->mesh)) return {};
    }
  }
  return {};
}

/// Whether a segment has anything of the request, but for the box.
Result<bool> MeshExtractor::Impl::has_any(std::size_t segment) {
  bool any = false;
  const auto good = walk(segment, [&](const MeshBlock& block) {
    if (request_->of_vertices()) {
      for (std::size_t v = 0; v < block.vertex_count() && !any; ++v)
        any = block.imported[v] == 0 && request_->includes_vertex(block.vertex_numbers[v]);
    } else {
      for (std::size_t c = 0; c < block.cell_count() && !any; ++c)
        any = request_->includes(block.cell_numbers[c], block.cell_blocks[c]);
    }
    return !any;
  });
  if (!good) return good.error();
  return any;
}

/// Whether the groups to come of the segment at hand can have nothing.
bool MeshExtractor::Impl::needs_no_more() const {
  if (request_->wants_unused()) return false;
  if (found_ >= request_->expected()) return true;
  if (!request_->box() || held_->in_box() > 0) return false;
  return next_group_ >= end_box_group_;
}

/// What is wanted of a block, into piece_.
Result<void> MeshExtractor::Impl::pick(MeshBlock& block) {
  if (request_->all()) {
    piece_ = std::move(block);
    piece_.first_vertex = vertex_numbers_.size();
    piece_.first_cell = cell_numbers_.size();
    std::fill(piece_.last_use.begin(), piece_.last_use.end(), 0);
    vertex_numbers_.insert(vertex_numbers_.end(), piece_.vertex_numbers.begin(),
                           piece_.vertex_numbers.end());
    cell_numbers_.insert(cell_numbers_.end(), piece_.cell_numbers.begin(),
                         piece_.cell_numbers.end());
    for (const std::uint32_t b : piece_.cell_blocks) ++block_cells_[b];
    return {};
  }
  empty(piece_, schema().arrays.size());
  piece_.first_vertex = vertex_numbers_.size();
  piece_.first_cell = cell_numbers_.size();
  taken_.assign(cell_arrays_.size(), 0);
  std::size_t vertex = 0;
  for (std::size_t cell = 0; cell < block.cell_count(); ++cell) {
    if (auto good = take_vertices(block, vertex,
                                  static_cast<std::size_t>(block.vertices_before_cell[cell]));
        !good)
      return good;
    if (auto good = pick_cell(block, cell); !good) return good;
  }
  // No cell uses those that are left.
  if (request_->of_vertices()) return take_vertices(block, vertex, block.vertex_count());
  return request_->wants_unused() ? take_unused(block, vertex) : Result<void>();
}

/// Vertices of a block until `end` are born: they wait for cells, or are wanted themselves.
Result<void> MeshExtractor::Impl::take_vertices(const MeshBlock& block, std::size_t& next,
                                                std::size_t end) {
  const std::size_t xyz_bytes = 3 * scalar_bytes(schema().coordinate_type);
  const auto of_index = request_->widened(file_.groups()[next_group_ - 1].box);
  for (; next < end; ++next) {
    bool in_box = false;
    if (request_->box()) {
      const auto point = point_of(block.xyz.data() + next * xyz_bytes, schema().coordinate_type);
      in_box = is_in(*request_->box(), point);
      for (std::size_t c = 0; c < 3; ++c)
        if (std::isfinite(point[c]) && (point[c] < of_index[c] || point[c] > of_index[3 + c]))
          return file_.wrong_index("has a box of group " + std::to_string(next_group_ - 1) +
                                   " that not all of its vertices are in");
    }
    const std::uint64_t number = block.vertex_numbers[next];
    if (request_->of_vertices()) {
      if (block.imported[next] != 0 || !request_->includes_vertex(number)) continue;
      ++found_;
      if (request_->box() && !in_box) continue;
    }
    if (!held_->add(block, next, in_box))
      return IndexedFile::wrong("has vertex " + std::to_string(number) + " twice",
                                "segment " + std::to_string(segment_), kNoOffset);
    if (!request_->of_vertices()) continue;
    give(*held_->find(number));
    held_->remove(number);
  }
  return {};
}

/// The vertices of a block from `next` on, which no cell uses, go into the piece.
Result<void> MeshExtractor::Impl::take_unused(const MeshBlock& block, std::size_t next) {
  const std::size_t first = next;
  if (auto good = take_vertices(block, next, block.vertex_count()); !good) return good;
  for (std::size_t v = first; v < next; ++v) {
    HeldVertices::Vertex& vertex = *held_->find(block.vertex_numbers[v]);
    if (!request_->box() || vertex.in_box) give(vertex);
    held_->remove(vertex.number);
  }
  return {};
}

Result<void> MeshExtractor::Impl::pick_cell(const MeshBlock& block, std::size_t cell) {
  if (request_->of_vertices()) return {};
  const std::uint64_t number = block.cell_numbers[cell];
  const std::uint32_t in_block = block.cell_blocks[cell];
  const auto begin = static_cast<std::size_t>(block.corner_begin[cell]);
  const auto end = static_cast<std::size_t>(block.corner_begin[cell + 1]);
  const auto corners = std::span(block.corners).subspan(begin, end - begin);
  bool wanted = request_->includes(number, in_block);
  found_ += wanted ? 1 : 0;
  if (wanted && request_->box())
    wanted = std::any_of(corners.begin(), corners.end(), [&](std::uint64_t corner) {
      const HeldVertices::Vertex* vertex = held_->find(corner);
      return vertex != nullptr && vertex->in_box;
    });
  pick_cell_values(block, cell, wanted);
  if (wanted) {
    for (const std::uint64_t corner : corners) {
      HeldVertices::Vertex* vertex = held_->find(corner);
      if (vertex == nullptr)
        return IndexedFile::wrong("uses vertex " + std::to_string(corner) + ", which is gone",
                                  "cell " + std::to_string(number), kNoOffset);
      give(*vertex);
      piece_.corners.push_back(corner);
    }
    piece_.corner_begin.push_back(piece_.corners.size());
    piece_.cell_numbers.push_back(number);
    piece_.cell_blocks.push_back(in_block);
    piece_.last_use.push_back(0);
    piece_.vertices_before_cell.push_back(piece_.vertex_count());
    cell_numbers_.push_back(number);
    ++block_cells_[in_block];
    cell_segments_.insert(segment_);
  }
  for (std::size_t i = 0; i < corners.size() && i < 64; ++i)
    if ((block.last_use[cell] >> i & 1) != 0) held_->remove(corners[i]);
  return {};
}

void MeshExtractor::Impl::pick_cell_values(const MeshBlock& block, std::size_t cell, bool wanted) {
  for (std::size_t i = 0; i < cell_arrays_.size(); ++i) {
    const std::uint32_t array = cell_arrays_[i];
    if (!schema().array_covers(array, block.cell_blocks[cell])) continue;
    const ArrayInfo& info = schema().arrays[array];
    const std::size_t stride = scalar_bytes(info.type) * info.components;
    const std::byte* from = block.arrays[array].data() + taken_[i]++ * stride;
    if (wanted) piece_.arrays[array].insert(piece_.arrays[array].end(), from, from + stride);
  }
}

/// Adds a vertex to the piece, unless it is there.
void MeshExtractor::Impl::give(HeldVertices::Vertex& vertex) {
  if (std::exchange(vertex.given, true)) return;
  if (vertex.imported && !shared_.insert(vertex.number).second) return;
  if (!vertex.imported && shared_.contains(vertex.number)) {
    imports_.erase(vertex.number);
    point_segments_.insert(segment_);
    return;
  }
  held_->give(vertex, piece_);
  vertex_numbers_.push_back(vertex.number);
  if (vertex.imported)
    imports_.emplace(vertex.number, Import{segment_, held_->point(vertex)});
  else
    point_segments_.insert(segment_);
}

void MeshExtractor::Impl::end_segment() {
  held_->for_each([&](const HeldVertices::Vertex& vertex) {
    if (vertex.given) shared_.insert(vertex.number);
  });
  held_->clear();
  decoder_.reset();
}

Result<void> MeshExtractor::Impl::finish() {
  const std::uint64_t expected = request_->expected();
  if (expected != PieceRequest::kUnknown && !request_->box() && found_ != expected)
    return request_->of_vertices()
               ? misuse(std::to_string(expected - found_) + " of the vertices are not there",
                        "piece")
               : file_.wrong_index("tells of cells that are not there");
  for (auto* numbers : {&vertex_numbers_, &cell_numbers_}) {
    std::sort(numbers->begin(), numbers->end());
    const auto twice = std::adjacent_find(numbers->begin(), numbers->end());
    if (twice != numbers->end())
      return IndexedFile::wrong(std::string(numbers == &cell_numbers_ ? "cell " : "vertex ") +
                                    std::to_string(*twice) + " is there twice",
                                "mesh", kNoOffset);
  }
  shared_.clear();
  done_ = true;
  return {};
}

// --- steps

/// Segments with the values of the piece's vertices: a vertex has them where it is owned.
Result<void> MeshExtractor::Impl::find_all_owners() {
  if (owners_known_) return {};
  const auto& segments = file_.segments();
  if (schema().order != Order::keep) {
    for (const auto& [number, import] : imports_) {
      const auto behind = std::upper_bound(
          segments.begin(), segments.end(), number,
          [](std::uint64_t n, const SegmentInfo& segment) { return n < segment.first_vertex; });
      if (behind == segments.begin()) continue;  // the owner is lost
      point_segments_.insert(static_cast<std::size_t>(behind - segments.begin()) - 1);
    }
    owners_known_ = true;
    return {};
  }
  Imports left = imports_;
  std::vector<bool> seen(segments.size());
  // Boxes are worth a look where that is not more than the segments themselves.
  constexpr std::size_t kMostLooks = std::size_t{1} << 28;
  for (const bool by_box : {true, false}) {
    if (by_box && left.size() > kMostLooks / (segments.size() + 1)) continue;
    if (auto good = find_owners(left, by_box, seen); !good) return good.error();
  }
  owners_known_ = left.empty() || file_.survivors();
  if (owners_known_) return {};
  return IndexedFile::wrong(
      "imports vertex " + std::to_string(left.begin()->first) + ", which no earlier segment has",
      "segment " + std::to_string(left.begin()->second.segment), kNoOffset);
}

/// Looks for vertices in the segments before those that import them, nearest first; where
/// `by_box`, only in those whose boxes they are in.
Result<void> MeshExtractor::Impl::find_owners(Imports& left, bool by_box, std::vector<bool>& seen) {
  std::size_t segment = 0;
  for (const auto& [number, import] : left) segment = std::max(segment, import.segment);
  while (segment-- > 0 && !left.empty()) {
    const auto box = request_->widened(file_.segments()[segment].box);
    if (seen[segment] || (by_box && std::none_of(left.begin(), left.end(), [&](const auto& it) {
                            return it.second.segment > segment && is_in(box, it.second.point);
                          })))
      continue;
    seen[segment] = true;
    const auto good = walk(segment, [&](const MeshBlock& block) {
      for (std::size_t v = 0; v < block.vertex_count(); ++v)
        if (block.imported[v] == 0 && left.erase(block.vertex_numbers[v]) > 0)
          point_segments_.insert(segment);
      return !left.empty();
    });
    if (!good) return good;
  }
  return {};
}

Result<void> MeshExtractor::Impl::begin_values(std::uint32_t array, std::uint64_t step) {
  in_values_ = false;
  if (!done_) return misuse("values of steps come behind the mesh", "piece");
  const auto reader = steps();
  if (!reader) return reader.error();
  // Says what is wrong with array and step.
  if (auto good = (*reader)->begin({array, step}); !good) return good;
  const ArrayInfo& info = schema().arrays[array];
  const bool of_points = info.location == Location::point;
  array_ = array;
  step_ = step;
  values_left_ = 0;
  if (of_points) values_left_ = vertex_numbers_.size();
  for (std::uint32_t b = 0; b < block_cells_.size() && !of_points; ++b)
    if (schema().array_covers(array, b)) values_left_ += block_cells_[b];
  value_segments_.clear();
  next_value_segment_ = 0;
  in_values_ = true;
  if (request_->all()) return {};
  if (of_points) {
    if (auto good = find_all_owners(); !good) return good;
    value_segments_.assign(point_segments_.begin(), point_segments_.end());
  } else {
    value_segments_.assign(cell_segments_.begin(), cell_segments_.end());
  }
  const auto more = next_segment_values();
  return more ? Result<void>() : more.error();
}

/// False behind the last segment.
Result<bool> MeshExtractor::Impl::next_segment_values() {
  in_values_ = values_left_ > 0 && next_value_segment_ < value_segments_.size();
  if (!in_values_) return false;
  const std::size_t segment = value_segments_[next_value_segment_++];
  if (auto good = steps_->begin({array_, step_, segment}); !good) return good.error();
  return true;
}

Result<StepValues*> MeshExtractor::Impl::next_values() {
  const ArrayInfo* info = in_values_ ? &schema().arrays[array_] : nullptr;
  while (in_values_) {
    auto values = steps_->next();
    if (!values) return values.error();
    if (*values == nullptr) {
      const auto more = request_->all() ? Result<bool>(in_values_ = false) : next_segment_values();
      if (!more) return more.error();
      continue;
    }
    if (request_->all()) {
      values_ = std::move(**values);
      values_.first = 0;
      values_left_ -= std::min<std::uint64_t>(values_left_, values_.numbers.size());
      return &values_;
    }
    const std::size_t stride = scalar_bytes(info->type) * info->components;
    const auto& members = info->location == Location::point ? vertex_numbers_ : cell_numbers_;
    values_ = {};
    for (std::size_t i = 0; i < (*values)->numbers.size(); ++i) {
      if (!has(members, (*values)->numbers[i])) continue;
      values_.numbers.push_back((*values)->numbers[i]);
      const auto from = (*values)->values.begin() + static_cast<std::ptrdiff_t>(i * stride);
      values_.values.insert(values_.values.end(), from, from + static_cast<std::ptrdiff_t>(stride));
    }
    if (values_.numbers.size() > values_left_)
      return IndexedFile::wrong("has values of an element twice", "step values", kNoOffset);
    values_left_ -= values_.numbers.size();
    if (!values_.numbers.empty()) return &values_;
  }
  if (info != nullptr && values_left_ > 0 && !file_.survivors())
    return IndexedFile::wrong("lacks values of elements of the piece", "step values", kNoOffset);
  return nullptr;
}

// --- the face

MeshExtractor::MeshExtractor(std::unique_ptr<Impl> impl) : impl_(std::move(impl)) {}
MeshExtractor::MeshExtractor(MeshExtractor&&) noexcept = default;
MeshExtractor& MeshExtractor::operator=(MeshExtractor&&) noexcept = default;
MeshExtractor::~MeshExtractor() = default;

Result<MeshExtractor> MeshExtractor::open(RandomSource& source, const ReadLimits& limits) {
  auto impl = std::make_unique<Impl>(source, limits);
  if (auto good = impl->open(); !good) return good.error();
  return MeshExtractor(std::move(impl));
}
Result<MeshExtractor> MeshExtractor::open_damaged(RandomSource& source, const ReadLimits& limits) {
  auto impl = std::make_unique<Impl>(source, limits);
  if (auto good = impl->open_damaged(); !good) return good.error();
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
  const auto& survivors = impl_->file().survivors();
  return survivors && (!survivors->has_index || survivors->told_steps.contains({array, step}));
}
std::uint64_t MeshExtractor::vertices() const { return impl_->file().index().vertices; }
std::uint64_t MeshExtractor::cells() const { return impl_->file().index().cells; }
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
Result<void> MeshExtractor::begin(const ExtractRequest& request) { return impl_->begin(request); }
Result<MeshBlock*> MeshExtractor::next() { return impl_->next(); }
const std::vector<std::uint64_t>& MeshExtractor::vertex_numbers() const {
  return impl_->vertex_numbers();
}
const std::vector<std::uint64_t>& MeshExtractor::cell_numbers() const {
  return impl_->cell_numbers();
}
Result<void> MeshExtractor::begin_values(std::uint32_t array, std::uint64_t step) {
  return impl_->begin_values(array, step);
}
Result<StepValues*> MeshExtractor::next_values() { return impl_->next_values(); }

}  // namespace shm
