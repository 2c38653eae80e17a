// Lossy compression: which coordinates and arrays may be rounded, and by how much. The error bound
// holds for every finite value, after rounding to the stored type. Infinities and NaN are restored
// bit by bit. Integers are never rounded.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "base/progress.h"
#include "mesh/mesh_source.h"

namespace shm::converters {

struct Accuracy {
  enum class Kind {
    lossless,
    bits,       // fixed number of bits per component, with uniform steps over the bounding box
    absolute,   // maximum error
    relative,   // maximum error as a fraction of the range of the values
    rms,        // root mean square of the errors of all values
    psnr,       // peak signal-to-noise ratio in decibels: 20 log10(range / root mean square)
    pointwise,  // maximum error of each value as a fraction of this value
  };
  Kind kind = Kind::lossless;
  std::uint32_t bits = 0;  // number of bits, 1..52
  // Error bound, positive: below 1e300 if absolute or rms, below 1 if relative, at most 300 if
  // psnr, at most 0.5 if pointwise.
  double bound = 0;

  static Accuracy of_bits(std::uint32_t bits) { return {Kind::bits, bits, 0}; }
  static Accuracy absolute(double bound) { return {Kind::absolute, 0, bound}; }
  static Accuracy relative(double bound) { return {Kind::relative, 0, bound}; }
};

// Parses "lossless", "bits=N", "abs=E", "rel=E", "rms=E", "psnr=DB", "pwrel=E" or "digits=N" (N
// significant decimal digits: a pointwise bound of half a unit of digit N). If `text` is invalid,
// throws Failure (misuse) with `option` in the message.
Accuracy parse_accuracy(std::string_view text, const std::string& option);

// The accuracy of some arrays, given as "NAME:ACCURACY" or "NAME@BLOCK:ACCURACY". NAME is
// "coordinates" or selects arrays, see arrays_called(). BLOCK is the name or the id of a block.
struct NamedAccuracy {
  std::string name;
  Accuracy accuracy;
};
NamedAccuracy parse_named_accuracy(const std::string& text, const std::string& option);

// A fill value of some arrays, given as "NAME:fill=VALUE". Returns nothing if `text` is not of this
// form.
struct NamedFill {
  std::string name;
  double value = 0;
};
std::optional<NamedFill> parse_named_fill(const std::string& text, const std::string& option);
// Parses a finite number.
double parse_fill(std::string_view text, const std::string& option);

struct Lossy {
  Accuracy coordinates;
  // Accuracy of all floating-point arrays without a role, except global arrays. An array with a
  // role has a special meaning in its source format. Global arrays take few bytes.
  Accuracy fields;

  // Accuracies of selected arrays. They override `coordinates` and `fields`. An accuracy that names
  // an array exactly overrides all accuracies with wildcards; otherwise the last one applies.
  std::vector<NamedAccuracy> named;

  // Fill values of all floating-point arrays without a role, and of selected arrays, in addition to
  // those that the source file states.
  std::vector<double> fills;
  std::vector<NamedFill> named_fills;
};

// Adds the fill values of `lossy` to the arrays of `schema`. Throws Failure (misuse) for integer
// arrays, and for names that match no array.
void add_fills(const Lossy& lossy, Schema& schema);

// Returns true if `lossy` contains an accuracy of a block.
bool has_block_bounds(const Schema& schema, const Lossy& lossy);

// The accuracy of an array in a block. `is_of_block` is false if it applies to the whole array.
struct BlockAccuracy {
  Accuracy accuracy;
  bool is_of_block = false;
};
// Returns the accuracy in each block, for each array that has an accuracy of a block; the lists of
// other arrays are empty. Throws Failure (misuse) for names that match nothing, and for accuracies
// other than absolute, relative and lossless.
std::vector<std::vector<BlockAccuracy>> accuracies_of_blocks(const Schema& schema,
                                                             const Lossy& lossy);

// Stores the quantizations that `lossy` requests in `schema`, whose arrays must be those of the
// mesh. Reads the values of each lossy array once, at all steps, in bounded memory. The range of an
// array covers all its components, blocks and steps, without fill values. The range of the
// coordinates is the longest side of their bounding box. Prints a warning if a range seems to
// contain values that mark missing data. An array is stored losslessly if its values are so large,
// or if its bound is so small, that rounding would not reduce its encoded size. Throws Failure
// (misuse) for integer arrays, and for names that match no array or several arrays. Arrays with
// block bounds (block_bounds.h) stay lossless, because their values are rounded already.
void set_accuracy(MeshSource& mesh, const Lossy& lossy, Schema& schema, const Progress& progress);

}  // namespace shm::converters
