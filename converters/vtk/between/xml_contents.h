// Contents: access to the skeleton of an XML file, i.e. the file without its numbers. Finds the
// elements of arrays, and the markup that only XML files have.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "interface/losses.h"
#include "mesh/mesh_source.h"
#include "vtk/xml_words.h"

namespace shm::converters::vtu {

class Contents {
 public:
  // Parses the skeleton of a mesh. Returns nothing if the mesh has no valid XML skeleton, e.g.
  // because it did not come from an XML file.
  static std::optional<Contents> of(const MeshInfo& info);

  Node& grid() { return *document_.root().child("UnstructuredGrid"); }
  std::string version() { return document_.root().attribute_or("version", ""); }
  // Returns the XML elements of the arrays of field data.
  std::vector<Node*> field_arrays();
  // Returns one entry per piece: its PointData or CellData element, or null if the piece has no
  // such element.
  std::vector<Node*> data(Location location);
  // Returns the PointData or CellData element of the first piece that has points or cells. This
  // element contains all arrays that exist in every piece.
  Node* first_data(Location location);
  // Returns the XML elements that contain the point coordinates of all pieces and time steps.
  std::vector<Node*> all_points();
  // Returns the first XML element that contains point coordinates, or null if no such element
  // exists.
  Node* points();
  // Returns the times in the TimeValues attribute. Returns an empty list if the attribute is
  // missing or does not consist of numbers.
  std::vector<double> times();
  // Returns the skeleton as text, without the value ranges of arrays.
  std::string without_ranges();
  // Returns the markup that is lost if the mesh is written as a legacy file: comments, elements and
  // other markup that VTK's readers ignore, and the division into pieces.
  LossList markup();

 private:
  explicit Contents(Document document) : document_(std::move(document)) {}
  std::vector<Node*> pieces();

  Document document_;
};

// Returns the index of the array with the role vtu:points that contains the point coordinates at a
// time step. Returns nothing if the coordinates at this step are those of the mesh itself.
std::optional<std::size_t> points_of_step(const MeshInfo& info, std::uint64_t step);

// Removes the value ranges (attributes and information keys) from an array element.
void forget_ranges(Node& array);

// Returns true if a <DataArray> element contains names of components, or information keys other
// than ranges.
bool has_metadata(const Node& array);

}  // namespace shm::converters::vtu
