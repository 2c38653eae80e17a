// PieceMesh: some cells of a .shm file as a separate mesh, staged in the spool. Its vertices and
// cells are renumbered in ascending order of their numbers in the file. Values of a step are read
// when they are first requested. In addition to the spool, it needs 8 to 16 bytes of memory per
// vertex and cell of the piece.
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

// Names of the arrays that hold the numbers of vertices and cells in the file, counted from 0.
inline constexpr const char* kVertexNumbers = "shm_vertex_number";
inline constexpr const char* kCellNumbers = "shm_cell_number";

// Returns the schema, counts, times and extras of a file, called `name` in messages.
MeshInfo info_of(MeshExtractor& file, const std::string& name);

// Returns true if an array holds the numbers of vertices or cells in the source. Such arrays are
// part of every piece.
bool is_number_map(const ArrayInfo& array);

struct PieceOptions {
  // Cells to extract; its member `arrays` is replaced by the selection below.
  ExtractRequest request;
  std::optional<std::uint64_t> step;  // if set, the piece has only this step

  // Index of a static point array with the positions of the points at that step. The array has 3
  // components, of the type of the coordinates. This array, and all other arrays of its role, do
  // not become arrays of the piece.
  std::optional<std::uint32_t> points;
  // Indices of the arrays to extract, ascending; nothing: all arrays. Number maps are always
  // extracted.
  std::optional<std::vector<std::uint32_t>> arrays;
  // Arrays in which the target format of the piece stores number maps, counted from 1. Used unless
  // the source has such maps itself. Borrowed. If null, the arrays kVertexNumbers and kCellNumbers
  // are used.
  const NumberMaps* maps = nullptr;
  // True if the piece is one of the parts into which the whole mesh is decomposed. All blocks,
  // arrays and sets are then kept, even if they become empty. The maps always hold numbers of the
  // whole mesh, with a type that is the same in all parts. Maps of the source get the role of
  // original numbers. Requires `maps`.
  bool decomposed = false;
  // True if the source is a damaged file. Lost step values then become NaN, and lost integers 0.
  bool damaged = false;
  // True if arrays of the numbers in the file are added. If false, the piece must contain all
  // vertices and cells.
  bool numbers = true;
  // True if the mesh is two-dimensional: the sides of its triangles and quads are edges.
  bool flat = false;
  // Step times that replace those of the file, if set.
  std::optional<std::vector<double>> step_times;
};

class PieceMesh final : public MeshSource {
 public:
  // Extras of the file in `extras` that do not belong to sets stay unchanged. `sets` are reduced to
  // the members in the piece. Empty sets are dropped, except from decomposed meshes. `file` and
  // `spool` must outlive the mesh. Throws the library's error for a bad file, with `name` as the
  // file's name.
  PieceMesh(MeshExtractor& file, const PieceOptions& options, std::vector<Extra> extras,
            const std::vector<MeshSet>& sets, const std::string& name, Spool& spool);

  const MeshInfo& info() const override { return info_; }
  void read_points(std::uint64_t first, std::uint64_t count, std::byte* out) override;
  bool next_cells(CellBatch& out, std::size_t max_cells) override;
  void rewind_cells() override { next_cell_ = 0; }
  void read_array(std::size_t array, std::uint64_t step, std::uint64_t first, std::uint64_t count,
                  std::byte* out) override;

  // Returns the labels of sets whose distribution factors are left out because they cannot be
  // assigned to the members, for example because sides of the cells have different numbers of
  // nodes.
  const std::vector<std::string>& without_factors() const { return without_factors_; }

  // Return the numbers in the file, ascending: element i is the number of vertex or cell i of the
  // piece.
  const std::vector<std::uint64_t>& vertex_numbers() const { return file_->vertex_numbers(); }
  const std::vector<std::uint64_t>& cell_numbers() const { return file_->cell_numbers(); }

  // Returns, for each array and step of the file whose values were read, the number of elements
  // without a value.
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
  const std::vector<std::uint64_t>& elements(std::uint32_t source);
  PagedArray& step_values(Array& array, std::uint64_t step);
  std::uint64_t vertex_of(std::uint64_t number) const;

  MeshExtractor* file_;
  std::string name_;
  Spool* spool_;
  bool decomposed_, damaged_;
  std::optional<std::uint64_t> step_;  // set if the piece has only this step
  std::optional<std::uint32_t> points_array_;
  std::optional<std::vector<std::uint32_t>> wanted_;
  MeshInfo info_;
  // Blocks of the file that are kept, and the new index of each block of the file.
  std::vector<std::uint32_t> kept_blocks_, new_blocks_;

  PagedArray points_;
  CellStore cells_;  // cells; their corners are vertex numbers of the file
  NumberList arrived_vertices_, arrived_cells_;
  bool vertices_moved_ = false, cells_moved_ = false;
  std::uint64_t last_vertex_ = 0, last_cell_ = 0;
  std::optional<NumberTable> cell_positions_;  // position of each cell in order of arrival
  std::vector<std::uint64_t> block_cells_;     // number of cells of each block of the file

  // Values of static arrays, by index of the array in the file.
  std::map<std::uint32_t, PagedArray> staged_;
  // Numbers of the cells that a list of blocks covers; the key is this list.
  std::map<std::vector<std::uint32_t>, std::vector<std::uint64_t>> covered_;
  std::vector<Array> arrays_;
  std::uint64_t next_cell_ = 0;
  std::map<std::pair<std::uint32_t, std::uint64_t>, std::uint64_t> lost_values_;
  std::vector<std::string> without_factors_;
};

// Returns the position of `number` in `sorted`, which is the number in the piece for a number of
// the file. Returns nothing if `sorted` does not contain it.
std::optional<std::uint64_t> rank_of(const std::vector<std::uint64_t>& sorted,
                                     std::uint64_t number);

}  // namespace shm::converters
