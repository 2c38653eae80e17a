// Counts the effects of damage. Flips every single bit of each file, truncates the file at every
// byte, and reads each damaged file front to back and using its index. The result must be an error
// or exactly the same contents; any other result is counted as wrong data. Child processes read the
// damaged files, so that crashes and hangs are counted, too.
//   count_flips [--sample N] FILE.shm...   tests every N-th bit and truncation of each file
//   (default 1: all)
// Prints one JSON object. The exit code is 1 if any result was wrong. The program is run by hand
// and by scripts/trust.
#include <sys/mman.h>
#include <sys/wait.h>
#include <unistd.h>

#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <fstream>
#include <iterator>
#include <map>
#include <new>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "shm/segment_reader.h"
#include "shm/step_reader.h"
#include "support/item_text.h"

namespace {

using shm::ErrorCode;
using Bytes = std::vector<std::byte>;

/// Seconds after which a read counts as a hang. Reading one of these files normally takes
/// milliseconds.
constexpr unsigned kHangSeconds = 20;

/// The readable parts of a file: a map from the name of each part to its contents as text.
using Parts = std::map<std::string, std::string>;

void add_segments(shm::RandomSource& source, Parts& parts) {
  auto reader = shm::SegmentReader::open(source);
  if (!reader) return;
  for (std::size_t s = 0; s < reader->segments().size(); ++s) {
    auto blocks = reader->read(s);
    if (!blocks) continue;
    shm::Decoded decoded;
    decoded.schema = reader->schema();
    for (shm::MeshBlock& block : *blocks) decoded.items.push_back(std::move(block));
    parts["segment " + std::to_string(s)] = shm::ItemText::of(decoded);
  }
}

void add_steps(shm::RandomSource& source, Parts& parts) {
  auto reader = shm::StepReader::open(source);
  if (!reader) return;
  constexpr std::uint64_t kSteps = 6;  // more than the files have
  for (std::uint32_t a = 0; a < reader->schema().arrays.size(); ++a)
    for (std::uint64_t step = 0; step < kSteps; ++step) {
      shm::StepRequest request;
      request.array = a;
      request.step = step;
      const auto values = reader->read(request);
      if (!values) continue;
      std::string& text = parts["array " + std::to_string(a) + " step " + std::to_string(step)];
      for (const shm::StepValues& it : *values) {
        text += std::to_string(it.first) + ":";
        text.append(reinterpret_cast<const char*>(it.values.data()), it.values.size());
        for (const std::uint64_t number : it.numbers) text += "," + std::to_string(number);
      }
    }
}

/// Reads each part of a mesh separately, using the index of the file.
Parts parts_of(std::span<const std::byte> bytes) {
  Parts parts;
  shm::MemoryRandomSource source(bytes);
  add_segments(source, parts);
  add_steps(source, parts);
  return parts;
}

/// Returns the contents of a file as text, but without the number of bytes after its trailer, which
/// is not part of the contents.
shm::Result<std::string> text_of(std::span<const std::byte> bytes) {
  auto text = shm::text_of_file(bytes);
  if (!text) return text;
  const std::size_t at = text->rfind("trailing bytes ");
  if (at != std::string::npos) text->resize(at);
  return text;
}

struct Whole {
  std::string text;  // contents of the whole file as text, read front to back
  Parts parts;
  bool is_mesh = true;
  std::size_t end = 0;  // offset of the end of the trailer; parity may follow
};

struct Counts {
  std::uint64_t flips = 0, cuts = 0;   // finished or in progress
  std::uint64_t errors = 0, same = 0;  // results of reading front to back
  /// Number of parts that were read using the index and were correct, summed over all damaged
  /// files.
  std::uint64_t parts_same = 0;
  std::uint64_t wrong = 0, crashes = 0, hangs = 0;
  std::uint64_t slowest_nanoseconds = 0;
};

/// Reads the damaged file front to back and using its index, and counts the results.
void look_at(std::span<const std::byte> bytes, const Whole& whole, Counts& counts) {
  const auto begin = std::chrono::steady_clock::now();
  ::alarm(kHangSeconds);
  const bool is_cut = bytes.size() < whole.end;
  const auto text = text_of(bytes);
  if (!text) {
    const bool fits = !whole.is_mesh || !is_cut || text.error().code == ErrorCode::truncated;
    ++(fits && !text.error().detail.empty() ? counts.errors : counts.wrong);
  } else {
    ++(*text == whole.text && !is_cut ? counts.same : counts.wrong);
  }
  if (whole.is_mesh)
    for (const auto& [name, part] : parts_of(bytes)) {
      const auto expected = whole.parts.find(name);
      ++(expected != whole.parts.end() && expected->second == part ? counts.parts_same
                                                                   : counts.wrong);
    }
  ::alarm(0);
  const std::chrono::nanoseconds took = std::chrono::steady_clock::now() - begin;
  counts.slowest_nanoseconds =
      std::max(counts.slowest_nanoseconds, static_cast<std::uint64_t>(took.count()));
}

/// Tests case `n` of a file. The first cases flip one bit each, the remaining cases truncate the
/// file. Returns false if the file has no case `n`.
bool try_case(std::uint64_t n, const Bytes& file, const Whole& whole, std::uint64_t sample,
              Counts& counts) {
  const std::uint64_t flips = (file.size() * 8 + sample - 1) / sample;
  const std::uint64_t cuts = (file.size() + sample - 1) / sample;
  if (n >= flips + cuts) return false;
  if (n < flips) {
    Bytes bytes = file;  // with exactly its size
    const std::uint64_t bit = n * sample;
    bytes[bit / 8] ^= std::byte{1} << static_cast<int>(bit % 8);
    ++counts.flips;
    look_at(bytes, whole, counts);
  } else {
    const auto size = static_cast<std::ptrdiff_t>((n - flips) * sample);
    ++counts.cuts;
    look_at(Bytes(file.begin(), file.begin() + size), whole, counts);
  }
  return true;
}

/// Tests all cases of a file in child processes. If a child crashes, the crash is counted, and
/// another child continues with the next case.
bool try_file(const Bytes& file, std::uint64_t sample, Counts& counts) {
  Whole whole;
  const auto text = text_of(file);
  if (!text) return false;
  whole.text = *text;
  whole.is_mesh = !shm::looks_like_archive(file);
  whole.end = file.size();
  if (whole.is_mesh) {
    whole.parts = parts_of(file);
    const auto totals = shm::decode_in_pieces(file);
    if (totals) whole.end = std::get<shm::Totals>(totals->items.back()).total_bytes;
  }

  struct Shared {
    std::uint64_t next = 0;
    bool ended = false;
    Counts counts;
  };
  void* room =
      ::mmap(nullptr, sizeof(Shared), PROT_READ | PROT_WRITE, MAP_SHARED | MAP_ANONYMOUS, -1, 0);
  if (room == MAP_FAILED) return false;
  auto* shared = new (room) Shared;
  shared->counts = counts;
  while (!shared->ended) {
    const pid_t child = ::fork();
    if (child < 0) return false;
    if (child == 0) {
      while (try_case(shared->next++, file, whole, sample, shared->counts)) {
      }
      shared->ended = true;
      ::_exit(0);
    }
    int status = 0;
    if (::waitpid(child, &status, 0) != child) return false;
    if (shared->ended) break;
    ++(WIFSIGNALED(status) && WTERMSIG(status) == SIGALRM ? shared->counts.hangs
                                                          : shared->counts.crashes);
  }
  counts = shared->counts;
  ::munmap(room, sizeof(Shared));
  return true;
}

}  // namespace

int main(int argc, char** argv) {
  std::vector<std::string> paths(argv + 1, argv + argc);
  std::uint64_t sample = 1;
  if (paths.size() > 1 && paths[0] == "--sample") {
    sample = std::max(1ull, std::strtoull(paths[1].c_str(), nullptr, 10));
    paths.erase(paths.begin(), paths.begin() + 2);
  }
  if (paths.empty()) {
    std::fputs("usage: count_flips [--sample N] FILE.shm...\n", stderr);
    return 2;
  }
  Counts counts;
  for (const std::string& path : paths) {
    std::ifstream in(path, std::ios::binary);
    const std::string text{std::istreambuf_iterator<char>(in), {}};
    const auto bytes = std::as_bytes(std::span(text));
    if (!try_file(Bytes(bytes.begin(), bytes.end()), sample, counts)) {
      std::fprintf(stderr, "%s cannot be read as it is\n", path.c_str());
      return 2;
    }
  }
  std::printf(
      "{\"files\": %zu, \"flips\": %llu, \"cuts\": %llu, \"errors\": %llu, \"same\": %llu, "
      "\"parts_same\": %llu, \"wrong_data\": %llu, \"crashes\": %llu, \"hangs\": %llu, "
      "\"slowest_ms\": %.1f}\n",
      paths.size(), static_cast<unsigned long long>(counts.flips),
      static_cast<unsigned long long>(counts.cuts), static_cast<unsigned long long>(counts.errors),
      static_cast<unsigned long long>(counts.same),
      static_cast<unsigned long long>(counts.parts_same),
      static_cast<unsigned long long>(counts.wrong),
      static_cast<unsigned long long>(counts.crashes),
      static_cast<unsigned long long>(counts.hangs),
      static_cast<double>(counts.slowest_nanoseconds) / 1e6);
  return counts.wrong + counts.crashes + counts.hangs == 0 ? 0 : 1;
}
