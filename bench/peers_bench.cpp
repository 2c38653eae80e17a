// peers_bench --type TYPE [--components N] [--steps N] [--seconds S] [--quick] [--bound B]... FILE:
// compresses one raw array with other compressors, and prints a line of JSON for each compressor.
// Without --bound, only lossless compressors are used. With --bound, the compressors may have
// errors of at most B. Reports the CPU time of the fastest run in S seconds, in memory and in one
// thread. All results are decoded and compared with the original array.
//   zstd, xz, blosc   pack the bytes unchanged, or as byte planes ("shuffle")
//   fpzip, zfp, SZ    pack one component after the other; the time to transpose the array is
//                     included. For fpzip, the time steps are a second dimension
// "SZ-like" is our own code, because no package exists. It codes the difference between a value and
// the previous restored value, in units of twice the bound; zstd -19 compresses the byte planes of
// these differences. Values whose errors would exceed the bound are stored exactly.
#include <fpzip.h>
#include <lzma.h>
#include <zfp.h>

#include <charconv>
#include <cmath>
#include <cstddef>
#include <cstring>
#include <iterator>
#include <limits>
#include <memory>
#include <span>
#include <stdexcept>
#include <string_view>
#include <vector>

#include "measure.h"
#include "options.h"
#include "raw_packers.h"

namespace shm::bench {
namespace {

/// The values of an array. They are sorted by step, then by element, then by component.
struct RawArray {
  std::vector<std::byte> bytes;
  std::size_t value_bytes = 4, components = 1, steps = 1;
  bool floats = true;
  std::size_t values() const { return bytes.size() / value_bytes; }
};

/// A compressor. `encode` and `decode` return the number of bytes written, and throw an exception
/// if they fail.
struct Peer {
  std::string name;
  std::size_t room;  ///< maximum size of the packed array
  std::function<std::size_t(Bytes, Room)> encode, decode;
};

/// to_components() transposes an array: it stores the first component of all elements at all steps,
/// then the second component, and so on. from_components() restores the array.
template <class T>
void to_components(Bytes in, std::size_t components, T* out) {
  const std::size_t count = in.size() / sizeof(T) / components;
  for (std::size_t c = 0; c < components; ++c)
    for (std::size_t i = 0; i < count; ++i)
      std::memcpy(out + c * count + i, in.data() + (i * components + c) * sizeof(T), sizeof(T));
}
template <class T>
void from_components(std::span<const T> in, std::size_t components, std::byte* out) {
  const std::size_t count = in.size() / components;
  for (std::size_t c = 0; c < components; ++c)
    for (std::size_t i = 0; i < count; ++i)
      std::memcpy(out + (i * components + c) * sizeof(T), &in[c * count + i], sizeof(T));
}

Peer zstd_peer(const RawArray& array, int level, bool shuffle) {
  const std::string name = "zstd -" + std::to_string(level);
  const std::size_t room = ZSTD_compressBound(array.bytes.size());
  if (!shuffle)
    return {name, room, [=](Bytes in, Room out) { return zstd_pack(in, out, level); }, zstd_unpack};
  const std::size_t width = array.value_bytes;
  return {name + " shuffle", room,
          [=](Bytes in, Room out) {
            std::vector<std::byte> planes(in.size());
            to_planes(in, width, planes.data());
            return zstd_pack(planes, out, level);
          },
          [=](Bytes in, Room out) {
            std::vector<std::byte> planes(out.size());
            const std::size_t size = zstd_unpack(in, planes);
            from_planes(Bytes(planes).first(size), width, out.data());
            return size;
          }};
}

Peer xz_peer(const RawArray& array) {
  const auto as_bytes = [](const std::byte* at) {
    return reinterpret_cast<const std::uint8_t*>(at);
  };
  return {"xz -6", lzma_stream_buffer_bound(array.bytes.size()),
          [=](Bytes in, Room out) {
            std::size_t size = 0;
            const auto code = lzma_easy_buffer_encode(
                6, LZMA_CHECK_CRC64, nullptr, as_bytes(in.data()), in.size(),
                reinterpret_cast<std::uint8_t*>(out.data()), &size, out.size());
            return checked(size, code == LZMA_OK);
          },
          [=](Bytes in, Room out) {
            std::uint64_t limit = std::numeric_limits<std::uint64_t>::max();
            std::size_t from = 0, size = 0;
            const auto code = lzma_stream_buffer_decode(
                &limit, 0, nullptr, as_bytes(in.data()), &from, in.size(),
                reinterpret_cast<std::uint8_t*>(out.data()), &size, out.size());
            return checked(size, code == LZMA_OK);
          }};
}

Peer blosc_peer(const RawArray& array) {
  return {"blosc shuffle zstd", array.bytes.size() + BLOSC_MAX_OVERHEAD,
          [width = array.value_bytes](Bytes in, Room out) { return blosc_pack(in, width, out); },
          blosc_unpack};
}

template <class T>
Peer fpzip_peer(const RawArray& array) {
  const std::size_t components = array.components, steps = array.steps, count = array.values();
  return {"fpzip", 2 * array.bytes.size() + 4096,
          [=](Bytes in, Room out) {
            std::vector<T> planes(count);
            to_components(in, components, planes.data());
            FPZ* fpz = fpzip_write_to_buffer(out.data(), out.size());
            fpz->type = sizeof(T) == 8 ? FPZIP_TYPE_DOUBLE : FPZIP_TYPE_FLOAT;
            fpz->prec = 0;
            fpz->nx = static_cast<int>(count / components / steps);
            fpz->ny = static_cast<int>(steps);
            fpz->nz = 1;
            fpz->nf = static_cast<int>(components);
            const std::size_t size = fpzip_write_header(fpz) ? fpzip_write(fpz, planes.data()) : 0;
            fpzip_write_close(fpz);
            return checked(size, size > 0);
          },
          [=](Bytes in, Room out) {
            std::vector<T> planes(count);
            FPZ* fpz = fpzip_read_from_buffer(in.data());
            const bool good = fpzip_read_header(fpz) && fpzip_read(fpz, planes.data());
            fpzip_read_close(fpz);
            checked(0, good);
            from_components<T>(planes, components, out.data());
            return out.size();
          }};
}

// --- zfp, in its one-dimensional form

struct ZfpClose {
  void operator()(zfp_stream* stream) const { zfp_stream_close(stream); }
  void operator()(zfp_field* field) const { zfp_field_free(field); }
  void operator()(bitstream* bits) const { stream_close(bits); }
};
template <class T>
std::size_t zfp_code(T* values, std::size_t count, double bound, Room buffer, bool encode) {
  const std::unique_ptr<bitstream, ZfpClose> bits(stream_open(buffer.data(), buffer.size()));
  const std::unique_ptr<zfp_stream, ZfpClose> stream(zfp_stream_open(bits.get()));
  const std::unique_ptr<zfp_field, ZfpClose> field(
      zfp_field_1d(values, sizeof(T) == 8 ? zfp_type_double : zfp_type_float, count));
  zfp_stream_set_accuracy(stream.get(), bound);
  zfp_stream_rewind(stream.get());
  const std::size_t size =
      encode ? zfp_compress(stream.get(), field.get()) : zfp_decompress(stream.get(), field.get());
  return checked(size, size > 0);
}

template <class T>
Peer zfp_peer(const RawArray& array, double bound) {
  const std::size_t components = array.components, count = array.values();
  return {"zfp 1-D", 2 * array.bytes.size() + 4096,
          [=](Bytes in, Room out) {
            std::vector<T> planes(count);
            to_components(in, components, planes.data());
            return zfp_code(planes.data(), count, bound, out, true);
          },
          [=](Bytes in, Room out) {
            std::vector<T> planes(count);
            // the cast is safe, because zfp only reads the packed data
            const Room packed(const_cast<std::byte*>(in.data()), in.size());
            zfp_code(planes.data(), count, bound, packed, false);
            from_components<T>(planes, components, out.data());
            return out.size();
          }};
}

// --- SZ-like

constexpr std::int32_t kEscape = std::numeric_limits<std::int32_t>::min();

/// Returns the restored value: the previous restored value `last` plus `steps` quantization steps
/// of size `step`.
template <class T>
T moved(T last, std::int32_t steps, double step) {
  return static_cast<T>(static_cast<double>(last) + steps * step);
}
template <class T>
T prediction_from(T value) {
  return std::isfinite(value) ? value : T{0};
}

/// Returns the size of a quantization step. It is slightly less than twice the bound, because
/// rounding the restored value to T adds an error.
template <class T>
double sz_step(std::span<const T> values, double bound) {
  double largest = 0;
  for (const T value : values)
    if (std::isfinite(value)) largest = std::max(largest, std::fabs(static_cast<double>(value)));
  const double rounding = largest * static_cast<double>(std::numeric_limits<T>::epsilon()) / 2;
  return 2 * std::max(bound - rounding, bound / 2);
}

/// Packs an array. The result contains the size of a quantization step, the byte planes of `codes`,
/// and the values that are stored exactly.
template <class T>
std::size_t sz_encode(Bytes in, std::size_t components, double bound, Room out) {
  std::vector<T> values(in.size() / sizeof(T)), exact;
  to_components(in, components, values.data());
  std::vector<std::int32_t> codes(values.size());
  const double step = sz_step<T>(values, bound);
  T last = 0;
  for (std::size_t i = 0; i < values.size(); ++i) {
    const double away =
        std::round((static_cast<double>(values[i]) - static_cast<double>(last)) / step);
    const bool near = std::fabs(away) < 1e9;
    const auto steps = near ? static_cast<std::int32_t>(away) : 0;
    const T restored = moved(last, steps, step);
    if (near &&
        std::fabs(static_cast<double>(restored) - static_cast<double>(values[i])) <= bound) {
      // maps small negative numbers to small codes, too, so that the high byte planes are 0
      codes[i] = steps < 0 ? -2 * steps - 1 : 2 * steps;
      last = restored;
    } else {
      codes[i] = kEscape;
      exact.push_back(values[i]);
      last = prediction_from(values[i]);
    }
  }
  const std::size_t planes_bytes = codes.size() * sizeof codes[0];
  std::vector<std::byte> parts(sizeof step + planes_bytes + exact.size() * sizeof(T));
  std::memcpy(parts.data(), &step, sizeof step);
  to_planes(std::as_bytes(std::span(codes)), sizeof codes[0], parts.data() + sizeof step);
  if (!exact.empty())
    std::memcpy(parts.data() + sizeof step + planes_bytes, exact.data(), exact.size() * sizeof(T));
  return zstd_pack(parts, out, 19);
}

template <class T>
std::size_t sz_decode(Bytes in, std::size_t components, Room out) {
  std::vector<T> values(out.size() / sizeof(T));
  std::vector<std::int32_t> codes(values.size());
  const std::size_t planes_bytes = codes.size() * sizeof codes[0];
  double step = 0;
  std::vector<std::byte> parts(sizeof step + planes_bytes + out.size());
  zstd_unpack(in, parts);
  std::memcpy(&step, parts.data(), sizeof step);
  from_planes(Bytes(parts).subspan(sizeof step, planes_bytes), sizeof codes[0],
              std::as_writable_bytes(std::span(codes)).data());
  const std::byte* exact = parts.data() + sizeof step + planes_bytes;
  T last = 0;
  for (std::size_t i = 0; i < values.size(); ++i) {
    const std::int32_t s = codes[i];
    if (s == kEscape) {
      std::memcpy(&values[i], exact, sizeof(T));
      exact += sizeof(T);
      last = prediction_from(values[i]);
    } else {
      last = values[i] = moved(last, s % 2 != 0 ? -(s + 1) / 2 : s / 2, step);
    }
  }
  from_components<T>(values, components, out.data());
  return out.size();
}

template <class T>
Peer sz_peer(const RawArray& array, double bound) {
  return {"SZ-like", ZSTD_compressBound(8 + array.values() * (4 + sizeof(T))),
          [=, n = array.components](Bytes in, Room out) { return sz_encode<T>(in, n, bound, out); },
          [n = array.components](Bytes in, Room out) { return sz_decode<T>(in, n, out); }};
}

// --- measuring

/// Measures one compressor, and prints the results. `bound` is the largest allowed error. If it is
/// 0, the compressor must be lossless.
void measure(const RawArray& array, const Peer& peer, double bound, double seconds) {
  const auto room = std::make_unique_for_overwrite<std::byte[]>(peer.room);
  std::vector<std::byte> back(array.bytes.size());
  std::size_t size = 0;
  const auto encode = [&] { size = peer.encode(array.bytes, {room.get(), peer.room}); };
  const auto decode = [&] { peer.decode({room.get(), size}, back); };
  double write = 0, read = 0;
  const std::uint64_t write_memory = memory_of([&] { write = seconds_of(encode); });
  const std::uint64_t read_memory = memory_of([&] { read = seconds_of(decode); });
  double error = 0;
  if (bound > 0)
    error = array.value_bytes == 8 ? largest_error<double>(array.bytes, back)
                                   : largest_error<float>(array.bytes, back);
  else if (back != array.bytes)
    throw std::runtime_error(peer.name + ": the decoded array differs");
  // A slow compressor is run only once.
  if (write < seconds) write = quickest(seconds - write, encode);
  if (read < seconds) read = quickest(seconds - read, decode);
  std::printf(
      "{\"name\": \"%s\", \"bytes\": %zu, \"encode_s\": %.9f, \"decode_s\": %.9f, "
      "\"encode_memory\": %llu, \"decode_memory\": %llu, \"bound\": %.17g, \"max_error\": %.17g}\n",
      peer.name.c_str(), size, write, read, static_cast<unsigned long long>(write_memory),
      static_cast<unsigned long long>(read_memory), bound, error);
}

std::vector<Peer> lossless_peers(const RawArray& array, bool quick) {
  std::vector<Peer> peers;
  for (const int level : {3, 19})
    for (const bool shuffle : {false, true})
      if (level == 3 || !quick) peers.push_back(zstd_peer(array, level, shuffle));
  peers.push_back(xz_peer(array));
  peers.push_back(blosc_peer(array));
  if (array.floats)
    peers.push_back(array.value_bytes == 8 ? fpzip_peer<double>(array) : fpzip_peer<float>(array));
  return peers;
}
std::vector<Peer> lossy_peers(const RawArray& array, double bound) {
  if (array.value_bytes == 8)
    return {zfp_peer<double>(array, bound), sz_peer<double>(array, bound)};
  return {zfp_peer<float>(array, bound), sz_peer<float>(array, bound)};
}

RawArray load(const std::string& path, std::string_view type) {
  RawArray array;
  std::ifstream file(path, std::ios::binary);
  const std::string text((std::istreambuf_iterator<char>(file)), {});
  if (!file || text.empty()) throw std::runtime_error(path + ": cannot be read, or is empty");
  array.bytes.resize(text.size());
  std::memcpy(array.bytes.data(), text.data(), text.size());
  array.floats = type.starts_with("float");
  const std::size_t digits = type.find_first_of("0123456789");
  std::size_t bits = 0;
  if (digits < type.size()) std::from_chars(type.data() + digits, type.data() + type.size(), bits);
  if (bits != 8 && bits != 16 && bits != 32 && bits != 64)
    throw std::runtime_error("--type: int8 to uint64, float32 or float64");
  array.value_bytes = bits / 8;
  return array;
}

void run(int argc, char** argv) {
  std::string type;
  std::size_t components = 1, steps = 1;
  double seconds = .3;
  bool quick = false;
  std::vector<double> bounds;
  const std::string path = parse_options(argc, argv,
                                         {{"--type", type},
                                          {"--components", components},
                                          {"--steps", steps},
                                          {"--seconds", seconds},
                                          {"--bound", bounds},
                                          {"--quick", quick}});
  RawArray array = load(path, type);
  array.components = components;
  array.steps = steps;
  if (components == 0 || steps == 0 ||
      array.bytes.size() % (array.value_bytes * components * steps) != 0)
    throw std::runtime_error(path + ": the size does not match components and steps");
  const auto try_peer = [&](const Peer& peer, double bound) {
    try {
      measure(array, peer, bound, seconds);
    } catch (const std::exception& error) {
      std::printf("{\"name\": \"%s\", \"failed\": \"%s\"}\n", peer.name.c_str(), error.what());
    }
  };
  if (bounds.empty())
    for (const Peer& peer : lossless_peers(array, quick)) try_peer(peer, 0);
  for (const double bound : bounds)
    for (const Peer& peer : lossy_peers(array, bound)) try_peer(peer, bound);
}

}  // namespace
}  // namespace shm::bench

int main(int argc, char** argv) {
  try {
    shm::bench::run(argc, argv);
  } catch (const std::exception& error) {
    std::fprintf(stderr, "peers_bench: %s\n", error.what());
    return 1;
  }
  return 0;
}
