#include "sila/io/log.hpp"

#include <ctime>
#include <iomanip>
#include <optional>
#include <sstream>

namespace sila {
namespace {

using nlohmann::ordered_json;

/// What became of the primitives in an episode.
struct Changes {
  std::size_t added = 0, fused = 0, split = 0, gone = 0;
};

std::size_t length_of(const ordered_json& object, const char* key) {
  const auto found = object.find(key);
  return found != object.end() && found->is_array() ? found->size() : 0;
}

std::optional<Changes> changes_of(const EpisodeRecord& episode) {
  const ordered_json statistics = ordered_json::parse(episode.statistics, nullptr, false);
  if (!statistics.is_object() || !statistics.contains("change") || !statistics["change"].is_object()) return {};
  const ordered_json& change = statistics["change"];
  Changes changes{length_of(change, "added"), length_of(change, "fused"), length_of(change, "split"),
                  length_of(change, "gone")};
  if (change.contains("incoming_split") && change["incoming_split"].is_number_unsigned())
    changes.split += change["incoming_split"].get<std::size_t>();
  return changes;
}

/// As ISO 8601, UTC; "-" if not known.
std::string when(const EpisodeRecord& episode) {
  const auto time = static_cast<std::time_t>(episode.committed_s);
  std::tm parts{};
  if (episode.committed_s <= 0 || gmtime_r(&time, &parts) == nullptr) return "-";
  std::ostringstream text;
  text << std::put_time(&parts, "%FT%TZ");
  return std::move(text).str();
}

}  // namespace

std::string describe_log(const StoredModel& stored, int oldest) {
  std::ostringstream text;
  const auto column = [&](int width) -> std::ostream& { return text << std::right << std::setw(width); };
  text << "episode  when                  tracks   seconds   size          added  fused  split  gone\n";
  for (const EpisodeRecord& episode : stored.episodes) {
    column(7) << episode.number << "  " << std::left << std::setw(20) << when(episode);
    column(8) << episode.tracks;
    column(10) << std::fixed << std::setprecision(3) << episode.seconds;
    column(6) << episode.size_before << " -> " << std::left << std::setw(6) << episode.size_after;
    const std::optional<Changes> changes = changes_of(episode);
    const auto number = [&](std::size_t Changes::*member) {
      return changes ? std::to_string((*changes).*member) : std::string("-");
    };
    column(5) << number(&Changes::added), column(7) << number(&Changes::fused);
    column(7) << number(&Changes::split), column(6) << number(&Changes::gone) << '\n';
  }
  if (stored.episodes.empty()) return "no episode is recorded\n";
  text << "can be rolled back to episode " << oldest;
  text << (oldest == stored.episodes.back().number ? ", the last, alone\n" : " and those after it\n");
  return std::move(text).str();
}

ordered_json log_json(const StoredModel& stored, int oldest) {
  ordered_json list = ordered_json::array();
  for (const EpisodeRecord& episode : stored.episodes) {
    ordered_json& entry = list.emplace_back(ordered_json{{"number", episode.number},
                                                         {"committed_s", episode.committed_s},
                                                         {"tracks", episode.tracks},
                                                         {"seconds", episode.seconds},
                                                         {"size_before", episode.size_before},
                                                         {"size_after", episode.size_after}});
    if (const auto changes = changes_of(episode)) {
      entry["added"] = changes->added, entry["fused"] = changes->fused;
      entry["split"] = changes->split, entry["gone"] = changes->gone;
    }
  }
  return {{"episodes", std::move(list)}, {"oldest_rollback", oldest}};
}

}  // namespace sila
