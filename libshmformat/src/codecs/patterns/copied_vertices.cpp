#include "codecs/patterns/copied_vertices.h"

#include <algorithm>
#include <bit>
#include <cstring>

#include "base/number_map.h"
#include "codecs/patterns/byte_planes.h"

namespace shm {
namespace {

/// Copies are stored if at least one in kFewestCopies vertices is a copy. Only the first
/// kSampledVertices vertices are searched if fewer of them are copies, so that the search takes
/// little time in most meshes.
constexpr std::size_t kFewestCopies = 8, kSampledVertices = 512;

bool are_few(std::size_t copies, std::size_t vertices) { return copies * kFewestCopies < vertices; }

/// Hash table of vertices with open addressing. It contains the most recent vertex with each value.
class RecentVertices {
 public:
  RecentVertices(const std::byte* values, std::size_t stride, std::size_t bytes, std::size_t count)
      : values_(values), stride_(stride), bytes_(bytes), table_(std::bit_ceil(2 * count + 1)) {}

  /// Returns the most recent vertex with the same values as vertex `i`, or `i` if none exists.
  /// Replaces it by vertex `i`.
  std::size_t exchange(std::size_t i) {
    std::size_t position = static_cast<std::size_t>(hash(i)) & (table_.size() - 1);
    while (table_[position] != 0 &&
           std::memcmp(vertex(table_[position] - std::size_t{1}), vertex(i), bytes_) != 0)
      position = (position + 1) & (table_.size() - 1);
    const std::size_t recent = table_[position] == 0 ? i : table_[position] - std::size_t{1};
    table_[position] = static_cast<std::uint32_t>(i + 1);
    return recent;
  }

 private:
  const std::byte* vertex(std::size_t i) const { return values_ + i * stride_; }
  std::uint64_t hash(std::size_t i) const {
    std::uint64_t hash = 0;
    for (std::size_t b = 0; b < bytes_; b += 8) {
      std::uint64_t word = 0;
      std::memcpy(&word, vertex(i) + b, std::min<std::size_t>(8, bytes_ - b));
      hash = scatter_(word ^ hash << 32);
    }
    return hash;
  }

  const std::byte* values_;
  std::size_t stride_, bytes_;
  std::vector<std::uint32_t> table_;  // number of a vertex plus 1, or 0 if the entry is free
  Scatter scatter_;
};

}  // namespace

std::size_t CopiedVertices::count_own(std::size_t first, std::size_t count) const {
  const auto begin = back_.begin() + static_cast<std::ptrdiff_t>(first);
  return static_cast<std::size_t>(
      std::count(begin, begin + static_cast<std::ptrdiff_t>(count), std::uint32_t{0}));
}

void CopiedVertices::find(const std::byte* values, std::size_t stride, std::size_t bytes,
                          std::size_t count) {
  back_.clear();
  for (const std::size_t searched : {std::min(count, kSampledVertices), count}) {
    RecentVertices recent(values, stride, bytes, searched);
    std::size_t copies = 0;
    back_.resize(searched);
    for (std::size_t i = 0; i < searched; ++i) {
      const std::size_t back = i - recent.exchange(i);
      back_[i] = back <= kFarthest ? static_cast<std::uint32_t>(back) : 0;
      copies += back_[i] > 0;
    }
    if (searched == 0 || are_few(copies, searched)) return back_.clear();
    if (searched == count) return;
  }
}

void CopiedVertices::put(ByteWriter& out, std::vector<std::byte>& scratch,
                         ZstdCompressor& zstd) const {
  out.put_u8(kCopiedVertices);
  put_numbers(out, back_, scratch, zstd);
}

void CopiedVertices::clear_copies(std::span<std::uint64_t> residuals) const {
  for (std::size_t i = 0; i < back_.size(); ++i)
    if (back_[i] > 0) residuals[i] = 0;
}

void CopiedVertices::remove_copies(std::vector<std::uint64_t>& residuals) const {
  if (empty()) return;
  std::size_t own = 0;
  for (std::size_t i = 0; i < residuals.size(); ++i)
    if (back_[i] == 0) residuals[own++] = residuals[i];
  residuals.resize(own);
}

bool CopiedVertices::get(ByteReader& in, std::uint64_t count, std::vector<std::byte>& scratch,
                         ZstdDecompressor& zstd) {
  if (!get_numbers(in, count, back_, scratch, zstd)) return false;
  for (std::size_t i = 0; i < back_.size(); ++i)
    if (back_[i] > i || back_[i] > kFarthest) return false;
  return true;
}

void CopiedVertices::insert_copies(std::size_t first, std::span<std::uint64_t> residuals) const {
  std::size_t own = count_own(first, residuals.size());
  for (std::size_t i = residuals.size(); i-- > 0;)
    residuals[i] = back_[first + i] == 0 ? residuals[--own] : 0;
}

}  // namespace shm
