// series_bench [--steps N] [--key-steps N] [--travel N] [--every N] [--fast] [--speed] MESH:
// measures the size of a time series of five float32 fields in one file, and in one file per step
// (only every N-th of these files is written, and its size is counted N times). Also measures
// reading one array at one step. Writes JSON to standard output. The file of the series is written
// next to MESH, and removed at the end. --speed: instead of the above, measures packing and
// unpacking only the steps, in memory and in one thread. Compares this with zstd -3 for the values
// of each array at each step, both unchanged and as byte planes.
#include <array>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <cstring>
#include <filesystem>
#include <functional>
#include <numbers>
#include <random>
#include <string>
#include <utility>
#include <vector>

#include "array_mesh.h"
#include "base/counted_source.h"
#include "bench_mesh.h"
#include "measure.h"
#include "options.h"
#include "raw_packers.h"
#include "shm/step_reader.h"

namespace shm::bench {
namespace {

using Point = std::array<double, 3>;

/// Calls `run` and returns its wall-clock time in seconds, which, unlike CPU time, includes waiting
/// for the disk.
double seconds_of_clock(const std::function<void()>& run) {
  const auto start = std::chrono::steady_clock::now();
  run();
  return std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
}

// --- fields

/// A field that is a sum of moving waves. The unit of length is about the width of the mesh.
struct Waves {
  struct Wave {
    Point k{};
    double speed = 0, phase = 0, height = 0;
  };
  std::vector<Wave> waves;

  double at(const Point& p, double time) const {
    double sum = 0;
    for (const Wave& wave : waves)
      sum += wave.height * std::sin(wave.k[0] * p[0] + wave.k[1] * p[1] + wave.k[2] * p[2] +
                                    wave.phase - wave.speed * time);
    return sum;
  }
};

/// Returns `count` waves with wave numbers from `low` to `high`, in waves per unit of length. As in
/// turbulence, their energy is proportional to the wave number to the power -5/3. Each wave moves
/// with the flow, and also changes at an individual rate.
Waves turbulence(std::size_t count, double low, double high, unsigned seed) {
  std::mt19937_64 random(seed);
  const auto uniform = [&] { return static_cast<double>(random() >> 11) * 0x1p-53; };
  Waves waves;
  for (std::size_t i = 0; i < count; ++i) {
    const double n =
        low * std::pow(high / low, static_cast<double>(i) /
                                       static_cast<double>(std::max<std::size_t>(1, count - 1)));
    const double z = 2 * uniform() - 1, angle = 2 * std::numbers::pi * uniform();
    const double r = std::sqrt(1 - z * z), k = 2 * std::numbers::pi * n;
    Waves::Wave wave;
    wave.k = {k * r * std::cos(angle), k * r * std::sin(angle), k * z};
    wave.phase = 2 * std::numbers::pi * uniform();
    wave.height = std::pow(n / low, -5. / 6);
    const double turning = (2 * uniform() - 1) * std::pow(n, 2. / 3);
    wave.speed =
        wave.k[0] + turning;  // the flow moves along x, by one unit of length per unit of time
    waves.waves.push_back(wave);
  }
  return waves;
}

/// The measured fields: two smooth point fields, and three cell fields (a smooth field that moves,
/// a field with a front, and turbulence).
class Fields {
 public:
  explicit Fields(const ArrayMesh& mesh) : points_(mesh.vertices) {
    for (std::size_t v = 0; v < mesh.vertices; ++v)
      for (std::size_t c = 0; c < 3; ++c) points_[v][c] = coordinate(mesh, 3 * v + c);
    normalize();
    for (std::size_t c = 0; c < mesh.cells(); ++c) {
      Point& centre = centres_.emplace_back();
      for (const std::uint64_t v : mesh.cell(c))
        for (std::size_t d = 0; d < 3; ++d)
          centre[d] += points_[v][d] / static_cast<double>(mesh.cell(c).size());
    }
  }

  static std::vector<ArrayInfo> infos(bool per_step) {
    std::vector<ArrayInfo> infos;
    for (const auto& [name, location] : {std::pair{"temperature", Location::point},
                                         {"pressure", Location::point},
                                         {"density", Location::cell},
                                         {"mixture", Location::cell},
                                         {"velocity", Location::cell}}) {
      ArrayInfo& info = infos.emplace_back();
      info.name = name;
      info.location = location;
      info.type = ScalarType::float32;
      info.per_step = per_step;
    }
    return infos;
  }
  /// Returns the values of a field at a time, in the order of the mesh.
  std::vector<std::byte> values(std::size_t array, double time) const {
    const auto& places = array < 2 ? points_ : centres_;
    std::vector<std::byte> out(places.size() * 4);
    for (std::size_t i = 0; i < places.size(); ++i) {
      const auto value = static_cast<float>(value_at(array, places[i], time));
      std::memcpy(out.data() + 4 * i, &value, 4);
    }
    return out;
  }

 private:
  static double coordinate(const ArrayMesh& mesh, std::size_t i) {
    if (mesh.coordinate_type == ScalarType::float64) {
      double value = 0;
      std::memcpy(&value, mesh.xyz.data() + 8 * i, 8);
      return value;
    }
    float value = 0;
    std::memcpy(&value, mesh.xyz.data() + 4 * i, 4);
    return value;
  }
  void normalize() {
    Point low = points_.at(0), high = low;
    for (const Point& p : points_)
      for (std::size_t c = 0; c < 3; ++c) {
        low[c] = std::min(low[c], p[c]);
        high[c] = std::max(high[c], p[c]);
      }
    const double side = std::max({high[0] - low[0], high[1] - low[1], high[2] - low[2], 1e-300});
    for (Point& p : points_)
      for (std::size_t c = 0; c < 3; ++c) p[c] = (p[c] - low[c]) / side;
  }
  double value_at(std::size_t array, const Point& p, double time) const {
    switch (array) {
      case 0: return 300 + 20 * smooth_.at(p, time);
      case 1: return 101325 + 400 * pressure_.at(p, time);
      case 2: return 1.2 + .1 * smooth_.at(p, time) + .02 * pressure_.at(p, time);
      case 3: return .5 + .5 * std::tanh(4 * smooth_.at(p, time));
      default: return 10 + 2 * turbulence_.at(p, time);
    }
  }

  std::vector<Point> points_, centres_;
  Waves smooth_ = turbulence(4, .8, 3, 1), pressure_ = turbulence(6, 1, 6, 2),
        turbulence_ = turbulence(20, 1, 24, 3);
};

// --- files

std::uint64_t bytes_of_single(const ArrayMesh& mesh, const Fields& fields, double time,
                              Level level) {
  std::vector<MeshArray> arrays;
  std::vector<const MeshArray*> all;
  for (std::size_t a = 0; const ArrayInfo& info : Fields::infos(false))
    arrays.push_back({info, {fields.values(a++, time)}});
  for (const MeshArray& array : arrays) all.push_back(&array);
  NullSink sink;
  return write(mesh, all, sink, level).total_bytes;
}

/// Measures reading one array at one step with a new StepReader, and then reading the next step
/// with the same StepReader.
void tell_reading(const char* what, RandomSource& file, const StepRequest& request) {
  converters::CountedSource source(file);
  std::uint64_t opening = 0, bytes = 0;
  std::size_t values = 0;
  double best = 1e300, best_next = 1e300;
  for (int i = 0; i < 2; ++i) {
    source.bytes = 0;
    std::optional<StepReader> reader;
    const double opened = seconds_of_clock([&] { reader = unwrap(StepReader::open(source)); });
    opening = source.bytes;
    const double read = seconds_of_clock([&] {
      values = 0;
      for (const StepValues& group : unwrap(reader->read(request))) values += group.values.size();
    });
    bytes = source.bytes;
    StepRequest following = request;
    ++following.step;
    following.numbers = false;
    const double next = seconds_of_clock([&] { unwrap(reader->read(following)); });
    best = std::min(best, opened + read);
    best_next = std::min(best_next, next);
  }
  std::printf(
      ",\n  \"%s\": {\"step\": %llu, \"numbers\": %s, \"index_bytes\": %llu, \"bytes\": %llu, "
      "\"share\": %.6f, \"of_values\": %zu, \"s\": %.3f, \"next_step_s\": %.3f}",
      what, static_cast<unsigned long long>(request.step), request.numbers ? "true" : "false",
      static_cast<unsigned long long>(opening), static_cast<unsigned long long>(bytes),
      static_cast<double>(bytes) / static_cast<double>(file.size()), values, best, best_next);
  std::fflush(stdout);
}

/// Measures packing and unpacking the raw values of each array at each step with zstd.
template <class Pack, class Unpack>
void tell_zstd(const char* name, std::span<const MeshArray> arrays, Pack&& pack, Unpack&& unpack) {
  std::size_t bytes = 0;
  double in = 0, out = 0;
  const auto take = [&](const std::vector<std::byte>& raw) {
    std::vector<std::byte> packed(ZSTD_compressBound(raw.size())), back(raw.size());
    std::size_t size = 0;
    in += seconds_of([&] { size = pack(raw, packed); });
    out += seconds_of([&] { unpack(Bytes(packed).first(size), back); });
    if (back != raw) throw std::runtime_error("zstd: the decoded values differ");
    bytes += size;
  };
  for (const MeshArray& array : arrays)
    for (const std::vector<std::byte>& raw : array.steps) take(raw);
  std::printf(",\n  \"%s\": {\"bytes\": %zu, \"in_s\": %.3f, \"out_s\": %.3f}", name, bytes, in,
              out);
}

/// Measures the cost of the steps: the cost of the whole series minus the cost of the mesh without
/// arrays.
void tell_speed(const ArrayMesh& mesh, const Fields& fields, std::uint64_t steps,
                const std::function<double(std::uint64_t)>& time_of, Level level) {
  std::vector<MeshArray> arrays;
  std::vector<const MeshArray*> all;
  std::size_t raw = 0;
  for (std::size_t a = 0; const ArrayInfo& info : Fields::infos(true)) {
    arrays.push_back({info, {}});
    for (std::uint64_t step = 0; step < steps; ++step)
      raw += arrays.back().steps.emplace_back(fields.values(a, time_of(step))).size();
    ++a;
  }
  for (const MeshArray& array : arrays) all.push_back(&array);
  struct Took {
    std::size_t bytes = 0;
    double in = 0, out = 0;
  };
  const auto with = [&](std::span<const MeshArray* const> of) {
    Took took;
    MemorySink sink;
    took.in = quickest(0, [&] {
      sink = {};
      write(mesh, of, sink, level);
    });
    ReadBack back(mesh, of);
    took.out = quickest(0, [&] { read(sink.bytes, back); });
    took.bytes = sink.bytes.size();
    for (std::size_t a = 0; a < of.size(); ++a)
      if (back.arrays[a] != of[a]->steps) throw std::runtime_error("the decoded values differ");
    return took;
  };
  const Took alone = with({}), series = with(all);
  std::printf(
      ",\n  \"raw_bytes\": %zu,\n  \"shm\": {\"bytes\": %zu, \"in_s\": %.3f, \"out_s\": %.3f}", raw,
      series.bytes - alone.bytes, series.in - alone.in, series.out - alone.out);
  tell_zstd(
      "zstd -3", arrays, [](Bytes from, Room to) { return zstd_pack(from, to, 3); }, zstd_unpack);
  std::vector<std::byte> planes;
  tell_zstd(
      "planes, zstd -3", arrays,
      [&](Bytes from, Room to) {
        planes.resize(from.size());
        to_planes(from, 4, planes.data());
        return zstd_pack(planes, to, 3);
      },
      [&](Bytes from, Room to) {
        planes.resize(to.size());
        const std::size_t size = zstd_unpack(from, planes);
        from_planes(planes, 4, to.data());
        return size;
      });
  std::printf("}\n");
}

int run(int argc, char** argv) {
  std::uint64_t steps = 100, every = 1, travel = 20;
  std::uint32_t key_steps = 8;
  bool fast = false, speed = false;
  const std::string path = parse_options(argc, argv,
                                         {{"--steps", steps},
                                          {"--key-steps", key_steps},
                                          {"--every", every},
                                          {"--travel", travel},
                                          {"--fast", fast},
                                          {"--speed", speed}});
  if (steps < 2 || key_steps == 0 || every == 0 || every > steps)
    throw std::runtime_error(
        "--steps must be at least 2, --key-steps and --every at least 1, and --every at most "
        "--steps");
  const Level level = fast ? Level::fast : Level::standard;
  const ArrayMesh mesh = load_arrays(path);
  const Fields fields(mesh);
  // `travel`: distance that the fields move in a hundred steps, in percent of the width of the
  // mesh.
  const auto time_of = [&](std::uint64_t step) {
    return static_cast<double>(step * travel) * 1e-4;
  };
  std::printf("{\"vertices\": %llu, \"cells\": %zu, \"steps\": %llu, \"key_steps\": %u",
              static_cast<unsigned long long>(mesh.vertices), mesh.cells(),
              static_cast<unsigned long long>(steps), key_steps);

  if (speed) {
    tell_speed(mesh, fields, steps, time_of, level);
    return 0;
  }
  const std::string series = path + ".series.shm";
  WriteOptions options;
  options.key_steps = key_steps;
  options.level = level;
  SizeReport sizes;
  const double writing = seconds_of_clock([&] {
    const auto sink = unwrap(FileSink::create(series));
    sizes = write_series(
        mesh, Fields::infos(true), steps,
        [&](std::size_t array, std::uint64_t step) { return fields.values(array, time_of(step)); },
        *sink, options);
  });
  std::printf(",\n  \"series_bytes\": %llu, \"series_s\": %.1f, \"streams\": {",
              static_cast<unsigned long long>(sizes.total_bytes), writing);
  const char* comma = "";
  for (const auto& [name, bytes] : sizes.streams)
    std::printf("%s\"%s\": %llu", std::exchange(comma, ", "), name.c_str(),
                static_cast<unsigned long long>(bytes));
  std::printf("}");
  std::fflush(stdout);

  const auto file = unwrap(FileRandomSource::open(series));
  const std::uint64_t key = steps / 2 / key_steps * key_steps;
  for (const std::uint32_t array : {0u, 4u})
    for (const auto& [name, step] :
         {std::pair{"key", key}, {"middle", key + key_steps / 2}, {"last", key + key_steps - 1}}) {
      if (step + 1 >= steps) continue;
      tell_reading((Fields::infos(true)[array].name + " " + name).c_str(), *file,
                   {array, step, {}, false});
    }
  tell_reading("temperature numbered", *file, {0, key, {}, true});
  std::filesystem::remove(series);

  std::uint64_t singles = 0, bytes = 0;
  const double took = seconds_of_clock([&] {
    for (std::uint64_t step = 0; step < steps; step += every, ++singles)
      bytes += bytes_of_single(mesh, fields, time_of(step), level);
  });
  const double all =
      static_cast<double>(bytes) * static_cast<double>(steps) / static_cast<double>(singles);
  std::printf(
      ",\n  \"singles\": %llu, \"singles_bytes\": %.0f, \"singles_s\": %.1f, "
      "\"ratio\": %.4f",
      static_cast<unsigned long long>(singles), all, took,
      static_cast<double>(sizes.total_bytes) / all);
  std::printf("}\n");
  return 0;
}

}  // namespace
}  // namespace shm::bench

int main(int argc, char** argv) {
  return shm::bench::run_reporting("series_bench", shm::bench::run, argc, argv);
}
