// What the skeleton of a mesh from an XML file has besides points and cells: its arrays of data,
// and what only XML files have.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "mesh/mesh_source.h"
#include "transfer/losses.h"
#include "vtk/xml_words.h"

namespace shm::converters::vtu {

class Contents {
 public:
  // Nothing when the mesh has no skeleton of an XML file.
  static std::optional<Contents> of(const MeshInfo& info);

  Node& grid() { return *document_.root().child("UnstructuredGrid"); }
  std::string version() { return document_.root().attribute_or("version", ""); }
  // Arrays of the field data.
  std::vector<Node*> field_arrays();
  // PointData or CellData of each piece; null where it has none.
  std::vector<Node*> data(Location location);
  // The same of the first piece that has points or cells, whose arrays are those of all.
  Node* first_data(Location location);
  // The arrays of points of all pieces and steps.
  std::vector<Node*> all_points();
  // The first of them that has the coordinates; null when there is none.
  Node* points();
  // Time steps of the file, and those that an array names; none when it names none.
  std::vector<double> times();
  // The skeleton without ranges of arrays.
  std::string without_ranges();
  // Comments, elements and the like that no reader of VTK looks at, and the split into pieces.
  LossList markup();

 private:
  explicit Contents(Document document) : document_(std::move(document)) {}
  std::vector<Node*> pieces();

  Document document_;
};

// The array (role vtu:points) that has the points at a time step; nothing where those of the mesh
// are meant.
std::optional<std::size_t> points_of_step(const MeshInfo& info, std::uint64_t step);

// Takes the ranges of its values from an array.
void forget_ranges(Node& array);

// Whether the array has more than its name and values: names of components, keys that are no
// ranges.
bool has_metadata(const Node& array);

}  // namespace shm::converters::vtu
