// Reads VTU files: first the XML tree, then the numbers of each array in the tree. Stores these
// numbers in the spool or as extras.
#include <algorithm>
#include <cstring>
#include <map>
#include <string_view>
#include <tuple>
#include <utility>

#include "base/failure.h"
#include "base/text_input.h"
#include "mesh/mesh_source.h"
#include "vtk/between/family.h"
#include "vtk/strings.h"
#include "vtk/xml/cells.h"
#include "vtk/xml/loader.h"
#include "vtk/xml/vtu.h"
#include "vtk/xml_document.h"

namespace shm::converters {
namespace vtu {
namespace {

constexpr std::uint64_t kMostComponents = 65535;
constexpr std::uint64_t kMostStringBytes = std::uint64_t{1} << 30;

class VtuSource : public MeshSource {
 public:
  explicit VtuSource(Spool& spool) : points_(spool, 1) {}
  const MeshInfo& info() const override { return info_; }
  void read_points(std::uint64_t first, std::uint64_t count, std::byte* out) override {
    points_.read(first * 3, count * 3, out);
  }
  bool next_cells(CellBatch& out, std::size_t max_cells) override {
    out.clear();
    cells_.next_cells(out, max_cells);
    return out.size() > 0;
  }
  void rewind_cells() override { cells_.rewind(); }
  void read_array(std::size_t array, std::uint64_t step, std::uint64_t first, std::uint64_t count,
                  std::byte* out) override {
    const std::uint64_t components = info_.schema.arrays[array].components;
    if (count > 0) arrays_[array][step].read(first * components, count * components, out);
  }

 private:
  friend class Parser;
  MeshInfo info_;
  PagedArray points_;
  vtk::CellTable cells_;
  std::vector<std::vector<PagedArray>> arrays_;  // indexed by array, then by step
};

// A point or cell array of one <Piece> element. The file contains one XML element for all time
// steps of the array, or one XML element per time step.
struct Column {
  std::string name;
  std::uint64_t occurrence = 0;  // number of earlier arrays with the same name in the piece
  ArrayType type;
  std::uint64_t components = 1;
  bool per_step = false;
  bool constant = false;  // true: the values are the same at all steps
  std::vector<Node*> nodes;
  // Returns a key that is unique within a piece. Columns of different pieces that have the same key
  // are joined into one array of the mesh.
  auto key() const {
    return std::tuple(std::string_view(name), occurrence, type.kind, type.stored, components,
                      per_step, constant);
  }
};

class Parser {
 public:
  Parser(const std::string& path, Spool& spool, VtuSource& source)
      : path_(path),
        spool_(spool),
        source_(source),
        info_(source.info_),
        document_(read_document(path)),
        loader_(path, document_, info_),
        cells_(loader_, spool) {}
  void parse();

 private:
  struct Piece {
    Node* node;
    PieceRange range;
  };
  void find_pieces(Node& grid);
  void find_steps(const Node& grid);
  void points();
  void begin_points(const ArrayType& type);
  void points_of_step(Node& array, Node& first, const PieceRange& piece);
  void load_points(Node& array, const ArrayType& type, const PieceRange& piece);
  void data(Location location, const char* element_name);
  std::vector<Column> columns_of(Node& data);
  bool join_steps(std::vector<Column>& columns, Column& column, std::vector<Node*>& nodes);
  void load_column(Location location, const std::vector<std::pair<Column, Piece>>& parts,
                   const std::string& role);
  void load_strings(Location location, const std::vector<std::pair<Column, Piece>>& parts);
  void keep_rest(Node& node);
  static void forget_offsets(Node& node);
  std::uint64_t product(const Node& node, std::uint64_t a, std::uint64_t b) const;

  std::string path_;
  Spool& spool_;
  VtuSource& source_;
  MeshInfo& info_;
  Document document_;
  ArrayLoader loader_;
  CellCollector cells_;
  std::vector<Piece> pieces_;
  std::vector<double> times_;
};

void Parser::parse() {
  info_.schema.source_format = "vtu";
  Node* grid = document_.root().child("UnstructuredGrid");
  if (grid == nullptr)
    loader_.fail(ErrorCode::corrupt, document_.root(), "has no element UnstructuredGrid");
  find_steps(*grid);
  find_pieces(*grid);
  points();
  for (Piece& piece : pieces_) {
    Node* cells = piece.node->child("Cells");
    if (cells != nullptr) cells_.add_piece(*cells, piece.range);
    if (cells == nullptr && piece.range.cells > 0)
      loader_.fail(ErrorCode::corrupt, *piece.node, "has cells, but no element Cells");
  }
  cells_.finish(source_.cells_, info_);
  data(Location::point, "PointData");
  data(Location::cell, "CellData");
  keep_rest(document_.root());
  forget_offsets(document_.root());
  source_.cells_.set_old_numbering(document_.root().attribute_or("version", "0.1") <
                                   vtk::kNewNumberingInXml);
  source_.cells_.find_blocks(info_, path_);
  info_.extras.push_back(vtk::cell_types_extra(info_));
  const std::string text = to_text(document_);
  Extra skeleton{"vtu/skeleton", ScalarType::uint8, Reference::nothing, {text.size()}, {}};
  skeleton.data.resize(text.size());
  std::memcpy(skeleton.data.data(), text.data(), text.size());
  info_.extras.push_back(std::move(skeleton));
}

std::uint64_t Parser::product(const Node& node, std::uint64_t a, std::uint64_t b) const {
  std::uint64_t result = 0;
  if (__builtin_mul_overflow(a, b, &result))
    loader_.fail(ErrorCode::corrupt, node, "declares more values than a file can hold");
  return result;
}

void Parser::find_steps(const Node& grid) {
  const std::string text = grid.attribute_or("TimeValues", "");
  for (std::size_t position = 0; position < text.size();) {
    const std::size_t begin = text.find_first_not_of(" \t\r\n", position);
    if (begin == std::string::npos) break;
    position = std::min(text.find_first_of(" \t\r\n", begin), text.size());
    double time = 0;
    if (!TextInput::parse(std::string_view(text).substr(begin, position - begin), time))
      loader_.fail(ErrorCode::corrupt, grid, "TimeValues are not numbers");
    times_.push_back(time);
  }
}

void Parser::find_pieces(Node& grid) {
  PieceRange next;
  for (Node& each : grid.children) {
    if (!each.is("Piece")) continue;
    next.points = loader_.count_attribute(each, "NumberOfPoints");
    next.cells = loader_.count_attribute(each, "NumberOfCells");
    constexpr std::uint64_t kMost = std::uint64_t{1} << 60;
    if (next.points > kMost - next.first_point || next.cells > kMost - next.first_cell)
      loader_.fail(ErrorCode::corrupt, each, "declares more points or cells than a file can hold");
    pieces_.push_back({&each, next});
    next.first_point += next.points;
    next.first_cell += next.cells;
    // Check the limits on the number of points and cells before unpacking any array.
    if (std::max(next.first_point, next.first_cell) > spool_.limits().most)
      loader_.fail(ErrorCode::over_limit, each,
                   "the pieces so far have more points or cells than the limit of " +
                       std::to_string(spool_.limits().most));
  }
  info_.vertices = next.first_point;
}

// Reads the points of all pieces. As in VTK, the points of all non-empty pieces must have the same
// scalar type.
void Parser::points() {
  source_.points_ = PagedArray(spool_, scalar_bytes(ScalarType::float64));
  std::optional<ArrayType> type;
  for (Piece& piece : pieces_) {
    Node* points = piece.node->child("Points");
    Node* first = nullptr;
    for (std::size_t i = 0; points != nullptr && i < points->children.size(); ++i) {
      Node& each = points->children[i];
      if (!each.is_array()) continue;
      if (first != nullptr) {
        points_of_step(each, *first, piece.range);
        continue;
      }
      first = &each;
      const auto own = loader_.type_of(each);
      if (!own || own->kind != ArrayKind::number)
        loader_.fail(ErrorCode::unsupported, each, "has a type that coordinates cannot have");
      if (piece.range.points > 0) {
        if (!type) begin_points(*own);
        if (type && *type != *own)
          loader_.fail(ErrorCode::unsupported, each, "the pieces have points of different types");
        type = own;
        load_points(each, *own, piece.range);
      }
      loader_.mark(each, "points");
    }
    if (first == nullptr && piece.range.points > 0)
      loader_.fail(ErrorCode::corrupt, *piece.node, "has points, but no array of points");
  }
}

void Parser::begin_points(const ArrayType& type) {
  info_.schema.coordinate_type =
      type.stored == ScalarType::float32 ? ScalarType::float32 : ScalarType::float64;
  source_.points_ = PagedArray(spool_, scalar_bytes(info_.schema.coordinate_type));
}

// Reads the points of a later time step. They are stored as a separate array unless they are the
// same as the points of the first step.
void Parser::points_of_step(Node& array, Node& first, const PieceRange& piece) {
  if (piece.points == 0 || loader_.same_values(first, array, spool_))
    return loader_.mark_like(array, first.values()->text);
  const auto type = loader_.type_of(array);
  if (pieces_.size() > 1 || !type || type->kind != ArrayKind::number)
    loader_.fail(ErrorCode::unsupported, array,
                 "points that change over time are supported only in files with one piece");
  load_column(
      Location::point,
      {{{.name = "Points", .type = *type, .components = 3, .nodes = {&array}}, pieces_.front()}},
      "vtu:points");
}

void Parser::load_points(Node& array, const ArrayType& type, const PieceRange& piece) {
  if (loader_.components_of(array) != 3)
    loader_.fail(ErrorCode::corrupt, array, "points do not have 3 components");
  const std::uint64_t count = product(array, piece.points, 3);
  if (is_float(type.stored)) return loader_.load(array, type, count, source_.points_);
  // Integer coordinates are converted to double.
  std::vector<std::byte> wide;
  const std::size_t width = scalar_bytes(type.stored);
  const std::uint64_t found = loader_.read(array, type, count, [&](auto values) {
    const std::size_t n = values.size() / width;
    wide.resize(n * sizeof(double));
    vtk::convert_numbers(type.stored, values.data(), n, ScalarType::float64, wide.data());
    source_.points_.append(n, wide.data());
  });
  if (found != count) loader_.fail(ErrorCode::truncated, array, "has too few values");
}

// Joins the arrays of all time steps into one column. Returns false unless there is exactly one
// array for each step.
bool Parser::join_steps(std::vector<Column>& columns, Column& column, std::vector<Node*>& nodes) {
  column.nodes.assign(times_.size(), nullptr);
  for (Node* node : nodes) {
    const auto step = parse_count(node->attribute_or("TimeStep", ""));
    const auto type = loader_.type_of(*node);
    if (!step || *step >= times_.size() || column.nodes[*step] != nullptr || !type ||
        *type != column.type || loader_.components_of(*node) != column.components)
      return false;
    column.nodes[*step] = node;
  }
  if (nodes.size() != times_.size()) return false;
  Node& first = *column.nodes.front();
  const bool strings = column.type.kind == ArrayKind::string;
  column.constant = std::all_of(nodes.begin(), nodes.end(), [&](Node* node) {
    return strings ? loader_.same_values(first, *node, spool_)
                   : ArrayLoader::same_place(first, *node);
  });
  column.per_step = !column.constant;
  if (column.per_step && strings) return false;
  columns.push_back(column);
  return true;
}

std::vector<Column> Parser::columns_of(Node& data) {
  std::vector<Column> columns;
  std::vector<std::string> order;
  std::map<std::string, std::vector<Node*>> stepped;
  std::map<std::string, std::uint64_t> occurrences;
  for (Node& each : data.children) {
    if (!each.is_array()) continue;
    Column column{.name = each.attribute_or("Name", ""), .nodes = {&each}};
    const auto type = loader_.type_of(each);
    column.components = loader_.components_of(each);
    if (!type || column.components > kMostComponents) continue;
    column.type = *type;
    if (!times_.empty() && each.attribute("TimeStep") != nullptr) {
      if (!stepped.contains(column.name)) {
        order.push_back(column.name);
        columns.push_back(column);  // placeholder for the column that join_steps() creates
      }
      stepped[column.name].push_back(&each);
      continue;
    }
    column.occurrence = occurrences[column.name]++;
    columns.push_back(std::move(column));
  }
  std::vector<Column> joined;
  for (Column& column : columns) {
    const auto steps = stepped.find(column.name);
    const bool first = steps != stepped.end() && !steps->second.empty() &&
                       column.nodes.front() == steps->second.front();
    if (!first) {
      joined.push_back(std::move(column));
      continue;
    }
    if (join_steps(joined, column, steps->second)) continue;
    column.per_step = column.constant = false;
    for (Node* node : steps->second) {
      column.nodes = {node};
      column.type = *loader_.type_of(*node);
      column.components = loader_.components_of(*node);
      column.occurrence = occurrences[column.name]++;
      joined.push_back(column);
    }
  }
  return joined;
}

void Parser::data(Location location, const char* element_name) {
  const auto elements = [&](const Piece& piece) {
    return location == Location::point ? piece.range.points : piece.range.cells;
  };
  const bool all_empty =
      std::all_of(pieces_.begin(), pieces_.end(), [&](const Piece& p) { return elements(p) == 0; });
  std::vector<std::vector<Column>> of_piece;
  std::size_t leader = pieces_.size(), others = 0;
  for (std::size_t p = 0; p < pieces_.size(); ++p) {
    Node* node = pieces_[p].node->child(element_name);
    of_piece.push_back(node == nullptr ? std::vector<Column>() : columns_of(*node));
    if (!all_empty && elements(pieces_[p]) == 0) continue;
    if (leader == pieces_.size()) leader = p;
    ++others;
  }
  if (leader == pieces_.size()) return;
  struct Parts {
    std::vector<std::pair<Column, Piece>> list;
    std::size_t found = 0;  // number of non-empty pieces with this column
  };
  std::map<decltype(Column().key()), Parts> parts_of;
  for (const Column& column : of_piece[leader]) parts_of.try_emplace(column.key());
  for (std::size_t p = 0; p < pieces_.size(); ++p) {
    for (const Column& each : of_piece[p]) {
      const auto parts = parts_of.find(each.key());
      if (parts == parts_of.end()) continue;
      parts->second.list.emplace_back(each, pieces_[p]);
      parts->second.found += all_empty || elements(pieces_[p]) > 0;
    }
  }
  for (const Column& column : of_piece[leader]) {
    const Parts& parts = parts_of.at(column.key());
    if (parts.found != others) continue;
    if (column.type.kind == ArrayKind::string)
      load_strings(location, parts.list);
    else
      load_column(location, parts.list, {});
  }
  // The remaining arrays cannot become arrays of the mesh, e.g. because some pieces lack them. They
  // are kept as extras.
  for (std::size_t p = 0; p < pieces_.size(); ++p) {
    Node* node = pieces_[p].node->child(element_name);
    if (node == nullptr) continue;
    for (Node& each : node->children) {
      if (!each.is_array()) continue;
      if (const Node* v = each.values(); v != nullptr && !v->text.empty()) continue;
      const auto type = loader_.type_of(each);
      const bool text = type && type->kind == ArrayKind::string;
      loader_.keep_as_extra(
          each, text ? kNoLimit : product(each, elements(pieces_[p]), loader_.components_of(each)));
    }
  }
}

void Parser::load_column(Location location, const std::vector<std::pair<Column, Piece>>& parts,
                         const std::string& role) {
  const Column& column = parts.front().first;
  ArrayInfo array;
  array.name = column.name;
  array.location = location;
  array.type = column.type.stored;
  array.components = static_cast<std::uint32_t>(column.components);
  array.per_step = column.per_step;
  array.role = role;
  if (column.per_step) info_.step_times = times_;
  const std::string word = 'a' + std::to_string(info_.schema.arrays.size());
  info_.schema.arrays.push_back(std::move(array));
  auto& steps = source_.arrays_.emplace_back();
  for (std::size_t s = 0; s < (column.per_step ? times_.size() : 1); ++s)
    steps.emplace_back(spool_, scalar_bytes(column.type.stored));
  for (const auto& [part, piece] : parts) {
    const std::uint64_t elements =
        location == Location::point ? piece.range.points : piece.range.cells;
    for (std::size_t s = 0; s < part.nodes.size(); ++s) {
      Node& node = *part.nodes[s];
      if (part.constant && s > 0) {
        loader_.mark_like(node, part.nodes.front()->values()->text);
        continue;
      }
      loader_.load(node, part.type, product(node, elements, part.components), steps[s]);
      loader_.mark(node, word + (part.per_step ? 's' + std::to_string(s) : ""));
    }
  }
}

// Reads an array of strings. Stores the distinct strings in a list, and the array as indices into
// this list. The reader of legacy VTK files does the same.
void Parser::load_strings(Location location, const std::vector<std::pair<Column, Piece>>& parts) {
  const Column& column = parts.front().first;
  const std::size_t index = info_.schema.arrays.size();
  ArrayInfo array;
  array.name = column.name;
  array.location = location;
  array.type = ScalarType::uint32;
  array.components = static_cast<std::uint32_t>(column.components);
  array.role = vtk::kStringRole;
  info_.schema.arrays.push_back(std::move(array));
  PagedArray& places = source_.arrays_.emplace_back().emplace_back(spool_, sizeof(std::uint32_t));
  vtk::StringLister strings(kMostStringBytes);
  std::string one;
  for (const auto& [part, piece] : parts) {
    Node& node = *part.nodes.front();
    const std::uint64_t wanted =
        product(node, location == Location::point ? piece.range.points : piece.range.cells,
                part.components);
    std::uint64_t found = 0;
    const auto end_of_string = [&] {
      const auto place = strings.place_of(one);
      if (!place)
        loader_.fail(ErrorCode::unsupported, node, "has more than 1 GiB of distinct strings");
      if (found++ == wanted)
        loader_.fail(ErrorCode::corrupt, node,
                     "has more than the expected " + std::to_string(wanted) + " strings");
      places.append(1, reinterpret_cast<const std::byte*>(&*place));
      one.clear();
    };
    loader_.read(node, part.type, kNoLimit, [&](std::span<const std::byte> bytes) {
      for (const std::byte byte : bytes) {
        one += static_cast<char>(byte);
        if (byte == std::byte{}) end_of_string();
        if (one.size() > kMostStringBytes)
          loader_.fail(ErrorCode::unsupported, node, "has a string longer than 1 GiB");
      }
    });
    if (found != wanted || !one.empty())
      loader_.fail(ErrorCode::truncated, node,
                   "has " + std::to_string(found) + " strings, but " + std::to_string(wanted) +
                       " are expected");
    loader_.mark(node, 'a' + std::to_string(index));
    for (Node* same : part.nodes)
      if (same != &node) loader_.mark_like(*same, node.values()->text);
  }
  info_.extras.push_back(text_extra(vtk::strings_key(index), strings.list()));
}

// Stores all remaining arrays as extras: field data, and arrays in XML elements that VTK ignores.
void Parser::keep_rest(Node& node) {
  for (Node& each : node.children) {
    if (!each.is_array()) {
      keep_rest(each);
      continue;
    }
    if (const Node* v = each.values(); v != nullptr && !v->text.empty()) continue;
    const auto type = loader_.type_of(each);
    std::uint64_t most = kNoLimit;
    if (type && type->kind != ArrayKind::string && each.attribute("NumberOfTuples") != nullptr)
      most = product(each, loader_.count_attribute(each, "NumberOfTuples"),
                     loader_.components_of(each));
    loader_.keep_as_extra(each, most);
  }
}

// Removes offsets into appended data from the tree, because they are valid only for the source
// file. The writer computes new offsets.
void Parser::forget_offsets(Node& node) {
  if (node.is_array()) node.remove_attribute("offset");
  for (Node& each : node.children) forget_offsets(each);
}

}  // namespace
}  // namespace vtu

bool looks_like_vtu(std::span<const std::byte> head) {
  const std::string_view text(reinterpret_cast<const char*>(head.data()), head.size());
  constexpr std::string_view kBlankOrMark = " \t\r\n\xef\xbb\xbf";
  const std::size_t first = text.find_first_not_of(kBlankOrMark);
  return first != std::string_view::npos && text[first] == '<' &&
         text.find("<VTKFile", first) != std::string_view::npos;
}

std::unique_ptr<MeshSource> open_vtu(const std::string& path, Spool& spool) {
  auto source = std::make_unique<vtu::VtuSource>(spool);
  vtu::Parser(path, spool, *source).parse();
  return source;
}

}  // namespace shm::converters
