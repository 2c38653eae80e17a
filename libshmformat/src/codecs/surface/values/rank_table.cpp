#include "codecs/surface/values/rank_table.h"

#include <algorithm>
#include <limits>

#include "codecs/shared/value_domain.h"
#include "entropy/range_coder.h"

namespace shm {
namespace {

// Encoder: the largest number of entries of `known` that may be skipped to reach an equal entry. If
// the equal entry is farther away, the distance from the previous entry is coded instead
constexpr std::uint64_t kMostSkipped = 63;

/// Returns the index of the negated value.
std::int64_t opposite(std::int64_t index, DomainKind kind) {
  return kind == DomainKind::floats || kind == DomainKind::narrow ? ~index : minus(0, index);
}

/// The most recent distinct distances between consecutive entries; the most recently used distance
/// comes first. Between evenly spaced values, two or three distances alternate, because the values
/// are rounded.
class Steps {
 public:
  template <class Coder>
  std::uint64_t code(Coder& coder, RankTableModels& models, std::uint64_t wanted) {
    std::size_t index = 0;
    while (index < count_ && !coder.bit(models.same_step[index], wanted == last_[index])) ++index;
    if (index == count_) {
      const std::uint64_t step = code_number(coder, models.step, wanted);
      if (count_ < last_.size()) ++count_;
      index = count_ - 1;
      last_[index] = step;
    }
    std::rotate(last_.begin(), last_.begin() + static_cast<std::ptrdiff_t>(index),
                last_.begin() + static_cast<std::ptrdiff_t>(index) + 1);
    return last_[0];
  }

 private:
  std::array<std::uint64_t, 4> last_{};  // initially the single step 0: consecutive entries
  std::size_t count_ = 1;
};

}  // namespace

void add_known_entries(std::span<const std::int64_t> table, DomainKind kind,
                       std::vector<std::int64_t>& known) {
  for (std::int64_t entry : table) {
    known.push_back(entry);
    known.push_back(opposite(entry, kind));
  }
}

template <class Coder>
bool code_rank_table(Coder& coder, RankTableModels& models, DomainKind kind,
                     std::vector<std::int64_t> known, std::uint64_t most_entries,
                     std::vector<std::int64_t>& table) {
  const std::vector<std::int64_t> wanted = Coder::kDecodes ? std::vector<std::int64_t>() : table;
  const std::uint64_t count = code_number(coder, models.entries, wanted.size() - 1) + 1;
  if (count > most_entries) return false;
  std::sort(known.begin(), known.end());
  known.erase(std::unique(known.begin(), known.end()), known.end());
  // If no entries of other tables are known, the positive entries of this table are predicted from
  // its negative entries.
  bool mirrors = known.empty();
  table.clear();
  Steps steps;
  std::size_t next = 0;  // index of the next entry in `known`
  std::uint32_t history = 0;
  for (std::size_t i = 0; i < count; ++i) {
    const std::int64_t last = i == 0 ? std::numeric_limits<std::int64_t>::min() : table.back();
    if (mirrors && i > 0 && last >= 0) {
      for (std::size_t k = table.size(); k-- > 0;)
        if (opposite(table[k], kind) > 0) known.push_back(opposite(table[k], kind));
      mirrors = false;
    }
    while (next < known.size() && known[next] <= last && i > 0) ++next;
    std::uint64_t skip = 0;
    bool is_known = false;
    if constexpr (!Coder::kDecodes) {
      const auto found = std::lower_bound(known.begin() + static_cast<std::ptrdiff_t>(next),
                                          known.end(), wanted[i]);
      skip = static_cast<std::uint64_t>(found - known.begin()) - next;
      is_known = found != known.end() && *found == wanted[i] && skip <= kMostSkipped;
    }
    if (next < known.size()) {
      is_known = coder.bit(models.known_entry[history], is_known);
      history = (2 * history + (is_known ? 1 : 0)) % 8;
    } else {
      is_known = false;
    }
    if (is_known) {
      skip = code_number(coder, models.skipped, skip);
      if (skip >= known.size() - next) return false;
      table.push_back(known[next + static_cast<std::size_t>(skip)]);
    } else if (i == 0) {
      table.push_back(code_signed(coder, models.first_entry, wanted.empty() ? 0 : wanted[0]));
    } else {
      std::uint64_t distance = 0;
      if constexpr (!Coder::kDecodes)
        distance = static_cast<std::uint64_t>(minus(wanted[i], wanted[i - 1])) - 1;
      const std::uint64_t step = steps.code(coder, models, distance);
      const std::int64_t entry = plus(last, static_cast<std::int64_t>(step + 1));
      if (entry <= last) return false;
      table.push_back(entry);
    }
  }
  return true;
}

template bool code_rank_table(SplitEncoder&, RankTableModels&, DomainKind,
                              std::vector<std::int64_t>, std::uint64_t, std::vector<std::int64_t>&);
template bool code_rank_table(SplitDecoder&, RankTableModels&, DomainKind,
                              std::vector<std::int64_t>, std::uint64_t, std::vector<std::int64_t>&);

}  // namespace shm
