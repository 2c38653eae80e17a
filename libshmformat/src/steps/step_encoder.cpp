#include "steps/step_encoder.h"

#include <algorithm>
#include <map>
#include <string>
#include <utility>

#include "base/errors.h"
#include "codecs/shared/shuffled_zstd.h"
#include "codecs/shifts/difference_values.h"
#include "format/schema.h"

namespace shm {
namespace {

/// Largest size in bytes of a step of an array that waits.
constexpr std::size_t kMostWaitingStep = std::size_t{1} << 16;
/// Arrays with at most kTinyStep values per step are always coded as bundles, if there are more
/// than kFewPairs pairs of an array and a step. Trying ordinary parts would take long, and they
/// would hardly be smaller.
constexpr std::uint64_t kTinyStep = 32, kFewPairs = 64;
/// Ordinary parts are preferred to bundles unless they are larger by more than this share, 1/N.
constexpr std::size_t kGraceOfParts = 16;
/// Approximate number of bytes of memory that a step of an array that waits needs besides its
/// values.
constexpr std::size_t kBytesAroundWaiting = 100;
/// Number of steps that are encoded as ordinary parts to estimate the size of all steps.
constexpr std::size_t kTriedSteps = 3;
/// Approximate number of bytes that a part needs in its chunk and in the index.
constexpr std::size_t kBytesAroundPart = 7;
/// The same for a bundle.
constexpr std::size_t kBytesAroundBundle = 40;

// Zstd compression level of steps that are coded with shuffled_zstd.
constexpr int kShuffledZstdLevel = 9;
// Zstd compression level with which repeated values are found.
constexpr int kQuickZstdLevel = 1;
constexpr std::size_t kUnlimitedBytes = ~std::size_t{0};
/// Except at level best, the slow codec `columns` must save at least this share, 1/N.
constexpr std::size_t kShareForSpeed = 32;
/// A reference to the base must save at least this share, 1/N, because readers of the step also
/// decode the base.
constexpr std::size_t kShareForBase = 8;
/// Except at level best, a reference to the previous steps must save at least this share, 1/N.
/// Otherwise a step without a reference is better, because it is a base for the key steps after it.
constexpr std::size_t kShareForReference = 64;
/// Number of elements of a group from which on fewer references are tried.
constexpr std::uint64_t kManyElements = 8192;
/// With the codec `terms`: while references do not pay, only every kStepsAlone-th step tries them.
constexpr std::uint32_t kStepsAlone = 4;

/// Returns true if `bytes` saves enough of `alone`, the size without a reference, for a reference
/// to the previous steps.
bool saves_enough(std::size_t bytes, std::size_t alone) {
  return bytes < alone - alone / kShareForReference;
}

}  // namespace

EncodedColumn StepColumnEncoder::encode(const ColumnElements& elements,
                                        std::span<const std::byte> values, Level level,
                                        const ReferenceValues& reference) {
  column_->make_room(elements.slots, elements.all_slots);
  return column_->encode(*elements.items, values.data(),
                         scalar_bytes(info().type) * info().components, level,
                         reference.empty() ? nullptr : reference.values.data());
}

EncodedColumn StepWeightedEncoder::encode(const ColumnElements& elements,
                                          std::span<const std::byte> values,
                                          const ReferenceValues& reference) {
  column_->make_room(elements.slots);
  return {Codec::weighted, column_->encode(*elements.items, values, reference)};
}

StepEncoder::StepEncoder(const Schema& schema, StepTopology& topology,
                         std::vector<std::uint64_t> elements, std::uint32_t key_steps,
                         KeptSteps kept, Level level, Sink sink)
    : schema_(&schema),
      mesh_(schema, topology, cover_numbers(schema)),
      elements_(std::move(elements)),
      key_steps_(key_steps),
      level_(level),
      most_(key_steps > 1 ? schema.step_references : StepReference::nothing),
      sink_(std::move(sink)),
      store_(std::make_unique<StepStore>(std::move(kept))) {
  for (std::uint32_t a = 0; a < schema.arrays.size(); ++a) {
    before_.push_back({.values = memory_of(*store_, schema.arrays[a], elements_[a], most_)});
    if (schema.arrays[a].per_step) mesh_.expect(a, elements_[a]);
  }
}

namespace {

// A StepBasis consists of a StepReference, of one of the numbers below, and of the number of values
// that the codec `columns` was tried for.
constexpr std::uint64_t kNoCodecChosen = 0, kColumnsChosen = 1, kWeightedChosen = 2,
                        kShuffledChosen = 3;

}  // namespace

void StepEncoder::choose(StepBasis basis) {
  const auto bits = static_cast<std::uint64_t>(basis);
  given_reference_ = static_cast<StepReference>(bits & 3);
  given_codec_.reset();
  if ((bits >> 2 & 3) == kColumnsChosen) given_codec_ = Codec::columns;
  if ((bits >> 2 & 3) == kWeightedChosen) given_codec_ = Codec::weighted;
  if ((bits >> 2 & 3) == kShuffledChosen) given_codec_ = Codec::shuffled_zstd;
  slow_values_ = std::max(slow_values_, bits >> 4);
}

std::optional<StepBasis> StepEncoder::chosen() const {
  if (!array_ || !reference_ || waits_) return std::nullopt;
  const std::uint64_t codec = weighted_      ? kWeightedChosen
                              : column_      ? kColumnsChosen
                              : is_shuffled_ ? kShuffledChosen
                                             : kNoCodecChosen;
  return StepBasis{static_cast<std::uint64_t>(*reference_) | codec << 2 | slow_values_ << 4};
}

Result<void> StepEncoder::begin(std::uint32_t array, std::uint64_t step) {
  if (array_ == array && step_ == step) return {};
  if (auto status = end_step(); !status) return status;
  return begin_step(array, step);
}

Result<void> StepEncoder::add(std::uint32_t array, std::uint64_t step,
                              std::span<const std::byte> values) {
  if (auto status = begin(array, step); !status) return status;
  if (!waits_) return encode_values(values);
  pending_.insert(pending_.end(), values.begin(), values.end());
  return {};
}

/// Encodes values of the current step. Groups are encoded as soon as they are complete.
Result<void> StepEncoder::encode_values(std::span<const std::byte> values) {
  while (!values.empty()) {
    if (count_ == 0)
      if (auto status = begin_group(); !status) return status;
    const std::size_t wanted = static_cast<std::size_t>(count_) * stride();
    const auto head = values.first(std::min(wanted - pending_.size(), values.size()));
    pending_.insert(pending_.end(), head.begin(), head.end());
    values = values.subspan(head.size());
    if (pending_.size() == wanted)
      if (auto status = end_group(); !status) return status;
  }
  return {};
}

void StepEncoder::go_on(std::uint32_t array, std::uint64_t last_step, std::uint32_t run,
                        std::optional<std::uint64_t> base) {
  before_[array].next_step = last_step + 1;
  before_[array].encoded_step = last_step;
  before_[array].run = run;
  before_[array].base = base;
  steps_ = std::max(steps_, last_step + 1);
}

bool StepEncoder::may_refer(std::uint32_t array, StepReference kind) const {
  const Before& before = before_[array];
  if (kind > most_) return false;
  switch (kind) {
    case StepReference::nothing: return true;
    case StepReference::before: return before.run >= 1 && before.run < key_steps_;
    case StepReference::trend: return before.run >= 2 && before.run < key_steps_;
    case StepReference::base: return before.base && before.run >= key_steps_;
  }
  return false;
}

Result<void> StepEncoder::begin_step(std::uint32_t array, std::uint64_t step) {
  Before& before = before_[array];
  if (step < before.next_step) return misuse("steps of an array must ascend", "steps");
  before.next_step = step + 1;
  // A step of an array without elements stores nothing in the file.
  if (elements_[array] > 0) steps_ = std::max(steps_, step + 1);
  waits_ = may_wait(array);
  if (waits_) {
    array_ = array;
    step_ = step;
    pending_.clear();
    return {};
  }
  begin_encoding(array, step);
  if (reference_ && !may_refer(array, *reference_) && elements_[array] > 0)
    return misuse("a step cannot refer to steps that were not added", "steps");
  return {};
}

void StepEncoder::begin_encoding(std::uint32_t array, std::uint64_t step) {
  Before& before = before_[array];
  previous_step_ = std::exchange(before.encoded_step, step);
  array_ = array;
  step_ = step;
  first_ = 0;
  groups_ = 0;
  count_ = 0;
  reference_ = std::exchange(given_reference_, std::nullopt);
  codec_ = std::exchange(given_codec_, std::nullopt);
  is_shuffled_ = codec_ == Codec::shuffled_zstd;
  column_.reset();
  weighted_.reset();
}

/// Begins the next group that has elements of the array.
Result<void> StepEncoder::begin_group() {
  if (first_ == elements_[*array_])
    return misuse("array '" + schema_->arrays[*array_].name + "' got more than its " +
                      std::to_string(first_) + " elements at step " + std::to_string(step_),
                  "steps");
  const auto next = mesh_.nth_group(*array_, groups_, mesh_.groups() - 1);
  if (!next) return next.error();
  if (*next == nullptr) return misuse("the mesh has fewer elements than its groups state", "steps");
  ++groups_;
  group_ = (*next)->group;
  count_ = (*next)->count;
  return {};
}

Result<void> StepEncoder::end_group() {
  auto coded = encode();
  if (!coded) return coded.error();
  container::StepHeader header;
  header.array = *array_;
  header.step = header.reference_step = step_;
  header.group = static_cast<std::uint32_t>(group_);
  header.count = count_;
  header.codec = coded->codec;
  header.reference = *reference_;
  if (*reference_ == StepReference::base)
    header.reference_step = *before_[*array_].base;
  else if (*reference_ != StepReference::nothing)
    header.reference_step = previous_step_;
  if (part_) header.group += part_->first_group;
  const std::uint64_t first = first_ + (part_ ? part_->first[*array_] : 0);
  auto digest = digest_of(*array_, step_, group_, first, pending_);
  if (!digest) return digest.error();
  if (auto status = sink_(header, first, coded->bytes, *digest); !status) return status;
  if (auto status =
          remember(*array_, first_ * stride(), pending_, *reference_ == StepReference::nothing);
      !status)
    return status;
  first_ += count_;
  count_ = 0;
  pending_.clear();
  return {};
}

/// Stores values of a step, beginning at byte `offset`, as a reader restores them. The next steps
/// may refer to them. `is_base` is true if the step refers to no other step.
Result<void> StepEncoder::remember(std::uint32_t array, std::uint64_t offset,
                                   std::span<const std::byte> values, bool is_base) {
  StepMemory& memory = before_[array].values;
  if (most_ == StepReference::nothing || !is_rounded(array))
    return memory.take(offset, values, is_base);
  return memory.take(offset, rounded(array, values), is_base);
}

/// Returns true if a reader restores rounded values of an array. Arrays with too many components
/// are stored exactly.
bool StepEncoder::is_rounded(std::uint32_t array) const {
  const ArrayInfo& info = schema_->arrays[array];
  return info.quantization.lossy() && info.components <= kMostStepComponents;
}

/// Returns the values that a reader of the array restores.
std::vector<std::byte> StepEncoder::rounded(std::uint32_t array,
                                            std::span<const std::byte> values) const {
  const ArrayInfo& info = schema_->arrays[array];
  const std::size_t bytes = scalar_bytes(info.type) * info.components;
  return restored_values(info, values.data(), bytes, values.size() / bytes);
}

/// Returns the digest of the values of an array at one step in a group. `first`: index of the first
/// element among those of the array in the whole mesh.
Result<std::uint64_t> StepEncoder::digest_of(std::uint32_t array, std::uint64_t step,
                                             std::size_t group, std::uint64_t first,
                                             std::span<const std::byte> values) {
  if (!has_digests_) return std::uint64_t{0};
  if (is_rounded(array)) {
    const std::vector<std::byte> restored = rounded(array, values);
    return mesh_.digest(array, step, group, first, restored);
  }
  return mesh_.digest(array, step, group, first, values);
}

/// Encodes the pending values of the current group.
Result<EncodedColumn> StepEncoder::encode() {
  const ArrayInfo& info = schema_->arrays[*array_];
  const auto count = static_cast<std::size_t>(count_);
  special_ = SpecialValues::find(info, pending_.data(), stride(), count);
  if (special_) plain_ = plain_values(info, pending_.data(), stride(), count);
  auto coded = encode_plain();
  if (!coded || !special_) return coded;
  const auto referred = stored_reference(*reference_);
  if (!referred) return referred.error();
  const bool are_those_of_reference =
      !referred->empty() &&
      SpecialValues::find(info, referred->values.data(), stride(), count) == special_;
  const std::vector<std::byte> head = special_->encode(are_those_of_reference);
  coded->codec = with_special_values(coded->codec);
  coded->bytes.insert(coded->bytes.begin(), head.begin(), head.end());
  return coded;
}

/// Returns the values to which the current group may refer, without special values.
Result<ReferenceValues> StepEncoder::reference(StepReference kind) {
  const auto stored = stored_reference(kind);
  if (!stored || !special_ || stored->empty()) return stored;
  return plain_reference_.of(schema_->arrays[*array_], *stored);
}

/// Encodes the values of the current group without special values.
Result<EncodedColumn> StepEncoder::encode_plain() {
  const ArrayInfo& info = schema_->arrays[*array_];
  if (info.components > kMostStepComponents) reference_ = StepReference::nothing;
  if (info.components > kMostStepComponents || is_shuffled_)
    return encode_shuffled(kShuffledZstdLevel);
  if (level_ == Level::fast || !mesh_.has_neighbourhoods(*array_, group_)) return encode_in_terms();
  const auto elements = mesh_.elements(*array_, group_);
  if (!elements) return elements.error();
  if (!column_ && !weighted_) return choose_codec(*elements);
  const std::uint32_t segment = mesh_.segment_of(group_);
  const auto referred = reference(*reference_);
  if (!referred) return referred.error();
  if (weighted_) {
    weighted_->begin(segment, *reference_);
    return weighted_->encode(*elements, values(), *referred);
  }
  column_->begin(segment, *reference_);
  return column_->encode(*elements, values(), level_, *referred);
}

EncodedColumn StepEncoder::encode_shuffled(int zstd_level) const {
  const std::size_t width = scalar_bytes(schema_->arrays[*array_].type);
  const std::vector<std::byte> planes =
      is_rounded(*array_) ? shuffled(rounded(*array_, values()), width) : shuffled(values(), width);
  return {Codec::shuffled_zstd, pack_shuffled(planes, zstd_level)};
}

/// Chooses the codec and the reference for all groups of a step. Encodes the first group in all
/// ways that are tried, and chooses the way with the smallest result. The codec `columns` is slow.
/// It is tried only for the first values, and for values that zstd makes smaller than the codec
/// `weighted` does: they repeat in a way that `columns` may recognize, or they are noise, which
/// shuffled_zstd makes smallest.
Result<EncodedColumn> StepEncoder::choose_codec(const ColumnElements& elements) {
  const std::uint32_t segment = mesh_.segment_of(group_);
  const std::optional<StepReference> given = reference_;
  const bool is_best = level_ == Level::best;
  EncodedColumn best;
  Result<void> status;
  // Returns the number of bytes that this kind of reference must save, of a way that needs `limit`
  // bytes.
  const auto least_saving = [&](StepReference kind, std::size_t limit) -> std::size_t {
    if (limit == kUnlimitedBytes || kind == reference_ || kind == StepReference::nothing) return 0;
    if (kind == StepReference::base) return limit / kShareForBase;
    return reference_ == StepReference::nothing && !is_best ? limit / kShareForReference : 0;
  };
  // With a trend, the codec `weighted` predicts from both steps before. If the group is large, the
  // values of the step before alone are not tried then, except at level best.
  const bool trend_suffices =
      !is_best && count_ >= kManyElements && may_refer(*array_, StepReference::trend);
  const auto is_tried = [&](StepReference kind, Codec codec) {
    if (given) return kind == *given;
    return may_refer(*array_, kind) &&
           (kind != StepReference::before || !trend_suffices || codec != Codec::weighted);
  };
  // Encodes with each reference that is tried. A result replaces `best` if it is smaller than
  // `limit` bytes.
  const auto try_all = [&](Codec codec, auto& chosen, std::size_t limit, auto&& encode) {
    for (const StepReference kind : {StepReference::nothing, StepReference::before,
                                     StepReference::trend, StepReference::base}) {
      if (!is_tried(kind, codec)) continue;
      std::remove_cvref_t<decltype(*chosen)> column(*schema_, *array_);
      column.begin(segment, kind);
      const auto referred = reference(kind);
      if (!referred) {
        status = referred.error();
        return;
      }
      EncodedColumn coded = encode(column, *referred);
      if (coded.bytes.size() >= limit - (given ? 0 : least_saving(kind, limit))) continue;
      limit = coded.bytes.size();
      reference_ = kind;
      best = std::move(coded);
      column_.reset();
      weighted_.reset();
      chosen = std::move(column);
    }
  };
  const auto try_columns = [&](std::size_t limit) {
    try_all(Codec::columns, column_, limit,
            [&](StepColumnEncoder& column, const ReferenceValues& values_before) {
              slow_values_ += values().size() / scalar_bytes(schema_->arrays[*array_].type);
              return column.encode(elements, values(), level_, values_before);
            });
  };
  if (codec_ == Codec::columns) {
    try_columns(kUnlimitedBytes);
    if (!status) return status.error();
    return best;
  }
  try_all(Codec::weighted, weighted_, kUnlimitedBytes,
          [&](StepWeightedEncoder& column, const ReferenceValues& values_before) {
            return column.encode(elements, values(), values_before);
          });
  if (!status) return status.error();
  if (codec_ == Codec::weighted) return best;
  const std::size_t weighted = best.bytes.size();
  const bool packs_well = encode_shuffled(kQuickZstdLevel).bytes.size() < weighted;
  if (is_best || slow_values_ < most_slow_values_ || packs_well)
    try_columns(is_best ? weighted : weighted - weighted / kShareForSpeed);
  if (!status) return status.error();
  if (!packs_well) return best;
  EncodedColumn packed = encode_shuffled(kShuffledZstdLevel);
  if (packed.bytes.size() >= best.bytes.size()) return best;
  reference_ = given.value_or(StepReference::nothing);
  column_.reset();
  weighted_.reset();
  is_shuffled_ = true;
  return packed;
}

Result<StepEncoder::StepTerms> StepEncoder::encode_terms(StepReference kind) {
  const auto referred = reference(kind);
  if (!referred) return referred.error();
  TermColumn column(schema_->arrays[*array_], true);
  TermColumn::Elements elements;
  elements.count = values().size() / column.element_bytes();
  elements.reference = referred->values;
  auto bytes = column.encode_terms(elements, values().data(), column.element_bytes(), scratch_);
  return StepTerms{column.refers(), {Codec::terms, std::move(bytes)}};
}

Result<EncodedColumn> StepEncoder::encode_in_terms() {
  if (reference_) {
    auto coded = encode_terms(*reference_);
    if (!coded) return coded.error();
    return std::move(coded->column);
  }
  if (may_refer(*array_, StepReference::before)) return choose_terms();
  const StepReference kind =
      may_refer(*array_, StepReference::base) ? StepReference::base : StepReference::nothing;
  auto coded = encode_terms(kind);
  if (!coded) return coded.error();
  reference_ = coded->refers ? kind : StepReference::nothing;
  if (!coded->refers) before_[*array_].base_bytes = coded->column.bytes.size();
  return std::move(coded->column);
}

/// Chooses the reference for all groups of a step that is coded with the codec `terms`, by encoding
/// the first group. Keeps the reference of the previous step, unless the first group now needs over
/// 25 % more bytes than it needed when that reference was chosen.
Result<EncodedColumn> StepEncoder::choose_terms() {
  Before& before = before_[*array_];
  // After two steps for which references did not pay, only some of the next steps try them again.
  const bool tries = before.alone < 2 || before.alone % kStepsAlone == 0;
  if (before.alone >= 2) ++before.alone;
  if (!tries) {
    auto alone = encode_terms(StepReference::nothing);
    if (!alone) return alone.error();
    before.base_bytes = alone->column.bytes.size();
    reference_ = StepReference::nothing;
    return std::move(alone->column);
  }
  if (before.liked_bytes > 0 && may_refer(*array_, before.liked)) {
    auto coded = encode_terms(before.liked);
    if (!coded) return coded.error();
    if (coded->column.bytes.size() <= before.liked_bytes + before.liked_bytes / 4) {
      reference_ = coded->refers ? before.liked : StepReference::nothing;
      return std::move(coded->column);
    }
  }
  auto best = encode_terms(StepReference::before);
  if (!best) return best.error();
  before.liked = StepReference::before;
  const bool may_follow_trend = may_refer(*array_, StepReference::trend);
  if (may_follow_trend) {
    auto trend = encode_terms(StepReference::trend);
    if (!trend) return trend.error();
    if (trend->column.bytes.size() < best->column.bytes.size()) {
      *best = std::move(*trend);
      before.liked = StepReference::trend;
    }
  }
  if (!saves_enough(best->column.bytes.size(), before.base_bytes)) {
    // The values differ so much from those before that this step may become a base.
    auto alone = encode_terms(StepReference::nothing);
    if (!alone) return alone.error();
    if (!saves_enough(best->column.bytes.size(), alone->column.bytes.size())) {
      before.liked_bytes = 0;
      before.base_bytes = alone->column.bytes.size();
      if (before.alone < 2) ++before.alone;
      reference_ = StepReference::nothing;
      return std::move(alone->column);
    }
  }
  before.alone = 0;
  // If one of the kinds of references was not allowed at this step, the next step compares all
  // kinds again.
  before.liked_bytes =
      may_follow_trend || most_ < StepReference::trend ? best->column.bytes.size() : 0;
  reference_ = best->refers ? before.liked : StepReference::nothing;
  return std::move(best->column);
}

Result<void> StepEncoder::end_step() {
  if (!array_) return {};
  const ArrayInfo& info = schema_->arrays[*array_];
  const std::uint64_t got = (waits_ ? 0 : first_) + pending_.size() / stride();
  if (got != elements_[*array_])
    return misuse("array '" + info.name + "' got " + std::to_string(got) + " elements at step " +
                      std::to_string(step_) + ", the mesh has " +
                      std::to_string(elements_[*array_]),
                  "steps");
  if (!waits_) {
    end_encoding();
    return {};
  }
  waiting_bytes_ += pending_.size() + kBytesAroundWaiting;
  waiting_.push_back({*array_, step_, std::exchange(pending_, {})});
  array_.reset();
  return waiting_bytes_ > most_waiting_bytes_ ? encode_waiting() : Result<void>();
}

void StepEncoder::end_encoding() {
  Before& before = before_[*array_];
  const StepReference kind = reference_.value_or(StepReference::nothing);
  before.run = container::is_key(kind) ? 1 : before.run + 1;
  if (kind == StepReference::nothing) before.base = step_;
  array_.reset();
  column_.reset();
  weighted_.reset();
}

Result<void> StepEncoder::end_steps() {
  if (auto status = end_step(); !status) return status;
  return encode_waiting();
}

// --- steps that wait, and bundles

/// Returns true if steps of this array wait for other steps: they are small, and one group has all
/// elements of the array.
bool StepEncoder::may_wait(std::uint32_t array) {
  if (!bundle_sink_ || elements_[array] == 0) return false;
  const ArrayInfo& info = schema_->arrays[array];
  if (part_ && part_->all[array] != elements_[array]) return false;
  const std::uint64_t stride = scalar_bytes(info.type) * info.components;
  if (elements_[array] > kMostWaitingStep / stride) return false;
  const auto group = mesh_.nth_group(array, 0, mesh_.groups() - 1);
  return group && *group != nullptr && (*group)->count == elements_[array];
}

/// Bundles of arrays that wait for the same steps. The bundles are not written yet.
class StepEncoder::Bundles {
 public:
  /// `first` is the first step, `steps` the number of steps.
  Bundles(const StepEncoder& encoder, std::uint64_t first, std::uint64_t steps)
      : encoder_(&encoder), first_(first), steps_(steps) {}

  /// Adds an array. Returns false if no bundle can contain the array. An array whose columns are
  /// all in a bundle already, or need no values, is added to that bundle.
  bool add(const WaitingArray& it) {
    for (OneBundle& bundle : bundles_)
      if (bundle.encoder.needs_no_values(it.columns) && add(it, bundle)) return true;
    if (!bundles_.empty() && add(it, bundles_.back())) return true;
    const Level level = encoder_->level_;
    OneBundle next(level == Level::fast ? 1 : level == Level::best ? 19 : 12);
    if (!add(it, next)) return false;
    bundles_.push_back(std::move(next));
    return true;
  }
  /// Encodes all bundles. No other array may be added afterwards.
  void finish() {
    for (OneBundle& it : bundles_) {
      it.bytes = it.encoder.finish();
      it.parts[0].bytes = it.bytes.size();
    }
  }
  /// Returns the approximate number of bytes that the finished bundles need in the file.
  std::size_t bytes() const {
    std::size_t bytes = 0;
    for (const OneBundle& it : bundles_) bytes += it.bytes.size() + kBytesAroundBundle;
    return bytes;
  }
  /// Writes the finished bundles.
  Result<void> write(StepEncoder& encoder) const {
    for (const OneBundle& it : bundles_) {
      encoder.bundle_pairs_ += it.pairs;
      encoder.written_ += it.bytes.size();
      if (auto status = encoder.bundle_sink_(it.parts, it.bytes); !status) return status;
    }
    return {};
  }

 private:
  struct OneBundle {
    explicit OneBundle(int zstd_level) : encoder(zstd_level) {}

    BundleEncoder encoder;
    std::vector<container::StepPart> parts;
    std::uint64_t pairs = 0;
    std::vector<std::byte> bytes;
  };

  /// Adds an array to a bundle. Returns false, and adds nothing, if the bundle would exceed a
  /// limit.
  bool add(const WaitingArray& it, OneBundle& to) const {
    const std::uint64_t count = encoder_->elements_[it.array];
    bool continues = false;
    if (!to.parts.empty()) {
      const container::StepHeader& last = to.parts.back().header;
      continues = last.array + last.arrays == it.array && last.count == count;
      if (last.group != it.group || to.pairs + steps_ > container::kMostBundlePairs ||
          (!continues && to.parts.size() == container::kMostStepParts))
        return false;
    }
    if (!to.encoder.add(it.columns)) return false;
    to.pairs += steps_;
    if (continues) {
      ++to.parts.back().header.arrays;
      to.parts.back().digest += it.digest;
      return true;
    }
    to.parts.emplace_back().digest = it.digest;
    container::StepHeader& header = to.parts.back().header;
    header.array = it.array;
    header.step = header.reference_step = first_;
    header.steps = steps_;
    header.group = it.group;
    header.count = count;
    header.codec = Codec::bundle;
    return true;
  }

  const StepEncoder* encoder_;
  std::uint64_t first_, steps_;
  std::vector<OneBundle> bundles_;
};

/// Encodes the steps that wait. Arrays that wait for the same consecutive steps are encoded as
/// bundles, unless they are smaller as ordinary parts.
Result<void> StepEncoder::encode_waiting() {
  const std::vector<Waiting> waiting = std::exchange(waiting_, {});
  waiting_bytes_ = 0;
  std::map<std::uint32_t, std::vector<const Waiting*>> of_array;
  for (const Waiting& it : waiting) of_array[it.array].push_back(&it);
  // Arrays by the first step and the number of steps; the number is 0 if steps are missing. An
  // array that has too many values for a bundle is divided into several runs of steps.
  std::map<std::pair<std::uint64_t, std::uint64_t>, std::vector<WaitingArray>> sets;
  for (const auto& [array, steps] : of_array) {
    const std::uint64_t values = elements_[array] * schema_->arrays[array].components;
    const auto most =
        static_cast<std::size_t>(std::max<std::uint64_t>(kMostBundleValues / values, 1));
    const std::size_t runs = (steps.size() + most - 1) / most;
    for (std::size_t run = 0; run < runs; ++run) {
      const std::size_t begin = run * steps.size() / runs, end = (run + 1) * steps.size() / runs;
      const std::uint64_t first = steps[begin]->step, last = steps[end - 1]->step;
      const bool consecutive = last - first == end - begin - 1;
      WaitingArray& it = sets[{first, consecutive ? end - begin : 0}].emplace_back();
      it.array = array;
      it.steps.assign(steps.begin() + static_cast<std::ptrdiff_t>(begin),
                      steps.begin() + static_cast<std::ptrdiff_t>(end));
      for (const Waiting* of_step : it.steps) it.values.push_back(of_step->values);
    }
  }
  for (auto& [range, arrays] : sets)
    if (auto status = encode_set(range.first, range.second, arrays); !status) return status;
  return {};
}

/// Encodes and writes arrays that wait for the same steps.
Result<void> StepEncoder::encode_set(std::uint64_t first, std::uint64_t steps,
                                     std::vector<WaitingArray>& arrays) {
  const std::uint64_t pairs = steps * arrays.size();
  const bool may_bundle = steps > 0 && steps <= container::kMostBundlePairs &&
                          bundle_pairs_ + pairs <= container::most_bundle_pairs(written_);
  BundlePlanner planner(steps);
  Bundles all(*this, first, steps), mixed(*this, first, steps);
  for (WaitingArray& it : arrays) {
    if (may_bundle) {
      const auto group = group_of(it.array);
      if (!group) return group.error();
      it.group = *group;
      for (const Waiting* of_step : it.steps) {
        const auto digest = digest_of(it.array, of_step->step, it.group, 0, of_step->values);
        if (!digest) return digest.error();
        it.digest += *digest;
      }
      it.columns = planner.plan(schema_->arrays[it.array], it.values);
      for (const auto& column : it.columns) it.bundled += column->bytes;
      it.is_bundled = all.add(it);
    }
    const std::uint64_t values = elements_[it.array] * schema_->arrays[it.array].components;
    if (it.is_bundled && values <= kTinyStep && pairs > kFewPairs) continue;
    if (auto status = encode_parts(it); !status) return status;
  }
  all.finish();

  // Compares three ways: bundles of all arrays, bundles of those arrays that seem smaller there,
  // and ordinary parts of all arrays. An array that fits into no bundle is always in parts.
  const auto bytes_of_parts = [&](auto&& includes) {
    std::size_t bytes = 0;
    for (const WaitingArray& it : arrays)
      if (includes(it)) bytes += it.bytes_of_parts();
    return bytes;
  };
  const auto never_bundled = [](const WaitingArray& it) { return !it.is_bundled; };
  // Ordinary parts may be slightly larger, because a reader of one array reads less of them. At
  // level best, the smallest way is chosen.
  const auto with_grace = [&](std::size_t bytes) {
    return level_ == Level::best ? bytes : bytes + bytes / kGraceOfParts;
  };
  const auto prefers_parts = [&](const WaitingArray& it) {
    return !it.parts.empty() && (!it.is_bundled || it.bytes_of_parts() <= with_grace(it.bundled));
  };
  const auto is_tried = [](const WaitingArray& it) { return !it.parts.empty(); };
  std::function<bool(const WaitingArray&)> is_in_parts = never_bundled;
  const Bundles* bundles = &all;
  std::size_t best = all.bytes() + bytes_of_parts(never_bundled);
  if (std::any_of(arrays.begin(), arrays.end(), prefers_parts)) {
    bool are_all_added = true;
    for (const WaitingArray& it : arrays)
      if (!prefers_parts(it)) are_all_added = mixed.add(it) && are_all_added;
    mixed.finish();
    if (const std::size_t bytes = mixed.bytes() + bytes_of_parts(prefers_parts);
        are_all_added && bytes < with_grace(best)) {
      best = bytes;
      is_in_parts = prefers_parts;
      bundles = &mixed;
    }
    if (std::all_of(arrays.begin(), arrays.end(), is_tried) &&
        bytes_of_parts(is_tried) < with_grace(best)) {
      is_in_parts = is_tried;
      bundles = nullptr;
    }
  }
  if (bundles != nullptr)
    if (auto status = bundles->write(*this); !status) return status;

  std::vector<EncodedPart> parts;
  for (WaitingArray& it : arrays) {
    if (is_in_parts(it)) {
      for (EncodedPart& part : it.parts) parts.push_back(std::move(part));
      continue;
    }
    Before& before = before_[it.array];
    for (const Waiting* of_step : it.steps)
      if (auto status = remember(it.array, 0, of_step->values, true); !status) return status;
    before.encoded_step = it.steps.back()->step;
    before.base = before.encoded_step;
    before.run = 1;
  }
  std::stable_sort(parts.begin(), parts.end(), [](const EncodedPart& a, const EncodedPart& b) {
    return a.header.step < b.header.step;
  });
  for (const EncodedPart& part : parts) {
    written_ += part.bytes.size();
    if (auto status = sink_(part.header, part.first, part.bytes, part.digest); !status)
      return status;
  }
  return {};
}

/// Returns the approximate number of bytes that the ordinary parts need in the file.
std::size_t StepEncoder::WaitingArray::bytes_of_parts() const {
  std::size_t bytes = 0;
  for (const EncodedPart& part : parts) bytes += part.bytes.size() + kBytesAroundPart;
  return bytes;
}

/// Returns the group that has all elements of an array. Precondition: may_wait() is true.
Result<std::uint32_t> StepEncoder::group_of(std::uint32_t array) {
  const auto group = mesh_.nth_group(array, 0, mesh_.groups() - 1);
  if (!group) return group.error();
  return (*group)->group;
}

/// Encodes the steps of an array as ordinary parts. If the first steps show that a bundle is
/// smaller, encodes no other steps, and returns no parts.
Result<void> StepEncoder::encode_parts(WaitingArray& array) {
  // Restores the sink at the end, also if memory runs out.
  struct Redirected {
    Sink& sink;
    Sink before;
    ~Redirected() { sink = std::move(before); }
  } redirected{sink_, sink_};
  sink_ = [&](const auto& header, auto first, auto bytes, auto digest) {
    array.parts.push_back({header, first, {bytes.begin(), bytes.end()}, digest});
    return Result<void>();
  };
  Result<void> status;
  for (std::size_t s = 0; s < array.steps.size() && status; ++s) {
    begin_encoding(array.array, array.steps[s]->step);
    status = encode_values(array.steps[s]->values);
    if (!status) break;
    end_encoding();
    if (s + 1 != kTriedSteps || s + 1 == array.steps.size() || !array.is_bundled) continue;
    // Steps without a reference are larger than others. The first of these steps has none.
    const std::size_t first = array.parts[0].bytes.size();
    const std::size_t others = (array.bytes_of_parts() - first) / (kTriedSteps - 1);
    const std::size_t doubt = array.bundled / (level_ == Level::fast ? kGraceOfParts : 1);
    if (first + others * (array.steps.size() - 1) > array.bundled + doubt) {
      array.parts.clear();
      break;
    }
  }
  return status;
}

}  // namespace shm
