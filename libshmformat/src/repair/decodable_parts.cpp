#include "repair/decodable_parts.h"

#include <algorithm>
#include <iterator>
#include <map>
#include <span>
#include <tuple>
#include <unordered_map>
#include <utility>

namespace shm {
namespace {

using container::ChunkKind;
using container::FoundChunk;
using container::IndexEntry;

class Gatherer {
 public:
  explicit Gatherer(const FoundChunks& found) : found_(&found) {}
  DecodableParts run();

 private:
  const Schema& schema() const { return *found_->schema(); }

  void gather_totals();
  void gather_by_index();
  void gather_by_numbers();
  void add_group(const FoundGroup& group, std::uint64_t number);
  std::uint64_t lost_before(const FoundGroup& group, std::size_t& next_chunk) const;
  void gather_values();
  void list_partial();
  bool covers_all(std::uint32_t array) const;
  std::uint64_t expected_parts(std::uint32_t array, std::size_t segment);
  bool is_complete(std::span<const FoundPart* const> run, std::size_t segment);
  bool touches_gap(std::span<const FoundPart* const> run) const;
  void gather_step(std::span<const FoundPart* const> of_step);
  std::size_t segment_of(std::size_t group) const;
  /// Returns the index in out_.groups of the group with this number. Returns the number of groups
  /// if the group cannot be decoded.
  std::size_t place_of(std::uint64_t number) const;
  std::size_t place_of(const container::StepEntry& part) const;
  std::uint64_t most_elements(std::uint32_t array, std::uint32_t group) const;

  const FoundChunks* found_;
  DecodableParts out_;
  std::optional<std::uint32_t> segment_;  // segment of the previous group
  // True if the rest of the current segment cannot be decoded.
  bool broken_ = false;

  // Number of the first group whose number in the file is uncertain. Used only if the file has no
  // index.
  std::optional<std::uint64_t> first_unsure_;
  // Contains (array, group index) if the array does not cover all blocks but certainly has elements
  // in the group.
  std::set<std::pair<std::uint32_t, std::size_t>> partial_;
  // Number of parts expected for each pair of array and segment.
  std::map<std::pair<std::uint32_t, std::size_t>, std::uint64_t> expected_;

  // For each segment, the most recent step of the current array that can be read.
  std::unordered_map<std::size_t, std::uint64_t> last_step_;
  // The same, but only of the steps that refer to no other step.
  std::unordered_map<std::size_t, std::uint64_t> base_step_;
  // For each group, how many of the groups before it have vertices, and how many have cells.
  std::vector<std::uint64_t> groups_with_vertices_, groups_with_cells_;
};

DecodableParts Gatherer::run() {
  out_.beginning = found_->beginning();
  out_.has_index = found_->index().has_value();
  out_.index_offset = found_->index_offset();
  if (out_.has_index)
    gather_by_index();
  else
    gather_by_numbers();
  out_.first_group.push_back(out_.groups.size());
  gather_totals();
  for (const FoundChunk& chunk : found_->chunks()) {
    IndexEntry entry;
    entry.kind = chunk.header.kind;
    entry.offset = chunk.offset;
    entry.bytes = chunk.bytes();
    if (chunk.whole && chunk.is(ChunkKind::extra)) out_.extras.push_back(entry);
    if (chunk.whole && chunk.is(ChunkKind::step_times)) out_.step_times.push_back(entry);
  }
  gather_values();
  return std::move(out_);
}

void Gatherer::gather_totals() {
  if (found_->index()) {
    out_.totals = *found_->index();
    out_.totals.entries.clear();
  }
  out_.totals.block_cells.resize(schema().blocks.size());
  for (const FoundGroup& group : found_->groups()) {
    if (!group.readable || out_.has_index) continue;
    out_.totals.cells = std::max(out_.totals.cells, group.end_cell());
    out_.totals.vertices =
        std::max(out_.totals.vertices, group.entry.first_vertex + group.entry.vertices);
  }
}

// --- groups

void Gatherer::add_group(const FoundGroup& group, std::uint64_t number) {
  if (out_.groups.empty() || out_.groups.back().segment != group.entry.segment) {
    out_.first_group.push_back(out_.groups.size());
    out_.lost_arrays.emplace_back();
    out_.whole.push_back(true);
  }
  out_.groups.push_back(group.entry);
  out_.group_numbers.push_back(number);
  if (group.lost_arrays.empty()) return;
  std::vector<std::uint32_t> lost;
  std::set_union(out_.lost_arrays.back().begin(), out_.lost_arrays.back().end(),
                 group.lost_arrays.begin(), group.lost_arrays.end(), std::back_inserter(lost));
  out_.lost_arrays.back() = std::move(lost);
}

void Gatherer::gather_by_index() {
  const auto& groups = found_->groups();
  std::size_t next = 0;
  std::uint64_t number = 0;
  const auto& entries = found_->index()->entries;
  for (std::uint32_t i = 0; i < entries.size(); ++i) {
    const IndexEntry& listed = entries[i];
    if (listed.kind != static_cast<std::uint8_t>(ChunkKind::group)) continue;
    const bool begins = !segment_ || *segment_ < listed.segment;
    if (begins) broken_ = false;
    segment_ = listed.segment;
    while (next < groups.size() && groups[next].sequence < i) ++next;
    const bool there = next < groups.size() && groups[next].sequence == i &&
                       groups[next].has_mesh && groups[next].entry.segment == listed.segment &&
                       groups[next].entry.first_cell == listed.first_cell &&
                       groups[next].entry.cells == listed.cells &&
                       groups[next].entry.first_vertex == listed.first_vertex &&
                       groups[next].entry.vertices == listed.vertices;
    // The groups that come after a lost group in the same segment cannot be decoded.
    if (!there) broken_ = true;
    if (!broken_) add_group(groups[next], number);
    if (broken_ && !out_.groups.empty() && out_.groups.back().segment == listed.segment)
      out_.whole.back() = false;
    ++number;
  }
}

/// Returns the number of lost chunks between the previous group and `group`. `next_chunk` is an
/// index in the list of found chunks: the call moves it from the chunk after the previous group to
/// the chunk after `group`.
std::uint64_t Gatherer::lost_before(const FoundGroup& group, std::size_t& next_chunk) const {
  const auto& chunks = found_->chunks();
  // The search starts at chunk 1, since chunk 0 is the schema, even if it is lost.
  std::uint64_t next =
                    next_chunk == 0 ? 1 : std::uint64_t{chunks[next_chunk - 1].header.sequence} + 1,
                lost = 0;
  for (;; ++next_chunk) {
    const std::uint64_t sequence = chunks[next_chunk].header.sequence;
    lost += sequence - std::min(sequence, next);
    next = sequence + 1;
    if (sequence == group.sequence) break;
  }
  ++next_chunk;
  return lost;
}

/// Collects the groups of a file without an index. Lost chunks may have contained groups or extras.
/// It may therefore be uncertain which number a group has in the file, and whether the first group
/// found of a segment is really the first group of that segment. Both are certain in two cases: no
/// chunk is lost before the group, or the number of lost chunks equals the number of lost segments.
/// (Each lost segment then has exactly one group.) The number is also certain if a single chunk is
/// lost and cells or vertices are missing, because that chunk must then have contained a group.
void Gatherer::gather_by_numbers() {
  std::size_t next_chunk = 0;
  std::uint64_t number = 0, end_cell = 0, end_vertex = 0;
  bool readable = true;  // true: the previous group is readable
  for (const FoundGroup& group : found_->groups()) {
    const IndexEntry& entry = group.entry;
    std::uint64_t lost = lost_before(group, next_chunk);
    // If no cells or vertices are missing, the lost chunks are not groups.
    if (readable && group.readable && entry.first_cell == end_cell &&
        entry.first_vertex == end_vertex)
      lost = 0;
    const bool begins = !segment_ || *segment_ != entry.segment;
    const std::uint64_t segments =
        !segment_ ? entry.segment
                  : std::uint64_t{entry.segment} - std::min(entry.segment, *segment_ + 1);
    if (begins) {
      broken_ = (segment_ && entry.segment < *segment_) || lost != segments;
      if (lost > segments && !out_.whole.empty()) out_.whole.back() = false;
    } else if (lost > 0) {
      broken_ = true;
    }
    const bool is_group = lost == 1 && readable && group.readable &&
                          (entry.first_cell > end_cell || entry.first_vertex > end_vertex);
    if (lost > 0 && !(begins && lost == segments) && !is_group && !first_unsure_)
      first_unsure_ = number;
    number += lost;
    segment_ = entry.segment;
    if (!group.has_mesh) broken_ = true;
    if (!broken_) add_group(group, number);
    if (broken_ && !out_.groups.empty() && out_.groups.back().segment == entry.segment)
      out_.whole.back() = false;
    ++number;
    readable = group.readable;
    end_cell = group.end_cell();
    end_vertex = entry.first_vertex + entry.vertices;
  }
}

// --- step values

bool Gatherer::covers_all(std::uint32_t array) const {
  const ArrayInfo& info = schema().arrays[array];
  return info.location != Location::cell || info.blocks.empty();
}

std::size_t Gatherer::place_of(std::uint64_t number) const {
  const auto& numbers = out_.group_numbers;
  const auto found = std::lower_bound(numbers.begin(), numbers.end(), number);
  return found != numbers.end() && *found == number
             ? static_cast<std::size_t>(found - numbers.begin())
             : numbers.size();
}

std::size_t Gatherer::segment_of(std::size_t group) const {
  const auto& first = out_.first_group;
  return static_cast<std::size_t>(std::upper_bound(first.begin(), first.end(), group) -
                                  first.begin()) -
         1;
}

/// Returns the group whose segment has the values of a part. Values that are neither on points nor
/// on cells do not need group 0. If it is lost, they belong to the first decodable group.
std::size_t Gatherer::place_of(const container::StepEntry& part) const {
  return is_on_mesh(schema().arrays[part.array].location) ? place_of(part.group) : 0;
}

/// Returns the number of elements of the array in a group of the file. For an array that does not
/// cover all blocks, returns the number of cells of the group.
std::uint64_t Gatherer::most_elements(std::uint32_t array, std::uint32_t group) const {
  const ArrayInfo& info = schema().arrays[array];
  if (!is_on_mesh(info.location)) return group == 0 ? info.elements : 0;
  const IndexEntry& entry = out_.groups[place_of(group)];
  return info.location == Location::point ? entry.vertices : entry.cells;
}

/// Lists the groups that have elements of arrays that do not cover all blocks.
void Gatherer::list_partial() {
  const auto add = [&](const container::StepEntry& part) {
    const std::size_t place = place_of(part.group);
    if (place == out_.groups.size()) return;
    for (std::uint64_t a = part.array; a - part.array < part.arrays; ++a) {
      const auto array = static_cast<std::uint32_t>(a);
      if (a >= schema().arrays.size() || covers_all(array)) continue;
      if (partial_.insert({array, place}).second) ++expected_[{array, segment_of(place)}];
    }
  };
  if (found_->index()) {
    for (const IndexEntry& listed : found_->index()->entries)
      for (const container::StepEntry& part : listed.parts) add(part);
  } else {
    for (const FoundPart& part : found_->parts()) add(part.values);
  }
}

std::uint64_t Gatherer::expected_parts(std::uint32_t array, std::size_t segment) {
  if (!covers_all(array)) return expected_[{array, segment}];
  if (!is_on_mesh(schema().arrays[array].location)) return 1;
  const auto& counts = schema().arrays[array].location == Location::point ? groups_with_vertices_
                                                                          : groups_with_cells_;
  return counts[out_.first_group[segment + 1]] - counts[out_.first_group[segment]];
}

/// Returns true if a chunk is lost between the parts in `run`, directly before the first part or
/// directly after the last part. The lost chunk may have contained another part of the same array,
/// step and segment.
bool Gatherer::touches_gap(std::span<const FoundPart* const> run) const {
  const auto& chunks = found_->chunks();
  const auto there = [&](std::uint32_t sequence) {
    const auto found = std::lower_bound(chunks.begin(), chunks.end(), sequence,
                                        [](const FoundChunk& chunk, std::uint32_t number) {
                                          return chunk.header.sequence < number;
                                        });
    return found != chunks.end() && found->header.sequence == sequence;
  };
  for (std::size_t i = 1; i < run.size(); ++i)
    if (run[i]->sequence > run[i - 1]->sequence + 1) return true;
  return !there(run.front()->sequence - 1) ||
         !(there(run.back()->sequence + 1) ||
           run.back()->sequence == chunks.back().header.sequence);
}

/// Returns true if `run`, which contains parts of one array at one step, contains all such parts of
/// the segment.
bool Gatherer::is_complete(std::span<const FoundPart* const> run, std::size_t segment) {
  const std::uint32_t array = run[0]->values.array;
  if (run.size() != expected_parts(array, segment)) return false;
  for (std::size_t i = 0; i < run.size(); ++i) {
    const std::uint64_t most = most_elements(array, run[i]->values.group);
    if (i > 0 && run[i]->values.group == run[i - 1]->values.group) return false;
    if (run[i]->values.count > most || (covers_all(array) && run[i]->values.count != most))
      return false;
  }
  // A bundle always contains the whole array.
  return out_.has_index || covers_all(array) || run[0]->values.codec == container::kBundleCodec ||
         !touches_gap(run);
}

/// Appends a part for each pair of an array and a step of a bundle.
void add_pairs(const FoundPart& bundle, std::vector<FoundPart>& parts) {
  for (std::uint64_t s = 0; s < bundle.values.steps; ++s)
    for (std::uint32_t a = 0; a < bundle.values.arrays; ++a) {
      FoundPart& part = parts.emplace_back(bundle);
      part.values.array += a;
      part.values.step += s;
      part.values.arrays = 1;
      part.values.steps = 1;
      part.reference_step = part.values.step;
    }
}

void Gatherer::gather_values() {
  if (found_->index())
    for (const IndexEntry& listed : found_->index()->entries)
      for (const container::StepEntry& part : listed.parts)
        for (std::uint32_t a = 0; a < part.arrays; ++a)
          for (std::uint64_t s = 0; s < part.steps; ++s)
            out_.listed_steps.insert({part.array + a, part.step + s});
  list_partial();
  groups_with_vertices_.assign(1, 0);
  groups_with_cells_.assign(1, 0);
  for (const IndexEntry& group : out_.groups) {
    groups_with_vertices_.push_back(groups_with_vertices_.back() + (group.vertices > 0 ? 1 : 0));
    groups_with_cells_.push_back(groups_with_cells_.back() + (group.cells > 0 ? 1 : 0));
  }
  std::vector<FoundPart> of_bundles;
  for (const FoundPart& part : found_->parts())
    if (part.values.codec == container::kBundleCodec) add_pairs(part, of_bundles);
  std::vector<const FoundPart*> parts;
  const auto add = [&](const FoundPart& part) {
    if (part.values.array < schema().arrays.size() && schema().arrays[part.values.array].per_step)
      parts.push_back(&part);
  };
  for (const FoundPart& part : found_->parts())
    if (part.values.codec != container::kBundleCodec) add(part);
  for (const FoundPart& part : of_bundles) add(part);
  const auto key = [](const FoundPart* part) {
    return std::tuple(part->values.array, part->values.step, part->values.group);
  };
  std::stable_sort(parts.begin(), parts.end(),
                   [&](const auto* a, const auto* b) { return key(a) < key(b); });
  for (std::size_t begin = 0, end = 0; begin < parts.size(); begin = end) {
    const container::StepEntry& first = parts[begin]->values;
    while (end < parts.size() && parts[end]->values.array == first.array &&
           parts[end]->values.step == first.step)
      ++end;
    gather_step(std::span(parts).subspan(begin, end - begin));
  }
}

/// Adds the decodable parts of one array at one step. `of_step` contains all undamaged parts of the
/// array at this step, in the order of their groups.
void Gatherer::gather_step(std::span<const FoundPart* const> of_step) {
  DecodableParts::Step step;
  step.array = of_step[0]->values.array;
  step.step = of_step[0]->values.step;
  const DecodableParts::Step* before =
      !out_.steps.empty() && out_.steps.back().array == step.array ? &out_.steps.back() : nullptr;
  if (before == nullptr) {
    last_step_.clear();
    base_step_.clear();
  }
  step.reference = of_step[0]->values.reference;
  const std::uint64_t reference_step = of_step[0]->reference_step;
  const bool on_mesh = is_on_mesh(schema().arrays[step.array].location);
  const std::uint64_t unsure = first_unsure_.value_or(~std::uint64_t{0});
  std::uint64_t first = 0;
  for (std::size_t i = 0; i < of_step.size();) {
    const std::size_t place = place_of(of_step[i]->values);
    if (place == out_.groups.size() || (on_mesh && of_step[i]->values.group >= unsure)) {
      ++i;
      continue;
    }
    const std::size_t segment = segment_of(place);
    std::size_t end = i;
    bool follows = true;
    for (; end < of_step.size(); ++end) {
      const std::size_t other = place_of(of_step[end]->values);
      if (other == out_.groups.size() || other >= out_.first_group[segment + 1]) break;
      follows = follows && of_step[end]->values.reference == step.reference &&
                of_step[end]->reference_step == reference_step;
    }
    const auto run = of_step.subspan(i, end - i);
    i = end;
    // The segment needs the values of the step to which its parts refer.
    if (step.reference != StepReference::nothing) {
      const auto& decodable = step.reference == StepReference::base ? base_step_ : last_step_;
      const auto found = decodable.find(segment);
      follows = follows && found != decodable.end() && found->second == reference_step;
    }
    if (!container::is_key(step.reference))
      follows = follows && before != nullptr && before->step == reference_step;
    if (!follows || !is_complete(run, segment)) continue;
    last_step_[segment] = step.step;
    if (step.reference == StepReference::nothing) base_step_[segment] = step.step;
    for (const FoundPart* part : run) {
      container::StepEntry values = part->values;
      values.group = static_cast<std::uint32_t>(place_of(values));
      values.first = first;
      first += values.count;
      step.parts.push_back({part->offset, part->bytes, values});
    }
  }
  if (!step.parts.empty()) out_.steps.push_back(std::move(step));
}

}  // namespace

DecodableParts DecodableParts::of(const FoundChunks& found) { return Gatherer(found).run(); }

}  // namespace shm
