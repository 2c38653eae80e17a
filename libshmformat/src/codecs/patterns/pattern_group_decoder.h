// PatternGroupDecoder: decodes the groups of a segment that is coded as patterns. It is the
// counterpart of pattern_segment_encoder.h.
// spec: "Patterns", "Values by terms"
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "codecs/patterns/patterns.h"
#include "codecs/patterns/term_columns.h"
#include "codecs/patterns/vertex_terms.h"
#include "codecs/shared/group_decoder.h"
#include "codecs/surface/cells/number_column.h"
#include "entropy/range_coder.h"

namespace shm {

class PatternGroupDecoder final : public GroupDecoder {
 public:
  /// Precondition: takes_patterns(schema).
  PatternGroupDecoder(const Schema& schema, const SegmentStart& start, const DecodedParts& parts,
                      CellBytes cell_bytes);

  Result<void> begin_plain_stream(const container::StreamEntry& entry, Codec codec,
                                  std::span<const std::byte> bytes) override;
  std::vector<std::uint64_t> alive() const override;
  Items items() const override { return {}; }
  std::uint32_t slots() const override { return patterns_.slot_count(); }

 private:
  Result<void> begin_streams(std::optional<ConnectivityCodec> codec) override;
  Result<void> begin_column(const container::StreamEntry& entry, Codec codec,
                            std::span<const std::byte> bytes, std::uint64_t decoded_bytes);
  Result<void> decode_elements(DecodedBlock& decoded) override;
  bool decode_column(std::size_t column, const MeshBlock& block,
                     std::vector<std::byte>& out) override;
  bool is_used_up() const override;
  Result<void> decode_cells(DecodedBlock& decoded);
  bool decode_cell(DecodedBlock& decoded, std::size_t cell);
  bool import_vertex(PatternHistory::Vertex& vertex);
  bool add_vertices(const PatternCell& cell, const std::uint64_t* numbers, DecodedBlock& decoded);

  PatternDecoder patterns_;
  TermFinder finder_;
  std::vector<TermColumn> columns_;
  TermScratch scratch_;
  std::size_t next_column_ = 0;

  NumberColumn<RangeDecoder> import_numbers_;
  RangeDecoder import_coder_{std::span<const std::byte>()};

  std::vector<VertexTerms> terms_;  // the vertices that the current block introduces, each with the
                                    // vertices that predict it (its terms)
};

}  // namespace shm
