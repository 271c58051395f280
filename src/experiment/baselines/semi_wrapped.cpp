#include "sila/experiment/baselines/semi_wrapped.hpp"

#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <numbers>

namespace sila {
namespace {

constexpr double kPi = std::numbers::pi;
constexpr double kShiftDirection_rad = 0.5, kShiftSpeed_mps = 0.3;
constexpr std::size_t kStarts = 40, kShiftSamples = 400;
constexpr int kShiftRounds = 30, kRounds = 30;
/// Variances that the samples' own noise has; a narrower Gaussian would be an accident.
constexpr double kLeastDirection_rad2 = 0.01, kLeastSpeed_mps2 = 0.0025;
constexpr double kLeastWeight = 0.02;
constexpr double kWraps[] = {-2.0 * kPi, 0.0, 2.0 * kPi};

Vector2 difference(const Vector2& a, const Vector2& b) {
  return {wrapped_rad(a.x() - b.x()), a.y() - b.y()};
}

/// At most `most` samples, evenly taken.
std::vector<Vector2> thinned(std::span<const Vector2> samples, std::size_t most) {
  const std::size_t stride = (samples.size() + most - 1) / most;
  std::vector<Vector2> few;
  for (std::size_t i = 0; i < samples.size(); i += stride) few.push_back(samples[i]);
  return few;
}

double shift_distance2(const Vector2& off) {
  return std::pow(off.x() / kShiftDirection_rad, 2) + std::pow(off.y() / kShiftSpeed_mps, 2);
}

Vector2 climbed(Vector2 place, std::span<const Vector2> samples) {
  for (int round = 0; round < kShiftRounds; ++round) {
    Vector2 sum = Vector2::Zero();
    double weights = 0.0;
    for (const Vector2& sample : samples) {
      const Vector2 off = difference(sample, place);
      const double weight = std::exp(-0.5 * shift_distance2(off));
      sum += weight * off, weights += weight;
    }
    const Vector2 shift = sum / std::max(weights, 1e-300);
    place += shift;
    place.x() = wrapped_rad(place.x());
    if (shift_distance2(shift) < 1e-6) break;
  }
  return place;
}

/// The modes of the samples' density.
std::vector<Vector2> mean_shift(std::span<const Vector2> samples) {
  const std::vector<Vector2> few = thinned(samples, kShiftSamples);
  std::vector<Vector2> modes;
  for (const Vector2& start : thinned(samples, kStarts)) {
    const Vector2 mode = climbed(start, few);
    const bool known =
        std::ranges::any_of(modes, [&](const Vector2& m) { return shift_distance2(difference(m, mode)) < 1.0; });
    if (!known) modes.push_back(mode);
  }
  return modes;
}

/// Weighted density of one wrap of a Gaussian.
double wrap_density(const SemiWrappedGaussian& gaussian, const Matrix2& inverse, double root, const Vector2& sample,
                    double wrap) {
  const Vector2 off = sample + Vector2(wrap, 0.0) - gaussian.mean;
  return gaussian.weight * std::exp(-0.5 * off.dot(inverse * off)) / (2.0 * kPi * root);
}

/// Sums of what falls to one Gaussian.
struct Share {
  double weight = 0.0;
  Vector2 first = Vector2::Zero();
  Matrix2 second = Matrix2::Zero();
};

/// The shares of all Gaussians in the samples: the expectation step, unwrapped round each mean.
std::vector<Share> shares_of(std::span<const Vector2> samples, const std::vector<SemiWrappedGaussian>& mixture) {
  std::vector<Share> shares(mixture.size());
  std::vector<Matrix2> inverses;
  std::vector<double> roots, parts(mixture.size() * std::size(kWraps));
  for (const SemiWrappedGaussian& gaussian : mixture) {
    inverses.emplace_back(gaussian.covariance.inverse());
    roots.push_back(std::sqrt(gaussian.covariance.determinant()));
  }
  for (const Vector2& sample : samples) {
    double total = 0.0;
    for (std::size_t p = 0; p < parts.size(); ++p) {
      const std::size_t k = p / std::size(kWraps);
      parts[p] = wrap_density(mixture[k], inverses[k], roots[k], sample, kWraps[p % std::size(kWraps)]);
      total += parts[p];
    }
    if (total < 1e-300) continue;  // an outlier of every Gaussian shapes none
    for (std::size_t p = 0; p < parts.size(); ++p) {
      Share& share = shares[p / std::size(kWraps)];
      const double r = parts[p] / total;
      const Vector2 off = sample + Vector2(kWraps[p % std::size(kWraps)], 0.0) - mixture[p / std::size(kWraps)].mean;
      share.weight += r, share.first += r * off, share.second += r * off * off.transpose();
    }
  }
  return shares;
}

std::vector<SemiWrappedGaussian> maximised(const std::vector<SemiWrappedGaussian>& mixture,
                                           const std::vector<Share>& shares) {
  double total = 0.0;
  for (const Share& share : shares) total += share.weight;
  std::vector<SemiWrappedGaussian> next;
  for (std::size_t k = 0; k < mixture.size(); ++k) {
    const double weight = shares[k].weight / std::max(total, 1e-300);
    if (weight < kLeastWeight && mixture.size() > 1) continue;
    const Vector2 off = shares[k].first / std::max(shares[k].weight, 1e-300);
    const Matrix2 second = shares[k].second / std::max(shares[k].weight, 1e-300);
    SemiWrappedGaussian gaussian{weight, mixture[k].mean + off, second - off * off.transpose()};
    gaussian.mean.x() = wrapped_rad(gaussian.mean.x());
    gaussian.covariance.diagonal() += Vector2(kLeastDirection_rad2, kLeastSpeed_mps2);
    next.push_back(gaussian);
  }
  return next.empty() ? mixture : next;
}

}  // namespace

double wrapped_rad(double angle_rad) {
  return angle_rad - 2.0 * kPi * std::floor((angle_rad + kPi) / (2.0 * kPi));
}

double density(std::span<const SemiWrappedGaussian> mixture, const Vector2& direction_speed) {
  double sum = 0.0;
  for (const SemiWrappedGaussian& gaussian : mixture) {
    const Matrix2 inverse = gaussian.covariance.inverse();
    const double root = std::sqrt(gaussian.covariance.determinant());
    for (double wrap : kWraps) sum += wrap_density(gaussian, inverse, root, direction_speed, wrap);
  }
  return sum;
}

std::vector<SemiWrappedGaussian> fit_semi_wrapped(std::span<const Vector2> samples) {
  std::vector<SemiWrappedGaussian> mixture;
  if (samples.empty()) return mixture;
  const std::vector<Vector2> modes = mean_shift(samples);
  const Matrix2 start = Vector2(kShiftDirection_rad, kShiftSpeed_mps).cwiseAbs2().asDiagonal();
  for (const Vector2& mode : modes) mixture.push_back({1.0 / static_cast<double>(modes.size()), mode, start});
  for (int round = 0; round < kRounds; ++round) mixture = maximised(mixture, shares_of(samples, mixture));
  double total = 0.0;
  for (const SemiWrappedGaussian& gaussian : mixture) total += gaussian.weight;
  for (SemiWrappedGaussian& gaussian : mixture) gaussian.weight /= total;
  return mixture;
}

}  // namespace sila
