#pragma once

#include <array>
#include <concepts>
#include <cstdint>
#include <limits>
#include <map>
#include <type_traits>
#include <vector>

#include "sila/core/fields.hpp"
#include "sila/fuse/config.hpp"
#include "sila/model/model.hpp"
#include "sila/refine/residual.hpp"

namespace sila {

/// What a model need not keep apart, and what it need not keep at all.
/// Source: none in the paper, whose models grow for ever; docs/decisions/0047-compaction.md.
struct CompactConfig {
  bool enabled = true;
  /// A transition seen at most so often is absorbed by one that agrees with it [trajectories].
  static constexpr double max_count = 3.0;
  /// Of its pseudo-inputs, which the other field must know.
  static constexpr double agreement_share = 0.8;
  double known_ratio = 0.4;
  /// Fields whose root mean square difference there is below this agree [m/s].
  static constexpr double agreement_mps = 0.3;
  double forget_count = 3.0;
  double forget_after_episodes = 10.0;
  double half_life_episodes = std::numeric_limits<double>::infinity();
};

template <class Config, class Visitor>
requires std::same_as<std::remove_const_t<Config>, CompactConfig>
void fields(Config& config, Visitor&& visit) {
  const double none = std::numeric_limits<double>::infinity();
  visit.flag("enabled", config.enabled, "absorb and forget transitions that are rare after each episode (paper: off)");
  visit.number("known_ratio", config.known_ratio, Range{0.0, 1.0, true}, "of the signal variance",
               "a field knows a place where its variance is below this");
  visit.number("forget_count", config.forget_count, Range{0.0, none}, "trajectories",
               "a transition seen at most so often is not kept for itself where another one knows its place");
  visit.number("forget_after_episodes", config.forget_after_episodes, Range{1.0, none}, "episodes",
               "of its site after this long without being seen, whatever that other one says");
  visit.number("half_life_episodes", config.half_life_episodes, Range{0.0, none, true}, "episodes",
               "after which all that was learnt counts half, whether or not the rest of this group is enabled");
}

/// What compaction did.
struct CompactReport {
  int absorbed = 0;    ///< transitions that became part of another one
  int forgotten = 0;   ///< transitions that have faded where nobody else knows the place
  int primitives = 0;  ///< that no transition touches any more
};

/// The transitions of a model that was compacted, as they were left: of two that are still so, neither absorbs the
/// other, and they need not be compared again.
class Settled {
 public:
  Settled() = default;
  Settled(const Model& compacted, const CompactConfig& config);

  /// Whether the transition is as it was left.
  bool holds(const Transition& transition) const { return old_before_.contains(mark_of(transition)); }
  /// Whether it is, and had not been seen for long even then.
  bool holds_as_old(const Transition& transition) const;

 private:
  /// Others hardly ever have it: how often and where it was seen.
  using Mark = std::array<std::uint64_t, 4>;
  static Mark mark_of(const Transition& transition);

  std::map<Mark, bool> old_before_;
};

/// A smaller model and how it came about.
struct Compacted {
  Model model;
  CompactReport report;
  std::vector<int> kept;  ///< the primitives that stay, by their old index
  Settled settled;
};

/// Absorbs rare transitions into those whose fields agree with them (counts add, fields and residual GPs are fused),
/// and those not seen again for long into one that knows their place, whatever it says; forgets what has faded where
/// nobody else knows the place, and drops primitives that no transition touches. Of sites that are apart a transition
/// absorbs only what is of its own site. Never grows a model; compacting twice
/// is compacting once. With `enabled` false the model itself, bit for bit. `before`: what an earlier call with the same
/// configuration left, which saves work and changes nothing. Throws: std::invalid_argument for a field out of range.
Compacted compact(Model model, const CompactConfig& config, const FuseConfig& fusing = {},
                  const ResidualConfig& residual = {}, const Settled& before = {});

}  // namespace sila
