#pragma once

#include <cstddef>
#include <span>
#include <utility>
#include <vector>

#include "sila/core/trajectory.hpp"
#include "sila/model/model.hpp"
#include "sila/refine/predictor.hpp"

namespace sila {

/// A primitive of model a and one of model b (indices) that belong together, and their similarity.
struct PrimitivePair {
  int a = 0;
  int b = 0;
  double similarity = 0.0;
};

/// A transition of model a and one of model b whose primitives belong together.
struct TransitionPair {
  std::pair<int, int> a;  ///< from, to
  std::pair<int, int> b;
  double count_a = 0.0;
  double count_b = 0.0;
};

/// The differences of two models; the numbers of their primitives do not matter.
struct ModelComparison {
  std::size_t same_primitives = 0;  ///< cells and velocities equal
  std::vector<PrimitivePair> changed_primitives;
  std::vector<int> primitives_of_a;  ///< indices of primitives that only `a` has
  std::vector<int> primitives_of_b;
  std::size_t same_transitions = 0;  ///< count, field and residual GP equal
  std::vector<TransitionPair> changed_transitions;
  std::vector<std::pair<int, int>> transitions_of_a;
  std::vector<std::pair<int, int>> transitions_of_b;
};

/// Primitives belong together if they are equal, else the most similar pairs of at least the threshold, one to one.
/// Unless one of the models shares its sites, they must have a site in common.
/// Throws: std::invalid_argument if the models' settings differ.
ModelComparison compare(const Model& a, const Model& b, double similarity_threshold);

/// Distance between the mean paths of two predictors at one horizon: mean and maximum over the observed paths.
struct HorizonDifference {
  double horizon_s = 0.0;
  double mean_m = 0.0;
  double max_m = 0.0;
};

/// Synthetic observed paths: for each pseudo-input of the fields of a model a straight path that ends there, with the
/// velocity of the field. At most `most`, evenly taken; slower ones than 0.2 m/s are left out.
std::vector<CurbTrajectory> traced_paths(const Model& model, double observe_s, std::size_t most = 1000);

/// At whole seconds and at the whole horizon; nothing if no path is given. Both predict as far as `a` does.
/// Throws: std::invalid_argument if one predicts less far than the other.
std::vector<HorizonDifference> compare_predictions(const Predictor& a, const Predictor& b,
                                                   std::span<const CurbTrajectory> observed);

}  // namespace sila
