// Formats: the list of all formats that are read and written. To add a format: create a folder with
// its reader, its writer and a format.cpp that describes it; add a line to the table in
// formats.cpp, to the list of folders in converters/CMakeLists.txt and to the one in
// tests/library/rules_test.cpp; add a test in tests/formats. A file is recognized by its content;
// its name decides only if the content does not.
#pragma once

#include <cstddef>
#include <memory>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "base/spool.h"
#include "interface/format.h"
#include "mesh/mesh_source.h"

namespace shm::converters {

std::span<const Format> formats();

// Return null if no format has that name, or if the extension of `path` belongs to no format. Names
// such as "out.e.4.0" and "out.e-s002" count as ".e".
const Format* format_named(std::string_view name);
const Format* format_of_name(std::string_view path);

// Returns the format of an existing file, by its content, or by its name if the content does not
// decide; null if neither decides. "-" (standard input) counts as .shm. Throws Failure (io) if the
// file cannot be read.
const Format* format_of_file(const std::string& path);

// Returns true if a file that begins with `head` is a .shm file.
bool looks_like_shm(std::span<const std::byte> head);

// Returns the files of a decomposed mesh. A single name NAME.COUNT stands for the files
// NAME.COUNT.0 and so on if there is no file of that name; other inputs are returned unchanged.
std::vector<std::string> files_of_parts(const std::vector<std::string>& inputs);
// Opens the parts of a decomposed mesh as one mesh, by the numbers that their vertices and cells
// have in the whole mesh. Only Exodus files have such numbers. Throws Failure: unsupported if a
// part is not an Exodus file or contains something that cannot be joined, corrupt if parts
// contradict each other.
std::unique_ptr<MeshSource> open_merged(const std::vector<std::string>& files, Spool& spool);

// Returns the format for open_mesh(). Throws Failure: io if the file does not exist, truncated if
// it is empty, unsupported if its format is unknown.
const Format& input_format(const std::string& path);
// Returns the format for write_mesh(). Throws Failure (misuse) if neither `format` (may be empty)
// nor the name of the file decides.
const Format& output_format(const std::string& path, const std::string& format);

// Return the format that a mesh came from, and how its extras are interpreted. For an unknown
// format they are one with default values, and one that overrides nothing.
const Format& format_of(const MeshInfo& info);
const SourceFormat& source_format(const MeshInfo& info);
// Returns the meaning of an array's role; for an unknown role, and for none, one with default
// values.
const Role& role_of(const ArrayInfo& array);
// Converts extras from a .shm file of any version to those that this version writes. Requires the
// complete MeshInfo.
void translate_old_extras(MeshInfo& info);

// Returns true if a mesh must be translated for `format` because it came from another format.
bool is_foreign(const MeshInfo& info, const Format& format);

}  // namespace shm::converters
