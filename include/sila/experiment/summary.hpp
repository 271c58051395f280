#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "sila/experiment/part.hpp"

namespace sila {

/// Mean and standard deviation over trials; without a value, NaN-free: `count` is 0.
struct Spread {
  std::size_t count = 0;
  double mean = 0.0;
  double deviation = 0.0;
};
Spread spread_of(std::span<const double> values);

/// The numbers of a row by which results are told; a ratio is to the weighted MHD of constant velocity on the same
/// windows.
struct RowValue {
  const char* name;
  const char* title;  ///< empty: in no table, in the CSV file alone
  int decimals;
  /// Nothing where the row has no such window.
  std::optional<double> (*of)(const PartRow& row);
};
std::span<const RowValue> row_values();

/// One method at one place, over all trials and orders.
struct MethodSummary {
  std::string place;
  std::string method;
  std::vector<Spread> values;  ///< as row_values()
};
/// In the order in which places and methods first come.
std::vector<MethodSummary> summarise(std::span<const PartRow> rows);

/// How much larger the error of a method is than that of another: sum of the differences over the sum of constant
/// velocity's errors, both over the moving windows of the same people in the same trials; with a 95 % interval by
/// resampling people. A place may be "mean": the mean over places.
struct Comparison {
  std::string place;
  std::string method;
  std::string against;  ///< a method, or "constant velocity"
  std::size_t people = 0;
  double difference = 0.0;
  double low = 0.0;
  double high = 0.0;
};
/// Each method against constant velocity and against `reference`, where that is another and was there in the same
/// trials. The same seed gives the same intervals.
std::vector<Comparison> compare(std::span<const PartRow> rows, const std::string& reference, int bootstraps,
                                std::uint64_t seed);

}  // namespace sila
