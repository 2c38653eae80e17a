// The value columns of a segment coded as patterns: one column for the coordinates, and one for
// each static array.
// spec: "Values by terms"
#pragma once

#include <vector>

#include "codecs/patterns/term_column.h"
#include "shm/schema.h"

namespace shm {

/// Returns the columns. Column 0 is geometry; the following columns are the static arrays in schema
/// order.
std::vector<TermColumn> term_columns(const Schema& schema);

}  // namespace shm
