#include "exodus/skeleton.h"

#include <algorithm>
#include <array>
#include <limits>
#include <map>
#include <set>

#include "base/failure.h"
#include "exodus/netcdf.h"

namespace shm::converters::exodus {
namespace {

bool is_atomic(int type) { return type >= NC_BYTE && type <= NC_STRING; }

// Reads the attributes of a variable, or of the file if `variable` is NC_GLOBAL.
std::vector<Attribute> read_attributes(int ncid, int variable, int count, const Place& place) {
  // The number of attributes is limited because netCDF needs linear time to find an attribute. The
  // netCDF manual states NC_MAX_ATTRS as the maximum.
  if (count > NC_MAX_ATTRS)
    place.fail(ErrorCode::over_limit, "attributes",
               "a variable or the file has " + std::to_string(count) + "; " +
                   std::to_string(NC_MAX_ATTRS) + " is the maximum");
  std::vector<Attribute> attributes;
  for (int i = 0; i < count; ++i) {
    char name[NC_MAX_NAME + 1];
    place.check(nc_inq_attname(ncid, variable, i, name), "attributes");
    const std::string section = std::string("attribute '") + name + "'";
    Attribute attribute{name, 0, {}, {}};
    std::size_t length = 0;
    place.check(nc_inq_att(ncid, variable, name, &attribute.type, &length), section);
    if (!is_atomic(attribute.type))
      place.fail(ErrorCode::unsupported, section, "has a type that is not built into netCDF");
    if (attribute.type == NC_STRING) {
      std::vector<char*> texts(length);
      place.check(nc_get_att_string(ncid, variable, name, texts.data()), section);
      for (const char* text : texts) attribute.strings.emplace_back(text != nullptr ? text : "");
      nc_free_string(length, texts.data());
    } else {
      attribute.values.resize(length * scalar_bytes(scalar_of(attribute.type)));
      if (length > 0)
        place.check(nc_get_att(ncid, variable, name, attribute.values.data()), section);
    }
    attributes.push_back(std::move(attribute));
  }
  return attributes;
}

void write_attributes(int ncid, int variable, const std::vector<Attribute>& attributes,
                      const Place& place) {
  for (const Attribute& attribute : attributes) {
    int status;
    if (attribute.type == NC_STRING) {
      std::vector<const char*> texts;
      for (const std::string& text : attribute.strings) texts.push_back(text.c_str());
      status =
          nc_put_att_string(ncid, variable, attribute.name.c_str(), texts.size(), texts.data());
    } else {
      const std::size_t length = attribute.values.size() / scalar_bytes(scalar_of(attribute.type));
      status = nc_put_att(ncid, variable, attribute.name.c_str(), attribute.type, length,
                          attribute.values.data());
    }
    place.check(status, "attribute '" + attribute.name + "'");
  }
}

// Reads the filters of a variable, except deflate, shuffle and checksum, which have their own
// netCDF functions.
std::vector<Filter> read_filters(int ncid, int id, const std::string& section, const Place& place) {
  constexpr unsigned kDeflate = 1, kShuffle = 2, kChecksum = 3;
  std::size_t count = 0;
  place.check(nc_inq_var_filter_ids(ncid, id, &count, nullptr), section);
  std::vector<unsigned> ids(count);
  place.check(nc_inq_var_filter_ids(ncid, id, &count, ids.data()), section);
  std::vector<Filter> filters;
  for (const unsigned filter : ids) {
    if (filter == kDeflate || filter == kShuffle || filter == kChecksum) continue;
    place.check(nc_inq_var_filter_info(ncid, id, filter, &count, nullptr), section);
    std::vector<unsigned> parameters(count);
    place.check(nc_inq_var_filter_info(ncid, id, filter, &count, parameters.data()), section);
    filters.push_back({filter, std::move(parameters)});
  }
  return filters;
}

Storage read_storage(int ncid, int id, const Variable& variable, const Place& place) {
  const std::string section = "variable '" + variable.name + "'";
  Storage storage;
  int kind = NC_CONTIGUOUS, shuffle = 0, deflate = 0, level = 0, checksum = 0, endianness = 0,
      unfilled = 0;
  std::vector<std::size_t> chunks(variable.dimensions.size() + 1);
  place.check(nc_inq_var_chunking(ncid, id, &kind, chunks.data()), section);
  place.check(nc_inq_var_endian(ncid, id, &endianness), section);
  place.check(nc_inq_var_fill(ncid, id, &unfilled, nullptr), section);
  storage.compact = kind == NC_COMPACT;
  storage.big_endian = endianness == NC_ENDIAN_BIG;
  storage.filled = unfilled == 0;
  if (kind != NC_CHUNKED) return storage;
  storage.chunks.assign(chunks.begin(), chunks.end() - 1);
  place.check(nc_inq_var_deflate(ncid, id, &shuffle, &deflate, &level), section);
  place.check(nc_inq_var_fletcher32(ncid, id, &checksum), section);
  storage.deflate_level = deflate != 0 ? level : 0;
  storage.shuffle = shuffle != 0;
  storage.checksum = checksum != 0;
  storage.filters = read_filters(ncid, id, section, place);
  return storage;
}

void define_filter(int ncid, int id, const Filter& filter, const std::string& section,
                   const Place& place) {
  constexpr unsigned kSzip = 4;
  // Bits of szip's options mask that a caller may set. HDF5 sets the other bits itself.
  constexpr std::array<unsigned, 2> kSzipCoders{4, 32};
  // If this HDF5 filter is not installed, write the values without it. Otherwise the file could not
  // be written at all.
  if (nc_inq_filter_avail(ncid, filter.id) != NC_NOERR) return;
  std::vector<unsigned> parameters = filter.parameters;
  if (filter.id == kSzip && parameters.size() > 2) {
    parameters.resize(2);
    parameters[0] &= kSzipCoders[0] | kSzipCoders[1];
  }
  place.check(nc_def_var_filter(ncid, id, filter.id, parameters.size(), parameters.data()),
              section);
}

void define_storage(int ncid, int id, const Variable& variable, const Place& place) {
  const Storage& storage = variable.storage;
  const std::string section = "variable '" + variable.name + "'";
  if (storage.big_endian) place.check(nc_def_var_endian(ncid, id, NC_ENDIAN_BIG), section);
  if (storage.filled) place.check(nc_def_var_fill(ncid, id, NC_FILL, nullptr), section);
  if (storage.compact) place.check(nc_def_var_chunking(ncid, id, NC_COMPACT, nullptr), section);
  if (storage.chunks.empty()) return;
  const std::vector<std::size_t> chunks(storage.chunks.begin(), storage.chunks.end());
  place.check(nc_def_var_chunking(ncid, id, NC_CHUNKED, chunks.data()), section);
  if (storage.shuffle || storage.deflate_level > 0)
    place.check(nc_def_var_deflate(ncid, id, storage.shuffle, storage.deflate_level > 0,
                                   storage.deflate_level),
                section);
  if (storage.checksum) place.check(nc_def_var_fletcher32(ncid, id, NC_FLETCHER32), section);
  for (const Filter& filter : storage.filters) define_filter(ncid, id, filter, section, place);
}

std::string quoted_list(const std::vector<std::string>& names) {
  std::string list;
  for (const std::string& name : names) list += (list.empty() ? "'" : ", '") + name + "'";
  return list;
}

// Throws Failure for groups, which are files within the file, and for user-defined types, whose
// values are not scalars.
void refuse_groups_and_types(int ncid, const Place& place) {
  char name[NC_MAX_NAME + 1];
  int count = 0;
  std::vector<std::string> names;
  place.check(nc_inq_grps(ncid, &count, nullptr), "groups");
  std::vector<int> ids(static_cast<std::size_t>(count));
  place.check(nc_inq_grps(ncid, &count, ids.data()), "groups");
  for (const int id : ids) {
    place.check(nc_inq_grpname(id, name), "groups");
    names.emplace_back(name);
  }
  if (!names.empty())
    place.fail(ErrorCode::unsupported, "groups",
               "has netCDF groups, which cannot be converted: " + quoted_list(names));
  place.check(nc_inq_typeids(ncid, &count, nullptr), "types");
  ids.resize(static_cast<std::size_t>(count));
  place.check(nc_inq_typeids(ncid, &count, ids.data()), "types");
  for (const int id : ids) {
    place.check(nc_inq_user_type(ncid, id, name, nullptr, nullptr, nullptr, nullptr), "types");
    names.emplace_back(name);
  }
  if (!names.empty())
    place.fail(ErrorCode::unsupported, "types",
               "defines netCDF types of its own (compound, enum, opaque or of variable length), "
               "which cannot be converted: " +
                   quoted_list(names));
}

}  // namespace

void Place::fail(ErrorCode why, const std::string& section, const std::string& detail) const {
  throw Failure(Error{.code = why, .detail = detail, .section = section, .file = file});
}

void Place::check(int status, const std::string& section) const {
  // All names come from the source file. If netCDF rejects a name while writing, the error is
  // therefore reported as corrupt data.
  if (status != NC_NOERR)
    fail(status == NC_EBADNAME ? ErrorCode::corrupt : code, section,
         std::string("netCDF reports: ") + nc_strerror(status));
}

int Skeleton::find_variable(std::string_view name) const {
  for (std::size_t i = 0; i < variables.size(); ++i)
    if (variables[i].name == name) return static_cast<int>(i);
  return -1;
}

int Skeleton::find_dimension(std::string_view name) const {
  for (std::size_t i = 0; i < dimensions.size(); ++i)
    if (dimensions[i].name == name) return static_cast<int>(i);
  return -1;
}

std::uint64_t Skeleton::length_of(std::string_view dimension) const {
  const int i = find_dimension(dimension);
  return i < 0 ? 0 : dimensions[static_cast<std::size_t>(i)].length;
}

std::vector<std::uint64_t> Skeleton::shape(const Variable& variable) const {
  std::vector<std::uint64_t> lengths;
  for (const std::size_t d : variable.dimensions) lengths.push_back(dimensions[d].length);
  return lengths;
}

std::uint64_t Skeleton::size(const Variable& variable) const {
  std::uint64_t product = 1;
  bool overflow = false;
  for (const std::uint64_t length : shape(variable)) {
    if (length == 0) return 0;
    overflow |= __builtin_mul_overflow(product, length, &product);
  }
  return overflow ? std::numeric_limits<std::uint64_t>::max() : product;
}

Skeleton read_skeleton(int ncid, const Place& place) {
  Skeleton skeleton;
  int format = 0, dimensions = 0, variables = 0, attributes = 0;
  place.check(nc_inq_format(ncid, &format), "header");
  switch (format) {
    case NC_FORMAT_CLASSIC: skeleton.kind = Kind::classic; break;
    case NC_FORMAT_64BIT_OFFSET: skeleton.kind = Kind::offset64; break;
    case NC_FORMAT_CDF5: skeleton.kind = Kind::cdf5; break;
    case NC_FORMAT_NETCDF4: skeleton.kind = Kind::netcdf4; break;
    case NC_FORMAT_NETCDF4_CLASSIC: skeleton.kind = Kind::netcdf4_classic; break;
    default: place.fail(ErrorCode::unsupported, "header", "is an unknown kind of netCDF file");
  }
  place.check(nc_inq(ncid, &dimensions, &variables, &attributes, nullptr), "header");
  if (is_netcdf4(skeleton.kind)) refuse_groups_and_types(ncid, place);

  std::vector<int> ids(static_cast<std::size_t>(dimensions)), unlimited(ids.size());
  int unlimited_count = 0;
  place.check(nc_inq_dimids(ncid, nullptr, ids.data(), 0), "dimensions");
  if (is_netcdf4(skeleton.kind)) {
    place.check(nc_inq_unlimdims(ncid, &unlimited_count, unlimited.data()), "dimensions");
  } else {
    int id = -1;
    place.check(nc_inq_unlimdim(ncid, &id), "dimensions");
    if (id >= 0) unlimited.at(static_cast<std::size_t>(unlimited_count++)) = id;
  }
  unlimited.resize(static_cast<std::size_t>(unlimited_count));
  const std::set<int> growing(unlimited.begin(), unlimited.end());
  std::map<int, std::size_t> place_of_id;
  for (const int id : ids) {
    char name[NC_MAX_NAME + 1];
    std::size_t length = 0;
    place.check(nc_inq_dim(ncid, id, name, &length), "dimensions");
    place_of_id.emplace(id, skeleton.dimensions.size());
    skeleton.dimensions.push_back({name, length, growing.contains(id)});
  }

  skeleton.attributes = read_attributes(ncid, NC_GLOBAL, attributes, place);
  for (int v = 0; v < variables; ++v) {
    char name[NC_MAX_NAME + 1];
    int type = 0, rank = 0, count = 0, used[NC_MAX_VAR_DIMS];
    place.check(nc_inq_var(ncid, v, name, &type, &rank, used, &count), "variables");
    Variable variable;
    variable.name = name;
    variable.type = type;
    if (!is_atomic(type))
      place.fail(ErrorCode::unsupported, "variable '" + variable.name + "'",
                 "has a type that is not built into netCDF");
    for (int d = 0; d < rank; ++d) {
      const auto found = place_of_id.find(used[d]);
      if (found == place_of_id.end())
        place.fail(ErrorCode::corrupt, "variable '" + variable.name + "'",
                   "has a dimension that does not exist");
      variable.dimensions.push_back(found->second);
    }
    variable.attributes = read_attributes(ncid, v, count, place);
    if (is_netcdf4(skeleton.kind)) variable.storage = read_storage(ncid, v, variable, place);
    skeleton.variables.push_back(std::move(variable));
  }
  return skeleton;
}

int create_file(const Skeleton& skeleton, const Place& place) {
  constexpr std::array<int, 5> kModes{0, NC_64BIT_OFFSET, NC_64BIT_DATA, NC_NETCDF4,
                                      NC_NETCDF4 | NC_CLASSIC_MODEL};
  int ncid = -1, previous = 0;
  open_netcdf(place.file, ErrorCode::output);
  place.check(nc_create(place.file.c_str(),
                        NC_CLOBBER | kModes[static_cast<std::size_t>(skeleton.kind)], &ncid),
              "creating it");
  try {
    // Disable filling by default, because all values are written anyway. define_storage() enables
    // it for variables that were filled in the source.
    place.check(nc_set_fill(ncid, NC_NOFILL, &previous), "creating it");
    std::vector<int> ids;
    for (const Dimension& dimension : skeleton.dimensions) {
      int id = -1;
      place.check(nc_def_dim(ncid, dimension.name.c_str(),
                             dimension.unlimited ? NC_UNLIMITED : dimension.length, &id),
                  "dimension '" + dimension.name + "'");
      ids.push_back(id);
    }
    write_attributes(ncid, NC_GLOBAL, skeleton.attributes, place);
    for (const Variable& variable : skeleton.variables) {
      std::vector<int> used;
      for (const std::size_t d : variable.dimensions) used.push_back(ids[d]);
      int id = -1;
      place.check(nc_def_var(ncid, variable.name.c_str(), variable.type,
                             static_cast<int>(used.size()), used.data(), &id),
                  "variable '" + variable.name + "'");
      if (is_netcdf4(skeleton.kind)) define_storage(ncid, id, variable, place);
      write_attributes(ncid, id, variable.attributes, place);
    }
    place.check(nc_enddef(ncid), "header");
  } catch (...) {
    nc_abort(ncid);
    throw;
  }
  return ncid;
}

void ChunkCaches::touch(int ncid, const Skeleton& skeleton, int variable) {
  // Maximum number of variables that have a chunk cache. Four caches suffice for three coordinates
  // and one more variable.
  constexpr std::size_t kKept = 4;
  constexpr std::uint64_t kSmallest = std::uint64_t{1} << 20, kLargest = std::uint64_t{1} << 28;
  constexpr std::size_t kSlots = 101;
  // Value of netCDF's `preemption` parameter. With the value 1, chunks that have been read or
  // written completely are evicted first, which suits sequential access.
  constexpr float kPreemption = 1;
  const Variable& one = skeleton.variables[static_cast<std::size_t>(variable)];
  if (one.storage.chunks.empty()) return;
  const auto found = std::find(recent_.begin(), recent_.end(), variable);
  if (found != recent_.end()) {
    std::rotate(found, found + 1, recent_.end());
    return;
  }
  std::uint64_t bytes = scalar_bytes(scalar_of(one.type));
  // Rows are accessed in order. The cache is therefore large enough for all chunks of one row, e.g.
  // the chunks with all nodes of an element.
  const std::size_t rows = skeleton.dimensions[one.dimensions.front()].unlimited ? 2 : 1;
  for (std::size_t d = 0; d < one.storage.chunks.size(); ++d) {
    const std::uint64_t chunk = std::max<std::uint64_t>(one.storage.chunks[d], 1);
    const std::uint64_t length = skeleton.dimensions[one.dimensions[d]].length;
    const std::uint64_t columns = d < rows ? chunk : std::max(chunk, length + chunk - 1);
    if (__builtin_mul_overflow(bytes, columns, &bytes)) bytes = kLargest;
  }
  // The cache affects only speed and memory, so errors are ignored.
  nc_set_var_chunk_cache(ncid, variable, std::clamp(bytes, kSmallest, kLargest), kSlots,
                         kPreemption);
  recent_.push_back(variable);
  if (recent_.size() <= kKept) return;
  nc_set_var_chunk_cache(ncid, recent_.front(), 0, 1, kPreemption);
  recent_.erase(recent_.begin());
}

}  // namespace shm::converters::exodus
