#pragma once

#include <nlohmann/json.hpp>
#include <span>
#include <string>

#include "sila/experiment/summary.hpp"

namespace sila {

/// One line a row, every value of row_values(); empty where there is none.
std::string rows_csv(std::span<const PartRow> rows);

/// One line an episode and place that was judged: scene, order, method, trial, tracks so far, size, seconds, errors.
std::string curves_csv(std::span<const nlohmann::json> parts);

/// The milestones of every part.
nlohmann::ordered_json curves_json(std::span<const nlohmann::json> parts);

nlohmann::ordered_json to_json(std::span<const MethodSummary> summaries);
nlohmann::ordered_json to_json(std::span<const Comparison> comparisons);

/// Markdown: a table of means and deviations a place, the means over places, and the comparisons.
std::string tables(std::span<const MethodSummary> summaries, std::span<const Comparison> comparisons);

}  // namespace sila
