// pieces_bench FILE: what a MeshExtractor reads of a .shm file for pieces of it. JSON on standard
// output: bytes of index and schema, and for each segment its own bytes, those that are read for
// its cells with all static arrays, with coordinates alone, and for its first cell.
#include <cstdint>
#include <cstdio>
#include <string>

#include "base/counted_source.h"
#include "bench_mesh.h"
#include "options.h"
#include "shm/mesh_extract.h"

namespace shm::bench {
namespace {

template <class T>
T unwrapped(Result<T> result) {
  if (!result) throw std::runtime_error(result.error().message());
  return std::move(*result);
}

/// Bytes read; the piece must have `cells` cells.
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

int run(int argc, char** argv) {
  const auto opened = unwrapped(FileRandomSource::open(parse_options(argc, argv, {})));
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
