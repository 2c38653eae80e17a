// Polyhedra of Exodus (NFACED blocks). In the file, polyhedra refer to faces, and each face is
// stored once in a face block. In the mesh, each polyhedron has its own faces, node by node. If
// every face is used, differs from all other faces and can be identified by its nodes, the face
// blocks and the lists of faces can be derived from the cells, except for the order of the faces.
#pragma once

#include <cstdint>
#include <span>
#include <unordered_map>
#include <vector>

#include "exodus/layout.h"

namespace shm::converters::exodus {

// Extras that describe the order of the faces. The faces are in the order in which the polyhedra,
// in file order, first use them. If the extra kSharedFirst (int32[1]) exists, faces used several
// times come before all other faces. The extra kFaceNumbers (int32 or int64) contains the numbers
// of the faces, from 1, in this order. If it is missing, the numbers are 1, 2, 3, ...
inline constexpr const char* kSharedFirst = "exodus/shared_faces_first";
inline constexpr const char* kFaceNumbers = "exodus/face_numbers";

// Returns the position of each face in the order described above. `uses` contains the number of
// uses of each face, in the order of first use.
std::vector<std::uint64_t> face_places(const std::vector<std::uint32_t>& uses, bool shared_first);

// A face block that stores the nodes of its faces in the variable `nodes`.
struct FaceBlock {
  int nodes = -1;  // variable with the nodes of all faces

  // Variable with the number of nodes of each face; -1: all faces have `size` nodes.
  int counts = -1;
  std::uint64_t faces = 0;
  std::uint64_t size = 0;
};
// Returns the face blocks up to, but without, the first face block that lacks these variables.
// Throws Failure if a variable has a wrong shape.
std::vector<FaceBlock> face_blocks(const Skeleton& skeleton, const Place& place);

// Changes blocks of polyhedra to the shape `faces`. Variables that are derived from the cells of
// these blocks are then neither extras nor arrays.
void derive_faces(const Skeleton& skeleton, Layout& layout, const Place& place);

// Assigns numbers from 0 to different faces (lists of nodes), in the order of their first
// occurrence.
class FaceTable {
 public:
  // Returns the number of a face. A new face receives the next number.
  std::uint64_t number_of(std::span<const std::uint64_t> nodes);
  std::uint64_t size() const { return begins_.size() - 1; }
  std::span<const std::uint64_t> nodes(std::uint64_t face) const {
    return std::span(nodes_).subspan(begins_[face], begins_[face + 1] - begins_[face]);
  }

 private:
  std::vector<std::uint64_t> begins_{0}, nodes_;
  std::unordered_multimap<std::uint64_t, std::uint64_t> by_hash_;
};

}  // namespace shm::converters::exodus
