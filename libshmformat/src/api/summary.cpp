// Summary: computes the totals of a file from the headers of its chunks, without decoding. A Reader
// counts the same totals while it decodes.
#include "shm/summary.h"

#include <algorithm>
#include <string>
#include <utility>

#include "base/errors.h"
#include "codecs/registry.h"
#include "format/random_chunks.h"
#include "format/schema.h"
#include "random/indexed_file.h"
#include "random/step_index.h"
#include "steps/bundle_chunk.h"

namespace shm {
namespace {

using container::ChunkHeader;
using container::ChunkKind;
using container::IndexEntry;
using container::StreamEntry;
using container::StreamKind;

/// Returns true if the index entry agrees with the header of the part of step values.
bool is_told_by(const container::StepEntry& entry, const container::StepPart& part) {
  const container::StepHeader& header = part.header;
  return header.array == entry.array && header.step == entry.step && header.group == entry.group &&
         header.arrays == entry.arrays && header.steps == entry.steps &&
         header.count == entry.count && header.codec == entry.codec &&
         header.reference == entry.reference;
}

class Summarizer {
 public:
  Summarizer(RandomSource& source, const ReadLimits& limits)
      : source_(&source), file_(source, limits) {}
  Result<Summary> run();

 private:
  Result<void> add_chunk(const ChunkHeader& header, const IndexEntry& entry);
  Result<void> add_group();
  Result<void> add_streams(std::size_t group, const std::vector<StreamEntry>& streams);
  Result<void> take_codec(std::size_t group, container::Codec codec);
  Result<void> add_step_values(const ChunkHeader& header, const IndexEntry& entry);
  Result<void> finish();

  Error wrong_group(std::size_t group, std::string detail,
                    ErrorCode code = ErrorCode::corrupt) const {
    return Error{code, std::move(detail), "group " + std::to_string(group),
                 file_.groups()[group].offset};
  }
  const Schema& schema() const { return file_.schema(); }

  RandomSource* source_;
  IndexedFile file_;
  std::vector<std::string> array_names_;  // stream names of the arrays
  std::size_t groups_ = 0;                // number of groups added so far
  bool has_step_values_ = false;
  bool has_index_ = false;  // true if the chunks so far include an index
  Summary summary_;
  Totals& totals_ = summary_.totals;
};

Result<Summary> Summarizer::run() {
  if (auto status = file_.open(); !status) return status.error();
  if (auto status = file_.expect_totals(); !status) return status.error();
  summary_.schema = schema();
  array_names_ = array_stream_names(schema());
  totals_.segment_connectivity.resize(file_.segments().size(), ConnectivityCodec::automatic);
  for (const SegmentInfo& segment : file_.segments())
    totals_.segment_starts.push_back(segment.first_cell);
  const auto add = [this](const ChunkHeader& header, const IndexEntry& entry) {
    return add_chunk(header, entry);
  };
  if (auto status =
          container::for_each_chunk(*source_, file_.index().entries, file_.index_offset(), add);
      !status)
    return status.error();
  auto times = file_.read_step_times();
  if (!times) return times.error();
  summary_.step_times = std::move(*times);
  auto extras = file_.read_extras();
  if (!extras) return extras.error();
  summary_.extras = std::move(*extras);
  if (auto status = finish(); !status) return status.error();
  return std::move(summary_);
}

Result<void> Summarizer::add_chunk(const ChunkHeader& header, const IndexEntry& entry) {
  const auto wrong = [&](std::string detail, ErrorCode code = ErrorCode::corrupt) {
    return Error{code, std::move(detail), container::chunk_name(entry.kind), entry.offset};
  };
  if (container::is_known(header)) switch (static_cast<ChunkKind>(header.kind)) {
      case ChunkKind::schema: return {};
      case ChunkKind::group:
        if (has_step_values_) return wrong("mesh groups come before step values");
        if (has_index_) return wrong("mesh groups come before the first index");
        return add_group();
      case ChunkKind::step_values: return add_step_values(header, entry);
      case ChunkKind::step_times:
      case ChunkKind::extra: totals_.streams["extras"] += header.payload_bytes; return {};
      case ChunkKind::index:
        if (!container::has_trailer_inside(header.version)) return wrong("another index follows");
        has_index_ = true;
        return {};
      case ChunkKind::members: break;
    }
  if ((header.flags & container::kChunkOptional) != 0) return {};
  return wrong("this reader does not support the chunk, and the chunk is not optional",
               ErrorCode::unsupported);
}

/// Adds the next group to the totals.
Result<void> Summarizer::add_group() {
  const std::size_t group = groups_++;
  const auto head = file_.read_group_head(group);
  if (!head) return head.error();
  const auto& streams = head->header.streams;
  totals_.max_active_vertices =
      std::max(totals_.max_active_vertices, head->header.max_active_vertices);
  totals_.imported_vertices += head->header.imported_vertices;
  const bool has_codec = !streams.empty() && streams[0].kind == StreamKind::connectivity;
  if (!has_codec && head->header.cells > 0) return wrong_group(group, "connectivity: missing");
  if (has_codec)
    if (auto status = take_codec(group, streams[0].codec); !status) return status;
  return add_streams(group, streams);
}

Result<void> Summarizer::add_streams(std::size_t group, const std::vector<StreamEntry>& streams) {
  const auto& arrays = schema().arrays;
  for (std::size_t s = 0; s < streams.size(); ++s) {
    const StreamEntry& stream = streams[s];
    const bool of_array = stream.kind == StreamKind::array;
    const bool known =
        of_array ? stream.array < arrays.size() && !arrays[stream.array].per_step
                 : stream.kind >= StreamKind::connectivity && stream.kind <= StreamKind::imports;
    const bool in_order = s == 0 || std::pair(streams[s - 1].kind, streams[s - 1].array) <
                                        std::pair(stream.kind, stream.array);
    const std::string name = container::stream_name(stream.kind);
    if (!known || !in_order) return wrong_group(group, name + ": unknown or out of order");
    totals_.streams[of_array ? array_names_[stream.array] : name] += stream.bytes;
  }
  return {};
}

Result<void> Summarizer::take_codec(std::size_t group, container::Codec codec) {
  const CellCodec* known = find_codec(codec);
  if (!known)
    return wrong_group(
        group, "connectivity: codec " + std::to_string(static_cast<int>(codec)) + " is unknown",
        ErrorCode::unsupported);
  ConnectivityCodec& of_segment = totals_.segment_connectivity[file_.groups()[group].segment];
  if (of_segment != ConnectivityCodec::automatic && of_segment != known->name)
    return wrong_group(
        group, "connectivity: its codec differs from that of earlier groups in this segment");
  of_segment = known->name;
  return {};
}

Result<void> Summarizer::add_step_values(const ChunkHeader& header, const IndexEntry& entry) {
  const std::string section = container::chunk_name(entry.kind);
  const auto bytes = container::read_bytes(
      *source_, entry.offset + header.bytes(),
      std::min(header.payload_bytes, container::most_step_head_bytes(std::min<std::uint64_t>(
                                         entry.parts.size(), container::kMostStepParts))),
      section);
  if (!bytes) return bytes.error();
  ByteReader in(*bytes);
  std::vector<container::StepPart> parts;
  if (!container::get(in, parts, header.version, header.payload_bytes))
    return corrupt("its header is invalid", section, entry.offset);
  if (!std::equal(entry.parts.begin(), entry.parts.end(), parts.begin(), parts.end(), is_told_by))
    return corrupt("the chunk at this position differs from its entry in the index", section,
                   entry.offset);
  for (const container::StepPart& part : parts) {
    if (part.header.array >= array_names_.size() ||
        part.header.arrays > array_names_.size() - part.header.array)
      return corrupt("does not belong to a stepped array", section, entry.offset);
    totals_.steps = std::max(totals_.steps, part.header.step + part.header.steps);
    if (part.header.codec != Codec::bundle)
      totals_.streams[array_names_[part.header.array]] += part.bytes;
  }
  if (parts[0].header.codec == Codec::bundle)
    for_each_share(parts, [&](std::uint32_t array, std::uint64_t share) {
      totals_.streams[array_names_[array]] += share;
    });
  has_step_values_ = true;
  return {};
}

/// Checks the totals of the index against the headers and copies them to the summary.
Result<void> Summarizer::finish() {
  const container::Index& index = file_.index();
  totals_.vertices = index.vertices;
  totals_.cells = index.cells;
  totals_.block_cells = index.block_cells;
  if (container::has_digest(index.version)) totals_.digest = index.digest;
  for (std::size_t b = 0; b < schema().blocks.size(); ++b)
    if (is_hexahedral(schema().blocks[b])) totals_.hexahedra += index.block_cells[b];
  totals_.steps = std::max<std::uint64_t>(totals_.steps, summary_.step_times.size());
  bool same = index.hexahedra == totals_.hexahedra &&
              index.max_active_vertices == totals_.max_active_vertices &&
              index.segments == file_.segments().size() &&
              index.imported_vertices == totals_.imported_vertices && index.steps == totals_.steps;
  if (index.version == 0) same = same && index.streams.size() == totals_.streams.size();
  std::uint64_t coded = 0;
  auto counted = totals_.streams.begin();
  for (std::size_t s = 0; same && s < index.streams.size(); ++s, ++counted)
    same = index.streams[s].name == counted->first && index.streams[s].bytes == counted->second;
  for (const auto& [name, bytes] : totals_.streams) coded += bytes;
  if (!same) return file_.wrong_index("does not match the contents of the file");
  totals_.total_bytes = source_->size();
  totals_.streams["container"] = totals_.total_bytes - coded;
  // StepIndex::of() checks that steps are complete and in order.
  const auto steps = StepIndex::of(file_);
  return steps ? Result<void>() : Result<void>(steps.error());
}

/// Checks the version and the features of the file before its first chunk is read.
Result<void> check_start(RandomSource& source, const ReadLimits& limits) {
  std::vector<std::byte> start(
      static_cast<std::size_t>(std::min<std::uint64_t>(source.size(), container::kFileStartBytes)));
  if (auto status = source.read_at(0, start); !status) return status;
  Decoder decoder(limits);
  if (auto status = decoder.feed(start); !status) return status;
  if (start.size() < container::kFileStartBytes) decoder.end_of_input();
  const auto progress = decoder.advance();
  return progress ? Result<void>() : Result<void>(progress.error());
}

}  // namespace

Result<std::uint64_t> bytes_of_file(RandomSource& source) {
  return container::bytes_of_file(source);
}

Result<Summary> read_summary(RandomSource& source, const ReadLimits& limits) {
  if (auto status = check_start(source, limits); !status) return status.error();
  const auto bytes = container::bytes_of_file(source);
  if (!bytes) return bytes.error();
  SectionSource file(source, 0, *bytes);
  // Limits for reading headers. The size of the mesh is not limited, since it is not decoded.
  ReadLimits of_heads = limits;
  of_heads.max_vertices = of_heads.max_cells = ReadLimits().max_cells;
  auto summary = Summarizer(file, of_heads).run();
  if (summary) summary->totals.trailing_bytes = source.size() - *bytes;
  return summary;
}

}  // namespace shm
