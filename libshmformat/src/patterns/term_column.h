// TermColumn: an array in bulk: what each value differs by from a prediction, of vertices from
// others of the cell that introduces them, of step values from the step before, of all from the
// element before; byte planes, under zstd. No neighbourhoods, no models: for speed.
// spec: "Values by terms"
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <vector>

#include "bytes/binary.h"
#include "bytes/codec.h"
#include "bytes/packing.h"
#include "patterns/vertex_terms.h"
#include "values/value_domain.h"

namespace shm {

/// Components and columns, together, that may be in terms: each takes 8 bytes for each live vertex,
/// 16 where it has a table. Frozen: part of the format.
inline constexpr std::uint32_t kMostTermComponents = 32;

/// Room that columns use in turn.
struct TermScratch {
  std::vector<std::uint64_t> words;
  std::vector<std::int64_t> indices, references;
  std::vector<std::byte> bytes;
  ZstdCompressor packing;
  ZstdDecompressor unpacking;
};

class TermColumn {
 public:
  /// Without `may_have_terms`, groups are in shuffled_zstd.
  TermColumn(const ArrayInfo& info, bool may_have_terms);

  /// Elements of a group: vertices by their terms, or so many others.
  struct Elements {
    std::span<const VertexTerms> vertices{};
    std::size_t count = 0;
    std::uint32_t slots = 0;  ///< above every slot; of others 0
    /// Of others: values that they may be predicted from, packed as they are; or none.
    std::span<const std::byte> reference{};
  };

  struct Encoded {
    Codec codec = Codec::terms;
    std::vector<std::byte> bytes;
  };
  /// All values of a group, `stride` bytes apart, in terms or in shuffled_zstd.
  Encoded encode(const Elements& elements, const std::byte* values, std::size_t stride,
                 TermScratch& scratch);
  /// In terms. Must hold: it may have them.
  std::vector<std::byte> encode_terms(const Elements& elements, const std::byte* values,
                                      std::size_t stride, TermScratch& scratch);

  bool takes(Codec codec) const {
    return codec == Codec::shuffled_zstd || (codec == Codec::terms && may_have_terms_);
  }
  std::size_t element_bytes() const { return components_.size() * width_; }
  /// Decoding: the values of a group, which may unpack to `limit` bytes. False for damaged data.
  bool begin_group(Codec codec, std::span<const std::byte> bytes, std::uint64_t limit,
                   TermScratch& scratch);
  /// Decoding: a group without values.
  void begin_empty_group() { count_ = next_ = 0; }
  /// Values of the next elements of the group, packed, appended to `out`. False where the group has
  /// fewer, or is damaged.
  bool decode(const Elements& elements, std::vector<std::byte>& out, TermScratch& scratch);
  /// Whether all values of the group have been decoded.
  bool at_end() const { return next_ == count_; }
  /// Whether values of the group are predicted from the reference.
  bool refers() const;

 private:
  /// What a value is predicted from. Frozen: part of the format.
  enum class Predictor : std::uint8_t {
    nothing,
    last,
    terms,      ///< vertices only
    reference,  ///< where there is one, as the next
    change,     ///< what the element before is more than its reference
  };
  static constexpr std::uint8_t kPredictors = 5;
  struct Component {
    // what groups leave to the next
    std::vector<std::uint64_t> ranks;  // by slot: group << 32 | rank; as far as there are tables
    std::uint64_t last = 0;            // state of the element before
    ValueDomain domain;
    // the group at hand
    Predictor predictor = Predictor::last;
    std::vector<std::int64_t> table;  // of indices, ascending; empty: none
    std::uint32_t width = 0;          // bytes of a residual
    std::size_t planes = 0;           // where they begin
    std::uint64_t change = 0;         // what the element before is more than its reference
  };
  template <class Differences>
  class Direct;
  template <class Differences>
  class Ranked;

  // For each element: code(differences, element, predicted) -> index, or rank where there is a
  // table. `references`: their indices, where the predictor asks.
  template <class Code>
  void for_each_value(std::size_t c, const Elements& elements,
                      std::span<const std::int64_t> references, Code&& code);
  template <class Known, class Code>
  static void walk(Known known, Predictor predictor, const Elements& elements,
                   std::span<const std::int64_t> references, std::uint64_t& change, Code& code);
  void refer(std::size_t c, const Elements& elements, std::vector<std::int64_t>& references,
             std::vector<std::uint64_t>& words) const;
  void make_room_for_slots(const Elements& elements);

  ValueDomain choose_domain(std::size_t c, std::span<std::uint64_t> words,
                            std::span<std::int64_t> indices) const;
  Predictor choose_predictor(const Component& component, const Elements& elements,
                             const TermScratch& scratch, std::uint64_t& bits) const;
  void encode_component(std::size_t c, const Elements& elements, const std::byte* values,
                        std::size_t stride, ByteWriter& heads, ByteWriter& planes,
                        TermScratch& scratch);
  bool read_terms(std::span<const std::byte> bytes, std::uint64_t most, TermScratch& scratch);
  bool read_heads(ByteReader& in);
  bool read_table(ByteReader& in, std::vector<std::int64_t>& table, TermScratch& scratch) const;
  bool decode_component(std::size_t c, const Elements& elements, std::byte* out,
                        TermScratch& scratch);
  static constexpr std::size_t kTogether = 3;
  void decode_floats(std::size_t c, const Elements& elements, std::byte* out);
  bool can_decode_together(const Elements& elements) const;
  void decode_together(const Elements& elements, std::byte* out, TermScratch& scratch);
  void take_residuals(const Component& component, std::span<std::uint64_t> words) const;
  void save_values(std::size_t c, std::span<std::uint64_t> indices, std::byte* out) const;

  std::shared_ptr<const ArrayInfo> info_;
  bool may_have_terms_;
  std::size_t width_;
  std::vector<Component> components_;
  // What groups leave to the next: by slot and component, bits of a double, or an index.
  std::vector<std::uint64_t> states_;
  std::uint32_t group_ = 0;  // for ranks; of the column

  // the group that is decoded
  Codec codec_ = Codec::terms;
  std::vector<std::byte> unpacked_;
  std::uint64_t count_ = 0, next_ = 0;
};

}  // namespace shm
