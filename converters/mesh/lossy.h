// What may be lost: which coordinates and arrays come back rounded, and how far off they may be.
// A bound is a promise for every finite value, after rounding to the stored type; what is not
// finite comes back bit by bit. Integers are never rounded.
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
    bits,      // uniform over the box of the values
    absolute,  // largest error
    relative,  // largest error as a part of the range of the values
  };
  Kind kind = Kind::lossless;
  std::uint32_t bits = 0;  // 1..52
  double bound = 0;        // absolute: below 1e300; relative: below 1; positive

  static Accuracy of_bits(std::uint32_t bits) { return {Kind::bits, bits, 0}; }
  static Accuracy absolute(double bound) { return {Kind::absolute, 0, bound}; }
  static Accuracy relative(double bound) { return {Kind::relative, 0, bound}; }
};

// "lossless", "bits=N", "abs=E" or "rel=E"; throws misuse, naming `option`.
Accuracy parse_accuracy(std::string_view text, const std::string& option);

// For one array: "NAME:ACCURACY". NAME is "coordinates" or the name of an array, with "point/" or
// "cell/" before it and "#2", "#3", ... behind it where the name alone fits several.
struct NamedAccuracy {
  std::string name;
  Accuracy accuracy;
};
NamedAccuracy parse_named_accuracy(const std::string& text, const std::string& option);

struct Lossy {
  Accuracy coordinates;
  Accuracy fields;                   // all floating-point arrays that are field data
  std::vector<NamedAccuracy> named;  // beats the other two
};

// Puts the quantizations that `lossy` asks for into `schema`, whose arrays are those of the mesh.
// Reads the values of what is lossy once, all steps, in bounded memory. The range of an array goes
// over all its components, blocks and steps; that of coordinates is the largest side of their box.
// Values that are so large, or a bound so small, that rounding would gain nothing stay lossless.
// Throws misuse for names that do not fit and arrays of integers.
void set_accuracy(MeshSource& mesh, const Lossy& lossy, Schema& schema, const Progress& progress);

}  // namespace shm::converters
