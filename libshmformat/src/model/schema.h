// Schema and extras as bytes, what a schema must satisfy, and the names of what stands in it.
// spec: "Schema", "Extras"
#pragma once

#include <span>

#include "bytes/binary.h"
#include "shm/reader.h"
#include "shm/schema.h"

namespace shm {

void put(ByteWriter& out, const Schema& schema);
/// False when the bytes are no schema; what it means is then checked by check_schema. Stops
/// reading where it passes the limits, so that memory stays within them.
bool get(ByteReader& in, Schema& schema, const ReadLimits& limits);
/// Fails with what is wrong with a schema, ErrorCode::misuse or over_limit.
Result<void> check_schema(const Schema& schema, const ReadLimits& limits = {});

/// Whether it has arrays with time steps.
bool has_steps(const Schema& schema);

void put(ByteWriter& out, const Extra& extra);
bool get(ByteReader& in, Extra& extra);

}  // namespace shm
