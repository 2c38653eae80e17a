#include <netcdf.h>

#include <sys/stat.h>

#include <algorithm>
#include <cstring>
#include <limits>
#include <utility>

#include "exodus.h"
#include "exodus_layout.h"
#include "exodus_skeleton.h"
#include "failure.h"

namespace shm::converters {
namespace {

using namespace exodus;

constexpr std::uint64_t kPieceNodes = std::uint64_t{1} << 18;  // node numbers read at once
constexpr std::uint64_t kPieceCells = std::uint64_t{1} << 15;
constexpr std::uint64_t kPiecePoints = std::uint64_t{1} << 15;
// Deflate makes at most 1032 bytes of one; a few more for values that repeat by default. Chunks
// that were never written take no room at all: so much may be missing from a file, all values
// together.
constexpr std::uint64_t kMostExpansion = 2048;
constexpr std::uint64_t kMostSets = 1 << 16;  // each takes some extras
// A face belongs to two polyhedra, and rarely to more; each may have the nodes of many faces.
constexpr std::uint64_t kMostFaceUses = 16, kFewFaceNodes = 1 << 20;
constexpr std::uint64_t kMostUnwritten = std::uint64_t{1} << 30;

// Numbers from 1 as references from 0; false when one is neither 0 nor in 1..count.
bool refer_from_zero(Extra& extra, Reference refers, std::uint64_t count) {
  const auto numbers = integers_of(extra.type, extra.data);
  if (!numbers) return false;
  const ScalarType type = reference_type(extra.type);
  std::vector<std::byte> values;
  for (const std::int64_t number : *numbers)
    if (number < 0 || std::cmp_greater(number, count) || !append_integer(values, type, number - 1))
      return false;
  extra.type = type;
  extra.refers = refers;
  extra.data = std::move(values);
  return true;
}

// first, first + 1, ...
void write_numbers(ScalarType type, std::uint64_t first, std::uint64_t count, std::byte* out) {
  std::vector<std::byte> values;
  for (std::uint64_t i = 0; i < count; ++i)
    append_integer(values, type, static_cast<std::int64_t>(first + i));
  std::copy(values.begin(), values.end(), out);
}

struct NetcdfFile {
  NetcdfFile() = default;
  NetcdfFile(const NetcdfFile&) = delete;
  NetcdfFile& operator=(const NetcdfFile&) = delete;
  ~NetcdfFile() {
    if (id >= 0) nc_close(id);
  }
  int id = -1;
};

class ExodusMesh final : public MeshSource {
 public:
  explicit ExodusMesh(const std::string& path);

  const MeshInfo& info() const override { return info_; }
  void read_points(std::uint64_t first, std::uint64_t count, std::byte* out) override;
  bool next_cells(CellBatch& out, std::size_t max_cells) override;
  void rewind_cells() override {
    at_ = {};
    polyhedron_nodes_ = 0;
  }
  void seek_cells(std::uint64_t first) override;
  void read_array(std::size_t array, std::uint64_t step, std::uint64_t first, std::uint64_t count,
                  std::byte* out) override;

 private:
  // Where next_cells goes on.
  struct Position {
    std::uint32_t block = 0;
    std::uint64_t cell = 0;  // in the block
    std::uint64_t node = 0;  // in the block's connectivity (polygons), face (polyhedra)
  };

  void read_structure();
  void check_sizes();
  void find_nodes();
  void describe_blocks();
  void describe_arrays();
  void describe_times();
  void read_set_labels(std::vector<Extra>& extras);
  void read_extras();
  void read_variable(std::size_t v, const ExtraIndex& labels, std::vector<Extra>& out);
  Extra read_rows(int index, std::uint64_t first, std::uint64_t count) const;
  void read_faces();

  const Variable& variable(int index) const {
    return skeleton_.variables[static_cast<std::size_t>(index)];
  }
  void touch(int index) const { caches_.touch(file_.id, skeleton_, index); }
  std::string section(int index) const { return "variable '" + variable(index).name + "'"; }
  std::vector<std::int64_t> integers(int index, std::uint64_t first, std::uint64_t count) const;
  std::vector<std::byte> whole(int index) const;
  std::vector<std::string> names(std::string_view table, std::uint64_t count) const;

  template <class Real>
  void read_points_as(std::uint64_t first, std::uint64_t count, Real* out);
  void read_part(const ArrayLayout& array, const ArrayPart& part, std::uint64_t step,
                 std::uint64_t first, std::uint64_t count, std::byte* out) const;

  void read_connectivity(const BlockLayout& block, std::uint64_t first, std::uint64_t cells);
  std::uint64_t take_nodes(CellBatch& out, std::uint64_t most);
  std::uint64_t take_polygons(CellBatch& out, std::uint64_t most);
  std::uint64_t take_polyhedra(CellBatch& out, std::uint64_t most);
  std::uint64_t vertex_of(std::int64_t node) const;

  Place place_;
  NetcdfFile file_;
  mutable ChunkCaches caches_;
  Skeleton skeleton_;
  Layout layout_;
  MeshInfo info_;
  std::uint64_t most_bytes_ = 0;                   // that values can have in a file of this size
  std::vector<std::vector<std::uint8_t>> places_;  // of nodes, by block
  std::vector<std::uint64_t> face_begin_;          // of all faces; only with polyhedra
  std::vector<std::int64_t> face_nodes_;
  Position at_;
  std::uint64_t polyhedron_nodes_ = 0;  // of the polyhedra up to there, face by face
  std::vector<std::int64_t> nodes_;
};

ExodusMesh::ExodusMesh(const std::string& path) : place_{path, ErrorCode::corrupt} {
  check_extent(path);
  read_structure();
  check_sizes();
  find_nodes();
  describe_blocks();
  describe_arrays();
  describe_times();
  read_extras();
  read_faces();
}

void ExodusMesh::read_structure() {
  place_.check(nc_open(place_.file.c_str(), NC_NOWRITE, &file_.id), "opening it");
  skeleton_ = read_skeleton(file_.id, place_);
  if (skeleton_.find_dimension("num_dim") < 0)
    place_.fail(ErrorCode::unsupported, "dimensions",
                "is a netCDF file, but not Exodus: it has no dimension 'num_dim'");
  layout_ = lay_out(skeleton_, place_);
}

// Nothing may claim more values than a file of this size can hold: counts drive allocations and
// loops from here on.
void ExodusMesh::check_sizes() {
  struct stat status {};
  if (::stat(place_.file.c_str(), &status) != 0) place_.fail(ErrorCode::io, "", "cannot be read");
  const bool packed = skeleton_.kind == Kind::netcdf4 || skeleton_.kind == Kind::netcdf4_classic;
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

// Elements of unknown kinds may have other numbers than nodes in the last columns.
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

// Into nodes_, the node columns of some cells of a block with a rectangular connectivity.
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

// All values; strings each ended by a zero.
std::vector<std::byte> ExodusMesh::whole(int index) const {
  const std::uint64_t count = skeleton_.size(variable(index));
  std::vector<std::byte> values;
  touch(index);
  if (variable(index).type != NC_STRING) {
    values.resize(count * scalar_bytes(scalar_of(variable(index).type)));
    if (count > 0) place_.check(nc_get_var(file_.id, index, values.data()), section(index));
    return values;
  }
  std::vector<char*> texts(count);
  if (count > 0) place_.check(nc_get_var_string(file_.id, index, texts.data()), section(index));
  for (const char* text : texts) {
    const auto* bytes = reinterpret_cast<const std::byte*>(text != nullptr ? text : "");
    values.insert(values.end(), bytes, bytes + (text != nullptr ? std::strlen(text) : 0) + 1);
  }
  nc_free_string(count, texts.data());
  return values;
}

// Rows of a table of names; as many as there are, at most `count`.
std::vector<std::string> ExodusMesh::names(std::string_view table, std::uint64_t count) const {
  const int index = skeleton_.find_variable(table);
  if (index < 0 || variable(index).type != NC_CHAR) return {};
  const auto shape = skeleton_.shape(variable(index));
  if (shape.size() != 2) return {};
  const std::vector<std::byte> values = whole(index);
  std::vector<std::string> rows;
  for (std::uint64_t i = 0; i < std::min(shape[0], count); ++i)
    rows.push_back(name_in_table(values, shape[1], i));
  return rows;
}

void ExodusMesh::describe_blocks() {
  Schema& schema = info_.schema;
  schema.source_format = "exodus";
  schema.coordinate_type = layout_.coordinate_type;
  info_.vertices = layout_.vertices;
  const std::size_t count = layout_.blocks.size();
  const auto labels = names("eb_names", count);
  std::vector<std::int64_t> ids;
  const int table = skeleton_.find_variable("eb_prop1");
  const bool has_ids = table >= 0 &&
                       skeleton_.shape(variable(table)) == std::vector<std::uint64_t>{count} &&
                       variable(table).type != NC_CHAR && variable(table).type != NC_STRING;
  if (has_ids) ids = integers(table, 0, count);
  for (std::size_t b = 0; b < count; ++b) {
    const BlockLayout& block = layout_.blocks[b];
    schema.blocks.push_back({has_ids ? ids[b] : static_cast<std::int64_t>(b + 1),
                             b < labels.size() ? labels[b] : std::string(), block.shape,
                             block.nodes_per_cell});
    info_.block_cells.push_back(block.cells);
    places_.push_back(node_places(block.shape, block.nodes_per_cell));
  }
}

void ExodusMesh::describe_arrays() {
  const std::size_t most = skeleton_.variables.size() + layout_.arrays.size();
  const auto nodal = names("name_nod_var", most);
  const auto element = names("name_elem_var", most);
  for (const ArrayLayout& array : layout_.arrays) {
    info_.schema.arrays.push_back(array.info);
    if (array.field == 0) continue;
    std::string& name = info_.schema.arrays.back().name;
    const auto& table = array.info.location == Location::point ? nodal : element;
    const auto place = static_cast<std::size_t>(array.field) - 1;
    if (place < table.size()) name = table[place];
    if (name.empty())
      name = (array.info.location == Location::point ? "nodal_" : "element_") +
             std::to_string(array.field);
  }
}

void ExodusMesh::describe_times() {
  info_.step_times.resize(layout_.steps);
  const int index = skeleton_.find_variable("time_whole");
  if (index < 0 || variable(index).type == NC_CHAR || variable(index).type == NC_STRING ||
      skeleton_.shape(variable(index)) != std::vector<std::uint64_t>{layout_.steps})
    return;
  if (layout_.steps > 0)
    place_.check(nc_get_var_double(file_.id, index, info_.step_times.data()), section(index));
}

void ExodusMesh::read_set_labels(std::vector<Extra>& extras) {
  for (const SetKind& kind : kSetKinds) {
    const int table = skeleton_.find_variable(std::string(kind.prefix) + "_prop1");
    if (table < 0) continue;
    const auto shape = skeleton_.shape(variable(table));
    const ScalarType type = scalar_of(variable(table).type);
    if (shape.size() != 1 || (type != ScalarType::int32 && type != ScalarType::int64)) continue;
    if (shape[0] > kMostSets)
      place_.fail(ErrorCode::unsupported, section(table),
                  "there are more than " + std::to_string(kMostSets) + " sets");
    const std::vector<std::byte> ids = whole(table);
    const auto labels = names(std::string(kind.prefix) + "_names", shape[0]);
    const auto bytes = static_cast<std::ptrdiff_t>(scalar_bytes(type));
    for (std::size_t i = 0; i < shape[0]; ++i) {
      const auto begin = ids.begin() + static_cast<std::ptrdiff_t>(i) * bytes;
      extras.push_back(
          {set_key(kind, i, "id"), type, Reference::nothing, {1}, {begin, begin + bytes}});
      if (i >= labels.size() || labels[i].empty()) continue;
      const auto* text = reinterpret_cast<const std::byte*>(labels[i].data());
      extras.push_back({set_key(kind, i, "name"),
                        ScalarType::uint8,
                        Reference::nothing,
                        {labels[i].size()},
                        {text, text + labels[i].size()}});
    }
  }
}

void ExodusMesh::read_extras() {
  const std::string text = to_text(skeleton_);
  const auto* bytes = reinterpret_cast<const std::byte*>(text.data());
  std::vector<Extra> extras;
  extras.push_back({"exodus/skeleton",
                    ScalarType::uint8,
                    Reference::nothing,
                    {text.size()},
                    {bytes, bytes + text.size()}});
  read_set_labels(extras);
  const ExtraIndex labels(extras);
  std::vector<Extra> values;
  for (std::size_t v = 0; v < skeleton_.variables.size(); ++v)
    if (layout_.uses[v] == Use::extra) read_variable(v, labels, values);
  info_.extras = std::move(extras);
  info_.extras.insert(info_.extras.end(), std::make_move_iterator(values.begin()),
                      std::make_move_iterator(values.end()));
}

// A variable as extras, of some rows each when it is large. Nothing when it follows from the rest.
void ExodusMesh::read_variable(std::size_t v, const ExtraIndex& labels, std::vector<Extra>& out) {
  const Variable& one = skeleton_.variables[v];
  const Reference refers = reference_of(one.name);
  const std::uint64_t count = refers == Reference::vertex ? layout_.vertices : layout_.cells;
  const bool integral = is_integer(one.type);
  const auto rows = rows_of_parts(skeleton_, one);
  std::vector<Extra> parts;
  bool referring = integral && refers != Reference::nothing;
  for (std::size_t i = 0; i + 1 < rows.size(); ++i) {
    Extra part = read_rows(static_cast<int>(v), rows[i], rows[i + 1] - rows[i]);
    if (rows.size() == 2 && derived_values(skeleton_, layout_, v, info_, labels) == part.data)
      return;
    parts.push_back(std::move(part));
    if (referring && !refer_from_zero(parts.back(), refers, count)) {
      // What is no reference in one part is none in any.
      referring = false;
      parts.clear();
      i = std::size_t(-1);
    }
  }
  const bool plain = refers != Reference::nothing && !referring;
  const std::string key = plain ? plain_key(one.name) : extra_key(one.name);
  for (std::size_t i = 0; i < parts.size(); ++i) {
    parts[i].key = part_key(key, i);
    out.push_back(std::move(parts[i]));
  }
}

// Rows of a variable: those of its first dimension.
Extra ExodusMesh::read_rows(int index, std::uint64_t first, std::uint64_t count) const {
  const Variable& one = variable(index);
  Extra extra{{}, scalar_of(one.type), Reference::nothing, skeleton_.shape(one), {}};
  if (count == 0 || one.type == NC_STRING || one.dimensions.empty()) {
    extra.data = whole(index);
    if (one.type == NC_STRING) extra.shape = {extra.data.size()};
    return extra;
  }
  extra.shape[0] = count;
  Slab slab{std::vector<std::size_t>(extra.shape.size(), 0),
            {extra.shape.begin(), extra.shape.end()}};
  slab.start[0] = first;
  std::size_t bytes = scalar_bytes(extra.type);
  for (const std::size_t length : slab.count) bytes *= length;
  extra.data.resize(bytes);
  touch(index);
  if (bytes > 0)
    place_.check(
        nc_get_vara(file_.id, index, slab.start.data(), slab.count.data(), extra.data.data()),
        section(index));
  return extra;
}

// Faces are numbered through all face blocks; polyhedra name them.
void ExodusMesh::read_faces() {
  const bool wanted = std::any_of(layout_.blocks.begin(), layout_.blocks.end(),
                                  [](const BlockLayout& block) { return block.faces >= 0; });
  if (!wanted) return;
  face_begin_.push_back(0);
  const std::uint64_t blocks = skeleton_.length_of("num_fa_blk");
  const VariableIndex variables(skeleton_);
  for (std::uint64_t b = 1; b <= blocks; ++b) {
    const int counts = variables.find("fbepecnt" + std::to_string(b));
    const int nodes = variables.find("fbconn" + std::to_string(b));
    if (nodes < 0) break;
    const auto shape = skeleton_.shape(variable(nodes));
    const bool same_size = shape.size() == 2;
    if (!same_size && (shape.size() != 1 || counts < 0 || variable(counts).dimensions.size() != 1))
      place_.fail(ErrorCode::corrupt, section(nodes), "does not have the shape of a connectivity");
    std::vector<std::int64_t> sizes;
    if (same_size)
      sizes.assign(shape[0], static_cast<std::int64_t>(shape[1]));
    else
      sizes = integers(counts, 0, skeleton_.size(variable(counts)));
    std::uint64_t total = 0;
    for (const std::int64_t size : sizes) {
      if (size < 0 || std::cmp_greater(size, kMaxNodesPerCell))
        place_.fail(ErrorCode::corrupt, section(same_size ? nodes : counts),
                    "states a face of " + std::to_string(size) + " nodes");
      total += static_cast<std::uint64_t>(size);
      face_begin_.push_back(face_nodes_.size() + total);
    }
    if (total != skeleton_.size(variable(nodes)))
      place_.fail(ErrorCode::corrupt, section(nodes),
                  "has " + std::to_string(skeleton_.size(variable(nodes))) +
                      " nodes where its faces need " + std::to_string(total));
    const std::size_t old = face_nodes_.size();
    std::vector<long long> values(total);
    if (total > 0)
      place_.check(nc_get_var_longlong(file_.id, nodes, values.data()), section(nodes));
    face_nodes_.resize(old + total);
    std::copy(values.begin(), values.end(), face_nodes_.begin() + static_cast<std::ptrdiff_t>(old));
  }
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

// Cells of blocks whose elements all have as many nodes are found at once; of others, those before
// are read.
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
    // Elements without nodes.
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
                  "states an element of " + std::to_string(count) + " nodes, where " +
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
    const std::uint64_t size = part.block != ArrayPart::kEverything ? info_.block_cells[part.block]
                               : layout.info.location == Location::point ? info_.vertices
                                                                         : layout_.cells;
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

void ExodusMesh::read_part(const ArrayLayout& array, const ArrayPart& part, std::uint64_t step,
                           std::uint64_t first, std::uint64_t count, std::byte* out) const {
  if (part.variable < 0) {
    write_numbers(array.info.type, first, count, out);
    return;
  }
  touch(part.variable);
  const Slab slab = slab_of(skeleton_, array, part, step, first, count);
  place_.check(nc_get_vara(file_.id, part.variable, slab.start.data(), slab.count.data(), out),
               section(part.variable));
}

}  // namespace

bool looks_like_exodus(std::span<const std::byte> head) {
  const auto starts_with = [&](std::string_view magic) {
    return head.size() >= magic.size() && std::memcmp(head.data(), magic.data(), magic.size()) == 0;
  };
  using namespace std::string_view_literals;
  return starts_with("CDF\x01"sv) || starts_with("CDF\x02"sv) || starts_with("CDF\x05"sv) ||
         starts_with("\x89HDF\r\n\x1a\n"sv);
}

std::unique_ptr<MeshSource> open_exodus(const std::string& path, Spool&) {
  return std::make_unique<ExodusMesh>(path);
}

}  // namespace shm::converters
