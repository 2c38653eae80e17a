// Converts the polyhedra of Exodus (NFACED blocks). In the file, each face is stored once in a face
// block, and polyhedra refer to faces. In the mesh, each polyhedron contains the nodes of its
// faces. If every face is used and no two faces have the same nodes, the face blocks and the lists
// of faces can be derived from the cells. Only the order of the faces must then be stored.
#pragma once

#include <cstdint>
#include <span>
#include <unordered_map>
#include <vector>

#include "exodus/layout.h"

namespace shm::converters::exodus {

// Keys of the extras that describe the order of the faces. Faces are listed in the order in which
// the polyhedra of the file first use them. If the extra kSharedFirst (int32[1]) exists, faces that
// are used several times are listed before all other faces. The extra kFaceNumbers (int32 or int64)
// contains the number in the file of each listed face; numbers start at 1. If this extra is
// missing, the numbers are 1, 2, 3, ...
inline constexpr const char* kSharedFirst = "exodus/shared_faces_first";
inline constexpr const char* kFaceNumbers = "exodus/face_numbers";

// Returns the position of each face in the list of faces that kFaceNumbers describes. `uses`
// contains the number of uses of each face, in the order of their first use. The list has the same
// order, unless `shared_first` is true: then faces that are used several times come before all
// other faces.
std::vector<std::uint64_t> face_places(const std::vector<std::uint32_t>& uses, bool shared_first);

// A face block that stores the nodes of its faces in the variable `nodes`.
struct FaceBlock {
  int nodes = -1;  // index of the variable with the nodes of all faces

  // Index of the variable with the number of nodes of each face. If it is -1, all faces have `size`
  // nodes.
  int counts = -1;
  std::uint64_t faces = 0;
  std::uint64_t size = 0;
};
// Returns the face blocks of the file. Stops at the first face block that lacks a required
// variable. Throws Failure if a variable has the wrong shape.
std::vector<FaceBlock> face_blocks(const Skeleton& skeleton, const Place& place);

// Changes the shape of all blocks of polyhedra to `faces`. Variables that can be derived from the
// cells of these blocks no longer become extras or arrays.
void derive_faces(const Skeleton& skeleton, Layout& layout, const Place& place);

// Numbers distinct faces from 0, in the order of their first occurrence. A face is a list of nodes.
class FaceTable {
 public:
  // Returns the number of a face. A face that is not in the table yet receives the next number.
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
