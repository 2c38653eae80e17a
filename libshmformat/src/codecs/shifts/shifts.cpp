#include "codecs/shifts/shifts.h"

#include <algorithm>

namespace shm {
namespace {

constexpr int kShiftZstdLevel = 1;

std::uint64_t key_of(const Shift& shift, std::uint32_t nodes) {
  std::uint64_t key = shift.marks.block;
  const auto mix = [&](std::uint64_t v) { key = (key ^ v) * 0x9e3779b97f4a7c15u; };
  mix(shift.marks.introduced);
  mix(shift.marks.imports);
  mix(shift.marks.last_use);
  for (std::uint32_t i = 0; i < nodes; ++i) mix(shift.by[i]);
  return key ^ key >> 32;
}

}  // namespace

bool takes_shifts(const Schema& schema) {
  return schema.delay == 0 &&
         std::all_of(schema.blocks.begin(), schema.blocks.end(),
                     [](const BlockInfo& block) {
                       return block.nodes_per_cell > 0 && block.nodes_per_cell <= kMostShiftNodes;
                     }) &&
         std::none_of(schema.arrays.begin(), schema.arrays.end(), [](const ArrayInfo& array) {
           return array.per_step && is_on_mesh(array.location) &&
                  array.components > kMostShiftStepComponents;
         });
}

ShiftTable::ShiftTable(const Schema& schema) : last_(schema.blocks.size()) {
  for (const BlockInfo& block : schema.blocks) nodes_.push_back(block.nodes_per_cell);
  for (std::uint32_t nodes : nodes_) most_nodes_ = std::max<std::size_t>(most_nodes_, nodes);
}

std::size_t ShiftTable::add(const Shift& shift) {
  const std::size_t place = next_;
  next_ = (next_ + 1) % kPlaces;
  if (place == shifts_.size())
    shifts_.push_back(shift);
  else
    shifts_[place] = shift;
  return place;
}

ShiftEncoder::ShiftEncoder(const Schema& schema, bool may_import)
    : table_(schema), may_import_(may_import) {}

/// Returns the index of a shift in the table, or the size of the table if it does not contain the
/// shift.
std::size_t ShiftEncoder::find(const Shift& shift, std::uint32_t nodes) const {
  const std::uint64_t key = key_of(shift, nodes);
  for (std::size_t place = 0; place < keys_.size(); ++place) {
    const Shift& other = table_.at(place);
    if (keys_[place] == key && other.marks == shift.marks &&
        std::equal(shift.by.begin(), shift.by.begin() + nodes, other.by.begin()))
      return place;
  }
  return table_.size();
}

void ShiftEncoder::add_cell(const CellMarks& marks, std::span<const std::uint64_t> numbers) {
  const auto nodes = static_cast<std::uint32_t>(numbers.size());
  std::uint64_t* const last = table_.last(marks.block).data();
  // First try the successor of the previous shift: the shift that came after it the last time. The
  // current shift is almost always this successor.
  const std::size_t guess = table_.size() == 0 ? 0 : followed_[last_place_];
  const Shift& guessed = table_.size() == 0 ? shift_ : table_.at(guess);
  std::uint64_t differs = 0;
  for (std::uint32_t i = 0; i < nodes; ++i) {
    const std::uint64_t by = numbers[i] - last[i];
    differs |= by ^ guessed.by[i];
    shift_.by[i] = by;
    last[i] = numbers[i];
  }
  shift_.marks = marks;
  std::size_t place = guess;
  if (table_.size() == 0 || differs != 0 || !(guessed.marks == marks)) place = find(shift_, nodes);
  if (place < table_.size()) {
    symbols_.push_back(static_cast<std::uint8_t>(place));
  } else {
    symbols_.push_back(ShiftTable::kNew);
    write(shift_, nodes);
    place = table_.add(shift_);
    keys_.resize(table_.size());
    followed_.resize(table_.size());
    keys_[place] = key_of(shift_, nodes);
    followed_[place] = static_cast<std::uint8_t>(place);
  }
  followed_[last_place_] = static_cast<std::uint8_t>(place);
  last_place_ = place;
}

void ShiftEncoder::write(const Shift& shift, std::uint32_t nodes) {
  bytes_.put_varint(shift.marks.block);
  for (std::uint32_t i = 0; i < nodes; ++i)
    bytes_.put_signed(static_cast<std::int64_t>(shift.by[i]));
  bytes_.put_varint(shift.marks.introduced);
  if (may_import_) bytes_.put_varint(shift.marks.imports);
  bytes_.put_varint(shift.marks.last_use);
}

void ShiftEncoder::add_unused(std::uint64_t number) {
  bytes_.put_signed(static_cast<std::int64_t>(number - last_unused_));
  last_unused_ = number;
}

std::vector<std::byte> ShiftEncoder::packed(ZstdCompressor& zstd) const {
  ByteWriter all = bytes_, out;
  out.put_varint(bytes_.bytes.size());
  all.put_bytes(std::as_bytes(std::span(symbols_)));
  out.put_bytes(zstd.compress(all.bytes, kShiftZstdLevel));
  return std::move(out.bytes);
}

std::vector<std::byte> ShiftEncoder::finish(ZstdCompressor& zstd) {
  std::vector<std::byte> out = packed(zstd);
  bytes_.bytes.clear();
  symbols_.clear();
  return out;
}

ShiftDecoder::ShiftDecoder(const Schema& schema, bool may_import)
    : table_(schema), may_import_(may_import) {}

bool ShiftDecoder::begin_group(std::span<const std::byte> bytes, std::uint32_t cells,
                               std::uint64_t limit, ZstdDecompressor& zstd) {
  ByteReader in(bytes);
  const std::uint64_t before = in.get_varint();  // size in bytes of the data that precede the
                                                 // symbols
  if (!in.ok() || before > limit) return false;
  if (!zstd.decompress(in.get_bytes(in.left()), before + cells, unpacked_)) return false;
  const auto split = static_cast<std::size_t>(before);
  bytes_ = ByteReader(std::span<const std::byte>(unpacked_).first(split));
  symbols_ = std::span<const std::byte>(unpacked_).subspan(split);
  next_symbol_ = 0;
  return true;
}

auto ShiftDecoder::next_cells(std::uint64_t* numbers, std::size_t most) -> Cells {
  if (next_symbol_ == symbols_.size()) return {nullptr, 0};
  const std::byte symbol = symbols_[next_symbol_++];
  const auto place = std::to_integer<std::size_t>(symbol);
  const bool is_new = place == ShiftTable::kNew;
  if (!is_new && place >= table_.size()) return {nullptr, 0};
  const Shift* shift = is_new ? read_shift() : &table_.at(place);
  if (shift == nullptr) return {nullptr, 0};
  std::size_t count = 1;
  if (!is_new)
    for (; count < most && next_symbol_ < symbols_.size() && symbols_[next_symbol_] == symbol;
         ++count)
      ++next_symbol_;
  std::uint64_t* const last = table_.last(shift->marks.block).data();
  const std::uint32_t nodes = table_.nodes(shift->marks.block);
  for (std::size_t c = 0; c < count; ++c)
    for (std::uint32_t i = 0; i < nodes; ++i) *numbers++ = last[i] += shift->by[i];
  return {&shift->marks, count};
}

const Shift* ShiftDecoder::read_shift() {
  const std::uint64_t block = bytes_.get_varint();
  if (!bytes_.ok() || block >= table_.blocks()) return nullptr;
  shift_ = {};
  CellMarks& marks = shift_.marks;
  marks.block = static_cast<std::uint32_t>(block);
  const std::uint32_t nodes = table_.nodes(marks.block);
  if (nodes > kMostShiftNodes) return nullptr;
  for (std::uint32_t i = 0; i < nodes; ++i)
    shift_.by[i] = static_cast<std::uint64_t>(bytes_.get_signed());
  marks.introduced = bytes_.get_varint();
  if (may_import_) marks.imports = bytes_.get_varint();
  marks.last_use = bytes_.get_varint();
  const std::uint64_t beyond = nodes == 64 ? 0 : ~std::uint64_t{0} << nodes;
  if (!bytes_.ok() || ((marks.introduced | marks.last_use) & beyond) != 0 ||
      (marks.imports & ~marks.introduced) != 0)
    return nullptr;
  return &table_.at(table_.add(shift_));
}

std::optional<std::uint64_t> ShiftDecoder::next_unused() {
  last_unused_ += static_cast<std::uint64_t>(bytes_.get_signed());
  return bytes_.ok() ? std::optional(last_unused_) : std::nullopt;
}

}  // namespace shm
