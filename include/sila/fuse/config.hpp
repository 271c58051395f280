#pragma once

#include <concepts>
#include <type_traits>

#include "sila/core/fields.hpp"
#include "sila/gp/config.hpp"
#include "sila/model/fusion_problem.hpp"
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
  FuseConfig() { split_credit = true; }

  double similarity_threshold = 0.7;
  /// No setting, but a fleet takes the mean by count.
  PrimitiveMean mean = PrimitiveMean::plain;
  /// Arrows shorter than this after a mean are dropped.
  static constexpr double drop_below = 0.05;
  SiteSharing sites = SiteSharing::apart;
  GpConfig gp;
};

template <class Config, class Visitor>
requires std::same_as<std::remove_const_t<Config>, FuseConfig>
void fields(Config& config, Visitor&& visit) {
  visit.number("similarity_threshold", config.similarity_threshold, Range{.min = 0, .max = 1, .open_min = true}, "",
               "primitives this similar may be fused, t_s; 1 fuses exact copies only");
  visit.flag("strict_relax", config.strict_relax, "Alg. 1 literally: relax to two edges even if they do not touch");
  visit.flag("both_directions", config.both_directions, "case 1 looks for a transition between the leaves both ways");
  visit.flag("split_credit", config.split_credit,
             "count those who walked through a split primitive between its two parts");
  visit.flag("literal_self_transitions", config.literal_self_transitions,
             "Alg. 2 literally: the self transition of a split primitive leads back");
  visit.choice("sites", config.sites, kSiteSharings,
               "apart: only what sites have in common fuses, a site predicts by what was seen there; shared: all "
               "sites are laid over each other (paper)");
  visit.choice("gp_fusion", config.gp.fusion, gp_fusion_names,
               "GPs without their data: transfer of the stored information, or weighted pseudo-data (Suk 2012)");
  visit.number("max_pseudo_inputs", config.gp.max_fused_pseudo_inputs, Range{1, 1000}, "",
               "most pseudo-inputs after a fusion");
}

/// Throws: std::invalid_argument for the first field out of its range.
void validate(const FuseConfig& config);

}  // namespace sila
