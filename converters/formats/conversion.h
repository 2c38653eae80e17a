// Conversion: a mesh, at all of its time steps or some, as the writer of a format takes it: as it
// is where the format is its own, else translated. What the file will lack is known then.
#pragma once

#include <memory>
#include <optional>

#include "base/spool.h"
#include "mesh/chosen_steps.h"
#include "transfer/format.h"
#include "transfer/losses.h"
#include "transfer/own_steps.h"
#include "transfer/piece_output.h"
#include "transfer/translate.h"

namespace shm::converters {

// Whether a file of `format` holds one step of the mesh. `chosen`: which is asked for.
bool holds_one_step(const MeshInfo& info, const Format& format, bool chosen);

class Conversion {
 public:
  // `steps`: these alone, a single one where holds_one_step(); none: all, or the last. `mesh` and
  // `spool` must outlive the conversion.
  Conversion(MeshSource& mesh, const Format& format, std::optional<StepRange> steps, Spool& spool);
  MeshSource& mesh() { return *mesh_; }
  const LossList& losses() const { return losses_; }

 private:
  void keep_format(MeshSource& mesh, StepRange steps, Spool& spool);
  void translate(MeshSource& mesh, const Capabilities& target, std::optional<StepRange> steps,
                 Spool& spool);

  const Format& format_;
  MeshSource* mesh_;
  std::unique_ptr<OwnSteps> own_;
  std::optional<Translation> translation_;
  std::optional<FromElsewhere> elsewhere_;
  LossList losses_;
};

}  // namespace shm::converters
