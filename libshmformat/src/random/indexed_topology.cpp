#include "random/indexed_topology.h"

#include <span>
#include <string>
#include <utility>
#include <vector>

#include "base/errors.h"
#include "codecs/registry.h"

namespace shm {

Result<void> add_group(IndexedFile& file, std::size_t group, StepTopology& topology) {
  const auto head = file.read_group_head(group);
  if (!head) return head.error();
  const ReadLimits& limits = file.limits();
  const auto& entry = file.groups()[group];
  const auto wrong = [&](const std::string& detail) {
    return over_limit(detail, "group " + std::to_string(group), entry.offset);
  };
  if (auto status = check_active(head->header, limits, entry.offset + entry.bytes); !status)
    return wrong(status.error().detail);
  if (head->header.decoded_bytes > limits.max_group_bytes)
    return wrong("needs more memory than the limit");
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
