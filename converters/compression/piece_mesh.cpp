#include "compression/piece_mesh.h"

#include <algorithm>
#include <cstring>
#include <limits>
#include <numeric>
#include <set>
#include <span>
#include <utility>

#include "base/failure.h"
#include "formats/formats.h"
#include "mesh/array_names.h"
#include "sets/cell_sides.h"

namespace shm::converters {
namespace {

constexpr std::uint32_t kGone = ~std::uint32_t{0};
template <class Real>
std::vector<std::byte> nans(std::size_t count) {
  const std::vector<Real> values(count, std::numeric_limits<Real>::quiet_NaN());
  const auto bytes = std::as_bytes(std::span(values));
  return {bytes.begin(), bytes.end()};
}

// Returns the values that replace a lost element of the array: NaN for floating-point types,
// otherwise 0.
std::vector<std::byte> lost_value_of(const ArrayInfo& array) {
  if (array.type == ScalarType::float32) return nans<float>(array.components);
  if (array.type == ScalarType::float64) return nans<double>(array.components);
  return std::vector<std::byte>(scalar_bytes(array.type) * array.components);
}

}  // namespace

std::optional<std::uint64_t> rank_of(const std::vector<std::uint64_t>& sorted,
                                     std::uint64_t number) {
  if (sorted.empty() || number < sorted.front() || number > sorted.back()) return std::nullopt;
  // Fast path for consecutive numbers.
  if (sorted.back() - sorted.front() == sorted.size() - 1) return number - sorted.front();
  const auto found = std::lower_bound(sorted.begin(), sorted.end(), number);
  if (*found != number) return std::nullopt;
  return static_cast<std::uint64_t>(found - sorted.begin());
}

MeshInfo info_of(MeshExtractor& file, const std::string& name) {
  MeshInfo info;
  info.schema = file.schema();
  info.vertices = file.vertices();
  info.block_cells = file.block_cells();
  info.step_times = unwrap(file.step_times(), name);
  info.extras = unwrap(file.extras(), name);
  translate_old_extras(info);
  return info;
}

bool is_number_map(const ArrayInfo& array) {
  if (array.role.empty()) return array.name == kVertexNumbers || array.name == kCellNumbers;
  return role_of(array).is_number_map;
}

PieceMesh::PieceMesh(MeshExtractor& file, const PieceOptions& options, std::vector<Extra> extras,
                     const std::vector<MeshSet>& sets, const std::string& name, Spool& spool)
    : file_(&file),
      name_(name),
      spool_(&spool),
      decomposed_(options.decomposed),
      damaged_(options.damaged),
      step_(options.step),
      points_array_(options.points),
      wanted_(options.arrays),
      points_(spool, 3 * scalar_bytes(file.schema().coordinate_type)),
      cells_(spool),
      arrived_vertices_(spool),
      arrived_cells_(spool),
      block_cells_(file.schema().blocks.size()) {
  ExtractRequest request = options.request;
  request.arrays.emplace();
  for (std::uint32_t a = 0; a < file.schema().arrays.size(); ++a) {
    const ArrayInfo& array = file.schema().arrays[a];
    if (!takes_array(a) || (request.vertices && array.location == Location::cell)) continue;
    request.arrays->push_back(a);
    if (!array.per_step)
      staged_.emplace(a, PagedArray(spool, scalar_bytes(array.type) * array.components));
  }
  stage(request);
  info_.schema.coordinate_type = file.schema().coordinate_type;
  info_.schema.source_format = file.schema().source_format;
  info_.vertices = vertex_numbers().size();
  info_.step_times = options.step_times ? *options.step_times : unwrap(file.step_times(), name);
  if (step_) info_.step_times = {info_.step_times.at(*step_)};
  info_.extras = std::move(extras);
  choose_blocks();
  settle();
  cut_sets(sets, options.flat);
  choose_arrays(options);
  require_within(spool.limits(), info_, name);
}

bool PieceMesh::takes_array(std::uint32_t source) const {
  return !wanted_ || points_array_ == source ||
         std::binary_search(wanted_->begin(), wanted_->end(), source) ||
         is_number_map(file_->schema().arrays[source]);
}

// --- staging

void PieceMesh::stage(const ExtractRequest& request) {
  unwrap(file_->begin(request), name_);
  std::uint64_t bytes = 0;
  while (const MeshBlock* part = unwrap(file_->next(), name_)) {
    add_part(*part);
    bytes += part->xyz.size() + part->corners.size() * sizeof part->corners[0];
    for (const auto& [array, values] : staged_) bytes += part->arrays[array].size();
    require_within(spool_->limits(), arrived_vertices_.size(), arrived_cells_.size(), bytes, name_);
  }
}

void PieceMesh::add_part(const MeshBlock& part) {
  for (const std::uint64_t number : part.vertex_numbers) {
    vertices_moved_ |= number < last_vertex_;
    arrived_vertices_.push_back(last_vertex_ = number);
  }
  points_.append(part.vertex_count(), part.xyz.data());
  for (std::size_t c = 0; c < part.cell_count(); ++c) {
    cells_moved_ |= part.cell_numbers[c] < last_cell_;
    arrived_cells_.push_back(last_cell_ = part.cell_numbers[c]);
    const std::uint64_t begin = part.corner_begin[c];
    cells_.append(part.cell_blocks[c],
                  std::span(part.corners).subspan(begin, part.corner_begin[c + 1] - begin));
    ++block_cells_[part.cell_blocks[c]];
  }
  for (auto& [array, values] : staged_) {
    const ArrayInfo& info = file_->schema().arrays[array];
    values.append(part.arrays[array].size() / (scalar_bytes(info.type) * info.components),
                  part.arrays[array].data());
  }
}

// Brings the data of vertices and cells into ascending order of their numbers, unless it arrived in
// this order.
void PieceMesh::settle() {
  const Schema& schema = file_->schema();
  if (cells_moved_) {
    cell_positions_.emplace(*spool_, cell_numbers().size());
    arrived_cells_.for_each([&](std::uint64_t arrival, std::uint64_t number) {
      cell_positions_->set(*rank_of(cell_numbers(), number), arrival);
    });
  }
  if (vertices_moved_)
    points_ = settled(points_, 3 * scalar_bytes(schema.coordinate_type), arrived_vertices_,
                      vertex_numbers());
  for (auto& staged : staged_) {
    const std::uint32_t a = staged.first;
    PagedArray& values = staged.second;
    const ArrayInfo& array = schema.arrays[a];
    const std::size_t stride = scalar_bytes(array.type) * array.components;
    if (array.location == Location::point) {
      if (vertices_moved_) values = settled(values, stride, arrived_vertices_, vertex_numbers());
    } else if (cells_moved_ && array.blocks.empty()) {
      values = settled(values, stride, arrived_cells_, cell_numbers());
    } else if (cells_moved_) {
      NumberList numbers(*spool_);
      CellBatch one;
      arrived_cells_.for_each([&](std::uint64_t arrival, std::uint64_t number) {
        one.clear();
        cells_.read(arrival, one);
        if (schema.array_covers(a, one.blocks[0])) numbers.push_back(number);
      });
      values = settled(values, stride, numbers, elements(a));
    }
  }
}

PagedArray PieceMesh::settled(PagedArray& arrived, std::size_t stride, NumberList& numbers,
                              const std::vector<std::uint64_t>& sorted) {
  PagedArray out(*spool_, stride);
  std::vector<std::byte> value(stride);
  numbers.for_each([&](std::uint64_t arrival, std::uint64_t number) {
    arrived.read(arrival, 1, value.data());
    out.write(*rank_of(sorted, number), 1, value.data());
  });
  return out;
}

// Returns the vertices or cells that the array covers, identified by their numbers in the file, in
// ascending order.
const std::vector<std::uint64_t>& PieceMesh::elements(std::uint32_t source) {
  const ArrayInfo& array = file_->schema().arrays[source];
  if (array.location == Location::point) return vertex_numbers();
  if (!is_on_mesh(array.location)) return beside_mesh_.at(source);
  if (array.blocks.empty()) return cell_numbers();
  const auto [found, fresh] = covered_.try_emplace(array.blocks);
  if (!fresh) return found->second;
  CellBatch one;
  for (std::uint64_t c = 0; c < cell_numbers().size(); ++c) {
    one.clear();
    cells_.read(cell_positions_ ? cell_positions_->get(c) : c, one);
    if (file_->schema().array_covers(source, one.blocks[0]))
      found->second.push_back(cell_numbers()[c]);
  }
  return found->second;
}

// --- blocks, arrays and sets of the piece

void PieceMesh::choose_blocks() {
  new_blocks_.assign(block_cells_.size(), kGone);
  for (std::uint32_t b = 0; b < block_cells_.size(); ++b) {
    if (block_cells_[b] == 0 && !decomposed_) continue;
    new_blocks_[b] = static_cast<std::uint32_t>(kept_blocks_.size());
    kept_blocks_.push_back(b);
    info_.schema.blocks.push_back(file_->schema().blocks[b]);
    info_.block_cells.push_back(block_cells_[b]);
  }
}

void PieceMesh::choose_arrays(const PieceOptions& options) {
  const auto& all = file_->schema().arrays;
  if (points_array_) points_ = std::move(staged_.at(*points_array_));
  for (std::uint32_t a = 0; a < all.size(); ++a) {
    ArrayInfo array = all[a];
    if (!takes_array(a) || (points_array_ && array.role == all[*points_array_].role)) continue;
    array.quantization = {};
    if (const NumberMaps* maps = options.maps;
        decomposed_ && (array.role == maps->vertices_role || array.role == maps->cells_role))
      array.role = is_signed_integer(array.type) ? maps->original_role : std::string_view();
    if (array.location == Location::cell) {
      std::vector<std::uint32_t> blocks;
      for (const std::uint32_t b : kept_blocks_)
        if (file_->schema().array_covers(a, b)) blocks.push_back(new_blocks_[b]);
      if (blocks.empty()) continue;
      if (blocks.size() == kept_blocks_.size()) blocks.clear();
      array.blocks = std::move(blocks);
    } else if (!is_on_mesh(array.location) && !cut_array_on_sets(a, array)) {
      continue;
    }
    Array& added = arrays_.emplace_back();
    added.source = a;
    if (!array.per_step) added.values = std::move(staged_.at(a));
    info_.schema.arrays.push_back(std::move(array));
  }
  staged_.clear();
  if (!options.numbers) return;
  add_number_array(Location::point, options.maps);
  if (info_.cells() > 0 || decomposed_) add_number_array(Location::cell, options.maps);
}

void PieceMesh::add_number_array(Location location, const NumberMaps* maps) {
  const bool of_points = location == Location::point;
  ArrayInfo array;
  array.name = of_points ? kVertexNumbers : kCellNumbers;
  if (maps != nullptr) {
    array.name = of_points ? maps->vertices : maps->cells;
    array.role = of_points ? maps->vertices_role : maps->cells_role;
  }
  array.location = location;
  array.type = ScalarType::int64;
  // If the source already has this array, because the source is itself a piece of another mesh, no
  // second array is added.
  for (const ArrayInfo& other : info_.schema.arrays)
    if (other.location == location && other.name == array.name && other.role == array.role) return;
  const auto& numbers = of_points ? vertex_numbers() : cell_numbers();
  const std::uint64_t end = decomposed_       ? (of_points ? file_->vertices() : file_->cells())
                            : numbers.empty() ? 0
                                              : numbers.back() + 1;
  if (maps != nullptr && end <= std::numeric_limits<std::int32_t>::max())
    array.type = ScalarType::int32;
  info_.schema.arrays.push_back(std::move(array));
  arrays_.emplace_back().what = of_points ? Array::What::vertex_numbers : Array::What::cell_numbers;
}

// Reduces a global array or an array on sets to the elements that belong to the piece. Returns
// false if none are left.
bool PieceMesh::cut_array_on_sets(std::uint32_t source, ArrayInfo& array) {
  std::vector<std::uint64_t>& elements = beside_mesh_[source];
  if (array.location == Location::global) {
    elements.resize(array.elements);
    std::iota(elements.begin(), elements.end(), std::uint64_t{0});
    return true;
  }
  const std::vector<std::uint32_t> covered = std::move(array.blocks);
  array.blocks.clear();
  std::uint64_t members = 0;
  std::uint32_t number = 0;
  for (const CutSet& set : cut_sets_) {
    if (location_of(set.kind) != array.location) continue;
    const std::uint32_t here = number++;
    if (!covered.empty() && !std::binary_search(covered.begin(), covered.end(), here)) continue;
    for (const std::uint64_t index : set.kept) elements.push_back(members + index);
    members += set.members;
    if (set.number) array.blocks.push_back(*set.number);
  }
  if (members != array.elements) {
    without_sets_.push_back(array_label(array));
    return false;
  }
  array.elements = elements.size();
  if (covered.empty()) array.blocks.clear();
  return decomposed_ || array.elements > 0;
}

// Returns the number of distribution factors per member if it is the same for all members.
// Otherwise returns nothing.
std::optional<std::size_t> PieceMesh::factors_of_each(const MeshSet& set, bool flat) const {
  if (!has_usual_factors(set)) return std::nullopt;
  if (set.kind != MeshSet::Kind::sides) return 1;
  constexpr std::size_t kMostSides = 64;  // more than any cell has
  SideFinder finder;
  std::optional<std::size_t> each;
  const auto& blocks = file_->schema().blocks;
  const std::set<std::int32_t> sides(set.sides.begin(), set.sides.end());
  if (sides.size() > kMostSides) return std::nullopt;
  for (const std::int32_t side : sides)
    for (std::size_t b = 0; b < blocks.size(); ++b) {
      if (file_->block_cells()[b] == 0) continue;
      const std::size_t nodes =
          finder.nodes_of_side(blocks[b], static_cast<std::uint64_t>(side), flat);
      if (nodes > 0 && nodes != each.value_or(nodes)) return std::nullopt;
      if (nodes > 0) each = nodes;
    }
  if (!each || *each * set.members.size() != set.factors.size()) return std::nullopt;
  return each;
}

void PieceMesh::cut_sets(const std::vector<MeshSet>& sets, bool flat) {
  std::vector<MeshSet> left;
  std::map<MeshSet::Kind, std::uint32_t> numbers_of_kind;
  for (const MeshSet& set : sets) {
    cut_sets_.push_back({set.kind, set.members.size(), {}, {}});
    MeshSet cut;
    cut.kind = set.kind;
    cut.id = set.id;
    cut.name = set.name;
    std::optional<std::size_t> each;
    // In the parts of a decomposed mesh, sets have no distribution factors. All parts must have the
    // same structure, but a part in which all factors of a set are 1 would not store these factors.
    if (!set.factors.empty()) {
      if (!decomposed_) each = factors_of_each(set, flat);
      if (!each) without_factors_.push_back(label_of(set));
    }
    const auto& numbers = set.kind == MeshSet::Kind::nodes ? vertex_numbers() : cell_numbers();
    for (std::size_t i = 0; i < set.members.size(); ++i) {
      const auto rank = rank_of(numbers, set.members[i]);
      if (!rank) continue;
      cut.members.push_back(*rank);
      cut_sets_.back().kept.push_back(i);
      if (!set.sides.empty()) cut.sides.push_back(set.sides[i]);
      if (!each) continue;
      const auto first = set.factors.begin() + static_cast<std::ptrdiff_t>(i * *each);
      cut.factors.insert(cut.factors.end(), first, first + static_cast<std::ptrdiff_t>(*each));
    }
    for (const std::uint32_t block : set.blocks)
      if (new_blocks_.at(block) != kGone) cut.blocks.push_back(new_blocks_[block]);
    if (cut.members.empty() && cut.blocks.empty() && !decomposed_) continue;
    cut_sets_.back().number = numbers_of_kind[set.kind]++;
    left.push_back(std::move(cut));
  }
  list_members(*this, left);
  rewind_cells();
  for (Extra& extra : set_extras(left)) info_.extras.push_back(std::move(extra));
}

// --- reading

void PieceMesh::read_points(std::uint64_t first, std::uint64_t count, std::byte* out) {
  points_.read(first, count, out);
}

std::uint64_t PieceMesh::vertex_of(std::uint64_t number) const {
  if (const auto rank = rank_of(vertex_numbers(), number)) return *rank;
  throw Failure(Error{.code = ErrorCode::corrupt,
                      .detail = "uses vertex " + std::to_string(number) + ", which no segment has",
                      .section = "mesh",
                      .file = name_});
}

bool PieceMesh::next_cells(CellBatch& out, std::size_t max_cells) {
  out.clear();
  const std::uint64_t count =
      std::min<std::uint64_t>(max_cells, cell_numbers().size() - next_cell_);
  if (cell_positions_)
    for (std::uint64_t i = 0; i < count; ++i)
      cells_.read(cell_positions_->get(next_cell_ + i), out);
  else
    cells_.read_run(next_cell_, count, out);
  for (std::uint32_t& block : out.blocks) block = new_blocks_[block];
  for (std::uint64_t& corner : out.corners) corner = vertex_of(corner);
  next_cell_ += count;
  return count > 0;
}

void PieceMesh::read_array(std::size_t array, std::uint64_t step, std::uint64_t first,
                           std::uint64_t count, std::byte* out) {
  Array& from = arrays_[array];
  if (from.what == Array::What::of_file) {
    PagedArray& values = from.values ? *from.values : step_values(from, step_.value_or(step));
    return values.read(first, count, out);
  }
  const ArrayInfo& info = info_.schema.arrays[array];
  const auto& numbers =
      from.what == Array::What::vertex_numbers ? vertex_numbers() : cell_numbers();
  const std::uint64_t base = info.role.empty() ? 0 : 1;
  for (std::uint64_t i = 0; i < count; ++i) {
    const auto wide = static_cast<std::int64_t>(numbers[first + i] + base);
    const auto narrow = static_cast<std::int32_t>(wide);
    if (info.type == ScalarType::int32)
      std::memcpy(out + i * sizeof narrow, &narrow, sizeof narrow);
    else
      std::memcpy(out + i * sizeof wide, &wide, sizeof wide);
  }
}

// Returns the values of an array at one step. The values are zero if the file has no values for
// this step.
PagedArray& PieceMesh::step_values(Array& array, std::uint64_t step) {
  const ArrayInfo& info = file_->schema().arrays[array.source];
  const std::size_t stride = scalar_bytes(info.type) * info.components;
  const auto [found, fresh] = array.steps.try_emplace(step, *spool_, stride);
  PagedArray& values = found->second;
  const auto& numbers = elements(array.source);
  if (!fresh || numbers.empty()) return values;
  const bool may_lack = damaged_ && file_->had_values(array.source, step);
  if (may_lack) {
    const auto lost = lost_value_of(info);
    for (std::uint64_t i = 0; i < numbers.size(); ++i) values.write(i, 1, lost.data());
    lost_values_[{array.source, step}] = numbers.size();
  } else {
    const std::vector<std::byte> zeros(stride);
    values.write(numbers.size() - 1, 1, zeros.data());
  }
  const auto steps = unwrap(file_->steps(array.source), name_);
  if (!std::binary_search(steps.begin(), steps.end(), step)) return values;
  unwrap(file_->begin_values(array.source, step), name_);
  while (const StepValues* part = unwrap(file_->next_values(), name_)) {
    // Elements that are consecutive in the file are often also consecutive in the piece. Write each
    // such run in one call.
    for (std::size_t i = 0; i < part->numbers.size();) {
      const auto begin = rank_of(numbers, part->numbers[i]);
      std::size_t run = 1;
      while (i + run < part->numbers.size() && begin && *begin + run < numbers.size() &&
             numbers[*begin + run] == part->numbers[i + run])
        ++run;
      if (begin) values.write(*begin, run, part->values.data() + i * stride);
      if (begin && may_lack) lost_values_[{array.source, step}] -= run;
      i += run;
    }
  }
  return values;
}

}  // namespace shm::converters
