#include "files/mesh_files.h"

#include <utility>

#include "base/failure.h"
#include "compression/compress.h"
#include "compression/decompress.h"
#include "formats/formats.h"

namespace shm::converters {

std::unique_ptr<MeshSource> open_mesh(const std::string& path, Spool& spool,
                                      const Progress& progress) {
  const Format& format = input_format(path);
  auto mesh = format.open == nullptr ? open_shm(path, spool, progress) : format.open(path, spool);
  require_within(spool.limits(), mesh->info(), path);
  return mesh;
}

void write_mesh(MeshSource& mesh, OutputFile& output, const Format& format, Spool& spool) {
  if (format.write == nullptr)
    compress_mesh(mesh, output.sink(), {}, spool);
  else
    format.write(mesh, output.temporary(), spool);
}

void write_mesh(MeshSource& mesh, const std::string& path, const Format& format, Spool& spool) {
  if (path == "-" && format.name == "shm") {
    const auto sink = unwrap(FileSink::create(path), path);
    compress_mesh(mesh, *sink, {}, spool);
    return;
  }
  OutputFile output(path, spool.directory(), format.temporary);
  try {
    write_mesh(mesh, output, format, spool);
  } catch (const Failure& failure) {
    Error error = failure.error();
    if (error.file == output.temporary()) error.file = path;
    throw Failure(std::move(error));
  }
  output.commit();
}

}  // namespace shm::converters
