#pragma once

#include <utility>
#include <vector>

#include "gp/fit.hpp"
#include "sila/gp/sparse_gp.hpp"
#include "sila/model/fusion_problem.hpp"
#include "sila/model/increment.hpp"

namespace sila {

/// The transitions that become one: with samples, or as GPs alone.
struct FieldSources {
  std::vector<const Transition*> stored;  ///< their data are gone
  std::vector<const Transition*> fresh;   ///< their samples are at hand: `samples`, in the same order
  std::vector<const TransitionSamples*> samples;
};

enum class FieldOrigin { copied, refitted, fused };

FieldOrigin origin_of(const FieldSources& sources);

/// One flow field of all. A single source is copied bit for bit; samples replace the GPs that were trained on them,
/// never both. Source: SILA paper, Alg. 2, FuseGP; docs/method.md, Fusion. Differs: docs/decisions/0045.
FlowField fuse_fields(const FieldSources& sources, const GpConfig& config);

/// A transition of a model, which must have it.
const Transition& transition_at(const Model& model, std::pair<int, int> edge);

/// The sources of a group of transitions.
FieldSources sources_of(const TransitionGroup& group, const Model& previous, const Increment& incoming);

/// Columns of `inputs` and rows of `outputs` of all samples.
GpData pooled(const std::vector<const TransitionSamples*>& samples, Eigen::MatrixXd TransitionSamples::*inputs,
              Eigen::MatrixXd TransitionSamples::*outputs);

/// Kernel and noise of GPs: theirs if they agree, otherwise the mean that their fusion takes.
Hyperparameters common_hyperparameters(const std::vector<const SparseGp*>& gps, const GpConfig& config);

}  // namespace sila
