#include "compare/pairs.h"

#include <algorithm>
#include <deque>
#include <map>
#include <optional>
#include <tuple>
#include <utility>

namespace shm::converters {
namespace {

constexpr std::uint32_t kUnpaired = ~std::uint32_t{0};

class BlockPairing {
 public:
  BlockPairing(const MeshInfo& a, const MeshInfo& b)
      : a_(a), b_(b), blocks_a_(a.schema.blocks), blocks_b_(b.schema.blocks) {
    found_.class_a.assign(blocks_a_.size(), kUnpaired);
    found_.class_b.assign(blocks_b_.size(), kUnpaired);
  }

  BlockPairs of_one_format() {
    const auto any = [](const BlockInfo&) { return true; };
    pair_by(
        [](const BlockInfo& x) {
          return std::tie(x.id, x.name, x.shape, x.nodes_per_cell, x.scheme);
        },
        any);
    pair_by([](const BlockInfo& x) { return std::tie(x.id, x.shape); }, any);
    pair_by([](const BlockInfo& x) { return std::tie(x.name); },
            [](const BlockInfo& x) { return !x.name.empty(); });
    pair_by([](const BlockInfo& x) { return std::tie(x.id); }, any);
    add_differences();
    return std::move(found_);
  }

  BlockPairs between_formats() {
    for (std::size_t i = 0; i < blocks_a_.size(); ++i)
      found_.class_a[i] = shape_class(blocks_a_[i].shape);
    for (std::size_t i = 0; i < blocks_b_.size(); ++i)
      found_.class_b[i] = shape_class(blocks_b_[i].shape);
    if (blocks_a_.size() != blocks_b_.size())
      found_.differences.push_back(
          {"number of blocks", std::to_string(blocks_a_.size()), std::to_string(blocks_b_.size())});
    return std::move(found_);
  }

 private:
  // Pairs blocks of A and B that are not paired yet, and for which key() returns the same value.
  // Blocks of B for which may() returns false are skipped. If several blocks of a mesh have the
  // same key, they are paired in ascending order.
  template <class Key, class May>
  void pair_by(Key&& key, May&& may) {
    std::map<decltype(key(blocks_b_.front())), std::deque<std::size_t>> left;
    for (std::size_t k = 0; k < blocks_b_.size(); ++k)
      if (found_.class_b[k] == kUnpaired && may(blocks_b_[k])) left[key(blocks_b_[k])].push_back(k);
    for (std::size_t i = 0; i < blocks_a_.size(); ++i) {
      if (found_.class_a[i] != kUnpaired) continue;
      const auto fits = left.find(key(blocks_a_[i]));
      if (fits == left.end() || fits->second.empty()) continue;
      const std::size_t k = fits->second.front();
      fits->second.pop_front();
      found_.class_a[i] = found_.class_b[k] = next_class_++;
      pairs_.emplace_back(i, k);
    }
  }

  void add_differences() {
    for (const auto& [i, k] : pairs_) {
      const BlockInfo &x = blocks_a_[i], &y = blocks_b_[k];
      const std::string what = "block " + std::to_string(i);
      if (x != y) found_.differences.push_back({what, block_text(x), block_text(y)});
      if (a_.block_cells[i] != b_.block_cells[k])
        found_.differences.push_back({"cells of " + block_text(x),
                                      std::to_string(a_.block_cells[i]),
                                      std::to_string(b_.block_cells[k])});
    }
    for (std::size_t i = 0; i < blocks_a_.size(); ++i)
      if (found_.class_a[i] == kUnpaired) {
        found_.class_a[i] = next_class_++;
        found_.differences.push_back({block_text(blocks_a_[i]), {}, {}, true, false});
      }
    for (std::size_t k = 0; k < blocks_b_.size(); ++k)
      if (found_.class_b[k] == kUnpaired) {
        found_.class_b[k] = next_class_++;
        found_.differences.push_back({block_text(blocks_b_[k]), {}, {}, false, true});
      }
  }

  // Returns the class of a shape. Formats have different names for polygons with three or four
  // corners, and for cells of unknown shape; such shapes share a class.
  static std::uint32_t shape_class(CellShape shape) {
    if (shape == CellShape::quad || shape == CellShape::polygon) shape = CellShape::triangle;
    if (shape == CellShape::polyhedron) shape = CellShape::other;
    return static_cast<std::uint32_t>(shape);
  }

  const MeshInfo &a_, &b_;
  const std::vector<BlockInfo>&blocks_a_, &blocks_b_;
  BlockPairs found_;
  std::vector<std::pair<std::size_t, std::size_t>> pairs_;
  std::uint32_t next_class_ = 0;
};

class StepPairing {
 public:
  StepPairing(const MeshInfo& a, const MeshInfo& b, const Likeness& likeness, std::uint64_t limit,
              MeshDiff& result)
      : a_(a.step_times), b_(b.step_times), likeness_(likeness), limit_(limit), result_(result) {
    times_.kind = times_.what = "times";
    only_a_.kind = "only_in_a";
    only_b_.kind = "only_in_b";
    only_a_.what = only_b_.what = "time steps";
  }

  std::vector<StepPair> run() {
    if (a_.size() == b_.size()) {
      for (std::uint64_t s = 0; s < a_.size(); ++s) pair(s, s);
    } else {
      const auto count = [](std::size_t steps) {
        return steps == 0 ? "none (compared with the last)" : std::to_string(steps);
      };
      result_.differences.push_back(
          {"steps", "number of time steps", count(a_.size()), count(b_.size())});
      if (!a_.empty() && !b_.empty()) merge();
    }
    for (Finding* finding : {&times_, &only_a_, &only_b_})
      if (finding->different > 0) result_.differences.push_back(std::move(*finding));
    return std::move(pairs_);
  }

 private:
  std::optional<double> apart(double a, double b) const {
    return distance_of_unlike(reinterpret_cast<const std::byte*>(&a), ScalarType::float64,
                              reinterpret_cast<const std::byte*>(&b), ScalarType::float64,
                              likeness_);
  }

  void merge() {
    std::uint64_t i = 0, k = 0;
    while (i < a_.size() && k < b_.size()) {
      if (!apart(a_[i], b_[k]))
        pair(i++, k++);
      else if (a_[i] < b_[k])
        alone(only_a_, i++, {});
      else
        alone(only_b_, {}, k++);
    }
    while (i < a_.size()) alone(only_a_, i++, {});
    while (k < b_.size()) alone(only_b_, {}, k++);
  }

  void pair(std::uint64_t i, std::uint64_t k) {
    pairs_.push_back({i, k});
    const auto distance = apart(a_[i], b_[k]);
    if (!distance) return;
    times_.compared = a_.size();
    times_.largest = std::max(times_.largest, *distance);
    if (times_.different++ >= limit_) return;
    DiffPlace place{"step", i, k};
    place.value_a = number_text(a_[i]);
    place.value_b = number_text(b_[k]);
    place.distance = distance;
    times_.places.push_back(std::move(place));
  }

  void alone(Finding& finding, std::optional<std::uint64_t> i, std::optional<std::uint64_t> k) {
    finding.compared = i ? a_.size() : b_.size();
    if (finding.different++ >= limit_) return;
    DiffPlace place{"step", i, k};
    place.time = i ? a_[*i] : b_[*k];
    finding.places.push_back(std::move(place));
  }

  const std::vector<double>&a_, &b_;
  const Likeness& likeness_;
  std::uint64_t limit_;
  MeshDiff& result_;
  std::vector<StepPair> pairs_;
  Finding times_, only_a_, only_b_;
};

}  // namespace

BlockPairs pair_blocks(const MeshInfo& a, const MeshInfo& b, bool one_format) {
  BlockPairing pairing(a, b);
  return one_format ? pairing.of_one_format() : pairing.between_formats();
}

std::string block_text(const BlockInfo& block) {
  return "block " + std::to_string(block.id) + (block.name.empty() ? "" : " '" + block.name + "'") +
         " of " + kind_of_cells(block) + " cells with " +
         (block.nodes_per_cell == 0 ? "any number of" : std::to_string(block.nodes_per_cell)) +
         " nodes";
}

std::vector<StepPair> pair_steps(const MeshInfo& a, const MeshInfo& b, bool one_format,
                                 const Likeness& likeness, std::uint64_t limit, MeshDiff& result) {
  // In some formats, a mesh without steps is stored with one step, so 0 steps and 1 step are not a
  // difference.
  const std::size_t fewer = std::min(a.step_times.size(), b.step_times.size());
  const std::size_t more = std::max(a.step_times.size(), b.step_times.size());
  if (!one_format && fewer == 0 && more == 1) return {};
  return StepPairing(a, b, likeness, limit, result).run();
}

std::vector<StepPair> steps_of(const FieldPair& field, const std::vector<StepPair>& common,
                               std::uint64_t steps_a, std::uint64_t steps_b) {
  const bool a = field.a.per_step, b = field.b.per_step;
  if (a && b) return common;
  if (!a && !b) return {{0, 0}};
  const std::uint64_t steps = a ? steps_a : steps_b;
  if (steps == 0) return {};
  const auto pair = [&](std::uint64_t step) { return a ? StepPair{step, 0} : StepPair{0, step}; };
  if ((a ? steps_b : steps_a) == 0 && steps > 1 && a != b) return {pair(steps - 1)};
  std::vector<StepPair> all;
  for (std::uint64_t step = 0; step < steps; ++step) all.push_back(pair(step));
  return all;
}

}  // namespace shm::converters
