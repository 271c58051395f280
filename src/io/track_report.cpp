#include "sila/io/track_report.hpp"

#include <nlohmann/json.hpp>

namespace sila {

nlohmann::json to_json(const TrackReport& report) {
  nlohmann::json dropped = nlohmann::json::object();
  for (const DroppedRows& entry : report.dropped) {
    dropped[std::string(name_of(entry.reason))] = {{"rows", entry.rows}, {"first", entry.first}};
  }
  return {{"sources", report.sources},
          {"rows_read", report.rows_read},
          {"rows_kept", report.rows_kept},
          {"dropped", dropped},
          {"track_ids", report.track_ids},
          {"tracks_kept", report.tracks_kept},
          {"out_of_order_rows", report.out_of_order_rows},
          {"splits_at_gaps", report.splits_at_gaps},
          {"splits_at_jumps", report.splits_at_jumps},
          {"standing_tracks", report.standing_tracks},
          {"warnings", report.warnings}};
}

}  // namespace sila
