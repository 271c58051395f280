#include "sila/live/scores.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

namespace sila {
namespace {

/// A band needs so many times the watched pedestrians before them.
constexpr std::size_t kReferenceFactor = 2;

HorizonSums sums_of(const Metrics& model, const Metrics& constant, bool nominal) {
  HorizonSums sums{1, model.weighted_mhd_m, constant.weighted_mhd_m, 0, {}};
  if (nominal) sums.nominal = 1, sums.inside = model.coverage;
  return sums;
}

void add_to(std::vector<HorizonSums>& sums, const WindowScore& window, bool nominal) {
  sums.resize(std::max(sums.size(), window.model.size()));
  for (std::size_t h = 0; h < window.model.size(); ++h)
    sums[h] = sums[h] + sums_of(window.model[h], window.constant[h], nominal);
}

}  // namespace

HorizonSums operator+(const HorizonSums& a, const HorizonSums& b) {
  HorizonSums sum{a.windows + b.windows, a.weighted_mhd_m + b.weighted_mhd_m, a.constant_mhd_m + b.constant_mhd_m,
                  a.nominal + b.nominal, a.inside};
  for (std::size_t p = 0; p < sum.inside.size(); ++p) sum.inside[p] += b.inside[p];
  return sum;
}

void add(PersonScore& score, const WindowScore& window, bool nominal_regions) {
  add_to(score.all, window, nominal_regions);
  if (window.moving) add_to(score.moving, window, nominal_regions);
  score.novelty += window.novelty;
}

void add(Scoreboard& board, PersonScore score, const LiveConfig& config) {
  if (score.all.empty()) return;
  board.push_back(std::move(score));
  while (board.size() > static_cast<std::size_t>(config.remembered)) board.pop_front();
}

std::vector<HorizonSums> totals(const Scoreboard& board, bool moving) {
  std::vector<HorizonSums> total;
  for (const PersonScore& person : board) {
    const std::vector<HorizonSums>& sums = moving ? person.moving : person.all;
    total.resize(std::max(total.size(), sums.size()));
    for (std::size_t h = 0; h < sums.size(); ++h) total[h] = total[h] + sums[h];
  }
  return total;
}

std::vector<std::array<double, kRegionProbabilities.size()>> coverage(const Scoreboard& board) {
  const std::size_t horizons = board.empty() ? 0 : board.back().all.size();
  std::vector<std::array<double, kRegionProbabilities.size()>> shares(horizons);
  for (std::size_t h = 0; h < horizons; ++h) {
    double people = 0.0;
    for (const PersonScore& person : board) {
      if (h >= person.all.size() || person.all[h].nominal == 0) continue;
      people += 1.0;
      for (std::size_t p = 0; p < shares[h].size(); ++p)
        shares[h][p] += person.all[h].inside[p] / static_cast<double>(person.all[h].nominal);
    }
    for (double& share : shares[h]) share = people > 0.0 ? share / people : -1.0;
  }
  return shares;
}

double mean_novelty(const Scoreboard& board) {
  double sum = 0.0, windows = 0.0;
  for (const PersonScore& person : board)
    sum += person.novelty, windows += static_cast<double>(person.all.front().windows);
  return windows > 0.0 ? sum / windows : 0.0;
}

Drift drift_of(const Scoreboard& board, const LiveConfig& config) {
  std::vector<double> errors_m;
  for (const PersonScore& person : board) {
    if (person.moving.empty()) continue;
    const HorizonSums& last = person.moving.back();
    errors_m.push_back(last.weighted_mhd_m / static_cast<double>(last.windows));
  }
  const auto recent = static_cast<std::size_t>(config.drift_pedestrians);
  Drift drift;
  if (errors_m.size() < (1 + kReferenceFactor) * recent) return drift;
  const std::size_t before = errors_m.size() - recent;
  double sum = 0.0, squares = 0.0, latest = 0.0;
  for (std::size_t i = 0; i < before; ++i) sum += errors_m[i], squares += errors_m[i] * errors_m[i];
  for (std::size_t i = before; i < errors_m.size(); ++i) latest += errors_m[i];
  const auto n = static_cast<double>(before), m = static_cast<double>(recent);
  drift.known = true;
  drift.error_m = latest / m, drift.reference_m = sum / n;
  const double variance = std::max(0.0, squares / n - drift.reference_m * drift.reference_m);
  drift.half_width_m = config.drift_deviations * std::sqrt(variance * (1.0 / m + 1.0 / n));
  drift.alarm = std::abs(drift.error_m - drift.reference_m) > drift.half_width_m;
  return drift;
}

}  // namespace sila
