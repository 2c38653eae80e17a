// Appends time steps to a damaged file. If the old file can be read completely and appending
// succeeds, the new file must be readable, and must contain the data of the old file and exactly
// the new steps that were passed. The first byte of the input chooses the appended data.
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <cstring>
#include <optional>
#include <span>
#include <vector>

#include "damaged_file.h"
#include "shm/appender.h"
#include "shm/mesh.h"

namespace {

using shm_fuzz::Bytes;

/// Returns the whole mesh of a file, or nothing if the file cannot be read.
std::optional<shm::Mesh> whole(std::span<const std::byte> file) {
  shm::MemorySource source(file);
  auto mesh = shm::read_mesh(source, shm_fuzz::small_limits());
  if (!mesh) return std::nullopt;
  return std::move(*mesh);
}

Bytes some_values(std::uint64_t elements, const shm::ArrayInfo& info, std::uint8_t how) {
  const std::size_t width = shm::scalar_bytes(info.type);
  Bytes values(static_cast<std::size_t>(elements) * info.components * width);
  for (std::size_t i = 0; i < values.size(); ++i)
    values[i] = static_cast<std::byte>(how % 2 == 0 ? how / 16 : i % width == 0 ? i / width : 0);
  return values;
}

/// Appends time steps to `old`, and writes the new file to `sink`. Returns false if the Appender
/// reports an error, e.g. because the old file is damaged or the limit for its data is reached.
bool append(shm::RandomSource& old, std::uint8_t how, shm::ByteSink& sink) {
  shm::AppendOptions options;
  options.level = static_cast<shm::Level>(how % 3);
  options.key_steps = how / 3 % 4;
  auto appender = shm::Appender::open(old, sink, options, shm_fuzz::small_limits());
  if (!appender) return false;
  if (how % 5 == 0) {
    auto rest = appender->without_steps();
    if (rest) {
      auto mesh = shm::read_mesh(**rest, shm_fuzz::small_limits());
      (void)mesh;
    }
  }
  const std::uint64_t first = appender->steps();
  for (std::uint64_t step = first; step < first + 1 + how % 2; ++step)
    for (std::uint32_t a = 0; a < appender->schema().arrays.size(); ++a) {
      const shm::ArrayInfo& info = appender->schema().arrays[a];
      const std::uint64_t elements = appender->elements(a);
      if (!info.per_step || elements > 1 << 16) continue;
      if (!appender->add_step_values(a, step, some_values(elements, info, how))) return false;
    }
  shm::Extra extra{"fuzz/extra", shm::ScalarType::uint8, shm::Reference::nothing, {3}, Bytes(3)};
  if (how % 7 == 0 && !appender->add_extra(extra)) return false;
  return bool(appender->finish());
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  if (size == 0) return 0;
  const auto all = std::as_bytes(std::span(data, size)).subspan(1);
  const Bytes old(all.begin(), all.end());
  shm::MemoryRandomSource source(old);
  shm::MemorySink sink;
  if (!append(source, data[0], sink)) return 0;
  const auto before = whole(old);
  // The Appender only copies some chunks, so it does not detect damage in them.
  if (!before) return 0;
  const auto after = whole(sink.bytes);
  if (!after || after->schema != before->schema || after->xyz != before->xyz ||
      after->corners != before->corners || after->arrays != before->arrays)
    std::abort();
  for (std::size_t a = 0; a < before->steps.size(); ++a)
    for (std::size_t s = 0; s < before->steps[a].size(); ++s)
      if (after->steps[a].size() <= s || after->steps[a][s] != before->steps[a][s]) std::abort();
  return 0;
}

extern "C" std::size_t LLVMFuzzerCustomMutator(std::uint8_t* data, std::size_t size,
                                               std::size_t max_size, unsigned seed) {
  return shm_fuzz::mutate_input(data, size, max_size, seed);
}
