// SpiralReorderer: the delay buffer. It chooses a waiting cell that shares a face with the previous
// hexahedron, so that gates are more often found on the previous hexahedron. If there is no such
// cell, it chooses the cell that has waited longest.
// - Input: cells in input order.
// - Output: the same cells in coding order.
//
// A cell that shares no face with the cells chosen before it may wait long, but the number of
// waiting cells never exceeds the size of the buffer.
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
  using Corners = std::array<std::uint64_t, 8>;  // any numbers that identify the vertices of the
                                                 // corners, in stored order

  /// Adds a cell. The caller chooses `handle`, which must differ from the handles of all waiting
  /// cells.
  void push_hexahedron(std::uint32_t handle, const Corners& corners);
  void push_other(std::uint32_t handle);
  std::size_t waiting() const { return by_age_.size(); }
  /// Removes and returns the waiting cell that comes next. Must hold: waiting() > 0.
  std::uint32_t pop();

 private:
  /// Faces of the previous hexahedron, as seen by an observer who walks through the mesh.
  enum Label : std::uint8_t { kFront, kLeft, kRight, kTop, kBottom, kBack, kLabels };
  using Face = std::array<std::uint64_t, 4>;  // vertex numbers in ascending order
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
  // The cells at each face, at most two.
  std::unordered_map<Face, std::array<std::uint32_t, 2>, FaceHash> faces_;

  bool has_previous_ = false;
  Corners previous_{};
  std::array<std::uint8_t, kLabels> face_at_{};  // the face of previous_ with each label
  Label horizontal_ = kRight, vertical_ = kTop;
  bool last_was_horizontal_ = true;
};

}  // namespace shm
