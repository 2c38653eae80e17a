// Implements the functions shmf_writer_*. They write the schema first, then vertices and cells,
// then time steps, extras and sets.
#include <array>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <utility>
#include <variant>
#include <vector>

#include "ends.h"
#include "errors.h"
#include "shm/appender.h"
#include "shm/damage.h"
#include "shm/mesh.h"
#include "shm/reader.h"
#include "shm/recorded_order.h"
#include "shm/sets.h"
#include "shm/summary.h"
#include "shm/writer.h"
#include "structs.h"

namespace shmf {
namespace {

using shm::Result;

enum class Stage { schema, mesh, behind_mesh, finished };

std::string text_of(const char* text) { return text == nullptr ? std::string() : text; }

template <class T>
std::span<const T> list_of(const T* first, std::uint64_t count) {
  return {first, first == nullptr ? 0 : static_cast<std::size_t>(count)};
}

std::size_t stride_of(const shm::ArrayInfo& info) {
  return shm::scalar_bytes(info.type) * info.components;
}

/// A sink whose file replaces the old file, from which data is copied. commit() closes the old file
/// first, because some systems cannot replace an open file.
class SuccessorSink final : public shm::ByteSink {
 public:
  SuccessorSink(std::unique_ptr<shm::ByteSink> sink, std::unique_ptr<shm::FileRandomSource>& old)
      : sink_(std::move(sink)), old_(&old) {}
  Result<void> write(std::span<const std::byte> bytes) override { return sink_->write(bytes); }
  Result<void> copy(shm::RandomSource& from, std::uint64_t offset, std::uint64_t bytes) override {
    return sink_->copy(from, offset, bytes);
  }
  Result<void> commit() override {
    old_->reset();
    return sink_->commit();
  }

 private:
  std::unique_ptr<shm::ByteSink> sink_;
  std::unique_ptr<shm::FileRandomSource>* old_;
};

/// Removes the bytes after the last index of a live file, which were not committed. Opens `old`
/// again if the file becomes shorter. Fails if these bytes may be part of the file: parity, or
/// chunks after damage.
Result<void> cut_to_last_index(shm::FileSink& file, std::unique_ptr<shm::FileRandomSource>& old,
                               const std::string& name) {
  const auto bytes = shm::bytes_of_file(*old);
  if (!bytes) return bytes.error();
  if (*bytes == old->size()) return file.continue_at(*bytes);
  // Fails if the file has parity.
  shm::AppendOptions in_place;
  in_place.in_place = true;
  if (auto opened = shm::Appender::open(*old, file, in_place); !opened) return opened.error();
  const auto report = shm::find_damage(*old);
  if (!report) return report.error();
  if (!report->damages.empty())
    return shm::Error{.code = shm::ErrorCode::corrupt,
                      .detail = "is damaged, so it cannot be continued in place"};
  if (auto status = file.continue_at(*bytes); !status) return status;
  auto shorter = shm::FileRandomSource::open(name);
  if (!shorter) return shorter.error();
  old = std::move(*shorter);
  return {};
}

}  // namespace
}  // namespace shmf

struct shmf_writer {
  shm::Schema schema;
  shm::WriteOptions options;
  std::unique_ptr<shm::ByteSink> sink;
  std::string name;  // name of the file for messages; may be empty
  shm::RecordedOrder order;
  std::optional<shm::Writer> writer;  // empty until the schema is complete
  // Set only while steps are appended to an existing file; in this case `writer` is empty.
  std::unique_ptr<shm::FileRandomSource> old;
  std::optional<shm::Appender> appender;
  shmf::Stage stage = shmf::Stage::schema;
  bool keeps_blocks = false;  // true: some array with time steps does not cover all blocks
  std::vector<std::uint32_t> cell_blocks;  // block index of each cell; used only if keeps_blocks
  bool is_live = false;
  bool has_sets = false;
  /// Index of the most recently written array, and the indices of its elements in coding order.
  std::optional<std::uint32_t> ordered_array;
  std::vector<std::uint64_t> coded_elements;
  std::optional<shm::Error> failed;
  bool ran_out = false;  // true: an earlier call ran out of memory, so all later calls fail

  shm::Result<void> begin_mesh();
  shm::Result<void> end_mesh();
  shm::Result<void> add_values(std::uint32_t array, std::uint64_t step,
                               std::span<const std::byte> values);
  shm::Result<void> add_coded_values(std::uint32_t array, std::uint64_t step,
                                     std::span<const std::byte> values) {
    return appender ? appender->add_step_values(array, step, values)
                    : writer->add_step_values(array, step, values);
  }
  shm::Result<void> add_extra(shm::Extra extra);
  shm::Result<void> read_order();
  /// Returns the total size in bytes of the values of one vertex, or of one cell of `block`, in all
  /// static arrays.
  std::size_t element_bytes(shm::Location location, std::uint32_t block) const;
};

using shm::Result;
using shmf::misuse;
using shmf::Stage;

/// Creates the writer from the schema, which must be complete.
Result<void> shmf_writer::begin_mesh() {
  if (stage == Stage::mesh) return {};
  if (stage != Stage::schema) return misuse("the mesh has ended");
  bool stepped = false;
  for (const shm::ArrayInfo& array : schema.arrays) {
    stepped = stepped || array.per_step;
    keeps_blocks = keeps_blocks || (array.per_step && array.location == shm::Location::cell &&
                                    !array.blocks.empty());
  }
  if (stepped || schema.order != shm::Order::keep) options.coding_order = &order;
  auto created = shm::Writer::create(*sink, schema, options);
  if (!created) return created.error();
  writer.emplace(std::move(*created));
  stage = Stage::mesh;
  return {};
}

Result<void> shmf_writer::end_mesh() {
  if (stage == Stage::behind_mesh) return {};
  if (stage == Stage::finished) return misuse("the file is finished");
  if (auto status = begin_mesh(); !status) return status;
  if (auto status = writer->end_mesh(); !status) return status;
  stage = Stage::behind_mesh;
  return {};
}

std::size_t shmf_writer::element_bytes(shm::Location location, std::uint32_t block) const {
  std::size_t bytes = 0;
  for (std::size_t a = 0; a < schema.arrays.size(); ++a) {
    const shm::ArrayInfo& info = schema.arrays[a];
    if (info.per_step || info.location != location) continue;
    if (location == shm::Location::point || schema.array_covers(a, block))
      bytes += shmf::stride_of(info);
  }
  return bytes;
}

/// Rearranges the caller's values into coding order, and writes them in parts of about 1 MiB.
Result<void> shmf_writer::add_values(std::uint32_t array, std::uint64_t step,
                                     std::span<const std::byte> values) {
  if (array >= schema.arrays.size()) return misuse("no array " + std::to_string(array));
  const shm::ArrayInfo& info = schema.arrays[array];
  if (!info.per_step) return misuse("array '" + info.name + "' is not per step");
  if (ordered_array != array) {
    auto elements = order.elements(schema, array, cell_blocks);
    if (!elements) return elements.error();
    coded_elements = std::move(*elements);
    ordered_array = array;
  }
  const std::size_t stride = shmf::stride_of(info);
  if (values.size() != coded_elements.size() * stride)
    return misuse("array '" + info.name + "' has " + std::to_string(coded_elements.size()) +
                  " elements, which need " + std::to_string(coded_elements.size() * stride) +
                  " bytes");
  constexpr std::size_t kBytesAtOnce = std::size_t{1} << 20;
  std::vector<std::byte> some;
  for (std::size_t i = 0; i < coded_elements.size(); ++i) {
    const auto from = static_cast<std::size_t>(coded_elements[i]) * stride;
    some.insert(some.end(), values.begin() + static_cast<std::ptrdiff_t>(from),
                values.begin() + static_cast<std::ptrdiff_t>(from + stride));
    if (some.size() < kBytesAtOnce && i + 1 < coded_elements.size()) continue;
    if (auto status = add_coded_values(array, step, some); !status) return status;
    some.clear();
  }
  // The writer must also receive the (empty) values of an array without elements.
  return coded_elements.empty() ? add_coded_values(array, step, {}) : Result<void>();
}

/// Adds an extra. The vertex and cell numbers in it are those with which the caller wrote the mesh;
/// when steps are appended to a file, they are the numbers that readers see.
Result<void> shmf_writer::add_extra(shm::Extra extra) {
  if (appender) return appender->add_extra(extra);
  if (schema.order != shm::Order::keep)
    if (auto status = order.renumber(extra); !status) return status;
  return writer->add_extra(extra);
}

/// Reads two properties of the old file: the coding order of its vertices and cells, and the block
/// of each cell.
Result<void> shmf_writer::read_order() {
  auto mesh = appender->without_steps();
  if (!mesh) return mesh.error();
  auto reader = shm::Reader::open(**mesh);
  if (!reader) return reader.error();
  std::vector<std::uint32_t> coded_blocks;
  const auto add = [](auto& to, const auto& from) {
    to.insert(to.end(), from.begin(), from.end());
  };
  while (true) {
    const auto item = reader->next();
    if (!item) return item.error();
    if (*item == nullptr) break;
    const auto* block = std::get_if<shm::MeshBlock>(*item);
    if (block == nullptr) continue;
    add(order.vertices, block->vertex_numbers);
    add(order.cells, block->cell_numbers);
    add(coded_blocks, block->cell_blocks);
  }
  cell_blocks.resize(coded_blocks.size());
  for (std::size_t i = 0; i < coded_blocks.size(); ++i) {
    if (order.cells[i] >= coded_blocks.size())
      return shmf::corrupt("there is a cell " + std::to_string(order.cells[i]) +
                               ", the number of cells is " + std::to_string(coded_blocks.size()),
                           "mesh");
    cell_blocks[static_cast<std::size_t>(order.cells[i])] = coded_blocks[i];
  }
  return {};
}

namespace shmf {
namespace {

/// Like guarded(), runs `call` and stores errors in *error. After the first failure for a writer,
/// all later calls fail with the same error.
template <class Call>
shmf_status with_writer(shmf_writer* writer, shmf_error* error, Call&& call) noexcept {
  return guarded(error, [&]() -> Result<void> {
    if (writer == nullptr) return misuse("the writer is NULL");
    if (writer->failed) return *writer->failed;
    if (writer->ran_out) return shm::Error{kNoMemory, "an earlier call ran out of memory"};
    writer->ran_out = true;  // stays true if `call` throws
    auto done = call();
    if (done) {
      writer->ran_out = false;
      return {};
    }
    shm::Error why = done.error();
    if (why.file.empty()) why.file = writer->name;
    writer->failed = why;
    return why;
  });
}

Result<shm::Quantization> bound_of(double error, shm::ScalarType type, std::uint32_t components) {
  if (error == 0) return shm::Quantization();
  if (!(error > 0) || !(error < 1e300))
    return misuse("an error bound must be above 0 and below 1e300");
  if (!shm::is_float(type)) return misuse("only floating-point values can have an error bound");
  return shm::Quantization::absolute(error, components);
}

Result<shm::Quantization> relative_bound_of(double relative_error, double error,
                                            shm::ScalarType type) {
  if (error != 0) return misuse("an array has either an error bound or a relative error bound");
  if (!(relative_error > 0) || !(relative_error <= 0.5))
    return misuse("a relative error bound must be above 0 and at most 0.5");
  if (!shm::is_float(type)) return misuse("only floating-point values can have an error bound");
  return shm::Quantization::relative(relative_error, type);
}

Result<std::unique_ptr<shmf_writer>> writer_with(const shmf_write_options& options) {
  auto made = std::make_unique<shmf_writer>();
  if (options.order < SHMF_ORDER_KEEP || options.order > SHMF_ORDER_FREE)
    return misuse("no order " + std::to_string(options.order));
  constexpr std::array kLevels = {shm::Level::standard, shm::Level::fast, shm::Level::best};
  if (options.level < SHMF_LEVEL_DEFAULT || options.level > SHMF_LEVEL_BEST)
    return misuse("no level " + std::to_string(options.level));
  if (options.coordinate_type != 0 && options.coordinate_type != SHMF_FLOAT32 &&
      options.coordinate_type != SHMF_FLOAT64)
    return misuse("coordinates must be float32 or float64");
  shm::Schema& schema = made->schema;
  schema.order = static_cast<shm::Order>(options.order);
  schema.coordinate_type =
      options.coordinate_type == SHMF_FLOAT32 ? shm::ScalarType::float32 : shm::ScalarType::float64;
  schema.source_format = text_of(options.source_format);
  auto bound = bound_of(options.coordinate_error, schema.coordinate_type, 3);
  if (!bound) return bound.error();
  schema.coordinate_quantization = std::move(*bound);
  made->options.level = kLevels[static_cast<std::size_t>(options.level)];
  made->options.threads = options.threads == SHMF_ALL_THREADS ? 0
                          : options.threads == 0              ? 1
                                                              : options.threads;
  made->options.segment_cells = options.segment_cells;
  if (options.key_steps != 0) made->options.key_steps = options.key_steps;
  return made;
}

/// Makes a writer, opens its sink with `open(writer, options)`, and stores the writer in *writer,
/// or null on failure.
template <class Open>
shmf_status give_writer(const shmf_write_options* options, shmf_writer** writer, shmf_error* error,
                        Open&& open) noexcept {
  return guarded(error, [&]() -> Result<void> {
    if (writer == nullptr) return misuse("the pointer for the handle is NULL");
    *writer = nullptr;
    const auto own = taken_or_default(options, "options");
    if (!own) return own.error();
    auto made = writer_with(*own);
    if (!made) return made.error();
    if (auto status = open(**made, *own); !status) return status;
    *writer = made->release();
    return {};
  });
}

Result<shm::NumberSpan> numbers_of(const shmf_target& from) {
  const std::size_t width = shmf_type_bytes(from.type);
  const bool is_number = from.type >= SHMF_INT32 && from.type <= SHMF_UINT64;
  if (!is_number) return misuse("vertex numbers must be 32-bit or 64-bit integers");
  if (reinterpret_cast<std::uintptr_t>(from.data) % width != 0)
    return misuse("the memory of the array is not aligned for its type");
  const auto count = static_cast<std::size_t>(from.bytes / width);
  // Reading a signed type as unsigned turns a negative number into a large number, which no vertex
  // has.
  if (width == 4)
    return shm::NumberSpan(std::span(static_cast<const std::uint32_t*>(from.data), count));
  return shm::NumberSpan(std::span(static_cast<const std::uint64_t*>(from.data), count));
}

/// Collects the arrays that shmf_writer_mesh() receives, and combines them into a mesh.
class ArraysOfCaller {
 public:
  explicit ArraysOfCaller(const shm::Schema& schema) : schema_(&schema) {
    mesh_.arrays.resize(schema.arrays.size());
  }
  Result<void> take(const shmf_target& from);
  Result<const shm::MeshArrays*> finish();

 private:
  Result<void> take_values(const shmf_target& from);

  const shm::Schema* schema_;
  shm::MeshArrays mesh_;
};

Result<void> ArraysOfCaller::take(const shmf_target& from) {
  if (from.data == nullptr && from.bytes > 0) return misuse("data is NULL");
  const auto bytes =
      std::span(static_cast<const std::byte*>(from.data), static_cast<std::size_t>(from.bytes));
  switch (from.what) {
    case SHMF_POINTS:
      if (from.type != static_cast<std::int32_t>(schema_->coordinate_type))
        return misuse("points are not of the coordinate type");
      mesh_.xyz = bytes;
      return {};
    case SHMF_CORNERS:
    case SHMF_CORNER_BEGIN: {
      auto numbers = numbers_of(from);
      if (!numbers) return numbers.error();
      (from.what == SHMF_CORNERS ? mesh_.corners : mesh_.corner_begin) = *numbers;
      return {};
    }
    case SHMF_CELL_BLOCKS:
      if (from.type != SHMF_INT32 && from.type != SHMF_UINT32)
        return misuse("block indices must be 32-bit integers");
      if (reinterpret_cast<std::uintptr_t>(from.data) % sizeof(std::uint32_t) != 0)
        return misuse("the memory of the array is not aligned for its type");
      mesh_.cell_blocks = std::span(static_cast<const std::uint32_t*>(from.data),
                                    static_cast<std::size_t>(from.bytes / sizeof(std::uint32_t)));
      return {};
    case SHMF_VALUES: return take_values(from);
    default:
      return misuse("shmf_writer_mesh() does not take shmf_what " + std::to_string(from.what));
  }
}

Result<void> ArraysOfCaller::take_values(const shmf_target& from) {
  if (from.array >= schema_->arrays.size()) return misuse("no array " + std::to_string(from.array));
  const shm::ArrayInfo& info = schema_->arrays[from.array];
  if (info.per_step) return misuse("values of array '" + info.name + "' come after the mesh");
  if (from.type != static_cast<std::int32_t>(info.type))
    return misuse("values of array '" + info.name + "' are not of its type");
  mesh_.arrays[from.array] =
      std::span(static_cast<const std::byte*>(from.data), static_cast<std::size_t>(from.bytes));
  return {};
}

/// Computes the number of cells from the arrays, and returns the mesh.
Result<const shm::MeshArrays*> ArraysOfCaller::finish() {
  if (!mesh_.corner_begin.empty()) {
    mesh_.cells = mesh_.corner_begin.size() - 1;
  } else if (!mesh_.cell_blocks.empty()) {
    mesh_.cells = mesh_.cell_blocks.size();
  } else if (!mesh_.corners.empty()) {
    const std::uint32_t nodes = schema_->blocks.empty() ? 0 : schema_->blocks[0].nodes_per_cell;
    if (nodes == 0) return misuse("corner_begin is missing: the number of corners varies");
    if (mesh_.corners.size() % nodes != 0)
      return misuse("the corners do not form cells of " + std::to_string(nodes) + " nodes");
    mesh_.cells = mesh_.corners.size() / nodes;
  }
  return &mesh_;
}

Result<shm::Extra> extra_from(const shmf_extra& from) {
  if (from.key == nullptr) return misuse("the key of an extra is NULL");
  if (from.dimensions > 0 && from.shape == nullptr) return misuse("the shape is NULL");
  if (from.bytes > 0 && from.data == nullptr) return misuse("data is NULL");
  if (shmf_type_bytes(from.type) == 0)
    return misuse("there is no type " + std::to_string(from.type));
  if (from.refers < SHMF_REFERS_TO_NOTHING || from.refers > SHMF_REFERS_TO_CELLS)
    return misuse("there is no kind of reference " + std::to_string(from.refers));
  shm::Extra extra;
  extra.key = from.key;
  extra.type = static_cast<shm::ScalarType>(from.type);
  extra.refers = static_cast<shm::Reference>(from.refers);
  const auto shape = list_of(from.shape, from.dimensions);
  extra.shape.assign(shape.begin(), shape.end());
  const auto data = list_of(static_cast<const std::byte*>(from.data), from.bytes);
  extra.data.assign(data.begin(), data.end());
  return extra;
}

Result<shm::MeshSet> set_from(const shmf_set& from) {
  if (from.kind < SHMF_NODE_SET || from.kind > SHMF_ELEMENT_SET)
    return misuse("there is no kind of set " + std::to_string(from.kind));
  if ((from.members > 0 && from.numbers == nullptr) ||
      (from.block_count > 0 && from.blocks == nullptr) ||
      (from.factor_count > 0 && from.factors == nullptr) ||
      (from.members > 0 && from.kind == SHMF_SIDE_SET && from.sides == nullptr))
    return misuse("a list of a set is NULL");
  shm::MeshSet set;
  set.kind = static_cast<shm::MeshSet::Kind>(from.kind);
  set.id = from.id;
  set.name = text_of(from.name);
  const auto copy = [](auto& to, const auto* first, std::uint64_t count) {
    const auto list = list_of(first, count);
    to.assign(list.begin(), list.end());
  };
  copy(set.members, from.numbers, from.members);
  if (from.kind == SHMF_SIDE_SET) copy(set.sides, from.sides, from.members);
  copy(set.blocks, from.blocks, from.block_count);
  copy(set.factors, from.factors, from.factor_count);
  return set;
}

}  // namespace
}  // namespace shmf

using shmf::with_writer;

shmf_status shmf_writer_path(const char* path, const shmf_write_options* options,
                             shmf_writer** writer, shmf_error* error) {
  const auto open = [&](shmf_writer& made, const shmf_write_options& own) -> Result<void> {
    if (path == nullptr) return misuse("the path is NULL");
    const auto existing =
        own.replace != 0 ? shm::FileSink::Existing::replace : shm::FileSink::Existing::refuse;
    const std::string file = shmf::path_of(path);
    made.is_live = own.live != 0;
    auto sink = made.is_live
                    ? shm::FileSink::create_live(file, existing)
                    : shm::FileSink::create(file, shm::FileSink::Temporary::unnamed, existing);
    if (!sink) return sink.error();
    made.sink = std::move(*sink);
    made.name = path;
    return {};
  };
  return shmf::give_writer(options, writer, error, open);
}

shmf_status shmf_writer_append(const char* path, const shmf_write_options* options,
                               shmf_writer** writer, shmf_error* error) {
  const auto open = [&](shmf_writer& made, const shmf_write_options& own) -> Result<void> {
    if (path == nullptr) return misuse("the path is NULL");
    const std::string name = shmf::path_of(path);
    made.name = path;
    const auto named = [&](shm::Error why) {
      if (why.file.empty()) why.file = path;
      return why;
    };
    made.is_live = own.live != 0;
    // A live file is locked before it is read.
    auto sink = made.is_live ? shm::FileSink::open_live(name) : shm::FileSink::create(name);
    if (!sink) return sink.error();
    auto old = shm::FileRandomSource::open(name);
    if (!old) return old.error();
    if (made.is_live)
      if (auto status = shmf::cut_to_last_index(**sink, *old, name); !status)
        return named(status.error());
    made.old = std::move(*old);
    made.sink = std::move(*sink);
    if (!made.is_live)
      made.sink = std::make_unique<shmf::SuccessorSink>(std::move(made.sink), made.old);
    shm::AppendOptions how;
    how.level = made.options.level;
    how.key_steps = own.key_steps;
    how.in_place = made.is_live;
    auto appender = shm::Appender::open(*made.old, *made.sink, how);
    if (!appender) return named(appender.error());
    made.appender.emplace(std::move(*appender));
    made.schema = made.appender->schema();
    if (auto status = made.read_order(); !status) return named(status.error());
    made.stage = Stage::behind_mesh;
    return {};
  };
  return shmf::give_writer(options, writer, error, open);
}

shmf_status shmf_writer_sink(int (*write)(void* context, const void* bytes, uint64_t count),
                             void* context, const shmf_write_options* options, shmf_writer** writer,
                             shmf_error* error) {
  return shmf::give_writer(options, writer, error,
                           [&](shmf_writer& made, const shmf_write_options&) -> Result<void> {
                             if (write == nullptr) return misuse("write is NULL");
                             made.sink = std::make_unique<shmf::CallbackSink>(write, context);
                             return {};
                           });
}

shmf_status shmf_writer_block(shmf_writer* writer, const shmf_block* block, shmf_error* error) {
  return with_writer(writer, error, [&]() -> Result<void> {
    if (writer->stage != Stage::schema) return misuse("blocks must be declared before the mesh");
    const auto own = shmf::taken(block, "the block");
    if (!own) return own.error();
    if (own->shape < SHMF_OTHER || own->shape > SHMF_FACES)
      return misuse("no shape " + std::to_string(own->shape));
    if (own->node_scheme < SHMF_LAGRANGE || own->node_scheme > SHMF_BEZIER)
      return misuse("no node scheme " + std::to_string(own->node_scheme));
    writer->schema.blocks.push_back({own->id, shmf::text_of(own->name),
                                     static_cast<shm::CellShape>(own->shape), own->nodes_per_cell,
                                     static_cast<shm::NodeScheme>(own->node_scheme)});
    return {};
  });
}

shmf_status shmf_writer_array(shmf_writer* writer, const shmf_array* array, shmf_error* error) {
  return with_writer(writer, error, [&]() -> Result<void> {
    if (writer->stage != Stage::schema) return misuse("arrays must be declared before the mesh");
    const auto own = shmf::taken(array, "the array");
    if (!own) return own.error();
    if (own->location < SHMF_POINT_DATA || own->location > SHMF_ELEMENT_SET_DATA)
      return misuse("no location " + std::to_string(own->location));
    if (shmf_type_bytes(own->type) == 0) return misuse("no type " + std::to_string(own->type));
    if (own->block_count > 0 && own->blocks == nullptr) return misuse("the blocks are NULL");
    if (own->fill_count > 0 && own->fills == nullptr) return misuse("the fill values are NULL");
    shm::ArrayInfo info;
    info.name = shmf::text_of(own->name);
    info.role = shmf::text_of(own->role);
    info.location = static_cast<shm::Location>(own->location);
    info.type = static_cast<shm::ScalarType>(own->type);
    info.components = own->components == 0 ? 1 : own->components;
    info.per_step = own->per_step != 0;
    if (!is_on_mesh(info.location)) info.elements = own->elements;
    const auto blocks = shmf::list_of(own->blocks, own->block_count);
    info.blocks.assign(blocks.begin(), blocks.end());
    const auto fills = shmf::list_of(own->fills, own->fill_count);
    info.fills.assign(fills.begin(), fills.end());
    auto bound = own->relative_error != 0
                     ? shmf::relative_bound_of(own->relative_error, own->error, info.type)
                     : shmf::bound_of(own->error, info.type, info.components);
    if (!bound) return bound.error();
    info.quantization = std::move(*bound);
    writer->schema.arrays.push_back(std::move(info));
    return {};
  });
}

shmf_status shmf_writer_mesh(shmf_writer* writer, const shmf_target* arrays, size_t count,
                             shmf_error* error) {
  return with_writer(writer, error, [&]() -> Result<void> {
    if (writer->stage != Stage::schema) return misuse("the mesh has already begun");
    if (arrays == nullptr && count > 0) return misuse("the arrays are NULL");
    shmf::ArraysOfCaller own(writer->schema);
    for (std::size_t i = 0; i < count; ++i) {
      const std::string name = "array " + std::to_string(i);
      const auto from = shmf::taken(shmf::at(arrays, i), name.c_str());
      if (!from) return from.error();
      if (auto status = own.take(*from); !status) return misuse(status.error().detail, name);
    }
    const auto mesh = own.finish();
    if (!mesh) return mesh.error();
    if (auto status = writer->begin_mesh(); !status) return status;
    if (auto status = writer->writer->add_mesh(**mesh); !status) return status;
    if (writer->keeps_blocks) {
      const auto& blocks = (*mesh)->cell_blocks;
      writer->cell_blocks.assign(blocks.begin(), blocks.end());
      // without SHMF_CELL_BLOCKS, all cells belong to block 0
      writer->cell_blocks.resize(static_cast<std::size_t>((*mesh)->cells));
    }
    return writer->end_mesh();
  });
}

shmf_status shmf_writer_vertices(shmf_writer* writer, uint64_t count, const uint64_t* numbers,
                                 const void* xyz, const void* values, shmf_error* error) {
  return with_writer(writer, error, [&]() -> Result<void> {
    if (auto status = writer->begin_mesh(); !status) return status;
    const std::size_t data_bytes = writer->element_bytes(shm::Location::point, 0);
    if (count > 0 && (numbers == nullptr || xyz == nullptr)) return misuse("vertices are NULL");
    if (count > 0 && (values == nullptr) != (data_bytes == 0))
      return misuse("the values of each vertex need " + std::to_string(data_bytes) + " bytes");
    const std::size_t xyz_bytes = 3 * shm::scalar_bytes(writer->schema.coordinate_type);
    return writer->writer->add_vertices(
        shmf::list_of(numbers, count),
        shmf::list_of(static_cast<const std::byte*>(xyz), count * xyz_bytes),
        shmf::list_of(static_cast<const std::byte*>(values), count * data_bytes));
  });
}

shmf_status shmf_writer_cells(shmf_writer* writer, uint64_t count, uint32_t block, uint32_t nodes,
                              const uint64_t* corners, const uint64_t* last_use, const void* values,
                              shmf_error* error) {
  return with_writer(writer, error, [&]() -> Result<void> {
    if (auto status = writer->begin_mesh(); !status) return status;
    if (block >= writer->schema.blocks.size()) return misuse("no block " + std::to_string(block));
    const std::size_t data_bytes = writer->element_bytes(shm::Location::cell, block);
    if (count > 0 && nodes > 0 && corners == nullptr) return misuse("corners are NULL");
    if (count > 0 && (values == nullptr) != (data_bytes == 0))
      return misuse("the values of each of these cells need " + std::to_string(data_bytes) +
                    " bytes");
    const auto status = writer->writer->add_cells(
        block, static_cast<std::size_t>(count), shmf::list_of(corners, count * nodes),
        shmf::list_of(last_use, last_use == nullptr ? 0 : count),
        shmf::list_of(static_cast<const std::byte*>(values), count * data_bytes));
    if (!status) return status;
    if (writer->keeps_blocks)
      writer->cell_blocks.insert(writer->cell_blocks.end(), static_cast<std::size_t>(count), block);
    return {};
  });
}

shmf_status shmf_writer_values(shmf_writer* writer, uint32_t array, uint64_t step,
                               const void* values, uint64_t bytes, shmf_error* error) {
  return with_writer(writer, error, [&]() -> Result<void> {
    if (auto status = writer->end_mesh(); !status) return status;
    if (values == nullptr && bytes > 0) return misuse("the values are NULL");
    return writer->add_values(array, step,
                              shmf::list_of(static_cast<const std::byte*>(values), bytes));
  });
}

shmf_status shmf_writer_times(shmf_writer* writer, const double* times, uint64_t count,
                              shmf_error* error) {
  return with_writer(writer, error, [&]() -> Result<void> {
    if (auto status = writer->end_mesh(); !status) return status;
    if (times == nullptr && count > 0) return misuse("the times are NULL");
    const auto all = shmf::list_of(times, count);
    return writer->appender ? writer->appender->set_step_times(all)
                            : writer->writer->set_step_times(all);
  });
}

shmf_status shmf_writer_extra(shmf_writer* writer, const shmf_extra* extra, shmf_error* error) {
  return with_writer(writer, error, [&]() -> Result<void> {
    if (auto status = writer->end_mesh(); !status) return status;
    const auto own = shmf::taken(extra, "the extra");
    if (!own) return own.error();
    auto made = shmf::extra_from(*own);
    if (!made) return made.error();
    return writer->add_extra(std::move(*made));
  });
}

shmf_status shmf_writer_sets(shmf_writer* writer, const shmf_set* sets, uint64_t count,
                             shmf_error* error) {
  return with_writer(writer, error, [&]() -> Result<void> {
    if (auto status = writer->end_mesh(); !status) return status;
    if (sets == nullptr && count > 0) return misuse("the sets are NULL");
    if (writer->appender) return misuse("the sets of an existing file cannot be changed");
    if (std::exchange(writer->has_sets, true))
      return misuse("all sets must be written in one call");
    std::vector<shm::MeshSet> all;
    for (std::uint64_t i = 0; i < count; ++i) {
      const auto own = shmf::taken(shmf::at(sets, static_cast<std::size_t>(i)), "a set");
      if (!own) return own.error();
      auto set = shmf::set_from(*own);
      if (!set) return set.error();
      all.push_back(std::move(*set));
    }
    auto extras = shm::extras_of_sets(all);
    if (!extras) return extras.error();
    for (shm::Extra& extra : *extras)
      if (auto status = writer->add_extra(std::move(extra)); !status) return status;
    return {};
  });
}

shmf_status shmf_writer_commit(shmf_writer* writer, shmf_error* error) {
  return with_writer(writer, error, [&]() -> Result<void> {
    if (auto status = writer->end_mesh(); !status) return status;
    if (!writer->is_live) return misuse("the file is not live");
    return writer->appender ? writer->appender->commit() : writer->writer->commit();
  });
}

shmf_status shmf_writer_finish(shmf_writer* writer, uint64_t* bytes, shmf_error* error) {
  return with_writer(writer, error, [&]() -> Result<void> {
    if (auto status = writer->end_mesh(); !status) return status;
    const auto report = writer->appender ? writer->appender->finish() : writer->writer->finish();
    if (!report) return report.error();
    writer->stage = Stage::finished;
    if (bytes != nullptr) *bytes = report->total_bytes;
    return {};
  });
}

void shmf_writer_free(shmf_writer* writer) { delete writer; }
