// values_bench [--level fast|default|best]... [--seconds S] [--stepped NAME]... [--like FILE.shm]
// [--sizes | --dump FOLDER] MESH
//
// Measures the bytes and the CPU time that coordinates and arrays need in a .shm file, for a mesh
// of any format. Writes lines of JSON to standard output. The Writer and the Reader run in memory,
// in one thread, and with the order "keep". Times are CPU times. All results are decoded and
// compared with the original values.
//
// For each level, reports the stream size and the additional time, in seconds, of the coordinates
// and of each array. Let T be the time for the mesh without arrays. The additional time of an array
// is the time for the mesh with this array, minus T. The additional time of the coordinates is the
// time for the mesh with a point array that is a copy of the coordinates, minus T. If the size of
// this point array shows that it is coded differently from the coordinates, the additional time is
// instead T minus the time for the mesh with all coordinates zero ("timed": "zeros"). All these
// differences are medians of several pairs of runs. In each pair, the run with less data comes
// directly before the other run. A difference of less than T / 100 is reported as T / 100. The
// reported memory is that of the whole Writer or Reader, including the packed bytes, but not the
// raw arrays.
//   --stepped NAME  treats the arrays NAME.0, NAME.1, ... as time steps of one array NAME
//   --like FILE     quantizes coordinates and arrays like those with the same names in FILE
//   --sizes         writes all arrays in one file, and measures no times
//   --no-arrays     writes only the mesh
//   --dump FOLDER   only writes the raw arrays, for other compressors; prints one line for each
#include <algorithm>
#include <cstdio>
#include <cstring>
#include <filesystem>
#include <iterator>
#include <nlohmann/json.hpp>
#include <optional>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include "array_mesh.h"
#include "bench_mesh.h"
#include "levels.h"
#include "measure.h"
#include "options.h"
#include "shm/reader.h"

namespace shm::bench {
namespace {

using nlohmann::json;
using Arrays = std::vector<const MeshArray*>;

std::string full_name(const ArrayInfo& info) {
  return (info.location == Location::point ? "point/" : "cell/") + info.name;
}

std::uint64_t values_of(const MeshArray& array) {
  std::uint64_t bytes = 0;
  for (const auto& values : array.steps) bytes += values.size();
  return bytes / scalar_bytes(array.info.type);
}

/// Compares decoded values with the original values. Returns the largest error; 0 if all bytes are
/// equal. Throws an exception if the array is lossless but the values differ.
double compared(const std::vector<std::byte>& source, const std::vector<std::byte>& back,
                ScalarType type, const Quantization& quantization, const std::string& name) {
  if (source == back) return 0;
  if (quantization.bits == 0 || source.size() != back.size())
    throw std::runtime_error(name + ": the decoded values differ");
  return type == ScalarType::float64 ? largest_error<double>(source, back)
                                     : largest_error<float>(source, back);
}

struct Seconds {
  double write = 1e300, read = 1e300;
};

/// A file with the mesh and some of its arrays, and the cost of writing and reading this file.
struct Variant {
  const ArrayMesh* mesh;
  Arrays arrays;
  Seconds last{}, quickest{};
  std::uint64_t write_memory = 0, read_memory = 0;
  SizeReport sizes{};
  double coordinates_error = 0;
  std::vector<double> errors{};  // largest error of each array
  // for each run: its time minus that of the preceding run of the first variant, in seconds
  std::vector<double> more_write{}, more_read{};

  /// Writes and reads the file. If `first` is true, measures memory and compares the result;
  /// otherwise measures time.
  void run(Level level, bool first) {
    MemorySink file;
    file.bytes.reserve(mesh->xyz.size() + 8 * mesh->corners.size());
    const auto do_write = [&] { sizes = write(*mesh, arrays, file, level); };
    ReadBack back(*mesh, arrays);
    const auto do_read = [&] { read(file.bytes, back); };
    if (first) {
      write_memory = memory_of(do_write);
      read_memory = memory_of(do_read);
      check(back);
    } else {
      last = {seconds_of(do_write), seconds_of(do_read)};
      quickest = {std::min(quickest.write, last.write), std::min(quickest.read, last.read)};
    }
  }

 private:
  void check(const ReadBack& back) {
    if (back.corners != mesh->corners) throw std::runtime_error("the decoded corners differ");
    coordinates_error = compared(mesh->xyz, back.xyz, mesh->coordinate_type,
                                 mesh->coordinate_quantization, "coordinates");
    errors.assign(arrays.size(), 0);
    for (std::size_t a = 0; a < arrays.size(); ++a)
      for (std::size_t s = 0; s < arrays[a]->steps.size(); ++s)
        errors[a] = std::max(errors[a],
                             compared(arrays[a]->steps[s], back.arrays[a][s], arrays[a]->info.type,
                                      arrays[a]->info.quantization, arrays[a]->info.name));
  }
};

/// Measures all variants for `seconds` per variant, and at least three times. Each variant runs
/// just after the first variant, which has the least data, so that a disturbance affects both.
void run_in_turn(std::vector<Variant>& variants, Level level, double seconds) {
  for (Variant& variant : variants) variant.run(level, true);
  const double start = processor_seconds();
  const double all = seconds * static_cast<double>(variants.size());
  for (int round = 0; round < 3 || processor_seconds() - start < all; ++round)
    for (Variant& variant : std::span(variants).subspan(1)) {
      variants[0].run(level, false);
      variant.run(level, false);
      variant.more_write.push_back(variant.last.write - variants[0].last.write);
      variant.more_read.push_back(variant.last.read - variants[0].last.read);
    }
}

double median(std::vector<double> values) {
  std::sort(values.begin(), values.end());
  const std::size_t n = values.size();
  return (values[(n - 1) / 2] + values[n / 2]) / 2;
}

json row(const char* level, const std::string& name, const Variant& variant, const Variant& alone) {
  return {{"level", level},
          {"array", name},
          {"encode_s", std::max(median(variant.more_write), .01 * alone.quickest.write)},
          {"decode_s", std::max(median(variant.more_read), .01 * alone.quickest.read)},
          {"encode_memory", variant.write_memory},
          {"decode_memory", variant.read_memory}};
}

void print(const json& line) { std::printf("%s\n", line.dump().c_str()); }

std::string stream_of(const MeshArray& array) {
  Schema schema;
  schema.arrays.push_back(array.info);
  return array_stream_name(schema, 0);
}

MeshArray coordinates_as_array(const ArrayMesh& mesh) {
  MeshArray copy;
  copy.info.name = "coordinates once more";
  copy.info.type = mesh.coordinate_type;
  copy.info.components = 3;
  copy.info.quantization = mesh.coordinate_quantization;
  copy.steps.push_back(mesh.xyz);
  return copy;
}

json row_beside_zeros(const ArrayMesh& mesh, const char* name, Level level, double seconds) {
  ArrayMesh flat = mesh;
  flat.xyz.assign(mesh.xyz.size(), {});
  std::vector<Variant> variants = {{&flat, {}}, {&mesh, {}}};
  run_in_turn(variants, level, seconds);
  return row(name, "coordinates", variants[1], variants[0]);
}

void time_level(const ArrayMesh& mesh, const char* name, Level level, double seconds) {
  const MeshArray copy = coordinates_as_array(mesh);
  std::vector<Variant> variants = {{&mesh, {}}, {&mesh, {&copy}}};
  const std::size_t first_array = variants.size();
  for (const MeshArray& array : mesh.arrays) variants.push_back({&mesh, {&array}});
  run_in_turn(variants, level, seconds);

  Variant& alone = variants[0];
  const std::uint64_t bytes = alone.sizes.streams["geometry"];
  const std::uint64_t again = variants[1].sizes.streams[stream_of(copy)];
  const bool alike = std::max(bytes, again) - std::min(bytes, again) <= bytes / 20 + 64;
  json line = alike ? row(name, "coordinates", variants[1], alone)
                    : row_beside_zeros(mesh, name, level, seconds);
  line["encode_memory"] = alone.write_memory;
  line["decode_memory"] = alone.read_memory;
  line["bytes"] = bytes;
  line["max_error"] = alone.coordinates_error;
  line["timed"] = alike ? "copy" : "zeros";
  line["mesh_encode_s"] = alone.quickest.write;
  line["mesh_decode_s"] = alone.quickest.read;
  print(line);
  for (std::size_t a = 0; a < mesh.arrays.size(); ++a) {
    Variant& with = variants[first_array + a];
    const MeshArray& array = mesh.arrays[a];
    line = row(name, full_name(array.info), with, alone);
    line["bytes"] = with.sizes.streams[stream_of(array)];
    line["max_error"] = with.errors[0];
    print(line);
  }
}

void tell_sizes(const ArrayMesh& mesh, const char* name, Level level) {
  Variant all{&mesh, {}};
  Schema schema;
  for (const MeshArray& array : mesh.arrays) {
    all.arrays.push_back(&array);
    schema.arrays.push_back(array.info);
  }
  all.run(level, true);
  json arrays = {{{"array", "coordinates"},
                  {"bytes", all.sizes.streams["geometry"]},
                  {"max_error", all.coordinates_error}}};
  for (std::size_t a = 0; a < mesh.arrays.size(); ++a)
    arrays.push_back({{"array", full_name(mesh.arrays[a].info)},
                      {"bytes", all.sizes.streams[array_stream_name(schema, a)]},
                      {"max_error", all.errors[a]}});
  print({{"level", name}, {"arrays", arrays}});
}

// --- raw arrays

void write_raw(const std::string& path, std::span<const std::vector<std::byte>> parts) {
  std::FILE* file = std::fopen(path.c_str(), "wb");
  bool good = file != nullptr;
  for (const auto& part : parts)
    good = good && std::fwrite(part.data(), 1, part.size(), file) == part.size();
  if (file == nullptr || std::fclose(file) != 0 || !good)
    throw std::runtime_error(path + ": cannot be written");
}

void dump(const ArrayMesh& mesh, const std::string& folder) {
  std::filesystem::create_directories(folder);
  std::vector<std::byte> corners(mesh.corners.size() * sizeof mesh.corners[0]);
  std::memcpy(corners.data(), mesh.corners.data(), corners.size());
  const auto tell = [&](const std::string& name, const std::string& file,
                        std::span<const std::vector<std::byte>> parts, ScalarType type,
                        std::uint64_t components, std::uint64_t values) {
    write_raw(folder + "/" + file, parts);
    print({{"array", name},
           {"file", file},
           {"type", scalar_name(type)},
           {"components", components},
           {"steps", parts.size()},
           {"values", values}});
  };
  tell("corners", "corners.bin", {&corners, 1}, ScalarType::uint64, 1, mesh.corners.size());
  tell("coordinates", "coordinates.bin", {&mesh.xyz, 1}, mesh.coordinate_type, 3,
       3 * mesh.vertices);
  for (std::size_t a = 0; a < mesh.arrays.size(); ++a) {
    const MeshArray& array = mesh.arrays[a];
    tell(full_name(array.info), "array" + std::to_string(a) + ".bin", array.steps, array.info.type,
         array.info.components, values_of(array));
  }
}

// --- options

/// Joins the arrays NAME.0, NAME.1, ... into one array with time steps.
void join_steps(ArrayMesh& mesh, const std::string& name) {
  std::optional<MeshArray> joined;
  std::vector<MeshArray> rest;
  for (MeshArray& array : mesh.arrays) {
    if (!array.info.name.starts_with(name + ".")) {
      rest.push_back(std::move(array));
    } else if (!joined) {
      joined = std::move(array);
      joined->info.name = name;
      joined->info.per_step = true;
    } else {
      joined->steps.push_back(std::move(array.steps[0]));
    }
  }
  if (!joined) throw std::runtime_error("no arrays " + name + ".0, " + name + ".1, ...");
  mesh.arrays = std::move(rest);
  mesh.arrays.push_back(std::move(*joined));
}

void quantize_like(ArrayMesh& mesh, const std::string& path) {
  const auto file = unwrap(FileSource::open(path));
  const Reader reader = unwrap(Reader::open(*file));
  mesh.coordinate_quantization = reader.schema().coordinate_quantization;
  for (MeshArray& array : mesh.arrays)
    for (const ArrayInfo& like : reader.schema().arrays)
      if (like.name == array.info.name && like.location == array.info.location)
        array.info.quantization = like.quantization;
}

int run(int argc, char** argv) {
  std::string like, folder;
  std::vector<std::string> level_names, stepped;
  double seconds = .3;
  bool only_sizes = false, no_arrays = false;
  const std::string path = parse_options(argc, argv,
                                         {{"--level", level_names},
                                          {"--seconds", seconds},
                                          {"--stepped", stepped},
                                          {"--like", like},
                                          {"--dump", folder},
                                          {"--sizes", only_sizes},
                                          {"--no-arrays", no_arrays}});
  const std::vector<std::size_t> levels = levels_named(level_names);
  ArrayMesh mesh = load_arrays(path);
  if (no_arrays) mesh.arrays.clear();
  for (const std::string& name : stepped) join_steps(mesh, name);
  if (!like.empty()) quantize_like(mesh, like);
  if (!folder.empty()) {
    dump(mesh, folder);
  } else {
    for (const std::size_t level : levels) {
      const auto& [name, what] = kLevels[level];
      if (only_sizes)
        tell_sizes(mesh, name, what);
      else
        time_level(mesh, name, what, seconds);
    }
  }
  return 0;
}

}  // namespace
}  // namespace shm::bench

int main(int argc, char** argv) {
  return shm::bench::run_reporting("values_bench", shm::bench::run, argc, argv);
}
