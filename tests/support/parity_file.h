// Creates a file with parity after its trailer. It is one of the golden files.
#pragma once

#include <algorithm>
#include <vector>

#include "archive/parity.h"
#include "base/failure.h"
#include "support/feature_files.h"

namespace shm {

/// Returns the feature file "segments" with parity. Precondition: has_parity_codes() is true.
inline FeatureFile parity_file() {
  const std::vector<FeatureFile> files = feature_files();
  FeatureFile out =
      *std::find_if(files.begin(), files.end(), [](auto& it) { return it.name == "segments"; });
  MemoryRandomSource source(out.bytes);
  MemorySink sink;
  converters::write_parity(source, converters::parity_shape(out.bytes.size(), .5), sink);
  out.name = "parity";
  std::vector<std::byte> all = out.bytes;
  all.insert(all.end(), sink.bytes.begin(), sink.bytes.end());
  out.bytes = std::move(all);
  return out;
}

}  // namespace shm
