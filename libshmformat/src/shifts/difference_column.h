// DifferenceColumn: an array whose elements have numbers that run in rows and layers: what each
// value differs by from a prediction along these numbers, bytes by significance, under zstd. No
// neighbourhoods, no models: for speed.
// spec: "Values as differences"
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <vector>

#include "bytes/binary.h"
#include "bytes/codec.h"
#include "bytes/packing.h"
#include "shifts/differences.h"

namespace shm {

/// Room that columns use in turn.
struct DifferenceScratch {
  std::vector<std::vector<std::uint64_t>> words;  // by component
  std::vector<std::byte> planes;
};

class DifferenceColumn {
 public:
  /// Without `may_differ`, groups are in shuffled_zstd.
  DifferenceColumn(const ArrayInfo& info, bool may_differ);

  struct Encoded {
    Codec codec = Codec::differences;
    std::vector<std::byte> bytes;
  };
  /// All values of a group, `stride` bytes apart, of the elements with these numbers, in order of
  /// coding. `lags`: where to look for a prediction, the likeliest first.
  Encoded encode(std::span<const std::uint64_t> numbers, const std::byte* values,
                 std::size_t stride, std::span<const std::uint32_t> lags,
                 DifferenceScratch& scratch, ZstdCompressor& zstd);

  /// Encoding: another column has coded the group, in shuffled_zstd.
  void forget() { remembers_ = false; }

  std::size_t element_bytes() const { return components_.size() * width_; }
  /// Whether its groups may be in this codec.
  bool takes(Codec codec) const {
    return codec == Codec::shuffled_zstd || (codec == Codec::differences && may_differ_);
  }
  /// Decoding: the values of a group, which may unpack to `limit` bytes. False for damaged data.
  bool begin_group(Codec codec, std::span<const std::byte> bytes, std::uint64_t limit,
                   ZstdDecompressor& zstd);
  /// Decoding: a group without values.
  void begin_empty_group() { count_ = next_ = 0; }
  /// Values of the next elements of the group, packed, appended to `out`. False where the group has
  /// fewer.
  bool decode(std::span<const std::uint64_t> numbers, std::vector<std::byte>& out,
              DifferenceScratch& scratch);
  /// Whether all values of the group have been decoded.
  bool at_end() const { return next_ == count_; }

 private:
  struct Component {
    ValueDomain domain;
    std::uint32_t width = 0;  // bytes of a residual
    std::size_t planes = 0;   // where they begin
  };

  /// Of three components four, so that two are predicted at once.
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
  /// For each element, predicts its components and takes what is to be remembered of them:
  /// code(differences, element, component, predicted index) -> index.
  template <class Code>
  void for_each_value(std::span<const std::uint64_t> numbers, Code&& code);
  template <std::size_t kComponents, class Differences, class Code>
  void walk(const Differences& differences, std::span<const std::uint64_t> numbers, Code& code);

  std::shared_ptr<const ArrayInfo> info_;
  bool may_differ_;
  std::size_t width_;
  std::vector<Component> components_;
  KnownNumbers known_;
  std::vector<std::uint64_t> ring_;  // what is remembered, by number and component
  std::vector<std::uint64_t> last_;  // of the element before, by component
  bool remembers_ = false;           // something
  std::vector<Tap> taps_;

  // the group that is decoded
  Codec codec_ = Codec::differences;
  std::vector<std::byte> unpacked_;
  std::uint64_t count_ = 0, next_ = 0;
};

}  // namespace shm
