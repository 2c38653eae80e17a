#include "access/segment_steps.h"

#include <algorithm>
#include <string>
#include <utility>

#include "steps/step_memory.h"

namespace shm {
namespace {

// Columns take memory each: so many steps are read together, with so many components in all.
constexpr std::size_t kMostSteps = 8, kMostComponents = 32;

Error at_chunk(Error error, std::uint64_t offset) {
  error.offset = offset;
  return error;
}

}  // namespace

SegmentSteps::SegmentSteps(IndexedFile& file, const StepIndex& index, StepReference most,
                           std::uint32_t array, std::size_t segment, std::size_t wanted,
                           HeldSteps& held)
    : file_(&file),
      index_(&index),
      most_(most),
      array_(array),
      segment_(segment),
      wanted_(wanted),
      key_(index.key_of(array, wanted)),
      from_(key_),
      held_(&held) {
  if (info().quantization.lossy()) most_ = StepReference::nothing;
  if (held.at && *held.at >= key_ && *held.at <= wanted) from_ = *held.at + 1;
}

/// A column goes on from part to part: where one part needs the mesh, all do.
bool SegmentSteps::told_by_mesh(std::size_t at) const {
  const auto parts = parts_of(at);
  return StepParts::may_need_elements(info()) &&
         std::any_of(parts.begin(), parts.end(),
                     [](const StepIndex::Part& part) { return is_predicted(part.codec); });
}

bool SegmentSteps::needs_mesh() const {
  for (std::size_t at = from_; at <= wanted_; ++at)
    if (told_by_mesh(at)) return true;
  return false;
}

std::uint64_t SegmentSteps::elements() const {
  std::uint64_t elements = 0;
  for (const StepIndex::Part& part : parts_of(wanted_)) elements += part.count;
  return elements;
}

Result<std::vector<std::byte>> SegmentSteps::read_next(StepElements* mesh) {
  if (!std::exchange(begun_, true))
    if (auto good = read_earlier_passes(mesh); !good) return good.error();
  const std::size_t nth = next_++;
  if (pass_.from == pass_.end) {  // the step is held
    const StepIndex::Part& part = parts_of(wanted_)[nth];
    const std::size_t stride = scalar_bytes(info().type) * info().components;
    const auto values =
        std::span(held_->last)
            .subspan(static_cast<std::size_t>((part.first - parts_of(wanted_)[0].first) * stride),
                     static_cast<std::size_t>(part.count * stride));
    return std::vector<std::byte>(values.begin(), values.end());
  }
  if (auto good = read_group(nth, mesh); !good) return good.error();
  if (at_end() && most_ != StepReference::nothing) held_->at = wanted_;
  return std::move(values_);
}

/// What is held of another step can only stand for parts that lie as those do.
bool SegmentSteps::has_same_groups(std::size_t at) const {
  const auto of_held = parts_of(at), wanted = parts_of(wanted_);
  return std::equal(of_held.begin(), of_held.end(), wanted.begin(), wanted.end(),
                    [](const StepIndex::Part& a, const StepIndex::Part& b) {
                      return a.group == b.group && a.count == b.count;
                    });
}

/// All that come before the wanted step, but for those of its own pass.
Result<void> SegmentSteps::read_earlier_passes(StepElements* mesh) {
  if (from_ > key_ && !has_same_groups(from_ - 1))
    return file_->wrong_index("steps of an array have not the same groups");
  // As many as there is memory for, by what is kept of a vertex or cell.
  constexpr std::uint64_t kKeptOfEach = 40;
  const std::uint64_t active = mesh == nullptr ? 0 : mesh->most_active();
  const std::uint64_t room = most_kept() / (kKeptOfEach * info().components * (active + 1));
  const auto together = static_cast<std::size_t>(std::clamp<std::uint64_t>(
      std::min<std::uint64_t>(kMostComponents / info().components, room), 1, kMostSteps));
  const std::size_t groups = parts_of(wanted_).size();
  for (pass_.from = from_;; pass_.from = pass_.end) {
    pass_.end = std::min(pass_.from + together, wanted_ + 1);
    begin_pass();
    if (pass_.end > wanted_) return {};
    for (std::size_t nth = 0; nth < groups; ++nth)
      if (auto good = read_group(nth, mesh); !good) return good;
  }
}

/// By the columns of a pass together.
std::uint64_t SegmentSteps::most_kept() const {
  return most_kept_of_steps(file_->limits().max_column_bytes, file_->source().size());
}

void SegmentSteps::begin_pass() {
  columns_.clear();
  by_mesh_.clear();
  for (std::size_t at = pass_.from; at < pass_.end; ++at) {
    columns_.emplace_back().emplace(file_->schema(), file_->limits().max_group_bytes, array_,
                                    most_kept() / (pass_.end - pass_.from));
    by_mesh_.push_back(told_by_mesh(at));
  }
  // Until all groups are read, what is held belongs to several steps.
  if (pass_.from < pass_.end) held_->at.reset();
}

/// The elements of the group of a part.
Result<ColumnElements> SegmentSteps::elements_of(StepElements& mesh,
                                                 const StepIndex::Part& part) const {
  const std::size_t group = part.group - file_->first_group(segment_);
  const auto count = mesh.count(array_, group);
  if (!count) return at_chunk(count.error(), file_->groups()[part.group].offset);
  if (*count != part.count)
    return IndexedFile::wrong("has another number of values than elements", "step values",
                              part.offset);
  auto elements = mesh.elements(array_, group);
  if (!elements) return at_chunk(elements.error(), file_->groups()[part.group].offset);
  return elements;
}

/// The values of the nth group at all steps of the pass.
Result<void> SegmentSteps::read_group(std::size_t nth, StepElements* mesh) {
  const StepIndex::Part& part = parts_of(wanted_)[nth];
  ColumnElements elements;
  if (std::find(by_mesh_.begin(), by_mesh_.end(), true) != by_mesh_.end()) {
    const auto of_group = elements_of(*mesh, part);
    if (!of_group) return of_group.error();
    elements = *of_group;
  }
  const std::size_t stride = scalar_bytes(info().type) * info().components;
  const auto offset = static_cast<std::size_t>(part.first - parts_of(wanted_)[0].first) * stride;
  const auto held_values = [&](const std::vector<std::byte>& of) {
    const auto size = static_cast<std::size_t>(part.count) * stride;
    if (of.size() < offset + size) return std::vector<std::byte>();
    const auto from = of.begin() + static_cast<std::ptrdiff_t>(offset);
    return std::vector<std::byte>(from, from + static_cast<std::ptrdiff_t>(size));
  };
  values_ = held_values(held_->last);
  one_back_ = held_values(held_->one_back);
  for (std::size_t at = pass_.from; at < pass_.end; ++at)
    if (auto good = read_step(at, nth, elements.items != nullptr ? &elements : nullptr); !good)
      return good;
  hold(offset);
  return {};
}

Result<void> SegmentSteps::read_step(std::size_t at, std::size_t nth,
                                     const ColumnElements* elements) {
  const auto parts = parts_of(at);
  const StepIndex::Part& expected = parts_of(wanted_)[nth];
  if (nth >= parts.size() || parts[nth].group != expected.group ||
      parts[nth].count != expected.count)
    return file_->wrong_index("steps of an array have not the same groups");
  two_back_ = std::exchange(one_back_, std::exchange(values_, {}));
  auto values = decode(at, parts[nth], by_mesh_[at - pass_.from] ? elements : nullptr);
  if (!values) return at_chunk(values.error(), parts[nth].offset);
  values_ = std::move(*values);
  return {};
}

Result<std::vector<std::byte>> SegmentSteps::decode(std::size_t at, const StepIndex::Part& part,
                                                    const ColumnElements* elements) {
  container::IndexEntry entry;
  entry.kind = static_cast<std::uint8_t>(container::ChunkKind::step_values);
  entry.offset = part.offset;
  entry.bytes = part.bytes;
  const auto payload = file_->read_chunk_of_parts(entry);
  if (!payload) return payload.error();
  ByteReader in(payload->bytes);
  std::vector<container::StepPart> parts;
  const bool known = container::get(in, parts, payload->version, payload->bytes.size());
  const auto found = std::find_if(parts.begin(), parts.end(), [&](const auto& it) {
    return it.header.array == array_ && it.header.step == index_->steps(array_)[at].step &&
           it.header.group == file_->group_number(part.group);
  });
  if (!known || found == parts.end() || found->header.count != part.count ||
      found->header.codec != part.codec || container::refers_to(found->header) != part.reference)
    return IndexedFile::wrong("the chunk that should stand here does not", "step values",
                              part.offset);
  for (auto before = parts.begin(); before != found; ++before) in.get_bytes(before->bytes);
  const container::StepHeader& header = found->header;
  StepParts& column = *columns_[at - pass_.from];
  if (auto good = column.check_size(header); !good) return good.error();
  if (auto good = check_reference(at, header); !good) return good.error();
  const StepReference kind = container::refers_to(header);
  const std::uint64_t size =
      std::uint64_t{part.count} * scalar_bytes(info().type) * info().components;
  if ((kind >= StepReference::before && one_back_.size() != size) ||
      (kind == StepReference::trend && two_back_.size() != size))
    return wrong_step_values(file_->schema(), header, "refers to other elements than it has");
  if (kind == StepReference::trend) go_on(info().type, one_back_, two_back_, trend_);
  return column.decode(header, in.get_bytes(found->bytes), file_->segment_number(segment_),
                       elements,
                       kind == StepReference::nothing  ? std::span<const std::byte>()
                       : kind == StepReference::before ? std::span<const std::byte>(one_back_)
                                                       : std::span<const std::byte>(trend_));
}

/// A trend needs two steps, of which the later one refers to a step itself.
Result<void> SegmentSteps::check_reference(std::size_t at,
                                           const container::StepHeader& header) const {
  const StepReference kind = container::refers_to(header);
  const auto wrong = [&](const char* detail) {
    return wrong_step_values(file_->schema(), header, detail);
  };
  if (kind == StepReference::nothing) {
    if (header.trend) return wrong("has a trend, but refers to no step");
    return {};
  }
  const std::size_t needed = kind == StepReference::trend ? 2 : 1;
  if (at < key_ + needed || header.reference_step != index_->steps(array_)[at - 1].step)
    return wrong("refers to a step that is not the one before it");
  if (kind > most_) return wrong("refers to steps that may not be referred to");
  return {};
}

/// Takes note of the last values of a group, for steps to come.
void SegmentSteps::hold(std::size_t offset) {
  if (most_ == StepReference::nothing) return;
  const auto put = [&](std::vector<std::byte>& to, const std::vector<std::byte>& from) {
    if (to.size() < offset + from.size()) to.resize(offset + from.size());
    std::copy(from.begin(), from.end(), to.begin() + static_cast<std::ptrdiff_t>(offset));
  };
  put(held_->last, values_);
  if (most_ == StepReference::trend) put(held_->one_back, one_back_);
}

}  // namespace shm
