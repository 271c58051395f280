#pragma once

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

/// Merges two residual GPs; the result has no points if neither has any.
SparseGp merge_residuals(const SparseGp& a, const SparseGp& b, const ResidualConfig& config);

}  // namespace sila
