#pragma once

#include "sila/fuse/fuse.hpp"
#include "sila/learn/learn.hpp"
#include "sila/refine/config.hpp"

// SILA's verbs with the refinement: the same names with one more argument. The paper's part of the result equals that
// of the verb alone; residual GPs are learnt by the segments and merged by the fusion plan that the verb returns.

namespace sila {

LearnResult learn(const Batch& batch, const ModelSettings& settings, const LearnConfig& config,
                  const ResidualConfig& residual, SiteSharing sharing = SiteSharing::shared);
FuseResult fuse(const Model& previous, const Increment& incoming, const FuseConfig& config,
                const ResidualConfig& residual);
FuseResult accumulate(const Model& previous, const Increment& incoming, const ResidualConfig& residual);

}  // namespace sila
