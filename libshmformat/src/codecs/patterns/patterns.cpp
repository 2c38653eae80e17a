#include "codecs/patterns/patterns.h"

#include <algorithm>
#include <cstring>

#include "codecs/patterns/byte_planes.h"

namespace shm {
namespace {

using namespace pattern_source;

/// Initial size of a segment's history: 2^kFirstHistoryBits cells. After each group, the encoder
/// counts the nodes whose vertices no remembered cell contains. If there is more than one of these
/// nodes per kMissedShare cells, the encoder doubles the history.
constexpr std::uint32_t kFirstHistoryBits = 16;
constexpr std::uint64_t kMissedShare = 64;

/// The decoder prefetches the pattern of the cell that follows the current cell at this distance.
constexpr std::size_t kAhead = 8;
inline void prefetch([[maybe_unused]] const std::uint8_t* bytes) {
#if defined(__GNUC__)
  __builtin_prefetch(bytes);
#endif
}

std::uint32_t words_of_uses(std::uint32_t nodes) { return (nodes + 31) / 32; }

std::vector<std::uint32_t> nodes_by_block(const Schema& schema) {
  std::vector<std::uint32_t> nodes;
  for (const BlockInfo& block : schema.blocks) nodes.push_back(block.nodes_per_cell);
  return nodes;
}

}  // namespace

// --- encoding

PatternEncoder::PatternEncoder(const Schema& schema, bool numbered)
    : numbered_(numbered),
      history_(most_nodes(schema)),
      nodes_(nodes_by_block(schema)),
      patterns_(schema.blocks.size()) {
  history_.reach(kFirstHistoryBits);
}

void PatternEncoder::add_cell(const PatternCell& cell, std::span<const std::uint32_t> handles,
                              std::span<const std::uint64_t> numbers) {
  const auto nodes = static_cast<std::uint32_t>(handles.size());
  slots_.resize(nodes);
  ops_.resize(2 * nodes);
  for (std::uint32_t i = 0; i < nodes; ++i)
    slots_[i] = (cell.introduced >> i & 1) != 0
                    ? at_slot(slot_of_, handles[i]) = history_.introduce()
                    : slot_of_[handles[i]];
  if (history_.slots() > 0) make_room_soon(uses_, history_.slots() - 1);
  find_nodes(cell, numbers);
  for (std::uint64_t left = cell.last_use; left != 0; left &= left - 1) {
    const std::uint32_t slot = slots_[static_cast<std::size_t>(std::countr_zero(left))];
    if (history_.is_live(slot)) history_.finalize(slot);
  }
  if (runs_.empty() || runs_.back().block != cell.block) runs_.push_back({cell.block, 0});
  ++runs_.back().cells;
  ids_.push_back(pattern_of(cell.block, nodes));
  for (std::uint32_t w = 0; w < words_of_uses(history_.stride()); ++w)
    last_use_.push_back(static_cast<std::uint32_t>(cell.last_use >> 32 * w));
}

/// For each node of the cell, finds the source, which specifies an earlier cell with the same
/// vertex.
void PatternEncoder::find_nodes(const PatternCell& cell, std::span<const std::uint64_t> numbers) {
  const std::uint32_t here = history_.next();
  const PatternHistory::References& on = history_.references();
  Candidates cells;
  cells.fill(here);
  cells[kBefore] = here - 1;
  for (std::uint32_t i = 0; i < on.count; ++i) cells[kOn + i] = on.cells[i] + 1;
  references_ = {};
  again_ = 0;
  auto number = numbers.begin();
  for (std::uint32_t i = 0; i < slots_.size(); ++i) {
    Uses& uses = uses_[slots_[i]];
    Op op;
    if ((cell.introduced >> i & 1) != 0) {
      op = {kNew, (cell.imports >> i & 1) != 0 ? new_vertex::kImported : 0};
      if (numbered_) {
        if (*number != last_number_ + 1) {
          op.node |= new_vertex::kNumbered;
          numbers_.put_signed(static_cast<std::int64_t>(*number - last_number_));
        }
        last_number_ = *number++;
      }
      uses.begin(here, i);
    } else if (uses.cells[0] == here) {
      op = {kHere, uses.nodes[0]};
      again_ |= std::uint64_t{1} << i;
    } else {
      op = find(cells, i, uses);
      if (i < kUsersOf) {
        cells[kUsers + 2 * i] = uses.cells[0];
        cells[kUsers + 2 * i + 1] = uses.cells[1];
      }
      uses.add(here, i);
    }
    ops_[2 * i] = static_cast<std::uint8_t>(op.source);
    ops_[2 * i + 1] = static_cast<std::uint8_t>(op.node);
  }
  history_.pass_cell(references_);
}

/// Finds an earlier cell that contains the vertex of `node`. Returns the source that specifies this
/// cell, and the node of the vertex in this cell.
auto PatternEncoder::find(const Candidates& cells, std::uint32_t node, const Uses& uses) -> Op {
  const std::uint32_t sources = kUsers + 2 * std::min(node, kUsersOf);
  // First try the two cells that used the vertex most recently, since they are the most likely.
  for (const std::size_t use : {0u, 2u})
    for (std::uint32_t source = kBefore; source < sources; ++source) {
      if (cells[source] != uses.cells[use] && cells[source] != uses.cells[use + 1]) continue;
      if (!history_.remembers(cells[source])) continue;
      if (source != kBefore) references_.add(cells[source]);
      return {source, uses.nodes[cells[source] == uses.cells[use] ? use : use + 1]};
    }
  if (!history_.remembers(uses.cells[0])) {
    ++missed_;
    slot_list_.push_back(slots_[node]);
    return {kSlot, 0};
  }
  references_.add(uses.cells[0]);
  distances_.push_back(history_.next() - uses.cells[0]);
  return {kFar, uses.nodes[0]};
}

void PatternEncoder::Patterns::grow() {
  if (2 * (keys.size() + 1) <= table.size()) return;
  table.assign(std::max<std::size_t>(2 * table.size(), 64), 0);
  for (std::uint32_t pattern = 0; pattern < keys.size(); ++pattern)
    table[find(keys[pattern], [](std::uint32_t) { return false; })] = pattern + 1;
}

/// Returns the index of the current pattern in the list of its block.
std::uint32_t PatternEncoder::pattern_of(std::uint32_t block, std::uint32_t nodes) {
  Patterns& patterns = patterns_[block];
  const std::size_t bytes = 2 * nodes;
  const auto matches = [&](std::uint32_t pattern) {
    const std::uint8_t* const ops = patterns.ops.data() + pattern * bytes;
    // a constant size lets the compiler inline the comparison
    return bytes == 16 ? std::memcmp(ops, ops_.data(), 16) == 0
                       : std::memcmp(ops, ops_.data(), bytes) == 0;
  };
  if (!patterns.uses.empty() && matches(patterns.last)) {
    ++patterns.uses[patterns.last];
    return patterns.last;
  }
  std::uint64_t key = 0;
  for (std::size_t i = 0; i < bytes; i += 8) {
    std::uint64_t word = 0;
    std::memcpy(&word, ops_.data() + i, std::min<std::size_t>(8, bytes - i));
    key = (key ^ word) * 0x9e3779b97f4a7c15u;
    key ^= key >> 29;
  }
  patterns.grow();
  std::uint32_t& found = patterns.table[patterns.find(key, matches)];
  if (found != 0) {
    patterns.last = found - 1;
    ++patterns.uses[patterns.last];
    return patterns.last;
  }
  patterns.last = static_cast<std::uint32_t>(patterns.uses.size());
  found = patterns.last + 1;
  patterns.keys.push_back(key);
  patterns.uses.push_back(1);
  patterns.ops.insert(patterns.ops.end(), ops_.begin(), ops_.end());
  return patterns.last;
}

void PatternEncoder::add_unused(std::uint64_t number) {
  if (!numbered_) return;
  numbers_.put_signed(static_cast<std::int64_t>(number - last_number_));
  last_number_ = number;
}

std::vector<std::byte> PatternEncoder::finish(ZstdCompressor& zstd) {
  ByteWriter out;
  std::vector<std::byte> scratch;
  out.put_u8(static_cast<std::uint8_t>(history_.bits()));
  out.put_varint(runs_.size());
  for (const Run& run : runs_) {
    out.put_varint(run.block);
    out.put_varint(run.cells);
  }
  // Sort the patterns by descending frequency, so that most indices are small. Patterns with equal
  // frequency are sorted by their bytes.
  struct Place {
    std::uint32_t uses, pattern;
    // Returns the first eight bytes of the pattern as a number whose most significant byte is the
    // first byte
    std::uint64_t first;
  };
  std::vector<Place> order;
  std::vector<std::vector<std::uint32_t>> places(patterns_.size());
  for (std::uint32_t b = 0; b < patterns_.size(); ++b) {
    Patterns& patterns = patterns_[b];
    if (patterns.uses.empty()) continue;
    const std::size_t count = patterns.uses.size(), bytes = 2 * nodes_[b];
    order.clear();
    for (std::uint32_t p = 0; p < count; ++p) {
      std::uint64_t first = 0;
      for (std::size_t k = 0; k < std::min<std::size_t>(bytes, 8); ++k)
        first = first << 8 | patterns.ops[p * bytes + k];
      order.push_back({patterns.uses[p], p, first});
    }
    std::sort(order.begin(), order.end(), [&](const Place& x, const Place& y) {
      if (x.uses != y.uses) return x.uses > y.uses;
      if (x.first != y.first) return x.first < y.first;
      return std::memcmp(patterns.ops.data() + x.pattern * bytes,
                         patterns.ops.data() + y.pattern * bytes, bytes) < 0;
    });
    places[b].resize(count);
    for (std::size_t i = 0; i < count; ++i)
      places[b][order[i].pattern] = static_cast<std::uint32_t>(i);
    out.put_varint(count);
    scratch.resize(count * bytes);
    for (std::size_t k = 0; k < bytes; ++k)
      for (std::size_t i = 0; i < count; ++i)
        scratch[k * count + i] = std::byte{patterns.ops[order[i].pattern * bytes + k]};
    put_plane(out, scratch, zstd);
  }
  std::size_t cell = 0;
  for (const Run& run : runs_)
    for (std::uint32_t i = 0; i < run.cells; ++i, ++cell)
      ids_[cell] = places[run.block][ids_[cell]];
  for (auto* list : {&ids_, &last_use_, &distances_, &slot_list_}) {
    if (list == &distances_ || list == &slot_list_) out.put_varint(list->size());
    put_numbers(out, std::span<const std::uint32_t>(*list), scratch, zstd);
  }
  out.put_varint(numbers_.bytes.size());
  put_plane(out, numbers_.bytes, zstd);

  if (missed_ * kMissedShare > ids_.size() && history_.may_reach(history_.bits() + 1))
    history_.reach(history_.bits() + 1);
  missed_ = 0;
  patterns_.assign(patterns_.size(), {});
  runs_.clear();
  ids_.clear();
  last_use_.clear();
  distances_.clear();
  slot_list_.clear();
  numbers_.bytes.clear();
  return std::move(out.bytes);
}

// --- decoding

PatternDecoder::PatternDecoder(const Schema& schema, bool numbered, bool may_import,
                               std::uint64_t first_vertex)
    : numbered_(numbered),
      may_import_(may_import),
      history_(most_nodes(schema)),
      nodes_(nodes_by_block(schema)),
      words_of_uses_(words_of_uses(history_.stride())),
      next_own_(first_vertex),
      patterns_(schema.blocks.size()) {}

bool PatternDecoder::begin_group(std::span<const std::byte> bytes, std::uint32_t cells,
                                 std::uint64_t nodes, std::uint64_t most_number_bytes,
                                 ZstdDecompressor& zstd) {
  ByteReader in(bytes);
  const std::uint8_t bits = in.get_u8();
  if (!in.ok() || !history_.may_reach(bits) || bits < history_.bits()) return false;
  history_.reach(bits);
  runs_.clear();
  std::vector<std::uint64_t> of_block(nodes_.size());
  std::uint64_t left = cells;
  for (std::uint64_t count = in.get_count(2); count > 0; --count) {
    const std::uint64_t block = in.get_varint(), run = in.get_varint();
    if (!in.ok() || block >= nodes_.size() || run == 0 || run > left) return false;
    runs_.push_back({static_cast<std::uint32_t>(block), static_cast<std::uint32_t>(run)});
    of_block[static_cast<std::size_t>(block)] += run;
    left -= run;
  }
  if (!in.ok() || left != 0) return false;
  std::vector<std::byte> planes;
  for (std::size_t b = 0; b < nodes_.size(); ++b) {
    patterns_[b].clear();
    if (of_block[b] == 0) continue;
    const std::uint64_t count = in.get_varint(), each = 2 * nodes_[b];
    if (!in.ok() || count == 0 || count > of_block[b] || of_block[b] * nodes_[b] > nodes ||
        !get_plane(in, count * each, planes, zstd))
      return false;
    patterns_[b].resize(planes.size());
    std::uint8_t* op = patterns_[b].data();
    const auto patterns = static_cast<std::size_t>(count);
    for (std::size_t i = 0; i < patterns; ++i)
      for (std::uint32_t node = 0; node < nodes_[b]; ++node, op += 2) {
        op[0] = std::to_integer<std::uint8_t>(planes[2 * node * patterns + i]);
        op[1] = std::to_integer<std::uint8_t>(planes[(2 * node + 1) * patterns + i]);
        if (!may_be(op[0], op[1], node)) return false;
      }
  }
  const std::uint64_t uses = std::uint64_t{cells} * words_of_uses(history_.stride());
  if (!get_numbers(in, cells, ids_, planes, zstd) ||
      !get_numbers(in, uses, last_use_, planes, zstd))
    return false;
  for (auto* list : {&distances_, &slot_list_}) {
    const std::uint64_t count = in.get_varint();
    if (!in.ok() || count > nodes || !get_numbers(in, count, *list, planes, zstd)) return false;
  }
  const std::uint64_t count = in.get_varint();
  if (!in.ok() || count > most_number_bytes || !get_plane(in, count, numbers_bytes_, zstd) ||
      in.left() != 0)
    return false;
  history_.expect(cells);
  numbers_ = ByteReader(numbers_bytes_);
  run_ = in_run_ = 0;
  next_id_ = next_use_ = next_distance_ = next_slot_ = 0;
  return true;
}

/// Returns true if a pattern may contain `source` and `place` for the node at index `node`. `place`
/// is the node in the source cell. For a new vertex, it contains the flags of the vertex.
bool PatternDecoder::may_be(std::uint32_t source, std::uint32_t place, std::uint32_t node) const {
  if (source >= kCount) return false;
  if (source == kNew)
    return place <= new_vertex::kMost && (numbered_ || (place & new_vertex::kNumbered) == 0) &&
           (may_import_ || (place & new_vertex::kImported) == 0);
  if (place >= history_.stride()) return false;
  if (source == kHere) return place < node;
  return source < kUsers || source >= kFar || (source - kUsers) / 2 < node;
}

bool PatternDecoder::begin_cell() {
  if (next_id_ == ids_.size()) return false;
  if (in_run_ == runs_[run_].cells) {
    ++run_;
    in_run_ = 0;
  }
  ++in_run_;
  const std::uint32_t block = runs_[run_].block, nodes = nodes_[block];
  const std::size_t offset = std::size_t{ids_[next_id_++]} * 2 * nodes;
  if (offset >= patterns_[block].size()) return false;
  // Prefetch the pattern: patterns are read in random order from a list that is larger than the
  // first-level cache.
  if (next_id_ + kAhead < ids_.size())
    prefetch(patterns_[block].data() + std::size_t{ids_[next_id_ + kAhead]} * 2 * nodes);
  ops_ = patterns_[block].data() + offset;
  cell_.block = block;
  cell_.imports = 0;
  cell_.last_use = last_use_[next_use_++];
  for (std::uint32_t w = 1; w < words_of_uses_; ++w)
    cell_.last_use |= std::uint64_t{last_use_[next_use_++]} << 32 * w;
  slots_ = history_.begin_row();
  cell_.slots = std::span(slots_, nodes);
  return nodes == 64 || cell_.last_use >> nodes == 0;
}

/// Reads the next vertex number, which is stored as the difference from the previous number.
void PatternDecoder::take_number() {
  last_number_ += static_cast<std::uint64_t>(numbers_.get_signed());
}

std::optional<std::uint64_t> PatternDecoder::next_unused() {
  if (!numbered_) return next_own_++;
  take_number();
  return numbers_.ok() ? std::optional(last_number_) : std::nullopt;
}

bool PatternDecoder::at_end() const {
  return next_id_ == ids_.size() && next_distance_ == distances_.size() &&
         next_slot_ == slot_list_.size() && numbers_.ok() && numbers_.left() == 0;
}

}  // namespace shm
