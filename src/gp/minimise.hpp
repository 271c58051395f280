#pragma once

#include <Eigen/Core>
#include <functional>

namespace sila::detail {

struct ValueAndGradient {
  double value = 0.0;
  Eigen::VectorXd gradient;
};

/// The start of the search, its box, and the typical steps: the distances by which each number must change for about
/// the same change of the objective. The optimiser works in units of these.
struct SearchBox {
  Eigen::VectorXd start, lower, upper, typical_step;
};

/// A local minimum in the box [lower, upper], by dlib's box-constrained L-BFGS; never worse than the start, which is
/// clamped to the box. See docs/decisions/0010 for the choice.
Eigen::VectorXd minimise_in_box(const std::function<ValueAndGradient(const Eigen::VectorXd&)>& objective,
                                const SearchBox& box, int max_iterations);

}  // namespace sila::detail
