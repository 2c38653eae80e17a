// Tests that the C interface returns an error status and does not leak memory, no matter which
// memory allocation fails.
#include <gtest/gtest.h>

#include <cstdlib>
#include <new>
#include <vector>

#include "shmformat.h"
#include "support/golden_files.h"

namespace {

// Number of allocations that will still succeed. The next allocation then fails. If `for_good` is
// true, all later allocations fail, too. A negative number means that all allocations succeed.
long allowed = -1;
bool for_good = true, has_failed = false;

void* taken(std::size_t bytes) {
  if (allowed == 0) {
    has_failed = true;
    if (!for_good) allowed = -1;
    throw std::bad_alloc();
  }
  if (allowed > 0) --allowed;
  void* memory = std::malloc(bytes > 0 ? bytes : 1);
  if (memory == nullptr) throw std::bad_alloc();
  return memory;
}

}  // namespace

[[gnu::noinline]] void* operator new(std::size_t bytes) { return taken(bytes); }
[[gnu::noinline]] void* operator new(std::size_t bytes, const std::nothrow_t&) noexcept {
  try {
    return taken(bytes);
  } catch (const std::bad_alloc&) {
    return nullptr;
  }
}
[[gnu::noinline]] void operator delete(void* memory) noexcept { std::free(memory); }
[[gnu::noinline]] void operator delete(void* memory, std::size_t) noexcept { std::free(memory); }

namespace shm {
namespace {

/// Calls `work` repeatedly, and lets more allocations succeed each time, until no allocation fails.
/// Does this twice: first, all allocations after the first failure fail, too; then only a single
/// allocation fails.
template <class Work>
void with_little_memory(Work&& work) {
  for (const bool all : {true, false}) {
    int refused = 0;
    for (long n = 0;; n += 1 + n / 16) {
      allowed = n;
      for_good = all;
      has_failed = false;
      const shmf_status status = work();
      const bool enough = !has_failed;
      allowed = -1;
      // If a single allocation fails, code that does not need the memory may continue and succeed.
      ASSERT_TRUE(status == SHMF_NO_MEMORY || (status == SHMF_OK && (enough || !all)))
          << "allocation " << n << ", status " << status;
      refused += status == SHMF_NO_MEMORY ? 1 : 0;
      if (enough) break;
    }
    EXPECT_GT(refused, 20);
  }
}

TEST(CFailures, ReadingTellsOfEachAllocationThatFails) {
  const std::string bytes = content(golden_folder() / "0.10" / "steps_and_extras.shm");
  std::vector<double> points(1 << 16);
  std::vector<std::uint64_t> corners(1 << 16);
  with_little_memory([&] {
    shmf_error why{};
    shmf_file* file = nullptr;
    auto status = shmf_open_memory(bytes.data(), bytes.size(), nullptr, &file, &why);
    shmf_target want[2] = {};
    for (shmf_target& target : want) target.struct_size = sizeof target;
    want[0].what = SHMF_POINTS;
    want[0].type = SHMF_FLOAT64;
    want[0].data = points.data();
    want[0].bytes = points.size() * sizeof points[0];
    want[1].what = SHMF_CORNERS;
    want[1].type = SHMF_UINT64;
    want[1].data = corners.data();
    want[1].bytes = corners.size() * sizeof corners[0];
    std::uint64_t count = 0;
    if (status == SHMF_OK) status = shmf_read(file, want, 2, nullptr, &why);
    if (status == SHMF_OK) status = shmf_extra_count(file, &count, &why);
    if (status == SHMF_OK) status = shmf_verify(file, nullptr, &why);
    const std::uint32_t array = 0;
    shmf_boundary_options options = {};
    options.struct_size = sizeof options;
    options.arrays = &array;
    options.array_count = 1;
    shmf_boundary* boundary = nullptr;
    if (status == SHMF_OK) status = shmf_find_boundary(file, &options, nullptr, &boundary, &why);
    shmf_boundary_free(boundary);
    shmf_close(file);
    EXPECT_EQ(why.status, status);
    return status;
  });
}

TEST(CFailures, StreamsTellOfEachAllocationThatFails) {
  const std::string bytes = content(golden_folder() / "0.10" / "steps_and_extras.shm");
  with_little_memory([&] {
    shmf_decoder* decoder = nullptr;
    auto status = shmf_decoder_new(nullptr, &decoder, nullptr);
    if (status == SHMF_OK) status = shmf_decoder_feed(decoder, bytes.data(), bytes.size(), nullptr);
    if (status == SHMF_OK) status = shmf_decoder_feed(decoder, nullptr, 0, nullptr);
    shmf_item item{};
    item.struct_size = sizeof item;
    while (status == SHMF_OK && item.kind != SHMF_END)
      status = shmf_decoder_next(decoder, &item, nullptr);
    shmf_decoder_free(decoder);
    return status;
  });
}

TEST(CFailures, WritingTellsOfEachAllocationThatFails) {
  const double xyz[8][3] = {{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 1, 0},
                            {0, 0, 1}, {1, 0, 1}, {1, 1, 1}, {0, 1, 1}};
  const std::int32_t corners[8] = {0, 1, 2, 3, 4, 5, 6, 7};
  const float values[8] = {1, 2, 3, 4, 5, 6, 7, 8};
  with_little_memory([&] {
    shmf_writer* writer = nullptr;
    const auto forget = [](void*, const void*, std::uint64_t) { return 0; };
    auto status = shmf_writer_sink(forget, nullptr, nullptr, &writer, nullptr);
    shmf_block block{};
    block.struct_size = sizeof block;
    block.shape = SHMF_HEXAHEDRON;
    block.nodes_per_cell = 8;
    shmf_array array{};
    array.struct_size = sizeof array;
    array.name = "t";
    array.type = SHMF_FLOAT32;
    array.per_step = 1;
    shmf_target mesh[2] = {};
    for (shmf_target& target : mesh) target.struct_size = sizeof target;
    mesh[0].what = SHMF_POINTS;
    mesh[0].type = SHMF_FLOAT64;
    mesh[0].data = const_cast<double(*)[3]>(xyz);
    mesh[0].bytes = sizeof xyz;
    mesh[1].what = SHMF_CORNERS;
    mesh[1].type = SHMF_INT32;
    mesh[1].data = const_cast<std::int32_t*>(corners);
    mesh[1].bytes = sizeof corners;
    if (status == SHMF_OK) status = shmf_writer_block(writer, &block, nullptr);
    if (status == SHMF_OK) status = shmf_writer_array(writer, &array, nullptr);
    if (status == SHMF_OK) status = shmf_writer_mesh(writer, mesh, 2, nullptr);
    if (status == SHMF_OK)
      status = shmf_writer_values(writer, 0, 0, values, sizeof values, nullptr);
    if (status == SHMF_OK) status = shmf_writer_finish(writer, nullptr, nullptr);
    if (status != SHMF_OK && writer != nullptr) {
      // A writer that failed stays failed.
      EXPECT_EQ(shmf_writer_finish(writer, nullptr, nullptr), SHMF_NO_MEMORY);
    }
    shmf_writer_free(writer);
    return status;
  });
}

}  // namespace
}  // namespace shm
