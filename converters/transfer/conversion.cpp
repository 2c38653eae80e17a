#include "transfer/conversion.h"

#include <string>

#include "formats/formats.h"

namespace shm::converters {

bool holds_one_step(const MeshInfo& info, const Format& format, bool chosen) {
  if (format.capabilities.every_step) return false;
  return chosen || is_foreign(info, format) || !source_format(info).describes_steps(info);
}

Conversion::Conversion(MeshSource& mesh, const Format& format, std::optional<StepRange> steps,
                       Spool& spool)
    : format_(format), mesh_(&mesh) {
  const MeshInfo& info = mesh.info();
  if (is_foreign(info, format)) {
    translate(mesh, format.capabilities, steps, spool);
    return;
  }
  const std::uint64_t count = info.step_times.size();
  if (!steps && count > 0 && holds_one_step(info, format, false)) {
    steps = StepRange{count - 1, count};
    if (count > 1) losses_.push_back(lost_steps(count, *steps, std::string(format.name)));
  }
  if (steps) keep_format(mesh, *steps, spool);
}

void Conversion::keep_format(MeshSource& mesh, StepRange steps, Spool& spool) {
  own_ = OwnSteps::of(mesh, steps);
  if (own_) {
    mesh_ = own_.get();
    return;
  }
  // Clear Capabilities::sibling. Otherwise, translate() would pass on the extras of the source
  // unchanged, although these extras also describe steps that are not written.
  Capabilities target = format_.capabilities;
  target.sibling = {};
  translate(mesh, target, steps, spool);
  mesh_ = &elsewhere_.emplace(*mesh_, mesh.info());
}

void Conversion::translate(MeshSource& mesh, const Capabilities& target,
                           std::optional<StepRange> steps, Spool& spool) {
  translation_.emplace(mesh, std::string(format_.name), target, steps, spool);
  mesh_ = &translation_->mesh();
  losses_ = translation_->losses();
}

}  // namespace shm::converters
