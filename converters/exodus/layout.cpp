#include "exodus/layout.h"

#include <netcdf.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <cstring>
#include <initializer_list>
#include <numeric>
#include <span>
#include <utility>

#include "base/stored_value.h"
#include "mesh/node_orders.h"

namespace shm::converters::exodus {
namespace {

constexpr std::uint64_t kMaxComponents = 65535;
constexpr std::uint64_t kMaxBlocks = 1 << 20;

// If `name` consists of `prefix` and a number N without leading zeros, returns N. Otherwise returns
// 0.
std::uint32_t number_after(std::string_view name, std::string_view prefix) {
  if (name.substr(0, prefix.size()) != prefix) return 0;
  name.remove_prefix(prefix.size());
  std::uint32_t number = 0;
  const auto [end, error] = std::from_chars(name.data(), name.data() + name.size(), number);
  const bool whole = error == std::errc() && end == name.data() + name.size();
  return whole && !name.empty() && name.front() != '0' ? number : 0;
}

// If `name` is the name of a variable of this kind, returns the numbers of its field and of its
// block or set. Otherwise returns nothing.
std::optional<std::pair<std::uint32_t, std::uint32_t>> field_numbers(const FieldKind& kind,
                                                                     std::string_view name) {
  const std::size_t split = name.rfind(kind.place);
  if (split == std::string_view::npos) return std::nullopt;
  const std::uint32_t field = number_after(name.substr(0, split), kind.values);
  const std::uint32_t place = number_after(name.substr(split), kind.place);
  if (field == 0 || place == 0) return std::nullopt;
  return std::pair(field, place);
}

bool is_numeric(int type) { return type != NC_CHAR && type != NC_STRING; }

std::string upper_without_padding(std::string_view text) {
  text = text.substr(0, text.find('\0'));
  while (!text.empty() && text.back() == ' ') text.remove_suffix(1);
  std::string upper(text);
  for (char& c : upper)
    if (c >= 'a' && c <= 'z') c = static_cast<char>(c - 'a' + 'A');
  return upper;
}

std::string element_type_of(const Variable& variable) {
  for (const Attribute& attribute : variable.attributes)
    if (attribute.name == "elem_type" && attribute.type == NC_CHAR)
      return upper_without_padding(
          {reinterpret_cast<const char*>(attribute.values.data()), attribute.values.size()});
    else if (attribute.name == "elem_type" && !attribute.strings.empty())
      return upper_without_padding(attribute.strings.front());
  return {};
}

class Surveyor {
 public:
  Surveyor(const Skeleton& skeleton, const Place& place) : skeleton_(skeleton), place_(place) {}

  Layout survey(bool beside_mesh) {
    out_.vertices = skeleton_.length_of("num_nodes");
    out_.steps = skeleton_.length_of("time_step");
    elements_ = skeleton_.length_of("num_elem");
    out_.uses.assign(skeleton_.variables.size(), Use::extra);
    find_coordinates();
    find_blocks();
    find_nodal_fields();
    for (const FieldKind& kind : kFieldKinds)
      if (is_on_mesh(kind.location) || beside_mesh) find_fields(kind);
    if (beside_mesh) find_global_fields();
    find_other_arrays();
    for (ArrayLayout& array : out_.arrays) find_fills(array);
    return std::move(out_);
  }

 private:
  const Variable& variable(int index) const {
    return skeleton_.variables[static_cast<std::size_t>(index)];
  }
  void use(int index, Use use) { out_.uses[static_cast<std::size_t>(index)] = use; }
  bool has_dimensions(const Variable& v, std::initializer_list<std::string_view> names) const {
    if (v.dimensions.size() != names.size()) return false;
    std::size_t i = 0;
    for (const std::string_view name : names)
      if (skeleton_.dimension_name(v, i++) != name) return false;
    return true;
  }
  [[noreturn]] void contradiction(const Variable& v, const std::string& detail) const {
    place_.fail(ErrorCode::corrupt, "variable '" + v.name + "'", detail);
  }

  void find_coordinates() {
    constexpr std::array<const char*, 3> kNames{"coordx", "coordy", "coordz"};
    bool any_double = false, any = false;
    const auto take = [&](int v, std::initializer_list<std::string_view> dimensions) {
      if (v < 0 || !has_dimensions(variable(v), dimensions) ||
          !is_float(scalar_of(variable(v).type)))
        return false;
      any_double |= variable(v).type == NC_DOUBLE;
      any = true;
      use(v, Use::coordinates);
      return true;
    };
    const std::uint64_t dimension = skeleton_.length_of("num_dim");
    if (dimension > 3)
      place_.fail(ErrorCode::corrupt, "dimension 'num_dim'",
                  "states " + std::to_string(dimension) + " coordinates; a mesh has 1 to 3");
    const int together = skeleton_.find_variable("coord");
    if (take(together, {"num_dim", "num_nodes"})) {
      out_.coordinates_together = true;
      for (std::size_t c = 0; c < dimension; ++c) out_.coordinates[c] = together;
    } else {
      for (std::size_t c = 0; c < 3; ++c) {
        const int v = skeleton_.find_variable(kNames[c]);
        if (take(v, {"num_nodes"})) out_.coordinates[c] = v;
      }
    }
    if (any && !any_double) out_.coordinate_type = ScalarType::float32;
  }

  void find_blocks() {
    const std::uint64_t count = skeleton_.length_of("num_el_blk");
    if (count > kMaxBlocks)
      place_.fail(ErrorCode::unsupported, "dimension 'num_el_blk'",
                  "states " + std::to_string(count) + " element blocks; at most " +
                      std::to_string(kMaxBlocks) + " can be converted");
    const VariableIndex variables(skeleton_);
    std::map<std::string_view, std::uint64_t> lengths;
    for (const Dimension& dimension : skeleton_.dimensions)
      lengths.emplace(dimension.name, dimension.length);
    for (std::uint64_t b = 1; b <= count; ++b) {
      const std::string number = std::to_string(b);
      const auto length = lengths.find("num_el_in_blk" + number);
      BlockLayout block;
      block.cells = length == lengths.end() ? 0 : length->second;
      block.connectivity = variables.find("connect" + number);
      const int counts = variables.find("ebepecnt" + number);
      const int faces = variables.find("facconn" + number);
      if (block.connectivity >= 0)
        describe_cells(block, number, counts);
      else if (block.cells > 0 && counts >= 0 && faces >= 0 &&
               has_dimensions(variable(counts), {"num_el_in_blk" + number}) &&
               variable(faces).dimensions.size() == 1)
        describe_polyhedra(block, counts, faces);
      if (__builtin_add_overflow(out_.cells, block.cells, &out_.cells))
        place_.fail(ErrorCode::corrupt, "dimension 'num_el_in_blk" + number + "'",
                    "there cannot be that many elements");
      out_.blocks.push_back(block);
    }
  }

  void describe_cells(BlockLayout& block, const std::string& number, int counts) {
    const Variable& connect = variable(block.connectivity);
    const auto lengths = skeleton_.shape(connect);
    if (!is_integer(connect.type)) contradiction(connect, "does not hold integers");
    use(block.connectivity, Use::connectivity);
    const bool by_element =
        !lengths.empty() && skeleton_.dimension_name(connect, 0) == "num_el_in_blk" + number;
    const std::string type = element_type_of(connect);
    if (by_element && lengths.size() <= 2) {
      const std::uint64_t nodes = lengths.size() == 2 ? lengths[1] : 1;
      if (nodes > kMaxNodesPerCell)
        place_.fail(ErrorCode::unsupported, "variable '" + connect.name + "'",
                    "has elements of " + std::to_string(nodes) + " nodes; at most " +
                        std::to_string(kMaxNodesPerCell) + " can be converted");
      block.nodes_per_cell = static_cast<std::uint32_t>(nodes);
      const BlockInfo elements = element_block(type, block.nodes_per_cell);
      block.shape = elements.shape;
      block.scheme = elements.scheme;
      return;
    }
    if (lengths.size() != 1 || counts < 0 ||
        !has_dimensions(variable(counts), {"num_el_in_blk" + number}) ||
        !is_integer(variable(counts).type))
      contradiction(connect, "does not have the shape of a connectivity");
    block.counts = counts;
    block.shape = CellShape::polygon;
    use(counts, Use::node_counts);
  }

  void describe_polyhedra(BlockLayout& block, int counts, int faces) {
    if (!is_integer(variable(counts).type))
      contradiction(variable(counts), "does not hold integers");
    if (!is_integer(variable(faces).type)) contradiction(variable(faces), "does not hold integers");
    block.counts = counts;
    block.faces = faces;
    block.shape = CellShape::polyhedron;
  }

  void find_nodal_fields() {
    const int together = skeleton_.find_variable("vals_nod_var");
    if (together >= 0 && is_numeric(variable(together).type) &&
        has_dimensions(variable(together), {"time_step", "num_nod_var", "num_nodes"}) &&
        skeleton_.length_of("num_nod_var") <= kMaxComponents) {
      const std::uint64_t fields = skeleton_.length_of("num_nod_var");
      for (std::uint64_t i = 0; i < fields; ++i) {
        ArrayLayout& array = add_array(Location::point, together, {}, true);
        array.leading = 1;
        array.plane = i;
        array.field = static_cast<int>(i + 1);
      }
      return;
    }
    std::map<std::uint32_t, int> fields;
    for (std::size_t v = 0; v < skeleton_.variables.size(); ++v) {
      const Variable& candidate = skeleton_.variables[v];
      const std::uint32_t field = number_after(candidate.name, "vals_nod_var");
      if (field > 0 && field < 1U << 30 && is_numeric(candidate.type) &&
          has_dimensions(candidate, {"time_step", "num_nodes"}))
        fields.emplace(field, static_cast<int>(v));
    }
    for (const auto& [field, v] : fields)
      add_array(Location::point, v, {}, true).field = static_cast<int>(field);
  }

  // Finds the element variables, or the variables of one kind of set.
  void find_fields(const FieldKind& kind) {
    const std::uint64_t places = skeleton_.length_of(kind.places);
    std::map<std::uint32_t, std::map<std::uint32_t, int>> fields;  // field -> place -> variable
    for (std::size_t v = 0; v < skeleton_.variables.size(); ++v) {
      const Variable& candidate = skeleton_.variables[v];
      const auto numbers = field_numbers(kind, candidate.name);
      if (!numbers || numbers->first >= 1U << 30 || !is_numeric(candidate.type) ||
          numbers->second > places ||
          !has_dimensions(candidate,
                          {"time_step", std::string(kind.count) + std::to_string(numbers->second)}))
        continue;
      fields[numbers->first].emplace(numbers->second - 1, static_cast<int>(v));
    }
    for (const auto& [field, by_place] : fields) {
      const int type = variable(by_place.begin()->second).type;
      ArrayLayout array;
      array.info.location = kind.location;
      array.info.type = scalar_of(type);
      array.info.per_step = true;
      array.field = static_cast<int>(field);
      for (const auto& [place, v] : by_place) {
        if (variable(v).type != type) continue;  // a variable of another type stays an extra
        array.parts.push_back({place, v});
        array.info.blocks.push_back(place);
        use(v, Use::array);
        if (is_on_mesh(kind.location)) continue;
        array.parts.back().elements =
            skeleton_.length_of(std::string(kind.count) + std::to_string(place + 1));
        array.info.elements += array.parts.back().elements;
      }
      if (array.info.blocks.size() == places) array.info.blocks.clear();
      out_.arrays.push_back(std::move(array));
    }
  }

  // Finds the global variables. They are the columns of one netCDF variable.
  void find_global_fields() {
    constexpr std::uint64_t kMostGlobal = 1 << 14;
    const int v = skeleton_.find_variable("vals_glo_var");
    const std::uint64_t fields = skeleton_.length_of("num_glo_var");
    if (v < 0 || fields > kMostGlobal || !is_numeric(variable(v).type) ||
        !has_dimensions(variable(v), {"time_step", "num_glo_var"}))
      return;
    for (std::uint64_t i = 0; i < fields; ++i) {
      ArrayLayout& array = add_array(Location::global, v, {}, true);
      array.leading = 1;
      array.plane = i;
      array.field = static_cast<int>(i + 1);
      array.info.elements = array.parts.back().elements = 1;
    }
  }

  // Finds the remaining variables that have a value for each node or element, such as maps and
  // attributes. They become arrays, so that their values are reordered together with the nodes or
  // elements.
  void find_other_arrays() {
    for (std::size_t i = 0; i < skeleton_.variables.size(); ++i) {
      const Variable& v = skeleton_.variables[i];
      if (out_.uses[i] != Use::extra || v.type == NC_STRING) continue;
      for (std::size_t d = 0; d < v.dimensions.size(); ++d)
        if (const auto elements = elements_of(skeleton_.dimension_name(v, d))) {
          add_planes(static_cast<int>(i), d, *elements);
          break;
        }
    }
    // The file stores the faces of all polyhedra of a block as one list, in the order of the
    // polyhedra. An array contains the index of each polyhedron in this order, so that the order is
    // known even if the cells are reordered.
    for (std::uint32_t b = 0; b < out_.blocks.size(); ++b) {
      if (out_.blocks[b].faces < 0) continue;
      ArrayLayout array;
      array.info.name = "polyhedron" + std::to_string(b + 1);
      array.info.role = "exodus:polyhedron";
      array.info.location = Location::cell;
      array.info.type =
          std::in_range<std::int32_t>(out_.blocks[b].cells) ? ScalarType::int32 : ScalarType::int64;
      if (out_.blocks.size() > 1) array.info.blocks = {b};
      array.parts = {{b, -1}};
      out_.arrays.push_back(std::move(array));
    }
  }

  struct Elements {
    Location location;
    std::uint32_t block;
  };
  std::optional<Elements> elements_of(std::string_view dimension) const {
    if (dimension == "num_nodes") return Elements{Location::point, ArrayPart::kEverything};
    if (dimension == "num_elem" && elements_ == out_.cells)
      return Elements{Location::cell, ArrayPart::kEverything};
    const std::uint32_t block = number_after(dimension, "num_el_in_blk");
    if (block > 0 && block <= out_.blocks.size()) return Elements{Location::cell, block - 1};
    return std::nullopt;
  }

  // Adds the arrays of a variable. The dimension `elements_at` counts nodes or elements. There is
  // one array for each combination of indices of the preceding dimensions (except time).
  void add_planes(int index, std::size_t elements_at, const Elements& elements) {
    constexpr std::uint64_t kMostPlanes = 1024;
    const Variable& v = variable(index);
    const bool stepped = skeleton_.dimension_name(v, 0) == "time_step";
    const std::size_t leading = elements_at - (stepped ? 1 : 0);
    std::uint64_t planes = 1;
    for (std::size_t d = stepped ? 1 : 0; d < elements_at; ++d) {
      planes *= std::min(skeleton_.dimensions[v.dimensions[d]].length, kMostPlanes + 1);
      if (planes > kMostPlanes) return;
    }
    if (planes == 0 || components_of(v, elements_at + 1) == 0) return;
    const std::string role = "exodus:" + (number_after(v.name, "attrib") > 0 ? "attribute"
                                          : v.name == "nattrb"               ? "node_attribute"
                                                                             : v.name);
    for (std::uint64_t plane = 0; plane < planes; ++plane) {
      ArrayLayout& array =
          add_array(elements.location, index, role, stepped, elements.block, elements_at);
      array.leading = leading;
      array.plane = plane;
      if (leading > 0) array.info.name += "#" + std::to_string(plane + 1);
    }
  }

  // Returns the number of components: the product of the lengths of the dimensions from index
  // `first` on. Returns 0 if the product exceeds kMaxComponents.
  std::uint32_t components_of(const Variable& v, std::size_t first) const {
    std::uint64_t product = 1;
    for (std::size_t d = first; d < v.dimensions.size(); ++d) {
      product *= std::min(skeleton_.dimensions[v.dimensions[d]].length, kMaxComponents + 1);
      if (product > kMaxComponents) return 0;
    }
    return static_cast<std::uint32_t>(product);
  }

  // Takes the fill values from the attributes _FillValue and missing_value of the array's
  // variables, as conventions for netCDF files define them.
  void find_fills(ArrayLayout& array) {
    if (!is_float(array.info.type)) return;
    for (const ArrayPart& part : array.parts) {
      if (part.variable < 0) continue;
      for (const Attribute& attribute : variable(part.variable).attributes)
        if ((attribute.name == "_FillValue" || attribute.name == "missing_value") &&
            attribute.type == variable(part.variable).type)
          add_fills(attribute.values, array.info);
    }
  }
  static void add_fills(std::span<const std::byte> values, ArrayInfo& array) {
    const std::size_t width = scalar_bytes(array.type);
    for (std::size_t at = 0; at + width <= values.size(); at += width) {
      const double fill = as_double(values.data() + at, array.type);
      const bool is_known =
          std::find(array.fills.begin(), array.fills.end(), fill) != array.fills.end();
      if (std::isfinite(fill) && !is_known && array.fills.size() < kMaxFills)
        array.fills.push_back(fill);
    }
  }

  ArrayLayout& add_array(Location location, int v, const std::string& role, bool stepped,
                         std::uint32_t block = ArrayPart::kEverything,
                         std::size_t elements_at = 0) {
    ArrayLayout array;
    array.info.location = location;
    array.info.type = scalar_of(variable(v).type);
    array.info.per_step = stepped;
    array.info.role = role;
    if (!role.empty()) {
      array.info.name = variable(v).name;
      array.info.components = components_of(variable(v), elements_at + 1);
    }
    if (block != ArrayPart::kEverything && out_.blocks.size() > 1) array.info.blocks = {block};
    array.parts.push_back({block, v});
    use(v, Use::array);
    out_.arrays.push_back(std::move(array));
    return out_.arrays.back();
  }

  const Skeleton& skeleton_;
  const Place& place_;
  std::uint64_t elements_ = 0;  // number of elements that the file states
  Layout out_;
};

struct Member {
  std::string_view prefix;
  const SetKind* kind;
  std::string_view field;
  Reference refers;
};
constexpr const SetKind *kNodes = &kSetKinds[0], *kSides = &kSetKinds[1], *kEdges = &kSetKinds[2],
                        *kFaces = &kSetKinds[3], *kElements = &kSetKinds[4];
constexpr std::array<Member, 13> kMembers{
    {{"node_ns", kNodes, kMembersField, Reference::vertex},
     {"dist_fact_ns", kNodes, kFactorsField, Reference::nothing},
     {"elem_ss", kSides, kMembersField, Reference::cell},
     {"side_ss", kSides, "sides", Reference::nothing},
     {"dist_fact_ss", kSides, kFactorsField, Reference::nothing},
     {"edge_es", kEdges, "edges", Reference::nothing},
     {"ornt_es", kEdges, "sides", Reference::nothing},
     {"dist_fact_es", kEdges, kFactorsField, Reference::nothing},
     {"face_fs", kFaces, "faces", Reference::nothing},
     {"ornt_fs", kFaces, "sides", Reference::nothing},
     {"dist_fact_fs", kFaces, kFactorsField, Reference::nothing},
     {"elem_els", kElements, kMembersField, Reference::cell},
     {"dist_fact_els", kElements, kFactorsField, Reference::nothing}}};

const Member* member_of(std::string_view name, std::uint32_t& number) {
  for (const Member& member : kMembers)
    if ((number = number_after(name, member.prefix)) > 0) return &member;
  return nullptr;
}

}  // namespace

bool is_integer(int nc_type) {
  return nc_type != NC_CHAR && nc_type != NC_STRING && !is_float(scalar_of(nc_type));
}

Layout lay_out(const Skeleton& skeleton, const Place& place, bool beside_mesh) {
  return Surveyor(skeleton, place).survey(beside_mesh);
}

std::string_view names_of_fields(Location location) {
  if (location == Location::point) return "name_nod_var";
  for (const FieldKind& kind : kFieldKinds)
    if (kind.location == location) return kind.names;
  return "name_glo_var";
}

std::uint64_t elements_of(const Layout& layout, const ArrayLayout& array, const ArrayPart& part) {
  if (!is_on_mesh(array.info.location)) return part.elements;
  if (part.block != ArrayPart::kEverything) return layout.blocks[part.block].cells;
  return array.info.location == Location::point ? layout.vertices : layout.cells;
}

void narrow_connectivity(const Skeleton& skeleton, Layout& layout, std::uint32_t block,
                         std::uint32_t nodes) {
  BlockLayout& cells = layout.blocks[block];
  const Variable& connect = skeleton.variables[static_cast<std::size_t>(cells.connectivity)];
  ArrayLayout array;
  array.info.name = connect.name;
  array.info.role = "exodus:connectivity";
  array.info.location = Location::cell;
  array.info.type = scalar_of(connect.type);
  array.info.components = cells.nodes_per_cell - nodes;
  if (layout.blocks.size() > 1) array.info.blocks = {block};
  array.parts = {{block, cells.connectivity}};
  array.column = nodes;
  layout.arrays.push_back(std::move(array));
  cells.nodes_per_cell = nodes;
}

std::uint32_t node_columns(const Skeleton& skeleton, const BlockLayout& block) {
  const Variable& connect = skeleton.variables[static_cast<std::size_t>(block.connectivity)];
  const bool bezier = element_type_of(connect).rfind("BEX_", 0) == 0;
  return bezier ? block.nodes_per_cell / 2 : block.nodes_per_cell;
}

BlockInfo element_block(std::string_view element_type, std::uint32_t nodes) {
  struct Family {
    std::string_view prefix;
    CellShape shape;
    // Number of corners. Elements with an unusual number of nodes have the shape if they have more
    // nodes than this. 0: they do not have the shape.
    std::uint32_t corners;
  };
  // An element of type SHELL is a triangle or a quad, depending on its number of nodes.
  static constexpr std::array<Family, 16> kFamilies{{
      {"HEX", CellShape::hexahedron, 8},
      {"TET", CellShape::tetrahedron, 4},
      {"WEDGE", CellShape::wedge, 6},
      {"PYR", CellShape::pyramid, 5},
      {"QUAD", CellShape::quad, 4},
      {"SHEL", CellShape::quad, 0},
      {"SHEL", CellShape::triangle, 0},
      {"TRI", CellShape::triangle, 3},
      {"BAR", CellShape::line, 0},
      {"BEAM", CellShape::line, 0},
      {"TRUSS", CellShape::line, 0},
      {"ROD", CellShape::line, 0},
      {"EDGE", CellShape::line, 0},
      {"SPHERE", CellShape::vertex, 0},
      {"CIRCLE", CellShape::vertex, 0},
      {"POINT", CellShape::vertex, 0},
  }};
  const std::string type = upper_without_padding(element_type);
  for (const Family& family : kFamilies) {
    if (type.rfind(family.prefix, 0) != 0) continue;
    for (const NodeScheme scheme : {NodeScheme::lagrange, NodeScheme::serendipity})
      if (const BlockInfo block{0, {}, family.shape, nodes, scheme}; has_element_type(block))
        return block;
    // The corners of HEX9, TETRA14 and similar elements come first. If another format has cells
    // with as many nodes, the order of the nodes is unknown.
    const BlockInfo block{0, {}, family.shape, nodes, NodeScheme::lagrange};
    if (family.corners > 0 && nodes > family.corners && cell_order(block) == 0) return block;
  }
  return {0, {}, CellShape::other, nodes, NodeScheme::lagrange};
}

bool has_element_type(const BlockInfo& block) {
  struct Topology {
    CellShape shape;
    std::array<std::uint32_t, 4> nodes;
  };
  static constexpr std::array<Topology, 8> kTopologies{{
      {CellShape::vertex, {1}},
      {CellShape::line, {2, 3, 4}},
      {CellShape::triangle, {3, 6, 7}},
      {CellShape::quad, {4, 8, 9, 16}},
      {CellShape::tetrahedron, {4, 10, 15}},
      {CellShape::pyramid, {5, 13, 14, 19}},
      {CellShape::wedge, {6, 15, 18, 21}},
      {CellShape::hexahedron, {8, 20, 27, 64}},
  }};
  const CellShape shape = block.shape;
  const std::uint32_t nodes = block.nodes_per_cell;
  if (shape == CellShape::polygon || shape == CellShape::faces || shape == CellShape::polyhedron)
    return true;
  if (block.scheme == NodeScheme::serendipity)  // TRI9, QUAD12, TETRA16, WEDGE24, HEX32
    return shape != CellShape::pyramid && cell_order(block) == 3;
  return block.scheme == NodeScheme::lagrange &&
         std::any_of(kTopologies.begin(), kTopologies.end(), [&](const Topology& topology) {
           return topology.shape == shape && nodes != 0 &&
                  std::find(topology.nodes.begin(), topology.nodes.end(), nodes) !=
                      topology.nodes.end();
         });
}

std::vector<std::uint16_t> exodus_permutation(const BlockInfo& block) {
  const CellShape shape = block.shape;
  const std::uint32_t nodes = block.nodes_per_cell;
  if (!has_element_type(block)) return {};
  if (cell_order(block) == 3)
    return node_permutation(exodus_cubic(shape, block.scheme), node_places(shape, block.scheme, 3));
  std::vector<std::uint16_t> places;
  const auto identity = [&] {
    places.resize(nodes);
    std::iota(places.begin(), places.end(), std::uint16_t{0});
  };
  // Changes the last nodes of the list.
  const auto set_last = [&](std::initializer_list<std::uint16_t> last) {
    std::copy(last.begin(), last.end(), places.end() - static_cast<std::ptrdiff_t>(last.size()));
  };
  // Exodus lists the edge nodes in the order bottom edges, vertical edges, top edges. VTK's order
  // is bottom, top, vertical.
  if (shape == CellShape::hexahedron && nodes > 8) {
    identity();
    std::swap_ranges(places.begin() + 12, places.begin() + 16, places.begin() + 16);
    // Exodus lists the remaining nodes in this order: the cell centre, then the face centres -z +z
    // -x +x -y +y. VTK's order is the face centres -x +x -y +y -z +z, then the cell centre.
    if (nodes == 27) set_last({23, 24, 25, 26, 21, 22, 20});
  } else if (shape == CellShape::wedge && nodes > 6) {
    identity();
    std::swap_ranges(places.begin() + 9, places.begin() + 12, places.begin() + 12);
    // Exodus lists the centres of the triangles, of the cell, and of the quads 1254, 0352 and 0143.
    // VTK's order is the triangles, the quads 0143, 1254 and 0352, then the cell.
    if (nodes == 21) set_last({20, 18, 19, 17});
  } else if (shape == CellShape::tetrahedron && nodes == 15) {
    // Exodus lists the centres of the faces 021, 123, 032 and 013, VTK those of 021, 013, 123, 032.
    identity();
    set_last({13, 11, 12, 14});
  }
  return places;
}

Slab slab_of(const Skeleton& skeleton, const ArrayLayout& array, const ArrayPart& part,
             std::uint64_t step, std::uint64_t first, std::uint64_t count) {
  Slab slab;
  const auto add = [&](std::size_t start, std::size_t length) {
    slab.start.push_back(start);
    slab.count.push_back(length);
  };
  if (array.info.per_step) add(step, 1);
  const auto shape = skeleton.shape(skeleton.variables[static_cast<std::size_t>(part.variable)]);
  const std::size_t first_leading = slab.start.size();
  std::uint64_t plane = array.plane;
  slab.start.resize(first_leading + array.leading);
  slab.count.resize(slab.start.size(), 1);
  for (std::size_t d = slab.start.size(); d-- > first_leading; plane /= shape[d])
    slab.start[d] = plane % shape[d];
  if (array.info.location != Location::global) add(first, count);
  if (array.column > 0) add(array.column, shape[1] - array.column);
  for (std::size_t d = slab.start.size(); d < shape.size(); ++d) add(0, shape[d]);
  return slab;
}

std::vector<std::uint64_t> rows_of_parts(const Skeleton& skeleton, const Variable& variable) {
  constexpr std::uint64_t kPartBytes = std::uint64_t{16} << 20;
  const std::uint64_t values = skeleton.size(variable);
  const std::uint64_t rows = variable.dimensions.empty() ? 1 : skeleton.shape(variable)[0];
  if (values == 0 || variable.type == NC_STRING) return {0, rows};
  const std::uint64_t row_bytes = values / rows * scalar_bytes(scalar_of(variable.type));
  const std::uint64_t together = std::max<std::uint64_t>(kPartBytes / row_bytes, 1);
  std::vector<std::uint64_t> begins;
  for (std::uint64_t row = 0; row < rows; row += std::min(together, rows - row))
    begins.push_back(row);
  begins.push_back(rows);
  return begins;
}

std::string part_key(const std::string& key, std::size_t part) {
  return part == 0 ? key : key + "/" + std::to_string(part);
}

std::string plain_key(std::string_view name) { return "exodus/variable/" + std::string(name); }

std::string set_key(const SetKind& kind, std::size_t index, std::string_view field) {
  return std::string(kind.folder) + std::to_string(index) + "/" + std::string(field);
}

std::optional<SetFactors> set_factors_of(std::string_view name) {
  std::uint32_t number = 0;
  const Member* member = member_of(name, number);
  if (member == nullptr || !member->kind->neutral || member->field != kFactorsField)
    return std::nullopt;
  return SetFactors{member->kind, number - 1};
}

std::string extra_key(std::string_view name) {
  std::uint32_t number = 0;
  const Member* member = member_of(name, number);
  return member == nullptr ? plain_key(name) : set_key(*member->kind, number - 1, member->field);
}

Reference reference_of(std::string_view name) {
  std::uint32_t number = 0;
  if (const Member* member = member_of(name, number)) return member->refers;
  // Edge blocks, face blocks and some Nemesis lists contain node or element numbers.
  if (number_after(name, "ebconn") > 0 || number_after(name, "fbconn") > 0 || name == "node_mapi" ||
      name == "node_mapb" || name == "node_mape" || name == "n_comm_nids")
    return Reference::vertex;
  if (name == "elem_mapi" || name == "elem_mapb" || name == "e_comm_eids") return Reference::cell;
  return Reference::nothing;
}

}  // namespace shm::converters::exodus
