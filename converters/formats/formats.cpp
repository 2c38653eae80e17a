#include "formats/formats.h"

#include <algorithm>
#include <cctype>
#include <cerrno>
#include <cstdio>
#include <cstring>
#include <utility>

#include "base/failure.h"
#include "exodus/exodus.h"
#include "exodus/parts/merged_mesh.h"
#include "formats/unread_formats.h"
#include "gmsh/gmsh.h"
#include "ucd/ucd.h"
#include "vtk/legacy/vtk.h"
#include "vtk/xml/vtu.h"

namespace shm::converters {
namespace {

constexpr std::size_t kHeadBytes = 4096;
constexpr unsigned char kShmSignature[] = {0x89, 'S', 'H', 'M'};

std::string list_of(std::string_view Format::*word) {
  std::string list;
  for (const Format& each : formats()) list += (list.empty() ? "" : ", ") + std::string(each.*word);
  return list;
}

constexpr class NothingToAdd final : public SourceFormat {
} kNothingToAdd;
constexpr Format kUnknownFormat;
constexpr Role kUnknownRole;

std::vector<std::byte> head_of(const std::string& path) {
  std::vector<std::byte> head(kHeadBytes);
  std::FILE* file = std::fopen(path.c_str(), "rb");
  const std::size_t count = file != nullptr ? std::fread(head.data(), 1, head.size(), file) : 0;
  const bool failed = file == nullptr || (count == 0 && std::ferror(file) != 0);
  const int error = errno;
  if (file != nullptr) std::fclose(file);
  if (failed && error == ENOMEM) throw std::bad_alloc();
  if (failed)
    throw Failure(ErrorCode::io, std::string("cannot be read: ") + std::strerror(error), path);
  head.resize(count);
  return head;
}

bool same_letters(std::string_view a, std::string_view b) {
  return std::equal(a.begin(), a.end(), b.begin(), b.end(), [](char x, char y) {
    return std::tolower(static_cast<unsigned char>(x)) ==
           std::tolower(static_cast<unsigned char>(y));
  });
}

// Returns true if `part` is the extension without its dot, possibly followed by the number of a
// time step: "e" and "e-s002" match the extension ".e".
bool is_extension(std::string_view part, std::string_view extension) {
  extension.remove_prefix(1);
  if (!same_letters(part.substr(0, extension.size()), extension)) return false;
  part.remove_prefix(extension.size());
  return part.empty() || (part.size() > 2 && part.substr(0, 2) == "-s" &&
                          part.find_first_not_of("0123456789", 2) == std::string_view::npos);
}

// Returns true if `name` consists of `word` and a number. For the word "edgconn", "edgconn3"
// matches.
bool is_numbered(std::string_view name, std::string_view word) {
  return name.size() > word.size() && name.starts_with(word) &&
         name.find_first_not_of("0123456789", word.size()) == std::string_view::npos;
}

// Returns true if a file that begins with `head` does not have the format `format`, although
// `format.looks_like(head)` is true. For example, a CGNS file that is an HDF5 file looks like an
// Exodus file.
bool is_another(const Format& format, std::span<const std::byte> head) {
  return format.name == kExodusFormat.name && is_cgns(head);
}

}  // namespace

std::span<const Format> formats() {
  static const Format all[] = {
      kExodusFormat,
      kVtkFormat,
      kVtuFormat,
      kGmshFormat,
      kUcdFormat,
      {.name = "shm",
       .title = ".shm",
       .extensions = {".shm"},
       .looks_like = looks_like_shm,
       .holds_everything = true,
       .capabilities =
           {.sets = Capabilities::Sets::sets,
            .every_step = true,
            .partial_arrays = true,
            .block_numbers = true,
            .maps = &kExodusMaps,
            .block = [](const BlockInfo& block) { return block.shape != CellShape::polyhedron; }}},
  };
  return all;
}

bool is_foreign(const MeshInfo& info, const Format& format) {
  return !format.holds_everything && info.schema.source_format != format.name;
}

bool looks_like_shm(std::span<const std::byte> head) {
  return head.size() >= sizeof kShmSignature &&
         std::memcmp(head.data(), kShmSignature, sizeof kShmSignature) == 0;
}

const Format* format_named(std::string_view name) {
  for (const Format& format : formats())
    if (format.name == name) return &format;
  return nullptr;
}

const Format& format_of(const MeshInfo& info) {
  const Format* format = format_named(info.schema.source_format);
  return format == nullptr ? kUnknownFormat : *format;
}

const SourceFormat& source_format(const MeshInfo& info) {
  const Format& format = format_of(info);
  return format.source == nullptr ? kNothingToAdd : *format.source;
}

const Role& role_of(const ArrayInfo& array) {
  const std::string_view name = array.role;
  const Format* format = format_named(name.substr(0, name.find(':')));
  if (format == nullptr) return kUnknownRole;
  for (const Role& role : format->roles)
    if (role.is_numbered ? is_numbered(name, role.name) : name == role.name) return role;
  return kUnknownRole;
}

void translate_old_extras(MeshInfo& info) {
  const Format& format = format_of(info);
  if (format.translate_old_extras != nullptr) format.translate_old_extras(info);
}

const Format* format_of_name(std::string_view path) {
  const std::size_t slash = path.rfind('/');
  std::string_view name = slash == std::string_view::npos ? path : path.substr(slash + 1);
  while (true) {
    const std::size_t dot = name.rfind('.');
    if (dot == std::string_view::npos) return nullptr;
    const std::string_view part = name.substr(dot + 1);
    for (const Format& format : formats())
      for (const std::string_view extension : format.extensions)
        if (!extension.empty() && is_extension(part, extension)) return &format;
    // In a name such as out.e.4.0, the numbers at the end are ignored, and ".e" is the extension.
    if (part.empty() || part.find_first_not_of("0123456789") != std::string_view::npos)
      return nullptr;
    name = name.substr(0, dot);
  }
}

const Format* format_of_file(const std::string& path) {
  if (path == "-") return format_named("shm");
  const std::vector<std::byte> head = head_of(path);
  // The content of a file matches at most one format. Try the format that the file name suggests
  // first.
  const Format* named = format_of_name(path);
  if (named != nullptr && named->looks_like(head) && !is_another(*named, head)) return named;
  for (const Format& format : formats())
    if (format.looks_like(head)) return is_another(format, head) ? nullptr : &format;
  return head.empty() || !unread_format(head).empty() ? nullptr : named;
}

std::vector<std::string> files_of_parts(const std::vector<std::string>& inputs) {
  if (inputs.size() != 1) return inputs;
  const std::size_t parts = count_of_parts(inputs.front());
  return parts > 0 ? part_files(inputs.front(), parts) : inputs;
}

std::unique_ptr<MeshSource> open_merged(const std::vector<std::string>& files, Spool& spool) {
  for (const std::string& file : files)
    if (format_of_file(file) != format_named(kExodusFormat.name))
      throw Failure(ErrorCode::unsupported,
                    "is not an Exodus file; only Exodus files contain global vertex and cell "
                    "numbers",
                    file);
  return std::make_unique<MergedMesh>(files, spool);
}

const Format& input_format(const std::string& path) {
  if (const Format* format = format_of_file(path)) return *format;
  const std::vector<std::byte> head = head_of(path);
  if (head.empty()) throw Failure(ErrorCode::truncated, "is empty", path);
  const std::string other(unread_format(head));
  throw Failure(
      ErrorCode::unsupported,
      other.empty()
          ? "is not a mesh in a supported format: " + list_of(&Format::title)
          : "is " + other + ", which cannot be read; supported formats: " + list_of(&Format::title),
      path);
}

const Format& output_format(const std::string& path, const std::string& format) {
  const Format* found = format.empty() ? format_of_name(path) : format_named(format);
  if (found != nullptr) return *found;
  const std::string known = list_of(&Format::name);
  throw Failure(ErrorCode::misuse,
                format.empty()
                    ? "its name does not determine the format; use --format (" + known + ")"
                    : "unknown format '" + format + "'; known: " + known,
                path);
}

}  // namespace shm::converters
