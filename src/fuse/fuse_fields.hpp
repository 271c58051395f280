#pragma once

#include <utility>
#include <vector>

#include "sila/gp/sparse_gp.hpp"
#include "sila/model/fusion_problem.hpp"
#include "sila/model/increment.hpp"

namespace sila {

/// The transitions that become one transition: GPs without data, and transitions with samples.
struct FieldSources {
  std::vector<const Transition*> stored;  ///< their data are gone
  std::vector<const Transition*> fresh;   ///< their samples are at hand: `samples`, in the same order
  std::vector<const TransitionSamples*> samples;
};

/// The flow field of all sources. A single source is copied bit for bit. Samples replace the GPs that were trained on
/// them, so no data counts twice. Source: SILA paper, Alg. 2, FuseGP; docs/method.md, Fusion.
/// Differs: docs/decisions/0045.
FlowField fuse_fields(const FieldSources& sources, const GpConfig& config);

/// A transition of a model by its (from, to). Precondition: the model has it.
const Transition& transition_at(const Model& model, std::pair<int, int> edge);

/// The sources of a group of transitions.
FieldSources sources_of(const TransitionGroup& group, const Model& previous, const Increment& incoming);

/// Columns of `inputs` and rows of `outputs` of all samples.
GpData pooled(const std::vector<const TransitionSamples*>& samples, Eigen::MatrixXd TransitionSamples::*inputs,
              Eigen::MatrixXd TransitionSamples::*outputs);

}  // namespace sila
