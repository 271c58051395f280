#include "sila/model/error_statistics.hpp"

#include <cmath>
#include <ranges>
#include <stdexcept>
#include <string>
#include <tuple>
#include <utility>

#include "core/concatenate.hpp"

namespace sila {
namespace {

[[noreturn]] void reject_statistics(const std::string& what) {
  throw std::invalid_argument("error statistics: " + what);
}

void require_length(const char* name, std::size_t length, std::size_t wanted) {
  if (length == wanted) return;
  reject_statistics(std::string(name) + " has " + std::to_string(length) + " entries, must have " +
                    std::to_string(wanted));
}

/// Of something that was counted or summed up from squares.
void require_sum(const char* name, double value) {
  if (!(value >= 0.0) || !std::isfinite(value))
    reject_statistics(std::string(name).append(" has a number that is no sum"));
}

void require_regressions(const char* name, const std::vector<RegressionMoments>& table, std::size_t cells, int features,
                         int outputs) {
  require_length(name, table.size(), cells);
  for (const RegressionMoments& moments : table) {
    require_sum(name, moments.weight);
    if (moments.features.rows() != features || moments.features.cols() != features ||
        moments.products.rows() != features || moments.products.cols() != outputs)
      reject_statistics(std::string(name) + " is not a regression on " + std::to_string(features) + " features");
    if (!moments.features.allFinite() || !moments.products.allFinite())
      reject_statistics(std::string(name) + " has a number that is not finite");
  }
}

void require_error_moments(const char* name, const std::vector<ErrorMoments>& table, std::size_t cells) {
  require_length(name, table.size(), cells);
  for (const ErrorMoments& moments : table) {
    require_sum(name, moments.weight);
    // One is a difference of squares, which rounding may leave a little below 0.
    for (const double sum : {moments.along, moments.across}) require_sum(name, sum + 1e-6);
  }
}

void require_bins(const char* name, const std::vector<double>& bins, std::size_t wanted) {
  require_length(name, bins.size(), wanted);
  for (const double count : bins) require_sum(name, count);
}

void require_densities(const char* name, const Densities& densities, int steps) {
  for (const DensityMoments& density : densities) {
    require_regressions(name, {density.scale}, 1, steps > 0 ? kScaleFeatures : 0, steps > 0 ? 2 : 0);
    require_error_moments(name, density.components, static_cast<std::size_t>(steps * kMixtureComponents));
  }
}

void discount(double& sum, double share) {
  sum *= share;
}

void discount(RegressionMoments& moments, double share) {
  moments.weight *= share;
  moments.features *= share;
  moments.products *= share;
}

void discount(ErrorMoments& moments, double share) {
  moments.weight *= share;
  moments.along *= share;
  moments.across *= share;
}

void discount(DensityMoments& moments, double share) {
  discount(moments.scale, share);
  for (ErrorMoments& cell : moments.components) discount(cell, share);
}

void discount(SlowErrors& errors, double share) {
  errors.weight *= share;
  for (double& error_m : errors.errors_m) error_m *= share;
}

template <std::ranges::range Table>
void discount(Table& table, double share) {
  for (auto& entry : table) discount(entry, share);
}

template <class Table>
void add_table(Table& sum, const Table& more) {
  if constexpr (std::ranges::range<Table>) {
    for (std::size_t i = 0; i < sum.size(); ++i) add_table(sum[i], more[i]);
  } else {
    sum += more;
  }
}

/// All sums; a member that is added to the struct and forgotten here does not compile.
auto tables_of(auto& error_statistics) {
  auto& [steps, interval_s, observe_s, stacking, density, density_place_free, scores, novelties, slow, changes,
         global_motion, motion, motion_share, correction, correction_share] = error_statistics;
  return std::tie(stacking, density, density_place_free, scores, novelties, slow, changes, global_motion, motion,
                  motion_share, correction, correction_share);
}

/// From about this number of windows on, recent ones count more.
constexpr double kEarlyWindows = 150.0;

/// What is left of past windows when recent ones count more: errors were larger when less was known, so a window counts
/// as the square of how many came before it: online expectation maximisation with steps of up to 3 / n instead of 1 / n
/// (Cappe and Moulines 2009).
double share_of_past(double before, double now) {
  const double share = (kEarlyWindows + before) / (kEarlyWindows + before + now);
  return share * share;
}

void favour_recent(Densities& past, const Densities& recent) {
  for (std::size_t d = kWalking; d < kErrorDensities; d += kMotionStates) {
    const double share = share_of_past(past[d].scale.weight, recent[d].scale.weight);
    discount(past[d].components, share);
  }
}

void add(ErrorStatistics& sum, const ErrorStatistics& more) {
  const auto add_all = [&](auto&... sums) {
    std::apply([&](const auto&... others) { (add_table(sums, others), ...); }, tables_of(more));
  };
  std::apply(add_all, tables_of(sum));
}

}  // namespace

DensityMoments& DensityMoments::operator+=(const DensityMoments& more) {
  scale += more.scale;
  for (std::size_t c = 0; c < components.size(); ++c) components[c] += more.components[c];
  return *this;
}

SlowErrors& SlowErrors::operator+=(const SlowErrors& more) {
  weight += more.weight;
  for (std::size_t c = 0; c < errors_m.size(); ++c) errors_m[c] += more.errors_m[c];
  return *this;
}

double windows_in(const Densities& densities) {
  return densities[kWalking].scale.weight + densities[kStanding].scale.weight;
}

ErrorStatistics zero_error_statistics(int steps, double interval_s, double observe_s) {
  ErrorStatistics error_statistics;
  error_statistics.steps = steps;
  error_statistics.interval_s = interval_s;
  error_statistics.observe_s = observe_s;
  const auto cells = static_cast<std::size_t>(steps * kSpeedClasses);
  const auto blank = [](int f, int outputs) {
    return RegressionMoments{0.0, Eigen::MatrixXd::Zero(f, f), Eigen::MatrixXd::Zero(f, outputs)};
  };
  error_statistics.stacking.assign(cells, blank(kStackedFeatures, 1));
  error_statistics.density.fill(
      {blank(kScaleFeatures, 2), std::vector<ErrorMoments>(static_cast<std::size_t>(steps * kMixtureComponents))});
  error_statistics.density_place_free = error_statistics.density;
  error_statistics.scores.assign(static_cast<std::size_t>(steps * kScoreClasses), std::vector<double>(kScoreBins, 0.0));
  error_statistics.novelties.assign(kNoveltyBins, 0.0);
  error_statistics.slow.resize(kSlowClasses);
  error_statistics.changes.fill(blank(kHazardFeatures, 1));
  error_statistics.global_motion.fill(blank(kMotionFeatures, kCorrectionKnots));
  error_statistics.motion.fill(blank(kMotionFeatures, kCorrectionKnots));
  error_statistics.motion_share = blank(1, 1);
  error_statistics.correction = blank(kCorrectionFeatures, 2 * kCorrectionKnots);
  error_statistics.correction_share = blank(1, 1);
  return error_statistics;
}

void forget_positions(ErrorStatistics& error_statistics) {
  if (error_statistics.empty()) return;
  ErrorStatistics zero =
      zero_error_statistics(error_statistics.steps, error_statistics.interval_s, error_statistics.observe_s);
  error_statistics.correction = std::move(zero.correction);
  error_statistics.correction_share = std::move(zero.correction_share);
}

ErrorStatistics discounted(ErrorStatistics error_statistics, double share) {
  std::apply([&](auto&... tables) { (discount(tables, share), ...); }, tables_of(error_statistics));
  return error_statistics;
}

void require_like(const ErrorStatistics& a, const ErrorStatistics& b) {
  if (a.empty() || b.empty()) return;
  if (a.steps == b.steps && a.interval_s == b.interval_s && a.observe_s == b.observe_s) return;
  const auto text = [](const ErrorStatistics& of) {
    return concatenate(of.steps, " steps after ", of.observe_s, " s");
  };
  throw std::invalid_argument("add_error_statistics: " + text(b) + ", the model was fitted to " + text(a) +
                              "; keep predict.horizon_s and predict.observe_s as they were when the model began");
}

ErrorStatistics add_error_statistics(const ErrorStatistics& past, const ErrorStatistics& recent,
                                     double memory_windows) {
  if (past.empty()) return recent;
  if (recent.empty()) return past;
  require_like(past, recent);
  ErrorStatistics sum = discounted(past, std::exp(-windows_in(recent.density) / memory_windows));
  if (std::isfinite(memory_windows)) {
    favour_recent(sum.density, recent.density);
    favour_recent(sum.density_place_free, recent.density_place_free);
    const double share = share_of_past(windows_in(past.density), windows_in(recent.density));
    discount(sum.scores, share);
  }
  add(sum, recent);
  return sum;
}

void accumulate(ErrorStatistics& sum, const ErrorStatistics& more) {
  if (more.empty()) return;
  if (sum.empty()) {
    sum = more;
    return;
  }
  require_like(sum, more);
  add(sum, more);
}

void validate(const ErrorStatistics& error_statistics) {
  const bool empty = error_statistics.empty();
  if (error_statistics.steps < 0) reject_statistics("steps = " + std::to_string(error_statistics.steps));
  if (!(error_statistics.interval_s > 0.0) || !std::isfinite(error_statistics.interval_s))
    reject_statistics("interval_s must be positive");
  if (!(error_statistics.observe_s > 0.0) || !std::isfinite(error_statistics.observe_s))
    reject_statistics("observe_s must be positive");
  const std::size_t cells = empty ? 0 : static_cast<std::size_t>(error_statistics.steps) * kSpeedClasses;
  require_regressions("stacking", error_statistics.stacking, cells, kStackedFeatures, 1);
  require_densities("density", error_statistics.density, empty ? 0 : error_statistics.steps);
  require_densities("density_place_free", error_statistics.density_place_free, empty ? 0 : error_statistics.steps);
  require_length("scores", error_statistics.scores.size(), cells / kSpeedClasses * kScoreClasses);
  for (const std::vector<double>& bins : error_statistics.scores) require_bins("scores", bins, kScoreBins);
  require_bins("novelties", error_statistics.novelties, empty ? 0 : kNoveltyBins);
  const auto require_one = [&](const char* name, const RegressionMoments& moments, int features, int outputs) {
    require_regressions(name, {moments}, 1, empty ? 0 : features, empty ? 0 : outputs);
  };
  for (const RegressionMoments& change : error_statistics.changes) require_one("changes", change, kHazardFeatures, 1);
  for (const RegressionMoments& motion : error_statistics.motion)
    require_one("motion", motion, kMotionFeatures, kCorrectionKnots);
  for (const RegressionMoments& motion : error_statistics.global_motion)
    require_one("global_motion", motion, kMotionFeatures, kCorrectionKnots);
  require_one("motion_share", error_statistics.motion_share, 1, 1);
  require_one("correction", error_statistics.correction, kCorrectionFeatures, 2 * kCorrectionKnots);
  require_one("correction_share", error_statistics.correction_share, 1, 1);
  require_length("slow", error_statistics.slow.size(), empty ? 0 : kSlowClasses);
  for (const SlowErrors& slow : error_statistics.slow) {
    require_sum("slow", slow.weight);
    for (const double error_m : slow.errors_m) require_sum("slow", error_m);
  }
}

}  // namespace sila
