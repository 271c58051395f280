#pragma once

#include <Eigen/Geometry>

#include "sila/gp/sparse_gp.hpp"

namespace sila {

/// Position -> velocity, both in curb coordinates: a sparse GP with two inputs and two outputs, and the box of its
/// data.
struct FlowField {
  SparseGp gp;
  Eigen::AlignedBox2d extent;  ///< of the positions that it was fitted to [sidewalk widths]
};

}  // namespace sila
