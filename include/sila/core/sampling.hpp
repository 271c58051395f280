#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <optional>
#include <vector>

#include "sila/core/fields.hpp"
#include "sila/core/trajectory.hpp"

namespace sila {

/// How a track becomes equally spaced positions and velocities.
struct SamplingConfig {
  double interval_s = 0.2;
  double acceleration_density = 2.0;
};

void fields(MaybeConst<SamplingConfig> auto& config, auto&& visit) {
  visit.number("interval_s", config.interval_s, Range{0.01, 2.0}, "s", "time between resampled positions (Delta t)");
  visit.number("acceleration_density", config.acceleration_density, Range{0.0, 1000.0, true}, "m^2/s^3",
               "spectral density of the acceleration of pedestrians: smaller values smooth tracks more");
}

/// Position and velocity of a person at one moment.
struct MotionState {
  Vector2 position_m = Vector2::Zero();
  Vector2 velocity_mps = Vector2::Zero();
};

/// The part of a track that a predictor may use at sample `last`: states every `interval_s`, ending exactly at that
/// sample and reaching back less than `observe_s` (16 states for 3.2 s at 0.2 s), or to the start of a shorter track.
/// Later samples of the track are ignored, so a live program may keep one growing Trajectory for each person. Gaps and
/// jumps are not cut: begin a new Trajectory at one that is beyond CleanConfig (sila/core/clean.hpp).
/// Units: curb units of `frame`, and curb units/s. `observe_s` and `config` are those of the model's configuration.
/// Throws: std::invalid_argument if there is no sample `last`, for a `config` out of range or an observe_s that is not
/// positive, and for times that do not increase or positions that are not finite, in the window or in the second before
/// it. Source: cubic smoothing spline, Wahba 1978; docs/decisions/0108-tracker-noise.md.
CurbTrajectory observe(const Trajectory& track, std::size_t last, const CurbFrame& frame, double observe_s,
                       const SamplingConfig& config);

/// A whole track, for learning: states every `interval_s` from its first sample to its last. Units and Source: as
/// `observe`. Throws: std::invalid_argument for a track that breaks its invariant and an interval that is not positive.
CurbTrajectory resample(const Trajectory& track, const CurbFrame& frame, const SamplingConfig& config);

/// The path until sample `last` as it was measured [m]: on straight lines between raw samples, at the times of
/// `observe`. Baselines predict from it, so that smoothing neither helps nor harms them.
/// Throws: std::invalid_argument if there is no sample `last`, its time is before that of the first sample or not
/// finite, or observe_s or the interval is not positive.
std::vector<Vector2> past(const Trajectory& track, std::size_t last, double observe_s, const SamplingConfig& config);

/// The true path after sample `last` as it was measured [m]: on straight lines between raw samples, at the `steps`
/// times that follow it by `interval_s`; shorter where the track ends. Throws: std::invalid_argument if there is no
/// sample `last` or fewer positions than times, or the interval is not positive.
std::vector<Vector2> future(const Trajectory& track, std::size_t last, std::size_t steps, const SamplingConfig& config);

/// The rule of `prediction_samples` for a track that still grows. If a prediction that is due at `due_s` is made at the
/// sample at `time_s`, the time at which the next one is due; else null. The first is due at `first_due_s`, observe_s
/// after the start of the track. With `stride_s` = 0 one is due at each sample.
std::optional<double> next_due_s(double first_due_s, double due_s, double time_s, double stride_s);

/// Indices of the samples at which predictions are due: the first at or after `observe_s` from the start, then the
/// first at or after each further `stride_s` (0: each sample), to the end of the track. Throws: std::invalid_argument
/// for a track that breaks its invariant and a negative `stride_s`.
std::vector<std::size_t> prediction_samples(const Trajectory& track, double observe_s, double stride_s);

/// How many steps of an interval a horizon has: none beyond it, but one if it is shorter than the interval. Prediction
/// and evaluation must agree on it, also where the horizon is no multiple of the interval (5 s at 0.3 s: 16 steps).
/// Precondition: both are positive.
inline int steps_in(double horizon_s, double interval_s) {
  constexpr double rounding = 1e-9;  // 2.4 / 0.2 must not be 11
  return std::max(1, static_cast<int>(std::floor(horizon_s / interval_s + rounding)));
}

}  // namespace sila
