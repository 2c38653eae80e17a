// What the tool reports about meshes and files, as text for people and JSON for programs.
#pragma once

#include <cstdint>
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
// "41 bytes from 82, 2.00 times smaller".
std::string ratio_text(std::uint64_t bytes, std::uint64_t source_bytes);
std::string compress_text(const CompressRun& run, const MeshInfo& info);

// Bits a cell of connectivity and of all numbers.
double bits_a_cell(const SizeReport& sizes);
// A hint that the same mesh in another order would need only `free_bytes`, as far as that is known;
// empty when that is not worth a word.
std::string free_order_hint(const CompressRun& run, std::optional<std::uint64_t> free_bytes);

// `totals`: null for files that are not .shm.
std::string info_json(const std::string& path, const MeshInfo& info, const Totals* totals);
std::string info_text(const std::string& path, const MeshInfo& info, const Totals* totals);

// The same of the members of an archive, and what join made of its inputs.
struct MemberSummary {
  std::string name;
  FileSummary file;
};
std::string archive_json(const std::string& path, const std::vector<MemberSummary>& members);
std::string archive_text(const std::string& path, const std::vector<MemberSummary>& members);
std::string join_json(const std::string& output, std::uint64_t output_bytes,
                      const std::vector<MemberReport>& members);
std::string join_text(const std::string& output, std::uint64_t output_bytes,
                      const std::vector<MemberReport>& members);

// What verify reports: of a file that could be decoded, with so many bytes behind its end; and of
// how it compares with its source.
std::string sound_json(const std::string& path, const MeshInfo& info, const ParityState& parity,
                       std::uint64_t stray_bytes);
std::string compare_json(const CompareReport& report, const std::string& source,
                         const std::string& restored, const MeshInfo& info);
std::string compare_text(const CompareReport& report, const std::string& source,
                         const std::string& restored);

// Names come from files and need not be UTF-8.
std::string json_text(const nlohmann::json& json);

// "3 vertices, 1 hexahedron, 2 other cells"
std::string counts_text(const MeshInfo& info);

}  // namespace shm::converters
