// DifferenceColumn: codes an array whose element numbers run in rows and layers. A value is stored
// as its residual relative to a prediction from elements with smaller numbers. The bytes of all
// residuals are sorted by significance and compressed by zstd. The method is fast, since it needs
// neither neighbourhoods nor models.
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

/// Buffers that are shared by columns, which are coded one after another.
struct DifferenceScratch {
  std::vector<std::vector<std::uint64_t>> words;  // values, indices or residuals, by component
  std::vector<std::byte> planes;
};

class DifferenceColumn {
 public:
  /// If `may_differ` is false, all groups use shuffled_zstd.
  DifferenceColumn(const ArrayInfo& info, bool may_differ);

  struct Encoded {
    Codec codec = Codec::differences;
    std::vector<std::byte> bytes;
  };
  /// Encodes a group. `numbers`: numbers of the elements in coding order. `values`: the values of
  /// all these elements. `stride`: distance in bytes between consecutive values. `lags`: distances
  /// along which values may be predictable, the most likely first.
  Encoded encode(std::span<const std::uint64_t> numbers, const std::byte* values,
                 std::size_t stride, std::span<const std::uint32_t> lags,
                 DifferenceScratch& scratch, ZstdCompressor& zstd);

  /// Encoding: forgets all earlier values. Call it if another column has coded the group in
  /// shuffled_zstd.
  void forget() { remembers_ = false; }

  std::size_t element_bytes() const { return components_.size() * width_; }
  /// Returns true if groups of this column may use `codec`.
  bool takes(Codec codec) const {
    return codec == Codec::shuffled_zstd || (codec == Codec::differences && may_differ_);
  }
  /// Decoding: begins a group, which may unpack to at most `limit` bytes. Returns false if the data
  /// is damaged.
  bool begin_group(Codec codec, std::span<const std::byte> bytes, std::uint64_t limit,
                   ZstdDecompressor& zstd);
  /// Decoding: begins a group without values.
  void begin_empty_group() { count_ = next_ = 0; }
  /// Decodes the next elements of the group and appends their values, packed, to `out`. Returns
  /// false if the group has fewer elements left.
  bool decode(std::span<const std::uint64_t> numbers, std::vector<std::byte>& out,
              DifferenceScratch& scratch);
  /// Returns true if all values of the group have been decoded.
  bool at_end() const { return next_ == count_; }

 private:
  struct Component {
    ValueDomain domain;
    std::uint32_t width = 0;  // number of bytes of a residual
    std::size_t planes = 0;   // offset of the component's byte planes
  };

  /// Returns the number of words per element in the ring. Three components use four words, so that
  /// the compiler can process two words together.
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
  /// Predicts each component of each element. Calls code(differences, element, component, predicted
  /// index), which returns the index of the value, and stores the state of this index.
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
  std::vector<std::uint64_t> last_;  // states of the previous element, by component
  bool remembers_ = false;           // true if ring_ and last_ contain values of earlier groups
  std::vector<Tap> taps_;

  // Data of the group that the column currently decodes
  Codec codec_ = Codec::differences;
  std::vector<std::byte> unpacked_;
  std::uint64_t count_ = 0, next_ = 0;
};

}  // namespace shm
