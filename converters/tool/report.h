// Formats the reports of the tool about meshes and files, as human-readable text or as JSON.
#pragma once

#include <cstddef>
#include <cstdint>
#include <map>
#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <string>
#include <vector>

#include "archive/archive_files.h"
#include "archive/parity.h"
#include "compare/compare.h"
#include "mesh/mesh_source.h"
#include "shm/reader.h"
#include "shm/writer.h"

namespace shm::converters {

struct CompressRun {
  std::string input, output;
  std::uint64_t input_bytes = 0;
  double seconds = 0;
  SizeReport sizes;
};
std::string compress_json(const CompressRun& run, const MeshInfo& info);
// Formats two sizes and their ratio, such as "41 bytes from 82, 2.00 times smaller". If `of_what`
// is not empty, it is inserted after the second size.
std::string ratio_text(std::uint64_t bytes, std::uint64_t source_bytes,
                       const std::string& of_what = {});
std::string compress_text(const CompressRun& run, const MeshInfo& info);

// Returns the encoded size of connectivity in bits per cell. Connectivity includes corner order,
// vertex numbers, cell numbers and imports (vertices that a segment uses but an earlier segment
// owns).
double bits_a_cell(const SizeReport& sizes);
// Returns a hint that --order free would make the file smaller, or an empty string if the saving
// would be small. `free_bytes` is the file size with --order free, if a trial has measured it.
std::string free_order_hint(const CompressRun& run, std::optional<std::uint64_t> free_bytes);

// join_json() and join_text() return the report of shm join.
std::string join_json(const std::string& output, std::uint64_t output_bytes,
                      const std::vector<MemberReport>& members);
std::string join_text(const std::string& output, std::uint64_t output_bytes,
                      const std::vector<MemberReport>& members);

// Reports of shm verify. sound_json() describes a file that could be decoded. compare_json() and
// compare_text() describe the comparison of a file with its source. `stray_bytes` is the number of
// bytes after the end of the mesh that are not parity.
std::string sound_json(const std::string& path, const MeshInfo& info, const ParityState& parity,
                       std::uint64_t stray_bytes);
std::string compare_json(const CompareReport& report, const std::string& source,
                         const std::string& restored, const MeshInfo& info,
                         std::uint64_t stray_bytes);
std::string compare_text(const CompareReport& report, const std::string& source,
                         const std::string& restored, std::uint64_t stray_bytes);

// Converts JSON to text. Names come from files and may not be valid UTF-8, so invalid bytes are
// replaced.
std::string json_text(const nlohmann::json& json);

// Formats the vertex and cell counts, such as "3 vertices, 1 hexahedron, 2 other cells".
std::string counts_text(const MeshInfo& info);

// Helper functions and types from which the reports are composed.
using Json = nlohmann::ordered_json;
std::string dump(const Json& json);
std::string plural(std::uint64_t count, const std::string& one, const std::string& many);
std::string fixed(double value, int digits);
// Formats a digest: 16 hexadecimal digits.
std::string hexadecimal(std::uint64_t digest);
Json bits_each(std::uint64_t bytes, std::uint64_t count);  // null if `count` is 0
std::uint64_t bytes_of(const std::map<std::string, std::uint64_t>& streams,
                       const std::string& kind);
std::uint64_t connectivity_bytes(const std::map<std::string, std::uint64_t>& streams);
std::uint64_t hexahedra_of(const MeshInfo& info);
std::uint64_t value_count(const MeshInfo& info,
                          std::size_t array);  // over all steps and components

}  // namespace shm::converters
