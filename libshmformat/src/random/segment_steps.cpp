#include "random/segment_steps.h"

#include <algorithm>
#include <string>
#include <utility>

#include "base/errors.h"
#include "steps/step_memory.h"

namespace shm {
namespace {

// Limits for reading several steps together: at most kMostSteps steps with at most kMostComponents
// components in total. The limits are necessary because each step is decoded by its own column (the
// decoder of an array), which needs memory.
constexpr std::size_t kMostSteps = 8, kMostComponents = 32;

Error at_chunk(Error error, std::uint64_t offset) {
  error.offset = offset;
  return error;
}

}  // namespace

const BundleChunk* HeldBundles::find(std::uint64_t offset) {
  const auto found = std::find_if(bundles_.begin(), bundles_.end(),
                                  [&](const auto& it) { return it.first == offset; });
  if (found == bundles_.end()) return nullptr;
  std::rotate(found, found + 1, bundles_.end());
  return &bundles_.back().second;
}

const BundleChunk* HeldBundles::keep(std::uint64_t offset, BundleChunk bundle) {
  if (bundles_.size() == kMost) bundles_.erase(bundles_.begin());
  bundles_.emplace_back(offset, std::move(bundle));
  return &bundles_.back().second;
}

SegmentSteps::SegmentSteps(IndexedFile& file, const StepIndex& index, StepReference most,
                           std::uint32_t array, std::size_t segment, std::size_t wanted,
                           HeldSteps& held, HeldBundles& bundles)
    : file_(&file),
      index_(&index),
      most_(most),
      array_(array),
      segment_(segment),
      chain_(index.chain(array, wanted)),
      held_(&held),
      bundles_(&bundles) {
  if (!held.at) return;
  const auto at = std::find(chain_.begin(), chain_.end(), *held.at);
  if (at != chain_.end()) from_ = static_cast<std::size_t>(at - chain_.begin()) + 1;
}

/// Returns the number of the part's group in the file. If the file is damaged, parts of an array
/// that is neither on points nor on cells may be listed with another group than 0.
std::uint64_t SegmentSteps::group_number(const StepIndex::Part& part) const {
  return is_on_mesh(info().location) ? file_->group_number(part.group) : 0;
}

/// Returns true if decoding the step needs the mesh. If one part of the step needs the mesh, all
/// parts need it, because the same decoder decodes one part after the other and keeps its state.
bool SegmentSteps::told_by_mesh(std::size_t step) const {
  const auto parts = parts_of(step);
  return StepParts::may_need_elements(info()) &&
         std::any_of(parts.begin(), parts.end(),
                     [](const StepIndex::Part& part) { return needs_neighbours(part.codec); });
}

bool SegmentSteps::needs_mesh() const {
  return std::any_of(chain_.begin() + static_cast<std::ptrdiff_t>(from_), chain_.end(),
                     [&](std::size_t step) { return told_by_mesh(step); });
}

std::uint64_t SegmentSteps::elements() const {
  std::uint64_t elements = 0;
  for (const StepIndex::Part& part : parts_of(wanted())) elements += part.count;
  return elements;
}

Result<std::vector<std::byte>> SegmentSteps::read_next(StepElements* mesh) {
  if (!std::exchange(begun_, true))
    if (auto status = read_earlier_passes(mesh); !status) return status.error();
  const std::size_t nth = next_++;
  if (pass_.from == pass_.end) {  // The values of the wanted step are already in held_.
    const StepIndex::Part& part = parts_of(wanted())[nth];
    const std::size_t stride = scalar_bytes(info().type) * info().components;
    const auto values = held_->last.read((part.first - parts_of(wanted())[0].first) * stride,
                                         static_cast<std::size_t>(part.count * stride));
    if (!values) return values.error();
    return std::vector<std::byte>(values->begin(), values->end());
  }
  if (auto status = read_group(nth, mesh); !status) return status.error();
  if (at_end() && most_ != StepReference::nothing) held_->at = wanted();
  return std::move(values_);
}

/// Returns true if the step has the same groups as the wanted step. If not, the stored values of
/// the step cannot be used as reference values.
bool SegmentSteps::has_same_groups(std::size_t step) const {
  const auto of_held = parts_of(step), of_wanted = parts_of(wanted());
  return std::equal(of_held.begin(), of_held.end(), of_wanted.begin(), of_wanted.end(),
                    [](const StepIndex::Part& a, const StepIndex::Part& b) {
                      return a.group == b.group && a.count == b.count;
                    });
}

/// Reads all steps before the wanted step, several steps in each pass. Begins the final pass, which
/// contains the wanted step, but does not read its groups.
Result<void> SegmentSteps::read_earlier_passes(StepElements* mesh) {
  if (from_ > 0 && !has_same_groups(chain_[from_ - 1]))
    return file_->wrong_index("steps of an array have different groups");
  // The memory limit determines the number of steps per pass. A step is assumed to need kKeptOfEach
  // bytes per component and per active vertex or cell.
  constexpr std::uint64_t kKeptOfEach = 40;
  const std::uint64_t active = mesh == nullptr ? 0 : mesh->most_active();
  const std::uint64_t room = most_kept() / (kKeptOfEach * info().components * (active + 1));
  const auto together = static_cast<std::size_t>(std::clamp<std::uint64_t>(
      std::min<std::uint64_t>(kMostComponents / info().components, room), 1, kMostSteps));
  const std::size_t groups = parts_of(wanted()).size();
  for (pass_.from = from_;; pass_.from = pass_.end) {
    pass_.end = std::min(pass_.from + together, chain_.size());
    begin_pass();
    if (pass_.end == chain_.size()) return {};
    for (std::size_t nth = 0; nth < groups; ++nth)
      if (auto status = read_group(nth, mesh); !status) return status;
  }
}

/// Returns the memory limit in bytes for all decoders of a pass together. Each step of the pass has
/// one decoder.
std::uint64_t SegmentSteps::most_kept() const {
  return most_kept_of_steps(file_->limits().max_column_bytes, file_->source().size());
}

void SegmentSteps::begin_pass() {
  columns_.clear();
  by_mesh_.clear();
  for (std::size_t i = pass_.from; i < pass_.end; ++i) {
    columns_.emplace_back().emplace(file_->schema(), file_->limits().max_group_bytes, array_,
                                    most_kept() / (pass_.end - pass_.from));
    by_mesh_.push_back(told_by_mesh(chain_[i]));
  }
  // Until the pass ends, held_ contains values of different steps in different groups, so it does
  // not represent a single step.
  if (pass_.from < pass_.end) held_->at.reset();
}

/// Returns the elements of the group to which a part belongs.
Result<ColumnElements> SegmentSteps::elements_of(StepElements& mesh,
                                                 const StepIndex::Part& part) const {
  const std::size_t group = part.group - file_->first_group(segment_);
  const auto count = mesh.count(array_, group);
  if (!count) return at_chunk(count.error(), file_->groups()[part.group].offset);
  if (*count != part.count)
    return corrupt("the number of values differs from the number of elements", "step values",
                   part.offset);
  auto elements = mesh.elements(array_, group);
  if (!elements) return at_chunk(elements.error(), file_->groups()[part.group].offset);
  return elements;
}

/// Decodes the values of the nth group at all steps of the pass.
Result<void> SegmentSteps::read_group(std::size_t nth, StepElements* mesh) {
  const StepIndex::Part& part = parts_of(wanted())[nth];
  ColumnElements elements;
  if (std::find(by_mesh_.begin(), by_mesh_.end(), true) != by_mesh_.end()) {
    const auto of_group = elements_of(*mesh, part);
    if (!of_group) return of_group.error();
    elements = *of_group;
  }
  const std::size_t stride = scalar_bytes(info().type) * info().components;
  const std::uint64_t offset = (part.first - parts_of(wanted())[0].first) * stride;
  const auto size = static_cast<std::size_t>(part.count) * stride;
  // Replaces `values` by the held values, or by nothing if there are none.
  const auto take_held = [&](StepBytes& from, std::vector<std::byte>& values) -> Result<void> {
    values.clear();
    if (from.size() < offset + size) return {};
    const auto held = from.read(offset, size);
    if (!held) return held.error();
    values.assign(held->begin(), held->end());
    return {};
  };
  if (auto status = take_held(held_->last, values_); !status) return status;
  if (auto status = take_held(held_->one_back, one_back_); !status) return status;
  for (std::size_t i = pass_.from; i < pass_.end; ++i)
    if (auto status = read_step(i, nth, elements.items != nullptr ? &elements : nullptr); !status)
      return status;
  return hold(offset);
}

/// Decodes the nth group at the step chain_[i].
Result<void> SegmentSteps::read_step(std::size_t i, std::size_t nth,
                                     const ColumnElements* elements) {
  const auto parts = parts_of(chain_[i]);
  const StepIndex::Part& expected = parts_of(wanted())[nth];
  if (nth >= parts.size() || parts[nth].group != expected.group ||
      parts[nth].count != expected.count)
    return file_->wrong_index("steps of an array have different groups");
  two_back_ = std::exchange(one_back_, std::exchange(values_, {}));
  auto values = decode(i, parts[nth], by_mesh_[i - pass_.from] ? elements : nullptr);
  if (!values) return at_chunk(values.error(), parts[nth].offset);
  values_ = std::move(*values);
  return {};
}

Result<std::vector<std::byte>> SegmentSteps::decode(std::size_t i, const StepIndex::Part& part,
                                                    const ColumnElements* elements) {
  if (part.codec == Codec::bundle)
    if (const BundleChunk* bundle = bundles_->find(part.offset)) return values_in(*bundle, i, part);
  container::IndexEntry entry;
  entry.kind = static_cast<std::uint8_t>(container::ChunkKind::step_values);
  entry.offset = part.offset;
  entry.bytes = part.bytes;
  const auto payload = file_->read_chunk_of_parts(entry);
  if (!payload) return payload.error();
  ByteReader in(payload->bytes);
  std::vector<container::StepPart> parts;
  const bool known = container::get(in, parts, payload->version, payload->bytes.size());
  if (known && part.codec == Codec::bundle && parts[0].header.codec == Codec::bundle) {
    auto bundle = BundleChunk::read(file_->schema(), parts, in.get_bytes(parts[0].bytes));
    if (!bundle) return bundle.error();
    return values_in(*bundles_->keep(part.offset, std::move(*bundle)), i, part);
  }
  const auto found = std::find_if(parts.begin(), parts.end(), [&](const auto& other) {
    return other.header.array == array_ && other.header.step == step_at(i).step &&
           other.header.group == group_number(part);
  });
  if (!known || found == parts.end() || found->header.count != part.count ||
      found->header.codec != part.codec || found->header.reference != part.reference)
    return corrupt("the chunk at this position differs from its entry in the index", "step values",
                   part.offset);
  for (auto before = parts.begin(); before != found; ++before) in.get_bytes(before->bytes);
  const container::StepHeader& header = found->header;
  StepParts& column = *columns_[i - pass_.from];
  if (auto status = column.check_size(header); !status) return status.error();
  if (auto status = check_reference(i, header); !status) return status.error();
  const StepReference kind = header.reference;
  const std::uint64_t size =
      std::uint64_t{part.count} * scalar_bytes(info().type) * info().components;
  if ((kind != StepReference::nothing && one_back_.size() != size) ||
      (kind == StepReference::trend && two_back_.size() != size))
    return wrong_step_values(file_->schema(), header,
                             "refers to values of elements other than its own");
  ReferenceValues reference;
  if (kind == StepReference::trend) {
    go_on(info().type, one_back_, two_back_, trend_);
    reference = {trend_, one_back_};
  } else if (kind != StepReference::nothing) {
    reference.values = one_back_;
  }
  return column.decode(header, in.get_bytes(found->bytes), file_->segment_number(segment_),
                       elements, reference);
}

/// Returns the values of the array at a step, from a bundle.
Result<std::vector<std::byte>> SegmentSteps::values_in(const BundleChunk& bundle, std::size_t i,
                                                       const StepIndex::Part& part) const {
  const auto pair = bundle.find(array_, step_at(i).step);
  if (!pair || bundle.header(*pair).count != part.count ||
      bundle.header(*pair).group != group_number(part))
    return corrupt("the chunk at this position differs from its entry in the index", "step values",
                   part.offset);
  if (auto status = columns_[i - pass_.from]->check_size(bundle.header(*pair)); !status)
    return status.error();
  return bundle.values(*pair);
}

/// Checks the reference of a step. A trend (extrapolation of the two previous steps) is allowed
/// only if the previous step is not the key step, so that both steps have been decoded.
Result<void> SegmentSteps::check_reference(std::size_t i,
                                           const container::StepHeader& header) const {
  const auto wrong = [&](const char* detail) {
    return wrong_step_values(file_->schema(), header, detail);
  };
  const StepReference kind = header.reference;
  if (kind == StepReference::nothing) return {};
  if (i == 0 || header.reference_step != step_at(i - 1).step ||
      (kind == StepReference::trend && chain_[i] < step_at(i).key + 2))
    return wrong("refers to a step that is not the previous step");
  if (kind > most_) return wrong("refers to earlier steps, although the file does not allow this");
  return {};
}

/// Stores a group's values at the most recent steps, since later steps may refer to them.
Result<void> SegmentSteps::hold(std::uint64_t offset) {
  if (most_ == StepReference::nothing) return {};
  if (auto status = held_->last.write(offset, values_); !status) return status;
  return most_ >= StepReference::trend ? held_->one_back.write(offset, one_back_) : Result<void>();
}

}  // namespace shm
