#include "compare/values.h"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <limits>
#include <utility>

namespace shm::converters {

void ValueScan::note(const PlaceOf& place, std::uint64_t element, std::uint32_t component,
                     double distance, std::string value_a, std::string value_b) {
  const bool is_largest = !largest_ || distance > finding_->largest;
  const bool is_listed = finding_->different < limit_;
  ++finding_->different;
  if (!is_largest && !is_listed) return;
  DiffPlace found = place(element);
  if (components_ > 1) found.component = component;
  found.value_a = std::move(value_a);
  found.value_b = std::move(value_b);
  if (strings_ == nullptr) found.distance = distance;
  if (is_listed) finding_->places.push_back(found);
  if (is_largest) {
    finding_->largest = distance;
    largest_rank_ = finding_->different - 1;
    largest_ = std::move(found);
  }
}

void ValueScan::compare(const std::byte* a, const std::byte* b, std::uint64_t count,
                        const PlaceOf& place) {
  const std::size_t bytes_a = scalar_bytes(type_a_), bytes_b = scalar_bytes(type_b_);
  finding_->compared += count * components_;
  if (count == 0) return;
  if (type_a_ == type_b_ && std::memcmp(a, b, count * components_ * bytes_a) == 0) return;
  for (std::uint64_t i = 0; i < count; ++i)
    for (std::uint32_t c = 0; c < components_; ++c, a += bytes_a, b += bytes_b) {
      const auto distance = distance_of_unlike(a, type_a_, b, type_b_, likeness_);
      if (distance && strings_ != nullptr)
        note(place, i, c, 0, strings_->text(load<std::uint32_t>(a)),
             strings_->text(load<std::uint32_t>(b)));
      else if (distance)
        note(place, i, c, *distance, value_text(a, type_a_), value_text(b, type_b_));
    }
}

void ValueScan::compare_with_none(const std::byte* values, bool of_a, std::uint64_t count,
                                  const PlaceOf& place) {
  const ScalarType type = of_a ? type_a_ : type_b_;
  const std::size_t bytes = scalar_bytes(type);
  finding_->compared += count * components_;
  for (std::uint64_t i = 0; i < count; ++i)
    for (std::uint32_t c = 0; c < components_; ++c, values += bytes) {
      const double value = as_double(values, type);
      if (std::isnan(value) || value == 0) continue;
      const std::string text = value_text(values, type);
      note(place, i, c, std::numeric_limits<double>::infinity(), of_a ? text : "no value",
           of_a ? "no value" : text);
    }
}

void ValueScan::finish() {
  if (!largest_) return;
  auto& places = finding_->places;
  if (largest_rank_ < places.size())
    std::rotate(places.begin(), places.begin() + static_cast<std::ptrdiff_t>(largest_rank_),
                places.begin() + static_cast<std::ptrdiff_t>(largest_rank_) + 1);
  else
    places.insert(places.begin(), std::move(*largest_));
  if (places.size() > std::max<std::uint64_t>(limit_, 1)) places.pop_back();
}

ValueRange::ValueRange(std::uint32_t components)
    : minimum_(components, std::numeric_limits<double>::max()),
      maximum_(components, std::numeric_limits<double>::lowest()) {}

void ValueRange::add(const std::byte* values, std::uint64_t count, ScalarType type) {
  const std::size_t bytes = scalar_bytes(type);
  for (std::uint64_t i = 0; i < count; ++i)
    for (std::size_t c = 0; c < minimum_.size(); ++c, values += bytes) {
      const double value = as_double(values, type);
      if (!std::isfinite(value)) continue;
      minimum_[c] = std::min(minimum_[c], value);
      maximum_[c] = std::max(maximum_[c], value);
    }
}

double ValueRange::overall() const {
  const double range = *std::max_element(maximum_.begin(), maximum_.end()) -
                       *std::min_element(minimum_.begin(), minimum_.end());
  return std::max(range, 0.0);
}

double ValueRange::largest_side() const {
  double side = 0;
  for (std::size_t c = 0; c < minimum_.size(); ++c)
    side = std::max(side, maximum_[c] - minimum_[c]);
  return side;
}

}  // namespace shm::converters
