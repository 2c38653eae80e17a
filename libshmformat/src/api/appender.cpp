// Appender: copies the chunks of an existing file to a new file and appends further steps.
#include "shm/appender.h"

#include <algorithm>
#include <map>
#include <optional>
#include <string>
#include <utility>

#include "api/file_writer.h"
#include "api/kept_steps.h"
#include "base/binary.h"
#include "base/errors.h"
#include "format/chunk_copy.h"
#include "format/random_chunks.h"
#include "random/indexed_file.h"
#include "random/indexed_topology.h"
#include "shm/step_reader.h"
#include "shm/summary.h"

namespace shm {
namespace {

using container::ChunkCopy;
using container::ChunkKind;
using container::IndexEntry;

constexpr std::uint32_t kLeastKeySteps = 8;
/// The Appender adds parts (values of further steps) to the final chunk of step values only if this
/// chunk has at most this size in bytes.
constexpr std::uint64_t kMostUnfinished =
    container::kLongHeaderBytes + container::kMostStepHeadBytes + container::kPartBytesTogether;

}  // namespace

class __attribute__((visibility("hidden"))) Appender::Impl {
 public:
  Impl(RandomSource& source, ByteSink& sink, const AppendOptions& options, const ReadLimits& limits)
      : source_(&source), sink_(&sink), options_(options), file_(source, limits) {}

  Result<void> open();
  const Schema& schema() const { return file_.schema(); }
  const StepReader& reader() const { return *reader_; }
  std::uint64_t steps() const { return file_.index().steps; }
  Result<std::unique_ptr<ByteSource>> without_steps();

  Calls& calls() { return calls_; }
  Result<void> drop_extras();
  Result<void> add_step_values(std::uint32_t array, std::uint64_t step,
                               std::span<const std::byte> values);
  Result<void> set_step_times(std::span<const double> times);
  Result<void> add_extra(const Extra& extra);
  Result<void> commit();
  Result<SizeReport> finish();

 private:
  using Streams = std::map<std::string, std::uint64_t>;
  /// State of a stepped array in the old file.
  struct Array {
    std::optional<std::uint64_t> last_step;
    std::uint32_t run = 0;  ///< number of steps from the array's most recent key step to its final
                            ///< step, both included
    StepReference last_reference = StepReference::nothing;  ///< of the array's final step
    /// Number of the most recent step that refers to no other step.
    std::optional<std::uint64_t> base;
    /// True if remember() has passed the array's final steps to the encoder.
    bool remembered = false;
  };

  void look_at_steps();
  /// Chunks to copy, and the sum of their digests.
  struct Copied {
    ChunkCopy chunks;
    std::uint64_t digest = 0;
  };
  Result<Copied> copy_of(bool with_steps, bool with_times, bool with_extras,
                         const IndexEntry* without = nullptr);
  Result<std::uint64_t> digest_of(const IndexEntry& entry);
  bool has_digests() const { return container::has_digest(file_.index().version); }
  Result<Streams> streams(const ChunkCopy& copy, bool with_steps) const;
  const IndexEntry* unfinished_parts() const;
  container::Index totals() const;
  Result<void> begin();
  Result<void> begin_in_place();
  Result<void> expect_end();
  Result<void> begin_steps();
  Result<void> remember(std::uint32_t array);
  Result<std::vector<std::byte>> read_step(std::uint32_t array, std::uint64_t step);

  RandomSource* source_;
  ByteSink* sink_;
  AppendOptions options_;
  IndexedFile file_;
  std::optional<StepReader> reader_;
  std::vector<Array> arrays_;
  std::uint32_t longest_run_ = 0;
  std::uint64_t bundle_pairs_ = 0;  // number of pairs of an array and a step in bundles
  std::uint64_t step_bytes_ = 0;    // total size of the chunks of step values that are copied
  Calls calls_;
  bool with_extras_ = true;

  // Writer of the new file; created after the old chunks have been copied.
  std::optional<FileWriter> writer_;
  std::optional<StepTopology> topology_;
  StepEncoder* encoder_ = nullptr;
};

Result<void> Appender::Impl::open() {
  if (auto status = file_.open(); !status) return status;
  auto reader = StepReader::open(*source_, file_.limits());
  if (!reader) return reader.error();
  reader_ = std::move(*reader);
  look_at_steps();
  return options_.in_place ? expect_end() : Result<void>();
}

/// Records the state of each array. Precondition: the StepReader has checked that the chunks of a
/// step are contiguous and that the steps of an array are in ascending order.
void Appender::Impl::look_at_steps() {
  arrays_.resize(schema().arrays.size());
  const auto end_step = [&](Array& array) {
    array.run = container::is_key(array.last_reference) ? 1 : array.run + 1;
    if (array.last_reference == StepReference::nothing) array.base = array.last_step;
    longest_run_ = std::max(longest_run_, array.run);
  };
  const IndexEntry* unfinished = unfinished_parts();
  for (const IndexEntry& entry : file_.index().entries) {
    if (entry.is(ChunkKind::step_values) && &entry != unfinished) step_bytes_ += entry.bytes;
    for (const container::StepEntry& part : entry.parts) {
      if (part.codec == Codec::bundle) bundle_pairs_ += part.arrays * part.steps;
      for (Array& array : std::span(arrays_).subspan(part.array, part.arrays)) {
        if (array.last_step != part.step) {
          if (array.last_step) end_step(array);
          array.last_step = part.step + part.steps - 1;
        }
        array.last_reference = part.reference;
      }
    }
  }
  for (Array& array : arrays_)
    if (array.last_step) end_step(array);
}

/// Selects the chunks to copy. The second copy of the schema is never copied; finish() writes a new
/// second copy if necessary.
auto Appender::Impl::copy_of(bool with_steps, bool with_times, bool with_extras,
                             const IndexEntry* without) -> Result<Copied> {
  const auto is_copied = [&](const IndexEntry& entry) {
    if (&entry == without || entry.is(ChunkKind::index)) return false;
    if (entry.is(ChunkKind::schema)) return entry.offset == container::kFileStartBytes;
    if (entry.is(ChunkKind::step_values)) return with_steps;
    if (entry.is(ChunkKind::step_times)) return with_times;
    return with_extras || !entry.is(ChunkKind::extra);
  };
  std::uint64_t digest = file_.index().digest;
  for (const IndexEntry& entry : file_.index().entries) {
    if (!has_digests() || is_copied(entry)) continue;
    const auto left_out = digest_of(entry);
    if (!left_out) return left_out.error();
    digest -= *left_out;
  }
  auto copy = ChunkCopy::of(*source_, file_.index().entries, file_.index_offset(), is_copied);
  if (!copy) return copy.error();
  return Copied{std::move(*copy), digest};
}

/// Returns the digest that a chunk states, or 0 if chunks of its kind have none.
Result<std::uint64_t> Appender::Impl::digest_of(const IndexEntry& entry) {
  if (!entry.is(ChunkKind::step_values) && !entry.is(ChunkKind::step_times))
    return std::uint64_t{0};
  constexpr std::uint64_t kMost = container::kLongHeaderBytes + sizeof(std::uint64_t);
  const auto bytes = container::read_bytes(*source_, entry.offset, std::min(entry.bytes, kMost),
                                           container::chunk_name(entry.kind));
  if (!bytes) return bytes.error();
  const auto header = container::checked_header(*bytes, entry);
  if (!header) return header.error();
  ByteReader in(std::span<const std::byte>(*bytes).subspan(header->bytes()));
  return container::has_digest(header->version) ? in.get_u64() : 0;
}

/// Returns the file's final chunk of step values, or null if no further parts may be added to it.
const IndexEntry* Appender::Impl::unfinished_parts() const {
  const auto& entries = file_.index().entries;
  const auto last = std::find_if(entries.rbegin(), entries.rend(), [](const IndexEntry& entry) {
    return entry.is(ChunkKind::step_values);
  });
  if (last == entries.rend() || file_.index().version == 0) return nullptr;
  const bool waits = std::all_of(last->parts.begin(), last->parts.end(), [&](const auto& part) {
    return part.group == 0 && part.count == reader_->elements(part.array);
  });
  return waits && last->bytes <= kMostUnfinished ? &*last : nullptr;
}

/// Returns the coded size in bytes of each stream in the copied chunks, by stream name. If
/// `with_steps` is false, streams of step values are not included.
Result<Appender::Impl::Streams> Appender::Impl::streams(const ChunkCopy& copy,
                                                        bool with_steps) const {
  const auto summary = read_summary(*source_, file_.limits());
  if (!summary) return summary.error();
  Streams streams = summary->totals.streams;
  streams.erase("extras");
  streams.erase("container");
  const auto& entries = copy.state().entries;
  for (std::size_t i = 0; i < entries.size(); ++i)
    if (entries[i].is(ChunkKind::extra) || entries[i].is(ChunkKind::step_times))
      streams["extras"] += copy.payload_bytes()[i];
  for (std::uint32_t a = 0; a < arrays_.size() && !with_steps; ++a)
    if (schema().arrays[a].per_step) streams.erase(array_stream_name(schema(), a));
  return streams;
}

container::Index Appender::Impl::totals() const {
  container::Index index = file_.index();
  index.entries.clear();
  return index;
}

Result<std::unique_ptr<ByteSource>> Appender::Impl::without_steps() {
  const auto copy = copy_of(false, true, true);
  if (!copy) return copy.error();
  auto schema_chunk = file_.read_chunk(file_.index().entries[0]);
  if (!schema_chunk) return schema_chunk.error();
  auto copied = streams(copy->chunks, false);
  if (!copied) return copied.error();
  MemorySink tail;
  FileWriter writer(tail, schema(), has_digests());
  writer.go_on(*std::move(schema_chunk), copy->chunks.state(), *std::move(copied),
               reader_->step_times().size(), copy->digest);
  if (auto finished = writer.finish(totals()); !finished) return finished.error();
  return copy->chunks.read(*source_, std::move(tail.bytes));
}

// --- appending

Result<void> Appender::Impl::drop_extras() {
  if (options_.in_place)
    return misuse("extras of a file that is continued in place cannot be dropped", "extras");
  if (writer_) return misuse("drop_extras must be called before anything is written", "extras");
  with_extras_ = false;
  return {};
}

/// Fails if the file cannot be continued after its last index.
Result<void> Appender::Impl::expect_end() {
  if (!container::has_trailer_inside(file_.index().version))
    return unsupported("only files of version 0.10 can be continued in place", "file start");
  const std::uint64_t end = file_.index_offset() + file_.index_bytes();
  std::vector<std::byte> mark(sizeof(std::uint32_t));
  if (source_->size() - end < mark.size()) return {};
  if (auto status = source_->read_at(end, mark); !status) return status;
  ByteReader in(mark);
  if (in.get_u32() == container::kPacketMark)
    return unsupported("has parity, so it cannot be continued in place", "parity", end);
  return {};
}

/// Begins to write after the last index of the old file.
Result<void> Appender::Impl::begin_in_place() {
  auto schema_chunk = file_.read_chunk(file_.index().entries[0]);
  if (!schema_chunk) return schema_chunk.error();
  const auto summary = read_summary(*source_, file_.limits());
  if (!summary) return summary.error();
  Streams streams = summary->totals.streams;
  streams.erase("container");
  container::ChunkWriter::State state;
  state.offset = file_.index_offset() + file_.index_bytes();
  state.entries = file_.index().entries;
  IndexEntry last;
  last.kind = static_cast<std::uint8_t>(ChunkKind::index);
  last.offset = file_.index_offset();
  last.bytes = file_.index_bytes();
  state.entries.push_back(std::move(last));
  state.sequence = static_cast<std::uint32_t>(state.entries.size());
  for (const std::size_t size : file_.index_sizes()) {
    const std::size_t begin = state.indexes.empty() ? 0 : state.indexes.back().end;
    state.indexes.push_back({begin, begin + size});
  }
  writer_.emplace(*sink_, schema(), has_digests());
  writer_->go_on(*std::move(schema_chunk), std::move(state), std::move(streams),
                 file_.index().steps, file_.index().digest, reader_->step_times());
  return {};
}

/// Copies the old chunks that are kept. Does nothing after the first call.
Result<void> Appender::Impl::begin() {
  if (writer_) return {};
  if (options_.in_place) return begin_in_place();
  const IndexEntry* last = unfinished_parts();
  std::vector<std::byte> parts;
  if (last != nullptr) {
    std::uint8_t version = 0;
    auto payload = file_.read_chunk(*last, &version);
    if (!payload) return payload.error();
    parts = std::move(*payload);
    if (version != container::with_digest(container::version_of_chunk(ChunkKind::step_values, {}),
                                          has_digests()))
      last = nullptr;
  }
  const auto copy = copy_of(true, false, with_extras_, last);
  if (!copy) return copy.error();
  auto schema_chunk = file_.read_chunk(file_.index().entries[0]);
  if (!schema_chunk) return schema_chunk.error();
  auto copied = streams(copy->chunks, true);
  if (!copied) return copied.error();
  if (auto status = copy->chunks.write(*source_, *sink_); !status) return status;
  std::uint64_t steps = 0;
  for (const Array& array : arrays_)
    if (array.last_step) steps = std::max(steps, *array.last_step + 1);
  writer_.emplace(*sink_, schema(), has_digests());
  writer_->go_on(*std::move(schema_chunk), copy->chunks.state(), *std::move(copied), steps,
                 copy->digest);
  return last == nullptr ? Result<void>() : writer_->go_on_with_parts(parts);
}

Result<void> Appender::Impl::begin_steps() {
  topology_.emplace(schema(), file_.limits().max_group_bytes,
                    needs_of_steps(schema(), has_digests()));
  for (std::size_t g = 0; g < file_.groups().size(); ++g)
    if (auto status = add_group(file_, g, *topology_); !status) return status;
  std::vector<std::uint64_t> elements(arrays_.size());
  for (std::uint32_t a = 0; a < elements.size(); ++a) elements[a] = reader_->elements(a);
  const std::uint32_t key_steps =
      options_.key_steps > 0 ? options_.key_steps : std::max(kLeastKeySteps, longest_run_);
  encoder_ = &writer_->begin_steps(
      *topology_, std::move(elements), key_steps,
      kept_steps(file_.limits().max_kept_steps_bytes, options_.temporary_folder), options_.level);
  if (options_.waiting_bytes > 0)
    writer_->use_bundles(options_.waiting_bytes, bundle_pairs_, step_bytes_);
  return {};
}

Result<std::vector<std::byte>> Appender::Impl::read_step(std::uint32_t array, std::uint64_t step) {
  StepRequest request;
  request.array = array;
  request.step = step;
  request.numbers = false;
  if (auto status = reader_->begin(request); !status) return status.error();
  std::vector<std::byte> all;
  while (true) {
    auto values = reader_->next();
    if (!values) return values.error();
    if (*values == nullptr) return all;
    all.insert(all.end(), (*values)->values.begin(), (*values)->values.end());
  }
}

/// Passes existing steps of the array to the encoder: those that the next step may refer to.
Result<void> Appender::Impl::remember(std::uint32_t array) {
  Array& known = arrays_[array];
  if (std::exchange(known.remembered, true) || !known.last_step) return {};
  encoder_->go_on(array, *known.last_step, known.run, known.base);
  if (encoder_->may_refer_to_base(array)) {
    const auto values = read_step(array, *known.base);
    if (!values) return values.error();
    if (auto status = encoder_->remember_base(array, *values); !status) return status;
  }
  if (!encoder_->may_refer(array, StepReference::before)) return {};
  const std::vector<std::uint64_t> steps = reader_->steps(array);
  const std::size_t wanted = encoder_->may_refer(array, StepReference::trend) ? 2 : 1;
  for (std::size_t back = wanted; back > 0; --back) {
    const auto values = read_step(array, steps[steps.size() - back]);
    if (!values) return values.error();
    if (auto status = encoder_->remember(array, *values); !status) return status;
  }
  return {};
}

Result<void> Appender::Impl::add_step_values(std::uint32_t array, std::uint64_t step,
                                             std::span<const std::byte> values) {
  if (auto status = begin(); !status) return status;
  if (auto status = writer_->check_step_values(array, values); !status) return status;
  if (encoder_ == nullptr)
    if (auto status = begin_steps(); !status) return status;
  if (auto status = remember(array); !status) return status;
  return writer_->add_step_values(array, step, values);
}

Result<void> Appender::Impl::set_step_times(std::span<const double> times) {
  if (auto status = begin(); !status) return status;
  return writer_->set_step_times(times);
}

Result<void> Appender::Impl::add_extra(const Extra& extra) {
  if (auto status = FileWriter::check(extra); !status) return status;
  if (auto status = begin(); !status) return status;
  return writer_->add_extra(extra);
}

Result<void> Appender::Impl::commit() {
  if (!options_.in_place)
    return misuse("only a file that is continued in place can be committed", "file");
  if (auto status = begin(); !status) return status;
  return writer_->commit(totals());
}

Result<SizeReport> Appender::Impl::finish() {
  return calls_.finish([&]() -> Result<SizeReport> {
    if (auto status = begin(); !status) return status.error();
    if (options_.in_place) return writer_->finish_with_commit(totals());
    const auto& entries = file_.index().entries;
    const bool had_times = std::any_of(entries.begin(), entries.end(), [](const IndexEntry& entry) {
      return entry.is(ChunkKind::step_times);
    });
    if (had_times && !writer_->has_times())
      if (auto status = writer_->set_step_times(reader_->step_times()); !status)
        return status.error();
    return writer_->finish(totals());
  });
}

// --- public interface

Appender::Appender(std::unique_ptr<Impl> impl) : impl_(std::move(impl)) {}
Appender::Appender(Appender&&) noexcept = default;
Appender& Appender::operator=(Appender&&) noexcept = default;
Appender::~Appender() = default;

Result<Appender> Appender::open(RandomSource& file, ByteSink& sink, const AppendOptions& options,
                                const ReadLimits& limits) {
  if (options.level > Level::best) return misuse("unknown level", "options");
  auto impl = std::make_unique<Impl>(file, sink, options, limits);
  if (auto status = impl->open(); !status) return status.error();
  return Appender(std::move(impl));
}
const Schema& Appender::schema() const { return impl_->schema(); }
const std::vector<double>& Appender::step_times() const { return impl_->reader().step_times(); }
std::uint64_t Appender::steps() const { return impl_->steps(); }
std::uint64_t Appender::elements(std::uint32_t array) const {
  return impl_->reader().elements(array);
}
Result<std::unique_ptr<ByteSource>> Appender::without_steps() { return impl_->without_steps(); }
Result<void> Appender::drop_extras() {
  return impl_->calls().run([&] { return impl_->drop_extras(); });
}
Result<void> Appender::add_step_values(std::uint32_t array, std::uint64_t step,
                                       std::span<const std::byte> values) {
  return impl_->calls().run([&] { return impl_->add_step_values(array, step, values); });
}
Result<void> Appender::set_step_times(std::span<const double> times) {
  return impl_->calls().run([&] { return impl_->set_step_times(times); });
}
Result<void> Appender::add_extra(const Extra& extra) {
  return impl_->calls().run([&] { return impl_->add_extra(extra); });
}
Result<void> Appender::commit() {
  return impl_->calls().run([&] { return impl_->commit(); });
}
Result<SizeReport> Appender::finish() { return impl_->finish(); }

}  // namespace shm
