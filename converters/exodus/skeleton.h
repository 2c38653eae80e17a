// Skeleton: the structure of a netCDF file, i.e. everything except the values of variables, as
// plain data. A skeleton can be read from an open file, be used to create a new file, and be stored
// as text (exodus.h describes the text).
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

// Context for error messages: the name of the file, and a default error code.
struct Place {
  std::string file;
  ErrorCode code;  // error code to use if no other code is more specific

  // Throws Failure if `status`, the result of a netCDF call, is an error.
  void check(int status, const std::string& section) const;
  [[noreturn]] void fail(ErrorCode why, const std::string& section,
                         const std::string& detail) const;
};

struct Attribute {
  std::string name;
  int type;                          // nc_type of the values; never a user-defined type
  std::vector<std::byte> values;     // values in host byte order, or characters if the type is
                                     // NC_CHAR
  std::vector<std::string> strings;  // values if the type is NC_STRING
  bool operator==(const Attribute&) const = default;
};
struct Dimension {
  std::string name;
  std::uint64_t length;  // if unlimited: the current length
  bool unlimited;
  bool operator==(const Dimension&) const = default;
};
// An HDF5 filter other than deflate, shuffle and checksum.
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
  // True if netCDF fills the variable with its fill value before values are written.
  bool filled = false;
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
  // Variables in the order of their definition. The index of a variable is its netCDF id.
  std::vector<Variable> variables;
  bool operator==(const Skeleton&) const = default;

  // find_variable() and find_dimension() return an index, or -1 if no variable or dimension has
  // this name.
  int find_variable(std::string_view name) const;
  int find_dimension(std::string_view name) const;
  // Returns the length of a dimension, or 0 if the dimension does not exist.
  std::uint64_t length_of(std::string_view dimension) const;
  const std::string& dimension_name(const Variable& variable, std::size_t i) const {
    return dimensions[variable.dimensions[i]].name;
  }
  std::vector<std::uint64_t> shape(const Variable& variable) const;
  // Returns the number of values of a variable, i.e. the product of its dimensions. If the product
  // overflows, returns the largest 64-bit number.
  std::uint64_t size(const Variable& variable) const;
};

// A map from names to variables, which makes repeated lookups fast. The skeleton is borrowed.
class VariableIndex {
 public:
  explicit VariableIndex(const Skeleton& skeleton) {
    for (std::size_t v = 0; v < skeleton.variables.size(); ++v)
      by_name_.emplace(skeleton.variables[v].name, static_cast<int>(v));
  }
  int find(std::string_view name) const {  // returns the index of a variable, or -1
    const auto found = by_name_.find(name);
    return found == by_name_.end() ? -1 : found->second;
  }

 private:
  std::map<std::string_view, int> by_name_;
};

// Returns the ScalarType that corresponds to an atomic nc_type. For characters and strings, this is
// uint8.
ScalarType scalar_of(int nc_type);

// Returns the structure of the open file `ncid`. Throws Failure (unsupported) for groups and
// user-defined types.
Skeleton read_skeleton(int ncid, const Place& place);
// Creates the file `place.file` with the structure of a skeleton. Its values can then be written.
// Returns the ncid of the open file.
int create_file(const Skeleton& skeleton, const Place& place);

// Decodes the %XX escapes in text. An escape represents a character with a special meaning in the
// skeleton, such as a tab. Returns nothing if an escape is invalid.
std::optional<std::string> unescaped(std::string_view text);

std::string to_text(const Skeleton& skeleton);
// Parses the lines of a skeleton. Throws Failure (corrupt).
Skeleton from_text(std::string_view text, const Place& place);

// Checks a netCDF file before the netCDF library opens it. Throws Failure with the code `truncated`
// if the header or the values extend beyond the end of the file; the library itself would read
// zeros there. Throws Failure with the code `corrupt` if the header is invalid.
void check_extent(const std::string& path);
// Writes zeros to the gaps between the values of a classic file. The netCDF library leaves
// arbitrary bytes in these gaps, but equal meshes must produce equal files.
void clear_padding(const std::string& path);

// Limits netCDF's caches for chunked variables in netCDF-4 files. By default, netCDF keeps tens of
// megabytes for each variable that has been accessed. With this class, only the most recently used
// variables have a cache, which is just large enough for the chunks of one row.
class ChunkCaches {
 public:
  // Must be called before values of `variable` in the open file `ncid` are read or written.
  void touch(int ncid, const Skeleton& skeleton, int variable);

 private:
  std::vector<int> recent_;  // variables that have a cache; the most recently used variable is last
};

}  // namespace shm::converters::exodus
