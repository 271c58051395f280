// The inner loops of kernels and posteriors, compiled once for each width of vector registers; Highway takes the widest
// that the processor has when the program runs.

#include "posterior_simd.hpp"

#include <algorithm>

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "posterior_simd.cpp"
// The definition of the targets comes first.
// clang-format off
#include <hwy/foreach_target.h>
#include <hwy/highway.h>
#include <hwy/contrib/math/math-inl.h>
// clang-format on

HWY_BEFORE_NAMESPACE();
namespace sila::detail::HWY_NAMESPACE {

namespace hn = hwy::HWY_NAMESPACE;
using Tag = hn::CappedTag<double, kColumnPadding>;

void kernel_vector_simd(const KernelView& view, const double* x, double* k) {
  const Tag d;
  const auto signal = hn::Set(d, view.signal_variance), half = hn::Set(d, -0.5);
  for (std::size_t column = 0; column < view.columns; column += hn::Lanes(d)) {
    auto squares = hn::Zero(d);
    for (std::size_t input = 0; input < view.inputs; ++input) {
      const auto z = hn::LoadU(d, view.points + input * view.columns + column);
      const auto scale = hn::Set(d, view.inverse_length_scales[input]);
      const auto off = hn::Mul(hn::Sub(z, hn::Set(d, x[input])), scale);
      squares = hn::MulAdd(off, off, squares);
    }
    hn::StoreU(hn::Mul(signal, hn::Exp(d, hn::Mul(half, squares))), d, k + column);
  }
}

/// The first rows of `weights` times k; two rows at a time, as their sums are independent.
void weighted_sums(const PosteriorView& view, const double* k, std::size_t rows, double* sums) {
  const Tag d;
  for (std::size_t row = 0; row < rows; row += 2) {
    const bool two = row + 1 < rows;
    const double* first = view.weights + row * view.columns;
    const double* second = two ? first + view.columns : first;
    auto first_sum = hn::Zero(d), second_sum = first_sum;
    for (std::size_t column = 0; column < view.columns; column += hn::Lanes(d)) {
      const auto here = hn::LoadU(d, k + column);
      first_sum = hn::MulAdd(hn::LoadU(d, first + column), here, first_sum);
      second_sum = hn::MulAdd(hn::LoadU(d, second + column), here, second_sum);
    }
    sums[row] = hn::GetLane(hn::SumOfLanes(d, first_sum));
    if (two) sums[row + 1] = hn::GetLane(hn::SumOfLanes(d, second_sum));
  }
}

void means_simd(const PosteriorView& view, const double* k, double* sums) {
  weighted_sums(view, k, view.outputs, sums);
  for (std::size_t output = 0; output < view.outputs; ++output) sums[output] += view.mean[output];
}

void means_and_norms_of_product_simd(const PosteriorView& view, const double* a, const double* b, double* sums) {
  const Tag d;
  const double *first = view.weights, *second = first + view.columns, *norms = second + view.columns;
  auto first_sum = hn::Zero(d), second_sum = first_sum, norms_sum = first_sum;
  for (std::size_t column = 0; column < view.columns; column += hn::Lanes(d)) {
    const auto here = hn::Mul(hn::LoadU(d, a + column), hn::LoadU(d, b + column));
    first_sum = hn::MulAdd(hn::LoadU(d, first + column), here, first_sum);
    second_sum = hn::MulAdd(hn::LoadU(d, second + column), here, second_sum);
    norms_sum = hn::MulAdd(hn::LoadU(d, norms + column), here, norms_sum);
  }
  sums[0] = hn::GetLane(hn::SumOfLanes(d, first_sum)) + view.mean[0];
  sums[1] = hn::GetLane(hn::SumOfLanes(d, second_sum)) + view.mean[1];
  sums[2] = hn::GetLane(hn::SumOfLanes(d, norms_sum));
}

double sum_of_norms_simd(const PosteriorView& view, const double* k) {
  PosteriorView norms = view;
  norms.weights += view.outputs * view.columns;
  double sum = 0.0;
  weighted_sums(norms, k, 1, &sum);
  return sum;
}

void jacobian_simd(const PosteriorView& view, const double* x, const double* k, double* jacobian) {
  const Tag d;
  for (std::size_t output = 0; output < view.outputs; ++output) {
    const double* weights = view.weights + output * view.columns;
    for (std::size_t input = 0; input < view.inputs; ++input) {
      const double* z = view.points + input * view.columns;
      const auto here = hn::Set(d, x[input]);
      auto sum = hn::Zero(d);
      for (std::size_t column = 0; column < view.columns; column += hn::Lanes(d)) {
        const auto share = hn::Mul(hn::LoadU(d, weights + column), hn::LoadU(d, k + column));
        sum = hn::MulAdd(share, hn::Sub(hn::LoadU(d, z + column), here), sum);
      }
      const double scale = view.inverse_length_scales[input];
      jacobian[output * view.inputs + input] = scale * scale * hn::GetLane(hn::SumOfLanes(d, sum));
    }
  }
}

/// Two registers of rows and four columns at a time: eight independent sums. The table is read from its first number to
/// its last, in the order of the memory.
double explained_variance_simd(const PosteriorView& view, const double* k) {
  const Tag d;
  const std::size_t lanes = hn::Lanes(d);
  auto total = hn::Zero(d);
  const double* panel = view.reduction;
  for (std::size_t row = 0; row < view.columns; row += kPanelRows) {
    for (std::size_t of_panel = 0; of_panel < kPanelRows; of_panel += 2 * lanes) {
      auto low_0 = hn::Zero(d), low_1 = low_0, low_2 = low_0, low_3 = low_0;
      auto high_0 = low_0, high_1 = low_0, high_2 = low_0, high_3 = low_0;
      const std::size_t last = std::min(view.columns, row + of_panel + 2 * lanes);
      const double* at = panel + of_panel;
      for (std::size_t column = 0; column < last; column += 4, at += 4 * kPanelRows) {
        const double *second = at + kPanelRows, *third = second + kPanelRows, *fourth = third + kPanelRows;
        const auto k_0 = hn::Set(d, k[column]), k_1 = hn::Set(d, k[column + 1]);
        const auto k_2 = hn::Set(d, k[column + 2]), k_3 = hn::Set(d, k[column + 3]);
        low_0 = hn::MulAdd(hn::LoadU(d, at), k_0, low_0);
        high_0 = hn::MulAdd(hn::LoadU(d, at + lanes), k_0, high_0);
        low_1 = hn::MulAdd(hn::LoadU(d, second), k_1, low_1);
        high_1 = hn::MulAdd(hn::LoadU(d, second + lanes), k_1, high_1);
        low_2 = hn::MulAdd(hn::LoadU(d, third), k_2, low_2);
        high_2 = hn::MulAdd(hn::LoadU(d, third + lanes), k_2, high_2);
        low_3 = hn::MulAdd(hn::LoadU(d, fourth), k_3, low_3);
        high_3 = hn::MulAdd(hn::LoadU(d, fourth + lanes), k_3, high_3);
      }
      const auto low = hn::Add(hn::Add(low_0, low_1), hn::Add(low_2, low_3));
      const auto high = hn::Add(hn::Add(high_0, high_1), hn::Add(high_2, high_3));
      total = hn::MulAdd(low, low, hn::MulAdd(high, high, total));
    }
    panel += panel_columns(row, view.columns) * kPanelRows;
  }
  return hn::GetLane(hn::SumOfLanes(d, total));
}

}  // namespace sila::detail::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace sila::detail {

HWY_EXPORT(kernel_vector_simd);
HWY_EXPORT(means_simd);
HWY_EXPORT(means_and_norms_of_product_simd);
HWY_EXPORT(sum_of_norms_simd);
HWY_EXPORT(jacobian_simd);
HWY_EXPORT(explained_variance_simd);

void kernel_vector(const KernelView& view, const double* x, double* k) {
  HWY_DYNAMIC_DISPATCH(kernel_vector_simd)(view, x, k);
}

void means(const PosteriorView& view, const double* k, double* sums) {
  HWY_DYNAMIC_DISPATCH(means_simd)(view, k, sums);
}

void means_and_norms_of_product(const PosteriorView& view, const double* a, const double* b, double* sums) {
  HWY_DYNAMIC_DISPATCH(means_and_norms_of_product_simd)(view, a, b, sums);
}

double sum_of_norms(const PosteriorView& view, const double* k) {
  return HWY_DYNAMIC_DISPATCH(sum_of_norms_simd)(view, k);
}

void jacobian(const PosteriorView& view, const double* x, const double* k, double* jacobian) {
  HWY_DYNAMIC_DISPATCH(jacobian_simd)(view, x, k, jacobian);
}

double explained_variance(const PosteriorView& view, const double* k) {
  return HWY_DYNAMIC_DISPATCH(explained_variance_simd)(view, k);
}

}  // namespace sila::detail
#endif
