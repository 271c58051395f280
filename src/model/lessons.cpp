#include "sila/model/lessons.hpp"

#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <string>

namespace sila {
namespace {

[[noreturn]] void refuse(const std::string& what) {
  throw std::invalid_argument("lessons: " + what);
}

void require_length(const char* name, std::size_t length, std::size_t wanted) {
  if (length == wanted) return;
  refuse(std::string(name) + " has " + std::to_string(length) + " entries, must have " + std::to_string(wanted));
}

/// Of something that was counted or summed up from squares.
void require_sum(const char* name, double value) {
  if (!(value >= 0.0) || !std::isfinite(value)) refuse(std::string(name).append(" has a number that is no sum"));
}

void require_regressions(const char* name, const std::vector<RegressionMoments>& table, std::size_t cells,
                         int features) {
  require_length(name, table.size(), cells);
  for (const RegressionMoments& moments : table) {
    require_sum(name, moments.weight);
    if (moments.features.rows() != features || moments.features.cols() != features ||
        moments.products.size() != features)
      refuse(std::string(name) + " is not a regression on " + std::to_string(features) + " features");
    if (!moments.features.allFinite() || !moments.products.allFinite())
      refuse(std::string(name) + " has a number that is not finite");
  }
}

void require_residuals(const char* name, const std::vector<ResidualMoments>& table, std::size_t cells) {
  require_length(name, table.size(), cells);
  for (const ResidualMoments& moments : table) {
    require_sum(name, moments.weight);
    // One is a difference of squares, which rounding may leave a little below 0.
    for (const double sum_m2 : {moments.along_m2, moments.across_m2}) require_sum(name, sum_m2 + 1e-6);
  }
}

void require_bins(const char* name, const std::vector<double>& bins, std::size_t wanted) {
  require_length(name, bins.size(), wanted);
  for (const double count : bins) require_sum(name, count);
}

}  // namespace

void validate(const Lessons& lessons) {
  const bool empty = lessons.empty();
  if (lessons.steps < 0 || (!empty && lessons.classes != kSpeedClasses))
    refuse("steps = " + std::to_string(lessons.steps) + ", classes = " + std::to_string(lessons.classes) +
           ", there must be " + std::to_string(kSpeedClasses) + " classes");
  if (!(lessons.interval_s > 0.0) || !std::isfinite(lessons.interval_s)) refuse("interval_s must be positive");
  const std::size_t cells = empty ? 0 : static_cast<std::size_t>(lessons.steps) * kSpeedClasses;
  require_regressions("with_map", lessons.with_map, cells, kMapFeatures);
  require_regressions("without_map", lessons.without_map, cells, kAloneFeatures);
  require_residuals("residuals_with_map", lessons.residuals_with_map, cells);
  require_residuals("residuals_without_map", lessons.residuals_without_map, cells);
  require_residuals("residuals_place_free", lessons.residuals_place_free, cells);
  require_length("surprises", lessons.surprises.size(), cells);
  for (const std::vector<double>& bins : lessons.surprises) require_bins("surprises", bins, kSurpriseBins);
  require_bins("novelties", lessons.novelties, empty ? 0 : kNoveltyBins);
}

}  // namespace sila
