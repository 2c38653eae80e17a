// SpiralReorderer: determines the order in which cells leave the delay buffer. It receives cells in
// input order and returns them in coding order. If waiting cells share a face with the previous
// hexahedron, it chooses one of them; otherwise, it chooses the cell that has waited longest. As a
// result, more hexahedra are attached to a face of the previous hexahedron, which takes fewer bits
// to code.
//
// A cell that shares no face with the chosen cells may wait for a long time. The number of waiting
// cells never exceeds the size of the buffer.
// source: paper section 3.1.1. Not part of the format: a reader sees only the resulting order.
#pragma once

#include <array>
#include <cstdint>
#include <map>
#include <unordered_map>

#include "base/number_map.h"

namespace shm {

class SpiralReorderer {
 public:
  using Corners = std::array<std::uint64_t, 8>;  // numbers that identify the vertices of the
                                                 // corners, in stored order; any numbers may be
                                                 // used

  /// Adds a cell. The caller chooses `handle`, which must differ from the handles of all waiting
  /// cells.
  void push_hexahedron(std::uint32_t handle, const Corners& corners);
  void push_other(std::uint32_t handle);
  std::size_t waiting() const { return by_age_.size(); }
  /// Removes the waiting cell that is next in coding order, and returns its handle. Precondition:
  /// waiting() > 0.
  std::uint32_t pop();

 private:
  /// Faces of the previous hexahedron, named from the viewpoint of an observer who walks through
  /// the mesh.
  enum Label : std::uint8_t { kFront, kLeft, kRight, kTop, kBottom, kBack, kLabels };
  using Face = std::array<std::uint64_t, 4>;  // vertex numbers of a face, in ascending order
  struct FaceHash {
    std::size_t operator()(const Face& face) const;
  };
  struct Waiting {
    std::uint64_t age = 0;
    bool hexahedral = false;
    Corners corners{};
  };

  static Face face_of(const Corners& corners, std::uint32_t face);
  void remove(std::uint32_t handle);
  void walk_through(Label label, std::uint32_t entered_face, const Corners& next);
  void start_at(const Corners& corners);

  std::uint64_t next_age_ = 0;
  std::map<std::uint64_t, std::uint32_t> by_age_;
  std::unordered_map<std::uint32_t, Waiting> cells_;
  // Handles of the waiting cells at each face. A face has at most two.
  std::unordered_map<Face, std::array<std::uint32_t, 2>, FaceHash> faces_;

  bool has_previous_ = false;
  Corners previous_{};
  std::array<std::uint8_t, kLabels> face_at_{};  // face of previous_ with each label
  Label horizontal_ = kRight, vertical_ = kTop;
  bool last_was_horizontal_ = true;
};

}  // namespace shm
