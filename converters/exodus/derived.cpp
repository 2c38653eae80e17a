// Derives the values of variables that are determined by the rest of a mesh, so that these
// variables need not be stored. Also contains conversions between the integer types of variables
// and extras.
#include <netcdf.h>

#include <algorithm>
#include <cstring>
#include <type_traits>
#include <utility>

#include "base/stored_value.h"
#include "exodus/layout.h"

namespace shm::converters::exodus {
namespace {

// Appends `value` to `out`, converted to the type T. Returns false if T cannot represent the value.
template <class T, class From>
bool append_value(std::vector<std::byte>& out, From value) {
  if constexpr (std::is_integral_v<T> && std::is_integral_v<From>)
    if (!std::in_range<T>(value)) return false;
  const T stored = static_cast<T>(value);
  const auto* bytes = reinterpret_cast<const std::byte*>(&stored);
  out.insert(out.end(), bytes, bytes + sizeof stored);
  return true;
}
bool append_real(std::vector<std::byte>& out, int type, double value) {
  if (type == NC_FLOAT) return append_value<float>(out, value);
  return type == NC_DOUBLE && append_value<double>(out, value);
}

// Derives the values of one variable.
class Deriver {
 public:
  Deriver(const Skeleton& skeleton, const Layout& layout, const Variable& variable,
          const MeshInfo& info, const ExtraIndex& extras)
      : skeleton_(skeleton),
        layout_(layout),
        variable_(variable),
        info_(info),
        extras_(extras),
        shape_(skeleton.shape(variable)) {}

  std::optional<std::vector<std::byte>> derive() {
    const std::string& name = variable_.name;
    const auto& blocks = info_.schema.blocks;
    if (shape_.empty() || variable_.type == NC_STRING) return std::nullopt;
    bool ok = false;
    if (name == "eb_prop1" && is_list_of(blocks.size()))
      ok = integers([&](std::size_t i) { return std::optional(blocks[i].id); });
    else if (name == "eb_names" && is_table_of(blocks.size()))
      ok = names([&](std::size_t i) -> const std::string& { return blocks[i].name; });
    else if (name == "name_nod_var")
      ok = field_names(Location::point);
    else if (name == "name_glo_var")
      ok = field_names(Location::global);
    else if (const FieldKind* kind = kind_with(&FieldKind::names))
      ok = field_names(kind->location);
    else if (const FieldKind* kind_of_table = kind_with(&FieldKind::table))
      ok = truth_table(*kind_of_table);
    else if (name == "time_whole" && is_list_of(info_.step_times.size()))
      ok = std::all_of(info_.step_times.begin(), info_.step_times.end(),
                       [&](double time) { return append_real(values_, variable_.type, time); });
    else if (name == "eb_status" && is_list_of(info_.block_cells.size()))
      ok = integers([&](std::size_t i) {
        return std::optional<std::int64_t>(info_.block_cells[i] > 0 ? 1 : 0);
      });
    else if (const auto factors = set_factors_of(name))
      ok = ones(*factors);
    else
      ok = set_table();
    return ok ? std::optional(std::move(values_)) : std::nullopt;
  }

 private:
  ScalarType type() const { return scalar_of(variable_.type); }
  bool is_list_of(std::size_t rows) const { return shape_.size() == 1 && shape_[0] == rows; }
  bool is_table_of(std::size_t rows) const {
    return shape_.size() == 2 && shape_[0] == rows && variable_.type == NC_CHAR &&
           shape_[1] <= NC_MAX_NAME * 16;
  }
  template <class Number>
  bool integers(Number&& number) {
    for (std::size_t i = 0; i < shape_[0]; ++i) {
      const std::optional<std::int64_t> value = number(i);
      if (!value || !append_integer(values_, type(), *value)) return false;
    }
    return true;
  }
  template <class Name>
  bool names(Name&& name) {
    values_.assign(shape_[0] * shape_[1], std::byte{0});
    for (std::size_t i = 0; i < shape_[0]; ++i) {
      const std::string text = name(i);
      if (text.size() > shape_[1]) return false;
      if (!text.empty()) std::memcpy(values_.data() + i * shape_[1], text.data(), text.size());
    }
    return true;
  }
  // Returns the kind of fields in which this variable has the given role; null if none has it.
  const FieldKind* kind_with(std::string_view FieldKind::*role) const {
    for (const FieldKind& kind : kFieldKinds)
      if (kind.*role == variable_.name) return &kind;
    return nullptr;
  }
  // Derives the names of variables at one location from the fields of the mesh. This is possible
  // only if the fields have the same order as the variables in the file.
  bool field_names(Location location) {
    std::vector<std::string> fields;
    for (std::size_t a = 0; a < layout_.arrays.size() && a < info_.schema.arrays.size(); ++a) {
      const ArrayLayout& array = layout_.arrays[a];
      if (array.field == 0 || array.info.location != location) continue;
      fields.push_back(info_.schema.arrays[a].name);
      if (static_cast<std::size_t>(array.field) != fields.size()) return false;
    }
    return is_table_of(fields.size()) &&
           names([&](std::size_t i) -> const std::string& { return fields[i]; });
  }
  bool truth_table(const FieldKind& kind) {
    if (shape_.size() != 2 || shape_[0] != skeleton_.length_of(kind.places)) return false;
    const std::uint64_t fields = shape_[1];
    if (fields > skeleton_.variables.size()) return false;
    std::vector<std::uint8_t> table(shape_[0] * fields);
    for (const ArrayLayout& array : layout_.arrays) {
      if (array.field == 0 || array.info.location != kind.location) continue;
      if (static_cast<std::uint64_t>(array.field) > fields) return false;
      for (const ArrayPart& part : array.parts)
        table[part.block * fields + static_cast<std::size_t>(array.field) - 1] = 1;
    }
    for (const std::uint8_t entry : table)
      if (!append_integer(values_, type(), entry)) return false;
    return true;
  }
  bool set_table() {
    for (const SetKind& kind : kSetKinds) {
      if (variable_.name == std::string(kind.prefix) + "_prop1" && shape_.size() == 1)
        return integers([&](std::size_t i) { return set_id(kind, i); });
      if (variable_.name == std::string(kind.prefix) + "_names" && is_table_of(shape_[0]))
        return names([&](std::size_t i) { return set_name(kind, i); });
      if (kind.neutral && variable_.name == std::string(kind.prefix) + "_status" &&
          shape_.size() == 1)
        return integers([&](std::size_t i) { return set_status(kind, i); });
    }
    return false;
  }
  // Stores distribution factors that are all 1. Returns false if a set with this number of members
  // cannot have this number of factors.
  bool ones(const SetFactors& factors) {
    // Maximum number of nodes of a side. A side of a hexahedron with 27 nodes has 9 nodes.
    constexpr std::uint64_t kMostNodesOfSide = 9;
    const std::uint64_t members = set_members(*factors.kind, factors.index);
    if (shape_.size() != 1 || shape_[0] == 0) return false;
    const bool sides = factors.kind == &kSetKinds[1];
    if (sides ? shape_[0] > kMostNodesOfSide * members : shape_[0] != members) return false;
    for (std::uint64_t i = 0; i < shape_[0]; ++i)
      if (!append_real(values_, variable_.type, 1)) return false;
    return true;
  }
  std::uint64_t set_members(const SetKind& kind, std::size_t index) const {
    const std::string key = set_key(kind, index, kMembersField);
    std::uint64_t members = 0;
    std::size_t part = 0;
    for (const Extra* extra; (extra = extras_.find(part_key(key, part))) != nullptr; ++part)
      members += extra->data.size() / std::max<std::size_t>(scalar_bytes(extra->type), 1);
    return members;
  }
  // Returns the status of a set: 1 if the set has members, 0 if it does not. Returns nothing if the
  // mesh has no extras for the set.
  std::optional<std::int64_t> set_status(const SetKind& kind, std::size_t index) const {
    if (set_members(kind, index) > 0) return 1;
    if (extras_.find(set_key(kind, index, "id")) == nullptr) return std::nullopt;
    return 0;
  }
  std::optional<std::int64_t> set_id(const SetKind& kind, std::size_t index) const {
    const Extra* extra = extras_.find(set_key(kind, index, "id"));
    // A set without a stored id has the default id (shm/sets.h), which is its index plus one.
    if (extra == nullptr && kind.neutral && set_members(kind, index) > 0)
      return static_cast<std::int64_t>(index) + 1;
    if (extra == nullptr || extra->data.size() != scalar_bytes(extra->type)) return std::nullopt;
    const auto values = integers_of(extra->type, extra->data);
    return values && !values->empty() ? std::optional(values->front()) : std::nullopt;
  }
  std::string set_name(const SetKind& kind, std::size_t index) const {
    const Extra* extra = extras_.find(set_key(kind, index, "name"));
    if (extra == nullptr) return {};
    return {reinterpret_cast<const char*>(extra->data.data()), extra->data.size()};
  }

  const Skeleton& skeleton_;
  const Layout& layout_;
  const Variable& variable_;
  const MeshInfo& info_;
  const ExtraIndex& extras_;
  std::vector<std::uint64_t> shape_;
  std::vector<std::byte> values_;
};

}  // namespace

ScalarType reference_type(ScalarType stored) {
  const bool narrow = scalar_bytes(stored) < 4 || stored == ScalarType::int32;
  return narrow ? ScalarType::int32 : ScalarType::int64;
}

std::optional<std::vector<std::int64_t>> integers_of(ScalarType type,
                                                     const std::vector<std::byte>& values) {
  std::vector<std::int64_t> numbers;
  const bool ok = !is_float(type) && with_scalar(type, [&](auto value) {
    for (std::size_t offset = 0; offset + sizeof value <= values.size(); offset += sizeof value) {
      std::memcpy(&value, values.data() + offset, sizeof value);
      if constexpr (std::is_integral_v<decltype(value)>)
        if (!std::in_range<std::int64_t>(value)) return false;
      numbers.push_back(static_cast<std::int64_t>(value));
    }
    return true;
  });
  return ok ? std::optional(std::move(numbers)) : std::nullopt;
}

bool append_integer(std::vector<std::byte>& out, ScalarType type, std::int64_t value) {
  return with_scalar(type, [&](auto zero) {
    if constexpr (std::is_integral_v<decltype(zero)>)
      return append_value<decltype(zero)>(out, value);
    else
      return false;
  });
}

std::optional<std::vector<std::byte>> derived_values(const Skeleton& skeleton, const Layout& layout,
                                                     std::size_t variable, const MeshInfo& info,
                                                     const ExtraIndex& extras) {
  return Deriver(skeleton, layout, skeleton.variables[variable], info, extras).derive();
}

std::string name_in_table(const std::vector<std::byte>& table, std::uint64_t width,
                          std::uint64_t index) {
  std::string_view row(reinterpret_cast<const char*>(table.data()) + index * width, width);
  row = row.substr(0, row.find('\0'));
  while (!row.empty() && row.back() == ' ') row.remove_suffix(1);
  return std::string(row);
}

}  // namespace shm::converters::exodus
