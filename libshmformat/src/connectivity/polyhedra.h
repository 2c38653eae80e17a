// Polyhedra: codes polyhedra face by face, and each face node by node, in stored order. A node is
// new, or one of some candidates: what continues an open face of an earlier polyhedron, an edge
// that the cell has on one side only, or an edge of the mesh; or what continues the numbers of the
// last cell of the block. So a face that is there costs next to nothing behind its first nodes, and
// where a face ends, and the cell, follows as a rule.
//   in     the nodes of a polyhedron
//   out    decisions for "connectivity"
//   keeps  open faces and edges, last cells, models; the same in encoder and decoder
// spec: "Polyhedra"
#pragma once

#include <array>
#include <cstdint>
#include <functional>
#include <map>
#include <utility>
#include <vector>

#include "entropy/mixing.h"
#include "entropy/models.h"
#include "surface/active_surface.h"
#include "surface/cell_topology.h"
#include "surface/polyhedron_surface.h"

namespace shm {

template <class Coder>
class Polyhedra {
 public:
  /// `surface` is borrowed.
  [[gnu::cold]] explicit Polyhedra(ActiveSurface& surface) : surface_(&surface) {}

  /// Codes whether a cell is told by its faces, and if it is, its nodes: slots, new_positions and
  /// cell.by_faces. `number`: of the cell in the segment. `add_vertex(position)` makes the new
  /// vertex. Decoding, the cell has no nodes before. False only when decoding damaged data.
  bool code(Coder& symbols, CellTopology& cell, std::uint64_t number,
            const std::function<void(std::uint32_t)>& add_vertex);
  /// Codes last_use of a cell that code() found to be by faces.
  void code_last_use(Coder& symbols, CellTopology& cell);
  void forget(std::uint32_t vertex) { open_.forget(vertex); }
  /// Of the last cell that was told by its faces: the numbers of those that had its faces before,
  /// the first eight, then OpenFaces::kNever.
  const std::array<std::uint64_t, OpenFaces::kMost>& behind() const { return behind_; }

 private:
  static constexpr std::size_t kCandidates = 24;
  static constexpr std::size_t kLooked = 64;       // vertices of the cell that a face may begin at
  static constexpr std::size_t kLookedFaces = 16;  // of each, the newest ones
  static constexpr std::size_t kMostEdges = 32;    // of the cell, at a vertex
  enum Question : std::uint32_t { kEnd, kClose, kNew, kAmong, kWhich, kLast, kQuestions };
  /// What happened at a node, for contexts.
  enum Outcome : std::uint32_t { kCloses = 1, kIsNew = 2, kIsMissed = 3, kIsTaken = 4 };

  /// What the next node of a face may be, and why.
  struct Candidate {
    std::uint32_t slot = kNone;
    std::uint8_t open =
        0;  ///< of an open face that it continues: where our first node stands there
    std::uint8_t inside = 0;  ///< edges that the cell has on one side only
    std::uint8_t edge = 0;    ///< polyhedra that had the edge to it
    bool shift = false;       ///< it goes on as the block's last cell did
    bool ours = false;        ///< a vertex of the cell
    std::uint8_t place = 0;   ///< in the face before, from 1
    std::uint32_t chance = 0;
    MixedBit* model = nullptr;
    std::uint32_t why() const { return clue(open, inside, edge, shift, ours); }
  };
  /// An open face that all nodes of ours so far are in, one behind the other.
  struct Match {
    std::uint32_t face = kNone, at = 0;  ///< where our first node stands
    bool along = false;
  };
  struct CellVertex {
    std::uint32_t slot = kNone;
    std::vector<std::pair<std::uint32_t, std::uint32_t>> edges;  ///< to, how often
  };
  /// The last cell of a block.
  struct Past {
    std::vector<std::uint64_t> ids;
    std::uint64_t step = 0;
  };
  /// What is known of a vertex by slot, in the rounds that it says.
  struct Seen {
    std::uint64_t cell = 0, face = 0, node = 0;  ///< rounds
    std::uint32_t vertex = 0, candidate = kNone;
    std::uint32_t place = 0;  ///< in the face, from 1
  };

  static bool told_by_faces(const CellTopology& cell);
  void begin_cell(CellTopology& cell);
  void end_cell();
  bool code_face(CellTopology& cell);
  bool code_close(bool ends);
  bool code_end(const CellTopology& cell);
  bool code_node(CellTopology& cell);
  std::uint32_t code_taken(CellTopology& cell);
  bool code_missed(CellTopology& cell);
  void note_outcome(std::uint32_t outcome);
  /// Of the last cell at this position.
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
  /// How a face of n nodes that begins at the one at `at` stands to an open one.
  static std::uint8_t beginning(std::size_t at, std::size_t n) {
    return at == 0 ? 3 : at + 1 == n ? 2 : 1;
  }
  Seen& seen(std::uint32_t slot) { return at_slot(seen_, slot); }

  ActiveSurface* surface_;
  PolyhedronSurface open_;
  MixingCoder<Coder> mixing_{kQuestions};
  std::map<std::uint32_t, Past> past_;  // by block
  AdaptiveBit by_faces_;
  std::array<std::array<MixedBit, 16>, 2> end_;                   // by closed, faces
  std::array<std::array<std::array<MixedBit, 16>, 3>, 3> close_;  // by match, edge, nodes
  std::array<std::array<MixedBit, 4>, 3> is_new_, among_;         // by nodes, what is best
  std::array<std::vector<MixedBit>, 3> which_;                    // by nodes, reasons
  std::array<std::array<MixedBit, 8>, 8> last_;                   // by open faces, edges
  std::array<SignedModel<NumberModel>, 2> step_;  // of a cell's first node, of others
  std::uint32_t before_ = 0;                      // outcomes of the last cell
  std::uint32_t last_finals_ = 0;                 // of it
  std::vector<std::uint32_t> last_outcomes_;      // of it, by position

  // the cell at hand
  const std::function<void(std::uint32_t)>* add_vertex_ = nullptr;
  Past* block_ = nullptr;
  std::uint64_t number_ = 0;
  std::array<std::uint64_t, OpenFaces::kMost> behind_{};
  std::size_t behind_count_ = 0;
  std::vector<CellVertex> vertices_;  // in order of their first use; the first vertex_count_
  std::size_t vertex_count_ = 0;
  std::uint32_t position_ = 0, faces_ = 0, open_edges_ = 0, outcomes_ = 0;
  std::uint32_t last_size_ = 0;  // of the face before
  std::uint64_t shift_ = 0;
  std::vector<std::uint32_t> cell_outcomes_;
  std::vector<std::pair<std::uint32_t, std::uint32_t>> cell_edges_;
  std::vector<std::uint32_t> new_cycles_, cycle_ends_;              // faces that were not open
  std::vector<std::pair<std::uint64_t, std::uint32_t>> positions_;  // encoding: by number

  // the face at hand
  std::vector<std::uint32_t> path_;
  std::vector<Match> matches_;

  // the node at hand
  std::vector<Candidate> candidates_;
  std::uint64_t expected_ = 0;
  std::vector<Seen> seen_;  // by slot
  std::uint64_t cell_round_ = 0, face_round_ = 0, node_round_ = 0;
};

extern template class Polyhedra<RangeEncoder>;
extern template class Polyhedra<RangeDecoder>;

}  // namespace shm
