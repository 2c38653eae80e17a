#include "tool/output_name.h"

#include "base/failure.h"
#include "formats/formats.h"

namespace shm::converters {
namespace {

bool holds_every_step(const Format& format) { return format.capabilities.every_step; }

// Describes data of the mesh that would be lost in format `target`, but not in format `named`.
// Returns an empty string if no such data exists.
std::string what_is_lost(const Format& target, const Format& named, const MeshInfo& mesh,
                         std::optional<StepRange> steps, const LossList& losses) {
  const std::size_t all = mesh.step_times.size();
  if (all > 1 && !steps && !holds_every_step(target) && holds_every_step(named))
    return std::to_string(all - 1) + " of " + std::to_string(all) + " time steps";
  if (losses.empty() || is_foreign(mesh, named)) return {};
  if (losses.size() == 1) return losses.front();
  return losses.front() + " and " + std::to_string(losses.size() - 1) + " more";
}

}  // namespace

void check_output_name(const std::string& output, const Format& target, const MeshInfo& mesh,
                       std::optional<StepRange> steps, const LossList& losses) {
  const Format* named = format_of_name(output);
  if (named == nullptr || named->name == target.name) return;
  const std::string lost = what_is_lost(target, *named, mesh, steps, losses);
  if (lost.empty()) return;
  throw Failure(ErrorCode::misuse,
                "is named like a file of format " + std::string(named->name) +
                    ", which would hold data that --format " + std::string(target.name) +
                    " loses: " + lost + "; leave --format out, or give OUT a name that ends in " +
                    std::string(target.extensions[0]),
                output);
}

}  // namespace shm::converters
