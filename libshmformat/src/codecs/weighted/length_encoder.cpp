#include "codecs/weighted/length_encoder.h"

#include <algorithm>
#include <array>
#include <numeric>

#include "codecs/surface/plan/mode_choice.h"
#include "codecs/weighted/length_coder.h"

namespace shm {
namespace {

constexpr std::uint32_t kScaleBits = LengthDecoder::kScaleBits, kScale = LengthDecoder::kScale;
constexpr std::uint64_t kLow = LengthDecoder::kLow;

/// Approximate size in bits of an entry of a table, and of a table.
constexpr double kEntryBits = 10, kTableBits = 24;

using Counts = std::array<std::uint32_t, kLengths>;

/// A run of contexts of one list that share a table.
struct Merged {
  std::uint32_t first = 0, last = 0;
  Counts counts{};
  double bits = 0;  // of the table and of the lengths
};

double cost_of(const Counts& counts) {
  std::uint32_t all = 0, used = 0;
  for (const std::uint32_t count : counts) all += count, used += count > 0;
  double bits = kTableBits + kEntryBits * used;
  const std::uint32_t whole = log2_steps(all);
  std::uint64_t steps = 0;
  for (const std::uint32_t count : counts)
    if (count > 0) steps += std::uint64_t{count} * (whole - log2_steps(count));
  return bits + static_cast<double>(steps) / 65536.0;
}

Merged merged(const Merged& a, const Merged& b) {
  Merged both{a.first, b.last, a.counts, 0};
  for (std::size_t i = 0; i < kLengths; ++i) both.counts[i] += b.counts[i];
  both.bits = cost_of(both.counts);
  return both;
}

/// Merges neighbouring contexts as long as this saves bits.
void merge(std::vector<Merged>& list) {
  std::vector<Merged> pairs;  // pairs[i]: list[i] and list[i + 1]
  for (std::size_t i = 0; i + 1 < list.size(); ++i) pairs.push_back(merged(list[i], list[i + 1]));
  while (!pairs.empty()) {
    std::size_t best = pairs.size();
    double most = 0;
    for (std::size_t i = 0; i < pairs.size(); ++i)
      if (const double saved = list[i].bits + list[i + 1].bits - pairs[i].bits;
          best == pairs.size() || saved > most) {
        best = i;
        most = saved;
      }
    if (most <= 0) return;
    list[best] = pairs[best];
    list.erase(list.begin() + static_cast<std::ptrdiff_t>(best) + 1);
    pairs.erase(pairs.begin() + static_cast<std::ptrdiff_t>(best));
    if (best < pairs.size()) pairs[best] = merged(list[best], list[best + 1]);
    if (best > 0) pairs[best - 1] = merged(list[best - 1], list[best]);
  }
}

/// Returns frequencies whose sum is kScale. Each length that occurs has at least 1.
std::array<std::uint32_t, kLengths> frequencies_of(const Counts& counts) {
  const std::uint64_t all = std::accumulate(counts.begin(), counts.end(), std::uint64_t{0});
  std::array<std::uint32_t, kLengths> frequencies{};
  std::uint32_t sum = 0;
  for (std::size_t i = 0; i < kLengths; ++i) {
    if (counts[i] == 0) continue;
    frequencies[i] = std::max<std::uint32_t>(
        1, static_cast<std::uint32_t>((counts[i] * std::uint64_t{kScale} + all / 2) / all));
    sum += frequencies[i];
  }
  while (sum != kScale) {
    const auto largest = std::max_element(frequencies.begin(), frequencies.end());
    const std::uint32_t by = sum > kScale ? std::min(sum - kScale, *largest / 2) : kScale - sum;
    *largest = sum > kScale ? *largest - by : *largest + by;
    sum = sum > kScale ? sum - by : sum + by;
  }
  return frequencies;
}

}  // namespace

void put_lengths(ByteWriter& out, std::span<const LengthInContext> lengths) {
  std::vector<Counts> counts(kLengthContexts);
  for (const LengthInContext& it : lengths) ++counts[it.context][it.length];
  std::vector<Merged> all;
  for (const auto& [begin, end] :
       {std::pair{kPlainLengths, kSomeZeroLengths}, std::pair{kSomeZeroLengths, kAllZeroLengths},
        std::pair{kAllZeroLengths, kLengthContexts}}) {
    std::vector<Merged> list;
    for (std::uint32_t c = begin; c < end; ++c)
      if (std::any_of(counts[c].begin(), counts[c].end(), [](auto n) { return n > 0; }))
        list.push_back({c, c, counts[c], cost_of(counts[c])});
    all.insert(all.end(), list.begin(), list.end());
  }
  merge(all);

  struct Range {
    std::uint32_t frequency = 0, first = 0;
  };
  std::array<std::uint8_t, kLengthContexts> map{};
  std::vector<std::array<Range, kLengths>> tables;
  out.put_varint(all.size());
  std::uint32_t begin = 0;
  for (std::size_t t = 0; t < all.size(); ++t) {
    const std::uint32_t end = t + 1 < all.size() ? all[t].last + 1 : kLengthContexts;
    if (t + 1 < all.size()) out.put_u8(static_cast<std::uint8_t>(end - begin));
    std::fill(map.begin() + begin, map.begin() + end, static_cast<std::uint8_t>(t));
    begin = end;
    const auto frequencies = frequencies_of(all[t].counts);
    std::uint32_t low = 0, high = kLengths - 1;
    while (frequencies[low] == 0) ++low;
    while (frequencies[high] == 0) --high;
    out.put_u8(static_cast<std::uint8_t>(low));
    out.put_u8(static_cast<std::uint8_t>(high));
    auto& table = tables.emplace_back();
    std::uint32_t first = 0;
    for (std::uint32_t i = low; i <= high; ++i) {
      table[i] = {frequencies[i], first};
      first += frequencies[i];
      if (i < high) out.put_varint(frequencies[i]);
    }
  }

  std::vector<std::uint32_t> words;
  std::uint64_t state = kLow;
  for (std::size_t i = lengths.size(); i-- > 0;) {
    const Range range = tables[map[lengths[i].context]][lengths[i].length];
    if (state >= (kLow >> kScaleBits << 32) * range.frequency) {
      words.push_back(static_cast<std::uint32_t>(state));
      state >>= 32;
    }
    state = (state / range.frequency << kScaleBits) + state % range.frequency + range.first;
  }
  out.put_varint(words.size());
  out.put_u64(state);
  for (std::size_t i = words.size(); i-- > 0;) out.put_u32(words[i]);
}

}  // namespace shm
