// Polyhedra of Exodus (NFACED blocks). In the file, polyhedra refer to faces, and each face is
// stored once in a face block. In the mesh, each polyhedron stores the nodes of its own faces. If
// every face is used, differs from all other faces and can be identified by its nodes, the face
// blocks and the lists of faces can be derived from the cells. Only the order of the faces must
// then be stored.
#pragma once

#include <cstdint>
#include <span>
#include <unordered_map>
#include <vector>

#include "exodus/layout.h"

namespace shm::converters::exodus {

// Keys of the extras that describe the order of the faces. Faces are listed in the order in which
// the polyhedra, in file order, first use them. If the extra kSharedFirst (int32[1]) exists, faces
// that are used several times come before all other faces. The extra kFaceNumbers (int32 or int64)
// contains the file's numbers of the faces, from 1, in this order. If this extra is missing, the
// numbers are 1, 2, 3, ...
inline constexpr const char* kSharedFirst = "exodus/shared_faces_first";
inline constexpr const char* kFaceNumbers = "exodus/face_numbers";

// Returns the position of each face in the order of kSharedFirst. `uses` contains the number of
// uses of each face; it lists the faces in the order of their first use.
std::vector<std::uint64_t> face_places(const std::vector<std::uint32_t>& uses, bool shared_first);

// A face block that stores the nodes of its faces in the variable `nodes`.
struct FaceBlock {
  int nodes = -1;  // variable with the nodes of all faces

  // Index of the variable with the number of nodes of each face. If it is -1, all faces have `size`
  // nodes.
  int counts = -1;
  std::uint64_t faces = 0;
  std::uint64_t size = 0;
};
// Returns the face blocks before the first face block that lacks these variables. Throws Failure if
// a variable has a wrong shape.
std::vector<FaceBlock> face_blocks(const Skeleton& skeleton, const Place& place);

// Changes the shape of blocks of polyhedra to `faces`. Variables that are derived from the cells of
// these blocks are then neither extras nor arrays.
void derive_faces(const Skeleton& skeleton, Layout& layout, const Place& place);

// Assigns numbers from 0 to distinct faces (lists of nodes), in the order of their first
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
