// What the words and numbers of VTK legacy files mean: scalar types, cell types, names, and the
// skeleton (see vtk.h) that reader and writer share.
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

// VTK matches type words by prefix and without case; so do these.
ValueForm form_of_word(std::string_view word);
// Stored type of the numbers; nothing for forms other than number.
std::optional<ScalarType> scalar_of_word(std::string_view word, bool binary);
std::string_view word_of_scalar(ScalarType type);
// Type of the model's array for values of a form that the file has for each point or cell: numbers
// as they are, 0 or 1 for a bit, for strings and variants their place in vtk/strings/<index>.
std::optional<ScalarType> array_type_of_word(std::string_view word, bool binary);

inline constexpr int kPixel = 8, kVoxel = 11, kPolyhedron = 42;

// Shape that the model gives cells of a VTK type with `nodes` nodes (0: varying).
CellShape shape_of_cell_type(int type, std::uint32_t nodes);
// VTK type for a block of another format.
int cell_type_of_block(const BlockInfo& block);
// Whether cells of another format have a cell type; else they are written as sets of points.
bool has_cell_type(const BlockInfo& block);
// True when cells of this type have any number of nodes.
bool has_varying_nodes(int type);
// Swaps the corners of a voxel or pixel between VTK's order and the model's; its own inverse.
void permute_corners(int type, std::uint64_t* corners, std::size_t count);

std::string lower_case(std::string_view text);
std::string encode_name(std::string_view name);  // %XX for what would break a word
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
// True for data sets whose cells follow from dimensions alone.
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
  aspect_ratio,  // what versions before 3.0 call spacing
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
// Components that a kind always has; 0: it states them itself.
std::uint64_t fixed_components(EntryKind kind);
inline bool holds_values(EntryKind kind) { return kind >= EntryKind::array; }
// What may stand behind POINT_DATA and CELL_DATA besides FIELD.
inline bool is_attribute(EntryKind kind) {
  return kind > EntryKind::array && kind <= EntryKind::edge_flags;
}
// Words behind a keyword that are kept as they stand; 0: none.
std::size_t plain_words(EntryKind kind);
// CELLS, or one of the lists of cells that polygonal data have.
inline bool lists_cells(EntryKind kind) {
  return kind == EntryKind::cells ||
         (kind >= EntryKind::vertices && kind <= EntryKind::triangle_strips);
}
// Cell type of `nodes` nodes in a list of polygonal data.
int cell_type_in(EntryKind list, std::uint64_t nodes);

enum class Origin : std::uint8_t { none, array, extra, block_ids };

// One line of the skeleton. Which members count depends on the kind.
struct Entry {
  EntryKind kind = EntryKind::array;
  Origin origin = Origin::none;
  std::size_t index = 0;  // into schema.arrays, or k of vtk/data/<k>
  std::string name{};     // %-encoded
  // Type word; for lists of cells: that of the offsets, empty for classic rows; for those of
  // plain_words: these.
  std::string type{};
  std::string second{};  // lookup table of scalars; for cells: type word of the connectivity
  // Of a field: tuples is its number of arrays; of a list of polygonal data, that of its cells.
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
// Nothing when `text` is no skeleton.
std::optional<Skeleton> parse_skeleton(std::string_view text);

std::string data_key(std::size_t index);  // "vtk/data/<index>"

}  // namespace shm::converters::vtk
