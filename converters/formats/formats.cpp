#include "formats/formats.h"

#include <algorithm>
#include <cctype>
#include <cerrno>
#include <cstdio>
#include <cstring>
#include <utility>

#include "base/failure.h"
#include "compression/compress.h"
#include "compression/decompress.h"
#include "exodus/exodus.h"
#include "gmsh/gmsh.h"
#include "ucd/ucd.h"
#include "vtk/between/vtk_from_vtu.h"
#include "vtk/between/vtu_from_vtk.h"
#include "vtk/legacy/vtk.h"
#include "vtk/xml/vtu.h"

namespace shm::converters {
namespace {

constexpr std::size_t kHeadBytes = 4096;

// Formats whose readers and writers need no more than this.
template <auto kOpen>
std::unique_ptr<MeshSource> open_plain(const std::string& path, Spool& spool, const Progress&) {
  return kOpen(path, spool);
}
template <auto kWrite>
void write_plain(MeshSource& mesh, OutputFile& output, Spool&) {
  kWrite(mesh, output.temporary());
}

void write_vtu_file(MeshSource& mesh, OutputFile& output, Spool& spool) {
  write_vtu(mesh, output.temporary(), spool);
}

void write_shm(MeshSource& mesh, OutputFile& output, Spool& spool) {
  FileSink& sink = output.sink();
  compress_mesh(mesh, sink, {}, spool);
}

std::vector<std::byte> head_of(const std::string& path) {
  std::FILE* file = std::fopen(path.c_str(), "rb");
  std::vector<std::byte> head(kHeadBytes);
  const std::size_t count = file != nullptr ? std::fread(head.data(), 1, head.size(), file) : 0;
  const bool failed = file == nullptr || (count == 0 && std::ferror(file) != 0);
  const int error = errno;
  if (file != nullptr) std::fclose(file);
  if (failed)
    throw Failure(Error{ErrorCode::io,
                        std::string("cannot be read: ") + std::strerror(error),
                        {},
                        kNoOffset,
                        path});
  head.resize(count);
  return head;
}

bool same_letters(std::string_view a, std::string_view b) {
  return std::equal(a.begin(), a.end(), b.begin(), b.end(), [](char x, char y) {
    return std::tolower(static_cast<unsigned char>(x)) ==
           std::tolower(static_cast<unsigned char>(y));
  });
}

// Whether `part` is "e" or "e-s002" for extension ".e".
bool is_extension(std::string_view part, std::string_view extension) {
  extension.remove_prefix(1);
  if (!same_letters(part.substr(0, extension.size()), extension)) return false;
  part.remove_prefix(extension.size());
  return part.empty() || (part.size() > 2 && part.substr(0, 2) == "-s" &&
                          part.find_first_not_of("0123456789", 2) == std::string_view::npos);
}

}  // namespace

bool is_foreign(const MeshInfo& info, const Format& format) {
  return format.holds != nullptr && info.schema.source_format != format.name;
}

const std::vector<Format>& formats() {
  static const Holds exodus = {.sets = Holds::Sets::sets,
                               .every_step = true,
                               .vectors = false,
                               .integers = false,
                               .partial_arrays = true,
                               .block_numbers = true,
                               .positive_numbers = true,
                               .unique_numbers = true,
                               .title_bytes = 80,
                               .block = exodus_holds_block,
                               .name = exodus_holds_name};
  static const Holds vtk = {.sets = Holds::Sets::arrays,
                            .title_bytes = 255,
                            .block = vtk_holds_block,
                            .kin = "vtu",
                            .losses_of_kin = vtk::losses_in_vtk};
  static const Holds vtu = {.sets = Holds::Sets::arrays,
                            .block = vtk_holds_block,
                            .kin = "vtk",
                            .losses_of_kin = vtu::losses_in_vtu};
  static const Holds gmsh = {.sets = Holds::Sets::cells,
                             .every_step = true,
                             .integers = false,
                             .partial_arrays = true,
                             .block_numbers = true,
                             .positive_numbers = true,
                             .times = false,
                             .name = gmsh_holds_name};
  static const Holds ucd = {.sets = Holds::Sets::arrays,
                            .integers = false,
                            .block_numbers = true,
                            .times = false,
                            .title_bytes = 0};
  static const std::vector<Format> all = {
      {"exodus",
       {".e", ".exo", ".g", ".ex2", ".gen", ".exii"},
       looks_like_exodus,
       open_plain<open_exodus>,
       write_plain<write_exodus>,
       &exodus,
       FileSink::Temporary::named},  // HDF5 looks up what a name in /proc links to
      {"vtk", {".vtk"}, looks_like_vtk, open_plain<open_vtk>, write_plain<write_vtk>, &vtk},
      {"vtu", {".vtu"}, looks_like_vtu, open_plain<open_vtu>, write_vtu_file, &vtu},
      {"gmsh", {".msh"}, looks_like_gmsh, open_plain<open_gmsh>, write_plain<write_gmsh>, &gmsh},
      {"ucd", {".ucd", ".inp"}, looks_like_ucd, open_plain<open_ucd>, write_plain<write_ucd>, &ucd},
      {"shm", {".shm"}, looks_like_shm, open_shm, write_shm, nullptr},
  };
  return all;
}

const Format* format_named(std::string_view name) {
  for (const Format& format : formats())
    if (format.name == name) return &format;
  return nullptr;
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
        if (is_extension(part, extension)) return &format;
    // The counts of a file that is one of several, as in out.e.4.0, come after its extension.
    if (part.empty() || part.find_first_not_of("0123456789") != std::string_view::npos)
      return nullptr;
    name = name.substr(0, dot);
  }
}

const Format* format_of_file(const std::string& path) {
  if (path == "-") return format_named("shm");
  const std::vector<std::byte> head = head_of(path);
  for (const Format& format : formats())
    if (format.looks_like(head)) return &format;
  return format_of_name(path);
}

std::unique_ptr<MeshSource> open_mesh(const std::string& path, Spool& spool,
                                      const Progress& progress) {
  if (const Format* format = format_of_file(path)) return format->open(path, spool, progress);
  throw Failure(Error{ErrorCode::unsupported,
                      "is neither an Exodus, VTK legacy, VTU, Gmsh, UCD nor .shm file",
                      {},
                      kNoOffset,
                      path});
}

const Format& output_format(const std::string& path, const std::string& format) {
  const Format* found = format.empty() ? format_of_name(path) : format_named(format);
  if (found != nullptr) return *found;
  std::string known;
  for (const Format& each : formats())
    known += (known.empty() ? "" : ", ") + std::string(each.name);
  throw Failure(Error{ErrorCode::misuse,
                      format.empty()
                          ? "its name does not tell the format; use --format (" + known + ")"
                          : "unknown format '" + format + "'; known: " + known,
                      {},
                      kNoOffset,
                      path});
}

void write_mesh(MeshSource& mesh, const std::string& path, const Format& format, Spool& spool) {
  if (path == "-" && format.name == "shm") {
    const auto sink = unwrap(FileSink::create(path), path);
    compress_mesh(mesh, *sink, {}, spool);
    return unwrap(sink->commit(), path);
  }
  OutputFile output(path, spool.directory(), format.temporary);
  try {
    format.write(mesh, output, spool);
  } catch (const Failure& failure) {
    Error error = failure.error();
    if (error.file == output.temporary()) error.file = path;
    throw Failure(std::move(error));
  }
  output.commit();
}

}  // namespace shm::converters
