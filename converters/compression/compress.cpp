#include "compression/compress.h"

#include <algorithm>
#include <cstring>
#include <limits>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "accuracy/block_accuracy.h"
#include "base/failure.h"
#include "compression/compress.h"
#include "compression/step_feeder.h"
#include "formats/formats.h"
#include "interface/format.h"
#include "mesh/coding_order.h"
#include "mesh/vertex_compaction.h"
#include "order/delay_trial.h"
#include "order/free_order.h"
#include "order/reordered_mesh.h"
#include "order/rounding_trial.h"
#include "order/sample_mesh.h"
#include "order/spooled_mesh.h"
#include "sets/set_folders.h"

namespace shm::converters {
namespace {

// Size limit, in bytes, of the cache for vertex records or for the values of one step. The cache is
// unlimited if the whole mesh is in memory anyway.
constexpr std::size_t kUnlimited = std::numeric_limits<std::size_t>::max();

// Creates a Writer. The Writer returns the error `misuse` if the codec cannot encode the mesh. If
// the user chose the codec, this error is passed on. Otherwise the mesh is the cause, and the error
// is changed to `unsupported`.
Writer writer_to(ByteSink& sink, Schema schema, const WriteOptions& options) {
  return options.connectivity == ConnectivityCodec::automatic
             ? checked(Writer::create(sink, std::move(schema), options))
             : unwrap(Writer::create(sink, std::move(schema), options));
}

// Forwards the coding order to two receivers, each of which may be null.
class BothOrders final : public CodingOrder {
 public:
  BothOrders(CodingOrder* first, CodingOrder* second) : first_(first), second_(second) {}
  void vertex(std::uint64_t number) override {
    if (first_ != nullptr) first_->vertex(number);
    if (second_ != nullptr) second_->vertex(number);
  }
  void cell(std::uint64_t number) override {
    if (first_ != nullptr) first_->cell(number);
    if (second_ != nullptr) second_->cell(number);
  }

 private:
  CodingOrder* first_;
  CodingOrder* second_;
};

// Writes the values of one array at all steps. `order` contains the element numbers in coding
// order. If `order` is null, the coding order is the order of the source file.
void write_steps(MeshSource& mesh, Writer& writer, std::size_t array, NumberList* order,
                 std::size_t cache_bytes, const Progress& progress) {
  const std::uint64_t steps = mesh.info().step_times.size();
  for (std::uint64_t step = 0; step < steps; ++step) {
    feed_step(mesh, array, step, order, cache_bytes, [&](std::span<const std::byte> values) {
      checked(writer.add_step_values(static_cast<std::uint32_t>(array), step, values));
    });
    if (progress) progress(mesh.info().schema.arrays[array].name, step + 1, steps);
  }
}

// Returns true if the coding order is still needed after the cells have been written. It is needed
// if the values at time steps are written in an order other than that of the source, or if extras
// refer to vertices or cells that are renumbered.
bool needs_coding_order(const MeshInfo& info, const Schema& schema) {
  const bool cells_move = schema.delay > 0;
  const auto has_ordered_steps = [&](const ArrayInfo& array) {
    return array.per_step &&
           (array.location == Location::point || (cells_move && array.location == Location::cell));
  };
  const auto refers = [](const Extra& extra) { return extra.refers != Reference::nothing; };
  return std::any_of(schema.arrays.begin(), schema.arrays.end(), has_ordered_steps) ||
         (schema.order != Order::keep &&
          std::any_of(info.extras.begin(), info.extras.end(), refers));
}

void write_all_steps(MeshSource& mesh, Writer& writer, const Schema& schema, CodingOrderLog* log,
                     Spool& spool, std::size_t cache_bytes, const Progress& progress) {
  std::optional<CoveredOrder> covered;
  for (std::size_t a = 0; a < schema.arrays.size(); ++a) {
    if (!schema.arrays[a].per_step) continue;
    NumberList* order = nullptr;
    if (schema.arrays[a].location == Location::point) {
      order = &log->vertices();
    } else if (schema.arrays[a].location == Location::cell && schema.delay > 0) {
      if (!covered) covered.emplace(mesh, log->cells(), spool);
      order = &covered->elements(a);
    }
    write_steps(mesh, writer, a, order, cache_bytes, progress);
  }
}

// Writes the extras. `log` contains the coding order. It may be null if no extra refers to vertices
// or cells whose numbers change.
void write_extras(const MeshInfo& info, Writer& writer, const Schema& schema, CodingOrderLog* log,
                  Spool& spool) {
  if (schema.order == Order::keep || log == nullptr) {
    for (const Extra& extra : info.extras) checked(writer.add_extra(extra));
    return;
  }
  Renumbering to;
  to.vertices = info.vertices;
  to.cells = info.cells();
  NumberTable vertex_position = invert(log->vertices(), info.vertices, "vertex", spool);
  std::optional<NumberTable> cell_position;
  to.vertex = [&](std::uint64_t v) { return vertex_position.get(v); };
  if (schema.delay > 0) {
    cell_position = invert(log->cells(), info.cells(), "cell", spool);
    to.cell = [&](std::uint64_t c) { return cell_position->get(c); };
  }
  for (const Extra& extra : info.extras) checked(writer.add_extra(renumbered(extra, to)));
}

// Encodes a mesh, with the cells in the order in which `mesh` supplies them. `cache_bytes` is the
// memory limit for the cache of vertex records, and later for the cache of the values of one step.
SizeReport code_mesh(MeshSource& mesh, const Schema& schema, ByteSink& sink,
                     const WriteOptions& options, const Progress& progress, Spool& spool,
                     std::size_t cache_bytes) {
  std::optional<CodingOrderLog> log;
  if (needs_coding_order(mesh.info(), schema)) log.emplace(spool, schema.delay > 0);
  BothOrders orders(log ? &*log : nullptr, options.coding_order);
  WriteOptions write_options = options;
  if (log) write_options.coding_order = &orders;
  write_options.kept_topology_bytes = kept_topology_bytes(spool);
  write_options.kept_steps_bytes = kept_steps_bytes(spool);
  write_options.temporary_folder = spool.directory();
  Writer writer = writer_to(sink, schema, write_options);
  {
    MeshFeeder<Writer> feeder(mesh, schema, writer, cache_bytes);
    stream_compacted(mesh, spool, feeder, progress);
  }
  checked(writer.end_mesh());
  if (log) log->check();
  CodingOrderLog* const order = log ? &*log : nullptr;
  write_all_steps(mesh, writer, schema, order, spool, cache_bytes, progress);
  checked(writer.set_step_times(mesh.info().step_times));
  write_extras(mesh.info(), writer, schema, order, spool);
  return checked(writer.finish());
}

bool rounds_something(const Lossy& lossy) {
  constexpr auto kLossless = Accuracy::Kind::lossless;
  return lossy.coordinates.kind != kLossless || lossy.fields.kind != kLossless ||
         !lossy.named.empty();
}

// Receives the coding order of a reordered mesh, whose vertices may also have been renumbered.
// Converts the vertex and cell numbers to those of the original mesh, and forwards them to another
// receiver.
class FormerNumbers final : public CodingOrder {
 public:
  // All arguments must outlive this object. `in_spool` is the mesh with renumbered vertices. It is
  // null if the vertices were not renumbered.
  FormerNumbers(const CellList& order, CodingOrder* out, const SpooledMesh* in_spool = nullptr)
      : order_(&order), out_(out), in_spool_(in_spool) {}
  void vertex(std::uint64_t number) override {
    if (out_ == nullptr) return;
    out_->vertex(in_spool_ == nullptr
                     ? number
                     : in_spool_->number_of_vertex(static_cast<std::uint32_t>(number)));
  }
  void cell(std::uint64_t number) override {
    if (out_ == nullptr) return;
    const std::uint32_t cell = (*order_)[number];
    out_->cell(in_spool_ == nullptr ? cell : in_spool_->number_of(cell));
  }

 private:
  const CellList* order_;
  CodingOrder* out_;
  const SpooledMesh* in_spool_;
};

std::size_t usual_cache(const Schema& schema, const Spool& spool) {
  return schema.order == Order::free ? kUnlimited : spool.memory_budget() / 4;
}

TrialCoder trial_coder(const Schema& schema, ConnectivityCodec codec, Spool& spool) {
  return [&, codec](MeshSource& part) {
    NullSink nowhere;
    WriteOptions options;
    // To compare cell orders and delays, use the rows codec instead of the mixed codec. Both lead
    // to the same decisions.
    const bool as_rows = codec == ConnectivityCodec::automatic || codec == ConnectivityCodec::mixed;
    options.connectivity = as_rows ? ConnectivityCodec::rows : codec;
    options.restart_budget = 0;
    options.slow_step_values = 0;
    options.digest = false;
    return code_mesh(part, schema, nowhere, options, {}, spool, usual_cache(schema, spool));
  };
}

// Returns true if the order of the cells is so regular that the connectivity needs almost no bits.
// A delay buffer could then hardly reduce the size of the file. To find out, encodes the first
// cells with the level and codec of `options`.
bool connectivity_is_free(MeshSource& mesh, const Schema& schema, const CompressOptions& options,
                          Spool& spool) {
  constexpr std::uint64_t kCells = 32768;
  constexpr double kBitsPerCell = .25;
  SampleMesh start(mesh, std::vector<CellRun>{{0, std::min(kCells, mesh.info().cells())}});
  NullSink nowhere;
  WriteOptions write_options;
  write_options.level = options.level;
  write_options.connectivity = options.connectivity;
  write_options.digest = false;
  const SizeReport sizes =
      code_mesh(start, schema, nowhere, write_options, {}, spool, usual_cache(schema, spool));
  const auto its = sizes.streams.find("connectivity");
  const double bytes = its == sizes.streams.end() ? 0 : static_cast<double>(its->second);
  return 8 * bytes <= kBitsPerCell * static_cast<double>(sizes.cells);
}

// Returns the best delay (number of cells in the delay buffer) for a mesh: 0 if the connectivity
// needs almost no bits, otherwise the result of find_delay(). At Level::best, always returns the
// result of find_delay().
std::uint32_t tried_delay(MeshSource& mesh, const Schema& schema, const CompressOptions& options,
                          Spool& spool) {
  if (options.progress) options.progress("trying delays", 0, 1);
  if (options.level != Level::best && connectivity_is_free(mesh, schema, options, spool)) return 0;
  const double worthwhile = options.level == Level::best ? kWorthwhileAtBest : kWorthwhile;
  return find_delay(mesh, worthwhile, [&](MeshSource& part, std::uint32_t delay) {
    Schema delayed = schema;
    delayed.delay = delay;
    return trial_coder(delayed, options.connectivity, spool)(part);
  });
}

// Returns the largest distance between key steps. For a mesh with one step, the default is 1. This
// makes the step a key step, so that neither the encoder nor the decoder keeps its values as a
// reference for other steps.
std::uint32_t key_steps_of(const MeshSource& mesh, const CompressOptions& options) {
  return options.key_steps.value_or(mesh.info().step_times.size() == 1 ? 1
                                                                       : WriteOptions().key_steps);
}

WriteOptions heard_by(CodingOrder* coding_order, WriteOptions options) {
  options.coding_order = coding_order;
  return options;
}

// Compresses a mesh in Order::free if the mesh does not fit in memory: copies it to a spool
// (temporary storage, on disk if large). The resulting file is the same as for a mesh in memory.
SizeReport compress_free_in_spool(MeshSource& mesh, ByteSink& sink, const Schema& schema,
                                  const CompressOptions& options, Spool& spool) {
  const SpooledSearch search(spool.memory_budget());
  Spool mesh_spool(spool.directory(), search.mesh_bytes);
  SpooledMesh in_spool(mesh, mesh_spool, search.sort_bytes, options.progress);
  const std::optional<CellList> order =
      find_free_order(mesh, in_spool, in_spool, trial_coder(schema, options.connectivity, spool),
                      options.progress, {&mesh_spool, search.order_bytes});
  Spool coding_spool(spool.directory(), search.coding_bytes);
  const auto code = [&](MeshSource& ordered, CodingOrder* coding_order) {
    return code_mesh(ordered, schema, sink,
                     heard_by(coding_order, write_options_for(mesh, options)), options.progress,
                     coding_spool, search.cache_bytes);
  };
  if (!order) return code(mesh, options.coding_order);
  FormerNumbers former(*order, options.coding_order, &in_spool);
  ReorderedMesh ordered(in_spool, in_spool, *order, &mesh_spool);
  return code(ordered, &former);
}

SizeReport compress_free(MeshSource& mesh, ByteSink& sink, const Schema& schema,
                         const CompressOptions& options, Spool& spool) {
  if (options.cell_order == nullptr && must_be_spooled(mesh.info(), spool.memory_budget()))
    return compress_free_in_spool(mesh, sink, schema, options, spool);
  const auto code = [&](MeshSource& ordered, CodingOrder* coding_order) {
    return code_mesh(ordered, schema, sink,
                     heard_by(coding_order, write_options_for(mesh, options)), options.progress,
                     spool, kUnlimited);
  };
  std::optional<CellTable> cells = CellTable::read(mesh, options.progress);
  if (!cells) return code(mesh, options.coding_order);
  std::optional<CellList> order;
  if (options.cell_order != nullptr)
    order.emplace(*options.cell_order);
  else
    order = find_free_order(mesh, *cells, mesh, trial_coder(schema, options.connectivity, spool),
                            options.progress);
  if (!order) cells.reset();
  if (!order) return code(mesh, options.coding_order);
  FormerNumbers former(*order, options.coding_order);
  ReorderedMesh ordered(mesh, *cells, *order);
  return code(ordered, &former);
}

}  // namespace

bool needs_corner_order(const MeshInfo& info) {
  const auto has_more_nodes = [](const BlockInfo& block) {
    return block.shape == CellShape::hexahedron && block.nodes_per_cell != 8;
  };
  const auto is_by_place = [](const ArrayInfo& array) {
    return array.location == Location::cell && role_of(array).is_by_place;
  };
  const std::vector<BlockInfo>& blocks = info.schema.blocks;
  const std::vector<ArrayInfo>& arrays = info.schema.arrays;
  return source_format(info).needs_corner_order(info) ||
         std::any_of(info.extras.begin(), info.extras.end(),
                     [](const Extra& extra) { return is_about_sides(extra.key); }) ||
         std::any_of(blocks.begin(), blocks.end(), has_more_nodes) ||
         std::any_of(arrays.begin(), arrays.end(), is_by_place);
}

Schema schema_for(MeshSource& mesh, const CompressOptions& options) {
  Schema schema = mesh.info().schema;
  schema.order = options.order;
  // Allows all kinds of references. The Writer chooses one of them for each step.
  schema.step_references = StepReference::base;
  schema.delay = options.order == Order::free ? 0 : options.delay.value_or(0);
  schema.corner_order = options.order == Order::keep || needs_corner_order(mesh.info());
  add_fills(options.lossy, schema);
  if (rounds_something(options.lossy)) {
    set_accuracy(mesh, options.lossy, schema, options.progress);
  } else {
    schema.coordinate_quantization = {};
    for (ArrayInfo& array : schema.arrays) array.quantization = {};
  }
  return schema;
}

Schema schema_to_write(MeshSource& mesh, const CompressOptions& options, Spool& spool) {
  if (has_block_bounds(mesh.info().schema, options.lossy) && !has_any(block_bounds_in(mesh.info())))
    throw Failure(ErrorCode::unsupported, "bounds of blocks need shm compress");
  Schema schema = schema_for(mesh, options);
  remove_useless_rounding(mesh, schema, [&](MeshSource& part, const Schema& tried) {
    if (options.progress) options.progress("trying bounds", 0, 1);
    NullSink nowhere;
    WriteOptions trial = write_options_for(mesh, options);
    trial.digest = false;
    if (&part != &mesh) trial.slow_step_values = 0;  // a sample of a large mesh
    return code_mesh(part, tried, nowhere, trial, {}, spool, usual_cache(tried, spool));
  });
  if (options.order == Order::stream && !options.delay && options.level != Level::fast)
    schema.delay = tried_delay(mesh, schema, options, spool);
  return schema;
}

WriteOptions write_options_for(const MeshSource& mesh, const CompressOptions& options) {
  WriteOptions write_options;
  write_options.level = options.level;
  write_options.connectivity = options.connectivity;
  write_options.segment_cells = options.segment_cells;
  write_options.restart_budget = options.restart_budget;
  write_options.key_steps = key_steps_of(mesh, options);
  write_options.threads = options.threads;
  write_options.digest = options.digest;
  return write_options;
}

namespace {

// Compresses a mesh whose arrays with block bounds are rounded already.
SizeReport compress_rounded(MeshSource& mesh, ByteSink& sink, const CompressOptions& options,
                            Spool& spool) {
  const Schema schema = schema_to_write(mesh, options, spool);
  if (options.order == Order::free) return compress_free(mesh, sink, schema, options, spool);
  return code_mesh(mesh, schema, sink,
                   heard_by(options.coding_order, write_options_for(mesh, options)),
                   options.progress, spool, usual_cache(schema, spool));
}

}  // namespace

SizeReport compress_mesh(MeshSource& mesh, ByteSink& sink, const CompressOptions& options,
                         Spool& spool) {
  if (!has_block_bounds(mesh.info().schema, options.lossy))
    return compress_rounded(mesh, sink, options, spool);
  Schema schema = mesh.info().schema;
  add_fills(options.lossy, schema);
  RoundedMesh rounded(mesh, block_bounds_of(mesh, options.lossy, options.progress), schema);
  return compress_rounded(rounded, sink, options, spool);
}

std::optional<std::uint64_t> bytes_in_free_order(MeshSource& mesh, const CompressOptions& options,
                                                 const SizeReport& sizes, Spool& spool) {
  if (must_be_spooled(mesh.info(), spool.memory_budget())) return std::nullopt;
  const std::optional<CellTable> cells = CellTable::read(mesh);
  if (!cells) return std::nullopt;
  const Schema schema = schema_for(mesh, options);
  Schema free_schema = schema;
  free_schema.order = Order::free;
  free_schema.delay = 0;
  free_schema.corner_order = needs_corner_order(mesh.info());
  const double share =
      share_in_free_order(mesh, *cells, trial_coder(free_schema, options.connectivity, spool),
                          trial_coder(schema, options.connectivity, spool));
  // The size of the extras does not depend on the order of the cells.
  const auto extras = sizes.streams.find("extras");
  const std::uint64_t fixed = extras == sizes.streams.end() ? 0 : extras->second;
  return fixed + static_cast<std::uint64_t>(share * static_cast<double>(sizes.total_bytes - fixed));
}

void replay_coding_order(MeshSource& mesh, const MeshInfo& of, CodingOrder& out, Spool& spool) {
  NullSink nowhere;
  Schema bare = of.schema;
  bare.arrays.clear();
  WriteOptions options;
  options.coding_order = &out;
  options.segment_starts = of.segment_starts;
  // Use the codec of the .shm file, because the codec determines the order in which the new
  // vertices of a cell are encoded.
  options.segment_connectivity = of.segment_connectivity;
  if (options.segment_starts.empty()) options.restart_budget = 0;
  Writer writer = writer_to(nowhere, bare, options);
  const bool in_memory =
      bare.order == Order::free && !must_be_spooled(mesh.info(), spool.memory_budget());
  MeshFeeder<Writer> feeder(mesh, bare, writer, in_memory ? kUnlimited : spool.memory_budget() / 4);
  stream_compacted(mesh, spool, feeder);
  checked(writer.end_mesh());
}

}  // namespace shm::converters
