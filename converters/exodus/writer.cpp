#include <netcdf.h>

#include <algorithm>
#include <cstring>
#include <limits>
#include <numeric>
#include <optional>
#include <set>
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
#include "exodus/skeleton.h"

namespace shm::converters {
namespace {

using namespace exodus;

// A mesh with the netCDF structure that it came with. Written through netCDF alone: opening a file
// for writing, the Exodus library adds to old ones what they did not have.
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

  // The extras that carry a variable, one after the other; none when it follows from the rest.
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

  // Whatever is missing is reported before anything is written.
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
      const auto places = node_places(block.shape, block.nodes_per_cell);
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
                      "the mesh has more polygon nodes than it has room for");
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
      for (std::uint64_t first = 0; first < info_.vertices; first += kPieceElements) {
        const std::uint64_t count = std::min(kPieceElements, info_.vertices - first);
        values.resize(count * stride);
        mesh_.read_array(index, step, first, count, values.data());
        put(array.parts.front(), step, first, count, values.data());
      }
    }
  }
  // The part of an array that has the cells of `block`, which it covers.
  static const ArrayPart& part_of(const ArrayLayout& array, std::uint32_t block) {
    if (array.parts.front().block == ArrayPart::kEverything) return array.parts.front();
    return *std::lower_bound(
        array.parts.begin(), array.parts.end(), block,
        [](const ArrayPart& part, std::uint32_t wanted) { return part.block < wanted; });
  }

  // Extras, or what follows from the rest of the mesh.
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
  // Texts, each ended by a zero.
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

  // Values of a one-component integer array on one block, in the order of the new file.
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

  // The faces of polyhedra that have changed places.
  void write_faces(const BlockLayout& block, const std::vector<const Extra*>& parts) {
    const auto from = numbers_on(index_of(block), -1);
    const auto counts = numbers_on(index_of(block), block.counts);
    const std::size_t width = scalar_bytes(parts.front()->type);
    std::vector<std::byte> faces;
    for (const Extra* part : parts) faces.insert(faces.end(), part->data.begin(), part->data.end());
    const std::uint64_t size = faces.size() / width;
    const auto wrong = [&] {
      place_.fail(ErrorCode::corrupt, section(block.faces),
                  "it is not known which faces belong to which polyhedron");
    };
    // begins[i]: of the cell that was the i-th
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

  // References as the file has them: from 1, of type `stored`, cells block by block.
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

// The mesh knows which columns of a connectivity are nodes.
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

// Whether the mesh still has the parts that the structure lists.
bool fits(const MeshInfo& info, const Layout& layout) {
  const Schema& schema = info.schema;
  if (info.vertices != layout.vertices || info.step_times.size() != layout.steps ||
      schema.coordinate_type != layout.coordinate_type ||
      schema.blocks.size() != layout.blocks.size() || schema.arrays.size() != layout.arrays.size())
    return false;
  for (std::size_t b = 0; b < layout.blocks.size(); ++b)
    if (schema.blocks[b].shape != layout.blocks[b].shape ||
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
    Layout layout = lay_out(skeleton, place);
    narrow_as(info, skeleton, layout);
    if (fits(info, layout)) {
      SkeletonWriter(mesh, skeleton, layout, extras, place, spool).write();
      return;
    }
  }
  write_foreign(mesh, path, spool);
}

}  // namespace shm::converters
