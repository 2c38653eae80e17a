// Losses: what a format will not hold of a mesh that came from another one, by name, before
// anything is written. Nothing may go silently.
#pragma once

#include <cstddef>
#include <set>
#include <string>
#include <string_view>
#include <vector>

#include "mesh/mesh_source.h"

namespace shm::converters {

// Each for a line on a terminal: "side set 3 'inlet'", "QA records".
using LossList = std::vector<std::string>;

// What a format holds of meshes from elsewhere. A new writer says it in the table of formats.
struct Holds {
  // Node sets, side sets, groups of elements: as such, as arrays (see set_arrays.h), or as cells of
  // their own (set_cells.h).
  enum class Sets { sets, arrays, cells };
  Sets sets = Sets::arrays;
  bool every_step = false;      // else one time step a file
  bool vectors = true;          // arrays with components; else columns
  bool integers = true;         // else all values are floating-point
  bool partial_arrays = false;  // cell arrays on some blocks; else NaN or 0 on the others
  bool block_numbers = false;   // blocks of its own; else their numbers are an array
  bool positive_numbers = false, unique_numbers = false;
  bool times = true;                                // of steps, even when no array has any
  std::size_t title_bytes = ~std::size_t{0};        // most
  bool (*block)(const BlockInfo& block) = nullptr;  // whether it has such cells; null: all
  bool (*name)(const std::string& name) = nullptr;  // whether it is written as it is; null: yes
  // A format whose meshes the writer takes as they are, extras and all, and what it has no words
  // for. Empty: none.
  std::string_view kin = {};
  LossList (*losses_of_kin)(const MeshInfo& info) = nullptr;
};

// The extras of `info` that are not in `told`, in the words of the format that they came from.
LossList losses_of_extras(const MeshInfo& info, const std::set<std::string>& told);

}  // namespace shm::converters
