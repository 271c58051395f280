#pragma once

#include "fuse/fuse_fields.hpp"
#include "refine/residual.hpp"
#include "sila/fuse/fuse.hpp"
#include "sila/learn/learn.hpp"

// SILA's verbs with the refinement: the same names with one more argument. The paper's part of the result equals that
// of the verb alone; residual GPs are learnt by the segments and merged by the fusion plan that the verb returns.

namespace sila {

/// The settings of a model that learns residual GPs until `horizon_s`.
ModelSettings with_residuals(ModelSettings settings, double horizon_s, const ResidualConfig& config);

LearnResult learn(const Batch& batch, const ModelSettings& settings, const LearnConfig& config,
                  const ResidualConfig& residual, SiteSharing sharing = SiteSharing::shared);
FuseResult fuse(const Model& previous, const Increment& incoming, const FuseConfig& config,
                const ResidualConfig& residual);
FuseResult accumulate(const Model& previous, const Increment& incoming, const ResidualConfig& residual);

/// The residual GP of a group of transitions; without points if no source has one. Samples replace the GPs that were
/// trained on them.
SparseGp merged_residual(const FieldSources& sources, const GpConfig& config);

}  // namespace sila
