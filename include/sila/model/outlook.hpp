#pragma once

#include <Eigen/Core>
#include <concepts>
#include <optional>
#include <span>
#include <vector>

#include "sila/core/fields.hpp"
#include "sila/core/trajectory.hpp"
#include "sila/gp/config.hpp"
#include "sila/gp/sparse_gp.hpp"
#include "sila/model/conventions.hpp"

namespace sila {

/// How outlooks are learnt: for each transition, a sparse GP from how somebody comes along (place, velocity, mean
/// velocity) to how their path will part from constant velocity. Lengths in metres become widths when a model begins.
/// Source: none in the paper; docs/decisions/0070-outlooks.md.
struct OutlookConfig {
  bool enabled = true;
  int knots = 4;
  double place_scale_m = 2.0;
  double velocity_scale_mps = 0.45;
  double mean_velocity_scale_mps = 0.5;
  double signal_std_mps = 0.4;
  double noise_std_mps = 0.33;
  double every_s = 0.8;
  double min_seen_share = 0.75;
  int max_pseudo_inputs = 120;
  double selection_stop = 0.1;
  double settled_share = GpConfig().settled_share;
  double gait_scale_mps = 0.9;
  int gait_pseudo_inputs = 40;
};

template <class Config, class Visitor>
requires std::same_as<std::remove_const_t<Config>, OutlookConfig>
void fields(Config& config, Visitor&& visit) {
  visit.flag("enabled", config.enabled,
             "learn with each transition how paths part from constant velocity (paper: off)");
  visit.number("knots", config.knots, Range{1, 20}, "-", "times until the horizon at which the parting is learnt");
  visit.number("place_scale_m", config.place_scale_m, Range{0.05, 100.0}, "m", "places this near are alike");
  visit.number("velocity_scale_mps", config.velocity_scale_mps, Range{0.01, 20.0}, "m/s",
               "velocities of the last 0.8 s this near are alike");
  visit.number("mean_velocity_scale_mps", config.mean_velocity_scale_mps, Range{0.01, 20.0}, "m/s",
               "velocities of the last 3 s this near are alike");
  visit.number("signal_std_mps", config.signal_std_mps, Range{0.01, 20.0}, "m/s",
               "how far paths part from constant velocity, a priori");
  visit.number("noise_std_mps", config.noise_std_mps, Range{0.01, 20.0}, "m/s",
               "how far people who come along alike part from one another");
  visit.number("every_s", config.every_s, Range{0.0, 60.0, true}, "s", "between the examples of a track");
  visit.number("min_seen_share", config.min_seen_share, Range{0.0, 1.0, true}, "of the horizon",
               "what must be seen of the future of an example");
  visit.number("max_pseudo_inputs", config.max_pseudo_inputs, Range{1, 1000}, "-", "most pseudo-inputs of an outlook");
  visit.number("selection_stop", config.selection_stop, Range{0.0, 1.0}, "of the signal variance",
               "no more pseudo-inputs once every conditional variance is below this");
  visit.number("settled_share", config.settled_share, Range{0.0, 1.0}, "of the points",
               "an outlook that has seen so much of all, and has as many pseudo-inputs as it may, keeps them in a "
               "fusion; 1: none");
  visit.number("gait_scale_mps", config.gait_scale_mps, Range{0.01, 100.0}, "m/s",
               "ways of walking whose velocities of the last 0.8 s are this near are alike, whatever the place");
  visit.number("gait_pseudo_inputs", config.gait_pseudo_inputs, Range{1, 1000}, "-",
               "most pseudo-inputs of what is known of walking whatever the place");
}

/// Constant velocity is the mean velocity of the last so many seconds.
inline constexpr double kConstantVelocityWindow_s = 0.8;
/// Position, velocity of the last 0.8 s, mean velocity of the last 3 s: curb coordinates.
inline constexpr int kOutlookInputs = 6;
using OutlookState = Eigen::Matrix<double, kOutlookInputs, 1>;

/// One moment of a track, and what came after it.
struct OutlookExample {
  double t0_s = 0.0;
  OutlookState state = OutlookState::Zero();
  /// Mean velocity from t0 to each knot minus constant velocity [widths/s]: x, y of the first knot, of the second, ...
  Eigen::VectorXd partings;
  /// The same whatever the place (see gait.hpp): how walking has been; partings ahead and left [m/s].
  Eigen::Matrix<double, 7, 1> gait = Eigen::Matrix<double, 7, 1>::Zero();
  Eigen::VectorXd gait_partings;
};

OutlookState outlook_state(const CurbTrajectory& observed);

/// The example of an observed path and its future (at the path's interval), if at least `min_seen_share` of the horizon
/// was seen; the last that was seen then stands for later knots. `conventions` say where the knots are.
std::optional<OutlookExample> outlook_example(const CurbTrajectory& observed, std::span<const Vector2> future_m,
                                              const Conventions& conventions, double min_seen_share);

Hyperparameters outlook_hyperparameters(const Conventions& conventions, const OutlookConfig& config);

/// How the sparse GPs of outlooks are fitted and fused: their mean is zero, so that far from all examples constant
/// velocity is left.
GpConfig outlook_gp_config(const OutlookConfig& config);

}  // namespace sila
