// PartWriter: a MeshEncoder and a StepEncoder that begin in the middle of a mesh and write their
// chunks to memory.
#include "shm/part_writer.h"

#include <algorithm>
#include <string>
#include <utility>

#include "api/file_writer.h"
#include "api/kept_steps.h"
#include "base/binary.h"
#include "base/errors.h"
#include "format/schema.h"
#include "pipeline/mesh_encoder.h"

namespace shm {
namespace {

/// Checks that the options let segments begin only at cells known in advance, and that segment
/// `start.segment` begins at cell `start.first_cell`.
Result<void> check_start(const WriteOptions& options, const PartStart& start) {
  const auto& starts = options.segment_starts;
  if (!starts.empty()) {
    const auto begins = static_cast<std::uint64_t>(
        std::count_if(starts.begin(), starts.end(),
                      [&](std::uint64_t cell) { return cell > 0 && cell <= start.first_cell; }));
    const bool there =
        start.first_cell == 0 || std::binary_search(starts.begin(), starts.end(), start.first_cell);
    if (begins == start.segment && there) return {};
  } else if (options.segment_cells > 0) {
    if (start.first_cell % options.segment_cells == 0 &&
        start.first_cell / options.segment_cells == start.segment)
      return {};
  } else if (options.restart_budget > 0) {
    return misuse("to write parts, set segment_cells or segment_starts, or set restart_budget to 0",
                  "options");
  } else if (start.segment == 0 && start.first_cell == 0) {
    return {};
  }
  return misuse("segment " + std::to_string(start.segment) + " does not begin with cell " +
                    std::to_string(start.first_cell),
                "part");
}

}  // namespace

Result<void> place(PartChunks& chunks, std::uint32_t first) {
  std::span<std::byte> left(chunks.bytes);
  while (!left.empty()) {
    container::ChunkHeader header;
    ByteReader in(left);
    if (left.size() < container::kShortHeaderBytes ||
        container::get(in, header) != container::HeaderState::good ||
        header.payload_bytes > left.size() - header.bytes())
      return corrupt("the bytes are not chunks of a part", "part",
                     chunks.bytes.size() - left.size());
    header.sequence = first++;
    ByteWriter out;
    container::put(out, header);
    std::copy(out.bytes.begin(), out.bytes.end(), left.begin());
    left = left.subspan(static_cast<std::size_t>(header.chunk_bytes()));
  }
  return {};
}

class __attribute__((visibility("hidden"))) PartWriter::Impl {
 public:
  Impl(Schema schema, const WriteOptions& options, const PartStart& start)
      : schema_(std::move(schema)),
        file_(sink_, schema_, options.digest),
        mesh_(schema_, options, [this](const EncodedGroup& group) { return write_group(group); }),
        start_(start),
        key_steps_(options.key_steps),
        level_(options.level),
        waiting_bytes_(options.waiting_bytes),
        slow_step_values_(options.slow_step_values),
        kept_steps_(kept_steps(options.kept_steps_bytes, options.temporary_folder)),
        kept_topology_bytes_(to_size(options.kept_topology_bytes)) {
    if (has_steps(schema_)) make_topology();
    mesh_.begin_part({start.segment, start.first_cell, start.first_vertex});
  }

  /// Runs `work` if no error has occurred and the writer is in the phase `phase`.
  template <class Work>
  auto in_phase(int phase, Work&& work) {
    return calls_.run([&]() -> decltype(work()) {
      return phase == phase_ ? work() : misuse("the call is out of order", "part");
    });
  }

  MeshEncoder& mesh() { return mesh_; }
  Result<void> end_mesh() {
    phase_ = keeps() ? kNumbered : kEnded;
    return mesh_.end();
  }
  Result<void> set_imported_numbers(std::span<const std::uint64_t> numbers) {
    phase_ = kNumbered;
    return mesh_.give_out_part(numbers);
  }
  Result<PartChunks> mesh_chunks() {
    phase_ = kChunksTaken;
    container::Index totals = mesh_.totals();
    totals.cells -= start_.first_cell;
    return take(std::move(totals));
  }

  /// Returns the number of elements of the array in this part. The part that begins with segment 0
  /// has the values of all arrays that are neither on points nor on cells.
  std::uint64_t elements_of(std::uint32_t array) const {
    if (!is_on_mesh(schema_.arrays[array].location) && start_.segment > 0) return 0;
    return shm::elements_of(schema_, mesh_.totals(), array);
  }
  Result<void> begin_steps(const PartSteps& steps) {
    const std::size_t arrays = schema_.arrays.size();
    if (steps.first_elements.size() != arrays || steps.elements.size() != arrays)
      return misuse("first_elements and elements must contain one number for each array", "steps");
    std::vector<std::uint64_t> own(arrays);
    for (std::uint32_t a = 0; a < arrays; ++a) own[a] = elements_of(a);
    first_elements_ = steps.first_elements;
    all_elements_ = steps.elements;
    if (!topology_) make_topology();
    steps_ = &file_.begin_steps(*topology_, std::move(own), key_steps_, kept_steps_, level_);
    steps_->begin_part({steps.first_group, steps.first_elements, steps.elements});
    steps_->use_slow_codec(slow_step_values_);
    if (waiting_bytes_ > 0) file_.use_bundles(waiting_bytes_);
    phase_ = kBetweenSteps;
    return {};
  }
  bool chooses(std::uint32_t array) const {
    return array < first_elements_.size() && first_elements_[array] == 0 && elements_of(array) > 0;
  }
  Result<void> begin_step(std::uint32_t array, std::uint64_t step, std::optional<StepBasis> basis) {
    if (auto status = file_.check_step_values(array, {}); !status) return status;
    if (basis.has_value() == chooses(array) && elements_of(array) > 0)
      return misuse(
          "basis must be passed to every part except the part that contains the first element of "
          "the array",
          "steps");
    if (basis) steps_->choose(*basis);
    // If other writers also have elements of this array, parts of other arrays that were held back
    // must be written before the part of this array.
    if (elements_of(array) < all_elements_[array])
      if (auto status = file_.write_parts(); !status) return status;
    phase_ = kInStep;
    array_ = array;
    step_number_ = step;
    return steps_->begin(array, step);
  }
  Result<void> add_step_values(std::span<const std::byte> values) {
    if (auto status = file_.check_step_values(array_, values); !status) return status;
    return steps_->add(array_, step_number_, values);
  }
  std::optional<StepBasis> step_basis() const {
    return phase_ == kInStep ? steps_->chosen() : std::nullopt;
  }
  Result<PartChunks> end_step() {
    phase_ = kBetweenSteps;
    if (auto status = steps_->end_step(); !status) return status.error();
    return take({});
  }
  Result<PartChunks> end_steps() {
    phase_ = kStepsTaken;
    if (auto status = file_.end_step_array(); !status) return status.error();
    if (auto status = file_.write_parts(); !status) return status.error();
    return take({});
  }

  enum Phase { kAdding, kEnded, kNumbered, kChunksTaken, kBetweenSteps, kInStep, kStepsTaken };

 private:
  void make_topology() {
    topology_.emplace(schema_, ~std::uint64_t{0}, needs_of_steps(schema_, file_.has_digests()),
                      kept_topology_bytes_);
  }
  bool keeps() const { return schema_.order == Order::keep; }
  Result<void> write_group(const EncodedGroup& group) {
    if (topology_) add_group(group, *topology_);
    return file_.write_group(group);
  }
  PartChunks take(container::Index totals) {
    PartChunks out;
    out.count = file_.chunks();
    const container::Index part = file_.take_part(std::move(totals));
    ByteWriter index;
    index.put_u32(checksum_of(schema_));
    index.put_u8(part.version);
    container::put(index, part.streams);
    container::put(index, part);
    out.index = std::move(index.bytes);
    out.bytes = std::exchange(sink_.bytes, {});
    return out;
  }

  Schema schema_;
  MemorySink sink_;
  FileWriter file_;
  MeshEncoder mesh_;
  PartStart start_;
  int phase_ = kAdding;
  Calls calls_;

  std::uint32_t key_steps_;
  Level level_;
  std::uint64_t waiting_bytes_, slow_step_values_;
  KeptSteps kept_steps_;
  std::size_t kept_topology_bytes_;
  // Topology of the part, from which step values are predicted. Set if the schema has stepped
  // arrays, at the latest by begin_steps().
  std::optional<StepTopology> topology_;
  StepEncoder* steps_ = nullptr;  // encoder of step values; set by begin_steps()
  std::vector<std::uint64_t> first_elements_, all_elements_;
  std::uint32_t array_ = 0;  // array of the current step
  std::uint64_t step_number_ = 0;
};

PartWriter::PartWriter(std::unique_ptr<Impl> impl) : impl_(std::move(impl)) {}
PartWriter::PartWriter(PartWriter&&) noexcept = default;
PartWriter& PartWriter::operator=(PartWriter&&) noexcept = default;
PartWriter::~PartWriter() = default;

Result<PartWriter> PartWriter::create(Schema schema, const WriteOptions& options,
                                      const PartStart& start) {
  auto checked = schema_of_file(std::move(schema), options);
  if (!checked) return checked.error();
  if (auto status = check_start(options, start); !status) return status.error();
  return PartWriter(std::make_unique<Impl>(std::move(*checked), options, start));
}

Result<void> PartWriter::add_vertex(std::uint64_t number, std::span<const std::byte> xyz,
                                    std::span<const std::byte> data) {
  return impl_->in_phase(Impl::kAdding,
                         [&] { return impl_->mesh().add_vertex(number, xyz, data); });
}
Result<void> PartWriter::add_imported_vertex(std::uint64_t number, std::span<const std::byte> xyz,
                                             std::span<const std::byte> data) {
  return impl_->in_phase(Impl::kAdding,
                         [&] { return impl_->mesh().add_imported_vertex(number, xyz, data); });
}
Result<void> PartWriter::add_unused_vertex(std::uint64_t number, std::span<const std::byte> xyz,
                                           std::span<const std::byte> data) {
  return impl_->in_phase(Impl::kAdding,
                         [&] { return impl_->mesh().add_unused_vertex(number, xyz, data); });
}
Result<void> PartWriter::add_cell(std::uint32_t block, std::span<const std::uint64_t> corners,
                                  std::uint64_t last_use, std::span<const std::byte> data,
                                  std::span<const std::uint64_t> other_last_uses) {
  return impl_->in_phase(Impl::kAdding, [&] {
    return impl_->mesh().add_cell(block, corners, last_use, data, other_last_uses);
  });
}
Result<void> PartWriter::end_mesh() {
  return impl_->in_phase(Impl::kAdding, [&] { return impl_->end_mesh(); });
}
Result<void> PartWriter::set_imported_numbers(std::span<const std::uint64_t> numbers) {
  return impl_->in_phase(Impl::kEnded, [&] { return impl_->set_imported_numbers(numbers); });
}
Result<PartChunks> PartWriter::mesh_chunks() {
  return impl_->in_phase(Impl::kNumbered, [&] { return impl_->mesh_chunks(); });
}
Result<void> PartWriter::begin_steps(const PartSteps& steps) {
  return impl_->in_phase(Impl::kChunksTaken, [&] { return impl_->begin_steps(steps); });
}
bool PartWriter::chooses(std::uint32_t array) const { return impl_->chooses(array); }
Result<void> PartWriter::begin_step(std::uint32_t array, std::uint64_t step,
                                    std::optional<StepBasis> basis) {
  return impl_->in_phase(Impl::kBetweenSteps,
                         [&] { return impl_->begin_step(array, step, basis); });
}
Result<void> PartWriter::add_step_values(std::span<const std::byte> values) {
  return impl_->in_phase(Impl::kInStep, [&] { return impl_->add_step_values(values); });
}
std::optional<StepBasis> PartWriter::step_basis() const { return impl_->step_basis(); }
Result<PartChunks> PartWriter::end_step() {
  return impl_->in_phase(Impl::kInStep, [&] { return impl_->end_step(); });
}
Result<PartChunks> PartWriter::end_steps() {
  return impl_->in_phase(Impl::kBetweenSteps, [&] { return impl_->end_steps(); });
}

}  // namespace shm
