#include "exodus/describe.h"

#include <netcdf.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <map>
#include <string>
#include <utility>

#include "base/stored_value.h"

namespace shm::converters::exodus {
namespace {

// Maximum number of sets of one kind. This is limited because each set needs several extras.
constexpr std::uint64_t kMostSets = 1 << 16;

// Converts vertex or cell numbers, which start at 1 in an Exodus file, to references, which start
// at 0. Returns false if a number is not in the range 0..count.
bool refer_from_zero(Extra& extra, Reference refers, std::uint64_t count) {
  const auto numbers = integers_of(extra.type, extra.data);
  if (!numbers) return false;
  const ScalarType type = reference_type(extra.type);
  std::vector<std::byte> values;
  for (const std::int64_t number : *numbers)
    if (number < 0 || std::cmp_greater(number, count) || !append_integer(values, type, number - 1))
      return false;
  extra.type = type;
  extra.refers = refers;
  extra.data = std::move(values);
  return true;
}

class Description {
 public:
  Description(const Skeleton& skeleton, const Layout& layout, const VariableValues& values,
              const Place& place)
      : skeleton_(skeleton), layout_(layout), values_(values), place_(place) {}

  MeshInfo describe() {
    describe_blocks();
    describe_arrays();
    describe_times();
    read_extras();
    return std::move(info_);
  }

 private:
  const Variable& variable(int index) const {
    return skeleton_.variables[static_cast<std::size_t>(index)];
  }
  std::string section(int index) const { return "variable '" + variable(index).name + "'"; }
  std::vector<std::byte> whole(int index) const {
    return whole_variable(skeleton_, values_, index);
  }
  // Returns true if the variable has one dimension of length `length` and contains numbers.
  bool is_list(int index, std::uint64_t length) const {
    return index >= 0 && variable(index).type != NC_CHAR && variable(index).type != NC_STRING &&
           skeleton_.shape(variable(index)) == std::vector<std::uint64_t>{length};
  }
  std::vector<std::int64_t> ids(int index) const;
  std::vector<std::string> names(std::string_view table, std::uint64_t count) const;

  void describe_blocks();
  void describe_arrays();
  void describe_times();
  void read_set_labels(std::vector<Extra>& extras, const ExtraIndex& members) const;
  bool lists_members(std::size_t v) const {
    return extra_key(skeleton_.variables[v].name).ends_with("/members");
  }
  void read_extras();
  std::vector<Extra> read_variable(std::size_t v, const ExtraIndex& known) const;
  Extra read_rows(int index, std::uint64_t first, std::uint64_t count) const;

  const Skeleton& skeleton_;
  const Layout& layout_;
  const VariableValues& values_;
  const Place& place_;
  MeshInfo info_;
};

// Returns the values of an integer variable of any type as 64-bit integers.
std::vector<std::int64_t> Description::ids(int index) const {
  const ScalarType type = scalar_of(variable(index).type);
  const std::vector<std::byte> values = whole(index);
  if (!is_float(type)) {
    auto numbers = integers_of(type, values);
    if (!numbers) place_.fail(ErrorCode::corrupt, section(index), "has an id beyond 63 bits");
    return std::move(*numbers);
  }
  std::vector<std::int64_t> numbers;
  for (std::size_t offset = 0; offset < values.size(); offset += scalar_bytes(type)) {
    const double number = as_double(values.data() + offset, type);
    if (!(std::fabs(number) < 0x1p63))
      place_.fail(ErrorCode::corrupt, section(index), "has an id beyond 63 bits");
    numbers.push_back(static_cast<std::int64_t>(number));
  }
  return numbers;
}

// Returns the first `count` names in a table of names, or all names if the table has fewer than
// `count`.
std::vector<std::string> Description::names(std::string_view table, std::uint64_t count) const {
  const int index = skeleton_.find_variable(table);
  if (index < 0 || variable(index).type != NC_CHAR) return {};
  const auto shape = skeleton_.shape(variable(index));
  if (shape.size() != 2) return {};
  const std::vector<std::byte> values = whole(index);
  std::vector<std::string> rows;
  for (std::uint64_t i = 0; i < std::min(shape[0], count); ++i)
    rows.push_back(name_in_table(values, shape[1], i));
  return rows;
}

void Description::describe_blocks() {
  Schema& schema = info_.schema;
  schema.source_format = "exodus";
  schema.coordinate_type = layout_.coordinate_type;
  info_.vertices = layout_.vertices;
  const std::size_t count = layout_.blocks.size();
  const auto labels = names("eb_names", count);
  const int table = skeleton_.find_variable("eb_prop1");
  const bool has_ids = is_list(table, count);
  const std::vector<std::int64_t> ids = has_ids ? this->ids(table) : std::vector<std::int64_t>();
  for (std::size_t b = 0; b < count; ++b) {
    const BlockLayout& block = layout_.blocks[b];
    schema.blocks.push_back({has_ids ? ids[b] : static_cast<std::int64_t>(b + 1),
                             b < labels.size() ? labels[b] : std::string(), block.shape,
                             block.nodes_per_cell, block.scheme});
    info_.block_cells.push_back(block.cells);
  }
}

void Description::describe_arrays() {
  const std::size_t most = skeleton_.variables.size() + layout_.arrays.size();
  std::map<Location, std::vector<std::string>> tables;
  for (const ArrayLayout& array : layout_.arrays) {
    info_.schema.arrays.push_back(array.info);
    if (array.field == 0) continue;
    std::string& name = info_.schema.arrays.back().name;
    const Location location = array.info.location;
    const auto [found, fresh] = tables.try_emplace(location);
    std::vector<std::string>& table = found->second;
    if (fresh) table = names(names_of_fields(location), most);
    const auto place = static_cast<std::size_t>(array.field) - 1;
    if (place < table.size()) name = table[place];
    const auto prefix = [&]() -> std::string {
      if (location == Location::point) return "nodal_";
      return location == Location::cell ? "element_" : std::string(location_name(location)) + "_";
    };
    if (name.empty()) name = prefix() + std::to_string(array.field);
  }
}

void Description::describe_times() {
  info_.step_times.resize(layout_.steps);
  const int index = skeleton_.find_variable("time_whole");
  if (!is_list(index, layout_.steps)) return;
  const ScalarType type = scalar_of(variable(index).type);
  const std::vector<std::byte> values = whole(index);
  for (std::size_t step = 0; step < layout_.steps; ++step)
    info_.step_times[step] = as_double(values.data() + step * scalar_bytes(type), type);
}

// Reads the ids and names of sets. An id is stored only if it differs from the default id
// (shm/sets.h), i.e. the index of the set plus one.
void Description::read_set_labels(std::vector<Extra>& extras, const ExtraIndex& members) const {
  for (const SetKind& kind : kSetKinds) {
    const int table = skeleton_.find_variable(std::string(kind.prefix) + "_prop1");
    if (table < 0) continue;
    const auto shape = skeleton_.shape(variable(table));
    const ScalarType type = scalar_of(variable(table).type);
    if (shape.size() != 1 || (type != ScalarType::int32 && type != ScalarType::int64)) continue;
    if (shape[0] > kMostSets)
      place_.fail(ErrorCode::unsupported, section(table),
                  "there are more than " + std::to_string(kMostSets) + " sets");
    const std::vector<std::byte> ids = whole(table);
    const auto labels = names(std::string(kind.prefix) + "_names", shape[0]);
    const auto bytes = static_cast<std::ptrdiff_t>(scalar_bytes(type));
    for (std::size_t i = 0; i < shape[0]; ++i) {
      const auto begin = ids.begin() + static_cast<std::ptrdiff_t>(i) * bytes;
      Extra id{set_key(kind, i, "id"), type, Reference::nothing, {1}, {begin, begin + bytes}};
      const Extra* list = kind.neutral ? members.find(set_key(kind, i, kMembersField)) : nullptr;
      const bool known = list != nullptr && !list->data.empty() &&
                         integers_of_extra(id).at(0) == static_cast<std::int64_t>(i) + 1;
      if (!known) extras.push_back(std::move(id));
      if (i >= labels.size() || labels[i].empty()) continue;
      const auto* text = reinterpret_cast<const std::byte*>(labels[i].data());
      extras.push_back({set_key(kind, i, "name"),
                        ScalarType::uint8,
                        Reference::nothing,
                        {labels[i].size()},
                        {text, text + labels[i].size()}});
    }
  }
}

void Description::read_extras() {
  const std::string text = to_text(skeleton_);
  const auto* bytes = reinterpret_cast<const std::byte*>(text.data());
  std::vector<Extra> extras;
  extras.push_back({"exodus/skeleton",
                    ScalarType::uint8,
                    Reference::nothing,
                    {text.size()},
                    {bytes, bytes + text.size()}});
  // Read the members of sets first, because other variables may be derived from them. The extras
  // are nevertheless stored in the order of the variables.
  std::vector<std::vector<Extra>> values(skeleton_.variables.size());
  ExtraIndex known;
  const auto read_all = [&](bool members) {
    for (std::size_t v = 0; v < values.size(); ++v)
      if (layout_.uses[v] == Use::extra && lists_members(v) == members)
        values[v] = read_variable(v, known);
  };
  read_all(true);
  for (const std::vector<Extra>& list : values) known.add(list);
  read_set_labels(extras, known);
  known.add(extras);
  read_all(false);
  info_.extras = std::move(extras);
  for (std::vector<Extra>& list : values)
    info_.extras.insert(info_.extras.end(), std::make_move_iterator(list.begin()),
                        std::make_move_iterator(list.end()));
}

// Reads a variable and returns it as an extra. A large variable becomes several extras, each with
// some of the rows. Returns an empty list if the variable can be derived from the rest of the mesh.
std::vector<Extra> Description::read_variable(std::size_t v, const ExtraIndex& known) const {
  const Variable& one = skeleton_.variables[v];
  const Reference refers = reference_of(one.name);
  const std::uint64_t count = refers == Reference::vertex ? layout_.vertices : layout_.cells;
  const bool integral = is_integer(one.type);
  const auto rows = rows_of_parts(skeleton_, one);
  std::vector<Extra> parts;
  bool referring = integral && refers != Reference::nothing;
  for (std::size_t i = 0; i + 1 < rows.size(); ++i) {
    Extra part = read_rows(static_cast<int>(v), rows[i], rows[i + 1] - rows[i]);
    if (rows.size() == 2 && derived_values(skeleton_, layout_, v, info_, known) == part.data)
      return {};
    parts.push_back(std::move(part));
    if (referring && !refer_from_zero(parts.back(), refers, count)) {
      // This part contains invalid references. No part of the variable may then be stored as
      // references, so read all parts again without conversion.
      referring = false;
      parts.clear();
      i = std::size_t(-1);
    }
  }
  const bool plain = refers != Reference::nothing && !referring;
  const std::string key = plain ? plain_key(one.name) : extra_key(one.name);
  for (std::size_t i = 0; i < parts.size(); ++i) parts[i].key = part_key(key, i);
  return parts;
}

// Reads the rows `first` to `first` + `count` - 1 of a variable. A row contains the values at one
// index of the first dimension.
Extra Description::read_rows(int index, std::uint64_t first, std::uint64_t count) const {
  const Variable& one = variable(index);
  Extra extra{{}, scalar_of(one.type), Reference::nothing, skeleton_.shape(one), {}};
  if (count == 0 || one.type == NC_STRING || one.dimensions.empty()) {
    extra.data = whole(index);
    if (one.type == NC_STRING) extra.shape = {extra.data.size()};
    return extra;
  }
  extra.shape[0] = count;
  extra.data = values_.rows(index, first, count);
  return extra;
}

}  // namespace

std::vector<std::byte> whole_variable(const Skeleton& skeleton, const VariableValues& values,
                                      int variable) {
  const auto shape = skeleton.shape(skeleton.variables[static_cast<std::size_t>(variable)]);
  return values.rows(variable, 0, shape.empty() ? 1 : shape[0]);
}

MeshInfo describe(const Skeleton& skeleton, const Layout& layout, const VariableValues& values,
                  const Place& place) {
  return Description(skeleton, layout, values, place).describe();
}

}  // namespace shm::converters::exodus
