// Skeleton: everything in a netCDF file except its values, as plain data. It is read from an open
// file, defined in a new file, or stored as text (exodus.h lists its lines).
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

// Context for error messages: the file, and the error code for failures without a more specific
// one.
struct Place {
  std::string file;
  ErrorCode code;  // for failures without a more specific code
  // Throws Failure if `status`, the result of a netCDF call, is an error.
  void check(int status, const std::string& section) const;
  [[noreturn]] void fail(ErrorCode why, const std::string& section,
                         const std::string& detail) const;
};

struct Attribute {
  std::string name;
  int type;                          // nc_type, atomic
  std::vector<std::byte> values;     // host byte order; char: the characters
  std::vector<std::string> strings;  // used instead for NC_STRING
  bool operator==(const Attribute&) const = default;
};
struct Dimension {
  std::string name;
  std::uint64_t length;  // current length if unlimited
  bool unlimited;
  bool operator==(const Dimension&) const = default;
};
// An HDF5 filter other than deflate, shuffle or checksum.
struct Filter {
  unsigned id;
  std::vector<unsigned> parameters;
  bool operator==(const Filter&) const = default;
};
// Storage properties of a netCDF-4 variable.
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
  std::vector<Variable> variables;  // in order of definition; the index is the netCDF id
  bool operator==(const Skeleton&) const = default;

  // Return the index, or -1.
  int find_variable(std::string_view name) const;
  int find_dimension(std::string_view name) const;
  std::uint64_t length_of(std::string_view dimension) const;  // 0 if it does not exist
  const std::string& dimension_name(const Variable& variable, std::size_t i) const {
    return dimensions[variable.dimensions[i]].name;
  }
  std::vector<std::uint64_t> shape(const Variable& variable) const;
  // Number of values, saturated at the largest 64-bit number.
  std::uint64_t size(const Variable& variable) const;
};

// Index of variables by name, for repeated lookups. Borrows the skeleton.
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

// Returns our type for an atomic nc_type; characters and strings are uint8.
ScalarType scalar_of(int nc_type);

// Returns the structure of the open file `ncid`. Throws unsupported for groups and user-defined
// types.
Skeleton read_skeleton(int ncid, const Place& place);
// Creates `path` with that structure, ready for values, and returns its ncid.
int create_file(const Skeleton& skeleton, const Place& place);

// Decodes text in which %XX encodes characters that end a field or line; returns nothing if a %XX
// is invalid.
std::optional<std::string> unescaped(std::string_view text);

std::string to_text(const Skeleton& skeleton);
// Throws Failure (corrupt).
Skeleton from_text(std::string_view text, const Place& place);

// Throws truncated if the header of a netCDF file, or the values at the places that it states,
// extend beyond the end of the file (netCDF itself would read zeros there); throws corrupt if the
// header is invalid.
void check_extent(const std::string& path);
// Writes zeros between the values of a classic file. netCDF leaves old contents of its buffers
// there, but the same mesh must produce the same bytes.
void clear_padding(const std::string& path);

// Caches of chunked (netCDF-4) variables. netCDF would keep tens of megabytes for each variable
// that has been accessed. Here only the last few variables have a cache, just large enough for one
// chunk.
class ChunkCaches {
 public:
  // Must be called before values of `variable` of the open file `ncid` are read or written.
  void touch(int ncid, const Skeleton& skeleton, int variable);

 private:
  std::vector<int> recent_;  // most recent last
};

}  // namespace shm::converters::exodus
