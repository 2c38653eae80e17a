// Reads the views of a Gmsh file, which are in the sections $NodeData, $ElementData and
// $ElementNodeData.
#include <algorithm>
#include <bit>

#include "gmsh/mesh.h"
#include "mesh/unique_names.h"

namespace shm::converters {
namespace {

constexpr std::uint64_t kMaxComponents = 65535;  // largest number of components of an array

// Maximum number of entries of a view that is sorted in memory. Larger views are sorted with a
// table on disk, in the spool.
constexpr std::uint64_t kFewEntries = 1 << 16;

struct Header {
  std::vector<std::string> strings;
  std::vector<std::string> reals, integers;  // words, verbatim
  std::uint64_t components = 0, entries = 0;
  std::int64_t step = 0;
  double time = 0;

  std::string text() const {
    std::string all;
    for (const auto* tags : {&strings, &reals, &integers}) {
      all += std::to_string(tags->size()) + '\n';
      for (const std::string& tag : *tags) all += tag + '\n';
    }
    return all;
  }
  // Returns a string that contains all tags of the section header except the time and the step
  // number. Data sections with equal strings are time steps of one view.
  std::string group() const {
    std::string all;
    for (const std::string& tag : strings) all += tag + '\n';
    for (std::size_t i = 1; i < reals.size(); ++i) all += '\n' + reals[i];
    for (std::size_t i = 1; i < integers.size(); ++i) all += "\n\n" + integers[i];
    return all;
  }
  std::string name() const {
    if (strings.empty()) return {};
    const std::string& tag = strings[0];
    const std::size_t open = tag.find('"'), close = tag.rfind('"');
    if (open == std::string::npos || open == close) return tag;
    return tag.substr(open + 1, close - open - 1);
  }
};

bool read_header(TextInput& input, Header& header) {
  const auto read_count = [&](std::uint64_t& count) {
    std::int64_t value = 0;
    if (!TextInput::parse(input.word(), value) || value < 0) return false;
    count = static_cast<std::uint64_t>(value);
    input.expect_room(count, 1, "tags of a view");
    return true;
  };
  std::uint64_t count = 0;
  if (!read_count(count)) return false;
  input.skip_line();
  for (std::uint64_t i = 0; i < count; ++i) header.strings.push_back(input.line());
  if (!read_count(count)) return false;
  for (std::uint64_t i = 0; i < count; ++i) header.reals.emplace_back(input.word());
  if (!read_count(count)) return false;
  for (std::uint64_t i = 0; i < count; ++i) header.integers.emplace_back(input.word());
  input.skip_line();
  if (!header.reals.empty() && !TextInput::parse(header.reals[0], header.time)) return false;
  return header.integers.size() >= 3 && TextInput::parse(header.integers[0], header.step) &&
         TextInput::parse(header.integers[1], header.components) &&
         TextInput::parse(header.integers[2], header.entries) && header.components > 0 &&
         header.components <= kMaxComponents;
}

class DataReader {
 public:
  DataReader(GmshReading& reading, Header header)
      : r_(reading),
        header_(std::move(header)),
        points_(r_.sections.back().name == "NodeData"),
        by_node_(r_.sections.back().name == "ElementNodeData"),
        known_(points_ ? r_.have_nodes : r_.have_elements),
        tags_(r_.spool, 8),
        places_(r_.spool, 8),
        sizes_(r_.spool, 4),
        values_(r_.spool, 8) {}

  void read() {
    read_entries();
    find_places();
    if (found_all_ && covers_blocks() && uniform_nodes())
      add_view();
    else
      add_list();
  }

 private:
  GmshTags& mesh_tags() { return points_ ? r_.nodes : r_.elements; }

  void read_entries() {
    const bool binary = r_.scan.encoding.binary;
    const std::uint64_t numbers = by_node_ ? 2 : 1 + header_.components;
    r_.input.expect_room(header_.entries,
                         binary && !by_node_ ? 4 + 8 * header_.components : numbers, "values");
    std::vector<double> values(header_.components);
    for (std::uint64_t e = 0; e < header_.entries; ++e) {
      const std::int64_t tag = r_.scan.integer32();
      tags_.append(1, reinterpret_cast<const std::byte*>(&tag));
      std::uint64_t nodes = 1;
      if (by_node_) {
        const std::int64_t stated = r_.scan.integer32();
        if (stated < 0) r_.input.fail(ErrorCode::corrupt, "a count is negative");
        nodes = static_cast<std::uint64_t>(stated);
        r_.input.expect_room(nodes, header_.components, "values of an element");
        const auto size = static_cast<std::uint32_t>(nodes);
        sizes_.append(1, reinterpret_cast<const std::byte*>(&size));
      }
      for (std::uint64_t n = 0; n < nodes; ++n) {
        r_.scan.reals(values);
        values_.append(values.size(), reinterpret_cast<const std::byte*>(values.data()));
      }
    }
    expect_section_end(r_);
  }

  void find_places() {
    found_all_ = known_;
    std::uint64_t before = 0;
    for (std::uint64_t e = 0; e < header_.entries && found_all_; ++e) {
      const auto place = mesh_tags().find(tags_.get<std::int64_t>(e));
      found_all_ = place.has_value();
      if (!found_all_) break;
      places_.set(e, *place);
      ascending_ &= e == 0 || *place > before;
      before = *place;
    }
  }

  // Returns true if the section has exactly one entry for each node, or for each element of some
  // blocks and no entry for other elements.
  bool covers_blocks() {
    const MeshInfo& info = r_.mesh->info_;
    if (header_.entries == 0 || header_.entries > mesh_tags().size()) return false;
    if (!ascending_ && header_.entries <= kFewEntries) {
      for (std::uint64_t e = 0; e < header_.entries; ++e)
        few_.emplace_back(places_.get<std::uint64_t>(e), e);
      std::sort(few_.begin(), few_.end());
      const auto same = [](const auto& a, const auto& b) { return a.first == b.first; };
      if (std::adjacent_find(few_.begin(), few_.end(), same) != few_.end()) return false;
    } else if (!ascending_) {
      entry_of_.emplace(r_.spool, 8);
      for (std::uint64_t e = 0; e < header_.entries; ++e) {
        const auto place = places_.get<std::uint64_t>(e);
        if (place < entry_of_->size() && entry_of_->get<std::uint64_t>(place) != 0) return false;
        entry_of_->set(place, e + 1);
      }
    }
    if (points_) return header_.entries == info.vertices;
    // Number of cells with entries, by block.
    std::map<std::uint32_t, std::uint64_t> cells;
    for (std::uint64_t e = 0; e < header_.entries; ++e)
      ++cells[r_.mesh->cell_blocks_.get<std::uint32_t>(places_.get<std::uint64_t>(e))];
    for (const auto& [block, count] : cells) {
      if (count != info.block_cells[block]) return false;
      covered_.push_back(block);
    }
    if (header_.entries != mesh_tags().size()) blocks_ = covered_;
    return true;
  }

  // For a section $ElementNodeData, returns true if all elements in the section have the same
  // number of nodes, and all cells in the blocks of these elements have this number of nodes. For
  // other sections, always returns true.
  bool uniform_nodes() {
    if (!by_node_) return true;
    nodes_ = sizes_.get<std::uint32_t>(0);
    if (nodes_ == 0 || nodes_ * header_.components > kMaxComponents) return false;
    for (std::uint64_t e = 1; e < header_.entries; ++e)
      if (sizes_.get<std::uint32_t>(e) != nodes_) return false;
    return std::all_of(covered_.begin(), covered_.end(), [&](std::uint32_t b) {
      return r_.mesh->info_.schema.blocks[b].nodes_per_cell == nodes_;
    });
  }

  void add_view() {
    GmshView view;
    view.section = r_.sections.size() - 1;
    view.array_name = header_.name();
    view.step = header_.step;
    view.time = header_.time;
    view.components = static_cast<std::uint32_t>(header_.components * nodes_);
    view.blocks = std::move(blocks_);
    view.group = r_.sections.back().name + '\n' + std::to_string(view.components) + '\n';
    for (const std::uint32_t b : view.blocks) view.group += std::to_string(b) + ',';
    view.group += '\n' + header_.group();
    if (ascending_)
      view.values = std::move(values_);
    else
      view.values = in_mesh_order(view.components);
    r_.views.push_back(std::move(view));
    r_.sections.back().kind = "array";
    r_.add_text(r_.section_key() + "/header", header_.text());
  }

  PagedArray in_mesh_order(std::uint64_t components) {
    PagedArray sorted(r_.spool, 8);
    std::vector<double> one(components);
    auto* bytes = reinterpret_cast<std::byte*>(one.data());
    for (const auto& [place, entry] : few_) {
      values_.read(entry * components, components, bytes);
      sorted.append(components, bytes);
    }
    for (std::uint64_t place = 0; entry_of_ && place < entry_of_->size(); ++place) {
      const auto entry = entry_of_->get<std::uint64_t>(place);
      if (entry == 0) continue;
      values_.read((entry - 1) * components, components, bytes);
      sorted.append(components, bytes);
    }
    return sorted;
  }

  void add_list() {
    r_.sections.back().kind = "list";
    const std::string key = r_.section_key();
    r_.add_text(key + "/header", header_.text());
    PagedArray& numbers = found_all_ ? places_ : tags_;
    const Reference refers = !found_all_ ? Reference::nothing
                             : points_   ? Reference::vertex
                                         : Reference::cell;
    r_.tags_are_referred_to |= !found_all_;
    const char* what = !found_all_ ? "/tags" : points_ ? "/vertices" : "/cells";
    add_numbers(key + what, ScalarType::int64, numbers, header_.entries, refers);
    if (by_node_) add_numbers(key + "/counts", ScalarType::int32, sizes_, header_.entries);
    add_numbers(key + "/values", ScalarType::float64, values_, values_.size());
  }

  void add_numbers(std::string key, ScalarType type, PagedArray& numbers, std::uint64_t count,
                   Reference refers = Reference::nothing) {
    Extra extra{std::move(key), type, refers, {count}, {}};
    extra.data.resize(count * scalar_bytes(type));
    numbers.read(0, count, extra.data.data());
    r_.mesh->info_.extras.push_back(std::move(extra));
  }

  GmshReading& r_;
  const Header header_;
  const bool points_, by_node_, known_;
  PagedArray tags_, places_, sizes_, values_;
  // Maps each node or element of the mesh to the index of its entry in the section. Used only if
  // the entries are not in mesh order. For a small view, few_ contains pairs (node or element,
  // entry). For a large view, entry_of_ contains, for each node or element, the index of its entry
  // plus 1, or 0 if it has no entry.
  std::vector<std::pair<std::uint64_t, std::uint64_t>> few_;
  std::optional<PagedArray> entry_of_;
  bool found_all_ = false, ascending_ = true;
  std::uint64_t nodes_ = 1;
  std::vector<std::uint32_t> blocks_, covered_;
};

// Groups the data sections, so that the sections of a group become the time steps of one array.
class ViewGroups {
 public:
  explicit ViewGroups(GmshReading& reading) : r_(reading) {
    for (const ArrayInfo& array : r_.mesh->info_.schema.arrays)
      names_.keep(array.location, array.name);
    for (std::size_t v = 0; v < r_.views.size(); ++v) {
      const auto [entry, fresh] = number_.try_emplace(r_.views[v].group, groups_.size());
      // If the step number of a section is not higher than that of the previous section of its
      // group, the section begins a new group.
      if (fresh || r_.views[v].step <= r_.views[groups_[entry->second].back()].step) {
        entry->second = groups_.size();
        groups_.emplace_back();
      }
      groups_[entry->second].push_back(v);
    }
  }

  void add_arrays() {
    const std::vector<std::size_t>* longest = nullptr;
    for (const auto& group : groups_)
      if (group.size() > 1 && (longest == nullptr || group.size() > longest->size()))
        longest = &group;
    if (longest != nullptr)
      for (const std::size_t v : *longest) r_.mesh->info_.step_times.push_back(r_.views[v].time);
    for (const auto& group : groups_) {
      if (longest != nullptr && same_times(group, *longest)) {
        add_array(group, true);
        continue;
      }
      for (const std::size_t v : group) add_array({v}, false);
    }
  }

 private:
  bool same_times(const std::vector<std::size_t>& a, const std::vector<std::size_t>& b) const {
    return std::equal(a.begin(), a.end(), b.begin(), b.end(), [&](std::size_t x, std::size_t y) {
      return std::bit_cast<std::uint64_t>(r_.views[x].time) ==
             std::bit_cast<std::uint64_t>(r_.views[y].time);
    });
  }

  void add_array(const std::vector<std::size_t>& group, bool per_step) {
    GmshView& first = r_.views[group[0]];
    const std::string& section = r_.sections[first.section].name;
    ArrayInfo info;
    info.location = section == "NodeData" ? Location::point : Location::cell;
    info.name = names_.take(info.location, first.array_name.empty() ? section : first.array_name);
    info.components = first.components;
    info.per_step = per_step;
    info.blocks = first.blocks;
    if (section == "ElementNodeData") info.role = "gmsh:element_node_data";
    auto& values = r_.mesh->values_.emplace_back();
    for (std::size_t step = 0; step < group.size(); ++step) {
      GmshView& view = r_.views[group[step]];
      values.push_back(std::move(*view.values));
      r_.sections[view.section].step = step;
      r_.sections[view.section].array = info.name;
    }
    r_.mesh->info_.schema.arrays.push_back(std::move(info));
  }

  GmshReading& r_;
  std::map<std::string, std::size_t> number_;
  std::vector<std::vector<std::size_t>> groups_;
  UniqueNames names_;
};

}  // namespace

bool read_gmsh_data(GmshReading& reading) {
  Header header;
  if (!read_header(reading.input, header)) return false;
  DataReader(reading, std::move(header)).read();
  return true;
}

void finish_gmsh_data(GmshReading& reading) { ViewGroups(reading).add_arrays(); }

}  // namespace shm::converters
