// pieces_bench FILE: measures the bytes that a MeshExtractor reads from a .shm file for pieces of
// the mesh. Prints JSON with the total size in bytes of index and schema and, for each segment,
// four sizes in bytes: the size of the segment, the bytes read for its cells with all static
// arrays, the bytes read for its cells with coordinates only, and the bytes read for its first
// cell.
//
// pieces_bench FILE --way WAY: reads the whole file in one thread, and prints the number of cells
// or faces. WAY is reader (everything, by a Reader), cells (a MeshExtractor without arrays),
// boundary (the boundary surface), values (the boundary surface with the first static array), or
// stream (like values, but by a Reader).
#include <cstdint>
#include <cstdio>
#include <string>
#include <variant>

#include "base/counted_source.h"
#include "bench_mesh.h"
#include "options.h"
#include "shm/boundary_surface.h"
#include "shm/mesh_extract.h"
#include "shm/reader.h"

namespace shm::bench {
namespace {

template <class T>
T unwrapped(Result<T> result) {
  if (!result) throw std::runtime_error(result.error().message());
  return std::move(*result);
}

/// Reads a piece, which must have `cells` cells. Returns the number of bytes read from the file.
std::uint64_t read_piece(converters::CountedSource& source, MeshExtractor& file,
                         const ExtractRequest& request, std::uint64_t cells) {
  const std::uint64_t before = source.bytes;
  if (const auto begun = file.begin(request); !begun)
    throw std::runtime_error(begun.error().message());
  std::uint64_t came = 0;
  while (const MeshBlock* part = unwrapped(file.next())) came += part->cell_count();
  if (came != cells) throw std::runtime_error("cells are missing");
  return source.bytes - before;
}

/// Selects the first array without steps.
BoundaryOptions with_values(const Schema& schema) {
  for (std::uint32_t a = 0; a < schema.arrays.size(); ++a)
    if (!schema.arrays[a].per_step) return {.arrays = {{a, 0}}};
  throw std::runtime_error("the file has no array without steps");
}

/// Reads the whole file by the method `way` (see --way). Returns the number of cells, or the number
/// of faces of the boundary.
std::uint64_t read_whole(const std::string& path, const std::string& way) {
  if (way == "reader" || way == "stream") {
    const auto source = unwrapped(FileSource::open(path));
    if (way == "stream") {
      const auto opened = unwrapped(FileRandomSource::open(path));
      const BoundaryOptions options = with_values(unwrapped(MeshExtractor::open(*opened)).schema());
      return unwrapped(read_boundary(static_cast<ByteSource&>(*source), options)).face_count();
    }
    Reader reader = unwrapped(Reader::open(*source));
    std::uint64_t cells = 0;
    while (const Item* item = unwrapped(reader.next()))
      if (const auto* block = std::get_if<MeshBlock>(item)) cells += block->cell_count();
    return cells;
  }
  const auto source = unwrapped(FileRandomSource::open(path));
  if (way == "boundary") return unwrapped(read_boundary(*source)).face_count();
  MeshExtractor file = unwrapped(MeshExtractor::open(*source));
  if (way == "values")
    return unwrapped(read_boundary(*source, with_values(file.schema()))).face_count();
  if (way != "cells") throw std::runtime_error("there is no way " + way);
  ExtractRequest request;
  request.arrays.emplace();
  if (const auto begun = file.begin(request); !begun)
    throw std::runtime_error(begun.error().message());
  std::uint64_t cells = 0;
  while (const MeshBlock* part = unwrapped(file.next())) cells += part->cell_count();
  return cells;
}

int run(int argc, char** argv) {
  std::string way;
  const std::string path = parse_options(argc, argv, {{"--way", way}});
  if (!way.empty()) {
    std::printf("%llu\n", static_cast<unsigned long long>(read_whole(path, way)));
    return 0;
  }
  const auto opened = unwrapped(FileRandomSource::open(path));
  converters::CountedSource source(*opened);
  MeshExtractor file = unwrapped(MeshExtractor::open(source));
  std::printf("{\"file\": %llu, \"index\": %llu, \"cells\": %llu, \"segments\": [",
              static_cast<unsigned long long>(source.size()),
              static_cast<unsigned long long>(source.bytes),
              static_cast<unsigned long long>(file.cells()));
  const char* between = "";
  for (const SegmentInfo& segment : file.segments()) {
    const auto cells = [&](std::uint64_t count) {
      ExtractRequest request;
      request.cells.range = {segment.first_cell, segment.first_cell + count};
      return request;
    };
    ExtractRequest bare = cells(segment.cells);
    bare.arrays.emplace();
    std::printf("%s\n  {\"bytes\": %llu, \"all\": %llu, \"bare\": %llu, \"first_cell\": %llu}",
                between, static_cast<unsigned long long>(segment.bytes),
                static_cast<unsigned long long>(
                    read_piece(source, file, cells(segment.cells), segment.cells)),
                static_cast<unsigned long long>(read_piece(source, file, bare, segment.cells)),
                static_cast<unsigned long long>(read_piece(source, file, cells(1), 1)));
    between = ",";
  }
  std::printf("\n]}\n");
  return 0;
}

}  // namespace
}  // namespace shm::bench

int main(int argc, char** argv) {
  return shm::bench::run_reporting("pieces_bench", shm::bench::run, argc, argv);
}
