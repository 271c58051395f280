#pragma once

#include "sila/fuse/config.hpp"
#include "sila/model/fusion_problem.hpp"
#include "sila/model/increment.hpp"
#include "sila/model/model.hpp"

namespace sila {

/// Counts of the decisions of a fusion.
struct FuseReport {
  int one_to_one = 0;  ///< components, or what relaxing left of them, by what became of them
  int case_1 = 0;
  int case_2 = 0;
  int case_3 = 0;           ///< with those of which the stronger pair was fused
  int apart = 0;            ///< only with strict_relax
  int relaxed = 0;          ///< similarity edges removed
  int copied = 0;           ///< transitions taken over bit for bit
  int refitted = 0;         ///< transitions only of the increment that became one: fitted to their pooled samples
  int fused = 0;            ///< transitions whose GPs were fused
  double split_credit = 0;  ///< by which the counts of the model exceed the sum of those that came in
};

/// A fused model and how it came about. `explain_fusion(name, problem, config, plan)` writes it down.
struct FuseResult {
  Model model;
  FusionProblem problem;
  FusionPlan plan;
  FuseReport report;
};

/// SILA: M(n) from M(n-1) and M'(n). Previous primitives keep their order, those of the increment that are new follow.
/// The first episode gives the increment's model, an increment without primitives leaves all primitives and transitions
/// as they are. Where GPs are fused, samples of the increment replace its GPs; without samples its GPs are fused
/// as stored. Sites are joined; episodes, tracks and error statistics add. The same on any number of threads. Throws:
/// std::invalid_argument for a field out of range, settings that differ, samples that do not belong to the
/// transitions, sites that are shared and must be apart. Source: SILA paper, Alg. 1 and 2. Differs: docs/decisions/0040
/// to 0046, 0097.
FuseResult fuse(const Model& previous, const Increment& incoming, const FuseConfig& config = {});

/// Standard incremental learning: all that was known and all that came, side by side. Equals `fuse` with a threshold
/// that nothing reaches. Throws: as fuse. Source: SILA paper, second baseline.
FuseResult accumulate(const Model& previous, const Increment& incoming);

/// How the previous and the incoming model become one: which primitives are fused, which are replaced by two others,
/// where each transition then begins and ends. The result does not depend on the order of the lists in the problem.
/// Throws: std::invalid_argument if validate(problem) does.
/// Source: SILA paper, Alg. 1 and the edges of Alg. 2. Differs: docs/decisions/0040 to 0043.
FusionPlan plan_fusion(const FusionProblem& problem, const FusionRules& rules = {});

}  // namespace sila
