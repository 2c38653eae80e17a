// Reads arbitrary bytes as an Exodus file. The result must be a complete mesh or a Failure. The
// mutator parses the header of a classic netCDF file. It damages dimensions, attributes, types or
// offsets in the header, or numbers in the data, and writes the file again. The header remains
// well-formed, so that the damage passes the checks of the netCDF library itself and reaches the
// code that runs after them.
//
// HDF5 files (netCDF-4) are skipped, because the HDF5 library crashes on some hostile files, and
// its behaviour is not tested (see README.md).
#include "exodus/exodus.h"

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <random>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "base/failure.h"
#include "base/spool.h"
#include "memory_file.h"
#include "read_everything.h"

extern "C" std::size_t LLVMFuzzerMutate(std::uint8_t* data, std::size_t size, std::size_t max_size);

namespace {

using Random = std::minstd_rand;
using Bytes = std::vector<std::uint8_t>;

/// Reads big-endian numbers from the header of a classic netCDF file. Returns 0 after the end of
/// the file.
class Input {
 public:
  explicit Input(std::span<const std::uint8_t> bytes) : bytes_(bytes) {}
  std::uint64_t number(std::size_t width) {
    std::uint64_t value = 0;
    for (std::size_t i = 0; i < width; ++i) value = value << 8 | byte();
    return value;
  }
  Bytes bytes(std::uint64_t count) {
    Bytes out;
    for (std::uint64_t i = 0; i < count && good_; ++i) out.push_back(byte());
    return out;
  }
  void align() {
    while (at_ % 4 != 0) ++at_;
  }
  std::size_t at() const { return at_; }
  bool good() const { return good_; }

 private:
  std::uint8_t byte() {
    if (at_ < bytes_.size()) return bytes_[at_++];
    good_ = false;
    return 0;
  }
  std::span<const std::uint8_t> bytes_;
  std::size_t at_ = 0;
  bool good_ = true;
};

class Output {
 public:
  void number(std::uint64_t value, std::size_t width) {
    for (std::size_t i = width; i-- > 0;)
      bytes.push_back(static_cast<std::uint8_t>(value >> 8 * i));
  }
  void add(std::span<const std::uint8_t> more) {
    bytes.insert(bytes.end(), more.begin(), more.end());
  }
  void align() {
    while (bytes.size() % 4 != 0) bytes.push_back(0);
  }
  Bytes bytes;
};

struct Attribute {
  Bytes name;
  std::uint32_t type = 0;
  std::uint64_t count = 0;
  Bytes values;
};
struct Dimension {
  Bytes name;
  std::uint64_t length = 0;
};
struct Variable {
  Bytes name;
  std::vector<std::uint64_t> dimensions;
  std::vector<Attribute> attributes;
  std::uint32_t type = 0;
  std::uint64_t size = 0, begin = 0;
};

std::size_t type_bytes(std::uint32_t type) {
  constexpr std::array<std::uint8_t, 12> kBytes{0, 1, 1, 2, 4, 4, 8, 1, 2, 4, 8, 8};
  return type < kBytes.size() ? kBytes[type] : 0;
}

/// A classic netCDF file, parsed into header and data.
class Classic {
 public:
  bool get(std::span<const std::uint8_t> file) {
    if (file.size() < 8 || std::memcmp(file.data(), "CDF", 3) != 0) return false;
    version_ = file[3];
    if (version_ != 1 && version_ != 2 && version_ != 5) return false;
    Input in(file.subspan(4));
    records = in.number(wide());
    const std::uint64_t dimension_count = list(in);
    for (std::uint64_t i = 0; i < dimension_count && in.good(); ++i)
      dimensions.push_back({name(in), in.number(wide())});
    attributes = get_attributes(in);
    const std::uint64_t variable_count = list(in);
    for (std::uint64_t i = 0; i < variable_count && in.good(); ++i) {
      Variable variable;
      variable.name = name(in);
      for (std::uint64_t d = in.number(wide()); d > 0 && in.good(); --d)
        variable.dimensions.push_back(in.number(wide()));
      variable.attributes = get_attributes(in);
      variable.type = static_cast<std::uint32_t>(in.number(4));
      variable.size = in.number(wide());
      variable.begin = in.number(version_ == 1 ? 4 : 8);
      variables.push_back(std::move(variable));
    }
    if (!in.good()) return false;
    header_ = 4 + in.at();
    data.assign(file.begin() + static_cast<std::ptrdiff_t>(header_), file.end());
    return true;
  }

  /// Writes the changed header and the data to a new file, and returns it. If the length of the
  /// header has changed, the data moves; the header then contains the new offsets of the data.
  Bytes put() const {
    Bytes out = put_moved(0);
    // unsigned wrap-around is intended if the new header is shorter
    const std::uint64_t moved = out.size() - header_;
    out = put_moved(moved);
    out.insert(out.end(), data.begin(), data.end());
    return out;
  }

  std::size_t header() const { return header_; }

  std::uint64_t records = 0;
  std::vector<Dimension> dimensions;
  std::vector<Attribute> attributes;
  std::vector<Variable> variables;
  Bytes data;

 private:
  std::size_t wide() const { return version_ == 5 ? 8 : 4; }
  std::uint64_t list(Input& in) {
    in.number(4);  // skips the tag of the list
    return in.number(wide());
  }
  Bytes name(Input& in) {
    Bytes out = in.bytes(in.number(wide()));
    in.align();
    return out;
  }
  std::vector<Attribute> get_attributes(Input& in) {
    std::vector<Attribute> out;
    for (std::uint64_t n = list(in); n > 0 && in.good(); --n) {
      Attribute attribute;
      attribute.name = name(in);
      attribute.type = static_cast<std::uint32_t>(in.number(4));
      attribute.count = in.number(wide());
      attribute.values =
          in.bytes(attribute.count > 1 << 20 ? 0 : attribute.count * type_bytes(attribute.type));
      in.align();
      out.push_back(std::move(attribute));
    }
    return out;
  }
  void put_list(Output& out, std::uint32_t tag, std::size_t count) const {
    out.number(count > 0 ? tag : 0, 4);
    out.number(count, wide());
  }
  void put_name(Output& out, const Bytes& text) const {
    out.number(text.size(), wide());
    out.add(text);
    out.align();
  }
  void put_attributes(Output& out, const std::vector<Attribute>& all) const {
    put_list(out, 12, all.size());
    for (const Attribute& attribute : all) {
      put_name(out, attribute.name);
      out.number(attribute.type, 4);
      out.number(attribute.count, wide());
      out.add(attribute.values);
      out.align();
    }
  }
  Bytes put_moved(std::uint64_t moved) const {
    Output out;
    out.add(std::array<std::uint8_t, 4>{'C', 'D', 'F', version_});
    out.number(records, wide());
    put_list(out, 10, dimensions.size());
    for (const Dimension& dimension : dimensions) {
      put_name(out, dimension.name);
      out.number(dimension.length, wide());
    }
    put_attributes(out, attributes);
    put_list(out, 11, variables.size());
    for (const Variable& variable : variables) {
      put_name(out, variable.name);
      out.number(variable.dimensions.size(), wide());
      for (const std::uint64_t d : variable.dimensions) out.number(d, wide());
      put_attributes(out, variable.attributes);
      out.number(variable.type, 4);
      out.number(variable.size, wide());
      out.number(variable.begin + moved, version_ == 1 ? 4 : 8);
    }
    return std::move(out.bytes);
  }

  std::uint8_t version_ = 1;
  std::size_t header_ = 0;
};

void disturb(std::uint64_t& number, Random& random) {
  switch (random() % 6) {
    case 0: ++number; break;
    case 1: --number; break;
    case 2: number = 0; break;
    case 3: number *= 2; break;
    case 4: number = std::uint64_t{1} << random() % 64; break;
    default: number = random() % 16;
  }
}

void mutate_bytes(Bytes& bytes, std::size_t room) {
  const std::size_t size = bytes.size();
  bytes.resize(size + room);
  if (!bytes.empty()) bytes.resize(LLVMFuzzerMutate(bytes.data(), size, bytes.size()));
}

template <class T>
T& any(std::vector<T>& of, Random& random) {
  return of[random() % of.size()];
}

void mutate_attribute(std::vector<Attribute>& of, Random& random) {
  if (of.empty()) return;
  Attribute& attribute = any(of, random);
  switch (random() % 5) {
    case 0: mutate_bytes(attribute.name, 8); break;
    case 1: attribute.type = static_cast<std::uint32_t>(random() % 14); break;
    case 2: disturb(attribute.count, random); break;
    case 3: of.erase(of.begin() + (&attribute - of.data())); break;
    default: mutate_bytes(attribute.values, 0);
  }
}

void mutate_variable(Classic& file, Random& random) {
  if (file.variables.empty()) return;
  Variable& variable = any(file.variables, random);
  switch (random() % 10) {
    case 0: mutate_bytes(variable.name, 8); break;
    case 1: variable.name = any(file.variables, random).name; break;
    case 2:
      if (!variable.dimensions.empty())
        any(variable.dimensions, random) = random() % (file.dimensions.size() + 1);
      break;
    case 3:
      if (random() % 2 == 0)
        variable.dimensions.push_back(random() % (file.dimensions.size() + 1));
      else if (!variable.dimensions.empty())
        variable.dimensions.pop_back();
      break;
    case 4: mutate_attribute(variable.attributes, random); break;
    case 5: variable.type = static_cast<std::uint32_t>(random() % 13); break;
    case 6: disturb(variable.size, random); break;
    case 7: variable.begin = any(file.variables, random).begin; break;
    case 8:
      file.variables.erase(file.variables.begin() + (&variable - file.variables.data()));
      break;
    default: variable.begin += random() % 16 * 4 - 32;
  }
}

/// Changes a 4-byte number in the data, which may be an id, a node number or a count.
void mutate_data(Classic& file, Random& random) {
  if (file.data.size() < 4) return;
  const std::size_t at = random() % (file.data.size() / 4) * 4;
  Input in(std::span(file.data).subspan(at, 4));
  std::uint64_t number = in.number(4);
  disturb(number, random);
  for (std::size_t b = 0; b < 4; ++b)
    file.data[at + b] = static_cast<std::uint8_t>(number >> (24 - 8 * b));
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const auto head = std::as_bytes(std::span(data, size));
  if (!shm::converters::looks_like_exodus(head.first(std::min<std::size_t>(size, 4096)))) return 0;
  if (data[0] == 0x89) return 0;
  const MemoryFile file(data, size);
  shm::converters::Spool spool(std::filesystem::temp_directory_path().string());
  try {
    const auto mesh = shm::converters::open_exodus(file.path(), spool);
    read_everything(*mesh);
  } catch (const shm::converters::Failure&) {
  }
  return 0;
}

extern "C" std::size_t LLVMFuzzerCustomMutator(std::uint8_t* data, std::size_t size,
                                               std::size_t max_size, unsigned seed) {
  Random random(seed);
  Classic file;
  if (random() % 16 == 0 || !file.get(std::span(data, size)))
    return LLVMFuzzerMutate(data, size, max_size);
  for (std::size_t n = random() % 3 + 1; n > 0; --n) switch (random() % 10) {
      case 0:
      case 1:
        if (!file.dimensions.empty()) disturb(any(file.dimensions, random).length, random);
        break;
      case 2:
        if (!file.dimensions.empty()) mutate_bytes(any(file.dimensions, random).name, 8);
        break;
      case 3: mutate_attribute(file.attributes, random); break;
      case 4: disturb(file.records, random); break;
      case 5:
      case 6: mutate_variable(file, random); break;
      case 7:
        if (file.dimensions.size() > 1 && random() % 4 == 0)
          std::swap(any(file.dimensions, random), any(file.dimensions, random));
        break;
      default: mutate_data(file, random);
    }
  const Bytes out = file.put();
  if (out.size() > max_size) return LLVMFuzzerMutate(data, size, max_size);
  std::memcpy(data, out.data(), out.size());
  return out.size();
}
