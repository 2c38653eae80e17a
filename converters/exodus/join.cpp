#include "exodus/join.h"

#include <netcdf.h>

#include <algorithm>
#include <array>
#include <iterator>
#include <set>
#include <utility>

#include "exodus/layout.h"

namespace shm::converters::exodus {
namespace {

constexpr std::array<SetDimension, 3> kSets{
    {{"num_nod_ns", "node_ns", "num_df_ns", true, false},
     {"num_side_ss", "elem_ss", "num_df_ss", false, true},
     {"num_ele_els", "elem_els", "num_df_els", false, false}}};

constexpr std::array<std::string_view, 16> kNemesisDimensions{
    "num_processors",    "num_procs_file", "num_nodes_global", "num_elems_global",
    "num_el_blk_global", "num_ns_global",  "num_ss_global",    "num_int_node",
    "num_bor_node",      "num_ext_node",   "num_int_elem",     "num_bor_elem",
    "num_n_cmaps",       "num_e_cmaps",    "ncnt_cmap",        "ecnt_cmap"};

bool is_nemesis(std::string_view dimension) {
  return std::find(kNemesisDimensions.begin(), kNemesisDimensions.end(), dimension) !=
         kNemesisDimensions.end();
}

// Returns the digits that follow `prefix` in `name`. Returns an empty string if `name` is not
// `prefix` followed by digits.
std::string_view number_behind(std::string_view name, std::string_view prefix) {
  if (prefix.empty() || !name.starts_with(prefix)) return {};
  name.remove_prefix(prefix.size());
  const bool digits = name.find_first_not_of("0123456789") == std::string_view::npos;
  return digits ? name : std::string_view();
}

// Returns the number at the end of a name, or 0 if the name does not end with a number. Names of
// blocks, sets and fields are sorted by this number.
std::uint64_t number_at_end(std::string_view name) {
  const std::size_t last = name.find_last_not_of("0123456789");
  std::uint64_t number = 0;
  for (const char digit : name.substr(last == std::string_view::npos ? 0 : last + 1))
    number = 10 * number + static_cast<std::uint64_t>(digit - '0');
  return number;
}

// Returns the position at which `name`, a name of a part, must be inserted into the list of all
// names. At any position from `next` to `end`, the list would keep the order of names in the part.
// Among these positions, the number at the end of the name decides: names are sorted by these
// numbers.
template <class Item, class Name>
typename std::list<Item>::iterator place_for(std::string_view name,
                                             typename std::list<Item>::iterator next,
                                             typename std::list<Item>::iterator end,
                                             Name&& name_of) {
  while (next != end && number_at_end(name_of(*next)) < number_at_end(name)) ++next;
  return next;
}

// For each name of a part: among this name and the names after it in the part, finds the first one
// that the list of all names contains. Returns the positions of the names that were found in the
// list. The position is `end` if no name was found.
template <class Items, class Iterator, class Name>
std::vector<Iterator> next_known(const Items& items, const std::map<std::string, Iterator>& known,
                                 Iterator end, Name&& name_of) {
  std::vector<Iterator> next(items.size(), end);
  for (std::size_t i = items.size(); i-- > 0;) {
    const auto found = known.find(name_of(items[i]));
    if (found != known.end()) end = found->second;
    next[i] = end;
  }
  return next;
}

bool is_number_map(std::string_view name) {
  return name == "node_num_map" || name == "elem_num_map" || name == "elem_map";
}

// Returns true for dimensions that count edges or faces. These cannot be joined, because edges and
// faces do not have numbers that are common to all parts.
bool is_of_edges_or_faces(std::string_view dimension) {
  for (const std::string_view prefix :
       {"num_edge", "num_face", "num_ed_", "num_fa_", "num_df_es", "num_df_fs"})
    if (dimension.starts_with(prefix)) return true;
  return false;
}

// Returns true if the variable contains the nodes of all polygons of a block. The variable then has
// a single dimension, whose length is the sum of its lengths in the parts.
bool is_of_polygons(const Skeleton& skeleton, const Variable& variable) {
  const std::string_view number = number_behind(variable.name, "connect");
  return !number.empty() && variable.dimensions.size() == 1 &&
         number_behind(skeleton.dimension_name(variable, 0), "num_nod_per_el") == number;
}

bool counts_elements(std::string_view dimension) {
  return dimension == "num_elem" || !number_behind(dimension, "num_el_in_blk").empty();
}

bool is_factors(std::string_view dimension) {
  return std::any_of(kSets.begin(), kSets.end(), [&](const SetDimension& set) {
    return !number_behind(dimension, set.factors).empty();
  });
}

// Returns true for dimensions that count members or distribution factors of a set. In the whole
// mesh, their length is at most the sum of their lengths in the parts.
bool is_of_set(std::string_view dimension) {
  std::string number;
  return set_dimension(dimension, number) != nullptr || is_factors(dimension);
}

// Returns true for dimensions of the whole mesh whose length is taken from the first part that has
// the dimension.
bool is_of_first(std::string_view dimension) {
  return dimension == "num_info" || dimension == "num_qa_rec";
}

bool uses(const Skeleton& skeleton, const Variable& variable, bool (*is_it)(std::string_view)) {
  for (std::size_t d = 0; d < variable.dimensions.size(); ++d)
    if (is_it(skeleton.dimension_name(variable, d))) return true;
  return false;
}

// Returns the kind of netCDF file for the whole mesh. This is the kind of the parts, unless the
// variables of the whole mesh are too large for it.
Kind kind_for(const Skeleton& skeleton) {
  constexpr std::uint64_t kClassic = (std::uint64_t{1} << 31) - 4,
                          kOffset64 = (std::uint64_t{1} << 32) - 4;
  Kind kind = skeleton.kind;
  if (kind != Kind::classic && kind != Kind::offset64) return kind;
  std::uint64_t all = 0;
  for (const Variable& variable : skeleton.variables) {
    std::uint64_t bytes = scalar_bytes(scalar_of(variable.type));
    bool beyond = false;
    for (const std::size_t d : variable.dimensions)
      if (!skeleton.dimensions[d].unlimited)
        beyond |= __builtin_mul_overflow(bytes, skeleton.dimensions[d].length, &bytes);
    beyond |= bytes > kOffset64;
    if (beyond) return Kind::cdf5;
    if (__builtin_add_overflow(all, bytes, &all)) return Kind::cdf5;
  }
  return all > kClassic ? Kind::offset64 : kind;
}

[[noreturn]] void refuse(const std::string& file, ErrorCode code, const std::string& section,
                         const std::string& detail) {
  const Place place{file, code};
  place.fail(code, section, detail);
}

}  // namespace

const SetDimension* set_dimension(std::string_view dimension, std::string& number) {
  for (const SetDimension& set : kSets) {
    number = number_behind(dimension, set.prefix);
    if (!number.empty()) return &set;
  }
  return nullptr;
}

std::optional<SetPlace> set_place(const Skeleton& skeleton, const Variable& variable) {
  for (std::size_t d = 0; d < variable.dimensions.size(); ++d) {
    const std::string& name = skeleton.dimension_name(variable, d);
    std::string number;
    if (const SetDimension* set = set_dimension(name, number))
      return SetPlace{set, number, d, false};
    for (const SetDimension& set : kSets)
      if (const auto digits = number_behind(name, set.factors); !digits.empty())
        return SetPlace{&set, std::string(digits), d, true};
  }
  return std::nullopt;
}

Joining joining_of(const Skeleton& skeleton, const Variable& variable) {
  const std::string& name = variable.name;
  if (name == "nem_ftype" || is_number_map(name) || uses(skeleton, variable, is_nemesis))
    return Joining::dropped;
  const auto is_of_elements = [](std::string_view dimension) {
    return dimension == "num_nodes" || counts_elements(dimension);
  };
  if (uses(skeleton, variable, is_of_elements) || is_of_polygons(skeleton, variable))
    return Joining::elements;
  if (set_place(skeleton, variable)) return Joining::members;
  for (const std::string_view any :
       {"eb_status", "ns_status", "ss_status", "els_status", "elem_var_tab", "nset_var_tab",
        "sset_var_tab", "elset_var_tab"})
    if (name == any && is_integer(variable.type)) return Joining::any;
  if (uses(skeleton, variable, is_of_first)) return Joining::first;
  return Joining::same;
}

void SkeletonJoin::add(const Skeleton& part, const std::string& file) {
  if (!begun_) {
    begun_ = true;
    kind_ = part.kind;
    for (const Attribute& attribute : part.attributes)
      if (!attribute.name.starts_with("nemesis_")) attributes_.push_back(attribute);
  } else if (part.kind != kind_) {
    refuse(file, ErrorCode::unsupported, "header",
           "is a different kind of netCDF file than the earlier parts");
  }
  std::set<std::string_view> sums;
  for (const Dimension& dimension : part.dimensions)
    if (counts_elements(dimension.name)) sums.insert(dimension.name);
  for (const Variable& variable : part.variables)
    if (is_of_polygons(part, variable)) sums.insert(part.dimension_name(variable, 0));
  const auto own_name = [](const auto& item) -> const std::string& { return item.name; };
  const auto dimension_ends =
      next_known(part.dimensions, dimension_at_, dimensions_.end(), own_name);
  auto next_dimension = dimensions_.begin();
  for (std::size_t i = 0; i < part.dimensions.size(); ++i) {
    const Dimension& dimension = part.dimensions[i];
    next_dimension =
        place_for<Dimension>(dimension.name, next_dimension, dimension_ends[i], own_name);
    add_dimension(dimension, sums.contains(dimension.name), file, next_dimension);
  }
  const auto variable_ends = next_known(part.variables, variable_at_, variables_.end(), own_name);
  auto next_variable = variables_.begin();
  for (std::size_t i = 0; i < part.variables.size(); ++i) {
    const Variable& variable = part.variables[i];
    next_variable = place_for<Named>(
        variable.name, next_variable, variable_ends[i],
        [](const Named& named) -> const std::string& { return named.variable.name; });
    add_variable(part, variable, file, next_variable);
  }
}

// Adds a dimension of a part to the list of dimensions of the whole mesh. If the list does not
// contain the dimension yet, inserts it before `next`. Otherwise, updates the length of the
// dimension in the list, and sets `next` to the position after it.
void SkeletonJoin::add_dimension(const Dimension& dimension, bool is_sum, const std::string& file,
                                 std::list<Dimension>::iterator& next) {
  if (is_nemesis(dimension.name)) return;
  const auto found = dimension_at_.find(dimension.name);
  if (found == dimension_at_.end()) {
    dimension_at_.emplace(dimension.name, dimensions_.insert(next, dimension));
    return;
  }
  Dimension& known = *found->second;
  next = std::next(found->second);
  const std::string section = "dimension '" + dimension.name + "'";
  if (is_sum || is_of_set(dimension.name)) {
    if (__builtin_add_overflow(known.length, dimension.length, &known.length))
      refuse(file, ErrorCode::corrupt, section, "there cannot be that many");
  } else if (dimension.name != "num_nodes" && !is_of_first(dimension.name) &&
             known.length != dimension.length) {
    refuse(file, ErrorCode::corrupt, section,
           "is " + std::to_string(dimension.length) + " here and " + std::to_string(known.length) +
               " in an earlier part");
  }
}

void SkeletonJoin::add_variable(const Skeleton& part, const Variable& variable,
                                const std::string& file, std::list<Named>::iterator& next) {
  if (joining_of(part, variable) == Joining::dropped) return;
  const std::string section = "variable '" + variable.name + "'";
  if (uses(part, variable, is_of_edges_or_faces))
    refuse(file, ErrorCode::unsupported, section,
           "has edges or faces, which have no numbers common to all parts");
  Named named{variable, {}};
  for (std::size_t d = 0; d < variable.dimensions.size(); ++d)
    named.dimensions.push_back(part.dimension_name(variable, d));
  named.variable.dimensions.clear();
  const auto found = variable_at_.find(variable.name);
  if (found == variable_at_.end()) {
    const std::string name = variable.name;
    variable_at_.emplace(name, variables_.insert(next, std::move(named)));
    return;
  }
  next = std::next(found->second);
  const Named& known = *found->second;
  // The attributes of a connectivity contain the element type, which defines the meaning of the
  // nodes. The attributes must therefore be equal in all parts.
  const bool typed = variable.name.starts_with("connect");
  if (known.variable.type != variable.type || known.dimensions != named.dimensions ||
      (typed && known.variable.attributes != variable.attributes))
    refuse(file, ErrorCode::corrupt, section,
           "has a different type or shape than in an earlier part");
}

Skeleton SkeletonJoin::joined(const std::map<std::string, std::uint64_t>& lengths) const {
  Skeleton skeleton;
  skeleton.kind = kind_;
  skeleton.attributes = attributes_;
  std::map<std::string_view, std::size_t> position_of;
  for (const Dimension& dimension : dimensions_) {
    position_of.emplace(dimension.name, skeleton.dimensions.size());
    skeleton.dimensions.push_back(dimension);
  }
  for (Dimension& dimension : skeleton.dimensions) {
    const auto known = lengths.find(dimension.name);
    if (known != lengths.end()) dimension.length = known->second;
  }
  for (const Named& named : variables_) {
    skeleton.variables.push_back(named.variable);
    for (const std::string& dimension : named.dimensions)
      skeleton.variables.back().dimensions.push_back(position_of.at(dimension));
  }
  skeleton.kind = kind_for(skeleton);
  return skeleton;
}

}  // namespace shm::converters::exodus
