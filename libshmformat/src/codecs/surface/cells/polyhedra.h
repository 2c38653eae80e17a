// Polyhedra: codes polyhedra as decisions of the bitstream "connectivity". A polyhedron is coded
// face by face, and a face is coded node by node, in stored order. A node is a new vertex or one of
// several candidates:
// - the next node along an open face of an earlier polyhedron,
// - the next node along an edge that only one face of the cell has so far,
// - the next node along an edge of the mesh,
// - the vertex whose number continues the numbers of the previous cell of the block.
// If a face is shared with an earlier polyhedron, its nodes after the first few cost almost
// nothing. The ends of faces and cells can usually be predicted. Encoder and decoder keep the same
// state: the open faces and edges, the most recent cells, and the models.
// spec: "Polyhedra"
#pragma once

#include <array>
#include <cstdint>
#include <functional>
#include <map>
#include <span>
#include <utility>
#include <vector>

#include "entropy/mixing.h"
#include "entropy/models.h"
#include "mesh/active_surface.h"
#include "mesh/cell_topology.h"
#include "mesh/polyhedron_surface.h"

namespace shm {

template <class Coder>
class Polyhedra {
 public:
  /// `surface` must outlive this object.
  [[gnu::cold]] explicit Polyhedra(ActiveSurface& surface) : surface_(&surface) {}

  /// Codes whether a cell is stored as a list of faces. If it is, codes its nodes. Sets the members
  /// `slots`, `new_positions` and `by_faces` of `cell`. `number`: number of the cell in the
  /// segment. The function calls `add_vertex(position)` to create each new vertex. When decoding,
  /// the cell has no nodes before the call. Returns false only when decoding damaged data.
  bool code(Coder& symbols, const StoredCell& stored, CellTopology& cell, std::uint64_t number,
            const std::function<void(std::uint32_t)>& add_vertex);
  /// Codes the last_use flags of a cell that is stored as a list of faces. Each flag states whether
  /// the cell is the last one that uses the vertex.
  void code_last_use(Coder& symbols, CellTopology& cell);
  void forget(std::uint32_t vertex) { open_.forget(vertex); }
  /// Returns the numbers of at most eight earlier polyhedra that share faces with the most recent
  /// polyhedron. Unused entries contain OpenFaces::kNever.
  const std::array<std::uint64_t, OpenFaces::kMost>& behind() const { return behind_; }

 private:
  static constexpr std::size_t kCandidates = 24;
  static constexpr std::size_t kLooked =
      64;  // largest number of vertices of the cell that are considered as the first node of a face

  // Largest number of open faces that are tried for each possible first node. The newest faces are
  // tried first
  static constexpr std::size_t kLookedFaces = 16;
  static constexpr std::size_t kMostEdges =
      32;  // largest number of edges of the cell that are stored for one vertex
  enum Question : std::uint32_t { kEnd, kClose, kNew, kAmong, kWhich, kLast, kQuestions };
  /// The way in which a node was coded. Later decisions use it as context.
  enum Outcome : std::uint32_t { kCloses = 1, kIsNew = 2, kIsMissed = 3, kIsTaken = 4 };

  /// A candidate: a vertex that may be the next node of a face, and the reasons for this guess.
  struct Candidate {
    std::uint32_t slot = kNone;
    /// If an open face contains the known nodes of the current face, followed by this vertex: the
    /// result of beginning() for that open face; otherwise 0
    std::uint8_t open = 0;
    /// A count of at most 2. For a later node of a face: how often the cell contains the edge to
    /// this vertex. For the first node of a later face: the number of edges at this vertex that
    /// only one face of the cell contains. For the first node of the cell: 1 if this vertex is the
    /// first node of an open face.
    std::uint8_t inside = 0;
    /// Number of polyhedra that contain the edge to this vertex; for the first node of a face,
    /// number of open faces at this vertex
    std::uint8_t edge = 0;
    bool shift =
        false;  ///< true if the vertex has the number that the previous cell of the block predicts
    bool ours = false;       ///< true if the cell already contains this vertex
    std::uint8_t place = 0;  ///< position of the vertex in the previous face, counted from 1; 0 if
                             ///< it is not in that face
    std::uint32_t chance = 0;
    MixedBit* model = nullptr;
    std::uint32_t why() const { return clue(open, inside, edge, shift, ours); }
  };
  /// An open face that contains all nodes of the current face so far, in the same order or in
  /// reverse order.
  struct Match {
    /// `at`: position in the open face at which the current face begins
    std::uint32_t face = kNone, at = 0;
    bool along = false;
  };
  struct CellVertex {
    std::uint32_t slot = kNone;
    /// The edges at this vertex. The first number is the vertex at the other end, the second is how
    /// often the cell contains the edge
    std::vector<std::pair<std::uint32_t, std::uint32_t>> edges;
  };
  /// The most recent cell of a block.
  struct Past {
    std::vector<std::uint64_t> ids;
    std::uint64_t step = 0;
  };
  /// Data of a vertex that apply to one cell, one face or one node of a face. The members `cell`,
  /// `face` and `node` are the running numbers (rounds) of that cell, face and node. Data with an
  /// earlier round are ignored, so they need not be cleared.
  struct Seen {
    std::uint64_t cell = 0, face = 0, node = 0;
    std::uint32_t vertex = 0, candidate = kNone;
    std::uint32_t place = 0;  ///< position in the face, from 1
  };

  static bool told_by_faces(std::span<const std::uint64_t> numbers);
  void begin_cell(CellTopology& cell);
  void end_cell();
  bool code_face(CellTopology& cell);
  bool code_close(bool ends);
  bool code_end();
  bool code_node(CellTopology& cell);
  std::uint32_t code_taken(CellTopology& cell);
  bool code_missed(CellTopology& cell);
  void note_outcome(std::uint32_t outcome);
  /// Returns the outcome that was coded at this position in the previous cell.
  std::uint32_t last_outcome() const {
    return position_ < last_outcomes_.size() ? last_outcomes_[position_] : 0;
  }
  void fill_repeats(CellTopology& cell);

  void take(std::uint32_t slot);
  std::uint32_t node_of(const Match& match, std::size_t i) const;
  void close_face();
  void note_edge(std::uint32_t a, std::uint32_t b);
  std::uint32_t times(std::uint32_t a, std::uint32_t b);

  void gather();
  void gather_first();
  void gather_beginnings();
  void gather_next();
  void add_expected();
  Candidate* add(std::uint32_t slot);
  void rank();
  /// Returns a context for a match with an open face of `n` nodes: 3 if the current face begins at
  /// the first node of the open face, 2 if it begins at the last node, otherwise 1.
  static std::uint8_t beginning(std::size_t place, std::size_t n) {
    return place == 0 ? 3 : place + 1 == n ? 2 : 1;
  }
  Seen& seen(std::uint32_t slot) { return at_slot(seen_, slot); }

  ActiveSurface* surface_;
  PolyhedronSurface open_;
  MixingCoder<Coder> mixing_{kQuestions};
  std::map<std::uint32_t, Past> past_;  // most recent cell of each block
  AdaptiveBit by_faces_;
  // Models of the decision whether a face is the final face of the cell, by whether the cell is
  // closed and by the number of faces
  std::array<std::array<MixedBit, 16>, 2> end_;
  // Models of the decision whether a face ends. The indices are: how well the face matches an open
  // face, the state of the edge that would close the face, and the number of nodes
  std::array<std::array<std::array<MixedBit, 16>, 3>, 3> close_;
  // Models of the decisions kNew and kAmong, by the number of nodes so far and the kind of the best
  // candidate
  std::array<std::array<MixedBit, 4>, 3> is_new_, among_;

  // Models for the decision whether a candidate is the next node. Indexed by the number of nodes of
  // the face so far, and by the set of rules that proposed the candidate
  std::array<std::vector<MixedBit>, 3> which_;
  // Models of the decision whether this is the last use of a vertex, by the number of open faces
  // and the number of edges at the vertex
  std::array<std::array<MixedBit, 8>, 8> last_;
  // Models of the difference between a vertex number and its expected value: one for the first node
  // of a cell, one for all other nodes
  std::array<SignedModel<NumberModel>, 2> step_;
  // Outcomes of the last few nodes of the previous cell, combined into one number
  std::uint32_t before_ = 0;
  std::uint32_t last_finals_ =
      0;  // bit set of the positions marked as last use in the previous cell
  std::vector<std::uint32_t> last_outcomes_;  // outcomes of the previous cell, by position

  // Data of the current cell
  const std::function<void(std::uint32_t)>* add_vertex_ = nullptr;
  Past* block_ = nullptr;
  std::uint64_t number_ = 0;
  std::array<std::uint64_t, OpenFaces::kMost> behind_{};
  std::size_t behind_count_ = 0;
  std::vector<CellVertex> vertices_;  // vertices of the cell in order of first use; only the first
                                      // vertex_count_ entries are valid
  std::size_t vertex_count_ = 0;
  std::uint32_t position_ = 0, faces_ = 0, open_edges_ = 0, outcomes_ = 0;
  std::uint32_t last_size_ = 0;  // size of the previous face
  std::uint64_t shift_ = 0;
  std::vector<std::uint32_t> cell_outcomes_;
  std::vector<std::pair<std::uint32_t, std::uint32_t>> cell_edges_;
  // Nodes of the faces that the cell does not share with earlier cells, one face after another.
  // cycle_ends_ contains the position after the end of each face
  std::vector<std::uint32_t> new_cycles_, cycle_ends_;
  std::vector<std::pair<std::uint64_t, std::uint32_t>>
      positions_;                           // encoding: positions sorted by number
  std::span<const std::uint64_t> numbers_;  // encoding: numbers of the nodes, by position

  // Data of the current face
  std::vector<std::uint32_t> path_;
  std::vector<Match> matches_;

  // Data of the current node
  std::vector<Candidate> candidates_;
  std::uint64_t expected_ = 0;
  std::vector<Seen> seen_;  // data of each vertex, by slot
  std::uint64_t cell_round_ = 0, face_round_ = 0, node_round_ = 0;
};

extern template class Polyhedra<RangeEncoder>;
extern template class Polyhedra<RangeDecoder>;

}  // namespace shm
