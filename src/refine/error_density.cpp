#include "refine/error_density.hpp"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <numeric>

#include "model/parts.hpp"

namespace sila {
namespace {

using ComponentVector = Eigen::Matrix<double, kMixtureComponents, 1>;

/// Nominal growth of errors: the prior before any error is known, and the unit of the variances.
constexpr double kNominalVelocity_mps = 0.15, kNominalPosition_m = 0.01;
/// The mixture before any error was seen, with the weight of this number of windows.
struct Prior {
  double relative[kMixtureComponents];  ///< variances, relative to nominal ones; of people who walk after 5 s
  double shares[kMixtureComponents];
};
constexpr Prior kPriors[kMotionStates] = {{{0.8, 4.8, 20.0}, {0.65, 0.25, 0.1}}, {{0.01, 0.5, 6.0}, {0.5, 0.35, 0.15}}};
constexpr double kPriorWindows = 5.0;
/// Ridge of the regression of the scale and the weights, towards no dependence.
constexpr double kScaleRidge = 60.0;
/// The scale is learnt from errors relative to the component that made them, with this share, and relative to nominal
/// ones. The former alone leaves too much to the weights, the latter alone counts what the weights explain again.
constexpr double kWithinShare = 0.7;
/// Keeps the logarithm of an error of zero finite.
constexpr double kSmallestSquare = 0.1;
/// Least ratio of the variances of a covariance, so that it is not nearly singular.
constexpr double kThinnest = 1e-12;
/// Limit of the logarithm of the scale by regression, however different a window is from those learnt; that of the
/// growth with speed is twice this.
constexpr double kMaxLogScale = 4.0;
/// The same for the weight of a component; a larger factor makes regions larger (docs/decisions/0107-error-density.md).
constexpr double kMaxLogWeight = 1.0;

/// Errors grow with this power of the speed beyond the speeds that were learnt (docs/decisions/0138-faster-people.md).
constexpr double kFastPower = 1.5;
/// Positions of the features of speed (of the last 0.4 s, and of the last 3 s), and their divisor.
constexpr Eigen::Index kLastSpeed = 1, kMeanSpeed = 2;
constexpr double kSpeedSpread = 0.4;

/// Along and across.
double nominal_variance_m2(std::size_t step, double interval_s) {
  return square(kNominalPosition_m + kNominalVelocity_mps * static_cast<double>(step + 1) * interval_s);
}

/// The mean of a feature plus its deviation; before any window the mean is 0 and the deviation 1.
double one_deviation_above(double windows, double sum, double squares) {
  const double mean = sum / (windows + kPriorWindows);
  const double variance = (squares + kPriorWindows) / (windows + kPriorWindows) - square(mean);
  return mean + std::sqrt(std::max(0.0, variance));
}

/// Errors of people who walk grow faster than nominal ones.
double prior_growth(double seconds) {
  return std::pow(seconds / 5.0, 0.7);
}

/// A logarithm, centred and scaled so that one ridge serves all features.
double centred_log(double value, double offset, double centre, double spread) {
  return (std::log(value + offset) - std::log(centre + offset)) / spread;
}

}  // namespace

ScaleFeatures scale_features(const PastVelocities& past_mps, const Vector2& predicted_mps, double local_support) {
  const Vector2 v04 = past_mps.col(0), v08 = past_mps.col(1), v16 = past_mps.col(2), v_all = past_mps.col(3);
  ScaleFeatures features;
  features << 1.0, centred_log(v04.norm(), 0.1, 1.2, kSpeedSpread), centred_log(v_all.norm(), 0.1, 1.2, kSpeedSpread),
      centred_log((v04 - v08).norm(), 0.02, 0.1, 0.8), centred_log((v08 - v16).norm(), 0.02, 0.1, 0.8),
      centred_log((v08 - v_all).norm(), 0.02, 0.15, 0.8), centred_log((predicted_mps - v08).norm(), 0.05, 0.2, 0.7),
      centred_log(local_support, 1.0, 5.0, 1.0);
  return features;
}

Matrix2 oriented_covariance(const Vector2& direction, const Vector2& along_across_m2) {
  const double length = direction.norm();
  if (length < 1e-9) return Matrix2::Identity() * along_across_m2.mean();
  const Vector2 along = direction / length, across = left_of(along);
  return along_across_m2.x() * along * along.transpose() + along_across_m2.y() * across * across.transpose();
}

ErrorDensity::ErrorDensity(const DensityMoments& moments, int steps, double interval_s, std::size_t state)
    : interval_s_(interval_s), windows_(moments.scale.weight), coefficients_(decltype(coefficients_)::Zero()) {
  double sum = 0.0, squares = 0.0;  // of the feature of the mean speed
  if (moments.scale.weight > 0.0) {
    Eigen::MatrixXd matrix = moments.scale.features;
    matrix.diagonal().tail(kScaleFeatures - 1).array() += kScaleRidge;
    matrix(0, 0) += 1e-3;
    coefficients_ = matrix.ldlt().solve(moments.scale.products);
    if (!coefficients_.allFinite()) coefficients_.setZero();
    coefficients_.row(0).setZero();  // no intercept: the components have the scale of each step
    mean_ = moments.scale.features.col(0) / moments.scale.weight;
    sum = moments.scale.features(kMeanSpeed, 0);
    squares = moments.scale.features(kMeanSpeed, kMeanSpeed);
  }
  if (state == kWalking) fastest_ = one_deviation_above(windows_, sum, squares);
  const Prior& initial = kPriors[state];
  ComponentWeights counts = {};
  for (std::size_t step = 0; step < static_cast<std::size_t>(steps); ++step) {
    const double growth = state == kStanding ? 1.0 : prior_growth(static_cast<double>(step + 1) * interval_s_);
    auto& relative = relative_.emplace_back();
    for (std::size_t c = 0; c < kMixtureComponents; ++c) {
      const ErrorMoments& seen = moments.components[step * kMixtureComponents + c];
      const double prior_windows = kPriorWindows * initial.shares[c];
      counts[c] += seen.weight + prior_windows;
      relative[c] =
          (Vector2(seen.along, seen.across) + Vector2::Constant(prior_windows * initial.relative[c] * growth)) /
          (seen.weight + prior_windows);
    }
  }
  const double total = std::accumulate(counts.begin(), counts.end(), 0.0);
  for (std::size_t c = 0; c < counts.size(); ++c) weights_[c] = total > 0.0 ? counts[c] / total : initial.shares[c];
}

ErrorScale ErrorDensity::scale(const ScaleFeatures& of_window) const {
  // The regression is not reliable beyond most of the speeds that it has seen.
  ScaleFeatures features = of_window;
  for (const Eigen::Index speed : {kLastSpeed, kMeanSpeed}) features[speed] = std::min(features[speed], fastest_);
  const double log_faster = kSpeedSpread * (of_window[kMeanSpeed] - features[kMeanSpeed]);
  const Vector2 logs = coefficients_.leftCols<2>().transpose() * features;
  ErrorScale scale{logs.cwiseMax(-kMaxLogScale).cwiseMin(kMaxLogScale).array().exp(), weights_};
  scale.factors *= std::exp(std::min(2.0 * kFastPower * log_faster, 2.0 * kMaxLogScale));
  const ComponentVector changes = coefficients_.rightCols<kMixtureComponents>().transpose() * (features - mean_);
  double sum = 0.0;
  for (std::size_t c = 0; c < kMixtureComponents; ++c) {
    // A line through the mean would leave 0 to 1; its exponential with the same slope there does not.
    const double relative = changes[static_cast<Eigen::Index>(c)] / weights_[c];
    sum += scale.weights[c] *= std::exp(std::clamp(relative, -kMaxLogWeight, kMaxLogWeight));
  }
  for (double& weight : scale.weights) weight /= sum;
  return scale;
}

Vector2 ErrorDensity::variances_m2(std::size_t component, std::size_t step, const ErrorScale& scale) const {
  const std::size_t row = std::min(step, relative_.size() - 1);
  const double growth = square(static_cast<double>(step + 1) / static_cast<double>(row + 1));
  const Vector2 variances =
      growth * nominal_variance_m2(row, interval_s_) * relative_[row][component].cwiseProduct(scale.factors);
  return variances.cwiseMax(std::max(square(kLeastError_m), kThinnest * variances.maxCoeff()));
}

Vector2 ErrorDensity::total_variances_m2(std::size_t step, const ErrorScale& scale) const {
  Vector2 sum = Vector2::Zero();
  for (std::size_t c = 0; c < kMixtureComponents; ++c) sum += scale.weights[c] * variances_m2(c, step, scale);
  return sum;
}

ComponentWeights ErrorDensity::responsibilities(std::size_t step, const ErrorScale& scale,
                                                const Vector2& error_m) const {
  ComponentWeights logs;
  for (std::size_t c = 0; c < kMixtureComponents; ++c) {
    const Vector2 variances = variances_m2(c, step, scale);
    logs[c] = std::log(scale.weights[c]) - 0.5 * (error_m.array().square() / variances.array()).sum() -
              0.5 * variances.array().log().sum();
  }
  const double most = *std::ranges::max_element(logs);
  double sum = 0.0;
  for (double& log : logs) sum += log = std::exp(log - most);
  for (double& share : logs) share /= sum;
  return logs;
}

void ErrorDensity::add_errors(DensityMoments& moments, const ScaleFeatures& features,
                              const std::vector<Vector2>& errors_m) const {
  if (errors_m.empty()) return;
  const ErrorScale of_window = scale(features);
  Vector2 relative = Vector2::Zero(), within = Vector2::Zero();
  ComponentVector weights = ComponentVector::Zero();
  for (std::size_t step = 0; step < errors_m.size(); ++step) {
    const Vector2 square_m2 = errors_m[step].array().square();
    const double nominal_m2 = nominal_variance_m2(step, interval_s_);
    const Vector2 scaled = square_m2.cwiseQuotient(nominal_m2 * of_window.factors);
    const ComponentWeights shares = responsibilities(step, of_window, errors_m[step]);
    for (std::size_t c = 0; c < kMixtureComponents; ++c) {
      add_sums(moments.components[step * kMixtureComponents + c],
               {shares[c], shares[c] * scaled.x(), shares[c] * scaled.y()});
      within += shares[c] * square_m2.cwiseQuotient(variances_m2(c, step, {}));
    }
    relative += square_m2 / nominal_m2;
    weights += ComponentVector::Map(shares.data());
  }
  const auto steps = static_cast<double>(errors_m.size());
  const auto logs_of = [&](const Vector2& sum) {
    return (sum / steps).cwiseMax(0.0).unaryExpr([](double x) { return std::log(x + kSmallestSquare); }).eval();
  };
  Eigen::Matrix<double, 1, kScaleOutputs> outputs;
  outputs << kWithinShare * logs_of(within).transpose() + (1.0 - kWithinShare) * logs_of(relative).transpose(),
      weights.transpose() / steps;
  add_examples(moments.scale, features, outputs, 1.0);
}

}  // namespace sila
