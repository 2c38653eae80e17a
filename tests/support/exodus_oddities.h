// Uses netCDF to add items to an Exodus file that the Exodus manual does not describe: assemblies,
// blobs and reduction variables as newer libraries store them, user-defined variables and
// attributes, variables that have Exodus names but unexpected types and shapes, and every storage
// option of netCDF.
#pragma once

#include <gtest/gtest.h>
#include <netcdf.h>
#include <netcdf_filter.h>

#include <cmath>
#include <cstdint>
#include <cstring>
#include <initializer_list>
#include <set>
#include <sstream>
#include <string>
#include <vector>

namespace shm::exodus_files {

// Opens an existing file to add items. The destructor closes the file.
class Additions {
 public:
  explicit Additions(const std::string& path) {
    good(nc_open(path.c_str(), NC_WRITE, &id_), "open");
    nc_redef(id_);
    int kind = 0;
    nc_inq_format(id_, &kind);
    enhanced_ = kind == NC_FORMAT_NETCDF4;
    hdf5_ = enhanced_ || kind == NC_FORMAT_NETCDF4_CLASSIC;
  }
  ~Additions() {
    nc_enddef(id_);
    for (const int variable : filled_) put_values(variable);
    good(nc_close(id_), "close");
  }
  Additions(const Additions&) = delete;
  Additions& operator=(const Additions&) = delete;

  int id() const { return id_; }
  bool enhanced() const {
    return enhanced_;
  }  // true if the file supports the complete netCDF-4 model
  bool hdf5() const { return hdf5_; }

  void dimension(const std::string& name, std::size_t length) {
    int dimension = -1;
    good(nc_def_dim(id_, name.c_str(), length, &dimension), name);
  }
  // Adds a variable and stores a few values in it.
  int variable(const std::string& name, nc_type type,
               std::initializer_list<const char*> dimensions) {
    std::vector<int> used;
    for (const char* one : dimensions) {
      used.push_back(-1);
      good(nc_inq_dimid(id_, one, &used.back()), one);
    }
    int variable = -1;
    good(nc_def_var(id_, name.c_str(), type, static_cast<int>(used.size()), used.data(), &variable),
         name);
    filled_.push_back(variable);
    return variable;
  }
  void text(int variable, const std::string& name, const std::string& value) {
    good(nc_put_att_text(id_, variable, name.c_str(), value.size(), value.data()), name);
  }
  template <class T>
  void numbers(int variable, const std::string& name, nc_type type, const std::vector<T>& values) {
    good(nc_put_att(id_, variable, name.c_str(), type, values.size(), values.data()), name);
  }
  void good(int status, const std::string& what) {
    if (status != NC_NOERR) ADD_FAILURE() << what << ": " << nc_strerror(status);
  }

 private:
  void put_values(int variable) {
    nc_type type = 0;
    int rank = 0, used[NC_MAX_VAR_DIMS];
    nc_inq_var(id_, variable, nullptr, &type, &rank, used, nullptr);
    std::vector<std::size_t> start(static_cast<std::size_t>(rank)), count(start.size());
    std::size_t size = 1;
    for (std::size_t d = 0; d < count.size(); ++d) {
      char name[NC_MAX_NAME + 1];
      nc_inq_dim(id_, used[d], name, &count[d]);
      if (count[d] == 0 && std::strcmp(name, "runs") == 0) count[d] = 3;
      size *= count[d];
    }
    if (size == 0) return;
    if (type == NC_STRING) {
      std::vector<const char*> texts(size, "some text");
      texts.front() = "";
      good(nc_put_vara_string(id_, variable, start.data(), count.data(), texts.data()), "strings");
    } else if (type == NC_CHAR) {
      std::string letters(size, ' ');
      for (std::size_t i = 0; i < size; ++i) letters[i] = static_cast<char>('a' + i * 7 % 26);
      good(nc_put_vara_text(id_, variable, start.data(), count.data(), letters.data()), "text");
    } else {
      std::vector<double> values(size);
      for (std::size_t i = 0; i < size; ++i) values[i] = static_cast<double>(i * 5 % 101);
      good(nc_put_vara_double(id_, variable, start.data(), count.data(), values.data()), "values");
    }
  }

  int id_ = -1;
  bool enhanced_ = false, hdf5_ = false;
  std::vector<int> filled_;
};

inline void add_assemblies_and_blobs(Additions& to) {
  to.dimension("num_assembly", 2);
  to.dimension("num_blob", 1);
  to.dimension("num_entity_assembly1", 3);
  to.dimension("num_values_blob1", 1000);
  to.dimension("num_assembly_red_var", 2);
  to.dimension("num_elem_red_var", 3);
  to.dimension("num_blob_var", 1);
  const int assembly = to.variable("assembly_entity1", NC_INT, {"num_entity_assembly1"});
  to.numbers<int>(assembly, "_id", NC_INT, {100});
  to.numbers<int>(assembly, "_type", NC_INT, {1});
  to.text(assembly, "_name", "Root");
  to.numbers<double>(assembly, "Scale", NC_DOUBLE, {1.5, -0.0, std::nan(""), 1e-310});
  const int blob = to.variable("blob_entity1", NC_BYTE, {"num_values_blob1"});
  to.numbers<int>(blob, "_id", NC_INT, {7});
  to.text(blob, "_name", "A blob");
  to.numbers<int>(blob, "Dimensions", NC_INT, {10, 10, 10});
  to.variable("name_assembly_red_var", NC_CHAR, {"num_assembly_red_var", "len_name"});
  to.variable("vals_assembly_red_var1", NC_DOUBLE, {"time_step", "num_assembly_red_var"});
  to.variable("name_elem_red_var", NC_CHAR, {"num_elem_red_var", "len_name"});
  to.variable("vals_elem_red_var2", NC_FLOAT, {"time_step", "num_elem_red_var"});
  to.variable("vals_blob_var1blob1", NC_DOUBLE, {"time_step", "num_values_blob1"});
}

// Adds items that every kind of netCDF file can store.
inline void add_unknown(Additions& to) {
  to.dimension("three", 3);
  to.dimension("five", 5);
  to.text(NC_GLOBAL, "empty", "");
  to.text(NC_GLOBAL, "odd text", std::string("a\tb\n%41\0\xc3\xa9 \\ \"quoted\"", 21));
  to.numbers<double>(NC_GLOBAL, "odd", NC_DOUBLE, {-0.0, std::nan(""), 1e-310, INFINITY});
  to.numbers<short>(NC_GLOBAL, "none", NC_SHORT, {});
  to.numbers<signed char>(NC_GLOBAL, "bytes", NC_BYTE, {-128, 127});
  to.text(to.variable("a name with (brackets), 100% & spaces", NC_SHORT, {"three"}), "units", "K");
  to.variable("alone", NC_DOUBLE, {});
  to.variable("letter", NC_CHAR, {});
  to.variable("three", NC_FLOAT, {"three"});  // a variable with the same name as its dimension
  to.variable("velocity", NC_FLOAT, {"num_nodes", "three"});
  to.variable("velocity_by_axis", NC_FLOAT, {"three", "num_nodes"});
  to.variable("history", NC_DOUBLE, {"time_step", "three", "five", "num_nodes"});
  to.variable("history_of_cells", NC_DOUBLE, {"time_step", "num_elem", "three"});
  to.variable("node_label", NC_CHAR, {"num_nodes", "five"});
  to.variable("square", NC_BYTE, {"num_nodes", "num_nodes"});
  to.variable("monitor", NC_INT, {"time_step"});
  const int filled = to.variable("has_fill_value", NC_INT, {"five"});
  to.numbers<int>(filled, "_FillValue", NC_INT, {-999});
  // These variables have the names of Exodus variables, but types and shapes that Exodus does not
  // use.
  to.variable("node_ns77", NC_DOUBLE, {"three", "five"});
  to.variable("elem_ss88", NC_CHAR, {"five"});
  to.variable("elem_els55", NC_SHORT, {"three"});
  to.variable("vals_nod_var9", NC_INT, {"time_step", "num_nodes"});
  to.variable("vals_nod_var12", NC_DOUBLE, {"five"});
  to.variable("vals_elem_var2eb2", NC_INT, {"time_step", "num_el_in_blk2"});
  to.variable("vals_elem_var7eb999", NC_DOUBLE, {"five"});
  to.variable("connect99", NC_FLOAT, {"five"});
  int taken = -1;
  const bool together = nc_inq_varid(to.id(), "coord", &taken) == NC_NOERR;
  to.variable(together ? "coordx" : "coord", NC_INT, {"num_nodes"});
  to.variable("attrib3000", NC_INT, {"num_nodes"});
  to.variable("ebconn99", NC_INT, {"five"});
}

// Adds items that need the complete netCDF-4 model.
inline void add_netcdf4(Additions& to) {
  to.dimension("runs", NC_UNLIMITED);
  to.dimension("never", NC_UNLIMITED);
  to.variable("by_run", NC_UINT64, {"runs", "five"});
  to.variable("runs_last", NC_INT64, {"five", "runs"});
  to.variable("nothing_yet", NC_DOUBLE, {"never", "three"});
  for (const auto& [name, type] :
       {std::pair("ubyte", NC_UBYTE), std::pair("ushort", NC_USHORT), std::pair("uint", NC_UINT),
        std::pair("int64", NC_INT64), std::pair("uint64", NC_UINT64)})
    to.variable(name, type, {"three"});
  const int words = to.variable("words", NC_STRING, {"three", "five"});
  to.variable("word", NC_STRING, {});
  to.variable("node_words", NC_STRING, {"num_nodes"});
  const std::vector<const char*> texts{"", "two\twords", "\xc3\xa9"};
  to.good(nc_put_att_string(to.id(), words, "texts", 3, const_cast<const char**>(texts.data())),
          "texts");
  to.good(nc_put_att_string(to.id(), NC_GLOBAL, "no_texts", 0, nullptr), "no texts");
  to.numbers<std::uint64_t>(words, "huge", NC_UINT64, {~std::uint64_t{0}});
  to.numbers<std::uint64_t>(words, "no_numbers", NC_UINT64, {});
}

inline void add_storage(Additions& to) {
  const auto chunked = [&](const char* name, nc_type type) {
    const int variable = to.variable(name, type, {"num_nodes", "three"});
    const std::size_t chunks[2] = {17, 2};
    to.good(nc_def_var_chunking(to.id(), variable, NC_CHUNKED, chunks), name);
    return variable;
  };
  const int deflated = chunked("deflated", NC_DOUBLE);
  to.good(nc_def_var_deflate(to.id(), deflated, 0, 1, 9), "deflate");
  const int shuffled = chunked("shuffled", NC_INT);
  to.good(nc_def_var_deflate(to.id(), shuffled, 1, 0, 0), "shuffle");
  to.good(nc_def_var_fletcher32(to.id(), shuffled, NC_FLETCHER32), "checksum");
  to.good(nc_def_var_endian(to.id(), chunked("big_end", NC_INT), NC_ENDIAN_BIG), "endian");
  to.good(
      nc_def_var_endian(to.id(), to.variable("big_end_whole", NC_DOUBLE, {"five"}), NC_ENDIAN_BIG),
      "endian");
  const int compact = to.variable("compact", NC_INT, {"five"});
  to.good(nc_def_var_chunking(to.id(), compact, NC_COMPACT, nullptr), "compact");
  to.good(nc_def_var_fill(to.id(), chunked("unfilled", NC_INT), NC_NOFILL, nullptr), "fill");
  constexpr unsigned kBzip2 = 307, kZstandard = 32015, kSzip = 4;
  const unsigned level = 5, szip[2] = {32, 16};
  if (nc_inq_filter_avail(to.id(), kBzip2) == NC_NOERR)
    to.good(nc_def_var_filter(to.id(), chunked("bzip2", NC_INT), kBzip2, 1, &level), "bzip2");
  if (nc_inq_filter_avail(to.id(), kZstandard) == NC_NOERR)
    to.good(nc_def_var_filter(to.id(), chunked("zstandard", NC_INT), kZstandard, 1, &level),
            "zstandard");
  if (nc_inq_filter_avail(to.id(), kSzip) == NC_NOERR)
    to.good(nc_def_var_filter(to.id(), chunked("szip", NC_INT), kSzip, 2, szip), "szip");
}

inline void add_oddities(const std::string& path) {
  Additions to(path);
  add_assemblies_and_blobs(to);
  add_unknown(to);
  if (to.enhanced()) add_netcdf4(to);
  if (to.hdf5()) add_storage(to);
}

// Reads, through netCDF, all variables that have exactly one dimension of nodes or elements.
// Returns one sentence per node or element, which contains the id of the node or element.
inline std::multiset<std::string> told_by_netcdf(const std::string& path) {
  std::multiset<std::string> sentences;
  int id = -1, variables = 0;
  if (nc_open(path.c_str(), NC_NOWRITE, &id) != NC_NOERR) return sentences;
  nc_inq_nvars(id, &variables);
  const auto ids_in = [&](const char* map, std::size_t count) {
    std::vector<long long> ids(count);
    int variable = -1;
    if (nc_inq_varid(id, map, &variable) == NC_NOERR) nc_get_var_longlong(id, variable, ids.data());
    return ids;
  };
  for (int v = 0; v < variables; ++v) {
    char name[NC_MAX_NAME + 1], dimension[NC_MAX_NAME + 1];
    nc_type type = 0;
    int rank = 0, used[NC_MAX_VAR_DIMS];
    nc_inq_var(id, v, name, &type, &rank, used, nullptr);
    std::vector<std::size_t> lengths(static_cast<std::size_t>(rank));
    std::size_t size = 1, inner = 1, at = 0;
    int found = 0;
    std::string entity;
    for (std::size_t d = 0; d < lengths.size(); ++d) {
      nc_inq_dim(id, used[d], dimension, &lengths[d]);
      size *= lengths[d];
      inner *= lengths[d];
      if (std::strcmp(dimension, "num_nodes") != 0 && std::strcmp(dimension, "num_elem") != 0)
        continue;
      entity = dimension;
      inner = 1;
      at = d;
      ++found;
    }
    if (found != 1 || type == NC_STRING || size == 0) continue;
    std::vector<double> values(size);
    if (type == NC_CHAR) {
      std::string letters(size, ' ');
      nc_get_var_text(id, v, letters.data());
      values.assign(letters.begin(), letters.end());
    } else {
      nc_get_var_double(id, v, values.data());
    }
    const auto ids = ids_in(entity == "num_nodes" ? "node_num_map" : "elem_num_map", lengths[at]);
    for (std::size_t i = 0; i < lengths[at]; ++i) {
      std::ostringstream text;
      text.precision(17);
      text << name << " of " << ids[i] << ':';
      for (std::size_t k = 0; k < size; ++k)
        if (k / inner % lengths[at] == i) text << ' ' << values[k];
      sentences.insert(text.str());
    }
  }
  nc_close(id);
  return sentences;
}

}  // namespace shm::exodus_files
