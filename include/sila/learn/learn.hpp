#pragma once

#include <cstddef>
#include <span>
#include <vector>

#include "sila/core/trajectory.hpp"
#include "sila/gp/config.hpp"
#include "sila/learn/config.hpp"
#include "sila/model/increment.hpp"

namespace sila {

/// The settings of a model. The length of its curb unit converts configured metres into units.
ModelSettings begin_settings(double reference_width_m, CurbScaling scaling, double sample_interval_s,
                             const GridConfig& config);

/// The hyper-parameters that fields start from, in curb units.
Hyperparameters starting_hyperparameters(const ModelSettings& settings, const FieldConfig& config);

/// A stretch of one track, samples [begin, end), that one primitive explains.
struct Segment {
  int primitive = 0;
  std::size_t begin = 0;
  std::size_t end = 0;
};

/// Counts of the tracks of a batch.
struct LearnReport {
  int tracks = 0;
  int standing = 0;     ///< no sample fast enough to have a heading
  int unexplained = 0;  ///< tracks for which no primitive was worth its cost
  std::size_t primitives = 0;
  std::size_t transitions = 0;
  double objective = 0.0;
};

struct LearnResult {
  Increment increment;
  LearnReport report;
  std::vector<std::vector<Segment>> segments;  ///< of each track
};

/// Learns the model of one batch, M'(n), from its tracks alone.
/// Units: tracks in curb units, sampled by the interval of the settings.
/// Throws: std::invalid_argument for a configuration out of range or a track that breaks its invariant.
/// Source: SILA paper, Alg. 1 line 3 (ASNSC, transitions, GPs).
LearnResult learn(const Batch& batch, const ModelSettings& settings, const LearnConfig& config);

/// The same for a batch of several sites that are to stay apart: each site is learnt by itself, and the increments
/// stand side by side in one.
LearnResult learn_apart(const Batch& batch, const ModelSettings& settings, const LearnConfig& config);

}  // namespace sila
