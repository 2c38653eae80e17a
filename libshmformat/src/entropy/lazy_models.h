// Models that come into being when they are first asked for: a file takes memory for what it says.
// They can be copied.
#pragma once

#include <cstdint>
#include <vector>

namespace shm {

template <class Model>
class LazyModel {
 public:
  Model& get() {
    if (held_.empty()) held_.emplace_back();
    return held_.front();
  }

 private:
  std::vector<Model> held_;  // one, or none yet
};

/// One for each context, of 65535 at most.
template <class Model>
class LazyModels {
 public:
  Model& of(std::uint32_t context) {
    if (context >= numbers_.size()) numbers_.resize(context + 1);
    std::uint16_t& number = numbers_[context];
    if (number == 0) {
      held_.emplace_back();
      number = static_cast<std::uint16_t>(held_.size());
    }
    return held_[number - 1u];
  }

 private:
  std::vector<std::uint16_t> numbers_;  // by context, from 1; 0: not yet
  std::vector<Model> held_;
};

}  // namespace shm
