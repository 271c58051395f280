#pragma once

#include <cstddef>
#include <span>
#include <vector>

#include "sila/core/fields.hpp"
#include "sila/core/trajectory.hpp"
#include "sila/gp/sparse_gp.hpp"
#include "sila/model/model.hpp"

namespace sila {

/// The grid of a new model. Its lengths in metres become curb units when the model begins (see ModelSettings).
struct GridConfig {
  double cell_m = 1.0;
  /// Side of a tile, at whose borders aligned primitives are cut [cells].
  static constexpr int tile_cells = 8;
};

void fields(MaybeConst<GridConfig> auto& config, auto&& visit) {
  visit.number("cell_m", config.cell_m, Range{0.05, 20.0}, "m",
               "side of a grid cell at the place where the model begins");
}

/// Where a path is cut into the support of a new primitive.
enum class CutRule {
  aligned,            ///< at the borders of a fixed tiling, so that two batches cut the same way
  first_unexplained,  ///< at the first cells that no primitive explains yet (as the paper's growth suggests)
};
inline constexpr const char* kCutRules[] = {"aligned", "first_unexplained"};

/// Dictionary learning by augmented semi-nonnegative sparse coding (ASNSC). Source: Chen, Liu, How 2016; docs/learn.md,
/// sections 2 to 5.
struct DictionaryConfig {
  /// Slower samples have no heading (v_min) [m/s].
  static constexpr double min_speed_mps = 0.2;
  /// Cost of using a primitive in a track [cell visits] (lambda).
  static constexpr double sparsity = 1.0;
  /// Minimum path length that a new primitive must explain (tau) [m].
  static constexpr double gain_m = 6.0;
  bool support_mask = true;
  /// How far the support reaches beyond the path (delta) [cells].
  static constexpr int dilation_cells = 1;
  CutRule cut = CutRule::aligned;
  /// Longest path of a primitive under first_unexplained [m]; not a setting.
  double run_m = 10.0;
  int max_primitives = 2000;  ///< learnt from one batch (L_max); not a setting
};

void fields(MaybeConst<DictionaryConfig> auto& config, auto&& visit) {
  visit.flag("support_mask", config.support_mask,
             "limit each primitive to its own cells; off: one primitive covers a whole route");
  visit.choice("cut", config.cut, kCutRules, "where a path is cut into primitives");
}

/// How the two components of a field's velocity are modelled.
enum class FieldOutputs {
  shared,       ///< one GP with two outputs: one set of pseudo-inputs, one theta
  independent,  ///< GP_x and GP_y, each with its own pseudo-inputs and theta (paper)
};
inline constexpr const char* kFieldOutputs[] = {"shared", "independent"};

/// Velocity fields of the transitions: the kernel that they start from, and how the GPs are fitted.
struct FieldConfig {
  FieldOutputs outputs = FieldOutputs::shared;
  double stride_s = 0.0;
  /// Prior deviation of a field from its mean (sigma_f) [m/s].
  static constexpr double signal_std_mps = 0.8;
  /// Distance over which velocities agree (l) [m].
  static constexpr double length_scale_m = 2.0;
  /// Spread of people around a field (sigma_n) [m/s].
  static constexpr double noise_std_mps = 0.3;
  GpConfig gp;
};

void fields(MaybeConst<FieldConfig> auto& config, auto&& visit) {
  visit.choice("outputs", config.outputs, kFieldOutputs,
               "one GP for both components of the velocity, or one for each as in the paper");
  visit.number("stride_s", config.stride_s, Range{0.0, 60.0}, "s",
               "time between the samples of a track that a field is fitted to, as neighbours are correlated; 0: all");
  visit.choice("pseudo_inputs", config.gp.pseudo_inputs, pseudo_input_choice_names,
               "pseudo-inputs: chosen from the data, or moved by gradient, with hyperparameters of each transition, as "
               "in the paper");
  visit.number("max_pseudo_inputs", config.gp.max_pseudo_inputs, Range{1, 1000}, "",
               "maximum number of pseudo-inputs of a fit, M");
}

/// All settings of `learn`.
struct LearnConfig {
  GridConfig grid;
  DictionaryConfig dictionary;
  FieldConfig field;
};

void fields(MaybeConst<LearnConfig> auto& config, auto&& visit) {
  visit.group("grid", config.grid);
  visit.group("dictionary", config.dictionary);
  visit.group("field", config.field);
}

/// The settings of a new model: configured metres become curb units of `reference_width_m` metres.
ModelSettings begin_settings(double reference_width_m, CurbScaling scaling, double sample_interval_s,
                             const GridConfig& config);

/// A stretch of one track, samples [begin, end), that one primitive explains.
struct Segment {
  int primitive = 0;
  std::size_t begin = 0;
  std::size_t end = 0;
};

/// Counts of the tracks of a batch.
struct LearnReport {
  int standing = 0;     ///< no sample fast enough to have a heading
  int unexplained = 0;  ///< tracks for which no primitive was worth its cost
  std::size_t primitives = 0;
  std::size_t transitions = 0;
};

/// The increment of a batch, and how it was made.
struct LearnResult {
  Increment increment;
  LearnReport report;
  std::vector<std::vector<Segment>> segments;  ///< of each track
};

/// Learns the model of one batch, M'(n), from its tracks alone. With sites apart each site is learnt by itself, without
/// transitions between sites. `sharing` must be the FuseConfig::sites of the fusion that follows, whose default is
/// `apart`: shared sites are laid over each other.
/// Units: tracks in curb units, sampled by the interval of the settings.
/// Throws: std::invalid_argument for a configuration out of range or a track that breaks its invariant.
/// Source: SILA paper, Alg. 1 line 3 (ASNSC, transitions, GPs).
LearnResult learn(std::span<const CurbTrajectory> tracks, const ModelSettings& settings, const LearnConfig& config,
                  SiteSharing sharing = SiteSharing::shared);

}  // namespace sila
