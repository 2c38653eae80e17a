#include "vtk/between/family_source.h"

#include <cmath>
#include <cstring>
#include <string_view>

#include "base/stored_value.h"
#include "base/text_input.h"
#include "mesh/extra_index.h"
#include "mesh/mesh_source.h"
#include "vtk/between/family.h"
#include "vtk/between/field_data.h"
#include "vtk/between/xml_contents.h"
#include "vtk/strings.h"
#include "vtk/words.h"

namespace shm::converters::vtk {
namespace {

bool is_numbered_anew(const MeshInfo& info) {
  if (!has_renumbered_cells(info)) return false;
  const ExtraIndex extras(info.extras);
  if (extras.find(kNewNumbering) != nullptr) return true;
  if (const Extra* text = extras.find("vtk/skeleton")) {
    const auto skeleton = parse_skeleton(text_of_extra(*text));
    return skeleton && skeleton->version >= "5.1";
  }
  auto contents = vtu::Contents::of(info);
  return contents && contents->version() >= "2.1";
}

// Returns the field data that contains the time of the file as a single number. Returns null if
// no such field data exists.
const Extra* time_of(const MeshInfo& info) {
  const std::vector<FieldArray> arrays = field_arrays(info);
  for (const std::string_view name : {kLegacyTime, kXmlTime})
    for (const FieldArray& array : arrays)
      if (array.name == name && array.form == ValueForm::number &&
          array.values->data.size() == scalar_bytes(array.values->type))
        return array.values;
  return nullptr;
}

bool is_skeleton(std::string_view key) { return key == "vtk/skeleton" || key == "vtu/skeleton"; }

std::vector<std::byte> stored_time(double time, ScalarType type) {
  // Limit for the absolute value of times that are stored in an integer type. A time that reaches
  // this limit is replaced with 0.
  constexpr double kMostWhole = 0x1p31;
  return with_scalar(type, [&](auto zero) {
    std::vector<std::byte> stored(sizeof zero);
    if (is_float(type))
      zero = static_cast<decltype(zero)>(time);
    else if (std::fabs(time) < kMostWhole)
      zero = static_cast<decltype(zero)>(static_cast<std::int64_t>(time));
    std::memcpy(stored.data(), &zero, sizeof zero);
    return stored;
  });
}

}  // namespace

std::optional<double> FamilySource::time(const MeshInfo& info, Keys& used) const {
  const Extra* values = time_of(info);
  if (values == nullptr) return std::nullopt;
  used.insert(values->key);
  return as_double(values->data.data(), values->type);
}

std::optional<std::vector<Extra>> FamilySource::extras_of_steps(const MeshInfo& info,
                                                                StepRange steps) const {
  if (describes_steps(info)) return std::nullopt;
  const Extra* time = steps.size() == 1 ? time_of(info) : nullptr;
  std::vector<Extra> extras = info.extras;
  for (Extra& extra : extras)
    if (time != nullptr && extra.key == time->key)
      extra.data = stored_time(info.step_times[steps.first], extra.type);
  return extras;
}

std::vector<Extra> FamilySource::extras_of_series(const MeshInfo& info) const {
  const Extra* time = time_of(info);
  std::vector<Extra> extras;
  for (const Extra& extra : info.extras) {
    if (is_skeleton(extra.key))
      extras.push_back(text_extra(extra.key, skeleton_without_ranges(info)));
    else
      extras.push_back(extra);
    if (&extra == time) extras.back().data.assign(extra.data.size(), std::byte{});
  }
  return extras;
}

bool FamilySource::is_about_file(std::string_view key) const {
  return is_skeleton(key) || key.starts_with("vtk/data/") || key.starts_with("vtu/data/");
}

std::optional<AppendedExtras> FamilySource::joined_extras(const MeshInfo& old, const MeshInfo&,
                                                          const std::vector<Extra>& extras,
                                                          std::span<const std::uint64_t>) const {
  if (describes_steps(old)) return std::nullopt;
  const ExtraIndex kept(old.extras);
  AppendedExtras joined;
  for (const Extra& extra : extras) {
    const Extra* found = kept.find(extra.key);
    if (found != nullptr && *found == extra) continue;
    if (!is_about_file(extra.key)) return std::nullopt;
    joined.losses.push_back("another '" + extra.key + "'");
  }
  return joined;
}

std::map<std::int64_t, std::string> FamilySource::block_names(const MeshInfo& info,
                                                              Keys& used) const {
  std::map<std::int64_t, std::string> names;
  for (const FieldArray& array : field_arrays(info)) {
    if (array.name != kBlockNames) continue;
    for (const std::string& line : strings_of(array)) {
      const std::size_t blank = line.find(' ');
      std::int64_t id = 0;
      if (blank != std::string::npos &&
          TextInput::parse(std::string_view(line).substr(0, blank), id))
        names.emplace(id, line.substr(blank + 1));
    }
    if (!names.empty()) used.insert(array.values->key);
    break;
  }
  return names;
}

bool FamilySource::has_strings(const ArrayInfo& array) const {
  return array.role == kStringRole && array.type == ScalarType::uint32;
}

std::vector<std::string> FamilySource::strings(const MeshInfo& info, std::size_t array) const {
  return strings_of_array(info, array);
}

bool FamilySource::is_list_of_strings(std::string_view key) const {
  return key.starts_with(kStringLists);
}

void FamilySource::mark_piece(const MeshInfo& whole, MeshInfo& piece) const {
  if (is_numbered_anew(whole) && find_extra(piece, kNewNumbering) == nullptr)
    piece.extras.push_back({kNewNumbering, ScalarType::uint8, Reference::nothing, {0}, {}});
}

}  // namespace shm::converters::vtk
