// PieceMesh: some cells of a .shm file as a mesh of its own, staged in the spool. Vertices and
// cells are numbered anew in the order of their numbers in the file. Steps are read when they are
// asked for. Beside the spool, memory is 8 to 16 bytes for each vertex and cell of the piece.
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
#include "mesh/coding_order.h"
#include "mesh/mesh_source.h"
#include "sets/transfer_sets.h"
#include "shm/mesh_extract.h"
#include "transfer/format.h"

namespace shm::converters {

// Arrays of the numbers that vertices and cells have in the file, from 0.
inline constexpr const char* kVertexNumbers = "shm_vertex_number";
inline constexpr const char* kCellNumbers = "shm_cell_number";

// Whether an array holds which vertex or cell of the source each one is: such arrays go with every
// piece.
bool is_number_map(const ArrayInfo& array);

struct PieceOptions {
  ExtractRequest request;             // `arrays` of it follows from the one below
  std::optional<std::uint64_t> step;  // this one alone
  // A static array of 3 components of points with their places, of the type of coordinates:
  // of that step. It and all others of its role do not become arrays of the piece.
  std::optional<std::uint32_t> points;
  // Indices of arrays, ascending; nothing: all. Number maps come along in any case.
  std::optional<std::vector<std::uint32_t>> arrays;
  // Numbers as maps of the format that the piece goes to, from 1, unless the source has such
  // itself; borrowed. Null: arrays kVertexNumbers and kCellNumbers.
  const NumberMaps* maps = nullptr;
  // One of the parts that together are the mesh: all blocks, arrays and sets stay, where nothing is
  // left of them empty, and the maps are numbers of the whole mesh in any case, of a type that is
  // the same in all parts. Those of the source get the role for original ones. Needs `maps`.
  bool decomposed = false;
  // What is left of a damaged file: step values that are lost are NaN, and integers 0.
  bool damaged = false;
  // Arrays of the numbers in the file; without, the piece must have all vertices and cells.
  bool numbers = true;
  // The mesh is one of two dimensions: sides of its triangles and quads are edges.
  bool flat = false;
  // Instead of those of the file.
  std::optional<std::vector<double>> step_times;
};

class PieceMesh final : public MeshSource {
 public:
  // `extras` of the file: those that are no sets stay as they are; `sets` are cut to what is left,
  // and those of which nothing is left go, but for decomposed meshes. `file` and `spool` must
  // outlive the mesh. Throws the library's error of a bad file, naming `name`.
  PieceMesh(MeshExtractor& file, const PieceOptions& options, std::vector<Extra> extras,
            const std::vector<MeshSet>& sets, const std::string& name, Spool& spool);

  const MeshInfo& info() const override { return info_; }
  void read_points(std::uint64_t first, std::uint64_t count, std::byte* out) override;
  bool next_cells(CellBatch& out, std::size_t max_cells) override;
  void rewind_cells() override { next_cell_ = 0; }
  void read_array(std::size_t array, std::uint64_t step, std::uint64_t first, std::uint64_t count,
                  std::byte* out) override;

  // Labels of sets whose distribution factors are left out: it is not known to which members they
  // belong, as where cells have sides of several numbers of nodes.
  const std::vector<std::string>& without_factors() const { return without_factors_; }

  // Ascending numbers in the file: element i is that of vertex or cell i.
  const std::vector<std::uint64_t>& vertex_numbers() const { return file_->vertex_numbers(); }
  const std::vector<std::uint64_t>& cell_numbers() const { return file_->cell_numbers(); }

  // Of step values that were read: how many elements lack theirs, by array and step of the file.
  const std::map<std::pair<std::uint32_t, std::uint64_t>, std::uint64_t>& lost_values() const {
    return lost_values_;
  }

 private:
  struct Array {
    enum class What { of_file, vertex_numbers, cell_numbers } what = What::of_file;
    std::uint32_t source = 0;  // of the file's arrays
    std::optional<PagedArray> values{};
    std::map<std::uint64_t, PagedArray> steps{};  // by step of the file
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
  std::optional<std::uint64_t> step_;  // the only one
  std::optional<std::uint32_t> points_array_;
  std::optional<std::vector<std::uint32_t>> wanted_;
  MeshInfo info_;
  std::vector<std::uint32_t> kept_blocks_, new_blocks_;  // of the file; by block of the file

  PagedArray points_;
  CellStore cells_;  // corners are numbers of the file
  NumberList arrived_vertices_, arrived_cells_;
  bool vertices_moved_ = false, cells_moved_ = false;
  std::uint64_t last_vertex_ = 0, last_cell_ = 0;
  std::optional<NumberTable> cell_positions_;   // in the order of arrival
  std::vector<std::uint64_t> block_cells_;      // by block of the file
  std::map<std::uint32_t, PagedArray> staged_;  // static arrays, by number in the file
  std::map<std::vector<std::uint32_t>, std::vector<std::uint64_t>> covered_;  // by blocks
  std::vector<Array> arrays_;
  std::uint64_t next_cell_ = 0;
  std::map<std::pair<std::uint32_t, std::uint64_t>, std::uint64_t> lost_values_;
  std::vector<std::string> without_factors_;
};

// From numbers of the file to those of a piece, which has `sorted` of them; nothing where it has
// not.
std::optional<std::uint64_t> rank_of(const std::vector<std::uint64_t>& sorted,
                                     std::uint64_t number);

}  // namespace shm::converters
