// Keywords and numbers of VTK legacy files and their meaning: scalar types, cell types, names, and
// the skeleton (see vtk.h). Used by the reader and the writer.
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

// Returns the form of values that a type word means. Like VTK, this function and the next ones
// match prefixes and ignore case.
ValueForm form_of_word(std::string_view word);
// Returns the type in which the file stores the numbers. Returns nothing for forms other than
// number.
std::optional<ScalarType> scalar_of_word(std::string_view word, bool binary);
std::string_view word_of_scalar(ScalarType type);
// Returns the type of the model's array for values of points or cells. Numbers keep their own type.
// Bits become a type that holds 0 and 1. Strings and variants become indices into
// vtk/strings/<index>.
std::optional<ScalarType> array_type_of_word(std::string_view word, bool binary);

inline constexpr int kPixel = 8, kVoxel = 11, kPolyhedron = 42;

// Returns the model's shape of cells of a VTK type with `nodes` nodes (0: varying).
CellShape shape_of_cell_type(int type, std::uint32_t nodes);
// Returns the VTK cell type for a block of another format.
int cell_type_of_block(const BlockInfo& block);
// Returns true if VTK has a cell type for this block of another format. Otherwise its cells are
// written as point sets.
bool has_cell_type(const BlockInfo& block);
// Returns true if cells of this type may have any number of nodes.
bool has_varying_nodes(int type);
// Swaps the corners of a voxel or pixel between VTK's order and the model's. Both directions are
// the same permutation.
void permute_corners(int type, std::uint64_t* corners, std::size_t count);

std::string lower_case(std::string_view text);
// Replaces bytes that cannot be part of a word by %XX.
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
// Returns true for data sets whose cells are determined by the dimensions.
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
  aspect_ratio,  // name of the spacing in versions before 3.0
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
// Returns the number of components that a kind always has, or 0 if the file states the number.
std::uint64_t fixed_components(EntryKind kind);
inline bool holds_values(EntryKind kind) { return kind >= EntryKind::array; }
// Returns true for attributes, which may follow POINT_DATA and CELL_DATA in addition to FIELD.
inline bool is_attribute(EntryKind kind) {
  return kind > EntryKind::array && kind <= EntryKind::edge_flags;
}
// Returns the number of words after a keyword that are kept verbatim.
std::size_t plain_words(EntryKind kind);
// Returns true for CELLS and for the lists of cells of polygonal data.
inline bool lists_cells(EntryKind kind) {
  return kind == EntryKind::cells ||
         (kind >= EntryKind::vertices && kind <= EntryKind::triangle_strips);
}
// Returns the type of a cell with `nodes` nodes in a list of polygonal data.
int cell_type_in(EntryKind list, std::uint64_t nodes);

enum class Origin : std::uint8_t { none, array, extra, block_ids };

// One line of the skeleton. The kind determines which members are used.
struct Entry {
  EntryKind kind = EntryKind::array;
  Origin origin = Origin::none;
  std::size_t index = 0;  // index into schema.arrays, or the k of vtk/data/<k>
  std::string name{};     // %-encoded

  // Type word. For lists of cells, the type word of the offsets, which is empty for classic rows.
  // For kinds with plain_words(), these words.
  std::string type{};
  // For scalars, the name of the lookup table; for cells, the type word of the connectivity.
  std::string second{};
  // Number of components and of tuples. For a field, `tuples` is the number of its arrays; for a
  // list of polygonal data, the number of its cells.
  std::uint64_t components = 0, tuples = 0;
  std::string metadata{};  // lines between METADATA and the empty line, each with its '\n'
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
// Parses a skeleton. Returns nothing if `text` is not a skeleton.
std::optional<Skeleton> parse_skeleton(std::string_view text);

std::string data_key(std::size_t index);  // returns "vtk/data/<index>"

}  // namespace shm::converters::vtk
