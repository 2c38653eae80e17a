// Checks a netCDF file before the netCDF library opens it. Reads the positions of the values from
// the header, and checks that all values are inside the file. Also overwrites the gaps between the
// values with zeros.
//
// Classic files (CDF-1, CDF-2, CDF-5) have big-endian numbers; names and attributes are padded to 4
// bytes. netCDF-4 files are HDF5 files, which are little-endian. The netCDF library overruns its
// buffers if the header contains an invalid name length or number of dimensions. Both are therefore
// checked here.
#include <netcdf.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstdio>
#include <cstring>
#include <limits>
#include <memory>
#include <optional>

#include "base/failure.h"
#include "exodus/skeleton.h"

namespace shm::converters::exodus {
namespace {

constexpr std::uint64_t kHuge = std::numeric_limits<std::uint64_t>::max();

std::uint64_t product(std::uint64_t a, std::uint64_t b) {
  std::uint64_t result = 0;
  return __builtin_mul_overflow(a, b, &result) ? kHuge : result;
}
std::uint64_t sum(std::uint64_t a, std::uint64_t b) {
  std::uint64_t result = 0;
  return __builtin_add_overflow(a, b, &result) ? kHuge : result;
}
std::uint64_t padded(std::uint64_t bytes) {
  return bytes > kHuge - 3 ? kHuge : (bytes + 3) & ~3ULL;
}

// Returns the size in bytes of one value of a netCDF type. Types 1 to 6 exist in all classic files,
// types 7 to 11 only in CDF-5. Returns 0 if the type is invalid.
std::uint64_t type_bytes(std::uint64_t type) {
  constexpr std::array<std::uint8_t, 12> kBytes{0, 1, 1, 2, 4, 4, 8, 1, 2, 4, 8, 8};
  return type < kBytes.size() ? kBytes[type] : 0;
}

class Header {
 public:
  Header(const std::string& path, const char* mode)
      : path_(path), file_(std::fopen(path.c_str(), mode)) {
    if (!file_) fail(ErrorCode::io, "", std::string("cannot be read: ") + std::strerror(errno));
    if (std::fseek(file_.get(), 0, SEEK_END) != 0) fail(ErrorCode::io, "", "cannot be read");
    size_ = static_cast<std::uint64_t>(std::max(0L, std::ftell(file_.get())));
    std::rewind(file_.get());
  }

  // Reads the header of a classic file. Returns false if the file is not a classic file.
  bool read() {
    std::array<unsigned char, 4> magic{};
    if (size_ < magic.size()) return false;
    take(magic.data(), magic.size());
    if (std::memcmp(magic.data(), "\x89HDF", 4) == 0) check_hdf5();
    if (std::memcmp(magic.data(), "CDF", 3) != 0) return false;
    version_ = magic[3];
    if (version_ != 1 && version_ != 2 && version_ != 5) return false;
    const std::uint64_t records = count();
    // A record count in which all bits are 1 means that the number of records is unknown, because
    // the file was written as a stream.
    if (records != (version_ == 5 ? kHuge : 0xffffffffU)) records_ = records;

    const std::uint64_t dimensions = list(10, "dimensions");
    for (std::uint64_t i = 0; i < dimensions; ++i) {
      name();
      lengths_.push_back(count());
    }
    attributes();
    const std::uint64_t variables = list(11, "variables");
    for (std::uint64_t i = 0; i < variables; ++i) variable();
    return true;
  }

  // Checks that the values of each variable are inside the file. Record variables are not checked
  // if the file has no records, because the header may then state positions past the end of the
  // file for them.
  void check_variables() {
    for (const Extent& extent : extents_) {
      if (extent.record && records_ == 0) continue;
      const std::uint64_t before = extent.record ? product(records_ - 1, record_bytes()) : 0;
      const std::uint64_t end = sum(sum(extent.begin, before), extent.bytes);
      if (end > size_)
        throw Failure(Error{ErrorCode::truncated,
                            "its values should end at byte " + std::to_string(end) +
                                ", but the file ends at byte " + std::to_string(size_),
                            "variable '" + extent.name + "'", extent.begin, path_});
    }
  }

  void clear_padding() {
    const std::uint64_t record = record_bytes();
    for (const Extent& extent : extents_) {
      const std::uint64_t pad = padded(extent.bytes) - extent.bytes;
      if (pad == 0 || (extent.record && record == extent.bytes)) continue;
      const std::uint64_t times = extent.record ? records_ : 1;
      for (std::uint64_t r = 0; r < times; ++r) {
        constexpr std::array<char, 4> kZeros{};
        const std::uint64_t begin = extent.begin + r * record + extent.bytes;
        if (begin >= size_) continue;
        const std::uint64_t bytes = std::min(pad, size_ - begin);
        if (std::fseek(file_.get(), static_cast<long>(begin), SEEK_SET) != 0 ||
            std::fwrite(kZeros.data(), 1, bytes, file_.get()) != bytes)
          throw_output();
      }
    }
    if (std::fflush(file_.get()) != 0) throw_output();
  }

 private:
  struct Extent {
    std::string name;
    std::uint64_t begin;
    std::uint64_t bytes;  // size in bytes of one record of a record variable, or of all values of
                          // another variable
    bool record;
  };

  [[noreturn]] void fail(ErrorCode code, const std::string& section,
                         const std::string& detail) const {
    throw Failure(Error{code, detail, section, section.empty() ? kNoOffset : at_, path_});
  }
  [[noreturn]] void throw_output() const {
    throw Failure(ErrorCode::output, std::string("cannot be written: ") + std::strerror(errno),
                  path_);
  }
  void take(void* out, std::size_t bytes) {
    if (bytes > size_ - at_ || std::fread(out, 1, bytes, file_.get()) != bytes)
      fail(ErrorCode::truncated, "netCDF header", "the file ends inside the header");
    at_ += bytes;
  }
  void skip(std::uint64_t bytes) {
    if (bytes > size_ - at_)
      fail(ErrorCode::truncated, "netCDF header", "the file ends inside the header");
    at_ += bytes;
    if (std::fseek(file_.get(), static_cast<long>(at_), SEEK_SET) != 0)
      fail(ErrorCode::io, "netCDF header", "cannot be read");
  }
  std::uint64_t number(std::size_t bytes) {
    std::array<unsigned char, 8> raw{};
    take(raw.data(), bytes);
    std::uint64_t value = 0;
    for (std::size_t i = 0; i < bytes; ++i) value = value << 8 | raw[i];
    return value;
  }
  std::uint64_t count() { return number(version_ == 5 ? 8 : 4); }
  // Reads the beginning of a list and returns its number of entries. Checks that the file is long
  // enough for these entries, which need at least 8 bytes each.
  std::uint64_t list(std::uint64_t expected_tag, const char* what) {
    const std::uint64_t tag = number(4);
    const std::uint64_t entries = count();
    if (tag == 0 && entries == 0) return 0;
    if (tag != expected_tag)
      fail(ErrorCode::corrupt, "netCDF header",
           std::string("the list of ") + what + " does not begin at the expected place");
    if (entries > (size_ - at_) / 8)
      fail(ErrorCode::truncated, "netCDF header",
           "the file is too short for " + std::to_string(entries) + " " + what);
    return entries;
  }
  std::string name() {
    const std::uint64_t length = count();
    if (length > size_ - at_)
      fail(ErrorCode::truncated, "netCDF header", "the file ends inside a name");
    if (length > NC_MAX_NAME)
      fail(ErrorCode::corrupt, "netCDF header",
           "a name has " + std::to_string(length) + " characters, more than netCDF allows");
    std::string text(length, '\0');
    take(text.data(), text.size());
    skip(padded(length) - length);
    return text;
  }
  // Checks that an HDF5 file is not truncated. The superblock states the end of the file. The
  // offsets below assume 8-byte addresses.
  void check_hdf5() {
    constexpr std::uint64_t kVersion = 8, kOldEnd = 40, kNewEnd = 28;
    skip(kVersion - at_);
    const std::uint64_t version = number(1);
    if (version > 3) return;
    skip((version < 2 ? kOldEnd : kNewEnd) - at_);
    std::array<unsigned char, 8> raw{};
    take(raw.data(), raw.size());
    std::uint64_t end = 0;
    for (std::size_t i = raw.size(); i-- > 0;) end = end << 8 | raw[i];
    if (end > size_)
      fail(ErrorCode::truncated, "HDF5 superblock",
           "the file should have " + std::to_string(end) + " bytes, but has " +
               std::to_string(size_));
  }
  void attributes() {
    const std::uint64_t entries = list(12, "attributes");
    for (std::uint64_t i = 0; i < entries; ++i) {
      const std::string label = name();
      const std::uint64_t bytes = type_bytes(number(4));
      if (bytes == 0)
        fail(ErrorCode::corrupt, "netCDF header", "attribute '" + label + "' has no known type");
      skip(padded(product(count(), bytes)));
    }
  }
  void variable() {
    Extent extent{name(), 0, 1, false};
    const std::uint64_t rank = count();
    if (rank > NC_MAX_VAR_DIMS)
      fail(ErrorCode::corrupt, "netCDF header",
           "variable '" + extent.name + "' has more dimensions than netCDF allows");
    for (std::uint64_t d = 0; d < rank; ++d) {
      const std::uint64_t id = count();
      if (id >= lengths_.size())
        fail(ErrorCode::corrupt, "netCDF header",
             "variable '" + extent.name + "' has a dimension that does not exist");
      if (lengths_[id] != 0)
        extent.bytes = product(extent.bytes, lengths_[id]);
      else if (d == 0)
        extent.record = true;
      else
        fail(ErrorCode::corrupt, "netCDF header",
             "variable '" + extent.name + "' has an unlimited dimension that is not its first");
    }
    attributes();
    const std::uint64_t bytes = type_bytes(number(4));
    if (bytes == 0)
      fail(ErrorCode::corrupt, "netCDF header", "variable '" + extent.name + "' has no known type");
    extent.bytes = product(extent.bytes, bytes);
    // Skips the header field that contains the size of the values. This size is redundant, and is
    // wrong if the values need more than 4 GiB.
    count();
    extent.begin = number(version_ == 1 ? 4 : 8);
    extents_.push_back(std::move(extent));
  }

  // Returns the size of a record in bytes. A record contains the values of each record variable at
  // one index of the unlimited dimension. If there are several record variables, the values of each
  // are padded.
  std::uint64_t record_bytes() const {
    std::uint64_t all = 0, last = 0;
    std::size_t variables = 0;
    for (const Extent& extent : extents_) {
      if (!extent.record) continue;
      all = sum(all, padded(extent.bytes));
      last = extent.bytes;
      ++variables;
    }
    return variables == 1 ? last : all;
  }

  struct Close {
    void operator()(std::FILE* file) const { std::fclose(file); }
  };
  std::string path_;
  std::unique_ptr<std::FILE, Close> file_;
  std::uint64_t size_ = 0, at_ = 0, records_ = 0;
  int version_ = 0;
  std::vector<std::uint64_t> lengths_;
  std::vector<Extent> extents_;
};

}  // namespace

void check_extent(const std::string& path) {
  Header header(path, "rb");
  if (header.read()) header.check_variables();
}

void clear_padding(const std::string& path) {
  Header header(path, "r+b");
  if (header.read()) header.clear_padding();
}

}  // namespace shm::converters::exodus
