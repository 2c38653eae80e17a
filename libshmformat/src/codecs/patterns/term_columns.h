// The value columns of a segment in patterns: one for the coordinates, one for each static array.
// spec: "Values by terms"
#pragma once

#include <vector>

#include "codecs/patterns/term_column.h"
#include "shm/schema.h"

namespace shm {

/// Returns the columns: column 0 is geometry; the static arrays follow in schema order.
std::vector<TermColumn> term_columns(const Schema& schema);

}  // namespace shm
