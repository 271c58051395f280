#pragma once

#include <Eigen/Geometry>

#include "sila/gp/sparse_gp.hpp"

namespace sila {

/// Eigen's box, but copying it is known not to throw. Otherwise a list of fields that grows would copy all their
/// matrices instead of moving them.
struct Extent : Eigen::AlignedBox2d {
  using Eigen::AlignedBox2d::AlignedBox2d;
  Extent() = default;
  Extent(const Eigen::AlignedBox2d& box) : Eigen::AlignedBox2d(box) {}
  Extent(const Extent& other) noexcept : Eigen::AlignedBox2d(other) {}
  Extent& operator=(const Extent& other) noexcept {
    Eigen::AlignedBox2d::operator=(other);
    return *this;
  }
};

/// Position -> velocity, both in curb coordinates: a sparse GP with two inputs and two outputs, and the box of its
/// data.
struct FlowField {
  SparseGp gp;
  Extent extent;  ///< of the positions that it was fitted to [sidewalk widths]
};

}  // namespace sila
