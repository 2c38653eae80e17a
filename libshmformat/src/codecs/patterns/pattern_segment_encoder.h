// PatternSegmentEncoder: encodes the cells of a segment as patterns (positions of vertices in
// earlier cells), and values by the terms of their vertices (other vertices of the same cell). The
// encoder uses neither an active surface nor neighbourhoods, so it is fast. It suits meshes of any
// kind.
// spec: "Patterns", "Values by terms"
#pragma once

#include <cstdint>
#include <vector>

#include "codecs/patterns/patterns.h"
#include "codecs/patterns/term_columns.h"
#include "codecs/patterns/vertex_terms.h"
#include "codecs/shared/segment_encoder.h"

namespace shm {

class PatternSegmentEncoder final : public SegmentEncoder {
 public:
  /// `schema` must have passed check_schema() and must outlive the encoder. Precondition:
  /// takes_patterns(schema).
  PatternSegmentEncoder(const Schema& schema, const SegmentOptions& options,
                        const SegmentStart& start);

 private:
  bool encode_cell(const SegmentPiece& piece, const SegmentPiece::Cell& cell,
                   const Place& place) override;
  void encode_unused(const SegmentPiece& piece, std::size_t vertex) override;
  void encode_streams() override;
  void add_size_at_hand(SegmentSize& size) override;
  std::uint64_t values_at_hand(RatedDomains* rated) override;
  void take(const SegmentPiece& piece, std::size_t index);

  PatternEncoder patterns_;
  TermFinder finder_;
  std::vector<TermColumn> columns_;
  TermScratch scratch_;

  // Data of the current cell
  std::vector<std::uint64_t> numbers_;

  // Data of the current group
  std::vector<VertexTerms> vertices_;
  std::vector<std::uint32_t> cell_blocks_;
};

}  // namespace shm
