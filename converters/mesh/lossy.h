// Lossy compression: which coordinates and arrays may be rounded, and by how much. The error bound
// holds for every finite value, after rounding to the stored type. Infinities and NaN are restored
// bit by bit. Integers are never rounded.
#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "base/progress.h"
#include "mesh/mesh_source.h"

namespace shm::converters {

struct Accuracy {
  enum class Kind {
    lossless,
    bits,      // fixed number of bits per component, with uniform steps over the bounding box
    absolute,  // maximum error
    relative,  // maximum error as a fraction of the range of the values
  };
  Kind kind = Kind::lossless;
  std::uint32_t bits = 0;  // number of bits, 1..52
  double bound = 0;        // error bound, positive; below 1e300 if absolute, below 1 if relative

  static Accuracy of_bits(std::uint32_t bits) { return {Kind::bits, bits, 0}; }
  static Accuracy absolute(double bound) { return {Kind::absolute, 0, bound}; }
  static Accuracy relative(double bound) { return {Kind::relative, 0, bound}; }
};

// Parses "lossless", "bits=N", "abs=E" or "rel=E". If `text` is invalid, throws Failure (misuse)
// with `option` in the message.
Accuracy parse_accuracy(std::string_view text, const std::string& option);

// The accuracy of one array, given as "NAME:ACCURACY". NAME is "coordinates" or the name of an
// array. To select one of several arrays with the same name, NAME also contains the prefix "point/"
// or "cell/", or the suffix "#2", "#3", ...
struct NamedAccuracy {
  std::string name;
  Accuracy accuracy;
};
NamedAccuracy parse_named_accuracy(const std::string& text, const std::string& option);

struct Lossy {
  Accuracy coordinates;
  // Accuracy of all floating-point arrays without a role. An array with a role has a special
  // meaning in its source format.
  Accuracy fields;

  // Accuracies of single arrays. They override `coordinates` and `fields`.
  std::vector<NamedAccuracy> named;
};

// Stores the quantizations that `lossy` requests in `schema`, whose arrays must be those of the
// mesh. Reads the values of each lossy array once, at all steps, in bounded memory. The range of an
// array covers all its components, blocks and steps. The range of the coordinates is the longest
// side of their bounding box. An array is stored losslessly if its values are so large, or if its
// bound is so small, that rounding would not reduce its encoded size. Throws Failure (misuse) for
// integer arrays, and for names that match no array or several arrays.
void set_accuracy(MeshSource& mesh, const Lossy& lossy, Schema& schema, const Progress& progress);

}  // namespace shm::converters
