#include "vtk/xml/plan.h"

#include <algorithm>
#include <charconv>
#include <utility>

#include "vtk/between/field_data.h"
#include "vtk/between/vtu_from_vtk.h"
#include "vtk/between/xml_contents.h"
#include "vtk/strings.h"
#include "vtk/words.h"
#include "vtk/xml/loader.h"

namespace shm::converters::vtu {
namespace {

constexpr std::string_view kSkeletonKey = "vtu/skeleton";
bool is_piece(const Node& node) { return node.is("Piece"); }

Node& child_of(Node& parent, std::string_view name) {
  if (Node* found = parent.child(name)) return *found;
  return parent.children.emplace_back(element(std::string(name)));
}

Node* array_named(Node& parent, std::string_view name) {
  for (Node& each : parent.children)
    if (each.is_array() && each.attribute_or("Name", "") == name) return &each;
  return nullptr;
}

}  // namespace

VtuPlan::VtuPlan(MeshSource& mesh) : CellPlan(mesh) {
  const Extra* text =
      info_.schema.source_format == "vtu" ? extra(std::string(kSkeletonKey)) : nullptr;
  own_ = text != nullptr;
  if (own_) {
    plan_from_source(*text);
  } else {
    plan_for_foreign();
  }
  set_old_numbering(document_.root().attribute_or("version", "0.1") < vtk::kNewNumberingInXml);
  std::size_t next_piece = 0;
  for (Node& piece : grid().children) {
    if (!is_piece(piece)) continue;
    by_node_[&piece] = next_piece;
    fit_cells(piece, pieces_[next_piece++]);
    add_unplaced_arrays(piece, Location::point);
    add_unplaced_arrays(piece, Location::cell);
  }
}

Node& VtuPlan::grid() { return *document_.root().child("UnstructuredGrid"); }

void VtuPlan::plan_from_source(const Extra& text) {
  const auto* begin = reinterpret_cast<const char*>(text.data.data());
  auto parsed = parse_skeleton({begin, text.data.size()});
  if (!parsed || parsed->root().child("UnstructuredGrid") == nullptr)
    vtk::fail_extra(text.key, "the stored structure of the VTU file is invalid");
  document_ = std::move(*parsed);
  read_head();
  add_time(grid());
  find_pieces();
  for (Node& piece : grid().children) {
    if (!is_piece(piece)) continue;
    if (Node* data = piece.child("PointData")) fit_arrays(*data, Location::point);
    if (Node* data = piece.child("CellData")) fit_arrays(*data, Location::cell);
  }
}

void VtuPlan::read_head() {
  Node& root = document_.root();
  const auto compressor = compressor_of_name(root.attribute_or("compressor", ""));
  if (!compressor) vtk::fail_extra(std::string(kSkeletonKey), "names an unknown compressor");
  form_.compressor = *compressor;
  form_.big_endian = root.attribute_or("byte_order", "") == "BigEndian";
  form_.header_bytes = root.attribute_or("header_type", "") == "UInt64" ? 8 : 4;
  if (Node* appended = root.child("AppendedData")) {
    raw_appended_ = appended->attribute_or("encoding", "base64") == "raw";
  } else {
    format_ = form_.compressor == Compressor::none ? "ascii" : "binary";
  }
}

// Determines which points and cells belong to each <Piece> element. Joins the pieces into one if
// the pieces of the source file no longer match the mesh, e.g. because it was renumbered.
void VtuPlan::find_pieces() {
  PieceRange next;
  bool valid = true;
  std::size_t count = 0;
  for (Node& piece : grid().children) {
    if (!is_piece(piece)) continue;
    ++count;
    const auto points = parse_count(piece.attribute_or("NumberOfPoints", ""));
    const auto cells = parse_count(piece.attribute_or("NumberOfCells", ""));
    valid = valid && points && cells && *points <= info_.vertices - next.first_point &&
            *cells <= info_.cells() - next.first_cell;
    if (!valid) break;
    next.points = *points;
    next.cells = *cells;
    pieces_.push_back(next);
    next.first_point += next.points;
    next.first_cell += next.cells;
  }
  valid = valid && next.first_point == info_.vertices && next.first_cell == info_.cells();
  if (!valid || (count > 1 && info_.schema.order != Order::keep)) join_pieces();
}

// Makes the first piece that has cells contain the whole mesh, and removes all other pieces. Also
// removes the arrays of this piece that are stored as extras, because an extra contains values only
// for the original piece.
void VtuPlan::join_pieces() {
  pieces_ = {{0, info_.vertices, 0, info_.cells()}};
  auto& nodes = grid().children;
  auto kept = std::find_if(nodes.begin(), nodes.end(), [](Node& node) {
    return is_piece(node) && parse_count(node.attribute_or("NumberOfCells", "")).value_or(0) > 0;
  });
  if (kept == nodes.end()) kept = std::find_if(nodes.begin(), nodes.end(), is_piece);
  Node piece = kept == nodes.end() ? element("Piece") : *kept;
  std::erase_if(nodes, is_piece);
  piece.set_attribute("NumberOfPoints", std::to_string(info_.vertices));
  piece.set_attribute("NumberOfCells", std::to_string(info_.cells()));
  for (Node& part : piece.children)
    std::erase_if(part.children, [](Node& array) {
      return array.is_array() && array.values() != nullptr && array.values()->text.starts_with('x');
    });
  nodes.push_back(std::move(piece));
}

void VtuPlan::fit_arrays(Node& data, Location location) {
  std::erase_if(data.children,
                [&](Node& each) { return each.is_array() && !fits(each, location); });
}

// Returns true if the mesh has the array to which the XML element `array` refers, and if the
// attributes of the element (type, components) are still correct for that array.
bool VtuPlan::fits(Node& array, Location location) {
  Node* node = array.values();
  const auto word = node == nullptr ? std::nullopt : parse_values_word(node->text);
  if (!word) return false;
  // Values that are stored as an extra, not as an array of the schema, remain in the order of the
  // source file. They are valid only if the mesh has kept this order (Order::keep).
  if (word->kind != ValuesWord::Kind::array) return info_.schema.order == Order::keep;
  if (word->index >= info_.schema.arrays.size()) return false;
  const ArrayInfo& info = info_.schema.arrays[word->index];
  const auto type = type_of_word(array.attribute_or("type", ""));
  const auto components = parse_count(array.attribute_or("NumberOfComponents", "1"));
  if (!type || !is_of_type(info, *type) || !components ||
      std::max<std::uint64_t>(*components, 1) != info.components || info.location != location ||
      info.per_step != word->step.has_value() || !info.blocks.empty())
    return false;
  if (word->step && *word->step >= info_.step_times.size()) return false;
  // The values were rounded, so the value ranges stored in the XML may be wrong.
  if (info.quantization.lossy()) forget_ranges(array);
  placed_.insert(word->index);
  return true;
}

// Returns true if the mesh array `info` can be written as an array of type `type`. An array of
// strings is stored as indices into a list of strings, and has no time steps.
bool VtuPlan::is_of_type(const ArrayInfo& info, const ArrayType& type) const {
  if (type.kind == ArrayKind::string) return info.role == vtk::kStringRole && !info.per_step;
  return info.role.empty() && (!info.per_step || !info_.step_times.empty()) &&
         type.stored == info.type;
}

bool VtuPlan::is_written(std::size_t array) const {
  const ArrayInfo& info = info_.schema.arrays[array];
  return info.role.empty() && (!info.per_step || !info_.step_times.empty());
}

// Removes arrays from <Points> that the mesh cannot provide. Only the coordinates remain, and the
// arrays with the coordinates of later time steps.
void VtuPlan::fit_points(Node& points) {
  std::erase_if(points.children, [&](Node& each) {
    if (!each.is_array()) return false;
    const auto word =
        each.values() == nullptr ? std::nullopt : parse_values_word(each.values()->text);
    if (!word) return true;
    if (word->kind != ValuesWord::Kind::array) return word->word != "points";
    const auto& arrays = info_.schema.arrays;
    return word->index >= arrays.size() || arrays[word->index].role != "vtu:points" ||
           type_of_word(each.attribute_or("type", "")) !=
               ArrayType{ArrayKind::number, arrays[word->index].type};
  });
}

// Adds the array of points and the arrays of <Cells> if they are missing. Arrays of <Cells> that
// were kept as extras are valid only in the original order of the cells; in any other order, they
// are computed from the cells instead.
void VtuPlan::fit_cells(Node& piece, const PieceRange& range) {
  if (own_ && range.points == 0 && piece.child("Points") == nullptr) return;
  Node& points = child_of(piece, "Points");
  fit_points(points);
  const auto is_any_array = [](const Node& node) { return node.is_array(); };
  if (std::none_of(points.children.begin(), points.children.end(), is_any_array))
    points.children.push_back(array_element(std::string(word_of_type(info_.schema.coordinate_type)),
                                            "Points", 3, format_, "points"));
  if (info_.schema.coordinate_quantization.lossy())
    for (Node& each : points.children)
      if (each.is_array()) forget_ranges(each);
  if (own_ && range.cells == 0) return;
  Node& cells = child_of(piece, "Cells");  // VTK requires a <Cells> element even if no cells exist
  const auto need = [&](std::string_view name, const char* type) {
    Node* found = array_named(cells, name);
    if (found == nullptr)
      found = &cells.children.emplace_back(array_element(type, std::string(name), 1, format_, ""));
    if (found->values() == nullptr) found->children.push_back(values_node({}));
    const std::string& word = found->values()->text;
    const bool other_order = info_.schema.order != Order::keep && word.starts_with('x');
    if (word.empty() || other_order) found->values()->text = name;
  };
  need(kConnectivity, "Int64");
  need(kOffsets, "Int64");
  need(kTypes, "UInt8");
  if (!has_polyhedra()) return;
  const bool tables = array_named(cells, kPolyhedronEnds) != nullptr;
  if (!tables || array_named(cells, kFaces) != nullptr) {
    need(kFaces, "Int64");
    need(kFaceOffsets, "Int64");
  }
  if (!tables) return;
  for (const std::string_view name :
       {kFaceConnectivity, kFaceEnds, kPolyhedronFaces, kPolyhedronEnds})
    need(name, "Int64");
}

void VtuPlan::add_unplaced_arrays(Node& piece, Location location) {
  const bool of_points = location == Location::point;
  for (std::size_t i = 0; i < info_.schema.arrays.size(); ++i)
    if (info_.schema.arrays[i].location == location && is_written(i) && !placed_.contains(i))
      add_array(child_of(piece, of_points ? "PointData" : "CellData"), i);
}

void VtuPlan::add_array(Node& data, std::size_t array) const {
  const ArrayInfo& info = info_.schema.arrays[array];
  std::string word = 'a' + std::to_string(array);
  if (info.per_step) word += 's' + std::to_string(info_.step_times.size() - 1);
  data.children.push_back(array_element(std::string(word_of_type(info.type)), valid_name(info.name),
                                        info.components, format_, std::move(word)));
}

void VtuPlan::plan_for_foreign() {
  form_.compressor = Compressor::zlib;
  Node root = element("VTKFile", {{"type", "UnstructuredGrid"},
                                  {"version", "1.0"},
                                  {"byte_order", "LittleEndian"},
                                  {"header_type", "UInt64"},
                                  {"compressor", "vtkZLibDataCompressor"}});
  Node grid_node = element("UnstructuredGrid");
  Node piece = element("Piece", {{"NumberOfPoints", std::to_string(info_.vertices)},
                                 {"NumberOfCells", std::to_string(info_.cells())}});
  if (extra(vtk::kNewNumbering) != nullptr || makes_lagrange_cells())
    root.set_attribute("version", "2.2");
  if (info_.schema.source_format == "vtk" && extra("vtk/skeleton") != nullptr) {
    plan_from_legacy(root, grid_node, piece);
  } else {
    plan_from_others(grid_node, piece);
  }
  made_.register_in(extras_);
  grid_node.children.push_back(std::move(piece));
  root.children.push_back(std::move(grid_node));
  root.children.push_back(element("AppendedData", {{"encoding", "raw"}}));
  document_.nodes.push_back(std::move(root));
  pieces_ = {{0, info_.vertices, 0, info_.cells()}};
}

void VtuPlan::plan_from_legacy(Node& root, Node& grid_node, Node& piece) {
  XmlParts parts = xml_of_legacy(info_, format_, nullptr);
  root.set_attribute("version", parts.version);
  if (!parts.field.children.empty()) grid_node.children.push_back(std::move(parts.field));
  add_time(grid_node);
  piece.children = {std::move(parts.point_data), std::move(parts.cell_data)};
  if (!parts.points.children.empty()) piece.children.push_back(std::move(parts.points));
  placed_ = std::move(parts.placed);
  made_ = std::move(parts.made);
}

void VtuPlan::plan_from_others(Node& grid_node, Node& piece) {
  add_time(grid_node);
  for (std::size_t i = 0; i < info_.schema.arrays.size(); ++i) {
    if (info_.schema.arrays[i].location != Location::global || !is_written(i)) continue;
    Node& field = child_of(grid_node, "FieldData");
    add_array(field, i);
    field.children.back().set_attribute("NumberOfTuples",
                                        std::to_string(info_.schema.arrays[i].elements));
  }
  piece.children = {element("PointData"), element("CellData")};
  add_block_ids(piece.children.back());
  add_strings(grid_node, vtk::kBlockNames,
              vtk::block_names_extra(info_, {}, vtk::StringForm::zeros));
  if (const Extra* title = extra("mesh/title"); title != nullptr && !title->data.empty()) {
    Extra ended = *title;
    ended.data.push_back({});
    add_strings(grid_node, std::string(vtk::kXmlTitle), ended);
  }
}

// Adds the time of the final time step to the tree if the tree does not contain a time.
void VtuPlan::add_time(Node& grid) const {
  Node* field = grid.child("FieldData");
  if (info_.step_times.empty() || grid.attribute("TimeValues") != nullptr ||
      (field != nullptr && array_named(*field, vtk::kXmlTime) != nullptr))
    return;
  if (field == nullptr) field = &*grid.children.insert(grid.children.begin(), element("FieldData"));
  Node time = array_element("Float64", std::string(vtk::kXmlTime), 1, format_, "time");
  time.set_attribute("NumberOfTuples", "1");
  field->children.push_back(std::move(time));
}

void VtuPlan::add_strings(Node& grid, const std::string& name, const Extra& strings) {
  if (strings.data.empty()) return;
  const auto* text = reinterpret_cast<const char*>(strings.data.data());
  child_of(grid, "FieldData")
      .children.push_back(strings_element(name, {text, strings.data.size()}, format_, made_));
}

// Adds a cell array `BlockId` with the block id of each cell if the mesh came from another format.
// VTK files have no blocks; without this array, the blocks would be lost.
void VtuPlan::add_block_ids(Node& data) const {
  // A mesh that came from VTK needs no such array: its blocks only group cells by cell type.
  if (info_.schema.source_format.starts_with("vt")) return;
  bool differ = false, wide = false;
  for (const BlockInfo& block : info_.schema.blocks) {
    differ |= block.id != info_.schema.blocks.front().id || !block.name.empty();
    wide |= block.id != static_cast<std::int32_t>(block.id);
  }
  for (const ArrayInfo& array : info_.schema.arrays)
    if (array.location == Location::cell && array.name == "BlockId") return;
  if (differ)
    data.children.push_back(
        array_element(wide ? "Int64" : "Int32", "BlockId", 1, format_, "block_ids"));
}

}  // namespace shm::converters::vtu
