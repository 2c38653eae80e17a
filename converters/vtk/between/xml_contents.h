// The parts of the skeleton of an XML file other than points and cells: arrays of data, and markup
// that only XML files have.
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
  // Returns nothing if the mesh has no skeleton of an XML file.
  static std::optional<Contents> of(const MeshInfo& info);

  Node& grid() { return *document_.root().child("UnstructuredGrid"); }
  std::string version() { return document_.root().attribute_or("version", ""); }
  // Arrays of the field data.
  std::vector<Node*> field_arrays();
  // PointData or CellData of each piece. Null if the piece has none.
  std::vector<Node*> data(Location location);
  // The same for the first piece that has points or cells. The other pieces have the same arrays.
  Node* first_data(Location location);
  // The arrays of points of all pieces and steps.
  std::vector<Node*> all_points();
  // The first of them, which has the coordinates. Null if there is none.
  Node* points();
  // The times in the attribute TimeValues. Empty if there are none or they are not numbers.
  std::vector<double> times();
  // The skeleton without ranges of arrays.
  std::string without_ranges();
  // Comments, elements and other markup that VTK's readers ignore, and the split into pieces.
  LossList markup();

 private:
  explicit Contents(Document document) : document_(std::move(document)) {}
  std::vector<Node*> pieces();

  Document document_;
};

// The array (role vtu:points) with the points at a time step. Nothing if the step uses the points
// of the mesh.
std::optional<std::size_t> points_of_step(const MeshInfo& info, std::uint64_t step);

// Removes the ranges of the values from an array.
void forget_ranges(Node& array);

// Returns true if the array has more than its name and values: names of components, or keys other
// than ranges.
bool has_metadata(const Node& array);

}  // namespace shm::converters::vtu
