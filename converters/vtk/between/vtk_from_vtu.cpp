#include "vtk/between/vtk_from_vtu.h"

#include <algorithm>
#include <optional>
#include <string_view>
#include <utility>

#include "base/stored_value.h"
#include "mesh/extra_index.h"
#include "mesh/mesh_source.h"
#include "vtk/between/xml_contents.h"
#include "vtk/cell_plan.h"
#include "vtk/strings.h"
#include "vtk/xml_words.h"

namespace shm::converters::vtk {
namespace {

using vtu::ArrayKind;
using vtu::Contents;
using vtu::Node;
using vtu::NodeKind;
using vtu::ValuesWord;

constexpr std::size_t kLongestTitle = 255;  // limit of VTK's readers

// Returns the text in an InformationKey element, or in a Value element inside it, encoded as a
// single word for a legacy file.
std::string word_in(const Node& node) {
  for (const Node& each : node.children) {
    if (each.kind != NodeKind::text) continue;
    constexpr std::string_view kBlank = " \t\r\n";
    const std::size_t first = each.text.find_first_not_of(kBlank);
    if (first == std::string::npos) break;
    return encode_name(
        std::string_view(each.text).substr(first, each.text.find_last_not_of(kBlank) + 1 - first));
  }
  return {};
}

// Returns the words that follow DATA in the legacy form of an information key: "<value>", or
// "<count> <values>" if the key has several values.
std::string information_data(const Node& key) {
  std::string values;
  std::uint64_t count = 0;
  for (const Node& each : key.children) {
    if (!each.is("Value")) continue;
    values += ' ' + word_in(each);
    ++count;
  }
  return count > 0 ? std::to_string(count) + values : word_in(key);
}

std::string metadata_of(const Node& array, std::uint64_t components, bool rounded) {
  constexpr std::string_view kName = "ComponentName";
  std::map<std::uint64_t, std::string> name_of;  // name of each component
  for (const auto& [key, name] : array.attributes)
    if (key.starts_with(kName) && !name.empty())
      if (const auto c = vtu::parse_count(key.substr(kName.size())); c && *c < components)
        name_of.emplace(*c, encode_name(name));
  const bool named = !name_of.empty();
  std::string names, keys;
  for (std::uint64_t c = 0; named && c < components; ++c)
    names += (name_of.contains(c) ? name_of[c] : std::string()) + '\n';
  std::size_t count = 0;
  for (const Node& each : array.children) {
    if (!each.is("InformationKey") || (rounded && is_range_key(each.attribute_or("name", ""))))
      continue;
    ++count;
    keys += "NAME " + encode_name(each.attribute_or("name", "")) + " LOCATION " +
            encode_name(each.attribute_or("location", "")) + "\nDATA " + information_data(each) +
            '\n';
  }
  return (named ? "COMPONENT_NAMES\n" + names : "") +
         (count > 0 ? "INFORMATION " + std::to_string(count) + '\n' + keys : "");
}

class LegacyBuilder {
 public:
  LegacyBuilder(const MeshInfo& info, Contents& contents, LossList* losses)
      : info_(info), contents_(contents), losses_(losses) {}

  LegacyParts build() {
    const std::string version = contents_.version();
    parts_.skeleton.version = version >= kNewNumberingInXml && has_renumbered_cells(info_)
                                  ? kNewNumberingInLegacy
                                  : "4.2";
    find_step();
    add_field_data();
    add_points();
    for (const Location location : {Location::cell, Location::point}) add_data(location);
    for (std::string& loss : contents_.markup()) lose(std::move(loss));
    if (!points_of_polyhedra_ascend()) lose("order of points of polyhedra");
    return std::move(parts_);
  }

 private:
  void lose(std::string loss) { losses_.add(std::move(loss)); }

  // Returns true if the point numbers of each polyhedron are in ascending order. When VTK reads a
  // legacy file, it sorts the points of a polyhedron, so any other order is lost.
  bool points_of_polyhedra_ascend() const {
    const Extra* counts = extras_.find("vtu/polyhedron/counts");
    const Extra* points = extras_.find("vtu/polyhedron/points");
    if (counts == nullptr || points == nullptr) return true;
    const std::vector<std::int64_t> all = integers_of_extra(*points);
    auto next = all.begin();
    for (const std::int64_t count : integers_of_extra(*counts)) {
      if (count < 0 || count > all.end() - next) return false;
      if (!std::is_sorted(next, next + count)) return false;
      next += count;
    }
    return true;
  }

  // Sets step_ to the time step of the XML file whose time equals the final time of the mesh. If
  // no such time step exists, sets step_ to the final time step of the XML file.
  void find_step() {
    times_ = contents_.times();
    step_ = times_.empty() ? 0 : times_.size() - 1;
    for (std::size_t s = 0; s < times_.size() && !info_.step_times.empty(); ++s)
      if (times_[s] == info_.step_times.back()) step_ = s;
  }

  void add_field_data() {
    std::vector<Entry> arrays;
    if (!info_.step_times.empty()) {
      const double time = info_.step_times.back();
      Extra extra{data_key(0), ScalarType::float64, Reference::nothing, {1, 1}, {}};
      const auto bytes = std::as_bytes(std::span(&time, 1));
      extra.data.assign(bytes.begin(), bytes.end());
      parts_.made.data.push_back(std::move(extra));
      arrays.push_back(Entry{.kind = EntryKind::array,
                             .origin = Origin::extra,
                             .index = 0,
                             .name = std::string(has_field(kLegacyTime) ? kXmlTime : kLegacyTime),
                             .type = "double",
                             .components = 1,
                             .tuples = 1});
    }
    for (Node* array : contents_.field_arrays())
      if (!is_title(*array)) add_extra(*array, arrays);
    add_field(std::move(arrays));
  }

  // Returns true if `array`, an array of field data, contains a title that fits into the header of
  // a legacy file. Also stores this title in the skeleton.
  bool is_title(Node& array) {
    const auto word = vtu::values_word(array);
    if (array.attribute_or("Name", "") != kXmlTitle || !word ||
        word->kind != ValuesWord::Kind::extra || array.attribute_or("type", "") != "String" ||
        vtu::has_metadata(array) || parts_.skeleton.title != Skeleton().title)
      return false;
    const Extra* found = extras_.find(vtu::data_key(word->index));
    std::string title = found == nullptr ? std::string() : text_of_extra(*found);
    if (title.empty() || title.back() != '\0') return false;
    title.pop_back();
    if (title.empty() || title.size() > kLongestTitle || title == Skeleton().title ||
        title.find_first_of(std::string_view("\n\r\0", 3)) != std::string::npos)
      return false;
    parts_.skeleton.title = std::move(title);
    return true;
  }

  void add_field(std::vector<Entry> arrays) {
    if (arrays.empty()) return;
    auto& entries = parts_.skeleton.entries;
    entries.push_back({.kind = EntryKind::field, .name = "FieldData", .tuples = arrays.size()});
    entries.insert(entries.end(), arrays.begin(), arrays.end());
  }

  void add_points() {
    for (const ArrayInfo& array : info_.schema.arrays)
      if (array.role == "vtu:points" && info_.step_times.empty())
        lose("points of other time steps");
    Node* points = contents_.points();
    if (points == nullptr) return;
    const auto type = vtu::type_of_word(points->attribute_or("type", ""));
    Entry entry{.kind = EntryKind::points,
                .type = std::string(word_of_scalar(info_.schema.coordinate_type))};
    if (type && !is_float(type->stored)) entry.type = word_of_scalar(type->stored);
    entry.metadata = metadata_of(*points, 3, info_.schema.coordinate_quantization.lossy());
    parts_.skeleton.entries.push_back(std::move(entry));
  }

  void add_data(Location location) {
    std::vector<Entry> named, others;
    Node* first = contents_.first_data(location);
    if (first != nullptr) {
      Roles roles = roles_of(*first, location);
      of_other_steps_ = of_other_steps(*first);
      for (Node& array : first->children)
        if (array.is_array()) add_array(array, location, roles, named, others);
      for (const auto& [name, kinds] : roles)
        if (!kinds.empty()) lose("attribute of " + quoted_array(name));
    }
    report_other_pieces(location, first);
    const bool of_cells = location == Location::cell;
    for (std::size_t i = 0; i < info_.schema.arrays.size(); ++i)
      if (info_.schema.arrays[i].location == location && is_written(i) &&
          parts_.placed.insert(i).second)
        others.push_back(entry_of_array(info_, i));
    if (named.empty() && others.empty()) return;
    auto& entries = parts_.skeleton.entries;
    entries.push_back({.kind = of_cells ? EntryKind::cell_data : EntryKind::point_data});
    entries.insert(entries.end(), named.begin(), named.end());
    add_field(std::move(others));
  }

  // Reports the loss of arrays that only some pieces have. Legacy files cannot store them, because
  // the points or cells of the other pieces have no values.
  void report_other_pieces(Location location, const Node* first) {
    const std::vector<Node*> all = contents_.data(location);
    for (std::size_t p = 0; p < all.size(); ++p)
      for (std::size_t i = 0; all[p] != nullptr && all[p] != first && i < all[p]->children.size();
           ++i) {
        Node& array = all[p]->children[i];
        if (const auto word = vtu::values_word(array);
            word && word->kind != ValuesWord::Kind::array)
          lose(quoted_array(array.attribute_or("Name", "")) + " of piece " + std::to_string(p));
      }
  }

  using Roles = std::map<std::string, std::set<EntryKind>>;  // roles of each array, by its name

  // Returns the roles of the arrays in a PointData or CellData element. Reports the loss of roles
  // that legacy files cannot express.
  Roles roles_of(const Node& data, Location location) {
    Roles roles;
    for (const auto& [key, name] : data.attributes) {
      const std::string_view role = key;
      const auto is_key = [role](const Attribute& attribute) { return attribute.name == role; };
      const bool known = std::find(std::begin(kXmlOnlyAttributes), std::end(kXmlOnlyAttributes),
                                   key) != std::end(kXmlOnlyAttributes) ||
                         std::any_of(std::begin(kAttributes), std::end(kAttributes), is_key);
      if (!known) continue;
      const ArrayInfo* array = nullptr;
      for (const ArrayInfo& each : info_.schema.arrays)
        if (each.location == location && each.name == name) array = &each;
      if (array == nullptr) continue;
      bool fits = false;
      for (const Attribute& attribute : kAttributes) {
        const bool may_be_strings = attribute.kind == EntryKind::pedigree_ids;
        fits = attribute.name == key && array->components >= attribute.least &&
               array->components <= attribute.most && (array->role.empty() || may_be_strings) &&
               roles[name].insert(attribute.kind).second;
        if (fits) break;
      }
      if (!fits) lose("attribute " + key + " of " + quoted_array(name));
    }
    return roles;
  }

  bool is_written(std::size_t array) const {
    const ArrayInfo& info = info_.schema.arrays[array];
    return info.role.empty() && (!info.per_step || !info_.step_times.empty());
  }

  // Returns the indices of the arrays in a PointData or CellData element that exist at other time
  // steps, but not at the written time step.
  std::set<std::uint64_t> of_other_steps(Node& data) const {
    std::set<std::uint64_t> others, current;
    for (Node& array : data.children) {
      const auto word = vtu::values_word(array);
      if (!word || word->kind != ValuesWord::Kind::array) continue;
      const auto step = vtu::parse_count(array.attribute_or("TimeStep", ""));
      const bool other = step && !word->step && !times_.empty() && *step != step_;
      (other ? others : current).insert(word->index);
    }
    for (const std::uint64_t array : current) others.erase(array);
    return others;
  }

  void add_array(Node& array, Location location, Roles& roles, std::vector<Entry>& named,
                 std::vector<Entry>& others) {
    const std::string name = array.attribute_or("Name", "");
    const auto word = vtu::values_word(array);
    if (!word) return;
    if (word->kind != ValuesWord::Kind::array)
      return add_other_values(array, *word, location, others);
    if (word->index >= info_.schema.arrays.size()) return;
    const ArrayInfo& info = info_.schema.arrays[word->index];
    const auto type = vtu::type_of_word(array.attribute_or("type", ""));
    const bool strings = type && type->kind == ArrayKind::string;
    if (info.location != location || strings != (info.role == kStringRole) ||
        (!strings && !is_written(word->index)))
      return;
    if (of_other_steps_.contains(word->index)) {
      lose(quoted_array(name) + " at time step " + array.attribute_or("TimeStep", ""));
      parts_.placed.insert(word->index);
      return;
    }
    if (!parts_.placed.insert(word->index).second) return;
    Entry entry = entry_of_array(info_, word->index);
    entry.metadata = metadata_of(array, entry.components, info.quantization.lossy());
    if (type && type->kind == ArrayKind::bit && info.type == ScalarType::uint8) entry.type = "bit";
    if (strings) {
      entry.type = "string";
      const Extra* list = extras_.find(strings_key(word->index));
      parts_.made.strings.push_back(
          text_extra(strings_key(word->index), recoded(list == nullptr ? "" : text_of_extra(*list),
                                                       StringForm::zeros, StringForm::lengths)));
    }
    const std::set<EntryKind> kinds = std::exchange(roles[name], {});
    if (kinds.empty()) others.push_back(entry);
    for (const EntryKind kind : kinds) {  // like VTK, writes the array once for each of its roles
      entry.kind = kind;
      entry.second = kind == EntryKind::scalars ? "default" : "";
      named.push_back(entry);
    }
  }

  // Adds an array of points or cells whose values are stored as an extra, not as an array of the
  // mesh. The values of an extra are in file order. If the mesh was stored in another order (not
  // Order::keep), they are dropped and reported as lost.
  void add_other_values(Node& array, const ValuesWord& word, Location location,
                        std::vector<Entry>& others) {
    const std::uint64_t elements = location == Location::cell ? info_.cells() : info_.vertices;
    const std::size_t before = others.size(), made = parts_.made.data.size();
    if (word.kind == ValuesWord::Kind::extra && info_.schema.order == Order::keep)
      add_extra(array, others);
    if (others.size() > before && others.back().tuples == elements) return;
    others.resize(before);
    parts_.made.data.resize(made);
    lose(quoted_array(array.attribute_or("Name", "")));
  }

  void add_extra(Node& array, std::vector<Entry>& out) {
    const std::string name = array.attribute_or("Name", "");
    const auto word = vtu::values_word(array);
    const auto type = vtu::type_of_word(array.attribute_or("type", ""));
    const Extra* found = word && type && word->kind == ValuesWord::Kind::extra
                             ? extras_.find(vtu::data_key(word->index))
                             : nullptr;
    const std::uint64_t components = std::max<std::uint64_t>(
        vtu::parse_count(array.attribute_or("NumberOfComponents", "1")).value_or(1), 1);
    if (found == nullptr || found->type != type->stored) return lose("field data '" + name + "'");
    const std::string text = text_of_extra(*found);
    std::uint64_t count = found->data.size() / scalar_bytes(type->stored);
    if (type->kind == ArrayKind::string)
      count = static_cast<std::uint64_t>(std::count(text.begin(), text.end(), '\0'));
    if (count % components != 0) return lose("field data '" + name + "'");
    Entry entry{.kind = EntryKind::array,
                .origin = Origin::extra,
                .index = parts_.made.data.size(),
                .name = encode_name(name),
                .type = std::string(word_of_scalar(type->stored)),
                .components = components,
                .tuples = count / components};
    if (name == kXmlTime && !info_.step_times.empty() && type->kind == ArrayKind::number) {
      const bool known =
          count == 1 && as_double(found->data.data(), found->type) == info_.step_times.back();
      return known ? void() : lose("field data '" + name + "' (replaced by the time of the step)");
    }
    if (name == kXmlTime && count == 1 && !has_field(kLegacyTime)) entry.name = kLegacyTime;
    const bool too_many = components > kMostNamedComponents;
    if (too_many && vtu::has_metadata(array)) lose("names of components of " + quoted_array(name));
    entry.metadata = metadata_of(array, too_many ? 0 : components, false);
    Extra values = *found;
    if (type->kind == ArrayKind::string) {
      entry.type = "string";
      values = text_extra({}, recoded(text, StringForm::zeros, StringForm::lengths));
    } else if (type->kind == ArrayKind::bit) {
      entry.type = "bit";
      values = text_extra({}, packed_bits(text));
    }
    values.key = data_key(entry.index);
    parts_.made.data.push_back(std::move(values));
    out.push_back(std::move(entry));
  }

  static std::string packed_bits(std::string_view bytes) {
    std::string packed((bytes.size() + 7) / 8, '\0');
    for (std::size_t i = 0; i < bytes.size(); ++i)
      if (bytes[i] != 0)
        packed[i / 8] =
            static_cast<char>(static_cast<unsigned char>(packed[i / 8]) | 0x80U >> i % 8);
    return packed;
  }

  bool has_field(std::string_view name) {
    const auto arrays = contents_.field_arrays();
    return std::any_of(arrays.begin(), arrays.end(),
                       [&](const Node* array) { return array->attribute_or("Name", "") == name; });
  }

  const MeshInfo& info_;
  Contents& contents_;
  LossCollector losses_;
  const ExtraIndex extras_{info_.extras};
  LegacyParts parts_;
  std::vector<double> times_;
  std::size_t step_ = 0;
  // Arrays of the current PointData or CellData element that do not exist at the written time step.
  std::set<std::uint64_t> of_other_steps_;
};

}  // namespace

LegacyParts legacy_of_xml(const MeshInfo& info, LossList* losses) {
  auto contents = Contents::of(info);
  if (!contents && find_extra(info, "vtu/skeleton") != nullptr)
    fail_extra("vtu/skeleton", "the stored structure of the VTU file is invalid");
  if (!contents) return {};
  return LegacyBuilder(info, *contents, losses).build();
}

LossList losses_in_vtk(const MeshInfo& info) {
  LossList losses;
  legacy_of_xml(info, &losses);
  return losses;
}

}  // namespace shm::converters::vtk
