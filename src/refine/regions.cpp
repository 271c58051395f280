#include "refine/regions.hpp"

#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <numeric>

#include "core/concatenate.hpp"
#include "model/parts.hpp"
#include "sila/refine/predictor.hpp"

namespace sila {
namespace {

/// Upper edges of the bins of scores: fine where the levels of the regions are, wider beyond.
constexpr double kEdges[kScoreBins - 1] = {0.1, 0.2, 0.3, 0.4, 0.5, 0.6, 0.7, 0.8, 0.95, 1.1, 1.3, 1.5,  1.75, 2.0,
                                           2.3, 2.6, 3.0, 3.5, 4.2, 5.0, 6.0, 7.5, 9.5,  12., 16., 22.0, 32.0};
/// Weight of the pooled classes, in windows of the speed class.
constexpr double kPooledWindows = 20.0;
/// Weight of the prior scores in the pooled classes, in windows.
constexpr double kPriorScoreWindows = 10.0;
/// Mean score of people who walk, before any score is known. A Gaussian has a mean score of 1; this density has a
/// narrow peak and wide tails (error_density.cpp), so its scores are larger.
constexpr double kWalkingScore = 2.0;
/// The same of a person who hardly moves. People who stay make the density narrow, so the scores of the others are
/// large.
constexpr double kStandingScore = 4.5;
constexpr double kLeastDensity = 1e-300;

/// The motion state of a class of scores.
constexpr std::size_t motion_state_of(std::size_t score_class) {
  return score_class < kSpeedClasses ? motion_state(static_cast<int>(score_class))
                                     : (score_class - kSpeedClasses) % kMotionStates;
}

double lower_edge(int bin) {
  return bin == 0 ? 0.0 : kEdges[bin - 1];
}

/// Shares of the bins for exponentially distributed scores.
std::vector<double> exponential_shares(double mean) {
  std::vector<double> shares;
  for (int bin = 0; bin < kScoreBins; ++bin) {
    const double beyond = bin + 1 < kScoreBins ? std::exp(-kEdges[bin] / mean) : 0.0;
    shares.push_back(std::exp(-lower_edge(bin) / mean) - beyond);
  }
  return shares;
}

/// Shares of `counts` and of `windows` more that are distributed as `prior`.
std::vector<double> shrunk(const std::vector<double>& counts, const std::vector<double>& prior, double windows) {
  const double total = std::accumulate(counts.begin(), counts.end(), 0.0) + windows;
  std::vector<double> shares(prior.size());
  for (std::size_t bin = 0; bin < prior.size(); ++bin) shares[bin] = (counts[bin] + windows * prior[bin]) / total;
  return shares;
}

/// Quantile of the nonconformity scores, with linear interpolation inside a bin.
double quantile(const std::vector<double>& shares, double probability) {
  double below = 0.0;
  for (int bin = 0; bin + 1 < kScoreBins; ++bin) {
    const double share = shares[static_cast<std::size_t>(bin)];
    if (below + share >= probability)
      return lower_edge(bin) + (kEdges[bin] - lower_edge(bin)) * (probability - below) / share;
    below += share;
  }
  return 2.0 * kEdges[kScoreBins - 2];
}

void require_point(const Prediction& prediction, std::size_t step, const Vector2& point_m) {
  const std::size_t steps = prediction.modes.empty() ? 0 : prediction.modes.front().path_m.size();
  if (step >= steps)
    throw invalid_argument("prediction: step = ", step, ", must be below ", steps, ", the number of steps");
  if (!point_m.allFinite())
    throw invalid_argument("prediction: point_m = (", point_m.x(), ", ", point_m.y(), "), must be finite");
}

}  // namespace

double unnormalised_density(const Prediction& prediction, std::size_t step, const Vector2& point_m) {
  require_point(prediction, step, point_m);
  double sum = 0.0;
  for (const Mode& mode : prediction.modes) {
    const Matrix2& covariance = mode.covariances_m2[step];
    const Vector2 off = point_m - mode.path_m[step];
    sum += mode.weight * std::exp(-0.5 * off.dot(covariance.inverse() * off)) / std::sqrt(covariance.determinant());
  }
  return std::max(sum, kLeastDensity);
}

double nonconformity(const Prediction& prediction, std::size_t step, const Vector2& point_m) {
  require_point(prediction, step, point_m);
  double peak = 0.0;
  for (const Mode& mode : prediction.modes)
    peak = std::max(peak, unnormalised_density(prediction, step, mode.path_m[step]));
  return std::max(0.0, std::log(peak / unnormalised_density(prediction, step, point_m)));
}

int score_bin(double nonconformity) {
  return static_cast<int>(std::lower_bound(std::begin(kEdges), std::end(kEdges), nonconformity) - std::begin(kEdges));
}

int novelty_bin(double raw_novelty) {
  return std::clamp(static_cast<int>(raw_novelty * kNoveltyBins), 0, kNoveltyBins - 1);
}

Calibration::Calibration(const ErrorStatistics& error_statistics) {
  if (error_statistics.empty() || error_statistics.scores.empty()) return;
  steps_ = error_statistics.steps;
  const std::vector<double> walking = exponential_shares(kWalkingScore), standing = exponential_shares(kStandingScore);
  for (int step = 0; step < steps_; ++step) {
    std::vector<double> pooled(kScoreBins, 0.0);  // without people who stand: their scores differ
    const auto cell = [&](int c) -> const std::vector<double>& {
      return error_statistics.scores[static_cast<std::size_t>(step * kScoreClasses + c)];
    };
    for (int c = 1; c < kSpeedClasses; ++c) add_sums(pooled, cell(c));
    const std::vector<double> all = shrunk(pooled, walking, kPriorScoreWindows);
    for (int c = 0; c < kScoreClasses; ++c) {
      const bool stands = motion_state_of(static_cast<std::size_t>(c)) == kStanding;
      const std::vector<double> shares = shrunk(cell(c), stands ? standing : all, kPooledWindows);
      auto& levels = levels_.emplace_back();
      for (std::size_t r = 0; r < levels.size(); ++r) levels[r] = quantile(shares, kRegionProbabilities[r]);
    }
  }
  const double total = std::accumulate(error_statistics.novelties.begin(), error_statistics.novelties.end(), 0.0);
  double below = 0.0;
  for (const double count : error_statistics.novelties) {
    if (total > 0.0) known_better_.push_back(below / total);
    below += count;
  }
}

double Calibration::level(std::size_t step, std::size_t score_class, std::size_t region) const {
  if (steps_ == 0) return -std::log1p(-kRegionProbabilities[region]);
  const std::size_t row = std::min(step, static_cast<std::size_t>(steps_ - 1));
  return levels_[row * kScoreClasses + score_class][region];
}

double Calibration::novelty(double raw_novelty) const {
  return known_better_.empty() ? raw_novelty : known_better_[static_cast<std::size_t>(novelty_bin(raw_novelty))];
}

}  // namespace sila
