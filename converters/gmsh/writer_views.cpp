// Writes the views of a Gmsh file, which are the sections $NodeData, $ElementData and
// $ElementNodeData.
#include <algorithm>
#include <cstring>

#include "base/stored_value.h"
#include "gmsh/writing.h"

namespace shm::converters {
namespace {

template <class T>
void widen_as(const std::vector<std::byte>& in, std::vector<double>& out) {
  for (std::size_t i = 0; i < out.size(); ++i) {
    T value;
    std::memcpy(&value, in.data() + i * sizeof(T), sizeof(T));
    out[i] = static_cast<double>(value);
  }
}

void write_header(GmshWriting& writing, const GmshPlannedSection& section) {
  writing.out.text(section.header);
  if (!section.header.ends_with('\n')) writing.out.text("\n");
}

// Iterates over the elements of an array at one time step.
class Values {
 public:
  Values(GmshWriting& writing, const GmshPlannedSection& section)
      : w_(writing),
        section_(section),
        array_(w_.info.schema.arrays[section.array]),
        left_(w_.info.array_elements(section.array)),
        shown_(section.components != 0 ? section.components : array_.components) {}

  std::span<const double> next() {
    if (at_ == loaded_) load();
    const std::size_t begin = at_++ * array_.components + section_.first_component;
    return std::span(values_).subspan(begin, shown_);
  }

 private:
  void load() {
    const std::uint64_t most = std::max<std::uint64_t>(1, kGmshPiece / array_.components);
    loaded_ = std::min(left_, most);
    if (loaded_ == 0) w_.fail(ErrorCode::corrupt, "an array is shorter than its mesh");
    raw_.resize(loaded_ * array_.components * scalar_bytes(array_.type));
    w_.mesh.read_array(section_.array, section_.step, first_, loaded_, raw_.data());
    values_.resize(loaded_ * array_.components);
    widen_numbers(array_.type, raw_, values_);
    first_ += loaded_;
    left_ -= loaded_;
    at_ = 0;
  }

  GmshWriting& w_;
  const GmshPlannedSection& section_;
  const ArrayInfo& array_;
  std::uint64_t first_ = 0, left_, at_ = 0, loaded_ = 0;
  std::size_t shown_;
  std::vector<std::byte> raw_;
  std::vector<double> values_;
};

}  // namespace

void widen_numbers(ScalarType type, const std::vector<std::byte>& in, std::vector<double>& out) {
  with_scalar(type, [&](auto zero) { widen_as<decltype(zero)>(in, out); });
}

void write_gmsh_view(GmshWriting& writing, const GmshPlannedSection& section) {
  const ArrayInfo& array = writing.info.schema.arrays[section.array];
  write_header(writing, section);
  std::vector<bool> covered(writing.info.schema.blocks.size());
  std::uint64_t nodes = 0;  // number of nodes per element, for $ElementNodeData
  for (std::uint32_t b = 0; b < covered.size(); ++b) {
    covered[b] = writing.info.schema.array_covers(section.array, b);
    if (covered[b] && writing.info.block_cells[b] > 0 && section.name == "ElementNodeData")
      nodes = writing.info.schema.blocks[b].nodes_per_cell;
  }
  if (section.name == "ElementNodeData" && (nodes == 0 || array.components % nodes != 0))
    writing.fail(ErrorCode::corrupt,
                 "the array does not have a value for each node of its elements");
  const bool points = array.location == Location::point;
  const std::uint64_t places = points ? writing.info.vertices : writing.cell_blocks.size();
  Values values(writing, section);
  for (std::uint64_t place = 0; place < places; ++place) {
    if (!points && !covered[writing.cell_blocks.get<std::uint32_t>(place)]) continue;
    writing.out.integer32(points ? writing.node_tags[place] : writing.element_tags[place]);
    if (nodes > 0) writing.out.integer32(static_cast<std::int64_t>(nodes));
    for (const double value : values.next()) writing.out.real(value);
    for (std::uint32_t i = 0; i < section.padding; ++i) writing.out.real(0);
    writing.out.end_line();
  }
  writing.out.end_of_data();
}

void write_gmsh_list(GmshWriting& writing, const GmshPlannedSection& section) {
  write_header(writing, section);
  const std::string& key = section.key;
  const bool by_vertex = writing.extras.find(key + "/vertices") != nullptr;
  const bool by_cell = writing.extras.find(key + "/cells") != nullptr;
  const auto places = writing.extras.integers(key + (by_vertex ? "/vertices"
                                                     : by_cell ? "/cells"
                                                               : "/tags"));
  const auto values = writing.extras.reals(key + "/values");
  std::vector<std::int64_t> counts;
  if (section.name == "ElementNodeData") counts = writing.extras.integers(key + "/counts");
  const auto sum = [&] {
    std::uint64_t all = 0;
    for (const std::int64_t n : counts) all += n > 0 ? static_cast<std::uint64_t>(n) : 0;
    return all;
  };
  const std::uint64_t nodes = counts.empty() ? places.size() : sum();
  const std::uint64_t components = nodes > 0 ? values.size() / nodes : 0;
  if ((!counts.empty() && counts.size() != places.size()) || components * nodes != values.size())
    writing.extras.fail(key + "/values", "does not have the same number of values for each entry");
  std::size_t next = 0;
  for (std::size_t e = 0; e < places.size(); ++e) {
    writing.out.integer32(by_vertex ? writing.node_tag(places[e])
                          : by_cell ? writing.element_tag(places[e])
                                    : places[e]);
    if (!counts.empty()) writing.out.integer32(counts[e]);
    const std::uint64_t of_entry =
        components *
        (counts.empty() ? 1 : static_cast<std::uint64_t>(std::max<std::int64_t>(counts[e], 0)));
    for (std::uint64_t i = 0; i < of_entry; ++i) writing.out.real(values[next++]);
    writing.out.end_line();
  }
  writing.out.end_of_data();
}

}  // namespace shm::converters
