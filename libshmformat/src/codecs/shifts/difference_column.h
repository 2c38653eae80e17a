// DifferenceColumn: codes the values of an array whose elements are numbered in rows and layers. A
// value is stored as the difference (residual) from its prediction, which is computed from elements
// with smaller numbers. The bytes of all residuals are sorted by significance and compressed by
// zstd. The method is fast, since it needs neither neighbourhoods nor adaptive models.
// spec: "Values as differences"
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <vector>

#include "base/binary.h"
#include "base/packing.h"
#include "codecs/shared/codec_id.h"
#include "codecs/shifts/differences.h"

namespace shm {

/// Temporary buffers. Columns share them, because columns are coded one after another.
struct DifferenceScratch {
  // values, indices or residuals, indexed by component
  std::vector<std::vector<std::uint64_t>> words;
  std::vector<std::byte> planes;
};

class DifferenceColumn {
 public:
  /// `may_differ`: if false, all groups are coded by shuffled_zstd.
  DifferenceColumn(const ArrayInfo& info, bool may_differ);

  struct Encoded {
    Codec codec = Codec::differences;
    std::vector<std::byte> bytes;
  };
  /// Encodes a group. `numbers`: the vertex or cell numbers of the elements, in coding order.
  /// `values`: the values of these elements in the same order. `stride`: number of bytes from one
  /// value to the next. `lags`: differences between the numbers of an element and of an earlier
  /// element that may predict its value; the most likely lag first.
  Encoded encode(std::span<const std::uint64_t> numbers, const std::byte* values,
                 std::size_t stride, std::span<const std::uint32_t> lags,
                 DifferenceScratch& scratch, ZstdCompressor& zstd);

  /// Encoding: forgets all earlier values. Call it if the values of the group have been coded with
  /// shuffled_zstd outside this column.
  void forget() { remembers_ = false; }

  std::size_t element_bytes() const { return components_.size() * width_; }
  /// Returns true if `codec` is allowed for groups of this column.
  bool takes(Codec codec) const {
    return codec == Codec::shuffled_zstd || (codec == Codec::differences && may_differ_);
  }
  /// Decoding: begins a group. `limit`: largest unpacked size in bytes. Returns false if the data
  /// is damaged.
  bool begin_group(Codec codec, std::span<const std::byte> bytes, std::uint64_t limit,
                   ZstdDecompressor& zstd);
  /// Decoding: begins a group without values.
  void begin_empty_group() { count_ = next_ = 0; }
  /// Decodes the next elements of the group and appends their values to `out` without gaps. Returns
  /// false if the group has fewer elements left.
  bool decode(std::span<const std::uint64_t> numbers, std::vector<std::byte>& out,
              DifferenceScratch& scratch);
  /// Returns true if all values of the group have been decoded.
  bool at_end() const { return next_ == count_; }

 private:
  struct Component {
    ValueDomain domain;
    std::size_t source = 0;   // the component itself, or the component of which it is a copy
    std::uint32_t width = 0;  // number of bytes of a residual
    std::size_t planes = 0;   // offset of the component's byte planes
  };

  /// Returns the number of words in the ring for each element. An element with three components has
  /// four words, so that the compiler can process two words at once.
  std::size_t ring_stride() const { return components_.size() == 3 ? 4 : components_.size(); }
  void begin(std::span<const Factor> factors, std::span<const ValueDomain> domains,
             std::uint64_t count);
  std::vector<ValueDomain> choose_domains(std::span<const std::vector<std::uint64_t>> bits) const;
  void round_to_quantized(std::span<const ValueDomain> domains,
                          std::span<std::vector<std::uint64_t>> bits) const;
  std::vector<std::byte> encode_differences(std::span<const std::uint64_t> numbers,
                                            std::span<const std::uint32_t> lags,
                                            DifferenceScratch& scratch, ZstdCompressor& zstd);
  bool read_differences(std::span<const std::byte> bytes, std::uint64_t most,
                        ZstdDecompressor& zstd);
  void read_residuals(std::size_t c, std::span<std::uint64_t> out) const;
  /// Predicts each component of each element. For each component it calls code(differences,
  /// element, component, predicted index). code() returns the index of the value. Later elements
  /// are predicted from the state of this index, which this function stores.
  template <class Code>
  void for_each_value(std::span<const std::uint64_t> numbers, Code&& code);
  template <std::size_t kComponents, class Differences, class Code>
  void walk(const Differences& differences, std::span<const std::uint64_t> numbers, Code& code);

  std::shared_ptr<const ArrayInfo> info_;
  bool may_differ_;
  std::size_t width_;
  std::vector<Component> components_;
  KnownNumbers known_;
  std::vector<std::uint64_t> ring_;  // states, by number and component
  std::vector<std::uint64_t> last_;  // states of the previous element, indexed by component
  bool remembers_ = false;           // true if ring_ and last_ contain values of earlier groups
  std::vector<Tap> taps_;

  // Data of the group that is being decoded
  Codec codec_ = Codec::differences;
  std::vector<std::byte> unpacked_;
  std::uint64_t count_ = 0, next_ = 0;
};

}  // namespace shm
