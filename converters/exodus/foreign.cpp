#include "exodus/foreign.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <limits>
#include <map>
#include <set>
#include <utility>
#include <vector>

#include "base/failure.h"
#include "base/stored_value.h"
#include "exodus/exodus.h"
#include "exodus/grouping.h"
#include "exodus/layout.h"
#include "exodus/netcdf.h"
#include "mesh/mesh_source.h"
#include "sets/transfer_sets.h"

namespace shm::converters::exodus {
namespace {

// Returns the largest block id and the largest set id that are written unchanged. Larger block ids
// are reserved for blocks that need new ids. `is_wide` is true if the file has 64-bit integers.
Capabilities::MostNumbers most_numbers_of(bool is_wide) {
  constexpr std::int64_t kMost = std::numeric_limits<std::int64_t>::max() / 2;
  constexpr std::int64_t kNarrow = std::numeric_limits<std::int32_t>::max();
  return is_wide ? Capabilities::MostNumbers{kMost, kMost}
                 : Capabilities::MostNumbers{kNarrow / 2, kNarrow};
}

// Maximum size in bytes of a variable in a 64-bit offset file, slightly less than 4 GiB. For record
// variables, the limit applies to each record.
constexpr std::uint64_t kMostVariableBytes = (std::uint64_t{1} << 32) - 4;
constexpr std::size_t kShortNames = 32;  // longest name that every reader supports

// One component of an array of the mesh, which becomes a nodal or element variable of the file.
struct Column {
  std::size_t array;
  std::uint32_t component;
  std::string name;
};

// Returns true if a 32-bit float can represent all values of the type. This is true for float32 and
// for integers of at most 2 bytes.
bool fits_float(ScalarType type) { return type == ScalarType::float32 || scalar_bytes(type) <= 2; }

bool is_float_value(double value) {
  constexpr double kMost = std::numeric_limits<float>::max();
  return std::fabs(value) <= kMost && double{static_cast<float>(value)} == value;
}

template <class Real>
Real real_at(const std::byte* from, ScalarType type) {
  return with_scalar(type, [from](auto value) {
    std::memcpy(&value, from, sizeof value);
    return static_cast<Real>(value);
  });
}

// Returns the element type of the cells of a block with `nodes` nodes. `any_size`: true if the mesh
// came from an Exodus file, so that the nodes have the order of Exodus even if their number is
// unusual.
std::string element_type(BlockInfo block, std::uint32_t nodes, bool any_size) {
  block.nodes_per_cell = nodes;
  const auto sized = [nodes](const char* family) { return family + std::to_string(nodes); };
  switch (any_size || has_element_type(block) ? block.shape : CellShape::other) {
    case CellShape::vertex: return "SPHERE";
    case CellShape::line: return sized("BAR");
    case CellShape::triangle: return sized("TRI");
    case CellShape::quad: return sized("QUAD");
    case CellShape::polygon: return "NSIDED";
    case CellShape::tetrahedron: return sized("TETRA");
    case CellShape::pyramid: return sized("PYRAMID");
    case CellShape::wedge: return sized("WEDGE");
    case CellShape::hexahedron: return sized("HEX");
    case CellShape::polyhedron:
    case CellShape::faces:
    case CellShape::other: break;
  }
  return sized("OTHER");
}

bool is_polyhedron(CellShape shape) {
  return shape == CellShape::polyhedron || shape == CellShape::faces;
}

// Returns pointers to the names. The Exodus library requires pointers to non-const characters, but
// does not change the characters.
std::vector<char*> pointers(std::vector<std::string>& names) {
  std::vector<char*> list;
  for (std::string& name : names) list.push_back(name.data());
  return list;
}

// Finds numbers that are not used yet, and marks them as used.
class FreeNumbers {
 public:
  // Returns the first unused number that is not less than `wanted`.
  std::int64_t take(std::int64_t wanted) {
    std::vector<std::int64_t> passed;
    std::int64_t number = wanted;
    for (auto found = next_.find(number); found != next_.end(); found = next_.find(number)) {
      passed.push_back(number);
      number = found->second;
    }
    next_[number] = number + 1;
    // Later searches continue after these numbers.
    for (const std::int64_t taken : passed) next_[taken] = number + 1;
    return number;
  }

 private:
  // Maps each used number n to a larger number m. All numbers from n to m - 1 are used, so the
  // search for an unused number continues at m.
  std::map<std::int64_t, std::int64_t> next_;
};

// Returns the sets of the mesh. The Exodus library accepts either one distribution factor per
// member, or one per node of each side. If a set has any other number of factors, the factors are
// dropped.
std::vector<MeshSet> sets_to_write(const MeshInfo& info) {
  std::vector<MeshSet> sets = sets_of_extras(info);
  for (MeshSet& set : sets)
    if (!has_usual_factors(set)) set.factors.clear();
  return sets;
}

// Largest number of global variables, and of variables of one kind of set.
constexpr std::size_t kMostBesideMesh = 1 << 14;

class ForeignWriter {
 public:
  // Returns true if a number map of the mesh has 64-bit integers, so that the file needs them too.
  static bool has_wide_maps(const MeshInfo& info) {
    return std::any_of(
        info.schema.arrays.begin(), info.schema.arrays.end(), [](const ArrayInfo& array) {
          return array.type == ScalarType::int64 && (is_map(array) || is_original_map(array));
        });
  }

  ForeignWriter(MeshSource& mesh, const std::string& path, Spool& spool)
      : mesh_(mesh),
        info_(mesh.info()),
        place_{path, ErrorCode::output},
        grouping_(mesh, spool, false),
        sets_(sets_to_write(info_)) {}
  ~ForeignWriter() {
    if (exoid_ >= 0) ex_close(exoid_);
  }
  ForeignWriter(const ForeignWriter&) = delete;
  ForeignWriter& operator=(const ForeignWriter&) = delete;

  void write() {
    check_counts();
    check_cells();
    choose_columns();
    choose_sizes();
    create();
    define_blocks();
    define_sets();
    define_original_maps();
    define_variables(EX_NODAL, nodal_);
    define_variables(EX_ELEM_BLOCK, element_);
    for (const auto& [location, columns] : beside_mesh_) define_beside_mesh(location, columns);
    if (real_bytes_ == 4)
      write_values<float>();
    else
      write_values<double>();
    check(ex_close(std::exchange(exoid_, -1)), "closing it");
    clear_padding(place_.file);
  }

 private:
  const BlockInfo& block_of(const CellGroup& group) const {
    return info_.schema.blocks[group.block];
  }
  bool is_polygons(const CellGroup& group) const {
    return block_of(group).shape == CellShape::polygon;
  }
  void check(int status, const std::string& section) const {
    if (status < 0) place_.fail(ErrorCode::output, section, "the Exodus library fails to write it");
  }

  // Throws Failure if there are too many blocks and sets. The Exodus library rewrites the header of
  // the file for each block and set. With kMost blocks and sets, this takes a few minutes.
  void check_counts() const {
    constexpr std::size_t kMost = 1 << 14;
    const std::size_t count = grouping_.groups().size() + sets_.size();
    if (count > kMost)
      place_.fail(ErrorCode::over_limit, "blocks and sets",
                  "there are " + std::to_string(count) + "; " + std::to_string(kMost) +
                      " is the maximum for Exodus");
  }
  void check_cells() const {
    for (const CellGroup& group : grouping_.groups())
      if (is_polyhedron(block_of(group).shape) && group.cells > 0)
        place_.fail(ErrorCode::unsupported, "block " + std::to_string(block_of(group).id),
                    "polyhedra can be written to Exodus only if they came from an Exodus file");
  }

  // Returns true if the array has one integer per node or element.
  static bool is_of_numbers(const ArrayInfo& array) {
    return array.components == 1 && !array.per_step && array.blocks.empty() &&
           (array.type == ScalarType::int32 || array.type == ScalarType::int64);
  }
  static bool is_map(const ArrayInfo& array) {
    return is_of_numbers(array) &&
           ((array.role == kExodusMaps.vertices_role && array.location == Location::point) ||
            (array.role == kExodusMaps.cells_role && array.location == Location::cell));
  }
  static bool is_original_map(const ArrayInfo& array) {
    return is_of_numbers(array) && array.role == kExodusMaps.original_role;
  }

  void choose_columns() {
    for (std::size_t a = 0; a < info_.schema.arrays.size(); ++a) {
      const ArrayInfo& array = info_.schema.arrays[a];
      if (is_map(array) || is_original_map(array)) maps_.push_back(a);
      if (!array.role.empty()) continue;
      auto& columns = array.location == Location::point  ? nodal_
                      : array.location == Location::cell ? element_
                                                         : beside_mesh_[array.location];
      // Each element of a global array has variables of its own.
      const std::uint64_t all =
          array.components * (array.location == Location::global ? array.elements : 1);
      for (std::uint32_t c = 0; c < all; ++c) {
        std::string name = array.name;
        if (all == 2 || all == 3)
          name += std::string("_") + "xyz"[c];
        else if (all > 1)
          name += "_" + std::to_string(c + 1);
        columns.push_back({a, c, name.substr(0, kLongestName)});
      }
    }
    times_ = info_.step_times;
    if (times_.empty() && (!nodal_.empty() || !element_.empty())) times_ = {0.0};
    for (const auto& [location, columns] : beside_mesh_)
      if (columns.size() > kMostBesideMesh)
        place_.fail(ErrorCode::over_limit, "variables",
                    "there are " + std::to_string(columns.size()) + " global or set variables");
  }

  void choose_sizes() {
    bool small = info_.schema.coordinate_type == ScalarType::float32;
    for (const ArrayInfo& array : info_.schema.arrays)
      small &= !array.role.empty() || fits_float(array.type);
    for (const MeshSet& set : sets_)
      small &= std::all_of(set.factors.begin(), set.factors.end(), is_float_value);
    real_bytes_ = small ? 4 : 8;
    std::uint64_t largest = info_.vertices * static_cast<std::uint64_t>(real_bytes_);
    std::uint64_t most = std::max(info_.vertices, info_.cells());
    for (const CellGroup& group : grouping_.groups()) {
      largest = std::max(
          {largest, group.nodes * 4, group.cells * static_cast<std::uint64_t>(real_bytes_)});
      most = std::max(most, group.nodes);
    }
    wide_ = most > std::numeric_limits<std::int32_t>::max() || has_wide_maps(info_);
    netcdf4_ = wide_ || largest > kMostVariableBytes;
  }

  void create() {
    open_netcdf(place_.file, ErrorCode::output);
    open_exodus_library(place_.file, ErrorCode::output);
    ex_opts(0);  // otherwise the library prints messages
    int memory_bytes = real_bytes_, file_bytes = real_bytes_;
    int mode = EX_CLOBBER | EX_ALL_INT64_API | (netcdf4_ ? EX_NETCDF4 : EX_LARGE_MODEL);
    if (wide_) mode |= EX_ALL_INT64_DB;
    exoid_ = ex_create(place_.file.c_str(), mode, &memory_bytes, &file_bytes);
    if (exoid_ < 0) place_.fail(ErrorCode::output, "creating it", "the Exodus library refuses");

    std::size_t longest = kShortNames;
    const auto lengthen = [&](const std::vector<Column>& columns) {
      for (const Column& column : columns) longest = std::max(longest, column.name.size());
    };
    lengthen(nodal_);
    lengthen(element_);
    for (const auto& [location, columns] : beside_mesh_) lengthen(columns);
    for (const MeshSet& set : sets_)
      longest = std::max(longest, std::min(set.name.size(), kLongestName));
    for (const BlockInfo& block : info_.schema.blocks)
      longest = std::max(longest, std::min(block.name.size(), kLongestName));
    check(ex_set_max_name_length(exoid_, static_cast<int>(longest)), "creating it");

    ex_init_params parameters{};
    std::string title = info_.schema.source_format.empty()
                            ? std::string("mesh")
                            : "mesh from " + info_.schema.source_format;
    if (const Extra* given = find_extra(info_, "mesh/title")) title = text_of_extra(*given);
    std::strncpy(parameters.title, title.c_str(), MAX_LINE_LENGTH);
    parameters.num_dim = 3;
    parameters.num_nodes = static_cast<std::int64_t>(info_.vertices);
    parameters.num_elem = static_cast<std::int64_t>(info_.cells());
    parameters.num_elem_blk = static_cast<std::int64_t>(grouping_.groups().size());
    for (const MeshSet& set : sets_) {
      auto& count = set.kind == MeshSet::Kind::nodes   ? parameters.num_node_sets
                    : set.kind == MeshSet::Kind::sides ? parameters.num_side_sets
                                                       : parameters.num_elem_sets;
      ++count;
    }
    check(ex_put_init_ext(exoid_, &parameters), "dimensions");
    std::vector<std::string> axes{"x", "y", "z"};
    check(ex_put_coord_names(exoid_, pointers(axes).data()), "coordinate names");
  }

  // Chooses the ids of the element blocks. A block keeps its id if it is positive, not too large,
  // and not used by an earlier block; otherwise it gets a new id.
  void choose_ids() {
    const std::int64_t most = most_numbers_of(wide_).block;
    std::int64_t highest = 0;
    for (const BlockInfo& block : info_.schema.blocks)
      if (block.id <= most) highest = std::max(highest, block.id);
    std::set<std::int64_t> taken;
    for (const CellGroup& group : grouping_.groups()) {
      std::int64_t id = block_of(group).id;
      if (id < 1 || id > most || taken.contains(id)) id = ++highest;
      taken.insert(id);
      ids_.push_back(id);
    }
  }

  void define_blocks() {
    choose_ids();
    std::vector<std::string> names;
    bool named = false;
    for (std::size_t g = 0; g < ids_.size(); ++g) {
      const CellGroup& group = grouping_.groups()[g];
      const BlockInfo& block = block_of(group);
      const std::string section = "element block " + std::to_string(ids_[g]);
      const std::uint64_t nodes = is_polygons(group) ? group.nodes : group.nodes_per_cell;
      check(ex_put_block(
                exoid_, EX_ELEM_BLOCK, ids_[g],
                element_type(block, group.nodes_per_cell, info_.schema.source_format == "exodus")
                    .c_str(),
                static_cast<std::int64_t>(group.cells), static_cast<std::int64_t>(nodes), 0, 0, 0),
            section);
      names.push_back(block.name.substr(0, kLongestName));
      named |= !block.name.empty();
    }
    if (named) check(ex_put_names(exoid_, EX_ELEM_BLOCK, pointers(names).data()), "block names");
  }

  static ex_entity_type kind_of(const MeshSet& set) {
    return set.kind == MeshSet::Kind::nodes   ? EX_NODE_SET
           : set.kind == MeshSet::Kind::sides ? EX_SIDE_SET
                                              : EX_ELEM_SET;
  }

  void define_sets() {
    const std::int64_t most = most_numbers_of(wide_).set;
    std::map<ex_entity_type, FreeNumbers> free;
    std::map<ex_entity_type, std::int64_t> highest;
    for (const MeshSet& set : sets_)
      if (set.id <= most) highest[kind_of(set)] = std::max(highest[kind_of(set)], set.id);
    for (const MeshSet& set : sets_) {
      const ex_entity_type kind = kind_of(set);
      const std::int64_t after = highest[kind] < most ? highest[kind] + 1 : 1;
      const std::int64_t id =
          free[kind].take(set.id > most ? after : std::max<std::int64_t>(set.id, 1));
      set_ids_.push_back(id);
      check(ex_put_set_param(exoid_, kind, id, static_cast<std::int64_t>(set.members.size()),
                             static_cast<std::int64_t>(set.factors.size())),
            label_of(set));
      if (!set.name.empty())
        check(ex_put_name(exoid_, kind, id, set.name.substr(0, kLongestName).c_str()),
              label_of(set));
    }
  }

  template <class Real>
  void write_sets() {
    for (std::size_t s = 0; s < sets_.size(); ++s) {
      const MeshSet& set = sets_[s];
      if (set.members.empty()) continue;
      std::vector<std::int64_t> members;
      for (const std::uint64_t member : set.members)
        members.push_back(1 + static_cast<std::int64_t>(set.kind == MeshSet::Kind::nodes
                                                            ? member
                                                            : grouping_.position(member)));
      const std::vector<std::int64_t> sides(set.sides.begin(), set.sides.end());
      check(ex_put_set(exoid_, kind_of(set), set_ids_[s], members.data(),
                       sides.empty() ? nullptr : sides.data()),
            label_of(set));
      if (set.factors.empty()) continue;
      std::vector<Real> factors;
      for (const double factor : set.factors) factors.push_back(static_cast<Real>(factor));
      check(ex_put_set_dist_fact(exoid_, kind_of(set), set_ids_[s], factors.data()), label_of(set));
    }
  }

  void name_variables(ex_entity_type kind, const std::vector<Column>& columns,
                      const std::string& section) {
    std::vector<std::string> names;
    for (const Column& column : columns) names.push_back(column.name);
    check(ex_put_variable_param(exoid_, kind, static_cast<int>(columns.size())), section);
    check(
        ex_put_variable_names(exoid_, kind, static_cast<int>(names.size()), pointers(names).data()),
        section);
  }

  void define_variables(ex_entity_type kind, const std::vector<Column>& columns) {
    if (columns.empty() || (kind == EX_NODAL && info_.vertices == 0)) return;
    const char* section = kind == EX_NODAL ? "nodal variables" : "element variables";
    name_variables(kind, columns, section);
    if (kind == EX_NODAL || ids_.empty()) return;
    std::vector<int> table;
    for (const CellGroup& group : grouping_.groups())
      for (const Column& column : columns)
        table.push_back(group.cells > 0 && info_.schema.array_covers(column.array, group.block));
    check(ex_put_truth_table(exoid_, kind, static_cast<int>(ids_.size()),
                             static_cast<int>(columns.size()), table.data()),
          section);
  }

  // Returns the sets whose members have values of the array. Throws Failure if they do not have as
  // many members as the array has elements.
  std::vector<std::size_t> sets_with(const ArrayInfo& array) const {
    std::vector<std::size_t> found;
    std::uint32_t number = 0;
    std::uint64_t members = 0;
    for (std::size_t s = 0; s < sets_.size(); ++s) {
      if (location_of(sets_[s].kind) != array.location) continue;
      const std::uint32_t here = number++;
      if (!array.blocks.empty() &&
          !std::binary_search(array.blocks.begin(), array.blocks.end(), here))
        continue;
      found.push_back(s);
      members += sets_[s].members.size();
    }
    if (members != array.elements)
      place_.fail(ErrorCode::unsupported, "array '" + array.name + "'",
                  "has " + std::to_string(array.elements) + " values, but its sets have " +
                      std::to_string(members) + " members");
    return found;
  }

  static ex_entity_type kind_at(Location location) {
    return location == Location::global     ? EX_GLOBAL
           : location == Location::node_set ? EX_NODE_SET
           : location == Location::side_set ? EX_SIDE_SET
                                            : EX_ELEM_SET;
  }

  // Defines the global variables, or the variables of one kind of set.
  void define_beside_mesh(Location location, const std::vector<Column>& columns) {
    const ex_entity_type kind = kind_at(location);
    const std::string section = std::string(location_name(location)) + " variables";
    name_variables(kind, columns, section);
    if (kind == EX_GLOBAL) return;
    std::vector<std::size_t> of_kind;
    for (std::size_t s = 0; s < sets_.size(); ++s)
      if (location_of(sets_[s].kind) == location) of_kind.push_back(s);
    std::vector<int> table(of_kind.size() * columns.size(), 0);
    for (std::size_t i = 0; i < columns.size(); ++i)
      for (const std::size_t s : sets_with(info_.schema.arrays[columns[i].array])) {
        const auto row = std::lower_bound(of_kind.begin(), of_kind.end(), s) - of_kind.begin();
        table[static_cast<std::size_t>(row) * columns.size() + i] =
            sets_[s].members.empty() ? 0 : 1;
      }
    if (!table.empty())
      check(ex_put_truth_table(exoid_, kind, static_cast<int>(of_kind.size()),
                               static_cast<int>(columns.size()), table.data()),
            section);
  }

  template <class Real>
  void write_global(const std::vector<Column>& columns, std::size_t step) {
    std::vector<Real> reals;
    std::vector<std::byte> values;
    for (const Column& column : columns) {
      const ArrayInfo& array = info_.schema.arrays[column.array];
      values.resize(array.elements * info_.array_stride(column.array));
      mesh_.read_array(column.array, step, 0, array.elements, values.data());
      reals.push_back(
          real_at<Real>(values.data() + column.component * scalar_bytes(array.type), array.type));
    }
    check(ex_put_var(exoid_, static_cast<int>(step + 1), EX_GLOBAL, 1, 1,
                     static_cast<std::int64_t>(reals.size()), reals.data()),
          "global variables");
  }

  template <class Real>
  void write_on_sets(const std::vector<Column>& columns, std::size_t step) {
    std::vector<Real> reals;
    std::vector<std::byte> values;
    for (std::size_t i = 0; i < columns.size(); ++i) {
      const Column& column = columns[i];
      std::uint64_t first = 0;
      for (const std::size_t s : sets_with(info_.schema.arrays[column.array])) {
        const std::uint64_t count = sets_[s].members.size();
        if (count == 0) continue;
        values.resize(count * info_.array_stride(column.array));
        mesh_.read_array(column.array, step, first, count, values.data());
        first += count;
        check(ex_put_var(exoid_, static_cast<int>(step + 1), kind_of(sets_[s]),
                         static_cast<int>(i + 1), set_ids_[s], static_cast<std::int64_t>(count),
                         component(column, count, values.data(), reals).data()),
              label_of(sets_[s]));
      }
    }
  }

  template <class Real>
  void write_values() {
    write_points<Real>();
    write_cells();
    for (const std::size_t map : maps_) write_map(map);
    write_sets<Real>();
    for (std::size_t step = 0; step < times_.size(); ++step) {
      const auto time = static_cast<Real>(times_[step]);
      check(ex_put_time(exoid_, static_cast<int>(step + 1), &time), "times");
      for (std::size_t i = 0; i < nodal_.size(); ++i) write_nodal<Real>(i, step);
      for (std::size_t i = 0; i < element_.size(); ++i) write_element<Real>(i, step);
      for (const auto& [location, columns] : beside_mesh_) {
        if (step >= info_.step_times.size()) continue;
        if (location == Location::global)
          write_global<Real>(columns, step);
        else
          write_on_sets<Real>(columns, step);
      }
    }
  }

  template <class Real>
  void write_points() {
    const ScalarType type = info_.schema.coordinate_type;
    const std::size_t bytes = scalar_bytes(type);
    std::array<std::vector<Real>, 3> axes;
    std::vector<std::byte> xyz;
    for (std::uint64_t first = 0; first < info_.vertices; first += kPieceElements) {
      const std::uint64_t count = std::min(kPieceElements, info_.vertices - first);
      xyz.resize(3 * count * bytes);
      mesh_.read_points(first, count, xyz.data());
      for (std::size_t c = 0; c < 3; ++c) {
        axes[c].resize(count);
        for (std::uint64_t i = 0; i < count; ++i)
          axes[c][i] = real_at<Real>(xyz.data() + (3 * i + c) * bytes, type);
      }
      check(ex_put_partial_coord(exoid_, static_cast<std::int64_t>(first + 1),
                                 static_cast<std::int64_t>(count), axes[0].data(), axes[1].data(),
                                 axes[2].data()),
            "coordinates");
    }
  }

  void write_cells() {
    std::vector<std::int64_t> nodes;
    std::vector<std::uint64_t> next_node(ids_.size(), 0);
    grouping_.deal_cells(mesh_, [&](std::uint32_t g, std::uint64_t first, std::uint64_t cells,
                                    const std::vector<std::uint64_t>& corners,
                                    const std::vector<std::uint32_t>& sizes) {
      const CellGroup& group = grouping_.groups()[g];
      BlockInfo block = block_of(group);
      block.nodes_per_cell = group.nodes_per_cell;
      const auto places = exodus_permutation(block);
      const std::size_t width = places.empty() ? 1 : places.size();
      nodes.resize(corners.size());
      for (std::size_t begin = 0; begin < corners.size(); begin += width)
        for (std::size_t i = 0; i < width; ++i)
          nodes[begin + (places.empty() ? i : places[i])] =
              static_cast<std::int64_t>(corners[begin + i]) + 1;
      if (corners.empty()) return;
      if (is_polygons(group)) {
        // The Exodus library can write the node counts of a block only in a single call. netCDF
        // functions are used instead, to write the node counts in pieces.
        put_integers("ebepecnt", g, first, {sizes.begin(), sizes.end()});
        put_integers("connect", g, next_node[g], {nodes.begin(), nodes.end()});
        next_node[g] += nodes.size();
        return;
      }
      check(ex_put_partial_elem_conn(exoid_, ids_[g], static_cast<std::int64_t>(first + 1),
                                     static_cast<std::int64_t>(cells), nodes.data()),
            "element block " + std::to_string(ids_[g]));
    });
  }

  // Writes the values of the elements `first` to `first` + `count` - 1 of a number map.
  void put_map(std::size_t array, std::uint64_t first, std::uint64_t count,
               const std::byte* values) const {
    const ArrayInfo& info = info_.schema.arrays[array];
    std::vector<std::int64_t> numbers(count);
    for (std::uint64_t i = 0; i < count; ++i) {
      std::int32_t narrow;
      std::memcpy(&narrow, values + i * info_.array_stride(array), sizeof narrow);
      numbers[i] = narrow;
      if (info.type == ScalarType::int64)
        std::memcpy(&numbers[i], values + i * sizeof(std::int64_t), sizeof(std::int64_t));
    }
    const ex_entity_type kind = info.location == Location::point ? EX_NODE_MAP : EX_ELEM_MAP;
    const auto start = static_cast<std::int64_t>(first + 1),
               size = static_cast<std::int64_t>(count);
    check(is_original_map(info)
              ? ex_put_partial_num_map(exoid_, kind, 1, start, size, numbers.data())
              : ex_put_partial_id_map(exoid_, kind, start, size, numbers.data()),
          info.name);
  }

  // Defines the number maps that the whole mesh already had before it was decomposed. Only a part
  // of a decomposed mesh has such maps. Their name is the one that nem_spread uses.
  void define_original_maps() {
    int counts[2] = {0, 0};
    for (const std::size_t map : maps_) {
      const ArrayInfo& info = info_.schema.arrays[map];
      if (is_original_map(info)) ++counts[info.location == Location::point ? 0 : 1];
    }
    if (counts[0] + counts[1] == 0) return;
    check(ex_put_map_param(exoid_, counts[0], counts[1]), "maps");
    std::vector<std::string> names;
    for (const int i : {0, 1}) {
      names.assign(static_cast<std::size_t>(counts[i]), "original_global_id_map");
      if (counts[i] > 0)
        check(ex_put_names(exoid_, i == 0 ? EX_NODE_MAP : EX_ELEM_MAP, pointers(names).data()),
              "maps");
    }
  }

  void write_map(std::size_t array) {
    if (info_.schema.arrays[array].location == Location::point) {
      std::vector<std::byte> values;
      for (std::uint64_t first = 0; first < info_.vertices; first += kPieceElements) {
        const std::uint64_t count = std::min(kPieceElements, info_.vertices - first);
        values.resize(count * info_.array_stride(array));
        mesh_.read_array(array, 0, first, count, values.data());
        put_map(array, first, count, values.data());
      }
      return;
    }
    // For each group, the number of elements in all earlier groups; then the total number of
    // elements.
    std::vector<std::uint64_t> begin(1);
    for (const CellGroup& group : grouping_.groups()) begin.push_back(begin.back() + group.cells);
    grouping_.deal_values(
        mesh_, array, 0,
        [&](std::uint32_t group, std::uint64_t first, std::uint64_t count,
            const std::byte* values) { put_map(array, begin[group] + first, count, values); });
  }

  void put_integers(const char* prefix, std::uint32_t group, std::size_t first,
                    const std::vector<long long>& values) {
    const std::string name = prefix + std::to_string(group + 1);
    const std::size_t count = values.size();
    int variable = -1;
    place_.check(nc_inq_varid(exoid_, name.c_str(), &variable), "variable '" + name + "'");
    place_.check(nc_put_vara_longlong(exoid_, variable, &first, &count, values.data()),
                 "variable '" + name + "'");
  }

  // Copies one component of `count` elements to `out` and returns `out`. `values` contains these
  // elements with all components.
  template <class Real>
  const std::vector<Real>& component(const Column& column, std::uint64_t count,
                                     const std::byte* values, std::vector<Real>& out) const {
    const ScalarType type = info_.schema.arrays[column.array].type;
    const std::size_t stride = info_.array_stride(column.array);
    const std::size_t offset = column.component * scalar_bytes(type);
    out.resize(count);
    for (std::uint64_t i = 0; i < count; ++i)
      out[i] = real_at<Real>(values + i * stride + offset, type);
    return out;
  }
  std::uint64_t source_step(const Column& column, std::size_t step) const {
    return info_.schema.arrays[column.array].per_step ? step : 0;
  }
  // Returns true if the column (one component of an array) has values. An array that changes with
  // time has no values if the mesh has no steps.
  bool has_values(const Column& column) const {
    return !info_.schema.arrays[column.array].per_step || !info_.step_times.empty();
  }

  template <class Real>
  void write_nodal(std::size_t index, std::size_t step) {
    const Column& column = nodal_[index];
    if (!has_values(column)) return;
    std::vector<std::byte> values;
    std::vector<Real> reals;
    for (std::uint64_t first = 0; first < info_.vertices; first += kPieceElements) {
      const std::uint64_t count = std::min(kPieceElements, info_.vertices - first);
      values.resize(count * info_.array_stride(column.array));
      mesh_.read_array(column.array, source_step(column, step), first, count, values.data());
      check(ex_put_partial_var(exoid_, static_cast<int>(step + 1), EX_NODAL,
                               static_cast<int>(index + 1), 1, static_cast<std::int64_t>(first + 1),
                               static_cast<std::int64_t>(count),
                               component(column, count, values.data(), reals).data()),
            "nodal variable '" + column.name + "'");
    }
  }

  template <class Real>
  void write_element(std::size_t index, std::size_t step) {
    const Column& column = element_[index];
    if (!has_values(column)) return;
    std::vector<Real> reals;
    grouping_.deal_values(
        mesh_, column.array, source_step(column, step),
        [&](std::uint32_t group, std::uint64_t first, std::uint64_t count,
            const std::byte* values) {
          check(ex_put_partial_var(exoid_, static_cast<int>(step + 1), EX_ELEM_BLOCK,
                                   static_cast<int>(index + 1), ids_[group],
                                   static_cast<std::int64_t>(first + 1),
                                   static_cast<std::int64_t>(count),
                                   component(column, count, values, reals).data()),
                "element variable '" + column.name + "'");
        });
  }

  MeshSource& mesh_;
  const MeshInfo& info_;
  Place place_;
  CellGrouping grouping_;
  const std::vector<MeshSet> sets_;
  std::vector<std::int64_t> set_ids_;
  int exoid_ = -1;
  int real_bytes_ = 8;
  bool wide_ = false, netcdf4_ = false;
  std::vector<Column> nodal_, element_;
  std::map<Location, std::vector<Column>> beside_mesh_;  // global and set variables
  std::vector<std::size_t> maps_;                        // indices of arrays that are number maps
  std::vector<double> times_;
  std::vector<std::int64_t> ids_;  // id of each group
};

}  // namespace

Capabilities::MostNumbers most_numbers(const MeshInfo& info) {
  constexpr std::uint64_t kMost = std::numeric_limits<std::int32_t>::max();
  return most_numbers_of(info.vertices > kMost || info.cells() > kMost ||
                         ForeignWriter::has_wide_maps(info));
}

void write_foreign(MeshSource& mesh, const std::string& path, Spool& spool) {
  ForeignWriter(mesh, path, spool).write();
}

}  // namespace shm::converters::exodus
