#include "sila/model/error_statistics.hpp"

#include <cmath>
#include <concepts>
#include <tuple>
#include <type_traits>

#include "core/concatenate.hpp"
#include "model/parts.hpp"

namespace sila {
namespace {

[[noreturn]] void reject_statistics(const auto&... parts) {
  throw invalid_argument("error statistics: ", parts...);
}

/// Rejects sums of another shape than `like`, and negative or non-finite sums; only entries of regression matrices may
/// be negative.
template <class Sums>
void require_sums(const char* name, const Sums& sums, const Sums& like) {
  const auto reject = [&](const char* what) { reject_statistics(name, what); };
  if constexpr (std::is_arithmetic_v<Sums>) {
    if (!(sums >= 0.0) || !std::isfinite(sums)) reject(" has a number that is no sum");
  } else if constexpr (std::same_as<Sums, Eigen::MatrixXd>) {
    if (sums.rows() != like.rows() || sums.cols() != like.cols()) reject(" is a regression on other features");
    if (!sums.allFinite()) reject(" has a number that is not finite");
  } else if constexpr (std::same_as<Sums, ErrorMoments>) {
    require_sums(name, sums.weight, like.weight);
    // One is a difference of squares, which rounding may leave a little below 0.
    for (const double sum : {sums.along, sums.across}) require_sums(name, sum + 1e-6, 0.0);
  } else if constexpr (requires { parts_of(sums); }) {
    const auto require_all = [&](const auto&... parts) {
      std::apply([&](const auto&... alike) { (require_sums(name, parts, alike), ...); }, parts_of(like));
    };
    std::apply(require_all, parts_of(sums));
  } else {
    if (sums.size() != like.size()) reject_statistics(name, " has ", sums.size(), " entries, must have ", like.size());
    for (std::size_t i = 0; i < sums.size(); ++i) require_sums(name, sums[i], like[i]);
  }
}

template <class Sums>
void discount(Sums& sums, double share) {
  if constexpr (requires { parts_of(sums); }) {
    std::apply([&](auto&... parts) { (discount(parts, share), ...); }, parts_of(sums));
  } else if constexpr (std::is_arithmetic_v<Sums> || std::same_as<Sums, Eigen::MatrixXd>) {
    sums *= share;
  } else {
    for (auto& entry : sums) discount(entry, share);
  }
}

/// From about this number of windows on, recent ones count more.
constexpr double kEarlyWindows = 150.0;

/// Factor of the past windows when recent ones count more. Errors were larger when the model had learnt less, so a
/// window counts as the square of the number of windows before it: online expectation maximisation with steps of up to
/// 3 / n instead of 1 / n (Cappe and Moulines 2009).
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

}  // namespace

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
  error_statistics.density.fill({blank(kScaleFeatures, kScaleOutputs),
                                 std::vector<ErrorMoments>(static_cast<std::size_t>(steps * kMixtureComponents))});
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
  for (RegressionMoments* moments : {&error_statistics.correction, &error_statistics.correction_share}) {
    moments->weight = 0.0;
    moments->features.setZero();
    moments->products.setZero();
  }
  for (RegressionMoments& change : error_statistics.changes) {
    change.features.bottomRows(kHazardPlaceFeatures).setZero();
    change.products.bottomRows(kHazardPlaceFeatures).setZero();
  }
}

ErrorStatistics discounted(ErrorStatistics error_statistics, double share) {
  discount(error_statistics, share);
  return error_statistics;
}

void require_like(const ErrorStatistics& a, const ErrorStatistics& b) {
  if (a.empty() || b.empty()) return;
  if (a.steps == b.steps && a.interval_s == b.interval_s && a.observe_s == b.observe_s) return;
  const auto text = [](const ErrorStatistics& of) {
    return concatenate("sampling.interval_s = ", of.interval_s, ", predict.horizon_s = ", of.interval_s * of.steps,
                       " and predict.observe_s = ", of.observe_s);
  };
  reject_statistics("expected those of ", text(a), ", found those of ", text(b),
                    "; all models, and a model and its later episodes, need the same values");
}

void require_one_shape(const std::vector<ErrorStatistics>& list) {
  for (const ErrorStatistics& a : list) {
    for (const ErrorStatistics& b : list) require_like(a, b);
  }
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
  add_sums(sum, recent);
  return sum;
}

void validate(const ErrorStatistics& error_statistics) {
  const int steps = error_statistics.steps;
  const double interval_s = error_statistics.interval_s, observe_s = error_statistics.observe_s;
  if (steps < 0) reject_statistics("steps = ", steps);
  if (!(interval_s > 0.0) || !std::isfinite(interval_s)) reject_statistics("interval_s must be positive");
  if (!(observe_s > 0.0) || !std::isfinite(observe_s)) reject_statistics("observe_s must be positive");
  // First, so that no damaged number of steps asks for very large tables.
  if (const auto cells = error_statistics.stacking.size(); cells != static_cast<std::size_t>(steps) * kSpeedClasses)
    reject_statistics("stacking has ", cells, " entries for ", steps, " steps");
  require_sums("error_statistics", error_statistics,
               error_statistics.empty() ? ErrorStatistics{} : zero_error_statistics(steps, interval_s, observe_s));
}

}  // namespace sila
