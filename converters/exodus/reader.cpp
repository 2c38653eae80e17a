#include <sys/stat.h>

#include <algorithm>
#include <cstring>
#include <limits>
#include <utility>

#include "base/failure.h"
#include "exodus/exodus.h"
#include "exodus/mesh.h"
#include "exodus/netcdf.h"
#include "exodus/polyhedra.h"

namespace shm::converters::exodus {
namespace {

// Maximum number of node numbers per read.
constexpr std::uint64_t kPieceNodes = std::uint64_t{1} << 18;
constexpr std::uint64_t kPieceCells = std::uint64_t{1} << 15;
constexpr std::uint64_t kPiecePoints = std::uint64_t{1} << 15;
// Maximum size of the values of a netCDF-4 file, as a multiple of the file size. Deflate expands a
// byte to at most 1032 bytes; repeated default values expand somewhat more. However, up to
// kMostUnwritten bytes of values are allowed in a file of any size, because chunks that were never
// written need no space in the file.
constexpr std::uint64_t kMostExpansion = 2048;
// Limits on the total number of nodes of all polyhedra. On average, a face may belong to at most
// kMostFaceUses polyhedra; it usually belongs to two. In addition, kFewFaceNodes nodes are allowed
// in any file.
constexpr std::uint64_t kMostFaceUses = 16, kFewFaceNodes = 1 << 20;
// Maximum number of faces of a cell. If a cell has more faces, faces are not derived from cells.
constexpr std::uint64_t kMostCellFaces = kMaxNodesPerCell / 2;
constexpr std::uint64_t kMostUnwritten = std::uint64_t{1} << 30;

// Stores the numbers `first` to `first` + `count` - 1 at `out`, as values of `type`.
void write_numbers(ScalarType type, std::uint64_t first, std::uint64_t count, std::byte* out) {
  std::vector<std::byte> values;
  for (std::uint64_t i = 0; i < count; ++i)
    append_integer(values, type, static_cast<std::int64_t>(first + i));
  std::copy(values.begin(), values.end(), out);
}

}  // namespace

ExodusMesh::ExodusMesh(const std::string& path) : place_{path, ErrorCode::corrupt} {
  check_extent(path);
  read_structure();
  check_sizes();
  find_nodes();
  read_faces();
  FaceUses faces;
  const bool derived = faces_follow(faces);
  if (derived) derive_faces(skeleton_, layout_, place_);
  info_ = describe(skeleton_, layout_, *this, place_);
  if (derived) add_face_numbers(faces);
  for (const BlockLayout& block : layout_.blocks)
    places_.push_back(exodus_permutation(block.elements()));
}

void ExodusMesh::read_structure() {
  open_netcdf(place_.file, ErrorCode::unsupported);
  place_.check(nc_open(place_.file.c_str(), NC_NOWRITE, &file_.id), "opening it");
  skeleton_ = read_skeleton(file_.id, place_);
  if (skeleton_.find_dimension("num_dim") < 0)
    place_.fail(ErrorCode::unsupported, "",
                std::string(is_netcdf4(skeleton_.kind) ? "is an HDF5 file" : "is a netCDF file") +
                    ", but not an Exodus file: it lacks dimension 'num_dim'");
  layout_ = lay_out(skeleton_, place_, true);
  if (layout_.vertices + layout_.cells == 0) layout_ = lay_out(skeleton_, place_, false);
}

// Throws Failure if a dimension or variable states more values than a file of this size can
// contain. This is checked first, because these counts later determine the size of allocations and
// the length of loops.
void ExodusMesh::check_sizes() {
  struct stat status {};
  if (::stat(place_.file.c_str(), &status) != 0) place_.fail(ErrorCode::io, "", "cannot be read");
  const bool packed = is_netcdf4(skeleton_.kind);
  most_bytes_ = static_cast<std::uint64_t>(status.st_size) * (packed ? kMostExpansion : 1);
  const auto refuse = [&](std::uint64_t values, const std::string& where) {
    place_.fail(ErrorCode::corrupt, where,
                "states " + std::to_string(values) + " values, more than the file can hold");
  };
  const auto check = [&](std::uint64_t values, const std::string& where) {
    if (values > most_bytes_) refuse(values, where);
  };
  check(layout_.vertices, "dimension 'num_nodes'");
  check(layout_.cells, "dimension 'num_elem'");
  check(layout_.steps, "dimension 'time_step'");
  const std::uint64_t most = packed ? std::max(most_bytes_, kMostUnwritten) : most_bytes_;
  std::uint64_t room = most;
  for (std::size_t v = 0; v < skeleton_.variables.size(); ++v) {
    const std::uint64_t values = skeleton_.size(skeleton_.variables[v]);
    const std::size_t bytes = scalar_bytes(scalar_of(skeleton_.variables[v].type));
    if (values > room / bytes) refuse(values, section(static_cast<int>(v)));
    room -= values * bytes;
  }
}

// Finds the columns of each connectivity that contain nodes. If the element type is unknown, the
// final columns may contain numbers that are not nodes. In this case, only the columns before the
// first number that cannot be a node are treated as nodes.
void ExodusMesh::find_nodes() {
  for (std::uint32_t b = 0; b < layout_.blocks.size(); ++b) {
    const BlockLayout& block = layout_.blocks[b];
    const std::uint32_t columns = block.nodes_per_cell;
    if (block.shape != CellShape::other || columns < 2) continue;
    std::uint32_t nodes = node_columns(skeleton_, block);
    const std::uint64_t piece = std::max<std::uint64_t>(kPieceNodes / columns, 1);
    for (std::uint64_t first = 0; first < block.cells; first += piece) {
      const std::uint64_t cells = std::min(piece, block.cells - first);
      read_connectivity(block, first, cells);
      for (std::uint64_t c = 0; c < cells; ++c)
        for (std::uint32_t i = 0; i < nodes; ++i) {
          const std::int64_t node = nodes_[c * columns + i];
          if (node < 1 || std::cmp_greater(node, layout_.vertices)) nodes = i;
        }
    }
    if (nodes > 0 && nodes < columns) narrow_connectivity(skeleton_, layout_, b, nodes);
  }
}

// Reads the connectivity of the cells `first` to `first` + `cells` - 1 of a block into nodes_. All
// cells of the block must have the same number of nodes.
void ExodusMesh::read_connectivity(const BlockLayout& block, std::uint64_t first,
                                   std::uint64_t cells) {
  const std::uint64_t nodes = block.nodes_per_cell;
  const std::size_t start[2] = {first, 0}, length[2] = {cells, nodes};
  std::vector<long long> values(cells * nodes);
  touch(block.connectivity);
  place_.check(nc_get_vara_longlong(file_.id, block.connectivity, start, length, values.data()),
               section(block.connectivity));
  nodes_.assign(values.begin(), values.end());
}

std::vector<std::int64_t> ExodusMesh::integers(int index, std::uint64_t first,
                                               std::uint64_t count) const {
  std::vector<long long> values(count);
  std::size_t start = first, length = count;
  touch(index);
  if (count > 0)
    place_.check(nc_get_vara_longlong(file_.id, index, &start, &length, values.data()),
                 section(index));
  return {values.begin(), values.end()};
}

std::vector<std::byte> ExodusMesh::rows(int index, std::uint64_t first, std::uint64_t count) const {
  const Variable& one = variable(index);
  std::vector<std::byte> values;
  touch(index);
  if (one.type == NC_STRING) {
    const std::uint64_t count_of_texts = skeleton_.size(one);
    std::vector<char*> texts(count_of_texts);
    if (count_of_texts > 0)
      place_.check(nc_get_var_string(file_.id, index, texts.data()), section(index));
    for (const char* text : texts) {
      const auto* bytes = reinterpret_cast<const std::byte*>(text != nullptr ? text : "");
      values.insert(values.end(), bytes, bytes + (text != nullptr ? std::strlen(text) : 0) + 1);
    }
    nc_free_string(count_of_texts, texts.data());
    return values;
  }
  const auto shape = skeleton_.shape(one);
  Slab slab{std::vector<std::size_t>(shape.size(), 0), {shape.begin(), shape.end()}};
  if (!shape.empty()) {
    slab.start[0] = first;
    slab.count[0] = count;
  }
  std::size_t bytes = scalar_bytes(scalar_of(one.type));
  for (const std::size_t length : slab.count) bytes *= length;
  values.resize(bytes);
  if (bytes > 0)
    place_.check(nc_get_vara(file_.id, index, slab.start.data(), slab.count.data(), values.data()),
                 section(index));
  return values;
}

// Reads the nodes of all faces. Faces are numbered consecutively across all face blocks, and
// polyhedra refer to these numbers.
void ExodusMesh::read_faces() {
  const bool wanted = std::any_of(layout_.blocks.begin(), layout_.blocks.end(),
                                  [](const BlockLayout& block) { return block.faces >= 0; });
  if (!wanted) return;
  face_begin_.push_back(0);
  for (const FaceBlock& block : face_blocks(skeleton_, place_)) {
    std::vector<std::int64_t> sizes;
    if (block.counts < 0)
      sizes.assign(block.faces, static_cast<std::int64_t>(block.size));
    else
      sizes = integers(block.counts, 0, block.faces);
    std::uint64_t total = 0;
    for (const std::int64_t size : sizes) {
      if (size < 0 || std::cmp_greater(size, kMaxNodesPerCell))
        place_.fail(ErrorCode::corrupt, section(block.counts < 0 ? block.nodes : block.counts),
                    "states a face of " + std::to_string(size) + " nodes");
      total += static_cast<std::uint64_t>(size);
      face_begin_.push_back(face_nodes_.size() + total);
    }
    if (total != skeleton_.size(variable(block.nodes)))
      place_.fail(ErrorCode::corrupt, section(block.nodes),
                  "has " + std::to_string(skeleton_.size(variable(block.nodes))) +
                      " nodes, but its faces need " + std::to_string(total));
    const std::size_t old = face_nodes_.size();
    std::vector<long long> values(total);
    if (total > 0)
      place_.check(nc_get_var_longlong(file_.id, block.nodes, values.data()), section(block.nodes));
    face_nodes_.resize(old + total);
    std::copy(values.begin(), values.end(), face_nodes_.begin() + static_cast<std::ptrdiff_t>(old));
  }
}

// Stores the numbers of the faces in the file as extras. Lists the numbers in one of two orders
// (polyhedra.h), whichever results in longer runs of consecutive numbers. If the numbers in this
// order are 1, 2, 3, ..., they are not stored.
void ExodusMesh::add_face_numbers(const FaceUses& faces) {
  const auto in_order = [&](bool shared_first) {
    const auto places = face_places(faces.uses, shared_first);
    std::vector<std::int64_t> numbers(places.size());
    for (std::size_t f = 0; f < places.size(); ++f) numbers[places[f]] = faces.numbers[f];
    return numbers;
  };
  const auto breaks = [](const std::vector<std::int64_t>& numbers) {
    std::size_t count = numbers.front() == 1 ? 0 : 1;
    for (std::size_t i = 1; i < numbers.size(); ++i)
      count += numbers[i] == numbers[i - 1] + 1 ? 0 : 1;
    return count;
  };
  std::vector<std::int64_t> numbers = in_order(false);
  std::size_t least = breaks(numbers);
  if (std::vector<std::int64_t> other = in_order(true); breaks(other) < least) {
    least = breaks(other);
    numbers = std::move(other);
    info_.extras.push_back(integers_extra(kSharedFirst, std::vector<std::int32_t>{1}));
  }
  if (least > 0) info_.extras.push_back(integers_extra(kFaceNumbers, numbers));
}

// Returns true if the face blocks and the lists of faces can be derived from the cells and the
// order of the faces. Stores this order in `faces` (see polyhedra.h). Returns false if the data is
// invalid; the error is reported later, when cells are read.
bool ExodusMesh::faces_follow(FaceUses& faces) const {
  if (face_begin_.size() < 2 || !faces_are_unlike()) return false;
  constexpr std::uint64_t kNobody = ~std::uint64_t{0};
  std::vector<std::uint64_t> places(face_begin_.size(), kNobody);
  for (const BlockLayout& block : layout_.blocks) {
    if (block.faces < 0) continue;
    const std::uint64_t all = skeleton_.size(variable(block.faces));
    std::uint64_t position = 0, window_begin = 0;
    std::vector<std::int64_t> window;  // part of the block's list of faces, from index window_begin
                                       // on
    const auto next_face = [&] {
      if (position - window_begin == window.size()) {
        window_begin = position;
        window = integers(block.faces, position, std::min(kPieceNodes, all - position));
      }
      return window[position++ - window_begin];
    };
    for (std::uint64_t first = 0; first < block.cells; first += kPieceCells)
      for (const std::int64_t count :
           integers(block.counts, first, std::min(kPieceCells, block.cells - first))) {
        if (count < 1 ||
            static_cast<std::uint64_t>(count) > std::min(all - position, kMostCellFaces))
          return false;
        // In cells of shape `faces`, each face ends with a repetition of its first node. Count one
        // more node per face.
        std::uint64_t nodes = static_cast<std::uint64_t>(count);
        for (std::int64_t i = 0; i < count; ++i) {
          const std::int64_t face = next_face();
          if (face < 1 || std::cmp_greater_equal(face, face_begin_.size())) return false;
          const auto f = static_cast<std::size_t>(face);
          nodes += face_begin_[f] - face_begin_[f - 1];
          if (places[f] == kNobody) {
            places[f] = faces.numbers.size();
            faces.numbers.push_back(face);
            faces.uses.push_back(0);
          }
          ++faces.uses[places[f]];
        }
        if (nodes > kMaxNodesPerCell) return false;
      }
    if (position != all) return false;
  }
  return faces.numbers.size() + 1 == face_begin_.size();
}

// Returns true if no two faces have the same list of nodes, and no face contains its first node
// twice.
bool ExodusMesh::faces_are_unlike() const {
  FaceTable table;
  std::vector<std::uint64_t> nodes;
  for (std::size_t f = 0; f + 1 < face_begin_.size(); ++f) {
    nodes.clear();
    for (auto n = face_begin_[f]; n < face_begin_[f + 1]; ++n) {
      const std::int64_t node = face_nodes_[n];
      if (node < 1 || std::cmp_greater(node, layout_.vertices)) return false;
      if (n > face_begin_[f] && node == face_nodes_[face_begin_[f]]) return false;
      nodes.push_back(static_cast<std::uint64_t>(node));
    }
    if (nodes.empty() || table.number_of(nodes) != f) return false;
  }
  return true;
}

template <class Real>
void ExodusMesh::read_points_as(std::uint64_t first, std::uint64_t count, Real* out) {
  std::array<std::vector<Real>, 3> axes;
  for (auto& axis : axes) axis.resize(std::min(count, kPiecePoints));
  while (count > 0) {
    const std::uint64_t run = std::min(count, kPiecePoints);
    for (const int v : layout_.coordinates)
      if (v >= 0) touch(v);
    for (std::size_t c = 0; c < 3; ++c) {
      const int v = layout_.coordinates[c];
      if (v < 0) continue;
      Slab slab{{first}, {run}};
      if (layout_.coordinates_together) slab = {{c, first}, {1, run}};
      if constexpr (std::is_same_v<Real, float>)
        place_.check(
            nc_get_vara_float(file_.id, v, slab.start.data(), slab.count.data(), axes[c].data()),
            section(v));
      else
        place_.check(
            nc_get_vara_double(file_.id, v, slab.start.data(), slab.count.data(), axes[c].data()),
            section(v));
    }
    for (std::size_t c = 0; c < 3; ++c) {
      if (layout_.coordinates[c] < 0) std::fill(axes[c].begin(), axes[c].end(), Real{0});
      for (std::uint64_t i = 0; i < run; ++i) out[3 * i + c] = axes[c][i];
    }
    out += 3 * run;
    first += run;
    count -= run;
  }
}

void ExodusMesh::read_points(std::uint64_t first, std::uint64_t count, std::byte* out) {
  if (layout_.coordinate_type == ScalarType::float32)
    read_points_as(first, count, reinterpret_cast<float*>(out));
  else
    read_points_as(first, count, reinterpret_cast<double*>(out));
}

std::uint64_t ExodusMesh::vertex_of(std::int64_t node) const {
  if (node < 1 || std::cmp_greater(node, layout_.vertices))
    place_.fail(ErrorCode::corrupt, "element block " + std::to_string(at_.block + 1),
                "an element has node " + std::to_string(node) + ", but nodes go from 1 to " +
                    std::to_string(layout_.vertices));
  return static_cast<std::uint64_t>(node - 1);
}

bool ExodusMesh::next_cells(CellBatch& out, std::size_t max_cells) {
  out.clear();
  while (at_.block < layout_.blocks.size() && at_.cell == layout_.blocks[at_.block].cells)
    at_ = {at_.block + 1, 0, 0};
  if (at_.block == layout_.blocks.size() || max_cells == 0) return false;
  const BlockLayout& block = layout_.blocks[at_.block];
  const std::uint64_t most =
      std::min({static_cast<std::uint64_t>(max_cells), kPieceCells, block.cells - at_.cell});
  const std::uint64_t taken = block.faces >= 0    ? take_polyhedra(out, most)
                              : block.counts >= 0 ? take_polygons(out, most)
                                                  : take_nodes(out, most);
  out.blocks.assign(taken, at_.block);
  at_.cell += taken;
  return true;
}

// Moves the reading position to cell `first`. If all blocks have a fixed number of nodes per
// element, this is immediate. Otherwise all earlier cells are read.
void ExodusMesh::seek_cells(std::uint64_t first) {
  for (const BlockLayout& block : layout_.blocks)
    if (block.faces >= 0 || block.counts >= 0) return MeshSource::seek_cells(first);
  at_ = {};
  for (; at_.block < layout_.blocks.size() && first >= layout_.blocks[at_.block].cells; ++at_.block)
    first -= layout_.blocks[at_.block].cells;
  if (at_.block < layout_.blocks.size()) at_.cell = first;
}

std::uint64_t ExodusMesh::take_nodes(CellBatch& out, std::uint64_t most) {
  const BlockLayout& block = layout_.blocks[at_.block];
  const std::uint64_t nodes = block.nodes_per_cell;
  const std::uint64_t cells =
      nodes == 0 ? most : std::clamp<std::uint64_t>(kPieceNodes / nodes, 1, most);
  nodes_.resize(cells * nodes);
  if (nodes == 0) {
    // The elements of this block have no nodes.
  } else if (variable(block.connectivity).dimensions.size() == 1) {
    nodes_ = integers(block.connectivity, at_.cell, cells);
  } else {
    read_connectivity(block, at_.cell, cells);
  }
  out.corners.resize(nodes_.size());
  const auto& places = places_[at_.block];
  for (std::uint64_t c = 0; c < cells; ++c) {
    for (std::uint64_t i = 0; i < nodes; ++i)
      out.corners[c * nodes + i] = vertex_of(nodes_[c * nodes + (places.empty() ? i : places[i])]);
    out.corner_begin.push_back((c + 1) * nodes);
  }
  return cells;
}

std::uint64_t ExodusMesh::take_polygons(CellBatch& out, std::uint64_t most) {
  const BlockLayout& block = layout_.blocks[at_.block];
  const std::uint64_t left = skeleton_.size(variable(block.connectivity)) - at_.node;
  std::uint64_t cells = 0, nodes = 0;
  for (const std::int64_t count : integers(block.counts, at_.cell, most)) {
    if (count < 0 || std::cmp_greater(count, kMaxNodesPerCell) ||
        static_cast<std::uint64_t>(count) > left - nodes)
      place_.fail(ErrorCode::corrupt, section(block.counts),
                  "states an element of " + std::to_string(count) + " nodes, but only " +
                      std::to_string(left - nodes) + " are left");
    if (cells > 0 && nodes + static_cast<std::uint64_t>(count) > kPieceNodes) break;
    nodes += static_cast<std::uint64_t>(count);
    ++cells;
    out.corner_begin.push_back(nodes);
  }
  for (const std::int64_t node : integers(block.connectivity, at_.node, nodes))
    out.corners.push_back(vertex_of(node));
  at_.node += nodes;
  return cells;
}

std::uint64_t ExodusMesh::take_polyhedra(CellBatch& out, std::uint64_t most) {
  const BlockLayout& block = layout_.blocks[at_.block];
  const std::uint64_t left = skeleton_.size(variable(block.faces)) - at_.node;
  const auto counts = integers(block.counts, at_.cell, most);
  std::uint64_t cells = 0;
  while (cells < most && (cells == 0 || out.corners.size() < kPieceNodes)) {
    const std::int64_t count = counts[cells];
    if (count < 0 || static_cast<std::uint64_t>(count) > left ||
        at_.node + static_cast<std::uint64_t>(count) > skeleton_.size(variable(block.faces)))
      place_.fail(ErrorCode::corrupt, section(block.counts),
                  "states an element of " + std::to_string(count) + " faces");
    for (const std::int64_t face :
         integers(block.faces, at_.node, static_cast<std::uint64_t>(count))) {
      if (face < 1 || std::cmp_greater_equal(face, face_begin_.size()))
        place_.fail(ErrorCode::corrupt, section(block.faces),
                    "an element has face " + std::to_string(face) + " of " +
                        std::to_string(face_begin_.size() - 1));
      const auto begin = face_begin_[static_cast<std::size_t>(face) - 1];
      for (auto n = begin; n < face_begin_[static_cast<std::size_t>(face)]; ++n)
        out.corners.push_back(vertex_of(face_nodes_[n]));
      if (block.shape == CellShape::faces) out.corners.push_back(vertex_of(face_nodes_[begin]));
      if (out.corners.size() - out.corner_begin.back() > kMaxNodesPerCell)
        place_.fail(ErrorCode::unsupported, section(block.faces),
                    "an element has more than " + std::to_string(kMaxNodesPerCell) + " nodes");
    }
    polyhedron_nodes_ += out.corners.size() - out.corner_begin.back();
    if (polyhedron_nodes_ > kMostFaceUses * face_nodes_.size() + kFewFaceNodes)
      place_.fail(ErrorCode::over_limit, section(block.faces),
                  "faces belong to more than " + std::to_string(kMostFaceUses) +
                      " elements on the average");
    out.corner_begin.push_back(out.corners.size());
    at_.node += static_cast<std::uint64_t>(count);
    ++cells;
  }
  return cells;
}

void ExodusMesh::read_array(std::size_t array, std::uint64_t step, std::uint64_t first,
                            std::uint64_t count, std::byte* out) {
  const ArrayLayout& layout = layout_.arrays[array];
  const std::size_t stride = info_.array_stride(array);
  for (const ArrayPart& part : layout.parts) {
    const std::uint64_t size = elements_of(layout_, layout, part);
    if (first >= size) {
      first -= size;
      continue;
    }
    const std::uint64_t run = std::min(count, size - first);
    if (run > 0 && stride > 0) read_part(layout, part, step, first, run, out);
    out += run * stride;
    count -= run;
    first = 0;
  }
}

// Reads the value of a global variable at a step from memory. All global variables at all steps are
// read together, because each of them takes a few bytes of each step's record. Returns false if
// they are too large for that.
bool ExodusMesh::read_global(const ArrayLayout& array, const ArrayPart& part, std::uint64_t step,
                             std::byte* out) {
  constexpr std::uint64_t kMostBytes = std::uint64_t{64} << 20;
  const std::size_t width = scalar_bytes(array.info.type);
  const std::uint64_t values = skeleton_.size(variable(part.variable));
  if (values > kMostBytes / width) return false;
  if (globals_.empty()) globals_ = rows(part.variable, 0, layout_.steps);
  const std::size_t fields = values / layout_.steps;
  std::copy_n(globals_.data() + (step * fields + array.plane) * width, width, out);
  return true;
}

void ExodusMesh::read_part(const ArrayLayout& array, const ArrayPart& part, std::uint64_t step,
                           std::uint64_t first, std::uint64_t count, std::byte* out) {
  if (part.variable < 0) {
    write_numbers(array.info.type, first, count, out);
    return;
  }
  if (array.info.location == Location::global && read_global(array, part, step, out)) return;
  touch(part.variable);
  const Slab slab = slab_of(skeleton_, array, part, step, first, count);
  place_.check(nc_get_vara(file_.id, part.variable, slab.start.data(), slab.count.data(), out),
               section(part.variable));
}

}  // namespace shm::converters::exodus

namespace shm::converters {

bool looks_like_exodus(std::span<const std::byte> head) {
  const auto starts_with = [&](std::string_view magic) {
    return head.size() >= magic.size() && std::memcmp(head.data(), magic.data(), magic.size()) == 0;
  };
  using namespace std::string_view_literals;
  return starts_with("CDF\x01"sv) || starts_with("CDF\x02"sv) || starts_with("CDF\x05"sv) ||
         starts_with("\x89HDF\r\n\x1a\n"sv);
}

std::unique_ptr<MeshSource> open_exodus(const std::string& path, Spool&) {
  return std::make_unique<exodus::ExodusMesh>(path);
}

}  // namespace shm::converters
