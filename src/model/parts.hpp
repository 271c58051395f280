#pragma once

#include <concepts>
#include <cstddef>
#include <tuple>
#include <type_traits>

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

/// Adds sums of the same shape, part by part.
template <class Sums>
void add_sums(Sums& sums, const Sums& more) {
  if constexpr (requires { parts_of(sums); }) {
    const auto add_all = [&](auto&... parts) {
      std::apply([&](const auto&... others) { (add_sums(parts, others), ...); }, parts_of(more));
    };
    std::apply(add_all, parts_of(sums));
  } else if constexpr (std::is_arithmetic_v<Sums> || std::same_as<Sums, Eigen::MatrixXd>) {
    sums += more;
  } else {
    for (std::size_t i = 0; i < sums.size(); ++i) add_sums(sums[i], more[i]);
  }
}

/// Adds n examples of one weight to a regression. Shapes: features F x n, targets n x P.
template <class Features, class Targets>
void add_examples(RegressionMoments& moments, const Features& features, const Targets& targets, double weight) {
  moments.weight += weight;
  moments.features.template selfadjointView<Eigen::Lower>().rankUpdate(features, weight);
  moments.products.noalias() += weight * features * targets;
}

}  // namespace sila
