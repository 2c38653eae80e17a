// make_seeds DIR SOURCE_DIR: writes the seeds of the fuzz targets into folders below DIR.
// SOURCE_DIR is the folder of this project. The folders are:
//   shm        the golden files of all versions, and one small file for each feature of the current
//              format. Each file is preceded by a byte, which targets use as a random seed or to
//              choose a variant of the test
//   calls      small feature files, each followed by a script of calls (for fuzz_calls)
//   archive    archives, each also preceded by a byte
//   writer     random bytes, from which fuzz_writer makes choices
// If the converters are built, there are also:
//   parity     files with parity
//   exodus, gmsh, ucd, vtk, vtu   some of the feature files, converted to these formats
//   converted  .shm files, each also preceded by a byte. They are made by compressing the seeds and
//              the corpus of fuzz_exodus, fuzz_gmsh, fuzz_ucd, fuzz_vtk and fuzz_vtu
#include <algorithm>
#include <array>
#include <cstdio>
#include <cstdlib>
#include <exception>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <string>
#include <string_view>
#include <vector>

#include "files/mesh_files.h"
#include "shm/sets.h"
#include "support/coded_meshes.h"
#ifdef SHM_SEEDS_OF_CONVERTERS
#include "archive/parity.h"
#include "base/failure.h"
#include "base/spool.h"
#include "compression/compress.h"
#include "compression/decompress.h"
#include "formats/formats.h"
#include "support/parity_file.h"
#endif

namespace {

using std::filesystem::path;

void write(const path& file, const std::string& bytes) {
  std::filesystem::create_directories(file.parent_path());
  std::ofstream out;
  out.exceptions(std::ios::failbit | std::ios::badbit);
  out.open(file, std::ios::binary);
  out.write(bytes.data(), static_cast<std::streamsize>(bytes.size()));
}

std::string text_of(const std::vector<std::byte>& bytes) {
  return {reinterpret_cast<const char*>(bytes.data()), bytes.size()};
}

struct Golden {
  std::string name, bytes;
};
/// Returns the golden files in `folder` and its subfolders. The returned name of a file in a
/// subfolder begins with the name of the subfolder, e.g. "0.1-keep.shm" for 0.1/keep.shm.
std::vector<Golden> golden_files(const path& folder) {
  std::vector<Golden> files;
  for (const auto& file : std::filesystem::recursive_directory_iterator(folder)) {
    if (file.path().extension() != ".shm") continue;
    std::ifstream in(file.path(), std::ios::binary);
    std::string name = std::filesystem::relative(file.path(), folder).generic_string();
    std::replace(name.begin(), name.end(), '/', '-');
    files.push_back({name, {std::istreambuf_iterator<char>(in), {}}});
  }
  std::sort(files.begin(), files.end(), [](auto& a, auto& b) { return a.name < b.name; });
  return files;
}

/// Returns a file with time steps, several segments and several groups, in which some arrays cover
/// only a few cells.
shm::FeatureFile steps_on_few_cells(shm::Order order, shm::ConnectivityCodec codec) {
  shm::TestMesh mesh = shm::bent_grid(4, 4, 3);
  mesh.schema.blocks.push_back({2, "few", shm::CellShape::hexahedron, 8});
  for (std::size_t c = 2; c < mesh.cells.size(); c += 5) mesh.cells[c].block = 1;
  mesh.schema.arrays.push_back(
      shm::array_of("fixed", shm::Location::cell, shm::ScalarType::float32));
  mesh.arrays.push_back(moving_values(mesh.schema.arrays[0], mesh.cells.size(), 1));
  shm::Stepped stepped{with_order(std::move(mesh), order, order == shm::Order::keep, 0), {}, {}};
  add_stepped(stepped.mesh,
              shm::array_of("t", shm::Location::cell, shm::ScalarType::float64, 2, {1}));
  add_stepped(stepped.mesh,
              shm::array_of("n", shm::Location::cell, shm::ScalarType::int16, 1, {1}));
  add_stepped(stepped.mesh, shm::array_of("p", shm::Location::cell, shm::ScalarType::float32));
  for (const std::uint32_t array : {1u, 2u, 3u})
    for (const std::uint64_t step : {0u, 1u, 2u, 5u})
      stepped.values[{array, step}] =
          moving_values(stepped.mesh.schema.arrays[array], elements_of(stepped.mesh, array), step);
  stepped.options.group_cells = 8;
  stepped.options.segment_cells = 16;
  stepped.options.key_steps = 3;
  stepped.options.connectivity = codec;
  if (codec == shm::ConnectivityCodec::patterns) stepped.options.level = shm::Level::fast;
  return {std::string("few_cells_") + std::string(shm::order_name(order)) + "_" +
              std::string(codec_name(codec)),
          written(stepped)};
}

/// Adds copies of a file to `out`, each with one damaged byte at a different position. Checksums
/// detect this damage.
void add_damaged(const shm::FeatureFile& file, std::vector<shm::FeatureFile>& out) {
  constexpr std::size_t kPlaces = 12;
  for (std::size_t i = 1; i < kPlaces; ++i) {
    shm::FeatureFile damaged = file;
    damaged.bytes[damaged.bytes.size() * i / kPlaces] ^= std::byte{16};
    damaged.name = file.name + "_damaged_" + std::to_string(i);
    out.push_back(std::move(damaged));
  }
}

/// Returns files with additional features. These features are not among the feature files
/// (support/feature_files.h), because they need larger files.
std::vector<shm::FeatureFile> more_files() {
  std::vector<shm::FeatureFile> files;
  {  // a file with data whose compression ratio is far above 30
    shm::MemorySink sink;
    auto writer = shm::Writer::create(sink, shm::hexahedra_schema());
    for (const char* key : {"zeros", "more zeros"})
      (void)writer->add_extra({key,
                               shm::ScalarType::uint8,
                               shm::Reference::nothing,
                               {1 << 20},
                               std::vector<std::byte>(1 << 20)});
    (void)writer->end_mesh();
    (void)writer->finish();
    files.push_back({"zeros", std::move(sink.bytes)});
  }
  {  // a file with a set of each kind, and a file with an invalid set of each kind
    using Kind = shm::MeshSet::Kind;
    std::vector<shm::MeshSet> sets = {{Kind::nodes, 7, "inlet", {0, 3, 5}, {}, {}, {1, .5, 2}},
                                      {Kind::sides, -1, "", {0, 4, 4}, {1, 6, 2}, {}, {}},
                                      {Kind::elements, 2, "all", {1, 2}, {}, {0}, {}}};
    for (const bool odd : {false, true}) {
      if (odd)
        for (shm::MeshSet& set : sets) set.members.push_back(std::uint64_t{1} << 40);
      if (odd) sets[1].sides.push_back(3);
      shm::MemorySink sink;
      const auto extras = [&](shm::Writer& writer) -> shm::Result<void> {
        const auto made = shm::extras_of_sets(sets);
        if (!made) return made.error();
        for (const shm::Extra& extra : *made)
          if (auto status = writer.add_extra(extra); !status) return status;
        return {};
      };
      (void)write_mesh(shm::bent_grid(3, 2, 2), sink, {}, extras);
      files.push_back({odd ? "odd_sets" : "sets", std::move(sink.bytes)});
    }
  }
  for (const shm::Order order : {shm::Order::keep, shm::Order::stream})
    // files with time steps and with vertices that no cell uses
    for (const auto codec : shm::codecs_of_both_kinds()) {
      shm::TestMesh mesh = with_order(shm::bent_grid(4, 3, 3), order, order == shm::Order::keep, 0);
      for (int i = 0; i < 3; ++i) append_point(mesh, {2, i + .5, -1});
      for (const shm::Location location : {shm::Location::point, shm::Location::cell}) {
        mesh.schema.arrays.push_back(shm::array_of("w", location, shm::ScalarType::float32));
        mesh.schema.arrays.back().per_step = true;
        mesh.arrays.emplace_back();
      }
      shm::MemorySink sink;
      shm::WriteOptions options;
      options.group_cells = 6;
      options.segment_cells = 12;
      options.connectivity = codec;
      const auto steps = [&](shm::Writer& writer) -> shm::Result<void> {
        for (const std::uint32_t array : {0u, 1u})
          for (std::uint64_t step = 0; step < 4; ++step) {
            std::vector<std::byte> values;
            const std::uint64_t elements = array == 0 ? mesh.vertices : mesh.cells.size();
            for (std::uint64_t e = 0; e < elements; ++e)
              shm::append(values, static_cast<float>(e * e % 100 + 3 * step));
            if (auto status = writer.add_step_values(array, step, values); !status) return status;
          }
        return writer.set_step_times(std::vector<double>{0, 1, 2, 3});
      };
      (void)write_mesh(mesh, sink, options, steps);
      files.push_back({std::string("unused_steps_") + std::string(codec_name(codec)) + "_" +
                           std::string(order_name(order)),
                       std::move(sink.bytes)});
      files.push_back(steps_on_few_cells(order, codec));
      add_damaged(shm::FeatureFile(files.back()), files);
    }
  return files;
}

/// Writes random choices for fuzz_writer.
void write_choices(const path& folder) {
  shm::PlainRandom random(12);
  for (int file = 0; file < 160; ++file) {
    std::string choices;
    for (std::uint64_t i = 20 + random.below(300); i > 0; --i)
      choices += static_cast<char>(random.below(256));
    write(folder / std::to_string(file), choices);
  }
}

/// Writes the seeds of fuzz_calls: two for each feature file, each with a different random script
/// of calls.
void write_calls(const path& folder, const std::vector<shm::FeatureFile>& features) {
  shm::PlainRandom random(11);
  for (const shm::FeatureFile& feature : features)
    for (int n = 0; n < 2; ++n) {
      std::string script;
      for (int i = 0; i < 80; ++i) script += static_cast<char>(random.below(256));
      write(folder / (feature.name + std::to_string(n)),
            static_cast<char>(script.size()) + text_of(feature.bytes) + script);
    }
}

#ifdef SHM_SEEDS_OF_CONVERTERS
/// Converts some of the feature files to all other formats. If a format cannot store a mesh, prints
/// a message and writes no seed.
void write_formats(const path& folder, const std::vector<shm::FeatureFile>& features) {
  using namespace shm::converters;
  constexpr std::array<std::string_view, 8> kSome = {
      "one_hexahedron", "mixed_cells",      "every_shape",           "second_order",
      "arrays",         "steps_and_extras", "arrays_on_some_blocks", "shifts_steps"};
  for (const shm::FeatureFile& feature : features) {
    if (std::find(kSome.begin(), kSome.end(), feature.name) == kSome.end()) continue;
    for (const std::string_view name : {"exodus", "gmsh", "ucd", "vtk", "vtu"}) {
      const path file = folder / name / feature.name;
      std::filesystem::create_directories(file.parent_path());
      try {
        Spool spool(std::filesystem::temp_directory_path().string());
        shm::MemorySource source(feature.bytes);
        StagedMesh mesh(source, feature.name, spool);
        write_mesh(mesh, file.string(), *format_named(name), spool);
      } catch (const Failure& failure) {
        std::fprintf(stderr, "no %s of %s: %s\n", std::string(name).c_str(), feature.name.c_str(),
                     failure.what());
      }
    }
  }
}

/// Compresses the files in `seeds`, which are in formats other than .shm. The extras of the
/// resulting .shm files describe the keywords and the layout of these source files.
void write_converted(const path& folder, const path& seeds) {
  using namespace shm::converters;
  std::vector<path> files;
  for (const auto& file : std::filesystem::directory_iterator(seeds)) files.push_back(file.path());
  std::sort(files.begin(), files.end());
  char choice = 0;
  for (const path& file : files) {
    try {
      Spool spool(std::filesystem::temp_directory_path().string());
      const auto mesh = open_mesh(file.string(), spool);
      shm::MemorySink sink;
      CompressOptions options;
      options.order = choice % 4 == 0 ? shm::Order::stream : shm::Order::keep;
      compress_mesh(*mesh, sink, options, spool);
      write(folder / (seeds.filename().string() + "-" + file.filename().string()),
            choice++ + text_of(sink.bytes));
    } catch (const Failure&) {  // skip the file: most files of a fuzzing corpus do not contain a
                                // complete mesh
    }
  }
}

void write_parity_files(const path& folder, const std::vector<shm::FeatureFile>& features) {
  if (!shm::converters::has_parity_codes()) return;
  const std::string file = text_of(shm::parity_file().bytes);
  write(folder / "segments", file);
  std::string damaged = file;
  std::fill(damaged.begin() + 100, damaged.begin() + 300, '\0');
  write(folder / "damaged", damaged);
  // Also writes a file with several parity blocks in several stripes.
  std::vector<std::byte> all;
  for (const shm::FeatureFile& feature : features)
    if (all.size() < 9000) all.insert(all.end(), feature.bytes.begin(), feature.bytes.end());
  shm::MemoryRandomSource source(all);
  shm::MemorySink sink;
  shm::converters::ParityShape shape;
  shape.protected_bytes = all.size();
  shape.data = 2;
  shape.parity = 1;
  shm::converters::write_parity(source, shape, sink);
  damaged = text_of(all) + text_of(sink.bytes);
  write(folder / "stripes", damaged);
  std::fill(damaged.begin() + 5000, damaged.begin() + 5100, '\1');
  write(folder / "stripes_damaged", damaged);
}
#endif

void make_seeds(const path& folder, const path& source) {
  std::vector<shm::FeatureFile> features = shm::feature_files();
  for (const auto& more : {more_files(), shm::coded_files()})
    features.insert(features.end(), more.begin(), more.end());
  char pieces = 0;
  for (const shm::FeatureFile& feature : features)
    write(folder / "shm" / feature.name, pieces++ + text_of(feature.bytes));
  for (const Golden& file : golden_files(source / "tests" / "golden"))
    write(folder / (file.name.find("archive") != file.name.npos ? "archive" : "shm") / file.name,
          pieces++ + file.bytes);
  write(folder / "archive" / "two", pieces + text_of(shm::archive_file().bytes));
  write_calls(folder / "calls", features);
  write_choices(folder / "writer");
#ifdef SHM_SEEDS_OF_CONVERTERS
  write_parity_files(folder / "parity", features);
  write_formats(folder, features);
  for (const std::string name : {"exodus", "gmsh", "ucd", "vtk", "vtu"})
    for (const path& seeds : {folder / name, source / "fuzz" / "corpus" / ("fuzz_" + name)})
      write_converted(folder / "converted", seeds);
#endif
}

}  // namespace

int main(int count, char** words) {
  if (count != 3) {
    std::fputs("usage: make_seeds DIR SOURCE_DIR\n", stderr);
    return 2;
  }
  try {
    make_seeds(words[1], words[2]);
  } catch (const std::exception& error) {
    std::fprintf(stderr, "make_seeds: %s\n", error.what());
    return 1;
  }
  return 0;
}
