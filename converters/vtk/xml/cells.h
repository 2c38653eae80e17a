// CellCollector: joins the cells of all pieces of a VTU file into one table, in the same form as
// the cells of a legacy file. In this form, points are numbered consecutively across all pieces,
// and a polyhedron is a face stream: the number of faces, then the size and the points of each
// face.
#pragma once

#include <cstdint>
#include <string_view>
#include <vector>

#include "base/spool.h"
#include "mesh/mesh_source.h"
#include "vtk/cells.h"
#include "vtk/xml/loader.h"
#include "vtk/xml_words.h"

namespace shm::converters::vtu {

// Returns the distinct points of a face stream in the order of their first use.
std::vector<std::int64_t> first_uses(const std::vector<std::int64_t>& stream);

struct PieceRange {
  std::uint64_t first_point = 0, points = 0, first_cell = 0, cells = 0;
};

class CellCollector {
 public:
  CellCollector(ArrayLoader& loader, Spool& spool);
  // Adds the cells of the next piece to the table, and marks the arrays of this piece as read.
  void add_piece(Node& cells, const PieceRange& piece);
  // Moves the cells into `table`. Adds extras to `info` for data that the table cannot express.
  // Must be called only once.
  void finish(vtk::CellTable& table, MeshInfo& info);

 private:
  // All values of an array, as 64-bit integers.
  struct Column {
    Column(CellCollector& owner, Node& array, std::uint64_t most);
    std::uint64_t size() const { return values.size(); }
    std::int64_t at(std::uint64_t i) { return values.get<std::int64_t>(i); }
    PagedArray values;
  };
  Node* find(Node& cells, std::string_view name) const;
  bool read_types(Node& types, const PieceRange& piece);  // returns true if there are polyhedra
  void read_plain(Node& offsets, Node& connectivity, const PieceRange& piece);
  void read_with_faces(Node& cells, Node& offsets, Node& connectivity, const PieceRange& piece);
  bool face_streams(Node& faces, Node& ends, const PieceRange& piece);
  bool face_tables(Node& cells, const PieceRange& piece);
  void add_cells(Node& offsets, Node& connectivity, const PieceRange& piece);
  void begin_stream(std::uint64_t faces);
  void add_stream_face(Node& array, Column& nodes, std::uint64_t begin, std::uint64_t end);
  void add_cell(std::uint64_t cell, std::uint8_t type, const std::vector<std::int64_t>& nodes,
                const PieceRange& piece);
  void check_nodes(Node& array, const std::vector<std::int64_t>& nodes,
                   const PieceRange& piece) const;
  void mark_steps(Node& cells);
  void mark_rest(Node& cells);

  ArrayLoader& loader_;
  Spool& spool_;
  PagedArray offsets_, connectivity_, types_;
  // Number of points in the faces of all polyhedra of the current piece. A point is counted once
  // for each face that contains it.
  std::uint64_t face_nodes_ = 0;

  // streams_ contains the face streams of the current piece, with point numbers relative to the
  // piece. stream_ends_ contains, for each cell, the end of its face stream.
  PagedArray streams_, stream_ends_;
  // A list of polyhedra whose points are in an unusual order. Contains the cell number of each
  // polyhedron, its number of points, and its points in file order.
  struct Reordered {
    std::vector<std::int64_t> cells, counts, nodes;
    void add(std::uint64_t cell, const std::vector<std::int64_t>& points,
             std::uint64_t first_point);
  };
  // unlike_faces_ contains the polyhedra whose points are not in the order in which their faces
  // first use them. not_ascending_ contains the polyhedra whose points do not ascend.
  Reordered unlike_faces_, not_ascending_;
};

}  // namespace shm::converters::vtu
