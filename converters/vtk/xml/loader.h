// ArrayLoader: finds and reads the arrays in the XML tree of a VTU file. In the tree, it replaces
// the numbers of each array with a word that names the mesh array or the extra in which these
// numbers are stored.
#pragma once

#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <string_view>

#include "base/spool.h"
#include "mesh/mesh_source.h"
#include "vtk/xml/payload.h"
#include "vtk/xml_document.h"
#include "vtk/xml_words.h"

namespace shm::converters::vtu {

inline constexpr std::uint64_t kNoLimit = ~std::uint64_t{0};

class ArrayLoader {
 public:
  // Reads the attributes of the root element. `document` and `info` are borrowed. Throws Failure if
  // an attribute is invalid.
  ArrayLoader(std::string path, Document& document, MeshInfo& info);

  std::optional<ArrayType> type_of(const Node& array) const;
  std::uint64_t components_of(const Node& array) const;
  // Returns the value of an attribute. Throws Failure unless the attribute exists and is a
  // non-negative integer.
  std::uint64_t count_attribute(const Node& node, std::string_view key) const;

  // Reads at most `most` numbers of an array, and passes them to `take` in pieces. Returns the
  // count of numbers that were read.
  std::uint64_t read(Node& array, const ArrayType& type, std::uint64_t most,
                     const PayloadReader::Take& take);
  // Reads exactly `count` numbers of an array and appends them to `out`.
  void load(Node& array, const ArrayType& type, std::uint64_t count, PagedArray& out);
  // Returns true if both arrays refer to the same bytes of the file. If an array is the same at
  // several time steps, VTK writes its values only once, and the arrays of these steps all refer to
  // the same bytes.
  static bool same_place(const Node& a, const Node& b);
  // Returns true if both arrays have the same values, even if their encodings differ.
  bool same_values(Node& a, Node& b, Spool& spool);
  // Reads the numbers of an array as 64-bit integers, and passes them to `take` in pieces. Returns
  // the count of numbers that were read.
  std::uint64_t read_integers(Node& array, std::uint64_t most,
                              const std::function<void(std::span<const std::int64_t>)>& take);
  // Stores the first `most` values of an array as an extra, or all values if `most` is kNoLimit.
  // Throws Failure if an array of numbers or bits has fewer than `most` values.
  void keep_as_extra(Node& array, std::uint64_t most);
  // Replaces the numbers of an array with `word` in the skeleton (the XML without its numbers, see
  // vtu.h). If the caller needs the numbers, it must read them before this call.
  void mark(Node& array, const std::string& word);
  // Like mark(), for an array that has the same numbers as an array that was marked before. `text`
  // is the text that mark() stored for that earlier array.
  void mark_like(Node& array, const std::string& text);

  [[noreturn]] void fail(ErrorCode code, const Node& node, std::string detail) const;

 private:
  void read_head(Node& root);
  PayloadPlace place_of(Node& array) const;

  std::string path_;
  Document& document_;
  MeshInfo& info_;
  std::shared_ptr<vtk::RandomFile> file_;
  std::uint64_t file_bytes_ = 0;
  Style appended_style_ = Style::base64;
  std::optional<PayloadReader> payload_;
  // For appended arrays that are stored as extras: maps the offset, type and size of an array to
  // the word that mark() stored for it. Arrays that refer to the same bytes thus share one extra.
  std::map<std::string, std::string> kept_;
  std::uint64_t extras_ = 0, extra_bytes_ = 0;
  // For each array that has been read: the size in bytes of its compressed blocks before
  // compression, or 0 if it is not compressed.
  std::map<const Node*, std::uint64_t> block_bytes_;
};

}  // namespace shm::converters::vtu
