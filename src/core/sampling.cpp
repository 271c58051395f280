#include "sila/core/sampling.hpp"

#include <Eigen/LU>

#include "core/concatenate.hpp"
#include "core/kinematics.hpp"

namespace sila {
namespace {

/// Prior of a tracker's noise [m], and its weight as a number of differences.
constexpr double kPriorNoise_m = 0.005, kPriorDifferences = 10.0;
constexpr double kMinNoise_m = 1e-3;
/// Prior standard deviation of the velocity before the first sample, about the mean velocity of the samples [m/s].
constexpr double kPriorSpeed_mps = 2.0;
/// Time from the beginning of the filter to the first requested state [s].
constexpr double kRunIn_s = 1.0;
/// Stamps are compared with this slack, far below any tracker's resolution.
constexpr double kTimeSlack_s = 1e-6;
/// Windows that are closer are at each sample: no tracker is faster.
constexpr double kShortestStride_s = 1e-3;

/// Variance of a tracker's noise [m^2]: the median of squared second differences, relative to the variance that unit
/// noise would give them, minus the contribution of the motion.
double noise_variance_m2(std::span<const double> times_s, std::span<const Vector2> positions_m, double density) {
  std::vector<double> squares;
  for (std::size_t i = 2; i < times_s.size(); ++i) {
    const double before = times_s[i - 1] - times_s[i - 2], after = times_s[i] - times_s[i - 1];
    const double share = after / (before + after);  // of the earlier sample in the line through both neighbours
    const Vector2 off = positions_m[i - 1] - share * positions_m[i - 2] - (1.0 - share) * positions_m[i];
    const double by_motion = density * square(before * after) / (3.0 * (before + after));
    const double by_noise = 1.0 + square(share) + square(1.0 - share);
    squares.push_back((0.5 * off.squaredNorm() / std::log(2.0) - by_motion) / by_noise);  // median of chi^2_2: 2 log 2
  }
  double median = 0.0;
  if (!squares.empty()) {
    const auto middle = squares.begin() + static_cast<std::ptrdiff_t>(squares.size() / 2);
    std::nth_element(squares.begin(), middle, squares.end());
    median = std::max(0.0, *middle);
  }
  const double count = static_cast<double>(squares.size());
  return std::max(square(kMinNoise_m),
                  (kPriorDifferences * square(kPriorNoise_m) + count * median) / (kPriorDifferences + count));
}

/// Position and velocity with their covariance, the same for x and y.
struct Belief {
  Eigen::Matrix<double, 2, 2> mean;  ///< rows: position, velocity; columns: x, y
  Eigen::Matrix2d covariance;
};

Eigen::Matrix2d transition(double seconds) {
  return (Eigen::Matrix2d() << 1.0, seconds, 0.0, 1.0).finished();
}

Belief predicted(const Belief& belief, double seconds, double density) {
  const Eigen::Matrix2d step = transition(seconds);
  Belief next{step * belief.mean, step * belief.covariance * step.transpose()};
  const double cube = seconds * seconds * seconds / 3.0, half = seconds * seconds / 2.0;
  next.covariance += density * (Eigen::Matrix2d() << cube, half, half, seconds).finished();
  return next;
}

Belief conditioned(const Belief& belief, const Vector2& position_m, double variance_m2) {
  const Eigen::Vector2d gain = belief.covariance.col(0) / (belief.covariance(0, 0) + variance_m2);
  return {belief.mean + gain * (position_m.transpose() - belief.mean.row(0)),
          belief.covariance - gain * belief.covariance.row(0)};
}

/// States at the samples: a Kalman filter and the Rauch-Tung-Striebel smoother of an integrated Wiener process, which
/// is the cubic smoothing spline (Wahba 1978; Sarkka, Bayesian Filtering and Smoothing, chapter 8).
std::vector<MotionState> smoothed_states(std::span<const double> times_s, std::span<const Vector2> positions_m,
                                         double density) {
  const std::size_t count = times_s.size();
  const double noise_m2 = noise_variance_m2(times_s, positions_m, density);
  std::vector<Belief> beliefs;
  beliefs.reserve(count);
  Belief belief{Eigen::Matrix2d::Zero(), Eigen::Matrix2d::Zero()};
  belief.mean.row(0) = positions_m[0].transpose();
  if (count > 1)
    belief.mean.row(1) = (positions_m.back() - positions_m.front()).transpose() / (times_s.back() - times_s.front());
  belief.covariance.diagonal() << noise_m2, square(kPriorSpeed_mps);
  beliefs.push_back(belief);
  for (std::size_t i = 1; i < count; ++i) {
    belief = conditioned(predicted(belief, times_s[i] - times_s[i - 1], density), positions_m[i], noise_m2);
    beliefs.push_back(belief);
  }
  for (std::size_t i = count - 1; i-- > 0;) {
    const double seconds = times_s[i + 1] - times_s[i];
    const Belief ahead = predicted(beliefs[i], seconds, density);
    const Eigen::Matrix2d gain = beliefs[i].covariance * transition(seconds).transpose() * ahead.covariance.inverse();
    beliefs[i].mean += gain * (beliefs[i + 1].mean - ahead.mean);
  }
  std::vector<MotionState> states;
  states.reserve(count);
  for (const Belief& b : beliefs) states.push_back({b.mean.row(0).transpose(), b.mean.row(1).transpose()});
  return states;
}

/// Between two states the cubic through both, which is the mean of the process; before the first and after the last a
/// straight line.
MotionState between(std::span<const double> times_s, std::span<const MotionState> states, double time_s) {
  const auto later = std::lower_bound(times_s.begin(), times_s.end(), time_s);
  const auto next = static_cast<std::size_t>(later - times_s.begin());
  if (next == 0 || next == states.size()) {
    const std::size_t end = next == 0 ? 0 : next - 1;
    const MotionState& state = states[end];
    return {state.position_m + (time_s - times_s[end]) * state.velocity_mps, state.velocity_mps};
  }
  const MotionState &a = states[next - 1], &b = states[next];
  const double seconds = times_s[next] - times_s[next - 1], u = (time_s - times_s[next - 1]) / seconds;
  const Vector2 chord = (b.position_m - a.position_m) / seconds;
  const Vector2 rising = 3.0 * chord - 2.0 * a.velocity_mps - b.velocity_mps;
  const Vector2 bending = a.velocity_mps + b.velocity_mps - 2.0 * chord;
  return {a.position_m + seconds * u * (a.velocity_mps + u * (rising + u * bending)),
          a.velocity_mps + u * (2.0 * rising + 3.0 * u * bending)};
}

/// On the straight line between the samples around `time_s`; the first or last sample outside them.
Vector2 raw_position_m(const Trajectory& track, double time_s) {
  const auto after = std::lower_bound(track.times_s.begin(), track.times_s.end(), time_s);
  if (after == track.times_s.begin()) return track.positions_m.front();
  if (after == track.times_s.end()) return track.positions_m.back();
  const auto next = static_cast<std::size_t>(after - track.times_s.begin());
  const double before_s = track.times_s[next - 1];
  const double share = (time_s - before_s) / (track.times_s[next] - before_s);
  return (1.0 - share) * track.positions_m[next - 1] + share * track.positions_m[next];
}

/// Throws: std::invalid_argument, naming the function of the caller, unless there are times to observe.
void require_window(const char* function, const Trajectory& track, std::size_t last, double observe_s,
                    double interval_s) {
  require_sample(function, track, last);
  if (!(observe_s > 0.0 && interval_s > 0.0 && std::isfinite(observe_s / interval_s)))
    throw invalid_argument(function, ": observe_s = ", observe_s, " and interval_s = ", interval_s,
                           ", must be positive and finite");
  const double length_s = track.times_s[last] - track.times_s.front();
  if (!(length_s >= 0.0 && std::isfinite(length_s)))
    throw invalid_argument("trajectory '", track.id, "', sample ", last, ": time = ", track.times_s[last],
                           ", the first one is ", track.times_s.front(), "; times must be finite and increase");
}

/// The times of `observe`, the last one exactly that of sample `last`.
std::vector<double> observed_times_s(const Trajectory& track, std::size_t last, double observe_s, double interval_s) {
  const double t0_s = track.times_s.at(last);
  std::vector<double> times_s;
  for (long k = std::max(std::lround(observe_s / interval_s), 1L) - 1; k >= 0; --k) {
    const double time_s = t0_s - static_cast<double>(k) * interval_s;
    if (time_s >= track.times_s.front() - kTimeSlack_s) times_s.push_back(time_s);
  }
  return times_s;
}

/// Time for which the track has stayed within kStandingReach_m of its position at sample `last`, at most 60 s.
double still_s(const Trajectory& track, std::size_t last) {
  constexpr double most_s = 60.0;
  std::size_t first = last;
  while (first > 0 && track.times_s[last] - track.times_s[first - 1] <= most_s &&
         (track.positions_m[first - 1] - track.positions_m[last]).squaredNorm() <= kStandingReach_m * kStandingReach_m)
    --first;
  return track.times_s[last] - track.times_s[first];
}

/// States at the given times from the first `known` samples alone; later samples never change the result. The states
/// are those of a cubic smoothing spline. Its stiffness follows from the noise of the tracker, which is estimated from
/// second differences of these samples: clean tracks are interpolated, noisy ones filtered. Precondition: `known` is at
/// least 1 and at most the length of the track. Throws: std::invalid_argument for times that do not increase and
/// positions that are not finite, among the samples that it uses.
/// Source: Wahba 1978; docs/decisions/0108-tracker-noise.md.
CurbTrajectory smooth(const Trajectory& track, std::size_t known, const CurbFrame& frame, std::vector<double> times_s,
                      const SamplingConfig& config) {
  CurbTrajectory result{track.id, frame, std::move(times_s), {}, {}, 0.0};
  if (result.times_s.empty()) return result;
  const auto begin = track.times_s.begin();
  const double from_s = result.times_s.front() - kRunIn_s - kTimeSlack_s;
  const auto from =
      static_cast<std::size_t>(std::lower_bound(begin, begin + static_cast<std::ptrdiff_t>(known - 1), from_s) - begin);
  const auto seen_s = std::span(track.times_s).subspan(from, known - from);
  for (std::size_t i = 0; i < seen_s.size(); ++i) {
    const bool increases = i == 0 || seen_s[i] > seen_s[i - 1];
    if (increases && track.positions_m[from + i].allFinite()) continue;
    throw invalid_argument("trajectory '", track.id, "', sample ", from + i, ": ",
                           increases ? "position is not finite" : "times do not increase");
  }
  if (const double density = config.acceleration_density; !(density > 0.0 && density <= 1000.0))
    throw invalid_argument("sampling.acceleration_density = ", density, ", must be above 0, at most 1000");
  const auto at_samples =
      smoothed_states(seen_s, std::span(track.positions_m).subspan(from, known - from), config.acceleration_density);
  result.positions.reserve(result.times_s.size());
  result.velocities.reserve(result.times_s.size());
  for (const double time_s : result.times_s) {
    const MotionState state = between(seen_s, at_samples, time_s);
    result.positions.push_back(to_curb(frame, state.position_m));
    result.velocities.push_back(velocity_to_curb(frame, state.velocity_mps));
  }
  return result;
}

}  // namespace

CurbTrajectory observe(const Trajectory& track, std::size_t last, const CurbFrame& frame, double observe_s,
                       const SamplingConfig& config) {
  validate(frame);
  require_window("observe", track, last, observe_s, config.interval_s);
  CurbTrajectory observed =
      smooth(track, last + 1, frame, observed_times_s(track, last, observe_s, config.interval_s), config);
  observed.still_s = still_s(track, last);
  return observed;
}

CurbTrajectory resample(const Trajectory& track, const CurbFrame& frame, const SamplingConfig& config) {
  validate(frame);
  validate(track);
  require_window("resample", track, track.times_s.size() - 1, config.interval_s, config.interval_s);
  std::vector<double> times_s;
  const double start = track.times_s.front(), end = track.times_s.back();
  for (long k = 0; start + static_cast<double>(k) * config.interval_s <= end + kTimeSlack_s; ++k)
    times_s.push_back(start + static_cast<double>(k) * config.interval_s);
  return smooth(track, track.times_s.size(), frame, std::move(times_s), config);
}

std::vector<Vector2> past(const Trajectory& track, std::size_t last, double observe_s, const SamplingConfig& config) {
  require_window("past", track, last, observe_s, config.interval_s);
  std::vector<Vector2> path_m;
  for (const double time_s : observed_times_s(track, last, observe_s, config.interval_s))
    path_m.push_back(raw_position_m(track, time_s));
  return path_m;
}

std::vector<Vector2> future(const Trajectory& track, std::size_t last, std::size_t steps,
                            const SamplingConfig& config) {
  require_window("future", track, last, config.interval_s, config.interval_s);
  require_sample("future", track, track.times_s.size() - 1);
  std::vector<Vector2> path_m;
  for (std::size_t j = 1; j <= steps; ++j) {
    const double time_s = track.times_s.at(last) + static_cast<double>(j) * config.interval_s;
    if (time_s > track.times_s.back() + kTimeSlack_s) break;
    path_m.push_back(raw_position_m(track, time_s));
  }
  return path_m;
}

std::optional<double> next_due_s(double first_due_s, double due_s, double time_s, double stride_s) {
  if (time_s < due_s - kTimeSlack_s) return std::nullopt;
  if (stride_s < kShortestStride_s) return time_s;
  // Not due_s + stride_s, because sums of strides round too much at Unix times.
  return first_due_s + stride_s * (std::floor((time_s + kTimeSlack_s - first_due_s) / stride_s) + 1.0);
}

std::vector<std::size_t> prediction_samples(const Trajectory& track, double observe_s, double stride_s) {
  if (!(stride_s >= 0.0)) throw invalid_argument("prediction_samples: stride_s must not be negative");
  validate(track);
  std::vector<std::size_t> samples;
  const double first_due_s = track.times_s.front() + observe_s;
  double due_s = first_due_s;
  for (std::size_t i = 0; i < track.times_s.size(); ++i) {
    const std::optional<double> next_s = next_due_s(first_due_s, due_s, track.times_s[i], stride_s);
    if (!next_s) continue;
    samples.push_back(i);
    due_s = *next_s;
  }
  return samples;
}

}  // namespace sila
