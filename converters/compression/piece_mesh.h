// PieceMesh: a mesh that consists of some cells of a .shm file. Its data is kept in a spool
// (temporary storage). Vertices and cells are renumbered in ascending order of their numbers in the
// file. Values of a step are read when they are first requested. In addition to the spool, needs 8
// to 16 bytes of memory per vertex and cell of the piece.
#pragma once

#include <cstddef>
#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "base/spool.h"
#include "compression/decompress.h"
#include "interface/format.h"
#include "mesh/coding_order.h"
#include "mesh/mesh_source.h"
#include "sets/transfer_sets.h"
#include "shm/mesh_extract.h"

namespace shm::converters {

// Names of the arrays that contain, for each vertex or cell of a piece, its number in the file.
// Numbers start at 0.
inline constexpr const char* kVertexNumbers = "shm_vertex_number";
inline constexpr const char* kCellNumbers = "shm_cell_number";

// Returns the schema, counts, times and extras of a file. `name` is the name of the file in
// messages.
MeshInfo info_of(MeshExtractor& file, const std::string& name);

// Returns true if an array is a number map: it contains the number of each vertex or cell in the
// source mesh. Number maps are extracted into every piece.
bool is_number_map(const ArrayInfo& array);

struct PieceOptions {
  // Cells to extract. The member `arrays` of the request is ignored; the option `arrays` below
  // selects the arrays.
  ExtractRequest request;
  std::optional<std::uint64_t> step;  // if set, the piece has only this step

  // Index of a static point array that contains the coordinates of the points at the step `step`.
  // The array has 3 components of the same type as the coordinates. This array and all other arrays
  // with the same role are not extracted.
  std::optional<std::uint32_t> points;
  // Indices of the arrays to extract, ascending. If not set, all arrays are extracted. Number maps
  // are always extracted.
  std::optional<std::vector<std::uint32_t>> arrays;
  // Names and roles of the arrays in which the format of the piece stores number maps. Their
  // numbers start at 1. The arrays are added unless the source already has them. If this pointer is
  // null, the arrays kVertexNumbers and kCellNumbers are used instead. Borrowed.
  const NumberMaps* maps = nullptr;
  // True if the piece is one of the parts into which the whole mesh is decomposed. All blocks,
  // arrays and sets are then kept, even if they become empty. The number maps always contain global
  // numbers (the numbers in the whole mesh), and have the same type in all parts. If the source
  // already has number maps, they keep their values in the parts, with the role
  // NumberMaps::original_role (or no role if their type is unsigned or floating-point).
  // Precondition: `maps` is not null.
  bool decomposed = false;
  // True if the source is a damaged file. Lost step values then become NaN (floating-point types)
  // or 0 (integer types).
  bool damaged = false;
  // True if number maps are added to the piece. If false, the piece must contain all vertices and
  // cells.
  bool numbers = true;
  // True if the mesh is two-dimensional, so that the sides of its triangles and quads are edges.
  bool flat = false;
  // If set, step times that replace the step times of the file.
  std::optional<std::vector<double>> step_times;
};

class PieceMesh final : public MeshSource {
 public:
  // `extras` are extras of the file that do not belong to sets; the piece contains them unchanged.
  // `sets` are reduced to the members that are in the piece. Empty sets are dropped, except in
  // decomposed meshes. `file` and `spool` must outlive the mesh. Throws the library's error for a
  // bad file, with `name` as the file's name.
  PieceMesh(MeshExtractor& file, const PieceOptions& options, std::vector<Extra> extras,
            const std::vector<MeshSet>& sets, const std::string& name, Spool& spool);

  const MeshInfo& info() const override { return info_; }
  void read_points(std::uint64_t first, std::uint64_t count, std::byte* out) override;
  bool next_cells(CellBatch& out, std::size_t max_cells) override;
  void rewind_cells() override { next_cell_ = 0; }
  void read_array(std::size_t array, std::uint64_t step, std::uint64_t first, std::uint64_t count,
                  std::byte* out) override;

  // Returns the labels of the sets whose distribution factors the piece omits. Factors are omitted
  // if they cannot be assigned to members, e.g. because the sides have different numbers of nodes.
  const std::vector<std::string>& without_factors() const { return without_factors_; }
  // Returns the labels of the arrays on sets that the piece omits, because the sets of the file do
  // not have the number of members that the array states.
  const std::vector<std::string>& without_sets() const { return without_sets_; }

  // Return the numbers that the vertices (or cells) of the piece have in the file, in ascending
  // order.
  const std::vector<std::uint64_t>& vertex_numbers() const { return file_->vertex_numbers(); }
  const std::vector<std::uint64_t>& cell_numbers() const { return file_->cell_numbers(); }

  // Returns, for each array and step that has been read so far from a damaged file, the number of
  // elements whose value is lost. The key consists of the array and the step.
  const std::map<std::pair<std::uint32_t, std::uint64_t>, std::uint64_t>& lost_values() const {
    return lost_values_;
  }

 private:
  struct Array {
    enum class What { of_file, vertex_numbers, cell_numbers } what = What::of_file;
    std::uint32_t source = 0;  // index of the array in the file
    std::optional<PagedArray> values{};
    std::map<std::uint64_t, PagedArray> steps{};  // values of each step; keys are steps of the file
  };

  void stage(const ExtractRequest& request);
  void add_part(const MeshBlock& part);
  void settle();
  PagedArray settled(PagedArray& arrived, std::size_t stride, NumberList& numbers,
                     const std::vector<std::uint64_t>& sorted);
  void choose_blocks();
  void choose_arrays(const PieceOptions& options);
  bool takes_array(std::uint32_t source) const;
  void add_number_array(Location location, const NumberMaps* maps);
  std::optional<std::size_t> factors_of_each(const MeshSet& set, bool flat) const;
  void cut_sets(const std::vector<MeshSet>& sets, bool flat);
  bool cut_array_on_sets(std::uint32_t source, ArrayInfo& array);
  const std::vector<std::uint64_t>& elements(std::uint32_t source);
  PagedArray& step_values(Array& array, std::uint64_t step);
  std::uint64_t vertex_of(std::uint64_t number) const;

  MeshExtractor* file_;
  std::string name_;
  Spool* spool_;
  bool decomposed_, damaged_;
  // The only step of the piece. Not set if the piece has all steps.
  std::optional<std::uint64_t> step_;
  std::optional<std::uint32_t> points_array_;
  std::optional<std::vector<std::uint32_t>> wanted_;
  MeshInfo info_;
  // kept_blocks_ lists the blocks of the file that are kept. new_blocks_ maps each block of the
  // file to its index in the piece.
  std::vector<std::uint32_t> kept_blocks_, new_blocks_;

  PagedArray points_;
  CellStore cells_;  // cells in order of arrival; corners are vertex numbers of the file
  NumberList arrived_vertices_, arrived_cells_;
  bool vertices_moved_ = false, cells_moved_ = false;
  std::uint64_t last_vertex_ = 0, last_cell_ = 0;
  std::optional<NumberTable> cell_positions_;  // for each cell of the piece, its index in order of
                                               // arrival
  std::vector<std::uint64_t> block_cells_;     // number of cells of each block of the file

  // Values of the static arrays. The key is the index of the array in the file.
  std::map<std::uint32_t, PagedArray> staged_;
  // The key is a list of blocks; the value contains the numbers that the cells of these blocks have
  // in the file.
  std::map<std::vector<std::uint32_t>, std::vector<std::uint64_t>> covered_;
  // Sets of the file, in order. `kept` lists the indices of the members that are in the piece.
  // `number` is the number of the set in the piece, among the sets of its kind.
  struct CutSet {
    MeshSet::Kind kind;
    std::uint64_t members;
    std::vector<std::uint64_t> kept;
    std::optional<std::uint32_t> number;
  };
  std::vector<CutSet> cut_sets_;
  // For each array that is neither on points nor on cells: the indices of its elements in the file.
  std::map<std::uint32_t, std::vector<std::uint64_t>> beside_mesh_;
  std::vector<Array> arrays_;
  std::uint64_t next_cell_ = 0;
  std::map<std::pair<std::uint32_t, std::uint64_t>, std::uint64_t> lost_values_;
  std::vector<std::string> without_factors_, without_sets_;
};

// Returns the index of `number` in `sorted`, or nothing if `sorted` does not contain `number`. Used
// to convert vertex and cell numbers of the file to those of the piece.
std::optional<std::uint64_t> rank_of(const std::vector<std::uint64_t>& sorted,
                                     std::uint64_t number);

}  // namespace shm::converters
