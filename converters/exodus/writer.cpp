#include <algorithm>
#include <cstring>
#include <limits>
#include <numeric>
#include <optional>
#include <set>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "base/failure.h"
#include "base/output_file.h"
#include "exodus/exodus.h"
#include "exodus/foreign.h"
#include "exodus/grouping.h"
#include "exodus/layout.h"
#include "exodus/netcdf.h"
#include "exodus/polyhedra.h"
#include "exodus/skeleton.h"

namespace shm::converters {
namespace {

using namespace exodus;

// Writes a mesh with its original netCDF structure. Uses netCDF without the Exodus library, because
// the Exodus library would add data that the original file did not have.
class SkeletonWriter {
 public:
  SkeletonWriter(MeshSource& mesh, const Skeleton& skeleton, const Layout& layout,
                 const ExtraIndex& extras, const Place& place, Spool& spool)
      : mesh_(mesh),
        info_(mesh.info()),
        skeleton_(skeleton),
        layout_(layout),
        extras_(extras),
        place_(place),
        grouping_(mesh, spool, true) {}
  ~SkeletonWriter() {
    if (ncid_ >= 0) nc_abort(ncid_);
  }
  SkeletonWriter(const SkeletonWriter&) = delete;
  SkeletonWriter& operator=(const SkeletonWriter&) = delete;

  void write() {
    check_values();
    ncid_ = create_file(skeleton_, place_);
    write_points();
    write_cells();
    if (has_derived_faces()) write_derived_faces();
    for (std::size_t a = 0; a < layout_.arrays.size(); ++a) write_array(a);
    for (std::size_t v = 0; v < skeleton_.variables.size(); ++v)
      if (layout_.uses[v] == Use::extra) write_list(v);
    place_.check(nc_close(std::exchange(ncid_, -1)), "closing it");
    clear_padding(place_.file);
  }

 private:
  void touch(int variable) { caches_.touch(ncid_, skeleton_, variable); }
  const Variable& variable(int index) const {
    return skeleton_.variables[static_cast<std::size_t>(index)];
  }
  std::string section(int index) const { return "variable '" + variable(index).name + "'"; }

  // Returns the extras that store a variable, in the order of its rows. Returns an empty list if
  // the variable is derived from the rest of the mesh.
  std::vector<const Extra*> extras_of(const Variable& one) const {
    std::string key = extra_key(one.name);
    if (extras_.find(key) == nullptr) key = plain_key(one.name);
    std::vector<const Extra*> parts;
    const std::size_t most = rows_of_parts(skeleton_, one).size() - 1;
    for (const Extra* part = nullptr;
         parts.size() < most && (part = extras_.find(part_key(key, parts.size()))) != nullptr;)
      parts.push_back(part);
    return parts;
  }

  // Throws Failure if the mesh does not contain the values of a variable. Called before the file is
  // created.
  void check_values() const {
    std::set<std::string_view> names;
    for (std::size_t v = 0; v < skeleton_.variables.size(); ++v) {
      const Variable& one = skeleton_.variables[v];
      if (!names.insert(one.name).second)
        place_.fail(ErrorCode::corrupt, "variable '" + one.name + "'", "is there twice");
      if (layout_.uses[v] != Use::extra || skeleton_.size(one) == 0) continue;
      const auto parts = extras_of(one);
      const auto rows = rows_of_parts(skeleton_, one);
      if (parts.size() + 1 != rows.size() &&
          (!parts.empty() || !derived_values(skeleton_, layout_, v, info_, extras_)))
        place_.fail(ErrorCode::corrupt, "variable '" + one.name + "'",
                    "the mesh has no values for it");
      const std::uint64_t row = skeleton_.size(one) / std::max<std::uint64_t>(rows.back(), 1);
      for (std::size_t i = 0; i < parts.size(); ++i)
        check_part(one, *parts[i], (rows[i + 1] - rows[i]) * row);
    }
  }
  void check_part(const Variable& one, const Extra& extra, std::uint64_t size) const {
    const ScalarType type = extra.refers == Reference::nothing
                                ? scalar_of(one.type)
                                : reference_type(scalar_of(one.type));
    const std::size_t bytes = scalar_bytes(type);
    const auto zeros =
        static_cast<std::uint64_t>(std::count(extra.data.begin(), extra.data.end(), std::byte{0}));
    const bool fits = one.type == NC_STRING
                          ? zeros == size && extra.data.back() == std::byte{0}
                          : extra.data.size() / bytes == size && extra.data.size() % bytes == 0;
    if (extra.type != type || !fits)
      place_.fail(ErrorCode::corrupt, "extra '" + extra.key + "'",
                  "its values do not fit variable '" + one.name + "'");
  }

  template <class Real>
  void write_points_as() {
    const auto put = [&](int v, const Slab& slab, const Real* values) {
      if constexpr (std::is_same_v<Real, float>)
        return nc_put_vara_float(ncid_, v, slab.start.data(), slab.count.data(), values);
      else
        return nc_put_vara_double(ncid_, v, slab.start.data(), slab.count.data(), values);
    };
    std::vector<Real> xyz, axis;
    for (std::uint64_t first = 0; first < info_.vertices; first += kPieceElements) {
      const std::uint64_t count = std::min(kPieceElements, info_.vertices - first);
      xyz.resize(3 * count);
      axis.resize(count);
      mesh_.read_points(first, count, reinterpret_cast<std::byte*>(xyz.data()));
      for (std::size_t c = 0; c < 3; ++c) {
        const int v = layout_.coordinates[c];
        if (v < 0) continue;
        touch(v);
        for (std::uint64_t i = 0; i < count; ++i) axis[i] = xyz[3 * i + c];
        Slab slab{{first}, {count}};
        if (layout_.coordinates_together) slab = {{c, first}, {1, count}};
        place_.check(put(v, slab, axis.data()), section(v));
      }
    }
  }
  void write_points() {
    if (info_.schema.coordinate_type == ScalarType::float32)
      write_points_as<float>();
    else
      write_points_as<double>();
  }

  void write_cells() {
    std::vector<std::uint64_t> next_node(layout_.blocks.size(), 0);
    std::vector<long long> nodes;
    grouping_.deal_cells(mesh_, [&](std::uint32_t b, std::uint64_t first, std::uint64_t cells,
                                    const std::vector<std::uint64_t>& corners,
                                    const std::vector<std::uint32_t>& sizes) {
      const BlockLayout& block = layout_.blocks[b];
      if (block.connectivity < 0 || block.faces >= 0) return;
      touch(block.connectivity);
      nodes.resize(corners.size());
      const auto places = exodus_permutation(block.elements());
      const std::size_t width = places.empty() ? 1 : places.size();
      for (std::size_t begin = 0; begin < corners.size(); begin += width)
        for (std::size_t i = 0; i < width; ++i)
          nodes[begin + (places.empty() ? i : places[i])] =
              static_cast<long long>(corners[begin + i]) + 1;
      Slab slab{{first}, {cells}};
      if (block.counts >= 0) {
        const std::vector<long long> counts(sizes.begin(), sizes.end());
        place_.check(nc_put_vara_longlong(ncid_, block.counts, slab.start.data(), slab.count.data(),
                                          counts.data()),
                     section(block.counts));
        if (corners.size() > skeleton_.size(variable(block.connectivity)) - next_node[b])
          place_.fail(ErrorCode::corrupt, section(block.connectivity),
                      "the mesh has more polygon nodes than the variable can hold");
        slab = {{next_node[b]}, {corners.size()}};
        next_node[b] += corners.size();
      } else if (variable(block.connectivity).dimensions.size() == 2) {
        slab = {{first, 0}, {cells, block.nodes_per_cell}};
      }
      if (!nodes.empty())
        place_.check(nc_put_vara_longlong(ncid_, block.connectivity, slab.start.data(),
                                          slab.count.data(), nodes.data()),
                     section(block.connectivity));
    });
  }

  void write_array(std::size_t index) {
    const ArrayLayout& array = layout_.arrays[index];
    const std::uint64_t steps = array.info.per_step ? layout_.steps : 1;
    const std::size_t stride = info_.array_stride(index);
    if (stride == 0 || array.parts.front().variable < 0) return;
    const auto put = [&](const ArrayPart& part, std::uint64_t step, std::uint64_t first,
                         std::uint64_t count, const std::byte* values) {
      const Slab slab = slab_of(skeleton_, array, part, step, first, count);
      touch(part.variable);
      place_.check(nc_put_vara(ncid_, part.variable, slab.start.data(), slab.count.data(), values),
                   section(part.variable));
    };
    for (std::uint64_t step = 0; step < steps; ++step) {
      if (array.info.location == Location::cell) {
        grouping_.deal_values(mesh_, index, step,
                              [&](std::uint32_t group, std::uint64_t first, std::uint64_t count,
                                  const std::byte* values) {
                                const ArrayPart& part = part_of(array, group);
                                if (part.block == ArrayPart::kEverything)
                                  first += grouping_.groups()[group].first_cell;
                                put(part, step, first, count, values);
                              });
        continue;
      }
      std::vector<std::byte> values;
      std::uint64_t begin = 0;
      for (const ArrayPart& part : array.parts) {
        const std::uint64_t elements = elements_of(layout_, array, part);
        for (std::uint64_t first = 0; first < elements; first += kPieceElements) {
          const std::uint64_t count = std::min(kPieceElements, elements - first);
          values.resize(count * stride);
          mesh_.read_array(index, step, begin + first, count, values.data());
          put(part, step, first, count, values.data());
        }
        begin += elements;
      }
    }
  }
  // Returns the part of `array` that contains the values of the cells of `block`. Precondition: the
  // array covers this block.
  static const ArrayPart& part_of(const ArrayLayout& array, std::uint32_t block) {
    if (array.parts.front().block == ArrayPart::kEverything) return array.parts.front();
    return *std::lower_bound(
        array.parts.begin(), array.parts.end(), block,
        [](const ArrayPart& part, std::uint32_t wanted) { return part.block < wanted; });
  }

  // Writes the values of a variable. The values come from its extras if these exist; otherwise they
  // are derived from the rest of the mesh.
  void write_list(std::size_t v) {
    const Variable& one = skeleton_.variables[v];
    if (skeleton_.size(one) == 0) return;
    const auto id = static_cast<int>(v);
    const auto rows = rows_of_parts(skeleton_, one);
    const auto parts = extras_of(one);
    touch(id);
    if (one.type == NC_STRING) return write_strings(id, parts.front()->data);
    if (parts.empty())
      return write_rows(id, 0, rows.back(), *derived_values(skeleton_, layout_, v, info_, extras_));
    for (const BlockLayout& block : layout_.blocks)
      if (block.faces == id && cells_moved(block)) return write_faces(block, parts);
    for (std::size_t i = 0; i < parts.size(); ++i)
      write_rows(id, rows[i], rows[i + 1] - rows[i],
                 parts[i]->refers == Reference::nothing
                     ? parts[i]->data
                     : counted_from_one(*parts[i], scalar_of(one.type)));
  }
  void write_rows(int id, std::uint64_t first, std::uint64_t count,
                  const std::vector<std::byte>& values) {
    const auto lengths = skeleton_.shape(variable(id));
    Slab slab{std::vector<std::size_t>(lengths.size(), 0), {lengths.begin(), lengths.end()}};
    if (!lengths.empty()) {
      slab.start[0] = first;
      slab.count[0] = count;
    }
    place_.check(nc_put_vara(ncid_, id, slab.start.data(), slab.count.data(), values.data()),
                 section(id));
  }
  // Writes a variable of strings. `values` contains all strings, each terminated by a zero byte.
  void write_strings(int id, const std::vector<std::byte>& values) {
    const auto lengths = skeleton_.shape(variable(id));
    const std::vector<std::size_t> start(lengths.size(), 0), count(lengths.begin(), lengths.end());
    std::vector<const char*> texts;
    const auto* text = reinterpret_cast<const char*>(values.data());
    for (std::uint64_t i = 0; i < skeleton_.size(variable(id)); ++i) {
      texts.push_back(text);
      text += std::strlen(text) + 1;
    }
    place_.check(nc_put_vara_string(ncid_, id, start.data(), count.data(), texts.data()),
                 section(id));
  }

  // Returns the values of an array on the cells of a block, in the cell order of the new file.
  // `variable_of_array` is the index of the variable that stores the array. The array must have one
  // integer per cell.
  std::vector<std::int64_t> numbers_on(std::uint32_t block, int variable_of_array) {
    std::vector<std::int64_t> numbers(layout_.blocks[block].cells);
    for (std::size_t a = 0; a < layout_.arrays.size(); ++a) {
      const ArrayLayout& array = layout_.arrays[a];
      if (array.parts.front().block != block || array.parts.front().variable != variable_of_array ||
          array.info.components != 1 || array.info.per_step)
        continue;
      grouping_.deal_values(
          mesh_, a, 0,
          [&](std::uint32_t, std::uint64_t first, std::uint64_t count, const std::byte* values) {
            const auto some = integers_of(array.info.type,
                                          {values, values + count * scalar_bytes(array.info.type)});
            if (some)
              std::copy(some->begin(), some->end(),
                        numbers.begin() + static_cast<std::ptrdiff_t>(first));
          });
    }
    return numbers;
  }
  std::uint32_t index_of(const BlockLayout& block) const {
    return static_cast<std::uint32_t>(&block - layout_.blocks.data());
  }
  bool cells_moved(const BlockLayout& block) {
    const auto from = numbers_on(index_of(block), -1);
    return !std::is_sorted(from.begin(), from.end());
  }

  bool has_derived_faces() const {
    return std::any_of(layout_.blocks.begin(), layout_.blocks.end(), [](const BlockLayout& block) {
      return block.faces >= 0 && block.shape == CellShape::faces;
    });
  }

  [[noreturn]] void fail_faces(std::string detail) const {
    place_.fail(ErrorCode::corrupt, "face blocks", std::move(detail));
  }

  // Nodes of the cells of a block, in the cell order of the new file. ends[i] is the index in
  // `nodes` at which cell i ends.
  struct BlockCells {
    std::vector<std::uint64_t> nodes, ends;
  };
  // Derives the face blocks and the lists of faces of the polyhedra from the cells (polyhedra.h),
  // and writes them.
  void write_derived_faces() {
    std::vector<BlockCells> cells(layout_.blocks.size());
    grouping_.deal_cells(mesh_, [&](std::uint32_t b, std::uint64_t, std::uint64_t,
                                    const std::vector<std::uint64_t>& corners,
                                    const std::vector<std::uint32_t>& sizes) {
      if (layout_.blocks[b].faces < 0) return;
      BlockCells& block = cells[b];
      block.nodes.insert(block.nodes.end(), corners.begin(), corners.end());
      for (const std::uint32_t size : sizes)
        block.ends.push_back((block.ends.empty() ? 0 : block.ends.back()) + size);
    });
    std::vector<std::vector<std::vector<std::uint64_t>>> faces_of(layout_.blocks.size());
    FaceTable faces;
    std::vector<std::uint32_t> uses;
    for (std::uint32_t b = 0; b < layout_.blocks.size(); ++b)
      if (layout_.blocks[b].faces >= 0)
        faces_of[b] = find_faces(layout_.blocks[b], cells[b], faces, uses);
    const std::vector<long long> numbers = face_numbers(uses);
    write_face_blocks(faces, numbers);
    for (std::uint32_t b = 0; b < layout_.blocks.size(); ++b) {
      std::vector<long long> all, counts;
      for (const auto& cell : faces_of[b]) {
        counts.push_back(static_cast<long long>(cell.size()));
        for (const std::uint64_t face : cell) all.push_back(numbers[face]);
      }
      if (layout_.blocks[b].faces < 0) continue;
      put_integers(layout_.blocks[b].faces, all);
      put_integers(layout_.blocks[b].counts, counts);
    }
  }

  // Returns the faces of each cell of a block, in the cell order of the new file. Faces are
  // numbered in the order in which the cells of the original file first use them.
  std::vector<std::vector<std::uint64_t>> find_faces(const BlockLayout& block,
                                                     const BlockCells& cells, FaceTable& faces,
                                                     std::vector<std::uint32_t>& uses) {
    const auto from = numbers_on(index_of(block), -1);
    std::vector<std::size_t> order(cells.ends.size());
    std::iota(order.begin(), order.end(), std::size_t{0});
    if (from.size() == order.size())
      std::stable_sort(order.begin(), order.end(),
                       [&](std::size_t a, std::size_t b) { return from[a] < from[b]; });
    std::vector<std::vector<std::uint64_t>> found(cells.ends.size());
    for (const std::size_t c : order) {
      const auto end = cells.nodes.begin() + static_cast<std::ptrdiff_t>(cells.ends[c]);
      auto it = cells.nodes.begin() + static_cast<std::ptrdiff_t>(c == 0 ? 0 : cells.ends[c - 1]);
      while (it != end) {
        const auto closed = std::find(it + 1, end, *it);
        if (closed == end) fail_faces("a face of a polyhedron does not end with its first node");
        const std::uint64_t face = faces.number_of(std::span(it, closed));
        uses.resize(faces.size());
        ++uses[face];
        found[c].push_back(face);
        it = closed + 1;
      }
    }
    return found;
  }

  // Returns the number that each face has in the file. Numbers start at 1. Throws Failure if a
  // number is too large or occurs twice.
  std::vector<long long> face_numbers(const std::vector<std::uint32_t>& uses) const {
    const auto places = face_places(uses, extras_.find(kSharedFirst) != nullptr);
    const Extra* extra = extras_.find(kFaceNumbers);
    std::optional<std::vector<std::int64_t>> own;
    if (extra != nullptr) own = integers_of(extra->type, extra->data);
    if (extra != nullptr && (!own || own->size() != uses.size()))
      fail_faces("the mesh does not have a number for each face");
    std::vector<long long> numbers;
    std::vector<bool> taken(uses.size(), false);
    for (const std::uint64_t place : places) {
      const std::int64_t number = own ? (*own)[place] : static_cast<std::int64_t>(place) + 1;
      if (number < 1 || std::cmp_greater(number, uses.size()) ||
          taken[static_cast<std::size_t>(number) - 1])
        fail_faces("two faces have the same number, or a number is too large");
      taken[static_cast<std::size_t>(number) - 1] = true;
      numbers.push_back(number);
    }
    return numbers;
  }

  void write_face_blocks(const FaceTable& faces, const std::vector<long long>& numbers) {
    const std::vector<FaceBlock> blocks = face_blocks(skeleton_, place_);
    std::uint64_t total = 0;
    for (const FaceBlock& block : blocks) total += block.faces;
    if (total != faces.size())
      fail_faces("polyhedra have " + std::to_string(faces.size()) + " faces, not " +
                 std::to_string(total));
    std::vector<std::uint64_t> by_number(total);
    for (std::uint64_t f = 0; f < total; ++f)
      by_number[static_cast<std::size_t>(numbers[f]) - 1] = f;
    std::uint64_t next = 0;
    for (const FaceBlock& block : blocks) {
      std::vector<long long> nodes, counts;
      for (const std::uint64_t end = next + block.faces; next < end; ++next) {
        const auto face = faces.nodes(by_number[next]);
        if (block.counts < 0 && face.size() != block.size)
          fail_faces("a face has " + std::to_string(face.size()) +
                     " nodes in a block of faces of " + std::to_string(block.size));
        counts.push_back(static_cast<long long>(face.size()));
        for (const std::uint64_t node : face) nodes.push_back(static_cast<long long>(node) + 1);
      }
      put_integers(block.nodes, nodes);
      if (block.counts >= 0) put_integers(block.counts, counts);
    }
  }

  // Writes all values of an integer variable.
  void put_integers(int id, const std::vector<long long>& values) {
    if (values.size() != skeleton_.size(variable(id)))
      place_.fail(ErrorCode::corrupt, section(id),
                  "can hold " + std::to_string(skeleton_.size(variable(id))) +
                      " numbers, but the mesh has " + std::to_string(values.size()));
    touch(id);
    if (!values.empty()) place_.check(nc_put_var_longlong(ncid_, id, values.data()), section(id));
  }

  // Writes the lists of faces of the polyhedra of a block, in the cell order of the new file.
  void write_faces(const BlockLayout& block, const std::vector<const Extra*>& parts) {
    const auto from = numbers_on(index_of(block), -1);
    const auto counts = numbers_on(index_of(block), block.counts);
    const std::size_t width = scalar_bytes(parts.front()->type);
    std::vector<std::byte> faces;
    for (const Extra* part : parts) faces.insert(faces.end(), part->data.begin(), part->data.end());
    const std::uint64_t size = faces.size() / width;
    const auto wrong = [&] {
      place_.fail(ErrorCode::corrupt, section(block.faces),
                  "the faces of each polyhedron are unknown");
    };
    // begins[i] is the index in `faces` at which the faces of cell i begin. Cells are numbered as
    // in the original file.
    std::vector<std::uint64_t> begins(from.size() + 1, 0);
    for (std::size_t i = 0; i < from.size(); ++i) {
      if (from[i] < 0 || std::cmp_greater_equal(from[i], from.size()) || counts[i] < 0 ||
          std::cmp_greater(counts[i], size))
        wrong();
      begins[static_cast<std::size_t>(from[i]) + 1] = static_cast<std::uint64_t>(counts[i]);
    }
    std::partial_sum(begins.begin(), begins.end(), begins.begin());
    if (begins.back() != size) wrong();
    std::vector<std::byte> moved;
    for (const std::int64_t cell : from) {
      const auto i = static_cast<std::size_t>(cell);
      moved.insert(moved.end(), faces.begin() + static_cast<std::ptrdiff_t>(begins[i] * width),
                   faces.begin() + static_cast<std::ptrdiff_t>(begins[i + 1] * width));
    }
    if (moved.size() != faces.size()) wrong();
    write_rows(block.faces, 0, size, moved);
  }

  // Converts the vertex or cell references in an extra to the vertex or cell numbers used in the
  // file. These numbers start at 1 and have the type `stored`; cells are numbered block by block.
  std::vector<std::byte> counted_from_one(const Extra& extra, ScalarType stored) {
    const bool cells = extra.refers == Reference::cell;
    const std::uint64_t count = cells ? info_.cells() : info_.vertices;
    std::vector<std::byte> values;
    const auto numbers = integers_of(extra.type, extra.data);
    for (std::int64_t number : *numbers) {
      const bool known = number < 0 || std::cmp_less(number, count);
      if (known && cells && number >= 0)
        number = static_cast<std::int64_t>(grouping_.position(static_cast<std::uint64_t>(number)));
      if (!known || !append_integer(values, stored, number + 1))
        place_.fail(ErrorCode::corrupt, "extra '" + extra.key + "'",
                    "refers to number " + std::to_string(number) + " of " + std::to_string(count));
    }
    return values;
  }

  MeshSource& mesh_;
  const MeshInfo& info_;
  const Skeleton& skeleton_;
  const Layout& layout_;
  const ExtraIndex& extras_;
  const Place& place_;
  CellGrouping grouping_;
  int ncid_ = -1;
  ChunkCaches caches_;
};

// If the cells of a block have fewer nodes in the mesh than the connectivity of the block has
// columns, changes the layout so that only the first columns, one per node, are nodes.
void narrow_as(const MeshInfo& info, const Skeleton& skeleton, Layout& layout) {
  const std::size_t count = std::min(info.schema.blocks.size(), layout.blocks.size());
  for (std::uint32_t b = 0; b < count; ++b) {
    const BlockLayout& block = layout.blocks[b];
    const std::uint32_t nodes = info.schema.blocks[b].nodes_per_cell;
    const bool rows = block.shape == CellShape::other && block.connectivity >= 0;
    if (rows && nodes > 0 && nodes < block.nodes_per_cell)
      narrow_connectivity(skeleton, layout, b, nodes);
  }
}

// Returns true if the mesh has polyhedra, and all its blocks of polyhedra have the shape `faces`.
bool has_faces(const MeshInfo& info, const Layout& layout) {
  bool any = false, all = true;
  for (std::size_t b = 0; b < std::min(info.schema.blocks.size(), layout.blocks.size()); ++b) {
    if (layout.blocks[b].faces < 0) continue;
    any = true;
    all = all && info.schema.blocks[b].shape == CellShape::faces;
  }
  return any && all;
}

// Returns true if the counts, types and arrays of the mesh still match the structure of the file.
bool fits(const MeshInfo& info, const Layout& layout) {
  const Schema& schema = info.schema;
  if (info.vertices != layout.vertices || info.step_times.size() != layout.steps ||
      schema.coordinate_type != layout.coordinate_type ||
      schema.blocks.size() != layout.blocks.size() || schema.arrays.size() != layout.arrays.size())
    return false;
  for (std::size_t b = 0; b < layout.blocks.size(); ++b)
    if (schema.blocks[b].shape != layout.blocks[b].shape ||
        schema.blocks[b].scheme != layout.blocks[b].scheme ||
        schema.blocks[b].nodes_per_cell != layout.blocks[b].nodes_per_cell ||
        info.block_cells[b] != layout.blocks[b].cells)
      return false;
  for (std::size_t a = 0; a < layout.arrays.size(); ++a) {
    ArrayInfo bare = schema.arrays[a];
    bare.name = layout.arrays[a].info.name;
    bare.quantization = {};
    if (bare != layout.arrays[a].info) return false;
  }
  return true;
}

}  // namespace

void write_exodus(MeshSource& mesh, const std::string& path) {
  const MeshInfo& info = mesh.info();
  const Place place{path, ErrorCode::output};
  Spool spool(OutputFile::folder_of(path), std::size_t{8} << 20);
  const ExtraIndex extras(info.extras);
  const Extra* text = extras.find("exodus/skeleton");
  if (info.schema.source_format == "exodus" && text != nullptr) {
    const Skeleton skeleton =
        from_text({reinterpret_cast<const char*>(text->data.data()), text->data.size()}, place);
    const auto& arrays = info.schema.arrays;
    const bool beside_mesh = std::any_of(arrays.begin(), arrays.end(), [](const ArrayInfo& array) {
      return !is_on_mesh(array.location);
    });
    Layout layout = lay_out(skeleton, place, beside_mesh);
    narrow_as(info, skeleton, layout);
    if (has_faces(info, layout)) derive_faces(skeleton, layout, place);
    if (fits(info, layout)) {
      SkeletonWriter(mesh, skeleton, layout, extras, place, spool).write();
      return;
    }
  }
  write_foreign(mesh, path, spool);
}

}  // namespace shm::converters
