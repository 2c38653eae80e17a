// Formats: the files that meshes come from and go to, as a plain list. To add one: a folder with
// its reader, its writer and format.cpp, which describes it; its line in the table of formats.cpp,
// in the rooms of converters/CMakeLists.txt and of tests/library/rules_test.cpp; a test in
// tests/formats. A file is recognised by what it holds; its name decides only when its content does
// not decide.
#pragma once

#include <memory>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "base/output_file.h"
#include "base/progress.h"
#include "base/spool.h"
#include "mesh/mesh_source.h"
#include "transfer/format.h"

namespace shm::converters {

std::span<const Format> formats();

// What a .shm file holds of a mesh from elsewhere: all but faces of polyhedra.
extern const Capabilities kShmCapabilities;

// Null when no format has that name, or no extension of `path` belongs to one. Names such as
// "out.e.4.0" and "out.e-s002" count as ".e".
const Format* format_named(std::string_view name);
const Format* format_of_name(std::string_view path);

// The format of a file that is there: by its content, or else by its name; null when neither
// decides. "-", standard input, counts as .shm. Throws Failure (io) when it cannot be read.
const Format* format_of_file(const std::string& path);

// Opens any mesh. Throws Failure: io when there is no such
// file, unsupported when it is of no known format.
std::unique_ptr<MeshSource> open_mesh(const std::string& path, Spool& spool,
                                      const Progress& progress = {});

// The parts of a decomposed mesh as the whole one, by the numbers that its vertices and cells have
// there. One file NAME.COUNT that is not there means the parts
// NAME.COUNT.0 and so on. Only Exodus files have such numbers.
std::vector<std::string> files_of_parts(const std::vector<std::string>& inputs);
// Throws Failure: unsupported where a part is no Exodus file or has what cannot be joined, corrupt
// where parts contradict each other.
std::unique_ptr<MeshSource> open_merged(const std::vector<std::string>& files, Spool& spool);

// The format that write_mesh will take. Throws Failure (misuse) when neither `format` (may be
// empty) nor the name decides.
const Format& output_format(const std::string& path, const std::string& format);

// Whether a mesh has to be translated for `format`, which never had it.
bool is_foreign(const MeshInfo& info, const Format& format);

// Writes `mesh` to a temporary file, then gives that its name. "-" is standard output, which gets
// a .shm file as it comes, and all else at the end. Throws Failure.
void write_mesh(MeshSource& mesh, const std::string& path, const Format& format, Spool& spool);
// The same for who commits the output.
void write_mesh(MeshSource& mesh, OutputFile& output, const Format& format, Spool& spool);

}  // namespace shm::converters
