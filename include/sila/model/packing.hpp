#pragma once

#include <concepts>
#include <cstddef>
#include <span>
#include <utility>
#include <vector>

#include "sila/model/model.hpp"

namespace sila {

/// The settings of a model: the paper's and those of its residual GPs.
using AllSettings = std::pair<ModelSettings, ResidualSettings>;

/// The parts of a model that a file keeps as flat lists of numbers.
template <class Part>
concept PackedPart =
    std::same_as<Part, ErrorStatistics> || std::same_as<Part, FlowField> || std::same_as<Part, SparseGp> ||
    std::same_as<Part, CurbFrame> || std::same_as<Part, std::vector<SiteCount>> || std::same_as<Part, AllSettings>;

/// A part as numbers, bit for bit: the one place that knows their order. A matrix is its numbers of rows and columns
/// and then its entries, column by column, a symmetric one its size and the lower triangle; a list is its length and
/// then its elements.
template <PackedPart Part>
std::vector<double> pack(const Part& part);

/// The part of which `pack` made these numbers.
/// Throws: std::invalid_argument if the numbers are too few or too many, or a size is not valid.
template <PackedPart Part>
Part unpack(std::span<const double> numbers);

/// The size of a part, and of the whole model, in a file: its numbers, without the overhead of the database [bytes].
std::size_t packed_bytes(const MotionPrimitive& primitive);
std::size_t packed_bytes(const Transition& transition, const SparseGp& residual);
std::size_t packed_bytes(const Model& model);

/// Whether two models are the same bit for bit: -0 is not 0 here, and a NaN is itself.
bool identical(const Model& a, const Model& b);

}  // namespace sila
