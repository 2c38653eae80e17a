// The table of all formats that the converters read and write. The content of a file determines its
// format. The file name is used only if the content is not conclusive. To add a format:
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

// format_named() returns the format called `name`. format_of_name() returns the format to which the
// extension of the file name `path` belongs. Both functions return null if no such format exists.
// Names such as "out.e.4.0" and "out.e-s002" are treated like "out.e".
const Format* format_named(std::string_view name);
const Format* format_of_name(std::string_view path);

// Returns the format of an existing file. The content of the file determines the format; if the
// content is not conclusive, the file name determines it. Returns null if the file name is not
// conclusive either. If `path` is "-" (standard input), returns the format of .shm files. Throws
// Failure (io) if the file cannot be read.
const Format* format_of_file(const std::string& path);

// Returns true if a file that begins with `head` is a .shm file.
bool looks_like_shm(std::span<const std::byte> head);

// Returns the part files of a decomposed mesh. If the only input is NAME.COUNT and no file has that
// name, the part files are NAME.COUNT.0, NAME.COUNT.1 and so on. In all other cases, returns
// `inputs` unchanged.
std::vector<std::string> files_of_parts(const std::vector<std::string>& inputs);
// Opens the parts of a decomposed mesh as one mesh. Joins the parts by means of the global vertex
// and cell numbers (the numbers in the whole mesh) that each part file contains. Only Exodus files
// contain such numbers. Throws Failure: unsupported if a part is not an Exodus file or contains
// data that cannot be joined, corrupt if parts contradict each other.
std::unique_ptr<MeshSource> open_merged(const std::vector<std::string>& files, Spool& spool);

// Returns the format in which open_mesh() reads a file. Throws Failure: io if the file does not
// exist, truncated if it is empty, unsupported if its format is unknown.
const Format& input_format(const std::string& path);
// Returns the format in which the file `path` is to be written: the format called `format`, or, if
// `format` is empty, the format to which the extension of `path` belongs. Throws Failure (misuse)
// if no such format exists.
const Format& output_format(const std::string& path, const std::string& format);

// format_of() returns the format of the file from which a mesh was read. source_format() returns
// the object that interprets the extras of the mesh. If the format is unknown, format_of() returns
// a Format with default values, and source_format() an object with default implementations.
const Format& format_of(const MeshInfo& info);
const SourceFormat& source_format(const MeshInfo& info);
// Returns the Role with the properties of the role of an array. If the role is empty or unknown,
// returns a Role with default values.
const Role& role_of(const ArrayInfo& array);
// For a mesh from an old .shm file: replaces its extras with the extras that the current version
// would write. `info` must be complete.
void translate_old_extras(MeshInfo& info);

// Returns true if a mesh came from a format other than `format` and must be translated before it
// can be written in `format`.
bool is_foreign(const MeshInfo& info, const Format& format);

}  // namespace shm::converters
