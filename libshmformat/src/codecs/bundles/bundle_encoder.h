// BundlePlanner and BundleEncoder: encode the values of several arrays at several steps as a
// Bundle. The planner chooses how each column is stored. The encoder puts planned columns into a
// bundle. A planned column can be part of several bundles, of which the caller keeps the smallest.
// spec: "Bundles"
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <unordered_map>
#include <utility>
#include <vector>

#include "base/binary.h"
#include "base/packing.h"
#include "codecs/bundles/bundle.h"
#include "shm/schema.h"

namespace shm {

/// The values of an array: the packed values of all elements, for each step.
using ValuesOfSteps = std::vector<std::span<const std::byte>>;

/// A column, and how a bundle stores it. Its form is never ColumnForm::copy.
struct PlannedColumn {
  ColumnForm form = ColumnForm::zero;
  ColumnShape shape = ColumnShape::full;
  BundlePredictor predictor = BundlePredictor::words;
  ValueDomain domain;
  std::uint32_t value_bytes = 0;  // size of a value
  std::uint32_t width = 0;        // size of a residual
  std::uint64_t base = 0;         // first index; of a constant its word
  std::size_t count = 0;          // number of stored values
  /// Words: one after another. Residuals: all bytes 0, then all bytes 1, and so on.
  std::vector<std::byte> stored;
  std::size_t bytes = 0;  // approximate number of bytes in a bundle
  /// If all values are those of another column multiplied by a factor: that column, which is coded.
  /// A bundle that contains it need not store the values of this column.
  std::shared_ptr<const PlannedColumn> source{};
  double factor = 0;
};

/// The columns of an array. Arrays with equal columns share them.
using PlannedColumns = std::vector<std::shared_ptr<const PlannedColumn>>;

class BundlePlanner {
 public:
  explicit BundlePlanner(std::uint64_t steps) : steps_(static_cast<std::size_t>(steps)) {}

  /// Plans the columns of an array. `values` has at least one element at each step, and must
  /// outlive the planner.
  PlannedColumns plan(const ArrayInfo& info, const ValuesOfSteps& values);

 private:
  /// Position of the values of a coded column.
  struct Known {
    const ArrayInfo* info;
    const ValuesOfSteps* values;
    std::size_t component;
    std::shared_ptr<const PlannedColumn> column;
  };

  std::vector<std::uint64_t> words_of(const ArrayInfo& info, const ValuesOfSteps& values,
                                      std::size_t component) const;
  const Known* known(const ArrayInfo& info, std::uint64_t hash,
                     std::span<const std::uint64_t> words) const;
  void find_source(const ArrayInfo& info, std::span<const std::uint64_t> words,
                   std::uint64_t outline, PlannedColumn& column) const;
  void choose(const ArrayInfo& info, std::size_t component, std::span<const std::uint64_t> words,
              PlannedColumn& column);
  void choose_prediction(const ArrayInfo& info, std::size_t component,
                         std::span<const std::uint64_t> words, const ValueDomain& domain,
                         const StoredValues& stored, PlannedColumn& column);
  void translate(const ArrayInfo& info, std::size_t component, std::span<const std::uint64_t> words,
                 const ValueDomain& domain);
  void store_residuals(const ArrayInfo& info, const StoredValues& stored, PlannedColumn& column);
  std::size_t size_of(std::span<const std::byte> bytes);
  std::size_t size_of_residuals(const PlannedColumn& column, std::size_t most);

  std::size_t steps_;
  std::unordered_multimap<std::uint64_t, Known> known_;  // coded columns by hash of their words
  // Coded columns by their outline, which is usually equal for multiples of the same values
  std::unordered_multimap<std::uint64_t, Known> outlines_;
  ZstdCompressor trial_;
  std::vector<std::int64_t> indices_;     // of the column whose residuals are stored
  std::vector<std::uint64_t> residuals_;  // its residuals
};

class BundleEncoder {
 public:
  explicit BundleEncoder(int zstd_level) : level_(zstd_level) {}

  /// Returns true if the bundle already contains all coded columns of `columns`.
  bool needs_no_values(const PlannedColumns& columns) const;
  /// Adds an array. Returns false, and adds nothing, if the bundle would exceed its limits.
  bool add(const PlannedColumns& columns);
  /// Returns the encoded bundle. No other function may be called afterwards.
  std::vector<std::byte> finish();

 private:
  /// A column of the bundle. `distance` is that of a copy, and 0 for other columns.
  struct Column {
    std::shared_ptr<const PlannedColumn> plan;
    std::size_t distance = 0;
    bool is_scaled = false;

    bool is_coded() const { return distance == 0 && plan->form == ColumnForm::coded; }
    bool has_words() const { return is_coded() && plan->predictor == BundlePredictor::words; }
    bool has_residuals() const { return is_coded() && plan->predictor != BundlePredictor::words; }
  };

  bool has_values_of(const PlannedColumn& column) const {
    return place_.contains(&column) || (column.source && place_.contains(column.source.get()));
  }
  void put_details(ByteWriter& out, const Column& column) const;

  int level_;
  std::vector<Column> columns_;
  std::unordered_map<const PlannedColumn*, std::size_t> place_;  // of coded columns
  std::uint64_t values_ = 0;
};

}  // namespace shm
