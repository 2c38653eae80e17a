#include "series/open_series.h"

#include <array>
#include <cstddef>
#include <filesystem>
#include <span>
#include <string_view>
#include <system_error>

#include "base/failure.h"
#include "files/mesh_files.h"
#include "series/numbered_name.h"
#include "shm/io.h"
#include "vtk/xml/collection.h"

namespace shm::converters {
namespace {

namespace fs = std::filesystem;

bool is_collection(const std::string& path) {
  constexpr std::size_t kHeadBytes = 4096;
  std::array<std::byte, kHeadBytes> head{};
  const auto file = unwrap(FileSource::open(path), path);
  const auto read = std::span(head).first(unwrap(file->read(head), path));
  const std::string_view text(reinterpret_cast<const char*>(read.data()), read.size());
  return text.find("Collection") != std::string_view::npos && looks_like_collection(read);
}

// Returns the files that a collection (.pvd) lists. Paths in the collection are relative to its
// folder, as in ParaView.
std::vector<SeriesFile> files_of_collection(const std::string& path) {
  std::vector<SeriesFile> files;
  for (const CollectedFile& each : read_collection(path))
    files.push_back({(fs::path(path).parent_path() / each.file).string(), each.time});
  return files;
}

}  // namespace

std::optional<std::vector<SeriesFile>> series_of(const std::string& path) {
  std::error_code none;
  const auto status = fs::status(path, none);
  if (fs::is_regular_file(status)) {
    if (!is_collection(path)) return std::nullopt;
    return files_of_collection(path);
  }
  const auto name = fs::exists(status) || path == "-" ? std::nullopt : NumberedName::of(path);
  if (!name) return std::nullopt;
  std::vector<SeriesFile> files;
  for (const NumberedName::File& each : name->files()) files.push_back({each.path, {}});
  if (files.empty())
    throw Failure(ErrorCode::io,
                  "no file matches this name; for example, " + name->at(0) + " does not exist",
                  path);
  return files;
}

std::vector<std::string> files_of(const std::string& path) {
  std::vector<std::string> paths = {path};
  if (const auto series = series_of(path))
    for (const SeriesFile& file : *series) paths.push_back(file.path);
  return paths;
}

std::unique_ptr<MeshSource> open_any(const std::string& path, Spool& spool,
                                     const Progress& progress, const Remark& remark) {
  const auto series = series_of(path);
  return series ? open_series(*series, spool, progress, remark) : open_mesh(path, spool, progress);
}

}  // namespace shm::converters
