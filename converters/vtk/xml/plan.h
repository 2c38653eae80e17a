// VtuPlan: the XML tree of the VTU file to be written, complete before the first byte is written.
// If the mesh came from a VTU file, the tree is the XML tree of that file, adapted to the current
// mesh. Otherwise, the tree is created from the mesh.
#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <set>
#include <string>
#include <string_view>
#include <vector>

#include "mesh/mesh_source.h"
#include "vtk/between/family.h"
#include "vtk/cell_plan.h"
#include "vtk/xml/cells.h"
#include "vtk/xml/codec.h"
#include "vtk/xml/loader.h"
#include "vtk/xml_document.h"
#include "vtk/xml_words.h"

namespace shm::converters::vtu {

class VtuPlan : public vtk::CellPlan {
 public:
  explicit VtuPlan(MeshSource& mesh);

  Document& document() { return document_; }
  const ByteForm& form() const { return form_; }
  bool raw_appended() const { return raw_appended_; }
  // Returns true if the connectivity array must list the points of each polyhedron in ascending
  // order. This is the case if the source lists them in ascending order, or if the source is not a
  // VTU file. (Legacy files list only the points of each face, and VTK itself then sorts the points
  // of the polyhedron.)
  bool sorts_points() const { return !own_ || extra("vtu/polyhedron/ascending") != nullptr; }
  // Returns the ranges of points and cells of `node` if it is a <Piece> element, otherwise null.
  const PieceRange* piece_of(const Node& node) const {
    const auto found = by_node_.find(&node);
    return found == by_node_.end() ? nullptr : &pieces_[found->second];
  }

 private:
  void plan_from_source(const Extra& text);
  void plan_for_foreign();
  void plan_from_legacy(Node& root, Node& grid_node, Node& piece);
  void plan_from_others(Node& grid_node, Node& piece);
  void read_head();
  void find_pieces();
  void join_pieces();
  void fit_arrays(Node& data, Location location);
  bool fits(Node& array, Location location);
  void fit_cells(Node& piece, const PieceRange& range);
  void fit_points(Node& points);
  void add_unplaced_arrays(Node& piece, Location location);
  void add_array(Node& data, std::size_t array) const;
  void add_time(Node& grid) const;
  void add_block_ids(Node& data) const;
  void add_strings(Node& grid, const std::string& name, const Extra& strings);
  bool is_written(std::size_t array) const;
  bool is_of_type(const ArrayInfo& info, const ArrayType& type) const;
  Node& grid();

  Document document_;
  ByteForm form_;
  bool raw_appended_ = true, own_ = false;
  std::string format_ = "appended";  // "format" attribute of added arrays

  // Ranges of points and cells of each piece. The ranges of consecutive pieces are adjacent.
  std::vector<PieceRange> pieces_;
  std::map<const Node*, std::size_t> by_node_;
  std::set<std::size_t> placed_;
  vtk::MadeExtras made_;  // extras with values in the form that VTU files need
};

}  // namespace shm::converters::vtu
