#pragma once

#include "sila/model/model.hpp"
#include "sila/refine/predictor.hpp"

namespace sila {

/// A model and its predictor, immutable, so that threads can share them.
struct Snapshot {
  Model model;
  Predictor predictor;

  /// Throws: std::invalid_argument for a configuration out of range.
  Snapshot(Model model, const RefineConfig& config);
  /// The same result with less work: posteriors of GPs that are equal in the earlier model are not factorised again.
  Snapshot(Model model, const RefineConfig& config, const Snapshot& earlier);
};

}  // namespace sila
