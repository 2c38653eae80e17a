// ExodusMesh: an open Exodus file. It can be read as a mesh (described in exodus.h), or variable by
// variable.
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include "exodus/describe.h"
#include "exodus/layout.h"
#include "exodus/netcdf.h"
#include "exodus/skeleton.h"
#include "mesh/mesh_source.h"

namespace shm::converters::exodus {

// Owner of an open netCDF file. The destructor closes the file. A negative `id` means that no file
// is open.
struct NetcdfFile {
  NetcdfFile() = default;
  NetcdfFile(const NetcdfFile&) = delete;
  NetcdfFile& operator=(const NetcdfFile&) = delete;
  ~NetcdfFile() {
    if (id >= 0) nc_close(id);
  }
  int id = -1;
};

class ExodusMesh final : public MeshSource, public VariableValues {
 public:
  // Opens the Exodus file at `path`. Throws Failure.
  explicit ExodusMesh(const std::string& path);

  const MeshInfo& info() const override { return info_; }
  void read_points(std::uint64_t first, std::uint64_t count, std::byte* out) override;
  bool next_cells(CellBatch& out, std::size_t max_cells) override;
  void rewind_cells() override {
    at_ = {};
    polyhedron_nodes_ = 0;
  }
  void seek_cells(std::uint64_t first) override;
  void read_array(std::size_t array, std::uint64_t step, std::uint64_t first, std::uint64_t count,
                  std::byte* out) override;

  const Skeleton& skeleton() const { return skeleton_; }
  const Layout& layout() const { return layout_; }
  std::vector<std::byte> rows(int index, std::uint64_t first, std::uint64_t count) const override;
  // Returns the values `first` to `first` + `count` - 1 of an integer variable with one dimension.
  std::vector<std::int64_t> integers(int index, std::uint64_t first, std::uint64_t count) const;

 private:
  // Position at which next_cells() continues to read.
  struct Position {
    std::uint32_t block = 0;
    std::uint64_t cell = 0;  // index of the cell in its block

    // Index of the cell's first node in the block's connectivity (polygons), or of its first face
    // in the block's list of faces (polyhedra).
    std::uint64_t node = 0;
  };

  void read_structure();
  void check_sizes();
  void find_nodes();
  void read_faces();
  // Faces in the order in which the polyhedra first use them: the number of each face in the file,
  // and how often it is used.
  struct FaceUses {
    std::vector<std::int64_t> numbers;
    std::vector<std::uint32_t> uses;
  };
  bool faces_follow(FaceUses& faces) const;
  void add_face_numbers(const FaceUses& faces);
  bool faces_are_unlike() const;

  const Variable& variable(int index) const {
    return skeleton_.variables[static_cast<std::size_t>(index)];
  }
  void touch(int index) const { caches_.touch(file_.id, skeleton_, index); }
  std::string section(int index) const { return "variable '" + variable(index).name + "'"; }

  template <class Real>
  void read_points_as(std::uint64_t first, std::uint64_t count, Real* out);
  void read_part(const ArrayLayout& array, const ArrayPart& part, std::uint64_t step,
                 std::uint64_t first, std::uint64_t count, std::byte* out);
  bool read_global(const ArrayLayout& array, const ArrayPart& part, std::uint64_t step,
                   std::byte* out);

  void read_connectivity(const BlockLayout& block, std::uint64_t first, std::uint64_t cells);
  std::uint64_t take_nodes(CellBatch& out, std::uint64_t most);
  std::uint64_t take_polygons(CellBatch& out, std::uint64_t most);
  std::uint64_t take_polyhedra(CellBatch& out, std::uint64_t most);
  std::uint64_t vertex_of(std::int64_t node) const;

  Place place_;
  NetcdfFile file_;
  mutable ChunkCaches caches_;
  Skeleton skeleton_;
  std::vector<std::byte> globals_;  // global variables at all steps, once they have been read
  Layout layout_;
  MeshInfo info_;
  // Maximum size in bytes of a variable's values, derived from the size of the file.
  std::uint64_t most_bytes_ = 0;
  // Result of exodus_permutation() for each block.
  std::vector<std::vector<std::uint16_t>> places_;

  // Index of the first node of each face in face_nodes_; empty if the mesh has no polyhedra.
  std::vector<std::uint64_t> face_begin_;
  std::vector<std::int64_t> face_nodes_;
  Position at_;
  // Total number of nodes of the polyhedra before the reading position `at_`. A node of a
  // polyhedron is counted once per face that contains it.
  std::uint64_t polyhedron_nodes_ = 0;
  std::vector<std::int64_t> nodes_;
};

}  // namespace shm::converters::exodus
