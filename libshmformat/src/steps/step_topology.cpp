#include "steps/step_topology.h"

#include <algorithm>
#include <string>
#include <utility>

#include "base/errors.h"
#include "base/lists.h"
#include "codecs/registry.h"

namespace shm {

ElementNeeds needs_of_steps(const Schema& schema, bool digests) {
  ElementNeeds needs;
  for (const ArrayInfo& info : schema.arrays) {
    if (!info.per_step || !is_on_mesh(info.location)) continue;
    const bool of_points = info.location == Location::point;
    (of_points ? needs.vertices : needs.cells) = true;
    if (!digests) continue;
    const bool keeps = schema.order == Order::keep;
    if (of_points)
      needs.vertex_numbers = needs.vertex_numbers || keeps;
    else
      needs.cell_numbers =
          needs.cell_numbers || (keeps && schema.delay > 0) || !info.blocks.empty();
  }
  return needs;
}

void PackedNumbers::add(std::span<const std::uint64_t> numbers) {
  for (const std::uint64_t number : numbers) {
    bytes_.put_signed(static_cast<std::int64_t>(number - next_));
    next_ = number + 1;
  }
  count_ += numbers.size();
}

void PackedNumbers::get(std::vector<std::uint64_t>& numbers) const {
  numbers.resize(count_);
  ByteReader in(bytes_.bytes);
  std::uint64_t next = 0;
  for (std::uint64_t& number : numbers) {
    number = next + static_cast<std::uint64_t>(in.get_signed());
    next = number + 1;
  }
}

StepTopology::StepTopology(const Schema& schema, std::uint64_t most_bytes,
                           const ElementNeeds& needs, std::size_t most_kept, CellBytes cell_bytes)
    : schema_(&schema),
      most_bytes_(most_bytes),
      needs_(needs),
      most_kept_(most_kept),
      cell_bytes_(cell_bytes != nullptr
                      ? std::move(cell_bytes)
                      : std::make_shared<const std::vector<std::size_t>>(cell_data_bytes(schema))) {
}

bool StepTopology::uses(const container::GroupHeader& header, const container::StreamEntry& stream,
                        bool vertex_numbers) const {
  using container::StreamKind;
  const bool keep = schema_->order == Order::keep;
  const container::StreamEntry* const first = header.streams.data();
  switch (stream.kind) {
    case StreamKind::connectivity:
    case StreamKind::corner_order:
    case StreamKind::imports: return true;
    case StreamKind::cell_numbers: return needs_.cell_numbers && keep && schema_->delay > 0;
    case StreamKind::vertex_numbers:
      // The stream of vertex numbers is needed if the hexahedra of the segment are coded by vertex
      // numbers. The header of a group without cells does not show how hexahedra are coded, so the
      // stream is needed in that case, too.
      return keep && (vertex_numbers || header.cells == 0 ||
                      (first->kind == StreamKind::connectivity &&
                       first->codec == container::Codec::replay));
    default: return false;
  }
}

void StepTopology::add_group(std::uint32_t segment, const container::GroupHeader& header,
                             std::span<const std::span<const std::byte>> streams) {
  Group& group = groups_.emplace_back();
  group.segment = segment;
  group.header = header;
  group.header.streams.clear();
  cells_in_all_ += header.cells;
  most_active_ = std::max(most_active_, header.max_active_vertices);
  vertices_in_all_ += header.vertices + header.imported_vertices;
  for (std::size_t s = 0; s < header.streams.size() && s < streams.size(); ++s) {
    if (!needs_.any() || !uses(header, header.streams[s])) continue;
    group.header.streams.push_back(header.streams[s]);
    group.header.streams.back().bytes = streams[s].size();
    group.streams.insert(group.streams.end(), streams[s].begin(), streams[s].end());
  }
  group.header.streams.shrink_to_fit();
  group.streams.shrink_to_fit();
}

void StepTopology::add_vertex_numbers(std::span<const std::uint64_t> numbers) {
  while (keeps_numbers_ && needs_.vertex_numbers && !numbers.empty() &&
         next_numbered_ < groups_.size()) {
    Group& group = groups_[next_numbered_];
    const auto left =
        static_cast<std::size_t>(group.header.vertices) - group.vertex_numbers.count();
    if (left == 0) {
      ++next_numbered_;
      continue;
    }
    const auto some = numbers.first(std::min(left, numbers.size()));
    number_bytes_ -= group.vertex_numbers.bytes();
    group.vertex_numbers.add(some);
    number_bytes_ += group.vertex_numbers.bytes();
    numbers = numbers.subspan(some.size());
    keeps_numbers_ = number_bytes_ <= most_kept_;
  }
  if (keeps_numbers_ || number_bytes_ == 0) return;
  for (Group& group : groups_) group.vertex_numbers = {};
  number_bytes_ = 0;
}

Result<std::span<const std::uint64_t>> StepTopology::vertex_numbers(std::size_t group) {
  if (has_added_numbers()) {
    groups_[group].vertex_numbers.get(numbers_);
    return std::span<const std::uint64_t>(numbers_);
  }
  const auto all = elements(group);
  if (!all) return all.error();
  return std::span<const std::uint64_t>((*all)->vertex_numbers);
}

void add_group(const EncodedGroup& group, StepTopology& topology) {
  topology.add_group(
      group.segment, group.header,
      std::vector<std::span<const std::byte>>(group.streams.begin(), group.streams.end()));
  std::vector<std::uint64_t> numbers;
  if (topology.needs().vertex_numbers)
    for (const EncodedGroup::Vertex& vertex : group.own) numbers.push_back(vertex.number);
  topology.add_vertex_numbers(numbers);
}

bool StepTopology::has_neighbourhoods(std::size_t group) const {
  return container::connectivity_of(groups_[group].header) != container::Codec::patterns;
}

Result<std::uint64_t> StepTopology::count(std::uint32_t array, std::size_t group) {
  if (schema_->arrays[array].location == Location::point) return groups_[group].header.vertices;
  if (schema_->arrays[array].blocks.empty()) return groups_[group].header.cells;
  if (!groups_[group].counted)
    if (auto status = elements(group); !status) return status.error();
  std::uint64_t cells = 0;
  for (const auto& [block, count] : groups_[group].block_cells)
    if (schema_->array_covers(array, block)) cells += count;
  return cells;
}

Result<const GroupElements*> StepTopology::elements(std::size_t group) {
  if (group < kept_.size()) return &kept_[group];
  const std::uint32_t segment = groups_[group].segment;
  if (has_elements_ && group + 1 == next_) return &elements_;
  if (!decoder_ || next_ > group || groups_[next_].segment != segment ||
      groups_[next_ - 1].segment != segment) {
    next_ = group;  // decode again from the first group of this segment on
    while (next_ > 0 && groups_[next_ - 1].segment == segment) --next_;
  }
  while (next_ <= group)
    if (auto status = decode_next(); !status) return status.error();
  return group < kept_.size() ? &kept_[group] : &elements_;
}

Result<void> StepTopology::decode_next() {
  const std::size_t number = next_++;
  Group& group = groups_[number];
  if (number == 0 || groups_[number - 1].segment != group.segment) decoder_.reset();
  const auto status = decode(group);
  has_elements_ = static_cast<bool>(status);
  if (!status) {
    decoder_.reset();
    return Error{status.error().code,
                 "group " + std::to_string(number) + ": " + status.error().detail, "step values"};
  }
  if (!std::exchange(group.counted, true))
    for (std::uint32_t block : elements_.cells.blocks) ++group.block_cells[block];
  if (keeps_ && number == kept_.size()) keep();
  return {};
}

Result<void> StepTopology::decode(const Group& group) {
  elements_.vertices.clear();
  elements_.cells.clear();
  elements_.vertex_numbers.clear();
  elements_.cell_numbers.clear();
  if (!decoder_) {
    DecodedParts parts = DecodedParts::without_values();
    // If the order is not Order::keep, the segment's own vertices are numbered by their positions.
    // Callers do not need the numbers of imported vertices.
    parts.vertex_numbers = decodes_numbers() && schema_->order == Order::keep;
    parts.imported_vertices = true;
    parts.vertex_neighbourhoods = needs_.vertices;
    parts.cell_neighbourhoods = needs_.cells;
    auto made = make_group_decoder(
        *schema_, {group.segment, group.header.first_cell, group.header.first_vertex}, parts,
        cell_bytes_, group.header);
    if (!made) return made.error();
    decoder_ = std::move(*made);
  }
  if (auto status = decoder_->begin_group(group.header, codec_of_cells(group.header)); !status)
    return status;
  auto streams = std::span<const std::byte>(group.streams);
  for (const container::StreamEntry& entry : group.header.streams) {
    const auto bytes = streams.first(static_cast<std::size_t>(entry.bytes));
    if (uses(group.header, entry, decodes_numbers()))
      if (auto status = decoder_->begin_stream(entry, bytes); !status) return status;
    streams = streams.subspan(bytes.size());
  }
  if (auto status = decoder_->end_streams(); !status) return status;
  for (bool first = true; first || !decoder_->is_complete(); first = false) {
    DecodedBlock block;
    if (auto status = decoder_->next_block(block); !status) return status;
    if (!first) {  // Each block begins a new tile.
      elements_.vertices.tile_begin.push_back(elements_.vertices.items.size());
      elements_.cells.tile_begin.push_back(elements_.cells.items.size());
    }
    add(block.mesh);
    if (elements_.bytes() > most_bytes_)
      return over_limit("the neighbourhoods of its elements take more than the limit of " +
                        std::to_string(most_bytes_) + " bytes");
  }
  elements_.slots = decoder_->slots();
  const auto end = decoder_->end_group();
  return end ? Result<void>() : end.error();
}

void StepTopology::add(const MeshBlock& block) {
  const auto append = [](auto& to, const auto& from) {
    expect_more(to, from.size());
    to.insert(to.end(), from.begin(), from.end());
  };
  const GroupDecoder::Items items = decoder_->items();
  if (needs_.vertices) {
    append(elements_.vertices.items, items.vertices);
    if (decoder_->start().segment > 0) append(elements_.vertices.blocks, block.imported);
  }
  if (needs_.cells) append(elements_.cells.items, items.cells);
  if (needs_.cells || needs_.cell_numbers) append(elements_.cells.blocks, block.cell_blocks);
  if (needs_.cell_numbers) append(elements_.cell_numbers, block.cell_numbers);
  if (!decodes_numbers()) return;
  expect_more(elements_.vertex_numbers, block.vertex_count());
  for (std::size_t v = 0; v < block.vertex_count(); ++v)
    if (block.imported[v] == 0) elements_.vertex_numbers.push_back(block.vertex_numbers[v]);
}

void StepTopology::release() {
  decoder_.reset();
  elements_ = {};
  has_elements_ = false;
}

/// Returns a lower bound on the size in bytes of the elements of all groups.
std::uint64_t StepTopology::expected_bytes() const {
  const std::uint64_t cell = (needs_.cells ? sizeof(Neighbourhood) : 0) +
                             (needs_.cell_numbers ? sizeof(std::uint64_t) : 0);
  const std::uint64_t vertex = (needs_.vertices ? sizeof(Neighbourhood) : 0) +
                               (needs_.vertex_numbers ? sizeof(std::uint64_t) : 0);
  std::uint64_t bytes = 0;
  for (const Group& group : groups_) {
    bytes += group.header.cells * cell;
    // The header of a damaged group may state a number of vertices for which the multiplication by
    // `vertex` would overflow.
    if (vertex > 0 && group.header.vertices > most_kept_) return group.header.vertices;
    bytes += group.header.vertices * vertex;
    if (bytes > most_kept_) break;
  }
  return bytes;
}

/// Stores the elements of the group. Frees all stored elements if the elements of all groups exceed
/// the memory limit, or are expected to exceed it.
void StepTopology::keep() {
  if (kept_.empty()) keeps_ = expected_bytes() <= most_kept_;
  kept_bytes_ += elements_.bytes();
  keeps_ = keeps_ && kept_bytes_ <= most_kept_;
  if (keeps_) {
    kept_.push_back(std::move(elements_));
    has_elements_ = false;
  } else {
    let_go(kept_);
  }
}

}  // namespace shm
