// Writes a mesh of one hexahedron to memory and reads it back.
#include <array>
#include <cstdio>
#include <span>

#include "shm/reader.h"
#include "shm/writer.h"

int fail(const shm::Error& error) {
  std::fprintf(stderr, "%s\n", error.message().c_str());
  return 1;
}

int main() {
  shm::Schema schema;
  schema.coordinate_type = shm::ScalarType::float32;
  schema.blocks.resize(1);  // a block holds hexahedra of 8 nodes unless told otherwise

  shm::MemorySink file;  // or shm::FileSink::create("mesh.shm")
  auto writer = shm::Writer::create(file, schema);
  if (!writer) return fail(writer.error());
  const std::array<std::uint64_t, 8> corners{0, 1, 2, 3, 4, 5, 6, 7};
  const float xyz[8][3] = {{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 1, 0},
                           {0, 0, 1}, {1, 0, 1}, {1, 1, 1}, {0, 1, 1}};
  // Errors stick: it is enough to look at what finish() says.
  for (const std::uint64_t vertex : corners)
    (void)writer->add_vertex(vertex, std::as_bytes(std::span(xyz[vertex])));
  (void)writer->add_cell(0, corners, 0xff);  // 8 bits: no later cell uses these corners
  (void)writer->end_mesh();
  if (const auto sizes = writer->finish(); !sizes) return fail(sizes.error());

  shm::MemorySource source(file.bytes);
  auto reader = shm::Reader::open(source);
  if (!reader) return fail(reader.error());
  for (;;) {
    const auto item = reader->next();
    if (!item) return fail(item.error());
    if (*item == nullptr) return 0;  // the end
    if (const auto* block = std::get_if<shm::MeshBlock>(*item))
      std::printf("%zu vertices, %zu cells\n", block->vertex_count(), block->cell_count());
  }
}
