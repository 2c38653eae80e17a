// speed_bench [--level fast|default|best]... [--turns N] [--seconds S] MESH: compresses and
// decompresses the hexahedra of a mesh of any format, in memory, in one thread and with order keep.
// The methods are our library at each level, without digests and (except at level best) with them,
// and other compressors, which pack two raw arrays: int32 corners, one hexahedron after the other,
// and coordinates as they are stored. Writes lines of JSON to standard output: a line for the mesh,
// then a line for each method with its bytes and the shortest CPU time of its runs in seconds.
//   zstd -3        packs each of the two arrays unchanged
//   column delta   replaces each number with its difference from the previous number of its column
//                  (there are eight columns of corners, and three of coordinates), then packs the
//                  zigzag-coded differences as byte planes with zstd -3. Before subtraction, the
//                  bits of coordinates are interpreted as integers. If differences do not make the
//                  packed coordinates smaller, they are not used for coordinates. This choice is
//                  made before time is measured
//   blosc          packs blocks of byte planes of each array with zstd; only if libblosc was found
// All methods take turns on the mesh, so that other load on the machine affects all of them. There
// are N turns (default 8). A method that has used S seconds (default 1) gets no more turns, but
// each method gets at least one turn. Runs of less than a millisecond are repeated within a turn.
// After the first turn, the decoded data is compared with the original. Our methods write a Mesh to
// a MemorySink, and read it into a new Mesh, whose memory the process has already obtained from the
// system. The other methods fill existing memory.
#include <algorithm>
#include <array>
#include <cstdio>
#include <cstring>
#include <functional>
#include <limits>
#include <memory>
#include <nlohmann/json.hpp>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#if defined(__GLIBC__)
#include <malloc.h>
#endif

#include "bench_mesh.h"
#include "levels.h"
#include "measure.h"
#include "options.h"
#include "raw_packers.h"
#include "shm/mesh.h"

namespace shm::bench {
namespace {

using nlohmann::json;

// In each turn, packing is repeated for at least this number of seconds, and so is unpacking.
constexpr double kTurn = 1e-3;

/// A method that packs a mesh.
class Method {
 public:
  explicit Method(std::string name) : name_(std::move(name)) {}
  virtual ~Method() = default;
  Method(const Method&) = delete;
  Method& operator=(const Method&) = delete;

  /// Does nothing if this method has already used `seconds` in earlier turns. Otherwise packs and
  /// unpacks the mesh at least once.
  void take_turn(double seconds) {
    const bool first = spent_ == 0;
    if (!first && spent_ >= seconds) return;
    encode_s_ = std::min(encode_s_, least([this] { pack(); }));
    decode_s_ = std::min(decode_s_, least([this] { unpack(); }));
    if (first && !came_back()) throw std::runtime_error(name_ + ": the decoded mesh differs");
  }
  virtual json told() const {
    return {{"name", name_}, {"encode_s", encode_s_}, {"decode_s", decode_s_}};
  }

 protected:
  virtual void pack() = 0;
  virtual void unpack() = 0;
  virtual void forget() = 0;  ///< frees the result of the previous run
  virtual bool came_back() const = 0;

 private:
  double least(const std::function<void()>& run) {
    double best = 1e300, spent = 0;
    do {
      forget();
      const double took = seconds_of(run);
      best = std::min(best, took);
      spent += took;
    } while (spent < kTurn);
    spent_ += spent;
    return best;
  }

  std::string name_;
  double encode_s_ = 1e300, decode_s_ = 1e300, spent_ = 0;
};

// --- our library

class Ours final : public Method {
 public:
  Ours(const Mesh& mesh, const char* name, Level level, bool digest)
      : Method(std::string("shm ") + name + (digest ? " with digests" : "")), mesh_(&mesh) {
    options_.level = level;
    options_.threads = 1;
    options_.digest = digest;
    sink_.bytes.reserve(mesh.xyz.size() + sizeof(std::int32_t) * mesh.corners.size());
  }
  json told() const override {
    json line = Method::told();
    line["bytes"] = bytes_;
    return line;
  }

 private:
  void pack() override {
    sink_.bytes.clear();
    bytes_ = unwrap(write_mesh(sink_, *mesh_, options_)).total_bytes;
  }
  void unpack() override {
    MemorySource source(sink_.bytes);
    ReadOptions options;
    options.threads = 1;
    back_ = unwrap(read_mesh(source, {}, options));
  }
  void forget() override { back_ = {}; }
  bool came_back() const override {
    return back_.corners == mesh_->corners && back_.xyz == mesh_->xyz;
  }

  const Mesh* mesh_;
  WriteOptions options_;
  MemorySink sink_;
  Mesh back_;
  std::uint64_t bytes_ = 0;
};

// --- other compressors

/// A raw array of rows with `columns` numbers each. A number has `width` bytes (4 or 8).
struct RawArray {
  std::vector<std::byte> bytes;
  std::size_t width = 4, columns = 1;
};

struct Packer {
  std::string name;
  std::function<std::size_t(std::size_t)>
      room;  ///< returns the maximum packed size of the given number of bytes
  std::function<std::size_t(const RawArray&, Room)> pack;
  /// uses only the members `width` and `columns` of the RawArray, which describe the original array
  std::function<void(const RawArray&, Bytes, Room)> unpack;
};

class Others final : public Method {
 public:
  Others(const std::array<RawArray, 2>& mesh, Packer packer)
      : Method(packer.name), mesh_(&mesh), packer_(std::move(packer)) {
    for (std::size_t i = 0; i < mesh.size(); ++i) {
      packed_[i].resize(packer_.room(mesh[i].bytes.size()));
      back_[i].resize(mesh[i].bytes.size());
    }
  }
  json told() const override {
    json line = Method::told();
    line["bytes"] = sizes_[0] + sizes_[1];
    line["connectivity_bytes"] = sizes_[0];
    return line;
  }

 private:
  void pack() override {
    for (std::size_t i = 0; i < mesh_->size(); ++i)
      sizes_[i] = packer_.pack((*mesh_)[i], packed_[i]);
  }
  void unpack() override {
    for (std::size_t i = 0; i < mesh_->size(); ++i)
      packer_.unpack((*mesh_)[i], Bytes(packed_[i]).first(sizes_[i]), back_[i]);
  }
  void forget() override {}
  bool came_back() const override {
    return back_[0] == (*mesh_)[0].bytes && back_[1] == (*mesh_)[1].bytes;
  }

  const std::array<RawArray, 2>* mesh_;
  Packer packer_;
  std::array<std::vector<std::byte>, 2> packed_, back_;
  std::array<std::size_t, 2> sizes_{};
};

/// Converts an array to byte planes, column by column. If `differences` is true, each number is
/// replaced with its difference from the previous number of its column.
template <class T>
void to_column_planes(const RawArray& array, bool differences, std::byte* out) {
  const std::size_t count = array.bytes.size() / sizeof(T);
  std::size_t at = 0;
  for (std::size_t column = 0; column < array.columns; ++column) {
    T last = 0;
    for (std::size_t i = column; i < count; i += array.columns, ++at) {
      T value;
      std::memcpy(&value, array.bytes.data() + i * sizeof value, sizeof value);
      const auto difference = static_cast<std::make_signed_t<T>>(static_cast<T>(value - last));
      const T told = differences ? static_cast<T>(static_cast<T>(difference) << 1 ^
                                                  static_cast<T>(difference >> (8 * sizeof(T) - 1)))
                                 : value;
      for (std::size_t b = 0; b < sizeof(T); ++b)
        out[b * count + at] = static_cast<std::byte>(told >> 8 * b);
      last = value;
    }
  }
}
template <class T>
void from_column_planes(const RawArray& like, bool differences, const std::byte* in, Room out) {
  const std::size_t count = out.size() / sizeof(T);
  std::size_t at = 0;
  for (std::size_t column = 0; column < like.columns; ++column) {
    T last = 0;
    for (std::size_t i = column; i < count; i += like.columns, ++at) {
      T told = 0;
      for (std::size_t b = 0; b < sizeof(T); ++b)
        told |= static_cast<T>(static_cast<T>(in[b * count + at]) << 8 * b);
      last =
          differences ? static_cast<T>(last + static_cast<T>(told >> 1 ^ (0 - (told & 1)))) : told;
      std::memcpy(out.data() + i * sizeof last, &last, sizeof last);
    }
  }
}

/// Returns the method "column delta". `scratch` is memory for the largest array. If `differ` is
/// true, coordinates are coded as differences, otherwise unchanged.
Packer column_packer(std::shared_ptr<std::vector<std::byte>> scratch, bool differ) {
  // Corners are always coded as differences.
  const auto differences = [=](const RawArray& array) { return differ || array.columns == 8; };
  return {"column delta", ZSTD_compressBound,
          [=](const RawArray& array, Room out) {
            const auto to = array.width == 8 ? to_column_planes<std::uint64_t>
                                             : to_column_planes<std::uint32_t>;
            to(array, differences(array), scratch->data());
            return zstd_pack(Bytes(*scratch).first(array.bytes.size()), out, 3);
          },
          [=](const RawArray& like, Bytes in, Room out) {
            zstd_unpack(in, Room(*scratch).first(out.size()));
            const auto from = like.width == 8 ? from_column_planes<std::uint64_t>
                                              : from_column_planes<std::uint32_t>;
            from(like, differences(like), scratch->data(), out);
          }};
}
/// Returns the method "column delta". Coordinates are coded as differences only if this makes the
/// packed coordinates of `mesh` smaller.
Packer column_packer(const std::array<RawArray, 2>& mesh) {
  const auto scratch = std::make_shared<std::vector<std::byte>>(
      std::max(mesh[0].bytes.size(), mesh[1].bytes.size()));
  std::vector<std::byte> packed(ZSTD_compressBound(mesh[1].bytes.size()));
  const auto size = [&](bool differ) {
    return column_packer(scratch, differ).pack(mesh[1], packed);
  };
  return column_packer(scratch, size(true) < size(false));
}

std::vector<Packer> packers(const std::array<RawArray, 2>& mesh) {
  std::vector<Packer> all;
  all.push_back({"zstd -3", ZSTD_compressBound,
                 [](const RawArray& array, Room out) { return zstd_pack(array.bytes, out, 3); },
                 [](const RawArray&, Bytes in, Room out) { zstd_unpack(in, out); }});
  all.push_back(column_packer(mesh));
#ifdef SHM_HAS_BLOSC
  all.push_back(
      {"blosc", [](std::size_t bytes) { return bytes + BLOSC_MAX_OVERHEAD; },
       [](const RawArray& array, Room out) { return blosc_pack(array.bytes, array.width, out); },
       [](const RawArray&, Bytes in, Room out) { blosc_unpack(in, out); }});
#endif
  return all;
}

// --- conversion of the mesh to the input of our library and of the other compressors

Mesh whole_mesh(const BenchMesh& from) {
  Mesh mesh;
  mesh.schema = hexahedra_schema();
  mesh.schema.coordinate_type = from.coordinate_type;
  mesh.xyz = from.xyz;
  mesh.cell_blocks.assign(from.hexahedra(), 0);
  mesh.corner_begin.resize(from.hexahedra() + 1);
  for (std::size_t c = 0; c < mesh.corner_begin.size(); ++c) mesh.corner_begin[c] = 8 * c;
  mesh.corners.assign(from.corners.begin(), from.corners.end());
  return mesh;
}

std::array<RawArray, 2> raw_arrays(const BenchMesh& mesh) {
  const Bytes corners = std::as_bytes(std::span(mesh.corners));
  return {{{{corners.begin(), corners.end()}, sizeof(std::int32_t), 8},
           {mesh.xyz, scalar_bytes(mesh.coordinate_type), 3}}};
}

int run(int argc, char** argv) {
  std::vector<std::string> level_names;
  std::size_t turns = 8;
  double seconds = 1;
  const std::string path = parse_options(
      argc, argv, {{"--level", level_names}, {"--turns", turns}, {"--seconds", seconds}});
  const BenchMesh loaded = load_hexahedra(path, true);
  if (loaded.hexahedra() == 0) throw std::runtime_error(path + ": no hexahedra");
  const Mesh mesh = whole_mesh(loaded);
  const std::array<RawArray, 2> raw = raw_arrays(loaded);
  std::vector<std::unique_ptr<Method>> methods;
  for (const bool digest : {false, true})
    for (const std::size_t level : levels_named(level_names))
      if (!digest || kLevels[level].second != Level::best)
        methods.push_back(
            std::make_unique<Ours>(mesh, kLevels[level].first, kLevels[level].second, digest));
  for (Packer& packer : packers(raw)) methods.push_back(std::make_unique<Others>(raw, packer));

  for (std::size_t turn = 0; turn < std::max<std::size_t>(turns, 1); ++turn)
    for (const auto& method : methods) method->take_turn(seconds);

  std::printf("%s\n", json{{"hexahedra", loaded.hexahedra()},
                           {"vertices", loaded.vertices},
                           {"raw_bytes", raw[0].bytes.size() + raw[1].bytes.size()}}
                          .dump()
                          .c_str());
  for (const auto& method : methods) std::printf("%s\n", method->told().dump().c_str());
  return 0;
}

}  // namespace
}  // namespace shm::bench

int main(int argc, char** argv) {
#if defined(__GLIBC__)
  // Keeps freed memory (here the buffers of zstd) in the process instead of returning it to the
  // system, as in a program that handles many meshes. If the process had to request new pages from
  // the system, reading would take a third longer.
  mallopt(M_MMAP_MAX, 0);
  mallopt(M_TRIM_THRESHOLD, std::numeric_limits<int>::max());
#endif
  return shm::bench::run_reporting("speed_bench", shm::bench::run, argc, argv);
}
