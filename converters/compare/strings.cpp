#include "compare/strings.h"

#include <cstring>
#include <unordered_map>
#include <utility>

#include "formats/formats.h"
#include "interface/format.h"

namespace shm::converters {

CommonStrings::CommonStrings(const MeshInfo& a, std::size_t array_a, const MeshInfo& b,
                             std::size_t array_b) {
  std::unordered_map<std::string, std::uint32_t> places;
  const auto add = [&](std::vector<std::string> list, std::vector<std::uint32_t>& from) {
    for (std::string& each : list) {
      const auto next = static_cast<std::uint32_t>(strings_.size());
      const auto [entry, fresh] = places.try_emplace(each, next);
      if (fresh) strings_.push_back(std::move(each));
      from.push_back(entry->second);
    }
  };
  add(source_format(a).strings(a, array_a), from_a_);
  add(source_format(b).strings(b, array_b), from_b_);
}

// An index past the end of a list is converted to an index that does not belong to any string.
void CommonStrings::translate(bool of_a, std::byte* places, std::uint64_t count) const {
  const auto& from = of_a ? from_a_ : from_b_;
  const auto known = static_cast<std::uint32_t>(strings_.size());
  for (std::uint64_t i = 0; i < count; ++i) {
    std::uint32_t place = 0;
    std::memcpy(&place, places + i * sizeof place, sizeof place);
    place = place < from.size() ? from[place] : known;
    std::memcpy(places + i * sizeof place, &place, sizeof place);
  }
}

std::string CommonStrings::text(std::uint32_t place) const {
  constexpr std::size_t kLongest = 60;
  if (place >= strings_.size()) return "no string";
  const std::string& string = strings_[place];
  return "'" + string.substr(0, kLongest) + (string.size() > kLongest ? "...'" : "'");
}

}  // namespace shm::converters
