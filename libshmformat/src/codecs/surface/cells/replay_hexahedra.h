// Replay hexahedra: codes each hexahedron as a repetition of an earlier hexahedron with different
// vertex numbers. Hexahedra are coded in coding order, as symbols of the bitstream "connectivity".
// Encoder and decoder keep the same state: a ring of the most recent cells, the numbers of live
// vertices, and the models.
//
// If a program has numbered the mesh, the numbers continue regularly: there is a distance d so that
// for each corner of cell i
//   number[i] = number[i - d] + (number[i - 1] - number[i - 1 - d])
// and cell i finalizes the same corners as cell i - d. One decision codes that all of this holds.
// The numbers are the source's vertex numbers (Order::keep) or stream numbers. If no live vertex
// has the number, the vertex is new. So numbers, cell order and corner order cost nothing extra,
// and no face is ever looked up. If the rule does not hold for a cell, the cell is coded corner by
// corner.
//
// The earlier cell i - d is the model cell of cell i. A stray is a corner whose vertex number was
// mispredicted from the model cell. Strays are common in refined meshes: when a cell is divided,
// each new cell has one corner of the original cell, and the number of this corner does not
// continue regularly. If a corner of a cell is a stray, the same corner of the model cell usually
// was a stray, too. As soon as the encoder has found enough repeated strays, it switches to
// following strays: encoder and decoder then predict which corners are strays, and which vertex
// numbers the strays have. The predicted number is the number of the previous stray plus a step.
// This step is the one that came after the most recent occurrence of the current step.
// spec: "Replay hexahedra"
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <utility>
#include <vector>

#include "base/number_map.h"
#include "entropy/models.h"
#include "mesh/active_surface.h"
#include "mesh/cell_topology.h"

namespace shm {

/// Smallest and largest capacity of the ring of earlier cells. Frozen: part of the format.
inline constexpr std::uint64_t kReplayLeast = std::uint64_t{1} << 14;
inline constexpr std::uint64_t kReplayWindow = std::uint64_t{1} << 18;

/// Ring of the most recent elements of a sequence. An element is accessed by its age. The capacity
/// of the ring is a power of two.
template <class T>
class LastRing {
 public:
  /// Returns the number of elements.
  std::uint64_t kept() const { return kept_; }
  /// Returns the element that was added `distance` elements ago; distance 1 is the most recent
  /// element. Only the distances 1 to kept() are meaningful, but any distance is memory-safe if the
  /// ring is not empty.
  const T& operator[](std::uint64_t distance) const { return ring_[place(sequence_ - distance)]; }
  /// Returns the storage of the next element. If the ring is full and its capacity is below
  /// `least`, doubles the capacity. If the ring is full and its capacity is large enough, replaces
  /// the oldest element.
  T& push(std::uint64_t least) {
    if (kept_ == ring_.size() && ring_.size() < std::max(least, kFirst))
      widen(std::max<std::size_t>(2 * ring_.size(), kFirst));
    T& entry = ring_[place(sequence_++)];
    kept_ = std::min<std::uint64_t>(kept_ + 1, ring_.size());
    return entry;
  }
  /// Sets the capacity and the number of elements to those of another ring, and sets all elements
  /// to T{}.
  template <class Other>
  void begin_as(const LastRing<Other>& other) {
    ring_.assign(other.ring_.size(), T{});
    sequence_ = other.sequence_;
    kept_ = other.kept_;
  }

 private:
  template <class>
  friend class LastRing;
  static constexpr std::uint64_t kFirst = 64;

  std::size_t place(std::uint64_t sequence) const {
    return static_cast<std::size_t>(sequence) & (ring_.size() - 1);
  }
  void widen(std::size_t size) {
    std::vector<T> wider(size);
    for (std::uint64_t n = 1; n <= kept_; ++n)
      wider[static_cast<std::size_t>(sequence_ - n) & (size - 1)] = (*this)[n];
    ring_ = std::move(wider);
  }

  std::vector<T> ring_;
  std::uint64_t sequence_ = 0, kept_ = 0;
};

template <class Coder>
class ReplayHexahedra {
 public:
  /// `surface` must outlive this object. `keep`: if true, corners are coded by the source's numbers
  /// in StoredCell::original; if false, by stream numbers. `strays`: true if the encoder may
  /// predict strays (mispredicted corners).
  ReplayHexahedra(ActiveSurface& surface, bool keep, bool strays)
      : surface_(&surface), keep_(keep), may_follow_(strays) {}

  /// Codes the corners of one hexahedron in stored order, and their last uses. Returns false if
  /// decoded data is damaged, or if two live vertices have the same number.
  bool code(Coder& symbols, Coder& corner_order, const StoredCell& stored, CellTopology& cell,
            bool order_matters);
  /// Sets the number of a vertex that has not been a corner of a hexahedron yet.
  void set_number(std::uint32_t slot, std::uint64_t number);
  /// Removes the vertex in `slot`. Call it before the vertex is finalized.
  void forget(std::uint32_t slot);

 private:
  using Numbers = std::array<std::uint64_t, 8>;
  using Slots = std::array<std::uint32_t, 8>;
  static constexpr std::size_t kMissSlots = 1024;
  // Number of recently used distances that are stored. The index of a distance is coded in a tree
  // of 3 bits. The values 6 (new distance) and 7 (kFollowStrays) are reserved, so 6 indices remain
  static constexpr std::uint32_t kDistances = 6;
  // Symbol that can occur once in the stream, before the index of a distance. After this symbol,
  // strays (mispredicted corners) are predicted
  static constexpr std::uint32_t kFollowStrays = 7;

  // Binary logarithm of the size of the table followers_. Frozen: part of the format
  static constexpr int kFollowerBits = 12;
  enum Kind : std::uint8_t { kExpected, kBeyond, kTop, kPrevious, kEarlier, kFromPrevious, kStep };

  using Halves = std::array<std::uint32_t, 8>;
  struct Past {
    Halves number{};         // lower halves of the vertex numbers
    std::uint8_t next = 0;   // set of corners whose number was the largest number so far plus 1
    std::uint8_t marks = 0;  // set of corners marked as last use

    // Set of strays: corners whose numbers were mispredicted. If the cell has no strays, this is a
    // copy of the set of its model cell, the earlier cell that it repeats
    std::uint8_t strays = 0;
    bool guessed = false;  // true if all corners and last-use marks were as expected
    std::uint32_t beside =
        1;  // distance, in cells, to the earlier cell whose shift this cell repeats
  };
  struct Named {
    std::uint64_t number = 0;
    bool known = false;  // true if the vertex can be found by its number
  };
  /// A source: an earlier corner with the same vertex. It is the corner `corner` of the cell that
  /// is `distance` cells before the current cell.
  struct Source {
    std::uint32_t distance = 1;
    std::uint8_t corner = 0;
  };
  /// Expected vertex numbers of a cell, and its expected last uses as a set of corners.
  struct Guess {
    Numbers number{};
    std::uint8_t marks = 0;
  };
  /// Parameters of a guess. The encoder chooses them; the decoder reads them.
  struct Choice {
    std::uint32_t place = 0;     // index in distances_; kDistances if the distance is new
    std::uint64_t distance = 0;  // the new distance, if there is one
    bool old_shift = false;      // true if the shift is computed over the distance of the previous
                                 // guess instead of the newly chosen distance

    // States which earlier cell's shift is repeated. 0: the cell at the distance that the model
    // cell used (Past::beside). 1: the previous cell. 2 or more: the cell at distance
    // distances_[beside - 2]
    std::uint32_t beside = 0;
  };

  const Past& past(std::uint64_t distance) const { return pasts_[distance]; }
  Numbers numbers(std::uint64_t distance) const {
    Numbers all;
    for (std::size_t c = 0; c < 8; ++c) all[c] = past(distance).number[c];
    if (upper_.kept() > 0)
      for (std::size_t c = 0; c < 8; ++c) all[c] |= std::uint64_t{upper_[distance][c]} << 32;
    return all;
  }
  std::uint64_t kept() const { return pasts_.kept(); }
  bool reaches(std::uint64_t distance) const { return distance > 0 && distance < kept(); }
  Guess guess(std::uint64_t distance, std::uint64_t over, std::uint64_t beside) const;
  std::uint64_t beside_of(std::uint64_t distance) const {
    return reaches(distance) ? past(distance).beside : 1;
  }
  std::uint64_t beside_of(std::uint64_t distance, std::uint32_t choice) const {
    return choice == 0 ? beside_of(distance) : choice == 1 ? 1 : distances_[choice - 2];
  }
  void take(const StoredCell& stored, Numbers& number, std::uint8_t& marks) const;
  Choice choose(const StoredCell& stored, const Numbers& number, std::uint8_t marks) const;
  std::size_t step_key(const Numbers& number) const;
  bool code_miss(Coder& symbols, const StoredCell& stored, CellTopology& cell, Numbers& number,
                 std::uint8_t& marks);
  bool code_choice_of_guess(Coder& symbols, Choice& choice);
  bool code_corners(Coder& symbols, const Guess& guess, Numbers& number);
  void code_marks(Coder& symbols, std::uint8_t expected, std::uint8_t& marks);
  bool resolve(const StoredCell& stored, CellTopology& cell, const Numbers& number);
  std::uint32_t look_up_hints(CellTopology& cell, const Numbers& number) const;
  bool resolve_corner(const StoredCell& stored, CellTopology& cell, const Numbers& number,
                      std::uint32_t corner);
  std::uint32_t find(std::uint64_t number, std::uint32_t corner);
  std::uint32_t find_anywhere(std::uint64_t number) const;
  void finish(CellTopology& cell, const Numbers& number, std::uint8_t marks);
  /// Returns the set of corners that are probably mispredicted: the strays of the model cell.
  /// Returns an empty set if the cell has no model cell.
  std::uint8_t likely_strays() const {
    return reaches(distances_[0]) ? past(distances_[0]).strays : std::uint8_t{0};
  }
  static std::size_t place_of_follower(std::uint64_t step, std::size_t corner);
  // The next two functions must be called only after kFollowStrays has been coded.
  std::uint64_t next_stray(std::size_t corner) const {
    return last_stray_ + followers_[place_of_follower(stray_step_, corner)];
  }
  void follow_strays(const Numbers& number);
  Past& remember(const CellTopology& cell, const Numbers& number);

  ActiveSurface* surface_;
  bool keep_, may_follow_;

  LastRing<Past> pasts_;
  // Upper 32 bits of the vertex numbers. The ring is empty until one of the numbers needs more than
  // 32 bits
  LastRing<Halves> upper_;
  LastRing<Slots> slots_;  // decoder: vertex slots of the most recent cells; this ring contains
                           // fewer cells than pasts_
  std::uint64_t sequence_ = 0;  // sequence number of the current hexahedron

  // Recently used distances to model cells; the most recently used distance comes first
  std::array<std::uint64_t, kDistances> distances_{1};
  bool marks_shift_ = false;

  std::vector<Named> named_;               // numbers of vertices, by slot
  std::vector<std::uint64_t> introduced_;  // encoder: for each vertex slot, the sequence number of
                                           // the hexahedron that introduced the vertex
  std::vector<std::uint64_t>
      misses_;  // encoder: for each result of step_key(), the sequence number of the most recent
                // mispredicted hexahedron with this key
  bool clash_ = false;   // true if two live vertices had the same number
  NumberMap by_number_;  // vertices by number; used in Order::keep only
  std::uint64_t largest_ = ~std::uint64_t{0};
  Numbers top_{};  // for each corner: the largest vertex number among the cells in which this
                   // corner was mispredicted
  std::array<std::array<Source, 2>, 8>
      sources_{};  // decoder: for each corner, two sources; the source that was right most recently
                   // comes first
  std::uint8_t next_ = 0;    // corners of the current hexahedron, see Past::next
  std::uint8_t strays_ = 0;  // corners of the current hexahedron, see Past::strays
  std::uint64_t beside_now_ = 1;
  bool follows_strays_ = false;
  std::uint32_t repeated_strays_ =
      0;  // encoder: number of cells so far that had a stray (mispredicted corner) at the same
          // corner as their model cell

  // last_stray_: vertex number of the most recent stray (mispredicted corner). stray_step_: this
  // number minus the number of the stray before it. followers_: for each step and corner, the step
  // that came next.
  std::uint64_t last_stray_ = 0, stray_step_ = 0;
  std::vector<std::uint64_t> followers_;  // empty until kFollowStrays has been coded

  // Contexts of the next decisions
  std::uint32_t hits_ = 0;
  std::uint32_t last_place_ = 0, last_kind_ = 0;

  // Adaptive models of the decisions
  std::array<std::array<AdaptiveBit, 8>, 2> hit_;
  std::array<TreeModel<3>, kDistances + 1> place_;
  SignedModel<NumberModel> distance_;
  AdaptiveBit old_shift_;
  std::array<TreeModel<3>, kDistances + 1> beside_;
  std::array<AdaptiveBit, kDistances + 1> as_guessed_;
  // Models of the decision whether a corner is as guessed. The first index is 1 if the corner is in
  // likely_strays()
  std::array<std::array<std::array<AdaptiveBit, 3>, 8>, 2> same_;
  std::array<std::array<TreeModel<3>, 8>, 8> kind_;
  std::array<TreeModel<3>, 8> previous_, earlier_;
  std::array<NumberModel, 8> age_;
  std::array<SignedModel<NumberModel>, 3> step_;
  AdaptiveBit marks_as_guessed_;
  std::array<std::array<AdaptiveBit, 2>, 8> mark_;
};

extern template class ReplayHexahedra<RangeEncoder>;
extern template class ReplayHexahedra<RangeDecoder>;

}  // namespace shm
