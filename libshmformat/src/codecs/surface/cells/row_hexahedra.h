// Row hexahedra: predicts each hexahedron from the neighbouring row of hexahedra. It codes
// hexahedra in coding order as symbols of the bitstreams "connectivity" and "corner order". Encoder
// and decoder keep the same state: the active surface, a record for each hexahedron on the surface,
// and the models.
//
// Every hexahedron has a frame of three axes, which is transferred from one hexahedron to the next
// across the shared face. So corresponding sides have the same index in all hexahedra of a row or
// layer, and no rotation is encoded. A hexahedron is encoded in this order:
//   gate       The active face to which the hexahedron is attached. The guess: if the previous
//              hexahedron was attached to hexahedron A, the gate is on the hexahedron that was
//              coded after A, at the same side.
//   sides      Which of the four faces around the gate are shared. This usually follows from the
//   fan
//              of hexahedra around the edge between the gate and the face.
//   far face   Whether the face opposite the gate is shared.
//   corners    The corners that are still unknown: each is a new vertex, a live vertex nearby, or
//              any live vertex.
//   last use   The corners that no later cell uses.
// spec: "Row hexahedra"
#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <vector>

#include "entropy/mixing.h"
#include "entropy/models.h"
#include "mesh/active_surface.h"
#include "mesh/cell_topology.h"
#include "mesh/hexahedron.h"
#include "mesh/open_faces.h"

namespace shm {

/// A live vertex that may be the next corner. `met`: number of candidates found before it.
struct JoinCandidate {
  std::uint32_t slot = 0, score = 0, met = 0;
};

template <class Coder>
class RowHexahedra {
 public:
  /// The kind of a decision, which is part of its context. Frozen: part of the format.
  enum Question : std::uint8_t {
    kHit = 0,
    kWhich = 1,
    kKind = 2,
    kPreviousSide = 3,
    kChainPlace = 4,
    kEdgePlace = 5,
    kDistanceAgain = 6,
    kDistanceWhich = 7,
    kDistance = 8,
    kRecentSide = 9,
    kSide = 10,
    kFar = 11,
    kRepeated = 12,
    kRepeatedWhich = 13,
    kNew = 14,
    kJoin = 15,
    kFromLast = 16,
    kReferenceStep = 17,
    kReferenceAge = 18,
    kOrientation = 19,
    kStoredFace = 20,
    kStoredCorner = 21,
    kTurned = 22,
    kMirrored = 23,
    kFinal = 24,
    kCloses = 25,
    kFinalOfMixed = 26,
    kQuestions = 27
  };

  /// Both arguments must outlive this object. `open`: open faces of cells of all shapes; null if
  /// the mesh has only hexahedra.
  // The attribute `cold` makes the constructor small. Without it, the compiler generates separate
  // initialization code for each of thousands of models.
  [[gnu::cold]] explicit RowHexahedra(ActiveSurface& surface, const OpenFaces* open = nullptr)
      : surface_(&surface), open_(open) {}

  /// Codes the corners of one hexahedron, and attaches it to the surface. If `order_matters` is
  /// set, also codes the order of the corners; otherwise only codes whether the hexahedron is
  /// mirrored. Returns false only when decoding damaged data.
  bool code(Coder& symbols, Coder& corner_order, const StoredCell& stored, CellTopology& cell,
            bool order_matters);
  /// Codes which vertices no cell after this cell uses. Call it after the rest of the cell has been
  /// coded. It does not finalize these vertices; the caller must do this.
  void code_last_use(Coder& symbols, CellTopology& cell);

 private:
  /// Returns the bit that represents a corner or face in a bit set.
  static constexpr std::uint32_t bit(std::uint32_t i) { return 1u << i; }

  using Bit = typename Coder::Bit;
  using Number = NumberModelOf<Bit>;
  template <int kBits>
  using Tree = TreeModel<kBits, Bit>;
  template <std::size_t kSize>
  using Choice = ChoiceModel<kSize, Bit>;

  using Corners =
      std::array<std::uint32_t, 8>;  // vertices of the corners; the corner at (x, y, z) in the
                                     // frame has the index x + 2y + 4z (its corner bits)
  enum Kind : std::uint8_t { kCandidate, kPrevious, kChain, kAtEdge, kRecent, kStart, kKinds };

  /// Data of a hexahedron. They are kept while at least one face of the hexahedron is active.
  struct Record {
    std::uint64_t sequence = ~std::uint64_t{0};
    std::uint32_t successor = kNone;  // slot of the hexahedron that was coded just after this one
    std::array<std::uint32_t, 6> face{kNone, kNone, kNone, kNone, kNone, kNone};
    std::uint8_t orientation = 0;  // orientation of the corners as stored, relative to the frame
    std::uint8_t shared = 0;       // set of faces that were shared when the hexahedron was coded
    std::uint8_t introduced = 0;   // set of corners that the hexahedron introduced
    std::uint8_t finals = 0;       // set of corners that the hexahedron finalized
    std::uint8_t repeats = 0;      // set of corners that have the same vertex as an earlier corner
    bool guessed = false;          // true if the gate of this hexahedron was one of the candidates
  };
  /// A hexahedron that shares a face with the most recently coded hexahedron. `side`: index that
  /// the shared face has in this Owner, not in the most recently coded hexahedron.
  struct Owner {
    std::uint32_t cell = kNone;
    std::uint64_t sequence = 0;
    std::uint8_t side = 0;
  };
  /// A gate that the encoder considers: an active face, and the orientation that the hexahedron
  /// would have at this face.
  struct Fit {
    std::uint32_t face = kNone;
    std::uint8_t orientation = 0;
  };
  /// The current hexahedron.
  struct Work {
    Corners corner{};  // vertices of the known corners
    Corners target{};  // encoder: vertices of all corners; kNone: new
    std::array<std::uint64_t, 8>
        number{};  // encoder: vertex numbers of the corners; two numbers are equal if and only if
                   // both corners are the same vertex
    std::uint32_t known = 0;
    std::uint8_t introduced = 0;
    std::array<std::uint32_t, 6> shared{kNone, kNone, kNone, kNone, kNone, kNone};
    const Record* owner = nullptr;
    std::uint32_t gate_side = 0;  // index, in the current hexahedron, of the face that is the gate
    Kind kind = kStart;
  };
  struct Coded {
    std::uint64_t sequence = 0;
    std::uint32_t cell = 0;
  };
  /// A vertex that, as the next corner, would make a side of the hexahedron coincide with an open
  /// quadrilateral (a face of a cell that is not a hexahedron).
  struct ClosingVertex {
    std::uint32_t slot = kNone;
    /// Score of the vertex: the sum over all edges that connect known corners and belong to an open
    /// quadrilateral with this vertex. An edge adds 2, or 3 if the fourth corner of its
    /// quadrilateral is known, too
    std::uint32_t score = 0;
    std::uint32_t others =
        0;  ///< number of other vertices that would also close an open quadrilateral at this corner
  };

  // Gate (row_hexahedra_surface.cpp)
  bool code_gate(Coder& symbols, const StoredCell& stored, Fit& gate, Kind& kind);
  bool code_candidate(Coder& symbols, const StoredCell& stored, Fit& gate);
  Kind choose_elsewhere(const StoredCell& stored, Fit& gate, std::uint32_t& index);
  bool code_listed(Coder& symbols, Kind kind, Choice<32>& model, std::uint32_t index,
                   std::uint32_t& face);
  bool code_side(Coder& symbols, Question question, std::uint32_t cell, std::uint32_t& face);
  void list_candidates();
  void list_faces(Kind kind, std::vector<std::uint32_t>& out) const;
  void list_chain(std::vector<std::uint32_t>& out) const;
  void list_at_edges(std::vector<std::uint32_t>& out) const;
  bool code_recent(Coder& symbols, std::uint32_t& face);
  std::uint32_t cell_of(std::uint64_t sequence) const;
  std::uint32_t live_face(std::uint32_t cell, std::uint32_t side) const;
  Fit fit(const StoredCell& stored, std::uint32_t face) const;
  void find_shared(const StoredCell& stored, std::vector<Fit>& out) const;

  // Functions that code faces and corners
  void take_gate(std::uint32_t face);
  bool is_shared(std::uint32_t face) const {
    bool found = false;
    for (const std::uint32_t shared : work_.shared) found |= shared == face;
    return found;
  }
  void code_sides(Coder& symbols, std::uint32_t gate);
  bool share(Coder& symbols, Bit& model, std::uint32_t side, std::uint32_t face, std::uint32_t a,
             std::uint32_t b, std::uint32_t above_a, std::uint32_t above_b);
  bool code_corner(Coder& symbols, CellTopology& cell, std::uint32_t corner);
  bool code_reference(Coder& symbols, std::uint32_t& slot);
  std::uint32_t count_leads(std::uint32_t corner) const;
  void list_joins(std::uint32_t corner);
  // --- hexahedra next to cells of other shapes
  ClosingVertex find_closing_vertex(std::uint32_t corner);
  std::uint32_t open_faces_of_others(std::uint32_t slot) const;

  // These functions set the contexts of the next decision. Only a coder that mixes predictions
  // needs them (row_hexahedra_contexts.cpp).
  void about_candidates(Coder& symbols) const;
  void about_candidate(Coder& symbols, std::uint32_t index) const;
  void about_kind(Coder& symbols) const;
  void about_cell_side(Coder& symbols, Question question, std::uint32_t cell, std::uint32_t side,
                       std::uint32_t left) const;
  void about_listed(Coder& symbols, Kind kind) const;
  void about_distance(Coder& symbols, Question question) const;
  void about_side(Coder& symbols, FaceEdge edge, std::uint32_t evidence, bool candidate,
                  std::uint32_t yes) const;
  void about_far(Coder& symbols, FaceEdge top, FaceEdge mate) const;
  void about_new(Coder& symbols, std::uint32_t corner, std::uint32_t leads,
                 std::uint32_t neighbours) const;
  void about_join(Coder& symbols, std::uint32_t rank) const;
  void about_closing_vertex(Coder& symbols, std::uint32_t corner,
                            const ClosingVertex& closing) const;
  void about_reference(Coder& symbols, Question question) const;
  void about_orientation(Coder& corner_order, std::uint32_t index, std::uint8_t orientation,
                         std::uint32_t votes, std::uint32_t voters) const;
  void about_stored_face(Coder& corner_order, std::uint32_t theirs) const;
  void about_stored_corner(Coder& corner_order, std::uint32_t mine) const;
  void about_last_use(Coder& symbols, const Record& record, std::uint32_t corner,
                      std::uint32_t slot, std::uint32_t next_uses) const;
  std::uint32_t live_sides(std::uint32_t cell) const;
  std::uint32_t shared_sides() const;
  std::uint32_t fans(std::uint32_t face) const;
  std::uint32_t sorted_fans(std::uint32_t face) const;
  std::uint32_t crowd(std::uint32_t face) const;
  std::uint32_t uses(std::uint32_t face) const;
  std::uint32_t age(std::uint32_t face) const;
  std::uint32_t gate_age() const;
  const Record& last() const;

  // Functions that are called when all corners are known (row_hexahedra_surface.cpp)
  void find_other_shared();
  std::uint8_t orientation_across(std::uint32_t side) const;
  bool code_orientation(Coder& corner_order, Coder& symbols, bool order_matters,
                        std::uint8_t& orientation);
  bool code_orientation_at_gate(Coder& corner_order, std::uint8_t& orientation);
  void attach(CellTopology& cell);
  void link_edges(const std::array<std::uint32_t, 6>& face);

  ActiveSurface* surface_;
  const OpenFaces* open_;
  std::vector<Record> records_;  // records by cell slot
  std::vector<Coded> coded_;  // hexahedra in coding order; from time to time, hexahedra without a
                              // record are removed
  Work work_;
  Record owner_;  // copy of the record of the hexahedron to which the gate belongs

  // The most recently coded hexahedron
  std::uint32_t last_cell_ = kNone;
  std::uint64_t sequence_ = 0;  // sequence number of the next hexahedron
  std::array<Owner, 6> owners_{};
  std::uint32_t owner_count_ = 0;
  struct Candidate {
    std::uint32_t face = kNone;
    std::uint32_t support =
        0;                 // number of other candidates with which this candidate shares an edge
    bool guessed = false;  // true if the hexahedron with this face was attached to a gate that was
                           // itself a candidate
  };
  std::array<Candidate, 6> candidates_{};
  std::uint32_t candidate_count_ = 0;
  // Value of ActiveSurface::removed_faces() when the candidates were listed; ~0: not listed yet
  std::uint64_t candidates_at_ = ~std::uint64_t{0};

  // Contexts of the next decisions
  std::uint32_t hits_ =
      0;  // the three most recent gates, with one bit each: 1 if the gate was a candidate
  std::uint32_t kinds_ = 0;
  std::uint32_t gates_ = 0;  // for each of the ten most recent gates: its kind, in three bits
  std::uint32_t last_gate_side_ = 0, gate_side_before_ = 0;
  std::uint32_t last_side_ = 0;
  std::uint32_t orientation_hits_ = 0, last_stored_face_ = 0;
  std::uint8_t last_finals_ = 0;
  std::array<std::uint64_t, 8> distances_{};
  std::uint64_t last_reference_ = 0;

  // Adaptive models of the decisions
  std::array<std::array<std::array<std::array<Bit, 2>, 8>, 4>, 7> hit_;
  std::array<std::array<std::array<std::array<std::array<Bit, 2>, 4>, 4>, 4>, 4> which_;
  std::array<Tree<3>, 64> kind_;
  std::array<Choice<6>, 6> previous_side_;
  Choice<32> chain_, at_edge_;
  Bit distance_again_;
  Tree<3> distance_which_;
  Number distance_;
  std::array<Choice<6>, 6> recent_side_;
  std::array<std::array<std::array<std::array<std::array<Bit, 2>, 2>, 2>, 6>, 8> side_;
  std::array<std::array<std::array<std::array<Bit, 2>, 5>, 5>, 8> far_;
  std::array<std::array<std::array<Bit, 2>, 4>, 8> repeated_;
  std::array<Tree<3>, 8> repeated_which_;
  std::array<std::array<std::array<std::array<Bit, 2>, 4>, 8>, 2> is_new_;
  std::array<std::array<Bit, 8>, 8> join_;
  std::array<std::array<Bit, 3>, 8> closes_;
  Bit from_last_;
  SignedModel<Number> reference_step_;
  Number reference_age_;
  std::array<std::array<std::array<std::array<Bit, 8>, 5>, 5>, 3> orientation_hit_;
  std::array<std::array<Tree<3>, 6>, 6> stored_face_;
  std::array<std::array<Tree<2>, 6>, 6> stored_corner_;
  std::array<Bit, 2> turned_;
  std::array<Bit, 2> mirrored_;
  /// Models of the decision whether this is the last use of a vertex. The indices are: the number
  /// of open faces of other cells at the vertex, the number of active faces at the vertex, the
  /// number of its uses, whether the same corner was marked as last use in the owner of the gate
  /// and in the previous hexahedron, and the number of candidates that contain the vertex.
  std::array<std::array<std::array<std::array<std::array<Bit, 3>, 4>, 9>, 8>, 4> final_;

  std::vector<std::uint32_t> faces_;
  std::vector<Fit> fits_;
  std::vector<JoinCandidate> joins_;
  // For each vertex slot: the index in joins_ of the vertex. Valid only if joins_ contains the
  // vertex
  std::vector<std::uint32_t> join_place_;
};

extern template class RowHexahedra<RangeEncoder>;
extern template class RowHexahedra<RangeDecoder>;
extern template class RowHexahedra<MixingCoder<RangeEncoder>>;
extern template class RowHexahedra<MixingCoder<RangeDecoder>>;

}  // namespace shm
