#pragma once

#include <span>
#include <utility>
#include <vector>

#include "sila/gp/sparse_gp.hpp"
#include "sila/model/fusion_problem.hpp"
#include "sila/model/model.hpp"

namespace sila {

/// A transition that becomes one with others, and its samples; null: they are gone.
struct FieldSource {
  const Transition* transition;
  const GpData* samples = nullptr;
};

/// The flow field of all sources. A single source is copied bit for bit. Samples replace the GPs that were trained on
/// them, so no data counts twice. Source: SILA paper, Alg. 2, FuseGP; docs/method.md, Fusion.
/// Differs: docs/decisions/0045.
FlowField fuse_fields(std::span<const FieldSource> sources, const GpConfig& config);

/// The model and the index of a transition, by its (from, to) in joint indices. Precondition: one of the models has it.
std::pair<const Model*, std::size_t> source_of(std::pair<int, int> edge, const Model& previous, const Model& incoming);

/// The sources of a group of transitions.
std::vector<FieldSource> sources_of(const TransitionGroup& group, const Model& previous, const Increment& incoming);

}  // namespace sila
