// CopiedElements: codes which elements of a tile are copies. A copy equals an earlier element (its
// source) in all components. The distance from the source to the copy, in elements, is coded, too.
// If the cells of a mesh share no vertices, most vertices are copies: the same coordinates occurred
// at a corner of an earlier cell. The source of the next copy at the same corner is usually the
// element after the previous source.
// spec: "Copied elements"
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "entropy/models.h"

namespace shm {

template <class Coder>
class CopiedElements {
 public:
  /// Largest distance between a copy and its source, in elements. Frozen: part of the format.
  static constexpr std::uint32_t kFarthest = std::uint32_t{1} << 16;

  /// Codes, for each element of a tile, the distance to its source; 0 means that the element is not
  /// a copy. `classes`: the class of each element. Returns false if the data is damaged.
  bool code(Coder& coder, std::span<const std::uint16_t> classes, std::span<std::uint32_t> back) {
    for (std::size_t i = 0; i < classes.size(); ++i)
      if (!code_one(coder, classes[i], back[i])) return false;
    return true;
  }

 private:
  /// Result for an element. kOwn: not a copy. kAgain: a copy at the same distance as the previous
  /// copy in the class. kBefore: a copy at the most recent other distance of the class. kOther: a
  /// copy at any other distance.
  enum Outcome : std::uint8_t { kOwn, kAgain, kBefore, kOther };
  struct Class {
    std::uint32_t last = 0, before_last = 0;  // the two most recent distinct distances; 0: none
    Outcome outcome = kOwn;
  };
  struct Models {
    AdaptiveBit again, copied, before;
  };

  bool code_one(Coder& coder, std::uint16_t of_class, std::uint32_t& back) {
    if (of_class >= classes_.size()) classes_.resize(of_class + std::size_t{1});
    Class& entry = classes_[of_class];
    Models& models = models_[entry.outcome][outcome_];
    const std::uint32_t wanted = back;
    Outcome outcome = kOwn;
    back = 0;
    if (entry.last > 0 && coder.bit(models.again, wanted == entry.last)) {
      outcome = kAgain;
      back = entry.last;
    } else if (coder.bit(models.copied, wanted > 0)) {
      if (entry.before_last > 0 && coder.bit(models.before, wanted == entry.before_last)) {
        outcome = kBefore;
        back = entry.before_last;
      } else {
        outcome = kOther;
        back = code_other(coder, wanted);
      }
      entry.before_last = entry.last;
      entry.last = back;
    }
    entry.outcome = outcome_ = outcome;
    if (outcome != kOwn) {
      if (back == 0 || back > kFarthest || back > here_) return false;
      following_ = here_ - back + 1;
    }
    ++here_;
    return true;
  }
  /// Codes the distance to the source. The predicted source is the element after the previous
  /// source. The difference between the actual distance and the distance to the predicted source is
  /// coded. Returns 0 if the data is damaged.
  std::uint32_t code_other(Coder& coder, std::uint32_t wanted) {
    const auto by =
        code_signed(coder, other_, static_cast<std::int64_t>(here_ - wanted - following_));
    const std::uint64_t back = here_ - following_ - static_cast<std::uint64_t>(by);
    return back <= kFarthest ? static_cast<std::uint32_t>(back) : 0;
  }

  std::vector<Class> classes_;
  // Models whose indices are the previous outcome in the class and the previous outcome in any
  // class
  std::array<std::array<Models, 4>, 4> models_;
  SignedModel<CompactNumberModel> other_;
  Outcome outcome_ = kOwn;
  // here_: number of elements so far; following_: number of the element after the previous source
  std::uint64_t here_ = 0, following_ = 0;
};

}  // namespace shm
