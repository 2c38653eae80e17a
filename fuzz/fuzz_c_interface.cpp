// Opens damaged files through the C interface, and calls its functions in any order. A file is in
// memory, or comes from a source that fails, reports a wrong size, or returns different bytes when
// it is read again. The memory that the caller provides for read data (a shmf_target) may be too
// small. A call must return a status and, if it succeeds, valid results. It must never crash, and
// never write beyond the memory of a target. The first byte of the input chooses the calls.
#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <cstring>
#include <memory>
#include <random>
#include <span>
#include <vector>

#include "damaged_file.h"
#include "shmformat.h"

namespace {

void expect(bool holds) {
  if (!holds) std::abort();
}

template <class Struct>
Struct sized() {
  Struct made{};
  made.struct_size = sizeof made;
  return made;
}

/// A caller's source (shmf_source) that may fail, return changed data, or report a wrong size.
struct Fetched {
  std::span<const std::uint8_t> bytes;
  std::uint64_t reads_left = ~std::uint64_t{0};
  bool changes = false;
  int closed = 0;

  shmf_source source(std::int64_t more) {
    auto own = sized<shmf_source>();
    own.context = this;
    own.bytes = bytes.size() + static_cast<std::uint64_t>(more);
    own.read_at = [](void* context, std::uint64_t offset, void* into, std::uint64_t count, char*,
                     size_t) { return static_cast<Fetched*>(context)->read(offset, into, count); };
    own.close = [](void* context) { ++static_cast<Fetched*>(context)->closed; };
    own.prefetch = [](void* context, const shmf_range* ranges, size_t count) {
      expect(context != nullptr && count > 0 && ranges[count - 1].bytes + 1 > 0);
    };
    return own;
  }
  int read(std::uint64_t offset, void* into, std::uint64_t count) {
    if (reads_left-- == 0 || offset > bytes.size() || count > bytes.size() - offset) return 1;
    std::memcpy(into, bytes.data() + offset, count);
    if (changes && count > 0) static_cast<std::uint8_t*>(into)[count / 2] ^= 1;
    return 0;
  }
};

/// A shmf_target for shmf_read() with random members. Its memory has exactly the size that it
/// states, so that sanitizers detect a write beyond its end.
class Wanted {
 public:
  Wanted(std::mt19937& random, std::uint32_t arrays) {
    target_ = sized<shmf_target>();
    target_.what = static_cast<std::int32_t>(random() % 10);
    target_.type = static_cast<std::int32_t>(random() % 12);
    if (random() % 4 != 0) {  // in most cases, choose the `type` that is valid for `what`
      constexpr std::int32_t kTypes[] = {
          0,          SHMF_FLOAT64, SHMF_INT32,  SHMF_INT64,   SHMF_UINT32,
          SHMF_UINT8, SHMF_INT64,   SHMF_UINT64, SHMF_FLOAT64, 0};
      target_.type = kTypes[target_.what];
    }
    target_.array = arrays == 0 ? 0 : random() % (arrays + 1);
    target_.step = random() % 3;
    target_.flags = random() % 2;
  }
  shmf_target& target() { return target_; }
  void give_room(std::uint64_t bytes) {
    room_ = std::make_unique<std::uint8_t[]>(static_cast<std::size_t>(bytes));
    target_.data = room_.get();
    target_.bytes = bytes;
  }

 private:
  shmf_target target_;
  std::unique_ptr<std::uint8_t[]> room_;
};

/// Called after a successful call. If the target received corners (SHMF_CORNERS), checks that each
/// is a valid vertex index. If it received the first corner of each cell (SHMF_CORNER_BEGIN),
/// checks that these offsets are in range and ascend.
void judge(const shmf_target& target, const shmf_counts& counts) {
  const auto end = target.what == SHMF_CORNERS ? counts.vertices : counts.corners + 1;
  const auto* numbers = static_cast<const std::int64_t*>(target.data);
  if (target.type != SHMF_INT64 ||
      (target.what != SHMF_CORNERS && target.what != SHMF_CORNER_BEGIN))
    return;
  for (std::uint64_t i = 0; i < target.used / 8; ++i) {
    expect(numbers[i] >= 0 && static_cast<std::uint64_t>(numbers[i]) < end);
    expect(target.what == SHMF_CORNERS || i == 0 || numbers[i - 1] <= numbers[i]);
  }
}

void read_some(shmf_file* file, std::mt19937& random, std::uint32_t arrays,
               const shmf_run_options* run) {
  // limit on the memory for a target, because a damaged file may claim any size
  constexpr std::uint64_t kMostBytes = 1 << 24;
  auto counts = sized<shmf_counts>();
  auto selection = sized<shmf_selection>();
  const std::uint32_t block = random() % 3;
  const bool piece = random() % 2 == 0;
  if (random() % 2 == 0) selection.end_cell = 1 + random() % 30;
  if (random() % 2 == 0) {
    selection.blocks = &block;
    selection.block_count = 1;
  }
  const std::uint64_t numbers[] = {1, 3, 4, random() % 40};
  if (random() % 4 == 0) {
    selection.numbers = numbers;
    selection.number_count = 4;
  }
  if (random() % 2 == 0) {
    selection.has_box = 1;
    const double box[6] = {-.5, -.5, -.5, .5, .5, random() % 8 * .25};
    std::copy(box, box + 6, selection.box);
  }
  shmf_error why{};
  if (shmf_select(file, piece ? &selection : nullptr, run, &counts, &why) != SHMF_OK) {
    expect(why.message[0] != 0);
    return;
  }
  std::vector<Wanted> wanted;
  std::vector<shmf_target> targets;
  for (std::uint32_t i = random() % 6 + 1; i > 0; --i) {
    Wanted one(random, arrays);
    const bool ok = shmf_read(file, &one.target(), 1, run, nullptr) == SHMF_OK;
    if (one.target().used > kMostBytes) continue;
    const std::uint64_t few = random() % 8 == 0 ? random() % 9 : 0;
    if (ok || random() % 4 == 0)
      one.give_room(one.target().used - std::min(few, one.target().used));
    targets.push_back(one.target());
    wanted.push_back(std::move(one));
  }
  if (shmf_read(file, targets.data(), targets.size(), run, &why) != SHMF_OK) return;
  for (const shmf_target& target : targets) {
    expect(target.data == nullptr || target.used <= target.bytes);
    if (target.data != nullptr) judge(target, counts);
  }
}

void find_boundary(shmf_file* file, std::mt19937& random, const shmf_run_options* run) {
  const auto array = static_cast<std::uint32_t>(random() % 4);
  const std::uint32_t arrays[] = {array, 0};
  const std::uint64_t steps[] = {random() % 3, 0};
  auto options = sized<shmf_boundary_options>();
  options.arrays = arrays;
  options.steps = random() % 2 == 0 ? steps : nullptr;
  options.array_count = random() % 3;
  options.max_bytes = 1 << 24;
  shmf_boundary* boundary = nullptr;
  shmf_error why{};
  const auto status = shmf_find_boundary(file, &options, run, &boundary, &why);
  expect((status == SHMF_OK) == (boundary != nullptr));
  expect(status == SHMF_OK || why.message[0] != 0);
  auto surface = sized<shmf_surface>();
  if (boundary == nullptr) return;
  expect(shmf_get_surface(boundary, &surface, nullptr) == SHMF_OK);
  expect(surface.face_begin[surface.faces] == surface.corners);
  for (std::uint64_t i = 0; i < surface.corners; ++i)
    expect(surface.face_corners[i] < surface.vertices);
  shmf_boundary_free(boundary);
}

void ask(shmf_file* file, std::mt19937& random) {
  auto info = sized<shmf_info>();
  const bool known = shmf_get_info(file, &info, nullptr) == SHMF_OK;
  std::uint64_t ended = random() % 40;
  auto run = sized<shmf_run_options>();
  run.context = &ended;
  run.threads = random() % 4;
  run.progress = [](void* context, double done) {
    expect(done >= 0 && done <= 1);
    return (*static_cast<std::uint64_t*>(context))-- == 0 ? 1 : 0;
  };
  const shmf_run_options* const watched = random() % 3 == 0 ? &run : nullptr;
  for (int calls = 0; calls < 6; ++calls) {
    const std::uint32_t i = random() % 4;
    std::uint64_t count = 0;
    const std::uint64_t* steps = nullptr;
    const double* times = nullptr;
    auto block = sized<shmf_block>();
    auto array = sized<shmf_array>();
    auto segment = sized<shmf_segment>();
    auto extra = sized<shmf_extra>();
    auto set = sized<shmf_set>();
    switch (random() % 10) {
      case 0: shmf_get_block(file, i, &block, nullptr); break;
      case 1: shmf_get_array(file, i, &array, nullptr); break;
      case 2: shmf_get_segment(file, i, &segment, nullptr); break;
      case 3: shmf_get_times(file, &times, &count, nullptr); break;
      case 4:
        if (shmf_get_steps(file, i, &steps, &count, nullptr) == SHMF_OK)
          expect(std::is_sorted(steps, steps + count));
        break;
      case 5: shmf_get_extra(file, i, &extra, nullptr); break;
      case 6: shmf_get_set(file, i, &set, nullptr); break;
      case 7: shmf_verify(file, watched, nullptr); break;
      case 8: find_boundary(file, random, watched); break;
      default: read_some(file, random, known ? info.arrays : 3, watched);
    }
  }
}

/// Opens the file from memory or from a source, depending on `how`, and makes random calls.
void open_and_ask(std::span<const std::uint8_t> bytes, std::uint8_t how) {
  std::mt19937 random(how);
  auto options = sized<shmf_open_options>();
  const shm::ReadLimits small = shm_fuzz::small_limits();
  options.max_active_vertices = small.max_active_vertices;
  options.max_chunk_bytes = options.max_extra_bytes = options.max_group_bytes = 1 << 22;
  options.max_arrays = options.max_blocks = 256;
  options.damaged = random() % 4 == 0 ? 1 : 0;
  shmf_file* file = nullptr;
  shmf_error why{};
  Fetched fetched{bytes};
  const bool from_functions = random() % 2 == 0;
  if (random() % 4 == 0) fetched.reads_left = random() % 20;
  fetched.changes = random() % 8 == 0;
  const auto more = random() % 8 == 0 ? static_cast<std::int64_t>(random() % 64) - 32 : 0;
  const shmf_source source =
      fetched.source(std::max(more, -static_cast<std::int64_t>(bytes.size())));
  const shmf_status status =
      from_functions ? shmf_open_source(&source, &options, &file, &why)
                     : shmf_open_memory(bytes.data(), bytes.size(), &options, &file, &why);
  expect((status == SHMF_OK) == (file != nullptr));
  expect(status == SHMF_OK || (why.status == status && why.message[0] != 0));
  if (file != nullptr) {
    shmf_file* member = nullptr;
    if (shmf_member_count(file) > 0 &&
        shmf_open_member(file, random() % 3, &options, &member, nullptr) == SHMF_OK) {
      shmf_close(file);
      file = member;
    }
    ask(file, random);
    shmf_close(file);
  }
  expect(fetched.closed == (from_functions ? 1 : 0));
}

/// Decodes the file with a shmf_decoder, in pieces of `piece` bytes, until its end or the first
/// failure.
void decode(std::span<const std::uint8_t> bytes, std::size_t piece) {
  shmf_decoder* decoder = nullptr;
  auto options = sized<shmf_open_options>();
  options.max_active_vertices = 1 << 16;
  options.max_chunk_bytes = options.max_extra_bytes = options.max_group_bytes = 1 << 22;
  expect(shmf_decoder_new(&options, &decoder, nullptr) == SHMF_OK);
  auto item = sized<shmf_item>();
  while (shmf_decoder_next(decoder, &item, nullptr) == SHMF_OK && item.kind != SHMF_END) {
    if (item.kind == SHMF_MESH) expect(item.corner_begin[0] == 0);
    if (item.kind != SHMF_NEED_INPUT) continue;
    const auto some = bytes.first(std::min(piece, bytes.size()));
    bytes = bytes.subspan(some.size());
    if (shmf_decoder_feed(decoder, some.data(), some.size(), nullptr) != SHMF_OK) break;
  }
  shmf_decoder_free(decoder);
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  if (size == 0) return 0;
  const std::span<const std::uint8_t> file(data + 1, size - 1);
  for (int more = 0; more < 3; ++more)
    open_and_ask(file, static_cast<std::uint8_t>(data[0] + more * 85));
  decode(file, 1 + data[0] * 7u);
  return 0;
}

extern "C" std::size_t LLVMFuzzerCustomMutator(std::uint8_t* data, std::size_t size,
                                               std::size_t max_size, unsigned seed) {
  return shm_fuzz::mutate_input(data, size, max_size, seed);
}
