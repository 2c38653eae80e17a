// CellCorners: codes the corners of cells other than hexahedra as decisions of the bitstream
// "connectivity", node by node in stored order. Each corner is a new vertex or one of several
// candidates:
// - the vertex that continues the numbers of the last cell of the block,
// - nodes of the cells that come after the neighbours of that cell,
// - nodes of open faces that share vertices with the current cell,
// - nodes of the last cell.
// Candidates are tried in the order of how often similar candidates were right. Encoder and decoder
// keep the same state: the open faces of cells of all shapes, the last cells, and the models.
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

  /// Codes the corners of a cell that has at least one corner: slots and new_positions. Calls
  /// `add_vertex(position)` to create each new vertex. Returns false only when decoding damaged
  /// data.
  bool code(Coder& symbols, const StoredCell& stored, CellTopology& cell, CellShape shape,
            const std::function<void(std::uint32_t)>& add_vertex);
  /// Opens and closes faces after the corners of a cell of any shape have been coded, and before
  /// its last uses are coded. `as_stored`: true if corners of a hexahedron are in the order of the
  /// source, false if they are in the coder's frame.
  void take_note(const CellTopology& cell, CellShape shape, bool as_stored);
  /// Codes last_use of the corners of a cell that code() has coded.
  void code_last_use(Coder& symbols, CellTopology& cell, CellShape shape);
  void forget(std::uint32_t vertex) { faces_.forget(vertex); }

  const OpenFaces& faces() const { return faces_; }

 private:
  static constexpr std::uint32_t kMost = OpenFaces::kMost;
  static constexpr std::uint32_t kShapes = 7, kPositions = 8;
  static constexpr std::size_t kCandidates = 24;
  /// Least probability, in units of 1/65536, at which a lead is tried before any faces are
  /// examined.
  static constexpr std::uint32_t kSure = 64512;
  enum Question : std::uint32_t { kNew, kAmong, kWhich, kLast, kQuestions };

  /// A candidate for the node at a position: a vertex, and the reasons for this guess.
  struct Candidate {
    std::uint32_t slot = kNone;
    std::uint8_t guesses = 0;  ///< number of guesses with this vertex at this position, at most 2
    bool shift = false;        ///< true: the vertex continues the numbers of the block's last cell

    /// Number of known nodes in the open faces that the vertex would close
    std::uint8_t shared = 0;
    /// Directions of the open faces that the vertex would close: 1 if such a face runs against the
    /// side of this cell, plus 2 if such a face runs along the side
    std::uint8_t directions = 0;
    std::uint8_t beside = 0;     ///< number of edges of open faces that lead to the vertex
    std::uint8_t place = kMost;  ///< position of the vertex in the last cell; kMost: none
    std::uint32_t chance = 0;    ///< probability that the candidate is right, in units of 1/65536
    MixedBit* model = nullptr;
    /// Returns a context that combines the reasons for the candidate.
    std::uint32_t why() const { return clue(guesses, shared, directions, shift, place); }
  };
  /// A cell that may be a neighbour of the next cell, and the node of this neighbour that is
  /// expected at each position of the next cell.
  struct Guess {
    std::uint64_t number = 0;
    /// For each position of the next cell: index of the node of this neighbour; kMost if there is
    /// none
    std::array<std::uint8_t, kMost> place{};
  };
  /// The last cell of a block.
  struct Past {
    std::vector<std::uint64_t> ids;
    /// Id of the cell's first node minus the id of the first node of the block's previous cell
    std::uint64_t step = 0;
    std::array<std::uint64_t, kMost> behind;
    std::vector<Guess> guesses;
    Past() { behind.fill(OpenFaces::kNever); }
  };
  struct ShapeModels {
    /// Models of the decision kWhich, by position, then by reasons: guesses (3 values), shift (2),
    /// shared (4), place (9), beside (2).
    std::array<std::vector<MixedBit>, kPositions> which;
    // Models of the decisions kNew and kAmong, by position and number of gates
    std::array<std::array<MixedBit, 3>, kPositions> is_new, among;
    // Models of last uses, by position and number of bare faces
    std::array<std::array<MixedBit, 8>, kPositions> last;
    std::array<std::array<AdaptiveBit, 6>, kPositions>
        lead;  // models of the lead, by position and reasons (guesses, shift)
    AdaptiveBit repeated;
    NumberModel repeat;
    // Models of the difference from the expected id, for the first corner and for the other corners
    std::array<SignedModel<NumberModel>, 2> step;
    std::array<std::uint32_t, 6> before{};  // outcomes of the last cells, newest first
    std::uint32_t finals = 0;               // last uses in the last cell, as a bit set
  };
  /// The corner that is being coded.
  struct Corner {
    std::uint32_t position = 0, model = 0;  ///< model: `position`, limited to kPositions - 1
    std::uint64_t expected = 0;  ///< id of the vertex if numbers continue as in the last cell
    std::uint32_t lead = kNone;  ///< slot of the likely vertex before faces are examined
    AdaptiveBit* lead_model = nullptr;
    /// Encoding: an earlier position with the same vertex; kNone if none exists
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
  std::map<std::uint32_t, Past> past_;            // last cell of each block that already has cells
  std::array<std::uint32_t, kMost> last_cell_{};  // slots of the last cell's corners
  std::uint32_t last_size_ = 0;

  // Data of the current cell
  ShapeModels* models_ = nullptr;
  Past* block_ = nullptr;
  std::span<const ShapeFace> sides_;
  std::uint32_t shape_ = 0;
  std::uint32_t gates_ = 0;  // number of sides found open, at most 3
  std::uint32_t outcomes_ = 0, two_cells_ = 0, six_cells_ = 0;
  // Sequence numbers of the cells across sides of the current cell
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
