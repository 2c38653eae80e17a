// SegmentReader: finds the groups of one segment in the index, and decodes only these groups.
#include "shm/segment_reader.h"

#include <string>
#include <utility>

#include "base/errors.h"
#include "pipeline/mesh_decoder.h"
#include "random/indexed_file.h"

namespace shm {

class __attribute__((visibility("hidden"))) SegmentReader::Impl {
 public:
  Impl(RandomSource& source, const ReadLimits& limits) : file(source, limits) {}
  Result<std::vector<MeshBlock>> read(std::size_t index);

  IndexedFile file;
};

Result<std::vector<MeshBlock>> SegmentReader::Impl::read(std::size_t index) {
  const auto& segments = file.segments();
  if (index >= segments.size())
    return misuse("there is no segment " + std::to_string(index), "segments");
  const DecodedParts parts{.imported_vertices = true};
  SegmentDecoder decoder(file.schema(), file.limits(), static_cast<std::uint32_t>(index), parts);
  std::vector<MeshBlock> blocks;
  for (std::size_t g = file.first_group(index); g < file.first_group(index + 1); ++g) {
    auto chunk = file.read_group(g, parts);
    if (!chunk) return chunk.error();
    if (auto status = decoder.begin_group(std::move(*chunk)); !status) return status.error();
    if (auto status = file.expect_group(g, decoder.group()); !status) return status.error();
    while (decoder.in_group()) {
      auto block = decoder.next_block();
      if (!block) return block.error();
      blocks.push_back(std::move(block->mesh));
    }
  }
  return blocks;
}

SegmentReader::SegmentReader(std::unique_ptr<Impl> impl) : impl_(std::move(impl)) {}
SegmentReader::SegmentReader(SegmentReader&&) noexcept = default;
SegmentReader& SegmentReader::operator=(SegmentReader&&) noexcept = default;
SegmentReader::~SegmentReader() = default;

Result<SegmentReader> SegmentReader::open(RandomSource& source, const ReadLimits& limits) {
  auto impl = std::make_unique<Impl>(source, limits);
  if (auto status = impl->file.open(); !status) return status.error();
  return SegmentReader(std::move(impl));
}
const Schema& SegmentReader::schema() const { return impl_->file.schema(); }
const std::vector<SegmentInfo>& SegmentReader::segments() const { return impl_->file.segments(); }
Result<std::vector<MeshBlock>> SegmentReader::read(std::size_t index) { return impl_->read(index); }

}  // namespace shm
