// Implements the functions that open files and describe their contents.
#include "file.h"

#include <algorithm>
#include <array>
#include <cstring>
#include <iterator>
#include <span>
#include <utility>

#include "ends.h"
#include "structs.h"

namespace shmf {
namespace {

using FilePointer = std::unique_ptr<shmf_file>;

/// Opens `file`. Precondition: `file->source` is set.
shm::Result<FilePointer> opened(FilePointer file, const shmf_open_options* options) {
  const auto own = taken_or_default(options, "options");
  if (!own) return own.error();
  file->limits = limits_of(*own);
  file->damaged = own->damaged != 0;
  const auto named = [&](shm::Error why) {
    if (why.file.empty()) why.file = file->name;
    return why;
  };
  std::array<std::byte, 16> head{};
  shm::RandomSource& bytes = file->bytes();
  if (bytes.size() >= head.size()) {
    if (auto status = bytes.read_at(0, head); !status) return named(status.error());
    if (!file->section && shm::looks_like_archive(head)) {
      auto archive = shm::ArchiveReader::open(bytes, file->limits);
      if (!archive) return named(archive.error());
      file->archive.emplace(std::move(*archive));
      return file;
    }
  }
  auto mesh = file->damaged ? shm::MeshExtractor::open_damaged(bytes, file->limits)
                            : shm::MeshExtractor::open(bytes, file->limits);
  if (!mesh) return named(mesh.error());
  file->mesh.emplace(std::move(*mesh));
  file->piece.whole = !file->damaged;
  return file;
}

/// Calls `make`, which makes a handle. Stores the handle in *handle, or null if `make` fails.
template <class Handle, class Make>
shmf_status give_handle(Handle** handle, shmf_error* error, Make&& make) noexcept {
  return guarded(error, [&]() -> shm::Result<void> {
    if (handle == nullptr) return misuse("the pointer for the handle is NULL");
    *handle = nullptr;
    auto made = make();
    if (!made) return made.error();
    *handle = made->release();
    return {};
  });
}

}  // namespace

shm::ReadLimits limits_of(const shmf_open_options& options) {
  shm::ReadLimits limits;
  const auto set = [](auto& limit, auto given) {
    if (given != 0) limit = given;
  };
  set(limits.max_active_vertices, options.max_active_vertices);
  set(limits.max_active_bytes, options.max_active_bytes);
  set(limits.max_chunk_bytes, options.max_chunk_bytes);
  set(limits.max_group_bytes, options.max_group_bytes);
  set(limits.max_extra_bytes, options.max_extra_bytes);
  set(limits.max_steps, options.max_steps);
  set(limits.max_unpacked_bytes, options.max_unpacked_bytes);
  set(limits.max_column_bytes, options.max_column_bytes);
  set(limits.max_vertices, options.max_vertices);
  set(limits.max_cells, options.max_cells);
  set(limits.max_decoded_bytes, options.max_decoded_bytes);
  set(limits.max_arrays, options.max_arrays);
  set(limits.max_static_components, options.max_static_components);
  set(limits.max_blocks, options.max_blocks);
  set(limits.max_segments, options.max_segments);
  return limits;
}

shmf_info info_of(const shm::Schema& schema) {
  shmf_info info{};
  info.blocks = static_cast<std::uint32_t>(schema.blocks.size());
  info.arrays = static_cast<std::uint32_t>(schema.arrays.size());
  info.coordinate_type = static_cast<std::int32_t>(schema.coordinate_type);
  info.order = static_cast<std::int32_t>(schema.order);
  info.source_format = schema.source_format.c_str();
  if (schema.coordinate_quantization.lossy())
    info.coordinate_error = schema.coordinate_quantization.max_error(schema.coordinate_type);
  return info;
}

shm::Result<shmf_block> block_of(const shm::Schema& schema, std::uint32_t block) {
  if (block >= schema.blocks.size()) return misuse("no block " + std::to_string(block));
  const shm::BlockInfo& from = schema.blocks[block];
  shmf_block info{};
  info.id = from.id;
  info.name = from.name.c_str();
  info.shape = static_cast<std::int32_t>(from.shape);
  info.nodes_per_cell = from.nodes_per_cell;
  info.node_scheme = static_cast<std::int32_t>(from.scheme);
  return info;
}

shm::Result<shmf_array> array_of(const shm::Schema& schema, std::uint32_t array) {
  if (array >= schema.arrays.size()) return misuse("no array " + std::to_string(array));
  const shm::ArrayInfo& from = schema.arrays[array];
  shmf_array info{};
  info.name = from.name.c_str();
  info.role = from.role.c_str();
  info.location = static_cast<std::int32_t>(from.location);
  info.type = static_cast<std::int32_t>(from.type);
  info.components = from.components;
  info.per_step = from.per_step ? 1 : 0;
  info.elements = from.elements;
  info.blocks = from.blocks.empty() ? nullptr : from.blocks.data();
  info.block_count = static_cast<std::uint32_t>(from.blocks.size());
  info.fills = from.fills.empty() ? nullptr : from.fills.data();
  info.fill_count = static_cast<std::uint32_t>(from.fills.size());
  info.relative_error = from.quantization.max_rel;
  if (from.quantization.lossy() && info.relative_error == 0)
    info.error = from.quantization.max_error(from.type);
  return info;
}

shmf_extra extra_of(const shm::Extra& extra) {
  shmf_extra info{};
  info.key = extra.key.c_str();
  info.type = static_cast<std::int32_t>(extra.type);
  info.refers = static_cast<std::int32_t>(extra.refers);
  info.shape = extra.shape.data();
  info.data = extra.data.data();
  info.bytes = extra.data.size();
  info.dimensions = static_cast<std::uint32_t>(extra.shape.size());
  return info;
}

std::uint64_t elements_of(const shm::Schema& schema, std::uint32_t array, std::uint64_t vertices,
                          const std::vector<std::uint64_t>& block_cells) {
  const shm::ArrayInfo& info = schema.arrays[array];
  if (info.location == shm::Location::point) return vertices;
  if (info.location != shm::Location::cell) return info.elements;
  std::uint64_t cells = 0;
  for (std::uint32_t b = 0; b < block_cells.size(); ++b)
    if (schema.array_covers(array, b)) cells += block_cells[b];
  return cells;
}

}  // namespace shmf

using shm::Result;
using shmf::give;
using shmf::misuse;
using shmf::taken;
using shmf::with_mesh;

Result<void> shmf_file::read_extras() {
  if (extras) return {};
  auto all = mesh->extras();
  if (!all) return all.error();
  extras.emplace(std::move(*all));
  return {};
}

Result<void> shmf_file::read_sets() {
  if (sets) return {};
  if (auto status = read_extras(); !status) return status;
  shm::SetBounds bounds{mesh->vertices(), mesh->cells(), schema().blocks.size()};
  // In a damaged file, the original counts may be unknown, so vertex and cell numbers are not
  // checked. Invalid sets are skipped, so that one damaged set does not hide the other sets.
  if (damaged) {
    bounds.vertices = bounds.cells = ~std::uint64_t{0};
    std::vector<shm::MeshSet> whole;
    for (const shm::SetPlace& place : shm::find_sets(*extras))
      if (auto set = shm::read_set(*extras, place, bounds)) whole.push_back(std::move(*set));
    sets.emplace(std::move(whole));
    return {};
  }
  auto all = shm::sets_of_extras(*extras, bounds);
  if (!all) return all.error();
  sets.emplace(std::move(*all));
  return {};
}

shmf_status shmf_open_path(const char* path, const shmf_open_options* options, shmf_file** file,
                           shmf_error* error) {
  return shmf::give_handle(file, error, [&]() -> Result<shmf::FilePointer> {
    if (path == nullptr) return misuse("the path is NULL");
    auto source = shm::FileRandomSource::open(shmf::path_of(path));
    if (!source) return source.error();
    auto made = std::make_unique<shmf_file>();
    made->name = path;
    made->source = std::move(*source);
    return shmf::opened(std::move(made), options);
  });
}

shmf_status shmf_open_memory(const void* bytes, uint64_t count, const shmf_open_options* options,
                             shmf_file** file, shmf_error* error) {
  return shmf::give_handle(file, error, [&]() -> Result<shmf::FilePointer> {
    if (bytes == nullptr && count > 0) return misuse("the bytes are NULL");
    auto made = std::make_unique<shmf_file>();
    made->source = std::make_shared<shm::MemoryRandomSource>(
        std::span(static_cast<const std::byte*>(bytes), static_cast<std::size_t>(count)));
    return shmf::opened(std::move(made), options);
  });
}

shmf_status shmf_open_source(const shmf_source* source, const shmf_open_options* options,
                             shmf_file** file, shmf_error* error) {
  shmf_source own{};
  if (source != nullptr && source->struct_size >= sizeof(std::size_t))
    std::memcpy(&own, source, std::min(source->struct_size, sizeof own));
  bool closes = false;  // true once a CallbackSource owns the source and will close it
  const auto opened = shmf::give_handle(file, error, [&]() -> Result<shmf::FilePointer> {
    if (const auto status = taken(source, "the source"); !status) return status.error();
    if (own.read_at == nullptr) return misuse("the source has no read_at()");
    auto made = std::make_unique<shmf_file>();
    auto bytes = std::make_unique<shmf::CallbackSource>(own);
    closes = true;
    // The members of an archive share one source, although each may be used in a different thread.
    made->source = std::make_shared<shm::SharedSource>(std::move(bytes));
    return shmf::opened(std::move(made), options);
  });
  if (!closes && own.close != nullptr) own.close(own.context);
  return opened;
}

void shmf_close(shmf_file* file) { delete file; }

int32_t shmf_is_archive(const shmf_file* file) { return file != nullptr && file->archive ? 1 : 0; }

uint32_t shmf_member_count(const shmf_file* archive) {
  if (archive == nullptr || !archive->archive) return 0;
  return static_cast<std::uint32_t>(archive->archive->members().size());
}

const char* shmf_member_name(const shmf_file* archive, uint32_t member) {
  if (member >= shmf_member_count(archive)) return nullptr;
  return archive->archive->members()[member].name.c_str();
}

shmf_status shmf_open_member(const shmf_file* archive, uint32_t member,
                             const shmf_open_options* options, shmf_file** file,
                             shmf_error* error) {
  return shmf::give_handle(file, error, [&]() -> Result<shmf::FilePointer> {
    if (member >= shmf_member_count(archive)) return misuse("no member " + std::to_string(member));
    const shm::ArchiveMember& of = archive->archive->members()[member];
    auto made = std::make_unique<shmf_file>();
    made->name = archive->name.empty() ? of.name : archive->name + ": " + of.name;
    made->source = archive->source;
    made->section.emplace(*made->source, of.offset, of.bytes);
    return shmf::opened(std::move(made), options);
  });
}

shmf_status shmf_get_info(const shmf_file* file, shmf_info* info, shmf_error* error) {
  return with_mesh(file, error, [&] {
    shmf_info own = shmf::info_of(file->schema());
    own.vertices = file->mesh->vertices();
    own.cells = file->mesh->cells();
    own.hexahedra = file->mesh->hexahedra();
    own.steps = file->mesh->step_count();
    own.has_digest = file->mesh->digest().has_value() ? 1 : 0;
    own.digest = file->mesh->digest().value_or(0);
    own.segments = static_cast<std::uint32_t>(file->mesh->segments().size());
    own.file_bytes = file->section ? file->section->size() : file->source->size();
    return give(info, own, "info");
  });
}

shmf_status shmf_get_block(const shmf_file* file, uint32_t block, shmf_block* info,
                           shmf_error* error) {
  return with_mesh(file, error, [&]() -> Result<void> {
    auto own = shmf::block_of(file->schema(), block);
    if (!own) return own.error();
    const auto& cells = file->mesh->block_cells();
    own->cells = block < cells.size() ? cells[block] : 0;
    return give(info, *own, "info");
  });
}

shmf_status shmf_get_array(const shmf_file* file, uint32_t array, shmf_array* info,
                           shmf_error* error) {
  return with_mesh(file, error, [&]() -> Result<void> {
    auto own = shmf::array_of(file->schema(), array);
    if (!own) return own.error();
    own->elements =
        shmf::elements_of(file->schema(), array, file->mesh->vertices(), file->mesh->block_cells());
    return give(info, *own, "info");
  });
}

int64_t shmf_find_array(const shmf_file* file, int32_t location, const char* name) {
  if (file == nullptr || !file->mesh || name == nullptr) return -1;
  const auto& arrays = file->schema().arrays;
  const auto found = std::find_if(arrays.begin(), arrays.end(), [&](const shm::ArrayInfo& array) {
    return static_cast<std::int32_t>(array.location) == location && array.name == name;
  });
  return found == arrays.end() ? -1 : std::distance(arrays.begin(), found);
}

shmf_status shmf_get_segment(const shmf_file* file, uint32_t segment, shmf_segment* info,
                             shmf_error* error) {
  return with_mesh(file, error, [&]() -> Result<void> {
    const auto& segments = file->mesh->segments();
    if (segment >= segments.size()) return misuse("no segment " + std::to_string(segment));
    const shm::SegmentInfo& from = segments[segment];
    shmf_segment own{};
    own.first_cell = from.first_cell;
    own.cells = from.cells;
    own.first_vertex = from.first_vertex;
    own.vertices = from.vertices;
    own.bytes = from.bytes;
    std::copy(from.box.begin(), from.box.end(), own.box);
    return give(info, own, "info");
  });
}

shmf_status shmf_get_times(shmf_file* file, const double** times, uint64_t* count,
                           shmf_error* error) {
  return with_mesh(file, error, [&]() -> Result<void> {
    if (times == nullptr || count == nullptr) return misuse("the pointer for the times is NULL");
    if (!file->times) {
      auto all = file->mesh->step_times();
      if (!all) return all.error();
      file->times.emplace(std::move(*all));
    }
    *times = file->times->data();
    *count = file->times->size();
    return {};
  });
}

shmf_status shmf_get_steps(shmf_file* file, uint32_t array, const uint64_t** steps, uint64_t* count,
                           shmf_error* error) {
  return with_mesh(file, error, [&]() -> Result<void> {
    if (steps == nullptr || count == nullptr) return misuse("the pointer for the steps is NULL");
    if (array >= file->schema().arrays.size()) return misuse("no array " + std::to_string(array));
    file->array_steps.clear();
    if (file->schema().arrays[array].per_step) {
      auto all = file->mesh->steps(array);
      if (!all) return all.error();
      file->array_steps = std::move(*all);
    }
    *steps = file->array_steps.data();
    *count = file->array_steps.size();
    return {};
  });
}

shmf_status shmf_extra_count(shmf_file* file, uint64_t* count, shmf_error* error) {
  return with_mesh(file, error, [&]() -> Result<void> {
    if (count == nullptr) return misuse("the pointer for the count is NULL");
    if (auto status = file->read_extras(); !status) return status;
    *count = file->extras->size();
    return {};
  });
}

shmf_status shmf_get_extra(shmf_file* file, uint64_t extra, shmf_extra* info, shmf_error* error) {
  return with_mesh(file, error, [&]() -> Result<void> {
    if (auto status = file->read_extras(); !status) return status;
    if (extra >= file->extras->size()) return misuse("no extra " + std::to_string(extra));
    const shm::Extra& from = (*file->extras)[static_cast<std::size_t>(extra)];
    return give(info, shmf::extra_of(from), "info");
  });
}

shmf_status shmf_set_count(shmf_file* file, uint64_t* count, shmf_error* error) {
  return with_mesh(file, error, [&]() -> Result<void> {
    if (count == nullptr) return misuse("the pointer for the count is NULL");
    if (auto status = file->read_sets(); !status) return status;
    *count = file->sets->size();
    return {};
  });
}

shmf_status shmf_get_set(shmf_file* file, uint64_t set, shmf_set* info, shmf_error* error) {
  return with_mesh(file, error, [&]() -> Result<void> {
    if (auto status = file->read_sets(); !status) return status;
    if (set >= file->sets->size()) return misuse("no set " + std::to_string(set));
    const shm::MeshSet& from = (*file->sets)[static_cast<std::size_t>(set)];
    shmf_set own{};
    own.kind = static_cast<std::int32_t>(from.kind);
    own.id = from.id;
    own.name = from.name.c_str();
    own.members = from.members.size();
    own.numbers = from.members.data();
    own.sides = from.kind == shm::MeshSet::Kind::sides ? from.sides.data() : nullptr;
    own.block_count = static_cast<std::uint32_t>(from.blocks.size());
    own.blocks = from.blocks.data();
    own.factor_count = from.factors.size();
    own.factors = from.factors.data();
    return give(info, own, "info");
  });
}
