#pragma once

#include <algorithm>
#include <cmath>
#include <numbers>

#include "fuse/steps.hpp"
#include "sila/fuse/fuse.hpp"

namespace sila {

/// Cells first .. last of one row, all with the same arrow.
inline MotionPrimitive row_of_arrows(int first, int last, double length = 1.0, double degrees = 0.0,
                                     double weight = 1.0) {
  const double angle = degrees * std::numbers::pi / 180.0;
  MotionPrimitive primitive{{}, weight};
  for (int x = first; x <= last; ++x) {
    primitive.cells.push_back({CellKey{x, 0}, length * Vector2(std::cos(angle), std::sin(angle))});
  }
  return primitive;
}

/// Counts of the decisions of a fusion, and of how the transitions of its result were made.
struct FuseCounts {
  int one_to_one = 0, case_1 = 0, case_2 = 0, case_3 = 0, relaxed = 0;
  int copied = 0, refitted = 0, fused = 0;
  double split_credit = 0.0;
};

inline FuseCounts counts_of(const FusionPlan& plan, const Model& previous, const Increment& incoming) {
  FuseCounts counts;
  for (const FusionComponent& component : plan.components) {
    counts.relaxed += static_cast<int>(component.relaxed.size());
    for (const FusionDecision& decision : component.decisions) {
      counts.one_to_one += decision.reason == FusionReason::one_to_one;
      counts.case_1 += decision.reason == FusionReason::case_1;
      counts.case_2 += decision.reason == FusionReason::case_2;
      counts.case_3 += decision.reason == FusionReason::case_3 || decision.reason == FusionReason::case_3_stronger;
    }
  }
  for (const TransitionGroup& group : plan.groups) {
    const std::vector<FieldSource> sources = sources_of(group, previous, incoming);
    const bool single = sources.size() == 1;
    const bool fresh =
        std::ranges::all_of(sources, [](const FieldSource& source) { return source.samples != nullptr; });
    counts.copied += single;
    counts.refitted += !single && fresh;
    counts.fused += !single && !fresh;
    counts.split_credit += group.credit;
  }
  return counts;
}

inline FuseConfig with_threshold(double threshold) {
  FuseConfig config;
  config.similarity_threshold = threshold;
  return config;
}

inline bool same(const FlowField& a, const FlowField& b) {
  return a.gp == b.gp && a.extent.min() == b.extent.min() && a.extent.max() == b.extent.max();
}

inline bool same(const MotionPrimitive& a, const MotionPrimitive& b) {
  return a.weight == b.weight && std::equal(a.cells.begin(), a.cells.end(), b.cells.begin(), b.cells.end(),
                                            [](const CellVelocity& c, const CellVelocity& d) {
                                              return c.cell == d.cell && c.velocity == d.velocity;
                                            });
}

}  // namespace sila
