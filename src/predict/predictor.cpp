#include "sila/predict/predictor.hpp"

#include <algorithm>
#include <cmath>
#include <span>
#include <sstream>
#include <stdexcept>
#include <utility>

#include "sila/core/steps.hpp"
#include "sila/predict/alternatives.hpp"
#include "sila/predict/candidates.hpp"
#include "sila/predict/modes.hpp"

namespace sila {
namespace {

/// How the error of constant velocity grows where nothing was taught about it [m/s].
constexpr double kUntaughtSpread_mps = 0.3;

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

void visit_primitives(const FieldMap& map, std::span<const int> transitions, std::vector<int>& visited) {
  for (const int index : transitions) {
    const FieldMap::Field& field = map.field(index);
    if (visited.empty() || visited.back() != field.from) visited.push_back(field.from);
    if (visited.back() != field.to) visited.push_back(field.to);
  }
}

/// One more mode, blank, with the memory of one that was there before.
Mode& add_mode(Workspace& workspace, double weight, std::size_t steps) {
  std::vector<Mode>& modes = workspace.prediction.modes;
  if (workspace.spare.empty()) {
    modes.emplace_back();
  } else {
    modes.push_back(std::move(workspace.spare.back()));
    workspace.spare.pop_back();
  }
  Mode& mode = modes.back();
  mode.weight = weight, mode.manner = Manner::expected, mode.source = modes.size() - 1;
  mode.primitives.clear();
  mode.path_m.resize(steps), mode.covariances_m2.resize(steps);
  return mode;
}

/// The paper's mode: the roll-out itself.
void fill_plain(Mode& mode, const Rollout& rollout, const CurbFrame& frame) {
  const Matrix2 matrix = world_from_curb(frame);
  for (std::size_t j = 0; j < mode.path_m.size(); ++j) {
    mode.path_m[j] = to_world(frame, rollout.path[j]);
    mode.covariances_m2[j] = matrix * rollout.covariances[j] * matrix.transpose();
  }
}

/// The roll-out blended with kinematics as past errors taught.
void fill_blended(Mode& mode, const Blend& blend, const Observation& seen, const Rollout& rollout,
                  const CurbTrajectory& observed, double interval_s) {
  const Vector2 start_m = to_world(observed.frame, observed.positions.back());
  for (std::size_t j = 0; j < mode.path_m.size(); ++j) {
    const Features features = map_features(seen, rollout, observed, j, interval_s);
    const Vector2 way = static_cast<double>(j + 1) * interval_s * blend.velocity_mps(features, j, seen.speed);
    mode.path_m[j] = start_m + way;
    mode.covariances_m2[j] = oriented_covariance(way, blend.residual_m2(j, seen.speed, kMapFeatures));
  }
}

/// Without roll-outs: constant velocity until past errors taught better. `here`: outlooks are asked as well.
void fill_kinematic(Mode& mode, const Blend& blend, const Observation& seen, bool here, const CurbTrajectory& observed,
                    double interval_s) {
  const Vector2 start_m = to_world(observed.frame, observed.positions.back());
  for (std::size_t j = 0; j < mode.path_m.size(); ++j) {
    const double seconds = static_cast<double>(j + 1) * interval_s;
    const double spread = kUntaughtSpread_mps * seconds;
    const Features features =
        here ? alone_features(seen, seen.outlooks, j, interval_s) : place_free_features(seen, j, interval_s);
    const Vector2 way = seconds * blend.velocity_mps(features, j, seen.speed);
    mode.path_m[j] = start_m + way;
    mode.covariances_m2[j] = blend.taught()
                                 ? oriented_covariance(way, blend.residual_m2(j, seen.speed, features.cols()))
                                 : Matrix2(Matrix2::Identity() * spread * spread);
  }
}

/// Transitions with which roll-outs of other modes began, and none of this mode.
std::span<const int> rivals_of(const Tracing& tracing, std::size_t mode, Scratch& scratch) {
  const auto first_of = [&](std::size_t member) { return tracing.rollouts[member].origin.transition; };
  const RolloutGroup own = tracing.groups[mode];
  const auto rivals = scratch.array<int>(tracing.rollouts.size());
  std::size_t count = 0;
  for (std::size_t group = 0; group < tracing.groups.size(); ++group) {
    if (group == mode) continue;
    for (const std::size_t rival : tracing.groups[group]) {
      const bool shared =
          std::any_of(own.begin(), own.end(), [&](std::size_t member) { return first_of(member) == first_of(rival); });
      if (!shared) rivals[count++] = first_of(rival);
    }
  }
  return rivals.first(count);
}

/// Heaviest first; those of equal weight stay in their order. Few enough to be moved one by one, without memory.
void sort_by_weight(std::vector<Mode>& modes) {
  for (auto end = modes.begin(); end != modes.end(); ++end) {
    const auto place =
        std::upper_bound(modes.begin(), end, *end, [](const Mode& a, const Mode& b) { return a.weight > b.weight; });
    std::rotate(place, end, end + 1);
  }
}

}  // namespace

Predictor::Predictor(const Model& model, const PredictConfig& config) : Predictor(model, config, FieldMap::Made{}) {}

Predictor::Predictor(const Model& model, const PredictConfig& config, const Model& earlier, const Predictor& of_earlier)
    : Predictor(model, config, FieldMap::Made{&earlier, &of_earlier.map_}) {}

Predictor::Predictor(const Model& model, const PredictConfig& config, const FieldMap::Made& earlier)
    : config_(config),
      interval_s_(model.conventions.sample_interval_s),
      map_(model, config, earlier),
      blend_(model.lessons, config),
      calibration_(config.blend ? model.lessons : Lessons{}) {
  validate_fields("predict", config);
}

Tracing Predictor::trace(const CurbTrajectory& observed, int steps, Scratch& scratch) const {
  const int decision_steps = steps_in(config_.mode_horizon_s, interval_s_);
  const std::span<const int> near = map_.near(observed, scratch);
  const Candidates candidates = find_candidates(map_, near, observed, config_, scratch);
  Tracing tracing;
  tracing.rollouts = roll_out(map_, candidates, observed, std::max(steps, decision_steps), interval_s_,
                              !blend_.taught(), config_, scratch);
  tracing.groups = group_rollouts(tracing.rollouts, observed.frame, decision_steps, config_, scratch);
  tracing.seen = observation_of(map_, near, observed, scratch);
  tracing.raw_novelty = candidates.novelty;
  return tracing;
}

Hypotheses Predictor::hypotheses(const CurbTrajectory& observed, int steps, Scratch& scratch) const {
  const Tracing tracing = trace(observed, steps, scratch);
  const std::span<Rollout> modes = merge_rollouts(tracing.rollouts, tracing.groups, scratch);
  for (std::size_t m = 0; m < modes.size(); ++m) {
    const std::span<const int> rivals = rivals_of(tracing, m, scratch);
    modes[m].outlooks =
        rivals.empty() ? tracing.seen.outlooks : combine(map_, observed, tracing.seen.opinions, rivals, scratch);
  }
  return {modes, tracing.seen, tracing.raw_novelty};
}

void Predictor::add_regions(Prediction& prediction, int speed_class) const {
  prediction.regions.resize(kRegionProbabilities.size());
  for (std::size_t r = 0; r < kRegionProbabilities.size(); ++r) {
    Region& region = prediction.regions[r];
    region.probability = kRegionProbabilities[r];
    region.levels.resize(prediction.times_s.size());
    for (std::size_t j = 0; j < region.levels.size(); ++j) region.levels[j] = calibration_.level(j, speed_class, r);
  }
}

const Prediction& Predictor::predict(const CurbTrajectory& observed, const Hypotheses& hypotheses,
                                     Workspace& workspace) const {
  const auto steps = static_cast<std::size_t>(steps_in(config_.horizon_s, interval_s_));
  const Observation& seen = hypotheses.seen;
  Prediction& prediction = workspace.prediction;
  std::vector<Mode>& modes = prediction.modes;
  for (Mode& mode : modes) workspace.spare.push_back(std::move(mode));
  modes.clear();
  prediction.t0_s = observed.times_s.back();
  prediction.novelty = calibration_.novelty(hypotheses.raw_novelty);
  prediction.times_s.resize(steps);
  for (std::size_t j = 0; j < steps; ++j) prediction.times_s[j] = static_cast<double>(j + 1) * interval_s_;
  const bool here = seen.known_place || !config_.known_places_only || !blend_.taught();
  prediction.fallback = !here || hypotheses.rollouts.empty();
  for (const Rollout& rollout : prediction.fallback ? std::span<const Rollout>() : hypotheses.rollouts) {
    Mode& mode = add_mode(workspace, rollout.weight, steps);
    visit_primitives(map_, rollout.transitions, mode.primitives);
    if (blend_.taught())
      fill_blended(mode, blend_, seen, rollout, observed, interval_s_);
    else
      fill_plain(mode, rollout, observed.frame);
  }
  if (prediction.fallback) fill_kinematic(add_mode(workspace, 1.0, steps), blend_, seen, here, observed, interval_s_);
  if (!blend_.taught()) {
    prediction.regions.clear();
    return prediction;
  }
  const int lighter = count_alternatives(config_.max_modes - static_cast<int>(modes.size()), config_);
  for (int k = 0; k < lighter; ++k) add_mode(workspace, 0.0, steps);
  if (lighter > 0) {
    // The first mode and the last ones, side by side.
    std::rotate(modes.begin() + 1, modes.end() - lighter, modes.end());
    split_into_alternatives(std::span(modes).first(static_cast<std::size_t>(lighter) + 1),
                            to_world(observed.frame, observed.positions.back()), config_);
  }
  sort_by_weight(modes);
  add_regions(prediction, seen.speed);
  return prediction;
}

const Prediction& Predictor::predict(const CurbTrajectory& observed, Workspace& workspace) const {
  validate(observed);
  require_interval(observed, interval_s_);
  workspace.scratch.reset();
  return predict(observed, hypotheses(observed, steps_in(config_.horizon_s, interval_s_), workspace.scratch),
                 workspace);
}

Prediction Predictor::predict(const CurbTrajectory& observed) const {
  Workspace workspace;
  predict(observed, workspace);
  return std::move(workspace.prediction);
}

Prediction predict(const Model& model, const CurbTrajectory& observed, const PredictConfig& config) {
  return Predictor(model, config).predict(observed);
}

}  // namespace sila
