// Paper hexahedra: the method of the paper for coding hexahedra, which is the baseline for all
// comparisons. Each hexahedron is coded as symbols of the bitstreams "connectivity" and "corner
// order". Encoder and decoder keep the same state: the previous hexahedron and the models.
//
// A hexahedron is attached to the active surface by one of five operations. The operation states
// which faces the hexahedron shares with the surface. Further shared faces are deduced, and one
// decision confirms each of them.
//   START   no face is shared, or no other operation fits: eight corners are coded, each as new,
//           live or repeated
//   HUT     one face f0 is shared
//   ROOF    f0 and the opposite face f5 are shared
//   STEP    f0 and f1, which have a common edge, are shared; then f2 (CORNER) and more (GAP, PIT,
//           DEN) are deduced
//   BRIDGE  f0, f1 and the opposite face f3 are shared; then TUNNEL is deduced
// The coder looks for the face f0 (the gate) on the previous hexahedron, at its edges, and at its
// vertices. If f0 is at none of these places, it is coded by the number of a live vertex.
// source: paper section 3.1; spec: "Connectivity stream", "Corner order stream"
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "entropy/models.h"
#include "mesh/active_surface.h"
#include "mesh/cell_topology.h"
#include "mesh/hexahedron.h"

namespace shm {

template <class Coder>
class PaperHexahedra {
 public:
  /// `surface` must outlive this object.
  explicit PaperHexahedra(ActiveSurface& surface) : surface_(surface) {}

  /// Codes the corners of one hexahedron and, if it matters, their order. Attaches the hexahedron
  /// to the surface. Returns false only when decoding damaged data.
  bool code(Coder& symbols, Coder& corner_order, const StoredCell& stored, CellTopology& cell,
            bool order_matters);

 private:
  enum Operation : std::uint8_t { kStart, kHut, kRoof, kStep, kBridge, kOperations };
  enum GateMode : std::uint8_t { kOnFace, kAtEdge, kAtVertex, kAnywhere, kGateModes };

  /// The way in which a hexahedron is attached to the surface: operation, rotation and gate. The
  /// encoder chooses the whole plan before it codes the hexahedron. The decoder decodes the plan
  /// step by step.
  struct Plan {
    Operation operation = kStart;
    std::uint32_t rotation = 0;
    GateMode mode = kAnywhere;
    std::uint32_t gate_face = kNone, side_face = kNone, far_face = kNone;
    std::uint64_t cost = ~std::uint64_t{0};
  };
  /// The position of the hexahedron on the gate face: which corner of the face is vertex 0 of the
  /// hexahedron, and the direction in which the other vertices of the face follow.
  struct Gate {
    FaceCorner at = kNone;
    bool mirrored = false;
  };
  using Corners = std::array<std::uint32_t, 8>;
  /// Models for a vertex number. The number is coded either as the difference from the previously
  /// coded number, or by the vertex's age relative to the oldest live vertex.
  struct ReferenceModel {
    AdaptiveBit from_last;
    SignedModel<NumberModel> step;
    NumberModel age;
    std::uint64_t last = 0;
  };

  // The encoder's choice of a plan
  Plan choose_plan(const StoredCell& stored) const;
  void rate_gate(Plan& plan, const Corners& target) const;
  static std::uint32_t earlier_corner(const StoredCell& stored, std::uint32_t position);
  static void rotate(const StoredCell& stored, CellTopology& cell, std::uint32_t rotation);

  // The following functions code the parts of a hexahedron. They are called in this order.
  bool code_gate(Coder& symbols, const Plan& plan, const Corners& target, Gate& gate);
  bool code_gate_face(Coder& symbols, const Plan& plan, const Corners& target, FaceCorner& corner,
                      bool mirrored);
  FaceCorner code_gate_on_face(Coder& symbols, const Plan& plan, const Corners& target,
                               std::uint32_t left);
  FaceCorner code_gate_at_edge(Coder& symbols, const Plan& plan, const Corners& target,
                               bool mirrored);
  FaceCorner code_gate_at_vertex(Coder& symbols, const Plan& plan, const Corners& target);
  bool code_gate_anywhere(Coder& symbols, const Plan& plan, const Corners& target,
                          FaceCorner& corner);
  bool code_second_face(Coder& symbols, const Plan& plan, const Corners& target, FaceCorner gate,
                        CellTopology& cell);
  bool code_roof(Coder& symbols, const Plan& plan, const Corners& target, CellTopology& cell);
  bool code_side(Coder& symbols, std::uint32_t along, std::uint32_t from, std::uint32_t not_face,
                 std::uint32_t side_face, int model, std::uint32_t& above_from,
                 std::uint32_t& above_along);
  bool code_corners_left(Coder& symbols, const Corners& target, CellTopology& cell);
  /// `repeats`: the earlier corner that has the same vertex as the corner `position`; 8 if no such
  /// corner exists.
  bool code_corner(Coder& symbols, const Corners& target, CellTopology& cell,
                   std::uint32_t position, std::uint32_t repeats = 8);
  bool code_reference(Coder& symbols, ReferenceModel& model, std::uint32_t& slot);
  bool code_corner_order(Coder& corner_order, const Gate& gate, CellTopology& cell,
                         std::uint32_t rotation);
  void attach(CellTopology& cell, bool order_matters);

  std::uint32_t add_vertex(CellTopology& cell, std::uint32_t position);
  bool previous_alive(std::uint32_t corner) const;
  bool on_previous(std::uint32_t face) const;
  void list_edge_gates(std::vector<std::pair<FaceCorner, std::uint32_t>>& out) const;
  void list_vertex_gates(std::vector<std::pair<FaceCorner, std::uint32_t>>& out) const;

  ActiveSurface& surface_;

  // The previous hexahedron, in its frame
  Corners previous_{};
  std::array<std::uint64_t, 8> previous_id_{};
  std::array<std::uint32_t, 6> previous_face_{kNone, kNone, kNone, kNone, kNone, kNone};
  std::uint32_t previous_cell_ = kNone;
  bool has_previous_ = false;

  // Contexts of the next decisions
  Operation operation_ = kStart;  // operation of the current cell
  std::uint32_t last_operation_ = kStart, mode_history_ = 0, last_face_ = 5, last_turn_ = 0;
  std::uint32_t rotation_history_ = 0;

  // Adaptive models of the decisions
  std::array<std::array<TreeModel<3>, 16>, kOperations> operations_;
  std::array<std::array<std::array<AdaptiveBit, 3>, 16>, kOperations> modes_;
  std::array<std::array<AdaptiveBit, 6>, 6> gate_on_face_;
  std::array<std::array<TreeModel<2>, 4>, 6> turn_;
  std::array<AdaptiveBit, 12> gate_at_edge_;
  std::array<AdaptiveBit, 8> gate_at_vertex_;
  ChoiceModel<16> gate_anywhere_;
  std::array<ChoiceModel<8>, 2> side_;
  ChoiceModel<16> roof_face_;
  AdaptiveBit roof_turned_;
  std::array<AdaptiveBit, kOperations> mirrored_;
  std::array<AdaptiveBit, 4> confirm_;
  std::array<std::array<std::array<AdaptiveBit, 2>, 8>, kOperations> corner_new_;
  std::array<AdaptiveBit, 8> corner_repeated_;
  TreeModel<3> repeated_corner_;
  ReferenceModel gate_reference_, join_reference_;
  std::array<AdaptiveBit, 4> rotation_hit_;
  TreeModel<5> rotation_;
  bool last_new_ = false;

  std::vector<std::pair<FaceCorner, std::uint32_t>> scratch_;
};

extern template class PaperHexahedra<RangeEncoder>;
extern template class PaperHexahedra<RangeDecoder>;

}  // namespace shm
