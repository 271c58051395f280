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

/// Position -> velocity, both in curb coordinates: one sparse GP with two inputs and two outputs, or one for each
/// component of the velocity; and the box of its data. All fields of a model are of one of the two kinds.
struct FlowField {
  SparseGp gp;         ///< of both components, or of that along axis 1
  Extent extent;       ///< of the positions that it was fitted to [curb units]
  SparseGp gp_y = {};  ///< of the component along axis 2; no output: `gp` has both

  bool independent() const { return gp_y.mean.size() > 0; }
  const SparseGp* second() const { return independent() ? &gp_y : nullptr; }
};

}  // namespace sila
