#include "sila/predict/predictor.hpp"

#include <algorithm>
#include <cmath>
#include <iterator>
#include <span>
#include <sstream>
#include <stdexcept>
#include <utility>

#include "sila/predict/alternatives.hpp"
#include "sila/predict/candidates.hpp"
#include "sila/predict/modes.hpp"

namespace sila {
namespace {

/// How the error of constant velocity grows where nothing was taught about it [m/s].
constexpr double kUntaughtSpread_mps = 0.3;

int steps_in(double seconds, double interval_s) {
  return std::max(1, static_cast<int>(std::floor(seconds / interval_s + 1e-9)));
}

void require_interval(const CurbTrajectory& observed, double interval_s) {
  for (std::size_t t = 1; t < observed.times_s.size(); ++t) {
    const double step_s = observed.times_s[t] - observed.times_s[t - 1];
    if (std::abs(step_s - interval_s) < 1e-3 * interval_s) continue;
    std::ostringstream text;
    text << "predict: track '" << observed.id << "' has an interval of " << step_s << " s at sample " << t
         << ", the model's is " << interval_s << " s";
    throw std::invalid_argument(text.str());
  }
}

std::vector<int> primitives_of(const FieldMap& map, const std::vector<int>& transitions) {
  std::vector<int> visited;
  for (int index : transitions) {
    const FieldMap::Field& field = map.field(index);
    if (visited.empty() || visited.back() != field.from) visited.push_back(field.from);
    if (visited.back() != field.to) visited.push_back(field.to);
  }
  return visited;
}

/// The paper's mode: the roll-out itself.
Mode plain_mode(const FieldMap& map, const Rollout& rollout, const CurbFrame& frame, std::size_t steps) {
  Mode mode{rollout.weight, {}, {}, primitives_of(map, rollout.transitions)};
  const Matrix2 matrix = world_from_curb(frame);
  for (std::size_t j = 0; j < steps; ++j) {
    mode.path_m.push_back(to_world(frame, rollout.path[j]));
    mode.covariances_m2.emplace_back(matrix * rollout.covariances[j] * matrix.transpose());
  }
  return mode;
}

/// The roll-out blended with kinematics as past errors taught.
Mode blended_mode(const FieldMap& map, const Blend& blend, const Observation& seen, const Rollout& rollout,
                  const CurbTrajectory& observed, std::size_t steps, double interval_s) {
  Mode mode{rollout.weight, {}, {}, primitives_of(map, rollout.transitions)};
  const Vector2 start_m = to_world(observed.frame, observed.positions.back());
  for (std::size_t j = 0; j < steps; ++j) {
    const Eigen::Matrix2Xd features = map_features(seen, rollout, observed, j, interval_s);
    const Vector2 way = static_cast<double>(j + 1) * interval_s * blend.velocity_mps(features, j, seen.speed);
    mode.path_m.emplace_back(start_m + way);
    mode.covariances_m2.push_back(oriented_covariance(way, blend.residual_m2(j, seen.speed, kMapFeatures)));
  }
  return mode;
}

/// Without roll-outs: constant velocity until past errors taught better. `here`: outlooks are asked as well.
Mode kinematic_mode(const Blend& blend, const Observation& seen, bool here, const CurbTrajectory& observed,
                    std::size_t steps, double interval_s) {
  Mode mode{1.0, {}, {}, {}};
  const Vector2 start_m = to_world(observed.frame, observed.positions.back());
  for (std::size_t j = 0; j < steps; ++j) {
    const double seconds = static_cast<double>(j + 1) * interval_s;
    const double spread = kUntaughtSpread_mps * seconds;
    const Eigen::Matrix2Xd features =
        here ? alone_features(seen, seen.outlooks, j, interval_s) : place_free_features(seen, j, interval_s);
    const Vector2 way = seconds * blend.velocity_mps(features, j, seen.speed);
    mode.path_m.emplace_back(start_m + way);
    mode.covariances_m2.push_back(blend.taught()
                                      ? oriented_covariance(way, blend.residual_m2(j, seen.speed, features.cols()))
                                      : Matrix2(Matrix2::Identity() * spread * spread));
  }
  return mode;
}

}  // namespace

Predictor::Predictor(const Model& model, const PredictConfig& config)
    : config_(config),
      interval_s_(model.conventions.sample_interval_s),
      map_(model),
      blend_(model.lessons, config),
      calibration_(config.blend ? model.lessons : Lessons{}) {
  validate_fields("predict", config);
}

namespace {

/// Transitions with which roll-outs of other modes began, and none of this mode.
std::vector<int> rivals_of(const Tracing& tracing, std::size_t mode) {
  const auto begins_with = [&](std::size_t group) {
    std::vector<int> transitions;
    for (const std::size_t member : tracing.groups[group])
      transitions.push_back(tracing.rollouts[member].origin.transition);
    return transitions;
  };
  const std::vector<int> own = begins_with(mode);
  std::vector<int> rivals;
  for (std::size_t group = 0; group < tracing.groups.size(); ++group) {
    if (group == mode) continue;
    for (const int transition : begins_with(group)) {
      if (std::find(own.begin(), own.end(), transition) == own.end()) rivals.push_back(transition);
    }
  }
  return rivals;
}

}  // namespace

Tracing Predictor::trace(const CurbTrajectory& observed, int steps) const {
  const int decision_steps = steps_in(config_.mode_horizon_s, interval_s_);
  const Candidates candidates = find_candidates(map_, observed, config_);
  Tracing tracing;
  tracing.rollouts = roll_out(map_, candidates, observed, std::max(steps, decision_steps), interval_s_, config_);
  tracing.groups = group_rollouts(tracing.rollouts, observed.frame, decision_steps, config_);
  tracing.seen = observation_of(map_, observed);
  tracing.raw_novelty = candidates.novelty;
  return tracing;
}

Hypotheses Predictor::hypotheses(const CurbTrajectory& observed, int steps) const {
  Tracing tracing = trace(observed, steps);
  std::vector<Rollout> modes = merge_rollouts(tracing.rollouts, tracing.groups);
  for (std::size_t m = 0; m < modes.size(); ++m) {
    const std::vector<int> rivals = rivals_of(tracing, m);
    modes[m].outlooks = rivals.empty() ? tracing.seen.outlooks : combine(map_, observed, tracing.seen.opinions, rivals);
  }
  return {std::move(modes), std::move(tracing.seen), tracing.raw_novelty};
}

Prediction Predictor::predict(const CurbTrajectory& observed, const Hypotheses& hypotheses) const {
  const int steps = steps_in(config_.horizon_s, interval_s_);
  const auto count = static_cast<std::size_t>(steps);
  Prediction prediction;
  prediction.t0_s = observed.times_s.back();
  prediction.novelty = calibration_.novelty(hypotheses.raw_novelty);
  const bool here = hypotheses.seen.known_place || !config_.known_places_only || !blend_.taught();
  prediction.fallback = !here || hypotheses.rollouts.empty();
  for (int j = 1; j <= steps; ++j) prediction.times_s.push_back(j * interval_s_);
  std::vector<Mode>& modes = prediction.modes;
  const std::span<const Rollout> rollouts(hypotheses.rollouts.data(),
                                          prediction.fallback ? 0 : hypotheses.rollouts.size());
  for (const Rollout& rollout : rollouts) {
    modes.push_back(blend_.taught() ? blended_mode(map_, blend_, hypotheses.seen, rollout, observed, count, interval_s_)
                                    : plain_mode(map_, rollout, observed.frame, count));
    modes.back().source = modes.size() - 1;
  }
  if (prediction.fallback) modes.push_back(kinematic_mode(blend_, hypotheses.seen, here, observed, count, interval_s_));
  if (!blend_.taught()) return prediction;
  const int room = config_.max_modes - static_cast<int>(modes.size());
  std::vector<Mode> split =
      with_alternatives(modes.front(), to_world(observed.frame, observed.positions.back()), room, config_);
  modes.front() = std::move(split.front());
  modes.insert(modes.end(), std::make_move_iterator(split.begin() + 1), std::make_move_iterator(split.end()));
  std::stable_sort(modes.begin(), modes.end(), [](const Mode& a, const Mode& b) { return a.weight > b.weight; });
  for (const double probability : kRegionProbabilities) {
    Region region{probability, {}};
    for (std::size_t j = 0; j < count; ++j)
      region.levels.push_back(calibration_.level(j, hypotheses.seen.speed, probability));
    prediction.regions.push_back(std::move(region));
  }
  return prediction;
}

Prediction Predictor::predict(const CurbTrajectory& observed) const {
  validate(observed);
  require_interval(observed, interval_s_);
  return predict(observed, hypotheses(observed, steps_in(config_.horizon_s, interval_s_)));
}

Prediction predict(const Model& model, const CurbTrajectory& observed, const PredictConfig& config) {
  return Predictor(model, config).predict(observed);
}

}  // namespace sila
