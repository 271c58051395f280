#pragma once

#include <concepts>
#include <limits>
#include <type_traits>
#include <vector>

#include "sila/core/fields.hpp"
#include "sila/fuse/config.hpp"
#include "sila/model/model.hpp"
#include "sila/refine/residual.hpp"

namespace sila {

/// Which transitions become part of others, and which are removed.
/// Source: none in the paper, whose models grow without limit; docs/decisions/0047-pruning.md.
struct PruneConfig {
  bool enabled = true;
  /// A transition seen at most this often is subsumed by one that agrees with it [trajectories].
  static constexpr double max_count = 3.0;
  /// Of its pseudo-inputs, which the other field must know.
  static constexpr double agreement_share = 0.8;
  double known_ratio = 0.4;
  /// Fields whose root mean square difference there is below this agree [m/s].
  static constexpr double agreement_mps = 0.3;
  double expire_count = 3.0;
  double expire_after_episodes = 10.0;
  double half_life_episodes = std::numeric_limits<double>::infinity();
};

template <class Config, class Visitor>
requires std::same_as<std::remove_const_t<Config>, PruneConfig>
void fields(Config& config, Visitor&& visit) {
  const double none = std::numeric_limits<double>::infinity();
  visit.flag("enabled", config.enabled,
             "remove rare transitions that others represent, after each episode (paper: off)");
  visit.number("known_ratio", config.known_ratio, Range{0.0, 1.0, true}, "of the signal variance",
               "a field knows a position where its variance is below this");
  visit.number("expire_count", config.expire_count, Range{0.0, none}, "trajectories",
               "a transition seen at most this often expires where another one knows its place");
  visit.number("expire_after_episodes", config.expire_after_episodes, Range{1.0, none}, "episodes",
               "without an observation, counted at its site, after which such a transition expires");
  visit.number("half_life_episodes", config.half_life_episodes, Range{0.0, none, true}, "episodes",
               "after which all observations count half, also with `enabled` false");
}

struct PruneReport {
  int subsumed = 0;    ///< transitions that became part of another one
  int expired = 0;     ///< transitions removed after exponential forgetting, where no other one knows the place
  int primitives = 0;  ///< removed because no transition touches them any more
};

struct PruneResult {
  Model model;
  PruneReport report;
  std::vector<int> kept;  ///< the primitives that stay, by their old index
};

/// Merges rare transitions into those whose fields agree with them (counts add, fields and residual GPs are fused), and
/// transitions without recent observations into one that knows their place, also if it disagrees. Removes a transition
/// of less than half a trajectory without recent observations where no other one knows the place, and primitives that
/// no transition touches. With sites apart, a transition subsumes only transitions of its own site. Never grows a
/// model; idempotent. With `enabled` false the model itself, bit for bit. Throws: std::invalid_argument for a field out
/// of range.
PruneResult prune(Model model, const PruneConfig& config, const FuseConfig& fusing = {},
                  const ResidualConfig& residual = {});

}  // namespace sila
