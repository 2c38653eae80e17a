// Translation: adapts a mesh of one format to the writer of another format so that as much data as
// possible is retained, and lists the data that is lost. If the source format is the sibling of the
// target format (Capabilities::sibling), the mesh is not adapted, because the target's writer
// accepts all extras of the source format. In this case, only time steps may be removed: if a file
// of the target format can contain only one step, only one step is kept.
//
// Extras of the translated mesh that the writers of all formats may use:
//   mesh/title               text
//   mesh/node_set/..., mesh/side_set/..., mesh/element_set/...   see transfer_sets.h
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "base/spool.h"
#include "interface/format.h"
#include "interface/losses.h"
#include "mesh/blocks_by_id.h"
#include "mesh/chosen_steps.h"
#include "mesh/mesh_source.h"

namespace shm::converters {

class Translation {
 public:
  // `steps` contains the steps to translate. If a file of the target format can contain only one
  // step, `steps` must contain a single step. If `steps` is empty, all steps are translated, or
  // only the last step if a file can contain only one. `source` and `spool` must outlive the
  // translation. `format` is the name of the target format, for messages about losses. If the
  // source is a part of a decomposed mesh, `blocks` lists the blocks of all parts (see BlocksById).
  Translation(MeshSource& source, const std::string& format, const Capabilities& target,
              std::optional<StepRange> steps, Spool& spool,
              const std::vector<BlocksById::Key>& blocks = {});
  MeshSource& mesh() { return *mesh_; }
  const MeshInfo& info() const { return mesh_->info(); }
  const LossList& losses() const { return losses_; }

 private:
  template <class Layer>
  Layer& add(std::unique_ptr<Layer> layer);
  void split_blocks(const std::vector<BlocksById::Key>& first);
  bool is_sibling() const {
    return !target_.sibling.empty() && from_.schema.source_format == target_.sibling;
  }
  void choose_steps(std::optional<StepRange> steps);
  void take_steps(StepRange steps);
  void carry_sets(Spool& spool);
  void carry_title();
  void report_arrays();
  void report_numbers(const std::vector<BlockInfo>& before);
  void report_blocks();
  void report_name(const std::string& name, const std::string& label);

  const MeshInfo& from_;
  const SourceFormat& source_;
  const std::string format_;
  const Capabilities& target_;
  MeshSource* mesh_;
  std::vector<std::unique_ptr<MeshSource>> layers_;
  std::vector<Extra> extras_;  // extras of the translated mesh
  Keys used_;                  // keys of those extras of the source that have been translated
  LossList losses_;
};

}  // namespace shm::converters
