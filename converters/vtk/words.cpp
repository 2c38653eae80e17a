#include "vtk/words.h"

#include <algorithm>
#include <array>
#include <charconv>
#include <utility>

#include "shm/cell_nodes.h"

namespace shm::converters::vtk {
namespace {

struct TypeWord {
  std::string_view prefix;
  ValueForm form;
  ScalarType type;
};
constexpr auto kNumber = ValueForm::number;

// The words for types of values, in the order in which VTK tests them. The order matters, because
// VTK uses the first of these words that is a prefix of the word in the file.
constexpr std::array<TypeWord, 26> kTypeWords{{
    {"bit", ValueForm::bit, ScalarType::uint8},
    {"char", kNumber, ScalarType::int8},
    {"signed_char", kNumber, ScalarType::int8},
    {"unsigned_char", kNumber, ScalarType::uint8},
    {"short", kNumber, ScalarType::int16},
    {"unsigned_short", kNumber, ScalarType::uint16},
    {"vtkidtype", kNumber, ScalarType::int32},
    {"int", kNumber, ScalarType::int32},
    {"unsigned_int", kNumber, ScalarType::uint32},
    {"long", kNumber, ScalarType::int64},
    {"unsigned_long", kNumber, ScalarType::uint64},
    {"vtktypeint64", kNumber, ScalarType::int64},
    {"vtktypeuint64", kNumber, ScalarType::uint64},
    {"vtktypeint32", kNumber, ScalarType::int32},
    {"vtktypeuint32", kNumber, ScalarType::uint32},
    {"vtktypeint16", kNumber, ScalarType::int16},
    {"vtktypeuint16", kNumber, ScalarType::uint16},
    {"vtktypeint8", kNumber, ScalarType::int8},
    {"vtktypeuint8", kNumber, ScalarType::uint8},
    {"vtktypefloat32", kNumber, ScalarType::float32},
    {"vtktypefloat64", kNumber, ScalarType::float64},
    {"float", kNumber, ScalarType::float32},
    {"double", kNumber, ScalarType::float64},
    {"string", ValueForm::string, ScalarType::uint8},
    {"utf8_string", ValueForm::string, ScalarType::uint8},
    {"variant", ValueForm::variant, ScalarType::uint8},
}};

const TypeWord* find_type(std::string_view word) {
  const std::string lower = lower_case(word);
  for (const TypeWord& known : kTypeWords) {
    const bool whole = known.prefix.ends_with("char") && !known.prefix.starts_with('u');
    if (whole ? lower == known.prefix : lower.starts_with(known.prefix)) return &known;
  }
  return nullptr;
}

struct CellKind {
  int type;
  CellShape shape;
  std::uint32_t nodes;  // 0: any number
};

// VTK cell types, their shapes in the mesh model, and their numbers of nodes (0: any number). The
// types with a fixed number of nodes in this table have the same node order in VTK and in the
// model, except for what permute_nodes() changes. block_of_cell_type() handles all other types.
// The first type of a shape and a number of nodes is used for meshes of other formats.
constexpr CellKind kCellKinds[] = {
    {12, CellShape::hexahedron, 8},
    {1, CellShape::vertex, 1},
    {3, CellShape::line, 2},
    {5, CellShape::triangle, 3},
    {7, CellShape::polygon, 0},
    {9, CellShape::quad, 4},
    {10, CellShape::tetrahedron, 4},
    {13, CellShape::wedge, 6},
    {14, CellShape::pyramid, 5},
    {21, CellShape::line, 3},
    {22, CellShape::triangle, 6},
    {23, CellShape::quad, 8},
    {24, CellShape::tetrahedron, 10},
    {25, CellShape::hexahedron, 20},
    {26, CellShape::wedge, 15},
    {27, CellShape::pyramid, 13},
    {28, CellShape::quad, 9},
    {29, CellShape::hexahedron, 27},
    {32, CellShape::wedge, 18},
    {33, CellShape::hexahedron, 24},
    {34, CellShape::triangle, 7},
    {35, CellShape::line, 4},
    {37, CellShape::pyramid, 19},
    {kPolyhedron, CellShape::faces, 0},
    {kVoxel, CellShape::hexahedron, 8},
    {kPixel, CellShape::quad, 4},
    // Lagrange cells that high_order_block() does not cover, and Bezier cells of order 1
    {69, CellShape::triangle, 7},
    {71, CellShape::tetrahedron, 15},
    {73, CellShape::wedge, 21},
    {74, CellShape::pyramid, 5},
    {75, CellShape::line, 2},
    {76, CellShape::triangle, 3},
    {77, CellShape::quad, 4},
    {78, CellShape::tetrahedron, 4},
    {kBezierHexahedron, CellShape::hexahedron, 8},
    {80, CellShape::wedge, 6},
    {81, CellShape::pyramid, 5},
};
constexpr int kFirstLagrange = 68, kFirstBezier = 75, kLastBezier = 81;
// Shapes of the VTK types kFirstLagrange, kFirstLagrange + 1, ..., and of kFirstBezier, ...
constexpr std::array<CellShape, 6> kLagrangeShapes{CellShape::line,       CellShape::triangle,
                                                   CellShape::quad,       CellShape::tetrahedron,
                                                   CellShape::hexahedron, CellShape::wedge};

// Returns the block for Lagrange or Bezier cells of a VTK type whose order is the same along all
// axes. Its shape is `other` if the type is not that of such a cell, or if no order has this number
// of nodes.
BlockInfo high_order_block(int type, std::uint32_t nodes) {
  const bool is_bezier = type >= kFirstBezier;
  const int place = type - (is_bezier ? kFirstBezier : kFirstLagrange);
  BlockInfo block{
      type, {}, CellShape::other, nodes, is_bezier ? NodeScheme::bezier : NodeScheme::lagrange};
  if (place >= 0 && place < std::ssize(kLagrangeShapes))
    block.shape = kLagrangeShapes[static_cast<std::size_t>(place)];
  // A cell of order 2 without all nodes is another cell: eight nodes of a quad are 2 * 4 nodes.
  const std::uint32_t order = cell_order(block);
  if (order != 0 && node_places(block.shape, block.scheme, order).size() == nodes) return block;
  return {type, {}, CellShape::other, nodes, NodeScheme::lagrange};
}

// Returns the order of a hexahedron with all nodes of an order, or 0 if no order has this number of
// nodes.
std::uint32_t order_of_hexahedron(std::size_t nodes) {
  std::uint32_t along = 2;  // nodes along an edge
  while (along <= kMostCellOrder && std::size_t{along} * along * along < nodes) ++along;
  return std::size_t{along} * along * along == nodes ? along - 1 : 0;
}

bool is_in_table(std::int64_t type, std::uint32_t nodes) {
  return std::any_of(std::begin(kCellKinds), std::end(kCellKinds), [&](const CellKind& kind) {
    return kind.type == type && kind.nodes == nodes;
  });
}

constexpr std::array<std::string_view, 5> kDatasets{
    "UNSTRUCTURED_GRID", "STRUCTURED_GRID", "RECTILINEAR_GRID", "STRUCTURED_POINTS", "POLYDATA"};

constexpr std::array<std::string_view, kEntryKinds> kKeywords{
    "FIELD",         "POINTS",        "CELLS",           "CELL_DATA",
    "POINT_DATA",    "NULL_ARRAY",    "DIMENSIONS",      "EXTENT",
    "SPACING",       "ASPECT_RATIO",  "ORIGIN",          "VERTICES",
    "LINES",         "POLYGONS",      "TRIANGLE_STRIPS", "ARRAY",
    "SCALARS",       "COLOR_SCALARS", "LOOKUP_TABLE",    "VECTORS",
    "NORMALS",       "TENSORS",       "TENSORS6",        "TEXTURE_COORDINATES",
    "GLOBAL_IDS",    "PEDIGREE_IDS",  "EDGE_FLAGS",      "X_COORDINATES",
    "Y_COORDINATES", "Z_COORDINATES", "BLANKING"};

bool is_plain(char c) { return c > ' ' && c < 127 && c != '"' && c != '%'; }

template <class T>
bool parse_number(std::string_view text, T& value) {
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  return error == std::errc() && end == text.data() + text.size() && !text.empty();
}

std::string_view take_line(std::string_view& text) {
  const std::size_t end = text.find('\n');
  const std::string_view line = text.substr(0, end);
  text.remove_prefix(end == std::string_view::npos ? text.size() : end + 1);
  return line;
}

std::vector<std::string_view> split_words(std::string_view line) {
  std::vector<std::string_view> words;
  while (!line.empty()) {
    const std::size_t end = line.find(' ');
    if (end != 0) words.push_back(line.substr(0, end));
    line.remove_prefix(end == std::string_view::npos ? line.size() : end + 1);
  }
  return words;
}

bool parse_values_entry(const std::vector<std::string_view>& words, Entry& entry) {
  if (words.size() < 6 || words.size() > 7 || words[1].size() < 2) return false;
  if (words[1][0] != 'a' && words[1][0] != 'x') return false;
  entry.origin = words[1][0] == 'a' ? Origin::array : Origin::extra;
  entry.name = words[2];
  entry.type = words[3];
  if (words.size() == 7) entry.second = words[6];
  if ((entry.kind == EntryKind::scalars) != (words.size() == 7)) return false;
  return parse_number(words[1].substr(1), entry.index) &&
         parse_number(words[4], entry.components) && parse_number(words[5], entry.tuples);
}

// Parses an entry CELLS [<type> <type>], or a list such as VERTICES <cells> [<type> <type>].
bool parse_list_entry(const std::vector<std::string_view>& words, Entry& entry) {
  const bool counted = entry.kind != EntryKind::cells;
  const std::size_t first = counted ? 2 : 1;
  if (words.size() != first && words.size() != first + 2) return false;
  if (words.size() == first + 2) entry.type = words[first], entry.second = words[first + 1];
  return !counted || parse_number(words[1], entry.tuples);
}

bool parse_entry(std::string_view line, Entry& entry) {
  const std::vector<std::string_view> words = split_words(line);
  if (words.empty()) return false;
  const auto kind = kind_of_keyword(words[0]);
  if (!kind) return false;
  entry.kind = *kind;
  if (holds_values(*kind)) return parse_values_entry(words, entry);
  if (const std::size_t plain = plain_words(*kind); plain > 0) {
    entry.type = line.substr(words[0].size() + (words.size() > 1));
    return words.size() == plain + 1;
  }
  if (lists_cells(*kind)) return parse_list_entry(words, entry);
  switch (*kind) {
    case EntryKind::field:
      if (words.size() != 3) return false;
      entry.name = words[1];
      return parse_number(words[2], entry.tuples);
    case EntryKind::points:
      if (words.size() != 2) return false;
      entry.type = words[1];
      return true;
    default: return words.size() == 1;
  }
}

}  // namespace

ValueForm form_of_word(std::string_view word) {
  const TypeWord* known = find_type(word);
  return known == nullptr ? ValueForm::unknown : known->form;
}

std::optional<ScalarType> scalar_of_word(std::string_view word, bool binary) {
  const TypeWord* known = find_type(word);
  if (known == nullptr || known->form != ValueForm::number) return std::nullopt;
  if (known->prefix == "vtkidtype" && !binary) return ScalarType::int64;
  return known->type;
}

std::optional<ScalarType> array_type_of_word(std::string_view word, bool binary) {
  switch (form_of_word(word)) {
    case ValueForm::number: return scalar_of_word(word, binary);
    case ValueForm::bit: return ScalarType::uint8;
    case ValueForm::string:
    case ValueForm::variant: return ScalarType::uint32;
    case ValueForm::unknown: break;
  }
  return std::nullopt;
}

std::string_view word_of_scalar(ScalarType type) {
  switch (type) {
    case ScalarType::int8: return "char";
    case ScalarType::uint8: return "unsigned_char";
    case ScalarType::int16: return "short";
    case ScalarType::uint16: return "unsigned_short";
    case ScalarType::int32: return "int";
    case ScalarType::uint32: return "unsigned_int";
    case ScalarType::int64: return "vtktypeint64";
    case ScalarType::uint64: return "vtktypeuint64";
    case ScalarType::float32: return "float";
    case ScalarType::float64: return "double";
  }
  return "double";
}

BlockInfo block_of_cell_type(int type, std::uint32_t nodes) {
  const auto block = [&](CellShape shape) {
    return BlockInfo{type, {}, shape, nodes, NodeScheme::lagrange};
  };
  const CellKind* other_size = nullptr;
  for (const CellKind& kind : kCellKinds) {
    if (kind.type != type) continue;
    if (kind.nodes == 0 || kind.nodes == nodes) return block(kind.shape);
    other_size = &kind;
  }
  if (type >= kFirstLagrange && type <= kLastBezier) {
    if (BlockInfo known = high_order_block(type, nodes); known.shape != CellShape::other)
      return known;
    // Lagrange and Bezier hexahedra of other orders list the corners first. If other hexahedra have
    // as many nodes, these are excluded, because their nodes have another order or meaning.
    const bool is_known = cell_order(block(CellShape::hexahedron)) != 0;
    const bool is_hexahedron = type == kLagrangeHexahedron || type == kBezierHexahedron;
    return block(is_hexahedron && nodes >= 8 && !is_known ? CellShape::hexahedron
                                                          : CellShape::other);
  }
  // Accept a number of nodes that does not match the type, because some writers use the linear type
  // for second-order cells.
  const bool in_order = other_size != nullptr && type != kVoxel && type != kPixel;
  const bool is_kind =
      in_order &&
      std::any_of(std::begin(kCellKinds), std::end(kCellKinds), [&](const CellKind& other) {
        return other.shape == other_size->shape && other.nodes == nodes;
      });
  return block(is_kind ? other_size->shape : CellShape::other);
}

bool has_model_nodes(const BlockInfo& block) {
  if (block.id < kFirstLagrange || block.id > kLastBezier) return true;
  const auto type = static_cast<int>(block.id);
  return is_in_table(type, block.nodes_per_cell) ||
         high_order_block(type, block.nodes_per_cell).shape != CellShape::other;
}

int cell_type_of_block(const BlockInfo& block) {
  constexpr int kConvexPointSet = 41, kPolyVertex = 2;
  // The faces of cells with the shape `polyhedron` are in extras, which this function does not
  // have, so these cells are written as point sets.
  if (block.shape == CellShape::polyhedron) return kConvexPointSet;
  if (block.scheme == NodeScheme::lagrange)
    for (const CellKind& kind : kCellKinds)
      if (kind.shape == block.shape && (kind.nodes == 0 || kind.nodes == block.nodes_per_cell))
        return kind.type;
  const auto shape = std::find(kLagrangeShapes.begin(), kLagrangeShapes.end(), block.shape);
  if (shape == kLagrangeShapes.end() || cell_order(block) == 0 ||
      block.scheme == NodeScheme::serendipity)
    return kPolyVertex;
  return (block.scheme == NodeScheme::bezier ? kFirstBezier : kFirstLagrange) +
         static_cast<int>(shape - kLagrangeShapes.begin());
}

bool has_cell_type(const BlockInfo& block) {
  constexpr int kConvexPointSet = 41, kPolyVertex = 2;
  const int type = cell_type_of_block(block);
  return type != kPolyVertex && type != kConvexPointSet;
}

bool has_varying_nodes(int type) {
  return type == 2 || type == 4 || type == 6 || type == 7 || type == 36 || type == 41 ||
         type == kPolyhedron;
}

void permute_nodes(int type, std::uint64_t* nodes, std::size_t count, bool old_numbering) {
  const bool voxel = type == kVoxel && count == 8;
  if (voxel || (type == kPixel && count == 4)) std::swap(nodes[2], nodes[3]);
  if (voxel) std::swap(nodes[6], nodes[7]);
  if (!old_numbering || (type != kLagrangeHexahedron && type != kBezierHexahedron)) return;
  const std::uint32_t order = order_of_hexahedron(count);
  if (order < 2) return;
  // The old numbering exchanges the last two of the 12 edges.
  std::uint64_t* const edge = nodes + 8 + 10 * std::size_t{order - 1};
  std::swap_ranges(edge, edge + (order - 1), edge + (order - 1));
}

std::string lower_case(std::string_view text) {
  std::string lower(text);
  for (char& c : lower)
    if (c >= 'A' && c <= 'Z') c = static_cast<char>(c - 'A' + 'a');
  return lower;
}

std::string encode_name(std::string_view name) {
  constexpr std::string_view kDigits = "0123456789ABCDEF";
  std::string text;
  for (char c : name) {
    const auto byte = static_cast<unsigned char>(c);
    if (is_plain(c)) {
      text += c;
    } else {
      text += {'%', kDigits[byte >> 4], kDigits[byte & 15]};
    }
  }
  return text.empty() ? "array" : text;
}

std::string decode_name(std::string_view name) {
  std::string text;
  for (std::size_t i = 0; i < name.size(); ++i) {
    unsigned byte = 0;
    const char* end = name.data() + i + 3;
    if (name[i] == '%' && i + 2 < name.size() &&
        std::from_chars(name.data() + i + 1, end, byte, 16).ptr == end) {
      text += static_cast<char>(byte);
      i += 2;
    } else {
      text += name[i];
    }
  }
  return text;
}

std::string_view dataset_word(Dataset dataset) {
  return kDatasets[static_cast<std::size_t>(dataset)];
}

std::optional<Dataset> dataset_of_word(std::string_view upper_case_word) {
  const auto found = std::find(kDatasets.begin(), kDatasets.end(), upper_case_word);
  if (found == kDatasets.end()) return std::nullopt;
  return static_cast<Dataset>(found - kDatasets.begin());
}

std::size_t plain_words(EntryKind kind) {
  if (kind == EntryKind::extent) return 6;
  return kind >= EntryKind::dimensions && kind <= EntryKind::origin ? 3 : 0;
}

int cell_type_in(EntryKind list, std::uint64_t nodes) {
  if (nodes == 0) return 0;
  switch (list) {
    case EntryKind::vertices: return nodes == 1 ? 1 : 2;
    case EntryKind::lines: return nodes == 2 ? 3 : 4;
    case EntryKind::polygons: return nodes == 3 ? 5 : nodes == 4 ? 9 : 7;
    default: return 6;
  }
}

std::string_view keyword(EntryKind kind) { return kKeywords[static_cast<std::size_t>(kind)]; }

std::optional<EntryKind> kind_of_keyword(std::string_view upper_case_word) {
  const auto found = std::find(kKeywords.begin(), kKeywords.end(), upper_case_word);
  if (found == kKeywords.end()) return std::nullopt;
  return static_cast<EntryKind>(found - kKeywords.begin());
}

std::uint64_t fixed_components(EntryKind kind) {
  switch (kind) {
    case EntryKind::vectors:
    case EntryKind::normals: return 3;
    case EntryKind::tensors: return 9;
    case EntryKind::tensors6: return 6;
    case EntryKind::lookup_table: return 4;
    case EntryKind::global_ids:
    case EntryKind::pedigree_ids:
    case EntryKind::edge_flags:
    case EntryKind::x_coordinates:
    case EntryKind::y_coordinates:
    case EntryKind::z_coordinates:
    case EntryKind::blanking: return 1;
    default: return 0;
  }
}

std::string data_key(std::size_t index) { return "vtk/data/" + std::to_string(index); }

std::string to_text(const Skeleton& skeleton) {
  std::string text =
      skeleton.version + '\n' + skeleton.title + '\n' + (skeleton.binary ? "BINARY\n" : "ASCII\n");
  if (skeleton.dataset != Dataset::unstructured_grid)
    text.append("DATASET ").append(dataset_word(skeleton.dataset)).append("\n");
  for (const Entry& entry : skeleton.entries) {
    text += keyword(entry.kind);
    if (holds_values(entry.kind)) {
      text += entry.origin == Origin::array ? " a" : " x";
      text += std::to_string(entry.index) + ' ' + entry.name + ' ' + entry.type + ' ' +
              std::to_string(entry.components) + ' ' + std::to_string(entry.tuples);
      if (entry.kind == EntryKind::scalars) text += ' ' + entry.second;
    } else if (entry.kind == EntryKind::field) {
      text += ' ' + entry.name + ' ' + std::to_string(entry.tuples);
    } else {
      if (lists_cells(entry.kind) && entry.kind != EntryKind::cells)
        text += ' ' + std::to_string(entry.tuples);
      if (!entry.type.empty()) text += ' ' + entry.type;
      if (!entry.second.empty()) text += ' ' + entry.second;
    }
    text += '\n';
    for (std::string_view rest = entry.metadata; !rest.empty();)
      text.append("|").append(take_line(rest)).append("\n");
  }
  return text;
}

std::optional<Skeleton> parse_skeleton(std::string_view text) {
  Skeleton skeleton;
  skeleton.version = take_line(text);
  skeleton.title = take_line(text);
  const std::string_view encoding = take_line(text);
  const std::string& version = skeleton.version;
  if (version.size() < 3 || version.size() > 8 || version[1] != '.' || version[0] < '1' ||
      version[0] > '5' || (encoding != "BINARY" && encoding != "ASCII"))
    return std::nullopt;
  skeleton.binary = encoding == "BINARY";
  constexpr std::string_view kDataset = "DATASET ";
  if (text.starts_with(kDataset)) {
    const auto dataset = dataset_of_word(take_line(text).substr(kDataset.size()));
    if (!dataset) return std::nullopt;
    skeleton.dataset = *dataset;
  }
  while (!text.empty()) {
    const std::string_view line = take_line(text);
    if (line.starts_with('|')) {
      if (skeleton.entries.empty()) return std::nullopt;
      skeleton.entries.back().metadata.append(line.substr(1)).append("\n");
    } else {
      Entry entry;
      if (!parse_entry(line, entry)) return std::nullopt;
      skeleton.entries.push_back(std::move(entry));
    }
  }
  return skeleton;
}

}  // namespace shm::converters::vtk
