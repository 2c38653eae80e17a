// NumberColumn: codes the stream numbers of imported vertices. A number is predicted from the
// imported neighbours in the cell, by the rules that predict coordinates (codecs/shared/stencil.h).
// spec: "Imports"
#pragma once

#include <cstdint>
#include <vector>

#include "codecs/shared/stencil.h"
#include "entropy/models.h"

namespace shm {

template <class Coder>
class NumberColumn {
 public:
  /// Codes the number of the vertex at `slot`. Encoding: `number` is this number. Decoding:
  /// `number` is ignored. Returns the number in both cases.
  std::uint64_t code(Coder& coder, const Stencil& stencil, std::uint32_t slot,
                     std::uint64_t number) {
    if (slot >= numbers_.size()) numbers_.resize(std::size_t{slot} * 2 + 1);
    const std::uint64_t expected =
        stencil.kind == Stencil::last ? last_ : spectral(stencil, numbers_);
    last_ =
        expected + static_cast<std::uint64_t>(code_signed(
                       coder, models_[stencil.kind], static_cast<std::int64_t>(number - expected)));
    return numbers_[slot] = last_;
  }

 private:
  std::vector<std::uint64_t> numbers_;  // numbers by vertex slot
  std::uint64_t last_ = 0;
  std::array<SignedModel<NumberModel>, 5> models_;
};

}  // namespace shm
