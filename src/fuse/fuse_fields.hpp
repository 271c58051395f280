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

/// The model and the index of a transition, by its (from, to) in joint indices. Precondition: one of the models has it.
std::pair<const Model*, std::size_t> source_of(std::pair<int, int> edge, const Model& previous, const Model& incoming);

/// The sources of a group of transitions.
FieldSources sources_of(const TransitionGroup& group, const Model& previous, const Increment& incoming);

/// Columns of `inputs` and rows of `outputs` of all samples.
template <class Samples>
GpData pooled(const std::vector<const Samples*>& samples, Eigen::MatrixXd Samples::*inputs,
              Eigen::MatrixXd Samples::*outputs) {
  Eigen::Index points = 0;
  for (const Samples* part : samples) points += (part->*inputs).cols();
  if (samples.empty()) return {};
  GpData data{Eigen::MatrixXd((samples.front()->*inputs).rows(), points),
              Eigen::MatrixXd(points, (samples.front()->*outputs).cols())};
  Eigen::Index filled = 0;
  for (const Samples* part : samples) {
    const Eigen::Index count = (part->*inputs).cols();
    data.inputs.middleCols(filled, count) = part->*inputs;
    data.outputs.middleRows(filled, count) = part->*outputs;
    filled += count;
  }
  return data;
}

}  // namespace sila
