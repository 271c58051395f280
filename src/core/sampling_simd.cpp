// The inner loop of smoothing, compiled once for each width of vector registers; Highway takes the widest that the
// processor has when the program runs.

#include "sampling_simd.hpp"

#include <algorithm>
#include <array>

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "sampling_simd.cpp"
// What defines the targets comes first.
// clang-format off
#include <hwy/foreach_target.h>
#include <hwy/highway.h>
#include <hwy/contrib/math/math-inl.h>
// clang-format on

HWY_BEFORE_NAMESPACE();
namespace sila::detail::HWY_NAMESPACE {

namespace hn = hwy::HWY_NAMESPACE;
constexpr std::size_t kMostLanes = 8;
using Tag = hn::CappedTag<double, kMostLanes>;

double sum_of(hn::Vec<Tag> lanes) {
  return hn::GetLane(hn::SumOfLanes(Tag(), lanes));
}

KernelSums kernel_sums_simd(const double* times_s, const double* positions_m, std::size_t count, double middle_s,
                            double scale) {
  const Tag d;
  const std::size_t lanes = hn::Lanes(d);
  std::array<double, kMostLanes> last_times{};
  std::array<double, 2 * kMostLanes> last_positions{};
  auto weight = hn::Zero(d), time = weight, square = weight;
  auto x_sum = weight, y_sum = weight, off_x_sum = weight, off_y_sum = weight;
  for (std::size_t i = 0; i < count; i += lanes, times_s += lanes, positions_m += 2 * lanes) {
    const std::size_t some = std::min(lanes, count - i);
    if (some < lanes) {  // the last ones, where a whole register would be read beyond the end
      times_s = std::copy_n(times_s, some, last_times.begin()) - some;
      positions_m = std::copy_n(positions_m, 2 * some, last_positions.begin()) - 2 * some;
    }
    const auto off = hn::Sub(hn::LoadU(d, times_s), hn::Set(d, middle_s));
    const auto scaled = hn::Mul(off, hn::Set(d, scale));
    const auto w = hn::IfThenElseZero(hn::FirstN(d, some), hn::Exp(d, hn::Neg(hn::Mul(scaled, scaled))));
    const auto w_off = hn::Mul(w, off);
    hn::Vec<Tag> x, y;
    hn::LoadInterleaved2(d, positions_m, x, y);
    weight = hn::Add(weight, w), time = hn::Add(time, w_off), square = hn::MulAdd(w_off, off, square);
    x_sum = hn::MulAdd(w, x, x_sum), y_sum = hn::MulAdd(w, y, y_sum);
    off_x_sum = hn::MulAdd(w_off, x, off_x_sum), off_y_sum = hn::MulAdd(w_off, y, off_y_sum);
  }
  return {sum_of(weight),
          sum_of(time),
          sum_of(square),
          {sum_of(x_sum), sum_of(y_sum)},
          {sum_of(off_x_sum), sum_of(off_y_sum)}};
}

}  // namespace sila::detail::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
#include <numbers>

namespace sila::detail {

HWY_EXPORT(kernel_sums_simd);

KernelSums kernel_sums(std::span<const double> times_s, std::span<const Vector2> positions_m, double middle_s,
                       double width_s) {
  if (times_s.empty()) return {};
  static_assert(sizeof(Vector2) == 2 * sizeof(double));
  return HWY_DYNAMIC_DISPATCH(kernel_sums_simd)(times_s.data(), positions_m.front().data(), times_s.size(), middle_s,
                                                0.5 * std::numbers::sqrt2 / width_s);
}

}  // namespace sila::detail
#endif
