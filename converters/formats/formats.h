// Formats: the table of all formats that the converters read and write. The content of a file
// determines its format; the name of the file matters only if the content is not conclusive. To add
// a format:
// - Create a folder with its reader, its writer and a format.cpp that describes it.
// - Add a line to the table in formats.cpp, to the list of folders in converters/CMakeLists.txt,
//   and to the list in tests/library/rules_test.cpp.
// - Add a test in tests/formats.
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

// format_named() returns the format with a name; format_of_name() returns the format to which the
// extension of `path` belongs. Both return null if no such format exists. Names such as
// "out.e.4.0" and "out.e-s002" are treated like "out.e".
const Format* format_named(std::string_view name);
const Format* format_of_name(std::string_view path);

// Returns the format of an existing file. The content of the file determines the format; if the
// content is not conclusive, the file name does. Returns null if neither is conclusive. "-"
// (standard input) is a .shm file. Throws Failure (io) if the file cannot be read.
const Format* format_of_file(const std::string& path);

// Returns true if a file that begins with `head` is a .shm file.
bool looks_like_shm(std::span<const std::byte> head);

// Returns the files of a decomposed mesh. If the only input is NAME.COUNT and no file has that
// name, it means the files NAME.COUNT.0, NAME.COUNT.1 and so on. Other inputs are returned
// unchanged.
std::vector<std::string> files_of_parts(const std::vector<std::string>& inputs);
// Opens the parts of a decomposed mesh as one mesh. The parts are joined by the numbers that their
// vertices and cells have in the whole mesh. Only Exodus files have such numbers. Throws Failure:
// unsupported if a part is not an Exodus file or contains data that cannot be joined, corrupt if
// parts contradict each other.
std::unique_ptr<MeshSource> open_merged(const std::vector<std::string>& files, Spool& spool);

// Returns the format in which open_mesh() reads a file. Throws Failure: io if the file does not
// exist, truncated if it is empty, unsupported if its format is unknown.
const Format& input_format(const std::string& path);
// Returns the format in which write_mesh() writes a file: `format` if it is not empty, otherwise
// the format of the file name's extension. Throws Failure (misuse) if no such format exists.
const Format& output_format(const std::string& path, const std::string& format);

// format_of() returns the format that a mesh came from; source_format() returns the object that
// interprets the mesh's extras. For an unknown format, format_of() returns a Format with default
// values, and source_format() returns an object whose functions all have their default
// implementations.
const Format& format_of(const MeshInfo& info);
const SourceFormat& source_format(const MeshInfo& info);
// Returns the meaning of an array's role. If the role is empty or unknown, returns a Role with
// default values.
const Role& role_of(const ArrayInfo& array);
// Converts the extras of a mesh that was read from a .shm file of any version to the extras that
// this version writes. Requires the complete MeshInfo.
void translate_old_extras(MeshInfo& info);

// Returns true if a mesh came from another format, so that it must be translated for `format`.
bool is_foreign(const MeshInfo& info, const Format& format);

}  // namespace shm::converters
