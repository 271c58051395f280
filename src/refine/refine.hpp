#pragma once

#include <span>

#include "refine/residual.hpp"
#include "sila/fuse/fuse.hpp"
#include "sila/gp/sparse_gp.hpp"
#include "sila/learn/learn.hpp"

// SILA's verbs with the refinement: the same names with one more argument. The paper's part of the result equals that
// of the verb alone; residual GPs are learnt by the segments and merged by the fusion plan that the verb returns.

namespace sila {

LearnResult learn(const Batch& batch, const ModelSettings& settings, const LearnConfig& config,
                  const ResidualConfig& residual, SiteSharing sharing = SiteSharing::shared);
FuseResult fuse(const Model& previous, const Increment& incoming, const FuseConfig& config,
                const ResidualConfig& residual);
FuseResult accumulate(const Model& previous, const Increment& incoming, const ResidualConfig& residual);

/// A residual GP that is merged with others.
struct ResidualSource {
  const SparseGp* gp;
  const GpData* samples = nullptr;  ///< that it was trained on; null: they are gone
};

/// The residual GP of a group of transitions; without points if no source has one. Samples replace the GPs that were
/// trained on them.
SparseGp merged_residual(std::span<const ResidualSource> sources, const GpConfig& config);

}  // namespace sila
