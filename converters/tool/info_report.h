// Reports of shm info. They describe the mesh first, and then its encoding.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "compression/decompress.h"
#include "mesh/mesh_source.h"

namespace shm::converters {

// Smallest and largest finite value of an array, over all components, elements and steps.
struct FoundRange {
  double least = 0, most = 0;
  bool is_empty = true;
  std::uint64_t not_finite = 0;
};

// Information about a mesh that the headers of a file do not contain. The values of the mesh must
// be read to determine it.
struct InfoExtent {
  std::optional<std::array<double, 6>> box;  // bounding box: lowest x, y, z, then highest x, y, z
  std::vector<FoundRange> ranges;  // value ranges, one per array; empty if the values were not read
  bool is_unreadable = false;      // true if the values could not be read
};

// Opens the .shm file at `path` and returns the bounding box that is stored in its index. Ignores
// the last `trailing_bytes` bytes of the file.
std::optional<std::array<double, 6>> box_of_index(const std::string& path,
                                                  std::uint64_t trailing_bytes);
// Computes the bounding box from all vertex coordinates. If `ranges` is true, also reads all values
// and computes the range of each array.
InfoExtent measure_extent(MeshSource& mesh, bool ranges, const Progress& progress);

struct InfoReport {
  std::string path;
  const MeshInfo& info;
  const Totals* totals;  // counts and stream sizes of a .shm file; null for other formats
  InfoExtent extent;
};
std::string info_json(const InfoReport& report);
// Formats the report as text. If `verbose` is true, the report includes order, codecs, segments and
// streams.
std::string info_text(const InfoReport& report, bool verbose);

struct MemberSummary {
  std::string name;
  FileSummary file;
};
std::string archive_json(const std::string& path, const std::vector<MemberSummary>& members);
std::string archive_text(const std::string& path, const std::vector<MemberSummary>& members);

}  // namespace shm::converters
