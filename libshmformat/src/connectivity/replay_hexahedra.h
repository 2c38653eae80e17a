// Replay hexahedra: each hexahedron repeats, in other numbers, one that came some cells earlier.
// in:    hexahedra in coding order            out: symbols for "connectivity"
// keeps: the last cells in a ring, the numbers of live vertices, the models; the same in
//        encoder and decoder
//
// Layouts that a program enumerated go on as they began: with a distance d, corner by corner,
//   number[i] = number[i - d] + (number[i - 1] - number[i - 1 - d])
// and the cell finalizes what cell i - d finalized. One decision codes that all of it is so. The
// numbers are the source's own (Order::keep) or stream numbers; a number that no live vertex has
// is a new vertex. So numbers, order and corner order come back at no cost, and no face is ever
// looked at. What is not so is coded corner by corner.
//
// Cells that a refinement made have corners of the refined cell among new ones: such a corner
// strays from what the model cell lets expect, and stands where it stood in the model cell. Where
// that is seen, strays are followed: which corners are likely to be some, and their numbers, each a
// step from the stray before, which repeats what came after an equal step before.
// spec: "Replay hexahedra"
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <utility>
#include <vector>

#include "entropy/models.h"
#include "surface/active_surface.h"
#include "surface/cell_topology.h"
#include "surface/number_map.h"

namespace shm {

/// Cells that are remembered: these at least, and these at most. Frozen: part of the format.
inline constexpr std::uint64_t kReplayLeast = std::uint64_t{1} << 14;
inline constexpr std::uint64_t kReplayWindow = std::uint64_t{1} << 18;

/// The last of a sequence, as many as a power of two, by how long ago they came.
template <class T>
class LastRing {
 public:
  /// How many there are.
  std::uint64_t kept() const { return kept_; }
  /// The one `distance` before the next. Any distance is safe once there is one; those from 1 to
  /// kept() have a meaning.
  const T& operator[](std::uint64_t distance) const { return ring_[place(sequence_ - distance)]; }
  /// The place of the next one. A full ring that is narrower than `least` becomes twice as wide;
  /// else the oldest one leaves.
  T& push(std::uint64_t least) {
    if (kept_ == ring_.size() && ring_.size() < std::max(least, kFirst))
      widen(std::max<std::size_t>(2 * ring_.size(), kFirst));
    T& it = ring_[place(sequence_++)];
    kept_ = std::min<std::uint64_t>(kept_ + 1, ring_.size());
    return it;
  }
  /// Becomes as wide as another, with as many that are nothing.
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
  /// `surface` is borrowed. `keep`: corners are coded by the source's numbers, in
  /// cell.original; else by stream numbers. `strays`: whether those may be followed.
  ReplayHexahedra(ActiveSurface& surface, bool keep, bool strays)
      : surface_(&surface), keep_(keep), may_follow_(strays) {}

  /// Codes corners as stored, and which of them are used last, of one hexahedron. False when
  /// decoding damaged data, or when two live vertices have the same number.
  bool code(Coder& symbols, Coder& corner_order, CellTopology& cell, bool order_matters);
  /// The number of a vertex that no hexahedron has as a corner so far.
  void set_number(std::uint32_t slot, std::uint64_t number);
  /// Before any vertex is finalized.
  void forget(std::uint32_t slot);

 private:
  using Numbers = std::array<std::uint64_t, 8>;
  using Slots = std::array<std::uint32_t, 8>;
  static constexpr std::size_t kMissSlots = 1024;
  static constexpr std::uint32_t kDistances = 6;     // as many as trees of 3 bits can choose from
  static constexpr std::uint32_t kFollowStrays = 7;  // in place of a place: once, from here on
  static constexpr int kFollowerBits = 12;           // frozen: part of the format
  enum Kind : std::uint8_t { kExpected, kBeyond, kTop, kPrevious, kEarlier, kFromPrevious, kStep };

  using Halves = std::array<std::uint32_t, 8>;
  struct Past {
    Halves number{};           // the lower half of each
    std::uint8_t next = 0;     // corners that introduced the number above the largest
    std::uint8_t marks = 0;    // corners that it used last, as coded
    std::uint8_t strays = 0;   // corners that were not as guessed; if none, its model cell's
    bool guessed = false;      // all of it was as expected
    std::uint32_t beside = 1;  // distance of the cell whose shift it had
  };
  struct Named {
    std::uint64_t number = 0;
    bool known = false;  // the number leads here
  };
  /// Where a corner's vertex was found before: a corner of the cell `distance` before.
  struct Source {
    std::uint32_t distance = 1;
    std::uint8_t corner = 0;
  };
  /// What a cell is expected to be.
  struct Guess {
    Numbers number{};
    std::uint8_t marks = 0;
  };
  /// Which guess to take.
  struct Choice {
    std::uint32_t place = 0;     // in distances_; kDistances: a new one
    std::uint64_t distance = 0;  // if new
    bool old_shift = false;      // the shift is over the distance used last
    std::uint32_t beside = 0;    // whose shift: 0 as the model's, 1 the last cell's,
                                 // 2.. that of the cell at distances_[beside - 2]
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
  void take(const CellTopology& cell, Numbers& number, std::uint8_t& marks) const;
  Choice choose(const CellTopology& cell, const Numbers& number, std::uint8_t marks) const;
  std::size_t step_key(const Numbers& number) const;
  bool code_miss(Coder& symbols, CellTopology& cell, Numbers& number, std::uint8_t& marks);
  bool code_choice_of_guess(Coder& symbols, Choice& choice);
  bool code_corners(Coder& symbols, const Guess& guess, Numbers& number);
  void code_marks(Coder& symbols, std::uint8_t expected, std::uint8_t& marks);
  bool resolve(CellTopology& cell, const Numbers& number);
  std::uint32_t look_up_hints(CellTopology& cell, const Numbers& number) const;
  bool resolve_corner(CellTopology& cell, const Numbers& number, std::uint32_t corner);
  std::uint32_t find(std::uint64_t number, std::uint32_t corner);
  std::uint32_t find_anywhere(std::uint64_t number) const;
  void finish(CellTopology& cell, const Numbers& number, std::uint8_t marks);
  /// Corners that are likely not to be as guessed, once the model cell is known.
  std::uint8_t likely_strays() const {
    return reaches(distances_[0]) ? past(distances_[0]).strays : std::uint8_t{0};
  }
  static std::size_t place_of_follower(std::uint64_t step, std::size_t corner);
  // While strays are followed.
  std::uint64_t next_stray(std::size_t corner) const {
    return last_stray_ + followers_[place_of_follower(stray_step_, corner)];
  }
  void follow_strays(const Numbers& number);
  Past& remember(const CellTopology& cell, const Numbers& number);

  ActiveSurface* surface_;
  bool keep_, may_follow_;

  LastRing<Past> pasts_;
  LastRing<Halves> upper_;      // of their numbers, from the first one on that has any
  LastRing<Slots> slots_;       // decoder: of fewer of them
  std::uint64_t sequence_ = 0;  // of the hexahedron at hand
  std::array<std::uint64_t, kDistances> distances_{1};  // the one used last first
  bool marks_shift_ = false;

  std::vector<Named> named_;               // by vertex slot
  std::vector<std::uint64_t> introduced_;  // encoder, by vertex slot: the hexahedron at hand then
  std::vector<std::uint64_t>
      misses_;           // encoder, by step_key: the last hexahedron that was not as expected
  bool clash_ = false;   // two live vertices had the same number
  NumberMap by_number_;  // Order::keep
  std::uint64_t largest_ = ~std::uint64_t{0};
  Numbers top_{};  // largest number of each corner, where it was not as expected
  std::array<std::array<Source, 2>, 8> sources_{};  // decoder: the one that was right last first
  std::uint8_t next_ = 0;                           // of the hexahedron at hand
  std::uint8_t strays_ = 0;                         // of the hexahedron at hand
  std::uint64_t beside_now_ = 1;
  bool follows_strays_ = false;
  std::uint32_t repeated_strays_ = 0;  // encoder: cells with strays where they were likely
  // The number of the last stray, its step from the one before it, and by a step and a corner which
  // step came next there.
  std::uint64_t last_stray_ = 0, stray_step_ = 0;
  std::vector<std::uint64_t> followers_;  // empty until strays are followed

  // contexts
  std::uint32_t hits_ = 0;
  std::uint32_t last_place_ = 0, last_kind_ = 0;

  // models
  std::array<std::array<AdaptiveBit, 8>, 2> hit_;
  std::array<TreeModel<3>, kDistances + 1> place_;
  SignedModel<NumberModel> distance_;
  AdaptiveBit old_shift_;
  std::array<TreeModel<3>, kDistances + 1> beside_;
  std::array<AdaptiveBit, kDistances + 1> as_guessed_;
  std::array<std::array<std::array<AdaptiveBit, 3>, 8>, 2> same_;  // by likely_strays() first
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
