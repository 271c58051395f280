#pragma once

#include <array>
#include <concepts>
#include <type_traits>

#include "sila/core/fields.hpp"
#include "sila/gp/sparse_gp.hpp"

namespace sila {

/// Kernel and noise of a GP, theta.
struct Hyperparameters {
  Kernel kernel;
  double noise_variance = 0.1;
};

bool operator==(const Hyperparameters& a, const Hyperparameters& b);
void validate(const Hyperparameters& hyperparameters);

enum class PseudoInputChoice { greedy, optimised };
enum class HyperparameterChoice { fixed, pooled, optimised };
enum class GpFusion { transfer, pseudo_data };
enum class ConstantMean { data, zero };

inline constexpr std::array<const char*, 2> pseudo_input_choice_names = {"greedy", "optimised"};
inline constexpr std::array<const char*, 3> hyperparameter_choice_names = {"fixed", "pooled", "optimised"};
inline constexpr std::array<const char*, 2> gp_fusion_names = {"transfer", "pseudo_data"};
inline constexpr std::array<const char*, 2> constant_mean_names = {"data", "zero"};

/// How sparse GPs are fitted and fused. Lengths and variances are in the units of the data.
struct GpConfig {
  PseudoInputChoice pseudo_inputs = PseudoInputChoice::greedy;
  HyperparameterChoice hyperparameters = HyperparameterChoice::fixed;
  ConstantMean constant_mean = ConstantMean::data;
  int max_pseudo_inputs = 30;
  double selection_stop = 0.01;
  double alpha = 1.0;
  int min_points_to_optimise = 30;
  int max_iterations = 50;
  double gradient_tolerance = 1e-4;
  double relative_tolerance = 1e-6;
  double min_length_scale = 0.5;
  double max_length_scale_extents = 3.0;
  double min_noise_variance = 0.0025;
  double min_noise_to_signal = 1e-3;
  int pooling_rounds = 2;
  GpFusion fusion = GpFusion::transfer;
  int max_fused_pseudo_inputs = 30;
  double keep_pseudo_inputs_share = 0.9;
  int max_candidates = 500;
  double lattice_step = 0.25;
};

template <class Config, class Visitor>
requires std::same_as<std::remove_const_t<Config>, GpConfig>
void fields(Config& config, Visitor&& visit) {
  visit.choice("pseudo_inputs", config.pseudo_inputs, pseudo_input_choice_names,
               "pseudo-inputs Z: chosen from the data, or moved by gradient as in the paper");
  visit.choice(
      "hyperparameters", config.hyperparameters, hyperparameter_choice_names,
      "theta: as given, one for all transitions of a batch, or one per transition by gradient as in the paper");
  visit.choice("constant_mean", config.constant_mean, constant_mean_names,
               "what a GP falls back to far from its data: their mean, or zero");
  visit.number("max_pseudo_inputs", config.max_pseudo_inputs, Range{1, 1000}, "", "most pseudo-inputs of a fit, M");
  visit.number("selection_stop", config.selection_stop, Range{0, 1}, "of the signal variance",
               "no more pseudo-inputs once every conditional variance is below this");
  visit.number("alpha", config.alpha, Range{0, 1}, "", "how the unexplained variance counts: 1 FITC, 0 DTC");
  visit.number("min_points_to_optimise", config.min_points_to_optimise, Range{2, 1e9}, "points",
               "with fewer, Z is chosen and theta kept, whatever the choices above");
  visit.number("max_iterations", config.max_iterations, Range{1, 1e6}, "", "most iterations of the optimiser");
  visit.number("gradient_tolerance", config.gradient_tolerance, Range{0}, "", "stop: largest gradient component");
  visit.number("relative_tolerance", config.relative_tolerance, Range{0}, "", "stop: relative decrease per iteration");
  visit.number("min_length_scale", config.min_length_scale, Range{.min = 0, .open_min = true}, "input units",
               "shortest length scale of an optimised theta");
  visit.number("max_length_scale_extents", config.max_length_scale_extents, Range{.min = 0, .open_min = true},
               "extents of the data", "longest length scale of an optimised theta");
  visit.number("min_noise_variance", config.min_noise_variance, Range{.min = 0, .open_min = true},
               "squared output units", "floor of an optimised noise");
  visit.number("min_noise_to_signal", config.min_noise_to_signal, Range{.min = 0, .max = 1, .open_min = true}, "",
               "floor of optimised noise variance / signal variance");
  visit.number("pooling_rounds", config.pooling_rounds, Range{1, 100}, "",
               "how often a greedy Z is chosen anew while theta is optimised");
  visit.choice("fusion", config.fusion, gp_fusion_names,
               "GPs without their data: transfer of the stored information, or weighted pseudo-data (Suk 2012)");
  visit.number("max_fused_pseudo_inputs", config.max_fused_pseudo_inputs, Range{1, 1000}, "",
               "most pseudo-inputs after a fusion");
  visit.number(
      "keep_pseudo_inputs_share", config.keep_pseudo_inputs_share, Range{0, 1}, "of the points",
      "a GP at its pseudo-input limit that holds at least this share of all points keeps its pseudo-inputs when "
      "fused; 1 disables this");
  visit.number("max_candidates", config.max_candidates, Range{1, 1e6}, "points",
               "more candidates than this are subsampled evenly");
  visit.number("lattice_step", config.lattice_step, Range{.min = 0, .max = 1, .open_min = true}, "length scales",
               "spacing of the lattice of candidate pseudo-inputs, so that none is a point of a track");
}

/// Throws: std::invalid_argument for the first field out of its range.
void validate(const GpConfig& config);

}  // namespace sila
