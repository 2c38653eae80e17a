#include "access/indexed_topology.h"

#include <span>
#include <string>
#include <utility>
#include <vector>

namespace shm {

Result<void> add_group(IndexedFile& file, std::size_t group, StepTopology& topology) {
  const auto head = file.read_group_head(group);
  if (!head) return head.error();
  const ReadLimits& limits = file.limits();
  if (head->header.max_active_vertices > limits.max_active_vertices ||
      head->header.decoded_bytes > limits.max_group_bytes)
    return IndexedFile::wrong("takes more memory than the limit", "group " + std::to_string(group),
                              file.groups()[group].offset, ErrorCode::over_limit);
  std::vector<std::vector<std::byte>> streams(head->header.streams.size());
  for (std::size_t s = 0; s < streams.size(); ++s) {
    if (!topology.uses(head->header, head->header.streams[s])) continue;
    auto bytes = file.read_stream(group, *head, s);
    if (!bytes) return bytes.error();
    streams[s] = std::move(*bytes);
  }
  topology.add_group(file.groups()[group].segment, head->header,
                     std::vector<std::span<const std::byte>>(streams.begin(), streams.end()));
  return {};
}

}  // namespace shm
