#pragma once

#include <Eigen/Core>
#include <functional>

namespace sila::detail {

struct ValueAndGradient {
  double value = 0.0;
  Eigen::VectorXd gradient;
};

struct Stopping {
  int max_iterations = 50;
  double gradient_tolerance = 1e-4;  ///< change of the objective by a typical step of any number, to first order
  double relative_tolerance = 1e-6;  ///< decrease in one iteration, relative to the value
};

/// The start of the search, its box, and the typical steps: the distances by which each number must change for about
/// the same change of the objective. The optimiser works in units of these.
struct SearchBox {
  Eigen::VectorXd start, lower, upper, typical_step;
};

/// A local minimum in the box [lower, upper], by dlib's box-constrained L-BFGS; never worse than the start, which is
/// clamped to the box. See docs/decisions/0010 for the choice.
Eigen::VectorXd minimise_in_box(const std::function<ValueAndGradient(const Eigen::VectorXd&)>& objective,
                                const SearchBox& box, const Stopping& stopping);

}  // namespace sila::detail
