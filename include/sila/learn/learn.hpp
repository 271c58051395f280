#pragma once

#include <span>

#include "sila/core/trajectory.hpp"
#include "sila/gp/config.hpp"
#include "sila/learn/config.hpp"
#include "sila/model/batch.hpp"
#include "sila/model/increment.hpp"

namespace sila {

/// The conventions of a model that begins with this sidewalk width: configured metres become widths by it.
Conventions begin_conventions(double reference_width_m, CurbScaling scaling, double sample_interval_s,
                              const GridConfig& config);

/// The same, for a model that learns outlooks until `horizon_s`.
Conventions with_outlooks(Conventions conventions, double horizon_s, const OutlookConfig& config);

/// The hyper-parameters that fields start from, in the widths of the place where the model began.
Hyperparameters starting_hyperparameters(const Conventions& conventions, const FieldConfig& config);

/// What became of the tracks of a batch.
struct LearnReport {
  int tracks = 0;
  int standing = 0;     ///< no sample fast enough to have a heading
  int unexplained = 0;  ///< no primitive was worth learning for them
  std::size_t primitives = 0;
  std::size_t transitions = 0;
  double objective = 0.0;
};

struct Learnt {
  Increment increment;
  LearnReport report;
};

/// Learns the model of one batch, M'(n), from its tracks alone.
/// Units: tracks in sidewalk widths, sampled by the conventions' interval.
/// Throws: std::invalid_argument for a configuration out of range or a track that breaks its invariant.
/// Source: SILA paper, Alg. 1 line 3 (ASNSC, transitions, GPs).
Learnt learn(const Batch& batch, const Conventions& conventions, const LearnConfig& config,
             const OutlookConfig& outlook = {});

}  // namespace sila
