#pragma once

#include <tuple>

#include "sila/core/fields.hpp"
#include "sila/model/error_statistics.hpp"

namespace sila {

// The parts of a struct of sums, in the order in which they are stored; a member that is added to a struct and
// forgotten here does not compile.

auto parts_of(MaybeConst<RegressionMoments> auto& moments) {
  auto& [weight, features, products] = moments;
  return std::tie(weight, features, products);
}

auto parts_of(MaybeConst<ErrorMoments> auto& moments) {
  auto& [weight, along, across] = moments;
  return std::tie(weight, along, across);
}

auto parts_of(MaybeConst<DensityMoments> auto& moments) {
  auto& [scale, components] = moments;
  return std::tie(scale, components);
}

auto parts_of(MaybeConst<SlowErrors> auto& errors) {
  auto& [weight, errors_m] = errors;
  return std::tie(weight, errors_m);
}

auto parts_of(MaybeConst<ErrorStatistics> auto& error_statistics) {
  auto& [steps, interval_s, observe_s, stacking, density, density_place_free, scores, novelties, slow, changes,
         global_motion, motion, motion_share, correction, correction_share] = error_statistics;
  return std::tie(stacking, density, density_place_free, scores, novelties, slow, changes, global_motion, motion,
                  motion_share, correction, correction_share);
}

}  // namespace sila
