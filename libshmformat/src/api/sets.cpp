#include "shm/sets.h"

#include <algorithm>
#include <array>
#include <charconv>
#include <cstring>
#include <limits>
#include <map>
#include <optional>
#include <string_view>
#include <utility>

#include "base/errors.h"
#include "shm/mesh.h"

namespace shm {
namespace {

using Kind = MeshSet::Kind;

// Maximum size in bytes of the values in one extra. A longer list is split and stored in several
// extras, because all values of an extra must be in memory at the same time.
constexpr std::size_t kPartBytes = std::size_t{16} << 20;

constexpr std::array<std::string_view, 3> kFolders{"mesh/node_set/", "mesh/side_set/",
                                                   "mesh/element_set/"};
constexpr std::string_view kId = "id", kName = "name", kMembers = "members", kSides = "sides",
                           kBlocks = "blocks", kFactors = "factors";
constexpr std::array kFields{kId, kName, kMembers, kSides, kBlocks, kFactors};

// Parses a number. Rejects signs and leading zeros, so that no two spellings can refer to the same
// set.
std::optional<std::uint64_t> number_of(std::string_view text) {
  std::uint64_t number = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), number);
  if (error != std::errc() || end != text.data() + text.size()) return std::nullopt;
  if (text.size() > 1 && text.front() == '0') return std::nullopt;
  return number;
}

// Parts of a key such as "mesh/side_set/3/members/1".
struct Key {
  Kind kind = Kind::nodes;
  std::uint64_t number = 0;
  std::string_view field;
  std::uint64_t part = 0;  // number of this part, if the list is stored in several extras
};

std::optional<Key> parse(std::string_view key) {
  const auto folder = std::find_if(kFolders.begin(), kFolders.end(),
                                   [&](std::string_view each) { return key.starts_with(each); });
  if (folder == kFolders.end()) return std::nullopt;
  Key parsed;
  parsed.kind = static_cast<Kind>(folder - kFolders.begin());
  key.remove_prefix(folder->size());
  const std::size_t slash = key.find('/');
  if (slash == key.npos) return std::nullopt;
  const auto number = number_of(key.substr(0, slash));
  if (!number) return std::nullopt;
  parsed.number = *number;
  key.remove_prefix(slash + 1);
  const std::size_t end = key.find('/');
  parsed.field = key.substr(0, end);
  if (std::find(kFields.begin(), kFields.end(), parsed.field) == kFields.end()) return std::nullopt;
  if (end == key.npos) return parsed;
  const auto part = number_of(key.substr(end + 1));
  if (!part || *part == 0) return std::nullopt;
  parsed.part = *part;
  return parsed;
}

// Extras of one set, sorted by field. If parts of a list are missing, only the parts before the
// first missing part are used.
class Folder {
 public:
  Folder(std::span<const Extra> extras, const SetPlace& place) : place_(place) {
    for (const std::size_t i : place.extras)
      if (i < extras.size())
        if (const auto key = parse(extras[i].key))
          if (key->kind == place.kind && key->number == place.number)
            by_field_[key->field].try_emplace(key->part, &extras[i]);
  }

  std::vector<const Extra*> parts(std::string_view field) const {
    std::vector<const Extra*> list;
    const auto found = by_field_.find(field);
    if (found == by_field_.end()) return list;
    for (const auto& [part, extra] : found->second) {
      if (part != list.size()) break;
      list.push_back(extra);
    }
    return list;
  }
  bool has(std::string_view field) const { return !parts(field).empty(); }
  // Returns true if no part of the field is missing.
  bool whole(std::string_view field) const {
    const auto found = by_field_.find(field);
    return found == by_field_.end() || parts(field).size() == found->second.size();
  }
  Error error(std::string_view field, std::string detail) const {
    return corrupt(std::string(field) + ": " + std::move(detail),
                   set_folder(place_.kind, place_.number));
  }

 private:
  const SetPlace& place_;
  std::map<std::string_view, std::map<std::uint64_t, const Extra*>> by_field_;
};

template <class T>
T value_at(const Extra& extra, std::size_t index) {
  T value;
  std::memcpy(&value, extra.data.data() + index * sizeof value, sizeof value);
  return value;
}

// Returns the integers of a field. Integers must have 32 or 64 bits and be at least `least`.
// Non-negative integers must be less than `end`. Extra::refers must be `refers`. Error messages
// contain the name of the field.
template <class T>
Result<std::vector<T>> integers(const Folder& folder, std::string_view field, Reference refers,
                                std::int64_t least, std::uint64_t end) {
  if (!folder.whole(field)) return folder.error(field, "a part of the list is missing");
  std::vector<T> values;
  for (const Extra* part : folder.parts(field)) {
    const bool narrow = part->type == ScalarType::int32;
    const std::size_t width = narrow ? 4 : 8;
    if ((!narrow && part->type != ScalarType::int64) || part->refers != refers ||
        part->data.size() % width != 0)
      return folder.error(field, "its values are of a wrong type");
    const std::size_t count = part->data.size() / width;
    values.reserve(values.size() + count);
    for (std::size_t i = 0; i < count; ++i) {
      const std::int64_t value =
          narrow ? value_at<std::int32_t>(*part, i) : value_at<std::int64_t>(*part, i);
      if (value < least || (value >= 0 && static_cast<std::uint64_t>(value) >= end))
        return folder.error(field, "out of range: " + std::to_string(value));
      values.push_back(static_cast<T>(value));
    }
  }
  return values;
}

Result<std::vector<double>> factors(const Folder& folder) {
  if (!folder.whole(kFactors)) return folder.error(kFactors, "a part of the list is missing");
  std::vector<double> values;
  bool any_other = false;  // true if at least one factor is not 1
  for (const Extra* part : folder.parts(kFactors)) {
    const bool narrow = part->type == ScalarType::float32;
    const std::size_t width = narrow ? 4 : 8;
    if ((!narrow && part->type != ScalarType::float64) || part->data.size() % width != 0)
      return folder.error(kFactors, "its values are of a wrong type");
    for (std::size_t i = 0; i < part->data.size() / width; ++i) {
      values.push_back(narrow ? double{value_at<float>(*part, i)} : value_at<double>(*part, i));
      any_other |= !(values.back() == 1);
    }
  }
  if (!any_other) values.clear();
  return values;
}

// If the lists of a set contradict each other or its kind, returns an error message. Otherwise
// returns an empty string.
std::string contradiction(const MeshSet& set) {
  const std::size_t members = set.members.size();
  if (set.kind == Kind::sides ? set.sides.size() != members : !set.sides.empty())
    return "has " + std::to_string(members) + " members, but " + std::to_string(set.sides.size()) +
           " sides";
  if (set.kind != Kind::elements && !set.blocks.empty())
    return "has blocks, but is not an element set";
  return {};
}

template <class T>
Extra extra_of(std::string key, ScalarType type, Reference refers, std::span<const T> values) {
  const auto bytes = std::as_bytes(values);
  Extra extra{std::move(key), type, refers, {values.size()}, {}};
  extra.data.assign(bytes.begin(), bytes.end());
  return extra;
}

template <class Stored, class T>
void put_parts(std::vector<Extra>& out, const std::string& key, ScalarType type, Reference refers,
               std::span<const T> values) {
  constexpr std::size_t kMost = kPartBytes / sizeof(Stored);
  for (std::size_t first = 0; first < values.size(); first += kMost) {
    const auto some = values.subspan(first, std::min(kMost, values.size() - first));
    std::vector<Stored> stored;
    stored.reserve(some.size());
    for (const T value : some) stored.push_back(static_cast<Stored>(value));
    out.push_back(extra_of(first == 0 ? key : key + '/' + std::to_string(first / kMost), type,
                           refers, std::span<const Stored>(stored)));
  }
}

template <class T>
void put_integers(std::vector<Extra>& out, const std::string& key, Reference refers,
                  const std::vector<T>& values) {
  const bool narrow = std::all_of(values.begin(), values.end(),
                                  [](T value) { return std::in_range<std::int32_t>(value); });
  if (narrow)
    put_parts<std::int32_t>(out, key, ScalarType::int32, refers, std::span(values));
  else
    put_parts<std::int64_t>(out, key, ScalarType::int64, refers, std::span(values));
}

// Returns true if conversion to float does not change the value. Returns false for NaN, so that the
// bits of the NaN are preserved.
bool is_float_value(double value) {
  if (!(value >= -double{std::numeric_limits<float>::max()} &&
        value <= double{std::numeric_limits<float>::max()}))
    return false;
  return double{static_cast<float>(value)} == value;
}

Reference reference_of(Kind kind) {
  return kind == Kind::nodes ? Reference::vertex : Reference::cell;
}

}  // namespace

std::string set_folder(MeshSet::Kind kind, std::uint64_t number) {
  return std::string(kFolders[static_cast<std::size_t>(kind)]) + std::to_string(number) + '/';
}

std::vector<SetPlace> find_sets(std::span<const Extra> extras) {
  std::vector<SetPlace> places;
  std::map<std::pair<Kind, std::uint64_t>, std::size_t> known;
  std::map<std::string_view, std::size_t> keys;
  for (std::size_t i = 0; i < extras.size(); ++i) {
    const auto key = parse(extras[i].key);
    if (!key || !keys.emplace(extras[i].key, i).second) continue;
    const auto [place, fresh] = known.try_emplace({key->kind, key->number}, places.size());
    if (fresh) places.push_back({key->kind, key->number, {}});
    places[place->second].extras.push_back(i);
  }
  return places;
}

Result<MeshSet> read_set(std::span<const Extra> extras, const SetPlace& place,
                         const SetBounds& bounds) {
  const Folder folder(extras, place);
  MeshSet set;
  set.kind = place.kind;
  constexpr std::int64_t kLeastId = std::numeric_limits<std::int64_t>::min();
  const auto ids = integers<std::int64_t>(folder, kId, Reference::nothing, kLeastId,
                                          std::numeric_limits<std::uint64_t>::max());
  if (!ids) return ids.error();
  if (ids->size() > 1 || (ids->empty() && folder.has(kId)) ||
      (ids->empty() && !std::in_range<std::int64_t>(place.number)))
    return folder.error(kId, "does not contain exactly one number");
  set.id = ids->empty() ? static_cast<std::int64_t>(place.number) + 1 : ids->front();
  if (const auto name = folder.parts(kName); !name.empty()) {
    if (name[0]->type != ScalarType::uint8) return folder.error(kName, "is not text");
    for (const std::byte byte : name[0]->data) set.name += static_cast<char>(byte);
  }
  auto members =
      integers<std::uint64_t>(folder, kMembers, reference_of(place.kind), 0,
                              place.kind == Kind::nodes ? bounds.vertices : bounds.cells);
  if (!members) return members.error();
  set.members = std::move(*members);
  auto sides =
      integers<std::int32_t>(folder, kSides, Reference::nothing, 1, std::uint64_t{1} << 31);
  if (!sides) return sides.error();
  set.sides = std::move(*sides);
  constexpr std::uint64_t kMostBlocks = std::uint64_t{1} << 32;
  auto blocks = integers<std::uint32_t>(folder, kBlocks, Reference::nothing, 0,
                                        std::min(bounds.blocks, kMostBlocks));
  if (!blocks) return blocks.error();
  set.blocks = std::move(*blocks);
  auto weights = factors(folder);
  if (!weights) return weights.error();
  set.factors = std::move(*weights);
  if (std::string why = contradiction(set); !why.empty())
    return corrupt(std::move(why), set_folder(place.kind, place.number));
  return set;
}

Result<std::vector<MeshSet>> sets_of_extras(std::span<const Extra> extras,
                                            const SetBounds& bounds) {
  std::vector<MeshSet> sets;
  for (const SetPlace& place : find_sets(extras)) {
    auto set = read_set(extras, place, bounds);
    if (!set) return set.error();
    sets.push_back(std::move(*set));
  }
  return sets;
}

Result<std::vector<MeshSet>> sets_of(const Mesh& mesh) {
  return sets_of_extras(
      mesh.extras, SetBounds{mesh.vertex_count(), mesh.cell_count(), mesh.schema.blocks.size()});
}

[[gnu::cold]] Result<std::vector<Extra>> extras_of_sets(std::span<const MeshSet> sets) {
  std::vector<Extra> extras;
  std::array<std::uint64_t, kFolders.size()> counts{};
  for (const MeshSet& set : sets) {
    const auto kind = static_cast<std::size_t>(set.kind);
    if (kind >= counts.size()) return misuse("unknown kind of set", "sets");
    const std::uint64_t number = counts[kind]++;
    const std::string folder = set_folder(set.kind, number);
    std::string wrong = contradiction(set);
    if (std::any_of(set.members.begin(), set.members.end(),
                    [](std::uint64_t member) { return !std::in_range<std::int64_t>(member); }))
      wrong = "has a member number of more than 63 bits";
    if (std::any_of(set.sides.begin(), set.sides.end(), [](std::int32_t side) { return side < 1; }))
      wrong = "has a side below 1";
    if (!wrong.empty()) return misuse(std::move(wrong), folder);
    const bool shown = !set.members.empty() || !set.blocks.empty();
    if (!shown || set.id != static_cast<std::int64_t>(number) + 1)
      put_integers(extras, folder + "id", Reference::nothing, std::vector{set.id});
    if (!set.name.empty())
      extras.push_back(extra_of(folder + "name", ScalarType::uint8, Reference::nothing,
                                std::span<const char>(set.name)));
    put_integers(extras, folder + "members", reference_of(set.kind), set.members);
    put_integers(extras, folder + "sides", Reference::nothing, set.sides);
    put_integers(extras, folder + "blocks", Reference::nothing, set.blocks);
    const std::span factors(set.factors);
    const auto is_one = [](double factor) { return factor == 1; };
    if (std::all_of(factors.begin(), factors.end(), is_one)) continue;
    if (std::all_of(factors.begin(), factors.end(), is_float_value))
      put_parts<float>(extras, folder + "factors", ScalarType::float32, Reference::nothing,
                       factors);
    else
      put_parts<double>(extras, folder + "factors", ScalarType::float64, Reference::nothing,
                        factors);
  }
  return extras;
}

}  // namespace shm
