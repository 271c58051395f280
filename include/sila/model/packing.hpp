#pragma once

#include <cstddef>
#include <span>
#include <vector>

#include "sila/model/model.hpp"

namespace sila {

/// Parts of a model as flat lists of numbers, bit for bit: the one place that knows their order. A matrix is its
/// numbers of rows and columns and then its entries, column by column; a list is its length and then its elements.
std::vector<double> pack(const ErrorStatistics& error_statistics);
std::vector<double> pack(const FlowField& field);
std::vector<double> pack(const SparseGp& gp);
std::vector<double> pack(const CurbFrame& frame);
std::vector<double> pack(const std::vector<SiteCount>& counts);
std::vector<double> pack(const ModelSettings& settings);

/// The parts again.
/// Throws: std::invalid_argument if the numbers are too few or too many, or a size is not valid.
ErrorStatistics unpack_error_statistics(std::span<const double> numbers);
FlowField unpack_flow_field(std::span<const double> numbers);
SparseGp unpack_gp(std::span<const double> numbers);
CurbFrame unpack_frame(std::span<const double> numbers);
std::vector<SiteCount> unpack_site_counts(std::span<const double> numbers);
ModelSettings unpack_settings(std::span<const double> numbers);

/// The size of a part, and of the whole model, in a file: its numbers, without the overhead of the database [bytes].
std::size_t packed_bytes(const MotionPrimitive& primitive);
std::size_t packed_bytes(const Transition& transition);
std::size_t packed_bytes(const Site& site);
std::size_t packed_bytes(const Model& model);

/// Whether two models are the same bit for bit: -0 is not 0 here, and a NaN is itself.
bool identical(const Model& a, const Model& b);

}  // namespace sila
