#pragma once

#include <algorithm>
#include <string>
#include <vector>

#include "sila/core/clean.hpp"

namespace sila {

/// The entry of a reason in a list by reason; a new one has no rows.
inline DroppedRows& entry_of(std::vector<DroppedRows>& list, DropReason reason) {
  const auto at = std::ranges::lower_bound(list, reason, {}, &DroppedRows::reason);
  return at != list.end() && at->reason == reason ? *at : *list.insert(at, {reason, 0, {}});
}

/// Adds the rows of a later part; the first row of a reason stays.
inline void add(std::vector<DroppedRows>& list, const std::vector<DroppedRows>& more) {
  for (const DroppedRows& entry : more) {
    DroppedRows& total = entry_of(list, entry.reason);
    if (total.rows == 0) total.first = entry.first;
    total.rows += entry.rows;
  }
}

/// Adds the report of a further part or source.
void add(TrackReport& report, const TrackReport& more);

/// "rows that have no number: 3 (first: a.csv:7, track 12)".
std::string to_text(const DroppedRows& dropped);

}  // namespace sila
