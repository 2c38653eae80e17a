// Conversion: prepares a mesh, or some of its time steps, for the writer of a format. If the mesh
// came from the same format, its data is passed to the writer unchanged. Any other mesh is
// translated. losses() lists all data of the mesh that the new file will not contain.
#pragma once

#include <memory>
#include <optional>

#include "base/spool.h"
#include "interface/format.h"
#include "interface/losses.h"
#include "mesh/chosen_steps.h"
#include "transfer/own_steps.h"
#include "transfer/piece_output.h"
#include "transfer/translate.h"

namespace shm::converters {

// Returns true if a file of `format` can contain only one of the time steps of the mesh. `chosen`
// is true if the user selected steps.
bool holds_one_step(const MeshInfo& info, const Format& format, bool chosen);

class Conversion {
 public:
  // `steps` contains the steps to write. If holds_one_step() is true, `steps` must contain a single
  // step. If `steps` is empty, all steps are written, or only the last step if holds_one_step() is
  // true. `mesh` and `spool` must outlive the conversion.
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
