#include "tool/step_choice.h"

#include <algorithm>
#include <cmath>
#include <string_view>

#include "base/failure.h"
#include "base/stored_value.h"
#include "base/text_input.h"

namespace shm::converters {
namespace {

[[noreturn]] void refuse(const std::string& words, std::uint64_t steps, const std::string& where) {
  const std::string message = "there is no step " + words + ": " + where + " has ";
  if (steps == 0) wrong_use(message + "no time steps");
  wrong_use(message + std::to_string(steps) + ", counted from 0 (0:" + std::to_string(steps) + ")");
}

StepRange step_at(double time, const std::vector<double>& times) {
  constexpr double kOfItself = 1e-6, kOfAll = 1e-9;
  constexpr std::size_t kNearby = 4;
  if (times.empty()) wrong_use("--time " + number_text(time) + ": the mesh has no time steps");
  std::size_t nearest = 0;
  for (std::size_t s = 1; s < times.size(); ++s)
    if (!(std::fabs(times[s] - time) >= std::fabs(times[nearest] - time))) nearest = s;
  const double tolerance =
      kOfItself * std::fabs(time) + kOfAll * std::fabs(times.back() - times.front());
  if (std::fabs(times[nearest] - time) <= tolerance) return {nearest, nearest + 1};
  const std::size_t first = nearest - std::min(nearest, kNearby / 2);
  const std::size_t end = std::min(first + kNearby + 1, times.size());
  std::string near;
  for (std::size_t s = first; s < end; ++s)
    near +=
        (near.empty() ? "" : ", ") + number_text(times[s]) + " (step " + std::to_string(s) + ")";
  wrong_use("there is no step at time " + number_text(time) + "; times nearby are " + near);
}

}  // namespace

StepRange steps_named(const std::string& words, std::uint64_t steps, const std::string& where) {
  if (words == "first" || words == "last") {
    if (steps == 0) refuse(words, steps, where);
    return words == "first" ? StepRange{0, 1} : StepRange{steps - 1, steps};
  }
  const std::size_t colon = words.find(':');
  const bool several = colon != std::string::npos;
  StepRange range;
  if (!TextInput::parse(std::string_view(words).substr(0, colon), range.first) ||
      (several && !TextInput::parse(std::string_view(words).substr(colon + 1), range.end)))
    wrong_use("--step " + words +
              ": must be N, first, last or A:B (the steps A to B - 1), counted from 0");
  if (several && range.first >= range.end)
    wrong_use("--step " + words + ": the range is empty; " + where +
              " has steps 0:" + std::to_string(steps));
  const std::uint64_t last = several ? range.end - 1 : range.first;
  if (last >= steps) refuse(words, steps, where);
  range.end = last + 1;
  return range;
}

std::optional<StepRange> StepChoice::in(const std::vector<double>& times) const {
  if (time) return step_at(*time, times);
  if (words.empty()) return std::nullopt;
  return steps_named(words, times.size(), "the mesh");
}

}  // namespace shm::converters
