// CopiedElements: which elements of a tile are as an earlier one, in all components, and how far
// back that stands. In meshes whose cells share no vertices most vertices are such: where one stood
// already the corner of a cell before, and at the same corner of the next cell the next one.
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
  /// Frozen, part of the format.
  static constexpr std::uint32_t kFarthest = std::uint32_t{1} << 16;

  /// Of each element of a tile, of such classes, how far back its copy stands; 0: it is none.
  /// False for damage.
  bool code(Coder& coder, std::span<const std::uint16_t> classes, std::span<std::uint32_t> back) {
    for (std::size_t i = 0; i < classes.size(); ++i)
      if (!code_one(coder, classes[i], back[i])) return false;
    return true;
  }

 private:
  /// No copy; as far back as the last one of the class, or the one before; farther or nearer.
  enum Outcome : std::uint8_t { kOwn, kAgain, kBefore, kOther };
  struct Class {
    std::uint32_t last = 0, before_last = 0;  // how far back; of two different ones, 0: none
    Outcome outcome = kOwn;
  };
  struct Models {
    AdaptiveBit again, copied, before;
  };

  bool code_one(Coder& coder, std::uint16_t of_class, std::uint32_t& back) {
    if (of_class >= classes_.size()) classes_.resize(of_class + std::size_t{1});
    Class& it = classes_[of_class];
    Models& models = models_[it.outcome][outcome_];
    const std::uint32_t wanted = back;
    Outcome outcome = kOwn;
    back = 0;
    if (it.last > 0 && coder.bit(models.again, wanted == it.last)) {
      outcome = kAgain;
      back = it.last;
    } else if (coder.bit(models.copied, wanted > 0)) {
      if (it.before_last > 0 && coder.bit(models.before, wanted == it.before_last)) {
        outcome = kBefore;
        back = it.before_last;
      } else {
        outcome = kOther;
        back = code_other(coder, wanted);
      }
      it.before_last = it.last;
      it.last = back;
    }
    it.outcome = outcome_ = outcome;
    if (outcome != kOwn) {
      if (back == 0 || back > kFarthest || back > here_) return false;
      following_ = here_ - back + 1;
    }
    ++here_;
    return true;
  }
  /// From the element that follows the last one that was copied. 0 for damage.
  std::uint32_t code_other(Coder& coder, std::uint32_t wanted) {
    const auto by =
        code_signed(coder, other_, static_cast<std::int64_t>(here_ - wanted - following_));
    const std::uint64_t back = here_ - following_ - static_cast<std::uint64_t>(by);
    return back <= kFarthest ? static_cast<std::uint32_t>(back) : 0;
  }

  std::vector<Class> classes_;
  std::array<std::array<Models, 4>, 4> models_;  // by the outcome in the class, and at the last one
  SignedModel<CompactNumberModel> other_;
  Outcome outcome_ = kOwn;
  std::uint64_t here_ = 0, following_ = 0;  // elements so far; the one after the last source
};

}  // namespace shm
