// CellCorners: codes the corners of cells other than hexahedra as decisions of the bitstream
// "connectivity", node by node in stored order. Each corner is a new vertex or one of several
// candidates:
// - the vertex whose number continues the numbers of the previous cell of the block,
// - nodes of the cells that were coded just after the neighbours of the previous cell of the block,
// - nodes of open faces that share vertices with the current cell,
// - nodes of the previous cell.
// The candidate that is most likely according to earlier cells is tried first. Encoder and decoder
// keep the same state: the open faces of cells of all shapes, the most recent cells, and the
// models.
// spec: "Corners of other cells"
#pragma once

#include <array>
#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <span>
#include <vector>

#include "entropy/mixing.h"
#include "entropy/models.h"
#include "mesh/active_surface.h"
#include "mesh/cell_shapes.h"
#include "mesh/cell_topology.h"
#include "mesh/open_faces.h"

namespace shm {

template <class Coder>
class CellCorners {
 public:
  /// `surface` must outlive this object.
  explicit CellCorners(ActiveSurface& surface) : surface_(&surface) {}

  /// Codes the corners of a cell that has at least one corner. Decoding sets the cell's slots and
  /// new_positions. Calls `add_vertex(position)` to create each new vertex. Returns false only when
  /// decoding damaged data.
  bool code(Coder& symbols, const StoredCell& stored, CellTopology& cell, CellShape shape,
            const std::function<void(std::uint32_t)>& add_vertex);
  /// Updates the open faces after the corners of a cell have been coded and before its last uses
  /// are coded. The cell may have any shape. `as_stored`: states in which order the corners of a
  /// hexahedron are stored with its open faces: in the order of the source (true) or in the coder's
  /// own order (false).
  void take_note(const CellTopology& cell, CellShape shape, bool as_stored);
  /// Codes the last_use flag of each corner of a cell: whether the cell is the last one that uses
  /// the vertex. Call this function after code() has coded the cell.
  void code_last_use(Coder& symbols, CellTopology& cell, CellShape shape);
  void forget(std::uint32_t vertex) { faces_.forget(vertex); }

  const OpenFaces& faces() const { return faces_; }

 private:
  static constexpr std::uint32_t kMost = OpenFaces::kMost;
  static constexpr std::uint32_t kShapes = 7, kPositions = 8;
  static constexpr std::size_t kCandidates = 24;
  /// Smallest probability, in units of 1/65536, at which the lead (the most likely vertex so far)
  /// is tried before faces are examined.
  static constexpr std::uint32_t kSure = 64512;
  enum Question : std::uint32_t { kNew, kAmong, kWhich, kLast, kQuestions };

  /// A candidate: a vertex that may be the node at a position, and the reasons for this guess.
  struct Candidate {
    std::uint32_t slot = kNone;
    std::uint8_t guesses =
        0;  ///< number of Guess objects that predict this vertex at this position, at most 2
    bool shift =
        false;  ///< true if the vertex has the number that the previous cell of the block predicts

    /// Total number of known nodes in the open faces that the vertex would complete, at most 7
    std::uint8_t shared = 0;
    /// Bit set of the directions of the open faces that the vertex would complete. Bit 0 is set if
    /// a face runs in the direction opposite to the side of this cell, and bit 1 if a face runs in
    /// the same direction
    std::uint8_t directions = 0;
    std::uint8_t beside =
        0;  ///< how often the vertex was found on an open face near known nodes, at most 15
    std::uint8_t place =
        kMost;  ///< position of the vertex in the previous cell; kMost if it is not in that cell
    std::uint32_t chance = 0;  ///< probability that the candidate is right, in units of 1/65536
    MixedBit* model = nullptr;
    /// Returns a context for coding, which combines the reasons for the candidate.
    std::uint32_t why() const { return clue(guesses, shared, directions, shift, place); }
  };
  /// A guess about the next cell of the block: an earlier cell that may be its neighbour, and the
  /// node of this neighbour that is expected at each position of the next cell.
  struct Guess {
    std::uint64_t number = 0;
    /// For each position of the next cell: the index of the expected node in the neighbour; kMost
    /// if no node is expected
    std::array<std::uint8_t, kMost> place{};
  };
  /// The most recent cell of a block.
  struct Past {
    std::vector<std::uint64_t> ids;
    /// Id of the cell's first node, minus the id of the first node of the previous cell of the
    /// block
    std::uint64_t step = 0;
    std::array<std::uint64_t, kMost> behind;
    std::vector<Guess> guesses;
    Past() { behind.fill(OpenFaces::kNever); }
  };
  struct ShapeModels {
    /// Models of the decision kWhich. The first index is the position. The second index combines
    /// five members of the candidate, each limited to a few values: guesses (3 values), shift (2),
    /// shared (4), place (9) and beside (2).
    std::array<std::vector<MixedBit>, kPositions> which;
    // Models of the decisions kNew and kAmong, by position and number of sides that match an open
    // face
    std::array<std::array<MixedBit, 3>, kPositions> is_new, among;
    // Models of the decision whether this is the last use of a vertex. The indices are the position
    // and the number of bare faces at the vertex (open faces that no flat cell covers)
    std::array<std::array<MixedBit, 8>, kPositions> last;
    std::array<std::array<AdaptiveBit, 6>, kPositions>
        lead;  // models of the decision whether the lead is right, by position and by its reasons
               // (guesses and shift)
    AdaptiveBit repeated;
    NumberModel repeat;
    // Models of the difference between a vertex id and its expected value: one for the first corner
    // of a cell, one for all other corners
    std::array<SignedModel<NumberModel>, 2> step;
    std::array<std::uint32_t, 6> before{};  // outcomes of the most recent cells, newest first
    std::uint32_t finals =
        0;  // bit set of the positions marked as last use in the previous cell of this shape
  };
  /// The corner that is being coded.
  struct Corner {
    std::uint32_t position = 0, model = 0;  ///< model: `position`, limited to kPositions - 1
    std::uint64_t expected =
        0;  ///< predicted id of the vertex, if ids increase as in the previous cell of the block
    std::uint32_t lead = kNone;  ///< slot of the lead, the most likely vertex before faces are
                                 ///< examined; kNone if none exists
    AdaptiveBit* lead_model = nullptr;
    /// Encoding: an earlier position in this cell that has the same vertex; kNone if none exists
    std::uint32_t repeats = kNone;
  };

  ShapeModels& models_of(CellShape shape);
  bool code_corner(Coder& symbols, const StoredCell& stored, CellTopology& cell, Corner& corner,
                   const std::function<void(std::uint32_t)>& add_vertex);
  std::uint32_t code_taken(CellTopology& cell, const Corner& corner);
  std::uint32_t code_missed(Coder& symbols, CellTopology& cell, const Corner& corner);

  void gather(const CellTopology& cell, Corner& corner);
  void gather_likely(const CellTopology& cell, Corner& corner);
  void gather_beside(const CellTopology& cell, std::uint32_t position);
  void gather_faces(const CellTopology& cell, std::uint32_t position);
  void gather_shared(const CellTopology& cell, const ShapeFace& ours, std::uint32_t place,
                     std::uint32_t known);
  void rank(const Corner& corner);
  Candidate* add(const CellTopology& cell, std::uint32_t position, std::uint32_t slot);
  static void count_beside(Candidate* candidate) {
    if (candidate != nullptr && candidate->beside < 15) ++candidate->beside;
  }
  void find_owners(const CellTopology& cell, std::uint32_t position);
  void make_guesses(Past& past, std::span<const std::uint32_t> corners);

  ActiveSurface* surface_;
  OpenFaces faces_;
  MixingCoder<Coder> mixing_{kQuestions};
  std::array<std::unique_ptr<ShapeModels>, kShapes> all_models_;
  std::map<std::uint32_t, Past> past_;            // by block: its most recent cell
  std::array<std::uint32_t, kMost> last_cell_{};  // slots of the previous cell's corners
  std::uint32_t last_size_ = 0;

  // Data of the current cell
  ShapeModels* models_ = nullptr;
  Past* block_ = nullptr;
  std::span<const ShapeFace> sides_;
  std::uint32_t shape_ = 0;
  std::uint32_t gates_ =
      0;  // number of sides of the current cell that match an open face, at most 3
  std::uint32_t outcomes_ = 0, two_cells_ = 0, six_cells_ = 0;
  // Sequence numbers of the cells across the sides of the current cell
  std::vector<std::uint64_t> owners_;

  // Data of the current corner
  std::vector<Candidate> candidates_;
  struct Listed {
    std::uint64_t round = 0;
    std::uint32_t candidate = kNone;
  };
  std::vector<Listed> listed_;  // candidate of each vertex, by slot
  std::uint64_t round_ = 0;
};

extern template class CellCorners<RangeEncoder>;
extern template class CellCorners<RangeDecoder>;

}  // namespace shm
