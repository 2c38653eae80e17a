// Skeleton: everything in a netCDF file except its values, as plain data.
// Read from an open file, defined in a new one, or carried as text (exodus.h lists its lines).
#pragma once

#include <cstddef>
#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "shm/schema.h"

namespace shm::converters::exodus {

// What failed, and where: the file, and the netCDF variable or library call.
struct Place {
  std::string file;
  ErrorCode code;  // for failures without a better one
  // Throws Failure when `status`, of a netCDF call, is not success.
  void check(int status, const std::string& section) const;
  [[noreturn]] void fail(ErrorCode why, const std::string& section,
                         const std::string& detail) const;
};

struct Attribute {
  std::string name;
  int type;                          // nc_type, atomic
  std::vector<std::byte> values;     // host order; char: the characters
  std::vector<std::string> strings;  // NC_STRING instead
  bool operator==(const Attribute&) const = default;
};
struct Dimension {
  std::string name;
  std::uint64_t length;  // current length when unlimited
  bool unlimited;
  bool operator==(const Dimension&) const = default;
};
// A filter of HDF5 that is not deflate, shuffle or checksum.
struct Filter {
  unsigned id;
  std::vector<unsigned> parameters;
  bool operator==(const Filter&) const = default;
};
// How a netCDF-4 variable lies in the file.
struct Storage {
  std::vector<std::uint64_t> chunks;  // empty: contiguous or compact
  int deflate_level = 0;
  bool shuffle = false, checksum = false;
  std::vector<Filter> filters;
  bool compact = false, big_endian = false;
  bool filled = false;  // with the fill value before values are written
  bool operator==(const Storage&) const = default;
};
struct Variable {
  std::string name;
  int type;
  std::vector<std::size_t> dimensions;  // indices into Skeleton::dimensions
  std::vector<Attribute> attributes;
  Storage storage;
  bool operator==(const Variable&) const = default;
};

enum class Kind : std::uint8_t { classic, offset64, cdf5, netcdf4, netcdf4_classic };
inline bool is_netcdf4(Kind kind) { return kind == Kind::netcdf4 || kind == Kind::netcdf4_classic; }

struct Skeleton {
  Kind kind = Kind::classic;
  std::vector<Dimension> dimensions;
  std::vector<Attribute> attributes;
  std::vector<Variable> variables;  // in order of definition; the index is the netCDF number
  bool operator==(const Skeleton&) const = default;

  // Index, or -1.
  int find_variable(std::string_view name) const;
  int find_dimension(std::string_view name) const;
  std::uint64_t length_of(std::string_view dimension) const;  // 0 when there is none
  const std::string& dimension_name(const Variable& variable, std::size_t i) const {
    return dimensions[variable.dimensions[i]].name;
  }
  std::vector<std::uint64_t> shape(const Variable& variable) const;
  // Number of values; the largest 64-bit number when it is even more.
  std::uint64_t size(const Variable& variable) const;
};

// Variables by name, for who asks for many. Borrows the skeleton.
class VariableIndex {
 public:
  explicit VariableIndex(const Skeleton& skeleton) {
    for (std::size_t v = 0; v < skeleton.variables.size(); ++v)
      by_name_.emplace(skeleton.variables[v].name, static_cast<int>(v));
  }
  int find(std::string_view name) const {  // index, or -1
    const auto found = by_name_.find(name);
    return found == by_name_.end() ? -1 : found->second;
  }

 private:
  std::map<std::string_view, int> by_name_;
};

// Our type for an atomic nc_type; characters and strings are uint8.
ScalarType scalar_of(int nc_type);

// Structure of open file `ncid`. Throws unsupported for groups and types of users' own.
Skeleton read_skeleton(int ncid, const Place& place);
// Creates `path` with that structure, ready for values; returns its ncid.
int create_file(const Skeleton& skeleton, const Place& place);

// Text with %XX for characters that end a field or line; nothing where a %XX is none.
std::optional<std::string> unescaped(std::string_view text);

std::string to_text(const Skeleton& skeleton);
// Throws Failure (corrupt).
Skeleton from_text(std::string_view text, const Place& place);

// Throws truncated when the header of a netCDF file, or the values that it places, reach beyond the
// end of the file (netCDF itself reads zeros there); corrupt when the header makes no sense.
void check_extent(const std::string& path);
// Zeros between the values of a classic file, where netCDF leaves what was in its buffers: the same
// mesh must become the same bytes.
void clear_padding(const std::string& path);

// Caches of chunked (netCDF-4) variables: netCDF would keep tens of megabytes for each variable
// that has been touched. Here the last few keep one, large enough for a chunk.
class ChunkCaches {
 public:
  // Before values of `variable` of open file `ncid` are read or written.
  void touch(int ncid, const Skeleton& skeleton, int variable);

 private:
  std::vector<int> recent_;  // latest last
};

}  // namespace shm::converters::exodus
