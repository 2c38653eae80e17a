// The keywords and numbers of VTK legacy files, and their meaning: scalar types, cell types, names,
// and the skeleton (see vtk.h). The reader and the writer use them.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "shm/schema.h"

namespace shm::converters::vtk {

enum class ValueForm { number, bit, string, variant, unknown };

// Returns whether values of the type `word` (such as "float") are numbers, bits, strings or
// variants. All functions that take a type word match prefixes and ignore case, as VTK does.
ValueForm form_of_word(std::string_view word);
// Returns the scalar type in which a file stores numbers of the type `word`. Returns nothing if
// values of this type are not numbers.
std::optional<ScalarType> scalar_of_word(std::string_view word, bool binary);
std::string_view word_of_scalar(ScalarType type);
// Returns the type of the mesh array for a point or cell array that has the type `word` in the
// file. Numbers keep their type. Bits become uint8. Strings and variants become uint32 indices into
// vtk/strings/<index>.
std::optional<ScalarType> array_type_of_word(std::string_view word, bool binary);

inline constexpr int kPixel = 8, kVoxel = 11, kPolyhedron = 42, kLagrangeHexahedron = 72,
                     kBezierHexahedron = 79;

// Returns the block for cells of the VTK type `type` with `nodes` nodes. Its id is the type.
// `nodes` is 0 if the number of nodes varies.
BlockInfo block_of_cell_type(int type, std::uint32_t nodes);
// Returns the VTK cell type for the cells of `block`, a block of a mesh from another format.
int cell_type_of_block(const BlockInfo& block);
// Returns true if VTK has a cell type for the cells of `block`, a block of a mesh from another
// format. If false, the cells are written as point sets.
bool has_cell_type(const BlockInfo& block);
// Returns true if cells of this type may have any number of nodes.
bool has_varying_nodes(int type);
// Returns false for Lagrange and Bezier cells with a number of nodes that no order has if it is the
// same along all axes. `block`: a block of a mesh from a VTK file, whose
// id is the VTK type.
bool has_model_nodes(const BlockInfo& block);
// Permutes the nodes of a cell from VTK's order to the model's: the corners of a voxel or pixel,
// and the edges of a Lagrange or Bezier hexahedron in a file with `old_numbering` (legacy files
// before version 5.1, XML files before version 2.1). The same permutation works in both directions.
void permute_nodes(int type, std::uint64_t* nodes, std::size_t count, bool old_numbering);

std::string lower_case(std::string_view text);
// Replaces each byte that cannot be part of a word with %XX, the value of the byte in hexadecimal.
std::string encode_name(std::string_view name);
std::string decode_name(std::string_view name);

enum class Dataset : std::uint8_t {
  unstructured_grid,
  structured_grid,
  rectilinear_grid,
  structured_points,
  polydata,
};
std::string_view dataset_word(Dataset dataset);
std::optional<Dataset> dataset_of_word(std::string_view upper_case_word);
// Returns true for structured data sets, in which the dimensions determine the cells.
inline bool is_lattice(Dataset dataset) {
  return dataset != Dataset::unstructured_grid && dataset != Dataset::polydata;
}

enum class EntryKind : std::uint8_t {
  field,
  points,
  cells,
  cell_data,
  point_data,
  null_array,
  dimensions,
  extent,
  spacing,
  aspect_ratio,  // called SPACING in file versions from 3.0 on
  origin,
  vertices,
  lines,
  polygons,
  triangle_strips,
  array,
  scalars,
  color_scalars,
  lookup_table,
  vectors,
  normals,
  tensors,
  tensors6,
  texture_coordinates,
  global_ids,
  pedigree_ids,
  edge_flags,
  x_coordinates,
  y_coordinates,
  z_coordinates,
  blanking,
};
inline constexpr std::size_t kEntryKinds = 31;
std::string_view keyword(EntryKind kind);
std::optional<EntryKind> kind_of_keyword(std::string_view upper_case_word);
// Returns the number of components of arrays of this kind, or 0 if it varies and is stated in the
// file.
std::uint64_t fixed_components(EntryKind kind);
inline bool holds_values(EntryKind kind) { return kind >= EntryKind::array; }
// Returns true for attributes: the kinds of arrays, other than FIELD, that may follow POINT_DATA
// and CELL_DATA.
inline bool is_attribute(EntryKind kind) {
  return kind > EntryKind::array && kind <= EntryKind::edge_flags;
}
// Returns how many of the words that follow the keyword of `kind` are copied verbatim to the
// skeleton.
std::size_t plain_words(EntryKind kind);
// Returns true for CELLS and for the four lists of cells of polygonal data.
inline bool lists_cells(EntryKind kind) {
  return kind == EntryKind::cells ||
         (kind >= EntryKind::vertices && kind <= EntryKind::triangle_strips);
}
// Returns the VTK type of a cell with `nodes` nodes in `list`, a list of polygonal data.
int cell_type_in(EntryKind list, std::uint64_t nodes);

enum class Origin : std::uint8_t { none, array, extra, block_ids };

// One line of the skeleton. The kind of the line determines which members are used.
struct Entry {
  EntryKind kind = EntryKind::array;
  Origin origin = Origin::none;
  std::size_t index = 0;  // index into schema.arrays, or the number <k> of the extra vtk/data/<k>
  std::string name{};     // %-encoded

  // For kinds whose words are copied verbatim (see plain_words()): these words. For a list of
  // cells: the word for the type of the offsets, or an empty string if the cells are stored as
  // rows. For all other kinds: the word for the type of the values.
  std::string type{};
  // For SCALARS: the name of the lookup table. For a list of cells: the word for the type of the
  // connectivity.
  std::string second{};
  // Number of components and number of tuples of an array. For a field, `tuples` is the number of
  // its arrays; for a list of polygonal data, `tuples` is the number of its cells.
  std::uint64_t components = 0, tuples = 0;
  // Lines between METADATA and the empty line that ends it, each with its '\n'.
  std::string metadata{};
};

struct Skeleton {
  std::string version = "4.2";
  std::string title = "vtk output";
  bool binary = true;
  Dataset dataset = Dataset::unstructured_grid;
  std::vector<Entry> entries;
  int major_version() const { return version.empty() ? 0 : version.front() - '0'; }
};

std::string to_text(const Skeleton& skeleton);
// Parses a skeleton. Returns nothing if `text` is not a valid skeleton.
std::optional<Skeleton> parse_skeleton(std::string_view text);

std::string data_key(std::size_t index);  // returns "vtk/data/<index>"

}  // namespace shm::converters::vtk
