#pragma once

#include "sila/core/fields.hpp"
#include "sila/gp/sparse_gp.hpp"
#include "sila/model/fusion_problem.hpp"
#include "sila/model/model.hpp"
#include "sila/model/site.hpp"

namespace sila {

/// How the arrows of fused primitives are averaged, cell by cell.
enum class PrimitiveMean {
  plain,  ///< every primitive counts the same, a missing arrow counts as zero (paper): arrows that disagree become
          ///< short
  count,  ///< as plain, weighted by how many primitives each was made of
};

/// How a model and an increment are fused.
struct FuseConfig : FusionRules {
  FuseConfig() { split_credit = true; }  ///< rules alone, as those of case files, default to false

  double similarity_threshold = 0.7;
  /// Not a setting; distributed training (train/fleet.hpp) uses `count`.
  PrimitiveMean mean = PrimitiveMean::plain;
  /// Arrows shorter than this after a mean are dropped.
  static constexpr double drop_below = 0.05;
  SiteSharing sites = SiteSharing::apart;
  GpConfig gp;
};

void fields(MaybeConst<FuseConfig> auto& config, auto&& visit) {
  visit.number("similarity_threshold", config.similarity_threshold, Range{.min = 0, .max = 1, .open_min = true}, "",
               "primitives this similar may be fused, t_s; 1 fuses exact copies only");
  visit.flag("strict_relax", config.strict_relax, "Alg. 1 literally: relax to two edges even if they do not touch");
  visit.flag("both_directions", config.both_directions, "case 1 looks for a transition between the leaves both ways");
  visit.flag("split_credit", config.split_credit,
             "count the tracks that went through a split primitive between its two parts");
  visit.flag("literal_self_transitions", config.literal_self_transitions,
             "Alg. 2 literally: the self transition of a split primitive leads back");
  visit.choice("sites", config.sites, kSiteSharings,
               "apart: each site is learnt, fused and predicted by itself; shared: all sites are overlaid "
               "by their frames (paper)");
  visit.choice("gp_fusion", config.gp.fusion, gp_fusion_names,
               "GPs without their data: transfer of the stored information, or weighted pseudo-data (Suk 2012)");
}

/// Throws: std::invalid_argument for the first field out of its range.
void validate(const FuseConfig& config);

/// A fused model and how it was made. `explain_fusion(name, problem, config, plan)` writes it down.
struct FuseResult {
  Model model;
  FusionProblem problem;
  FusionPlan plan;
};

/// SILA: M(n) from M(n-1) and M'(n). Previous primitives keep their order; new ones of the increment follow them.
/// If `previous` is empty the result is the model of the increment; an increment without primitives changes no
/// primitive and no transition. Where GPs are fused, samples of the increment replace its GPs; without samples its GPs
/// are fused as stored. Sites are joined; episodes and tracks add. The result does not depend on the
/// number of threads. Throws: std::invalid_argument for a field out of range, settings that differ, samples that do not
/// belong to the transitions, a model with shared sites if they must stay apart. Source: SILA paper, Alg. 1 and 2.
/// Differs: docs/decisions/0040 to 0046, 0097.
FuseResult fuse(const Model& previous, const Increment& incoming, const FuseConfig& config = {});

/// Standard incremental learning: the union of the previous and the incoming model. Equals `fuse` with a threshold
/// that no pair reaches. Throws: as fuse. Source: SILA paper, second baseline.
FuseResult accumulate(const Model& previous, const Increment& incoming);

/// Plans the fusion of two models: which primitives are fused, which are replaced by two others, and where each
/// transition then begins and ends. The result does not depend on the order of the lists in the problem.
/// Throws: std::invalid_argument if validate(problem) does.
/// Source: SILA paper, Alg. 1 and the edges of Alg. 2. Differs: docs/decisions/0040 to 0043.
FusionPlan plan_fusion(const FusionProblem& problem, const FusionRules& rules = {});

}  // namespace sila
