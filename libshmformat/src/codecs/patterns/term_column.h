// TermColumn: codes the values of an array, group by group. A value is stored as the difference
// (residual) from its prediction. The prediction comes from other vertices of the same cell (the
// terms), from the previous step, or from the previous element. The residuals are stored as byte
// planes compressed by zstd. This method is fast, since it needs neither neighbourhoods nor
// adaptive models.
// spec: "Values by terms"
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <vector>

#include "base/binary.h"
#include "base/packing.h"
#include "codecs/patterns/copied_vertices.h"
#include "codecs/patterns/vertex_terms.h"
#include "codecs/shared/codec_id.h"
#include "codecs/shared/value_domain.h"

namespace shm {

/// Largest total number of components of the columns that are coded by terms. Each component needs
/// 8 bytes per live vertex, or 16 bytes with a table, and up to 512 KB in a group with copied
/// vertices. Frozen: part of the format.
inline constexpr std::uint32_t kMostTermComponents = 32;

/// Temporary buffers. Columns share them, because columns are coded one after another.
struct TermScratch {
  std::vector<std::uint64_t> words;
  std::vector<std::int64_t> indices, references;
  std::vector<std::byte> bytes;
  ZstdCompressor packing;
  ZstdDecompressor unpacking;
};

class TermColumn {
 public:
  /// `may_have_terms`: if false, all groups are coded by shuffled_zstd.
  TermColumn(const ArrayInfo& info, bool may_have_terms);

  /// The elements of a group: either vertices with their terms, or `count` elements without terms.
  struct Elements {
    std::span<const VertexTerms> vertices{};
    std::size_t count = 0;
    std::uint32_t slots = 0;  ///< a number greater than every slot; 0 for elements without terms

    /// Reference values for elements without terms, packed in the same way as the values; empty if
    /// the group has no reference values.
    std::span<const std::byte> reference{};
  };

  struct Encoded {
    Codec codec = Codec::terms;
    std::vector<std::byte> bytes;
  };
  /// Encodes a group by terms or by shuffled_zstd. `values`: values of all elements of the group.
  /// `stride`: number of bytes from one element to the next.
  Encoded encode(const Elements& elements, const std::byte* values, std::size_t stride,
                 TermScratch& scratch);
  /// Encodes a group by terms, with or without copied vertices, whichever is smaller. Precondition:
  /// terms are allowed for this column.
  std::vector<std::byte> encode_terms(const Elements& elements, const std::byte* values,
                                      std::size_t stride, TermScratch& scratch);

  bool takes(Codec codec) const {
    return codec == Codec::shuffled_zstd || (codec == Codec::terms && may_have_terms_);
  }
  std::size_t element_bytes() const { return components_.size() * width_; }
  /// Decoding: begins a group. `limit`: largest unpacked size in bytes. Returns false if the data
  /// is damaged.
  bool begin_group(Codec codec, std::span<const std::byte> bytes, std::uint64_t limit,
                   TermScratch& scratch);
  /// Decoding: begins a group without values.
  void begin_empty_group() { count_ = next_ = 0; }
  /// Decodes the next elements of the group and appends their values to `out` without gaps. Returns
  /// false if the group has fewer elements left, or if the data is damaged.
  bool decode(const Elements& elements, std::vector<std::byte>& out, TermScratch& scratch);
  /// Returns true if all values of the group have been decoded.
  bool at_end() const { return next_ == count_; }
  /// Returns true if any value of the group is predicted from reference values.
  bool refers() const;

 private:
  /// The methods of predicting a value. Frozen: part of the format.
  enum class Predictor : std::uint8_t {
    nothing,
    last,
    terms,      ///< terms of the vertex; for vertices only
    reference,  ///< the reference value; only for elements with references
    change,  ///< the reference value plus the amount by which the previous element's value differed
             ///< from its reference value
  };
  static constexpr std::uint8_t kPredictors = 5;
  struct Component {
    // Data that remains from group to group

    // Rank of each vertex, indexed by slot and stored as group << 32 | rank. Used only in groups
    // with a table
    std::vector<std::uint64_t> ranks;
    std::uint64_t last = 0;  // state of the previous element
    ValueDomain domain;
    // Data of the current group
    // The component of which this component is a copy
    std::optional<std::size_t> source;
    Predictor predictor = Predictor::last;
    std::vector<std::int64_t> table;  // indices that occur, ascending; empty: no table
    std::uint32_t width = 0;          // size of a residual in bytes
    std::size_t planes = 0;           // offset of the component's byte planes

    // For the previous element: index of its value minus index of its reference value
    std::uint64_t change = 0;
    // Decoding: a ring with the indices (or ranks) of the most recent vertices of the group. Empty
    // if the group has no copied vertices
    std::vector<std::uint64_t> recent;
  };
  template <class Differences>
  class Direct;
  template <class Differences>
  class Ranked;

  // Predicts component `c` of each element, and calls code(differences, element, predicted index).
  // `differences` contains the functions that compute differences of indices. code() returns the
  // index of the value. If the component has a table, code() receives and returns ranks instead of
  // indices. `references`: indices of the reference values; used only by predictors that need
  // references.
  template <class Code>
  void for_each_value(std::size_t c, const Elements& elements,
                      std::span<const std::int64_t> references, Code&& code);
  template <class Known, class Code>
  static void walk(Known known, Predictor predictor, const Elements& elements,
                   std::span<const std::int64_t> references, std::uint64_t& change, Code& code);
  void refer(std::size_t c, const Elements& elements, std::vector<std::int64_t>& references,
             std::vector<std::uint64_t>& words) const;
  void make_room_for_slots(const Elements& elements);
  void copy_component(std::size_t c, const Elements& elements);

  ValueDomain choose_domain(std::size_t c, std::span<std::uint64_t> words,
                            std::span<std::int64_t> indices) const;
  std::vector<std::byte> encode_components(const Elements& elements, const std::byte* values,
                                           std::size_t stride, TermScratch& scratch);
  Predictor choose_predictor(const Component& component, const Elements& elements,
                             const TermScratch& scratch, std::uint64_t& bits) const;
  void encode_component(std::size_t c, const Elements& elements, const std::byte* values,
                        std::size_t stride, ByteWriter& heads, ByteWriter& planes,
                        TermScratch& scratch);
  bool read_terms(std::span<const std::byte> bytes, std::uint64_t most, TermScratch& scratch);
  bool read_heads(ByteReader& in, TermScratch& scratch);
  bool read_head(ByteReader& in, std::size_t c, std::uint8_t head);
  bool read_table(ByteReader& in, std::vector<std::int64_t>& table, TermScratch& scratch) const;
  bool decode_component(std::size_t c, const Elements& elements, std::byte* out,
                        TermScratch& scratch);
  static constexpr std::size_t kTogether = 3;
  void decode_floats(std::size_t c, const Elements& elements, std::byte* out);
  bool can_decode_together(const Elements& elements) const;
  void decode_together(const Elements& elements, std::byte* out, TermScratch& scratch);
  std::size_t count_own(std::size_t count) const;
  void take_residuals(const Component& component, std::span<std::uint64_t> words) const;
  [[gnu::cold]] void copy_vertex(Component& component, std::size_t e, std::uint64_t& word) const;
  void save_values(std::size_t c, std::span<std::uint64_t> indices, std::byte* out) const;

  std::shared_ptr<const ArrayInfo> info_;
  bool may_have_terms_;
  std::size_t width_;
  std::vector<Component> components_;
  // States of the vertices, indexed by slot and component. They are kept from one group to the
  // next. A state is either the bits of a double or an index.
  std::vector<std::uint64_t> states_;
  std::uint32_t group_ = 0;  // number of the current group; marks the ranks that belong to it
  CopiedVertices copies_;    // of the current group

  // Data of the group that is being decoded
  Codec codec_ = Codec::terms;
  std::vector<std::byte> unpacked_;
  std::uint64_t count_ = 0, next_ = 0;  // numbers of elements: of the group, and decoded so far
  std::uint64_t own_count_ = 0, next_own_ = 0;  // the same numbers without copied vertices
};

}  // namespace shm
