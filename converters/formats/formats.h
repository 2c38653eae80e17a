// Formats: the files that meshes come from and go to, as a plain list.
// A file is recognised by what it holds; its name decides only when the content does not tell.
#pragma once

#include <cstddef>
#include <memory>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "base/output_file.h"
#include "base/progress.h"
#include "base/spool.h"
#include "mesh/mesh_source.h"
#include "transfer/losses.h"

namespace shm::converters {

struct Format {
  std::string_view name;  // as in --format
  std::vector<std::string_view> extensions;
  bool (*looks_like)(std::span<const std::byte> head);  // up to 4096 bytes
  std::unique_ptr<MeshSource> (*open)(const std::string& path, Spool& spool,
                                      const Progress& progress);
  void (*write)(MeshSource& mesh, OutputFile& output, Spool& spool);  // commits nothing
  const Holds* holds;  // of meshes from other formats; null: all of them
  FileSink::Temporary temporary = FileSink::Temporary::unnamed;  // of its files
};

const std::vector<Format>& formats();

// Null when no format has that name, or no extension of `path` belongs to one. Names such as
// "out.e.4.0" and "out.e-s002" count as ".e".
const Format* format_named(std::string_view name);
const Format* format_of_name(std::string_view path);

// The format of a file that is there: by its content, or else by its name; null when neither
// tells. "-", standard input, counts as .shm. Throws Failure (io) when it cannot be read.
const Format* format_of_file(const std::string& path);

// Opens any mesh. Throws Failure: io when there is no such
// file, unsupported when it is of no known format.
std::unique_ptr<MeshSource> open_mesh(const std::string& path, Spool& spool,
                                      const Progress& progress = {});

// The format that write_mesh will take. Throws Failure (misuse) when neither `format` (may be
// empty) nor the name tells.
const Format& output_format(const std::string& path, const std::string& format);

// Whether a mesh has to be translated for `format`, which never had it.
bool is_foreign(const MeshInfo& info, const Format& format);

// Writes `mesh` to a temporary file, then gives that its name. "-" is standard output, which gets
// a .shm file as it comes, and all else at the end. Throws Failure.
void write_mesh(MeshSource& mesh, const std::string& path, const Format& format, Spool& spool);

}  // namespace shm::converters
