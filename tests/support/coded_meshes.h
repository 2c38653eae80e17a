// Test meshes for every codec. The functions list the codecs, report which of them can encode a
// mesh, and generate small meshes of all kinds, each in every codec that can encode it. Unit tests,
// round-trip tests and the seeds of the fuzz targets all use these functions, so that none of them
// misses a codec.
#pragma once

#include <algorithm>
#include <array>
#include <random>
#include <set>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "codecs/registry.h"
#include "format/format.h"
#include "support/file_surgery.h"
#include "support/stepped_mesh.h"

namespace shm {

/// Returns the name of the codec in spec/registry.md, or an empty name if `codec` is not a codec
/// number. The switch has no default case, so that the compiler warns if a new codec is missing.
constexpr std::string_view registered_name(Codec codec) {
  switch (codec) {
    case Codec::paper: return "paper";
    case Codec::predictive: return "predictive";
    case Codec::shuffled_zstd: return "shuffled_zstd";
    case Codec::rows: return "rows";
    case Codec::replay: return "replay";
    case Codec::mixed: return "mixed";
    case Codec::columns: return "columns";
    case Codec::mixed_columns: return "mixed_columns";
    case Codec::shifts: return "shifts";
    case Codec::differences: return "differences";
    case Codec::patterns: return "patterns";
    case Codec::terms: return "terms";
    case Codec::bundle: return "bundle";
    case Codec::weighted: return "weighted";
  }
  return {};
}

/// Set of pairs: the name of a codec, and the kind of data that this codec encodes in a file. The
/// kind is the number of a stream kind, or "step_values".
using CodecUses = std::set<std::pair<std::string, std::string>>;

/// Adds the codecs of all groups and step values of a file to `uses`.
inline void add_uses(std::span<const std::byte> file, CodecUses& uses) {
  const auto add = [&](Codec codec, std::string what) {
    uses.emplace(registered_name(without_special_values(codec)), std::move(what));
  };
  for (const Chunk& chunk : take_apart(file).chunks) {
    if (chunk.is(container::ChunkKind::group))
      if (const auto group = take_group_apart(chunk))
        for (const container::StreamEntry& stream : group->header.streams)
          add(stream.codec, std::to_string(static_cast<int>(stream.kind)));
    if (chunk.is(container::ChunkKind::step_values))
      if (const auto steps = take_steps_apart(chunk))
        for (const container::StepPart& part : steps->heads) add(part.header.codec, "step_values");
  }
}

/// Returns true if a Writer accepts `codec` for the cells of a mesh with this schema.
inline bool can_be_in(const Schema& schema, ConnectivityCodec codec) {
  NullSink sink;
  return static_cast<bool>(Writer::create(sink, schema, {.connectivity = codec}));
}
/// Returns the codecs that a Writer accepts for the cells of a mesh with this schema. The first
/// entry is `automatic`.
inline std::vector<ConnectivityCodec> codecs_for(const Schema& schema) {
  std::vector<ConnectivityCodec> codecs{ConnectivityCodec::automatic};
  for (const CellCodec& named : cell_codecs())
    if (can_be_in(schema, named.name)) codecs.push_back(named.name);
  return codecs;
}
/// Returns the codecs that do not support a delay buffer.
inline std::vector<ConnectivityCodec> codecs_without_delay() {
  Schema schema = hexahedra_schema();
  auto codecs = codecs_for(schema);
  schema.delay = 1;
  for (const ConnectivityCodec with_delay : codecs_for(schema)) std::erase(codecs, with_delay);
  return codecs;
}
/// Returns `automatic` and the codecs that do not support a delay buffer. `automatic` represents
/// all other codecs.
inline std::vector<ConnectivityCodec> codecs_of_both_kinds() {
  auto codecs = codecs_without_delay();
  codecs.insert(codecs.begin(), ConnectivityCodec::automatic);
  return codecs;
}

struct GeneratedMesh {
  std::string name;
  TestMesh mesh;
};
inline std::vector<GeneratedMesh> generated_meshes() {
  std::vector<GeneratedMesh> all;
  all.push_back({"grid", bent_grid(5, 4, 4)});
  all.push_back({"shuffled", shuffled(bent_grid(4, 4, 4))});
  all.push_back({"holes and unused vertices", grid(5, 4, 4, ScalarType::float64, warped, porous)});
  all.push_back({"ring", exact_ring(7, 2, 3)});
  all.push_back({"mixed cells", mixed_cells()});
  all.push_back({"every shape", every_shape()});
  all.push_back({"few nodes", with_few_nodes(every_shape())});
  all.push_back({"second order", second_order_cells()});
  all.push_back({"degenerate", degenerate_hexahedra()});
  all.push_back({"broken", broken(bent_grid(4, 3, 2))});
  all.push_back({"arrays", with_arrays_of_every_type(bent_grid(3, 3, 3))});
  all.push_back({"arrays on some blocks", arrays_on_some_blocks()});
  all.push_back({"special values", special_values()});
  all.push_back({"rounded", quantized()});
  all.push_back(
      {"wide steps", bent_grid(3, 2, 1)});  // its step values are coded without neighbourhoods
  add_stepped(all.back().mesh, array_of("wide", Location::point, ScalarType::int16, 40));
  TestMesh renumbered = bent_grid(4, 4, 4);
  std::mt19937_64 random(5);
  shuffle_vertices(renumbered, random);
  all.push_back({"shuffled vertices", std::move(renumbered)});
  return all;
}

/// Encodes each generated mesh with every codec that supports it, and returns the files. Orders,
/// delays, steps and levels vary from file to file.
inline std::vector<FeatureFile> coded_files() {
  constexpr std::array kLevels = {Level::fast, Level::standard, Level::best};
  std::vector<FeatureFile> files;
  std::size_t turn = 0;
  for (const GeneratedMesh& generated : generated_meshes())
    for (const ConnectivityCodec codec : codecs_for(generated.mesh.schema)) {
      const Order order = turn % 2 == 0 ? Order::keep : Order::stream;
      const bool steps = turn % 4 == 3 || has_steps(generated.mesh.schema);
      Stepped stepped = steps ? with_steps(generated.mesh, order)
                              : Stepped{with_order(generated.mesh, order, true, 0), {}};
      stepped.mesh.schema.delay = 5;
      if (turn % 5 > 1 || !can_be_in(stepped.mesh.schema, codec)) stepped.mesh.schema.delay = 0;
      stepped.options.connectivity = codec;
      stepped.options.level = kLevels[turn++ % kLevels.size()];
      stepped.options.group_cells = 20;
      stepped.options.segment_cells = 40;
      std::string name = std::string(codec_name(codec)) + "_of_" + generated.name;
      std::replace(name.begin(), name.end(), ' ', '_');
      files.push_back({std::move(name), written(stepped)});
    }
  return files;
}

}  // namespace shm
