#pragma once

#include <span>

#include "sila/core/curb_frame.hpp"

namespace sila::detail {

/// What a local line is found from: sums over samples, each weighted by a Gaussian of how far in time it is.
struct KernelSums {
  double weight = 0.0, time = 0.0, time_square = 0.0;  ///< times count from the middle of the kernel
  Vector2 position = Vector2::Zero(), product = Vector2::Zero();
};

/// Shapes: as many positions as times.
KernelSums kernel_sums(std::span<const double> times_s, std::span<const Vector2> positions_m, double middle_s,
                       double width_s);

}  // namespace sila::detail
