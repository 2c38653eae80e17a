// Damage: functions that find all damage in a .shm file, and restore files whose chunks are intact.
// To find damage, the functions check the markers of chunks and the checksums of chunks and
// bitstreams; they decode no values. MeshExtractor::open_damaged() (shm/mesh_extract.h) reads the
// intact parts of a damaged file.
// spec: "Container", "Recovery"
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "shm/damage_report.h"
#include "shm/io.h"
#include "shm/reader.h"
#include "shm/schema.h"

namespace shm {

/// Finds all damage in `source`, which is borrowed during the call. Fails if the source cannot be
/// read, is an archive (ErrorCode::unsupported) or contains no part of a .shm file
/// (ErrorCode::corrupt). Chunks with correct checksums count as intact; they are not decoded. (A
/// Reader also checks their contents.) The function reads each byte at most a few times. It needs
/// memory for the largest chunk (ReadLimits::max_chunk_bytes) and a few hundred bytes per chunk.
SHM_API Result<DamageReport> find_damage(RandomSource& source, const ReadLimits& limits = {});

/// Restores a file: writes exactly its original bytes to the sink. All chunks of `source` must be
/// intact, but may be out of place, repeated or mixed with stray bytes. The file start and the
/// trailer are rebuilt. To rebuild a lost index, all chunks are decoded. If
/// DamageReport::has_other_ranges is true, the value ranges in the rebuilt index may differ from
/// those in the original index. The function succeeds if DamageReport::restorable is true, or if
/// DamageReport::lacks_index is true and the index can be rebuilt. Otherwise it fails without
/// writing anything.
SHM_API Result<void> write_in_order(RandomSource& source, ByteSink& sink,
                                    const ReadLimits& limits = {});

}  // namespace shm
