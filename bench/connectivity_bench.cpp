// connectivity_bench [--corners FILE] [--seconds S] [--codecs-only] MESH: encodes and decodes the
// connectivity of a mesh with each codec and each level, and measures CPU time. Writes JSON to
// standard output. Only the corners of the hexahedra of MESH are used, one block after the other.
// Checks that all vertex numbers and the order of cells are restored. "codec" results measure only
// the coders of connectivity and vertex numbers. "level" results measure the whole Writer and
// Reader with all coordinates zero; this is the cost that a user of the library sees. --codecs-only
// omits the "level" results. --corners: also writes the corners to FILE as raw int32, for other
// compressors.
#include <cstdio>
#include <map>
#include <string>
#include <utility>

#include "bench_mesh.h"
#include "measure.h"
#include "options.h"
#include "shm/reader.h"

namespace shm::bench {
namespace {

struct Coding {
  std::string name;
  std::uint64_t bytes = 0;
  double encode = 0, decode = 0;  // processor seconds
};

Coding with_codec(const BenchMesh& mesh, const std::string& name, ConnectivityCodec codec,
                  double seconds) {
  Coding coding{name};
  Streams streams;
  coding.encode = quickest(
      seconds, [&] { streams = encode(mesh.corners, mesh.last_use, mesh.vertices, codec); });
  std::vector<std::uint32_t> back;
  coding.decode = quickest(seconds, [&] { back = decode(streams, mesh.hexahedra(), codec); });
  if (back != mesh.corners) throw std::runtime_error(name + ": the decoded corners differ");
  coding.bytes = streams.bytes();
  return coding;
}

std::vector<std::uint32_t> corners_of(std::span<const std::byte> file) {
  MemorySource source(file);
  Reader reader = unwrap(Reader::open(source));
  std::vector<std::uint32_t> corners;
  while (Item* item = unwrap(reader.next()))
    if (auto* block = std::get_if<MeshBlock>(item))
      for (std::uint64_t v : block->corners) corners.push_back(static_cast<std::uint32_t>(v));
  return corners;
}

Coding with_level(const BenchMesh& mesh, const std::string& name, Level level, double seconds) {
  Coding coding{name};
  WriteOptions options;
  options.level = level;
  MemorySink file;
  SizeReport sizes;
  coding.encode = quickest(seconds, [&] {
    file = {};
    sizes = write(mesh, file, options);
  });
  std::vector<std::uint32_t> back;
  coding.decode = quickest(seconds, [&] { back = corners_of(file.bytes); });
  if (back != mesh.corners) throw std::runtime_error(name + ": the decoded corners differ");
  for (const char* stream :
       {"connectivity", "corner order", "vertex numbers", "cell numbers", "imports"})
    coding.bytes += sizes.streams[stream];
  return coding;
}

void write_raw(const std::string& path, const BenchMesh& mesh) {
  std::FILE* file = std::fopen(path.c_str(), "wb");
  const std::size_t count = mesh.corners.size();
  const bool good = file != nullptr &&
                    std::fwrite(mesh.corners.data(), sizeof mesh.corners[0], count, file) == count;
  if (file == nullptr || std::fclose(file) != 0 || !good)
    throw std::runtime_error(path + ": cannot be written");
}

int run(int argc, char** argv) {
  std::string corners;
  double seconds = .3;
  bool codecs_only = false;
  const std::string path = parse_options(
      argc, argv, {{"--corners", corners}, {"--seconds", seconds}, {"--codecs-only", codecs_only}});
  const BenchMesh mesh = load_hexahedra(path, false);
  if (!corners.empty()) write_raw(corners, mesh);
  std::vector<Coding> codings;
  if (mesh.hexahedra() > 0) {
    for (const auto& [name, codec] : kConnectivityCodecs)
      codings.push_back(with_codec(mesh, name, codec, seconds));
    if (!codecs_only)
      for (const auto& [name, level] : {std::pair{"level fast", Level::fast},
                                        {"level default", Level::standard},
                                        {"level best", Level::best}})
        codings.push_back(with_level(mesh, name, level, seconds));
  }
  std::printf("{\"vertices\": %llu, \"hexahedra\": %zu, \"codings\": [",
              static_cast<unsigned long long>(mesh.vertices), mesh.hexahedra());
  const char* comma = "";
  for (const Coding& c : codings) {
    std::printf("%s{\"name\": \"%s\", \"bytes\": %llu, \"encode_s\": %.9f, \"decode_s\": %.9f}",
                comma, c.name.c_str(), static_cast<unsigned long long>(c.bytes), c.encode,
                c.decode);
    comma = ", ";
  }
  std::printf("]}\n");
  return 0;
}

}  // namespace
}  // namespace shm::bench

int main(int argc, char** argv) {
  return shm::bench::run_reporting("connectivity_bench", shm::bench::run, argc, argv);
}
