// The Format of AVS UCD files: functions that recognize, open and write files, and the capabilities
// and losses of the format.
#include "ucd/ucd.h"

namespace shm::converters {
namespace {

class UcdSource final : public SourceFormat {
 public:
  bool describes_steps(const MeshInfo&) const override { return false; }
};

constexpr UcdSource kUcdSource;

}  // namespace

constinit const Format kUcdFormat = {
    .name = "ucd",
    .title = "UCD",
    .extensions = {".ucd", ".inp"},
    .looks_like = looks_like_ucd,
    .open = open_ucd,
    .write = [](MeshSource& mesh, const std::string& path, Spool&) { write_ucd(mesh, path); },
    .capabilities = {.integers = false, .block_numbers = true, .times = false, .title_bytes = 0},
    .source = &kUcdSource};

}  // namespace shm::converters
