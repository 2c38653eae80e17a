// threads_bench [--segments N] [--threads T] MESH: measures how much faster the library is with T
// threads than with one thread. Runs the Writer, the Reader and SegmentReaders on the whole mesh,
// in memory. Prints JSON with the wall-clock time of the fastest of three runs. The machine must
// otherwise be idle.
#include <algorithm>
#include <atomic>
#include <chrono>
#include <cstdio>
#include <functional>
#include <string>
#include <thread>

#include "bench_mesh.h"
#include "options.h"
#include "shm/reader.h"
#include "shm/segment_reader.h"

namespace shm::bench {
namespace {

double quickest_of_three(const std::function<void()>& run) {
  double best = 1e300;
  for (int i = 0; i < 3; ++i) {
    const auto start = std::chrono::steady_clock::now();
    run();
    best = std::min(
        best, std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count());
  }
  return best;
}

std::uint64_t cells_read(std::span<const std::byte> file, unsigned threads) {
  MemorySource source(file);
  ReadOptions options;
  options.threads = threads;
  Reader reader = unwrap(Reader::open(source, {}, options));
  std::uint64_t cells = 0;
  while (Item* item = unwrap(reader.next()))
    if (auto* block = std::get_if<MeshBlock>(item)) cells += block->cell_count();
  return cells;
}

/// Decodes all segments and returns their number of cells. Each thread has a SegmentReader, and
/// repeatedly takes the next segment that no thread has taken.
std::uint64_t cells_of_segments(std::span<const std::byte> file, unsigned threads) {
  std::atomic<std::size_t> next = 0;
  std::atomic<std::uint64_t> cells = 0;
  std::atomic<bool> failed = false;
  const auto work = [&] {
    MemoryRandomSource source(file);
    auto reader = SegmentReader::open(source);
    if (!reader) {
      failed = true;
      return;
    }
    for (std::size_t i; (i = next++) < reader->segments().size();) {
      const auto blocks = reader->read(i);
      if (!blocks) {
        failed = true;
        return;
      }
      for (const MeshBlock& block : *blocks) cells += block.cell_count();
    }
  };
  std::vector<std::thread> others;
  for (unsigned t = 1; t < threads; ++t) others.emplace_back(work);
  work();
  for (std::thread& other : others) other.join();
  if (failed) throw std::runtime_error("a segment cannot be read");
  return cells;
}

int run(int argc, char** argv) {
  std::uint64_t segments = 8;
  unsigned threads = 2;
  const std::string path =
      parse_options(argc, argv, {{"--segments", segments}, {"--threads", threads}});
  if (segments == 0 || threads == 0)
    throw std::runtime_error("segments and threads must be positive");
  const BenchMesh mesh = load_hexahedra(path, true);
  const std::uint64_t cells = mesh.hexahedra();
  WriteOptions options;
  options.segment_cells = (cells + segments - 1) / segments;

  MemorySink one, many;
  SizeReport sizes;
  const auto write_with = [&](unsigned count, MemorySink& sink) {
    return quickest_of_three([&] {
      options.threads = count;
      sink = {};
      sizes = write(mesh, sink, options);
    });
  };
  const auto check = [&](std::uint64_t came) {
    if (came != cells) throw std::runtime_error("cells are missing");
  };
  std::printf("{\"vertices\": %llu, \"hexahedra\": %llu, \"threads\": %u",
              static_cast<unsigned long long>(mesh.vertices),
              static_cast<unsigned long long>(cells), threads);
  const double write_one = write_with(1, one), write_many = write_with(threads, many);
  if (one.bytes != many.bytes) throw std::runtime_error("threads change the bytes");
  std::printf(", \"segments\": %llu, \"bytes\": %zu",
              static_cast<unsigned long long>(sizes.segments), one.bytes.size());
  const auto tell = [&](const char* what, double single, double several) {
    std::printf(", \"%s\": {\"one_s\": %.4f, \"threads_s\": %.4f, \"ratio\": %.3f}", what, single,
                several, single / several);
  };
  tell("Writer", write_one, write_many);
  for (const auto& [name, read] :
       {std::pair{"Reader", &cells_read}, {"SegmentReader", &cells_of_segments}}) {
    const double single = quickest_of_three([&] { check(read(one.bytes, 1)); });
    const double several = quickest_of_three([&] { check(read(one.bytes, threads)); });
    tell(name, single, several);
  }
  std::printf("}\n");
  return 0;
}

}  // namespace
}  // namespace shm::bench

int main(int argc, char** argv) {
  return shm::bench::run_reporting("threads_bench", shm::bench::run, argc, argv);
}
