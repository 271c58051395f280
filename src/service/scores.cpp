#include "sila/service/scores.hpp"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <utility>

namespace sila {
namespace {

/// The band needs at least this many times as many earlier pedestrians as recent ones.
constexpr std::size_t kReferenceFactor = 2;

HorizonSums sums_of(const Metrics& model, const Metrics& constant, bool has_regions) {
  HorizonSums sums{1, model.weighted_mhd_m, constant.weighted_mhd_m, 0, {}};
  if (has_regions) {
    sums.with_regions = 1;
    sums.covered = model.coverage;
  }
  return sums;
}

void add_to(std::vector<HorizonSums>& sums, const WindowScore& window, bool has_regions) {
  sums.resize(std::max(sums.size(), window.model.size()));
  for (std::size_t h = 0; h < window.model.size(); ++h)
    sums[h] = sums[h] + sums_of(window.model[h], window.constant[h], has_regions);
}

}  // namespace

HorizonSums operator+(const HorizonSums& a, const HorizonSums& b) {
  HorizonSums sum{a.windows + b.windows, a.weighted_mhd_m + b.weighted_mhd_m, a.constant_mhd_m + b.constant_mhd_m,
                  a.with_regions + b.with_regions, a.covered};
  for (std::size_t p = 0; p < sum.covered.size(); ++p) sum.covered[p] += b.covered[p];
  return sum;
}

void add(PedestrianScore& score, const WindowScore& window, bool has_regions) {
  add_to(score.all, window, has_regions);
  if (window.moving) add_to(score.moving, window, has_regions);
  score.novelty += window.novelty;
}

void add(RecentScores& scores, PedestrianScore score, const ServiceConfig& config) {
  if (score.all.empty()) return;
  scores.push_back(std::move(score));
  while (scores.size() > static_cast<std::size_t>(config.scored_pedestrians)) scores.pop_front();
}

std::vector<HorizonSums> totals(const RecentScores& scores, bool moving) {
  std::vector<HorizonSums> total;
  for (const PedestrianScore& pedestrian : scores) {
    const std::vector<HorizonSums>& sums = moving ? pedestrian.moving : pedestrian.all;
    total.resize(std::max(total.size(), sums.size()));
    for (std::size_t h = 0; h < sums.size(); ++h) total[h] = total[h] + sums[h];
  }
  return total;
}

std::vector<std::array<double, kRegionProbabilities.size()>> coverage(const RecentScores& scores) {
  const std::size_t horizons = scores.empty() ? 0 : scores.back().all.size();
  std::vector<std::array<double, kRegionProbabilities.size()>> shares(horizons);
  for (std::size_t h = 0; h < horizons; ++h) {
    double pedestrians = 0.0;
    for (const PedestrianScore& pedestrian : scores) {
      if (h >= pedestrian.all.size() || pedestrian.all[h].with_regions == 0) continue;
      pedestrians += 1.0;
      for (std::size_t p = 0; p < shares[h].size(); ++p)
        shares[h][p] += pedestrian.all[h].covered[p] / static_cast<double>(pedestrian.all[h].with_regions);
    }
    for (double& share : shares[h]) share = pedestrians > 0.0 ? share / pedestrians : -1.0;
  }
  return shares;
}

double mean_novelty(const RecentScores& scores) {
  double sum = 0.0, windows = 0.0;
  for (const PedestrianScore& pedestrian : scores) {
    sum += pedestrian.novelty;
    windows += static_cast<double>(pedestrian.all.front().windows);
  }
  return windows > 0.0 ? sum / windows : 0.0;
}

Drift drift_of(const RecentScores& scores) {
  std::vector<double> errors_m;
  for (const PedestrianScore& pedestrian : scores) {
    if (pedestrian.moving.empty()) continue;
    const HorizonSums& last = pedestrian.moving.back();
    errors_m.push_back(last.weighted_mhd_m / static_cast<double>(last.windows));
  }
  const auto recent = static_cast<std::size_t>(ServiceConfig::drift_pedestrians);
  if (errors_m.size() < (1 + kReferenceFactor) * recent) return {};
  const auto split = errors_m.end() - static_cast<std::ptrdiff_t>(recent);
  const auto n = static_cast<double>(errors_m.size() - recent), m = static_cast<double>(recent);
  Drift drift;
  drift.known = true;
  drift.error_m = std::accumulate(split, errors_m.end(), 0.0) / m;
  drift.reference_m = std::accumulate(errors_m.begin(), split, 0.0) / n;
  const double squares = std::inner_product(errors_m.begin(), split, errors_m.begin(), 0.0);
  const double variance = std::max(0.0, squares / n - drift.reference_m * drift.reference_m);
  drift.half_width_m = ServiceConfig::drift_deviations * std::sqrt(variance * (1.0 / m + 1.0 / n));
  drift.alarm = std::abs(drift.error_m - drift.reference_m) > drift.half_width_m;
  return drift;
}

}  // namespace sila
