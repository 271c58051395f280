#include <algorithm>
#include <cmath>

#include "statistics.hpp"

// Only the headers of dlib are used. Debian's configuration of dlib would require BLAS and LAPACK, which vectors of
// about ten numbers do not need, and a link-time check against the library of dlib, which is not linked.
#define DLIB_TEST_FOR_ODR_VIOLATIONS_H_
#include <dlib/assert.h>
#undef DLIB_USE_BLAS
#undef DLIB_USE_LAPACK
#include <dlib/optimization/optimization.h>

namespace sila::detail {
namespace {

/// Change of the objective by a typical step of any number, to first order, at which the search ends.
constexpr double kGradientTolerance = 1e-4;
/// Decrease in one iteration, relative to the value, at which it ends.
constexpr double kRelativeTolerance = 1e-6;

using Column = dlib::matrix<double, 0, 1>;

Column to_dlib(const Eigen::VectorXd& v) {
  return dlib::mat(v);
}

/// The objective in typical steps. dlib requests value and gradient one after the other at the same point; one
/// evaluation gives both. Keeps the best point.
class Memo {
 public:
  Memo(const std::function<ValueAndGradient(const Eigen::VectorXd&)>& objective, const SearchBox& box)
      : objective_(objective), box_(box) {}

  const ValueAndGradient& at(const Column& column) {
    const Eigen::VectorXd steps = Eigen::VectorXd::Map(&column(0), column.nr());
    if (best_.size() > 0 && steps == steps_) return last_;
    steps_ = steps;
    // Clamped, because the conversion to steps and back rounds.
    const Eigen::VectorXd x = steps.cwiseProduct(box_.typical_step).cwiseMax(box_.lower).cwiseMin(box_.upper);
    last_ = objective_(x);
    if (best_.size() == 0 || last_.value < least_) {
      best_ = x;
      least_ = last_.value;
    }
    last_.gradient = last_.gradient.cwiseProduct(box_.typical_step).eval();
    return last_;
  }

  const Eigen::VectorXd& best() const { return best_; }

 private:
  const std::function<ValueAndGradient(const Eigen::VectorXd&)>& objective_;
  const SearchBox& box_;
  Eigen::VectorXd steps_;
  ValueAndGradient last_;
  Eigen::VectorXd best_;
  double least_ = 0.0;
};

/// A stop strategy in dlib's sense: relative decrease, and the gradient without the components that press against the
/// box.
class StopRule {
 public:
  StopRule(int max_iterations, const Column& lower, const Column& upper)
      : max_iterations_(max_iterations), lower_(lower), upper_(upper) {}

  bool should_continue_search(const auto& x, double value, const auto& gradient) {
    double largest = 0.0;
    for (long i = 0; i < x.nr(); ++i) {
      const bool blocked = (x(i) <= lower_(i) && gradient(i) > 0.0) || (x(i) >= upper_(i) && gradient(i) < 0.0);
      if (!blocked) largest = std::max(largest, std::abs(gradient(i)));
    }
    const bool first = iterations_ == 0;
    const bool stalled = !first && previous_ - value <= kRelativeTolerance * std::max(1.0, std::abs(previous_));
    previous_ = value;
    return largest > kGradientTolerance && !stalled && iterations_++ < max_iterations_;
  }

 private:
  int max_iterations_;
  Column lower_;
  Column upper_;
  double previous_ = 0.0;
  int iterations_ = 0;
};

}  // namespace

Eigen::VectorXd minimise_in_box(const std::function<ValueAndGradient(const Eigen::VectorXd&)>& objective,
                                const SearchBox& box, int max_iterations) {
  Memo memo(objective, box);
  const auto in_steps = [&](const Eigen::VectorXd& x) { return to_dlib(x.cwiseQuotient(box.typical_step)); };
  const Column lower = in_steps(box.lower), upper = in_steps(box.upper);
  Column x = in_steps(box.start.cwiseMax(box.lower).cwiseMin(box.upper));
  constexpr int remembered_steps = 10;
  dlib::find_min_box_constrained(
      dlib::lbfgs_search_strategy(remembered_steps), StopRule(max_iterations, lower, upper),
      [&memo](const Column& at) { return memo.at(at).value; },
      [&memo](const Column& at) { return to_dlib(memo.at(at).gradient); }, x, lower, upper);
  return memo.best();
}

}  // namespace sila::detail
