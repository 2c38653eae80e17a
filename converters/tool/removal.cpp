#include "tool/removal.h"

#include <unistd.h>
#include <cerrno>
#include <cstring>
#include <filesystem>
#include <system_error>

#include "base/failure.h"
#include "compare/compare.h"
#include "compare/mesh_diff.h"
#include "series/open_series.h"
#include "tool/input.h"
#include "tool/progress_line.h"

namespace shm::converters {
namespace {

[[noreturn]] void refuse_removal(const std::string& path, const std::string& detail) {
  throw Failure(ErrorCode::output, detail, path);
}

// Describes the first difference between the two meshes. Returns an empty string if they are equal.
std::string first_difference(MeshSource& source, MeshSource& written, bool is_shm, Spool& spool,
                             const Progress& progress, const CellSequence* cell_order) {
  if (is_shm) {
    const CompareReport report = compare_meshes(source, written, spool, progress, cell_order);
    return report.equal() ? std::string() : report.first.front();
  }
  const MeshDiff diff = diff_meshes(source, written, {}, spool, progress);
  return diff.equal() ? std::string() : diff.differences.front().what + " differs";
}

}  // namespace

void check_removable(const std::string& path) {
  if (series_of(path)) refuse_removal(path, "is a series of files, which --rm does not remove");
  std::error_code none;
  const auto status = std::filesystem::symlink_status(path, none);
  if (std::filesystem::is_symlink(status))
    refuse_removal(path, "is a link, which --rm does not remove");
  if (std::filesystem::exists(status) && !std::filesystem::is_regular_file(status))
    refuse_removal(path, "is not a file that --rm can remove");
}

void remove_source(const std::string& source, const std::string& written, CommonOptions& options,
                   const Progress& progress, const CellSequence* cell_order) {
  Spool spool(spool_directory(options), spool_memory(options), mesh_limits(options));
  ToolInput source_file(options, source), written_file(options, written);
  const bool compressed = written_file.is_shm();
  const auto before = source_file.open(spool, progress);
  const auto after = written_file.open(spool, progress);
  WatchedMesh watched(*before, progress, "comparing");
  const std::string difference =
      first_difference(watched, *after, compressed, spool, progress, cell_order);
  if (!difference.empty())
    refuse_removal(source,
                   "is not removed, because " + written + " does not restore it: " + difference);
  if (::unlink(source.c_str()) != 0)
    refuse_removal(source, std::string("cannot be removed: ") + std::strerror(errno));
}

}  // namespace shm::converters
