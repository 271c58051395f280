#include "sila/core/clean.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <filesystem>
#include <iterator>
#include <map>
#include <optional>
#include <tuple>
#include <unordered_map>
#include <unordered_set>

#include "core/concatenate.hpp"
#include "core/dropped_rows.hpp"
#include "core/lower.hpp"
#include "core/track_cuts.hpp"
#include "core/track_frame.hpp"
#include "core/unit_warnings.hpp"
#include "sila/core/counted.hpp"

namespace sila {
namespace {

/// Beyond this a double resolves no tenth of a millisecond; no clock counts that many seconds.
constexpr double kLargestTime_s = 1e12;

struct Sample {
  double t_s = 0.0;
  Vector2 position_m = Vector2::Zero();
  std::size_t line = 0;
};

/// The samples of one id of one source.
struct RawTrack {
  std::string id;
  std::vector<Sample> samples;
};

/// A part of a raw track between two cuts.
struct Tracklet {
  const RawTrack* track = nullptr;
  std::vector<Sample> samples;
};

void drop(TrackReport& report, DropReason reason, const std::string& source, const std::string& track,
          std::size_t line) {
  DroppedRows& total = entry_of(report.dropped, reason);
  if (total.rows++ > 0) return;
  total.first = source + (line > 0 ? ":" + std::to_string(line) : "") + ", track " + track;
  if (reason == DropReason::other_label) total.first += "; --person (person_classes) names the classes that count";
}

/// Whether a class label means a person on foot; an empty one does.
bool is_pedestrian(std::string_view label) {
  static constexpr std::array<std::string_view, 8> names{"",       "ped",    "pedestrian", "pedestrians",
                                                         "person", "people", "walker",     "human"};
  return std::ranges::find(names, lower(label)) != names.end();
}

std::optional<DropReason> fault_of(const Detection& row, const CleanConfig& config) {
  if (!std::isfinite(row.t_s) || !row.position_m.allFinite()) return DropReason::not_finite;
  if (row.position_m.cwiseAbs().maxCoeff() > config.max_abs_position_m || std::abs(row.t_s) > kLargestTime_s)
    return DropReason::absurd_value;
  if (config.pedestrians_only && !is_pedestrian(row.label)) return DropReason::other_label;
  return std::nullopt;
}

/// The usable rows by id, sorted by time. Equal stamps are sorted by position, so that the order of the input has no
/// influence.
std::vector<RawTrack> raw_tracks(const Detections& source, const CleanConfig& config, TrackReport& report) {
  std::vector<RawTrack> tracks;
  std::unordered_map<std::string_view, std::size_t> index;
  for (const Detection& row : source.rows) {
    if (const auto fault = fault_of(row, config)) {
      const bool named = fault == DropReason::other_label && row.label.size() <= kMaxIdBytes;
      drop(report, *fault, source.source, row.track + (named ? ", class " + row.label : ""), row.line);
      continue;
    }
    const auto [entry, is_new] = index.try_emplace(row.track, tracks.size());
    if (is_new) tracks.push_back({row.track, {}});
    std::vector<Sample>& samples = tracks[entry->second].samples;
    if (!samples.empty() && row.t_s < samples.back().t_s) ++report.out_of_order_rows;
    samples.push_back({row.t_s, row.position_m, row.line});
  }
  const auto key = [](const Sample& s) { return std::make_tuple(s.t_s, s.position_m.x(), s.position_m.y(), s.line); };
  for (RawTrack& track : tracks) std::ranges::sort(track.samples, {}, key);
  report.track_ids += tracks.size();
  return tracks;
}

/// One sample for several rows of the same stamp; none if they contradict one another.
std::optional<Sample> merged(std::span<const Sample> same, const std::string& id, const std::string& source,
                             TrackReport& report) {
  if (same.size() == 1) return same.front();
  const bool contradictory = std::ranges::any_of(same, [&](const Sample& sample) {
    return (sample.position_m - same.front().position_m).norm() > CleanConfig::jump_tolerance_m;
  });
  Vector2 sum = Vector2::Zero();
  std::size_t places = 0;
  for (std::size_t i = 0; i < same.size(); ++i) {
    const bool again = i > 0 && same[i].position_m == same[i - 1].position_m;
    if (!again) {
      sum += same[i].position_m;
      ++places;
    }
    if (contradictory) drop(report, DropReason::contradictory, source, id, same[i].line);
    if (!contradictory && i > 0)
      drop(report, again ? DropReason::repeated : DropReason::averaged, source, id, same[i].line);
  }
  if (contradictory) return std::nullopt;
  return Sample{same.front().t_s, sum / static_cast<double>(places), same.front().line};
}

/// Sorted samples to samples with strictly increasing times.
std::vector<Sample> one_per_stamp(const RawTrack& track, const std::string& source, TrackReport& report) {
  std::vector<Sample> result;
  result.reserve(track.samples.size());
  for (std::size_t begin = 0, end = 0; begin < track.samples.size(); begin = end) {
    while (end < track.samples.size() && track.samples[end].t_s - track.samples[begin].t_s < kSlack_s) ++end;
    const std::span<const Sample> same(track.samples.data() + begin, end - begin);
    if (const auto sample = merged(same, track.id, source, report)) result.push_back(*sample);
  }
  return result;
}

bool is_gap(const std::vector<Sample>& before, const Sample& sample, const CleanConfig& config) {
  const double last_s = before.back().t_s;
  const double interval_s = before.size() > 1 ? last_s - before[before.size() - 2].t_s : config.max_gap_s;
  return sample.t_s - last_s > longest_gap_s(interval_s, config);
}

bool is_jump(const Sample& from, const Sample& to, const CleanConfig& config) {
  return is_jump(to.position_m - from.position_m, to.t_s - from.t_s, config);
}

/// Cuts at gaps and jumps; a single sample off a path that continues without it is dropped.
std::vector<Tracklet> tracklets_of(const RawTrack& track, const std::string& source, const CleanConfig& config,
                                   TrackReport& report) {
  const std::vector<Sample> samples = one_per_stamp(track, source, report);
  std::vector<Tracklet> tracklets;
  for (std::size_t i = 0; i < samples.size(); ++i) {
    const std::vector<Sample>* before = tracklets.empty() ? nullptr : &tracklets.back().samples;
    const bool jump = before != nullptr && is_jump(before->back(), samples[i], config);
    if (jump && i + 1 < samples.size() && !is_jump(before->back(), samples[i + 1], config) &&
        !is_gap(*before, samples[i + 1], config)) {
      drop(report, DropReason::outlier, source, track.id, samples[i].line);
      continue;
    }
    const bool gap = before != nullptr && is_gap(*before, samples[i], config);
    if (jump) ++report.splits_at_jumps;
    if (gap && !jump) ++report.splits_at_gaps;
    if (before == nullptr || jump || gap) tracklets.push_back({&track, {}});
    tracklets.back().samples.push_back(samples[i]);
  }
  std::erase_if(tracklets, [&](const Tracklet& tracklet) {
    if (tracklet.samples.size() > 1) return false;
    drop(report, DropReason::single_sample, source, track.id, tracklet.samples.front().line);
    return true;
  });
  return tracklets;
}

Trajectory trajectory_of(std::string id, std::span<const Sample> samples) {
  Trajectory result{std::move(id), {}, {}};
  for (const Sample& sample : samples) {
    result.times_s.push_back(sample.t_s);
    result.positions_m.push_back(sample.position_m);
  }
  return result;
}

bool all_digits(const std::string& text) {
  return !text.empty() && std::all_of(text.begin(), text.end(), [](char c) { return c >= '0' && c <= '9'; });
}

/// The last `parts` components of a path, without the extensions of the file.
std::string tail_of(const std::filesystem::path& path, std::size_t parts) {
  std::string name = path.filename().string();
  if (const std::size_t dot = name.find('.', 1); dot != std::string::npos) name.erase(dot);
  std::filesystem::path folder = path.parent_path();
  for (std::size_t i = 1; i < parts && folder.has_filename(); ++i, folder = folder.parent_path())
    name = folder.filename().string() + "/" + name;
  return name;
}

/// Ids for tracklets in their final order: the first tracklet of a track keeps its id, later ones get "#2", "#3", ...
std::vector<std::string> ids_of(const std::vector<Tracklet>& tracklets, const std::string& prefix) {
  std::unordered_set<std::string> taken;
  for (const Tracklet& tracklet : tracklets) taken.insert(tracklet.track->id);
  std::unordered_map<const RawTrack*, std::size_t> count;
  std::vector<std::string> ids;
  for (const Tracklet& tracklet : tracklets) {
    std::string id = tracklet.track->id;
    if (std::size_t& n = count[tracklet.track]; ++n > 1) {
      // A recording may have an id "17#2" of its own.
      while (!taken.insert(id = tracklet.track->id + "#" + std::to_string(n)).second) ++n;
    }
    ids.push_back(prefix + id);
  }
  return ids;
}

std::size_t rows_dropped(const TrackReport& report, DropReason reason) {
  const auto entry = std::ranges::find(report.dropped, reason, &DroppedRows::reason);
  return entry == report.dropped.end() ? 0 : entry->rows;
}

/// Rows that share their time stamp with others of their track.
std::size_t rows_of_shared_stamps(const TrackReport& report) {
  return rows_dropped(report, DropReason::averaged) + rows_dropped(report, DropReason::contradictory);
}

/// More rows than this, and than a tenth of all, have a common cause: more jumps do not come from re-used ids, more
/// rows that stand alone not from single misses.
constexpr std::size_t kManyRows = 20;

/// A trajectory and the id that the input gave it.
struct CleanedTrack {
  Trajectory trajectory;
  std::string input_id;
};

/// The tracks of one source by start time, then id.
std::vector<CleanedTrack> clean_source(const Detections& source, const std::string& prefix, const CleanConfig& config,
                                       TrackReport& report) {
  add(report.dropped, source.dropped);
  const std::size_t shared_before = rows_of_shared_stamps(report), jumps_before = report.splits_at_jumps;
  const std::size_t alone_before = rows_dropped(report, DropReason::single_sample), gaps_before = report.splits_at_gaps;
  const std::vector<RawTrack> tracks = raw_tracks(source, config, report);
  auto& warnings = report.warnings;
  warnings.insert(warnings.end(), source.warnings.begin(), source.warnings.end());
  std::vector<Trajectory> paths;
  std::vector<Tracklet> tracklets;
  for (const RawTrack& track : tracks) {
    paths.push_back(trajectory_of(track.id, track.samples));
    std::ranges::move(tracklets_of(track, source.source, config, report), std::back_inserter(tracklets));
  }
  const std::vector<std::string> of_units = unit_warnings(paths, config.max_gap_s);
  for (const std::string& warning : of_units) warnings.push_back(source.source + ": " + warning);
  const std::size_t jumps = report.splits_at_jumps - jumps_before;
  const std::size_t alone = rows_dropped(report, DropReason::single_sample) - alone_before;
  const std::size_t many = std::max(kManyRows, source.rows.size() / 10);
  if (of_units.empty() && jumps > many)
    warnings.push_back(source.source + ": tracks jump at " + std::to_string(jumps) + " of " +
                       counted(source.rows.size(), "row") +
                       ": are the columns t, x and y in another order, or are the ids not those of persons?");
  else if (of_units.empty() && alone > many && report.splits_at_gaps - gaps_before > many)
    warnings.push_back(concatenate(source.source, ": ", alone, " of ", counted(source.rows.size(), "row"),
                                   " stand alone: the rows of their tracks are more than ", config.max_gap_s,
                                   " s apart; to keep them, set ", gap_setting(paths, config.max_gap_s)));
  if (2 * (rows_of_shared_stamps(report) - shared_before) > source.rows.size())
    warnings.push_back(
        source.source +
        ": most rows have the time stamp of another row of their track; give each person another id, or, "
        "if the stamps are whole seconds, leave them out and give frame numbers and the frame rate");
  std::sort(tracklets.begin(), tracklets.end(), [](const Tracklet& a, const Tracklet& b) {
    if (a.samples.front().t_s != b.samples.front().t_s) return a.samples.front().t_s < b.samples.front().t_s;
    return id_less(a.track->id, b.track->id);
  });
  std::vector<std::string> ids = ids_of(tracklets, prefix);
  std::vector<CleanedTrack> result;
  for (std::size_t i = 0; i < tracklets.size(); ++i)
    result.push_back({trajectory_of(std::move(ids[i]), tracklets[i].samples), prefix + tracklets[i].track->id});
  return result;
}

}  // namespace

std::string_view name_of(DropReason reason) {
  return kDropReasons[static_cast<std::size_t>(reason)].name;
}

bool id_less(const std::string& a, const std::string& b) {
  const bool a_number = all_digits(a);
  const bool b_number = all_digits(b);
  if (a_number != b_number) return a_number;
  if (a_number && a.size() != b.size()) return a.size() < b.size();
  return a < b;
}

std::vector<std::string> id_prefixes(std::span<const std::string> sources) {
  if (sources.size() <= 1) return std::vector<std::string>(sources.size());
  for (std::size_t parts = 1; parts <= 8; ++parts) {
    std::vector<std::string> names;
    for (const std::string& source : sources) names.push_back(tail_of(source, parts) + ":");
    if (std::unordered_set<std::string>(names.begin(), names.end()).size() == names.size()) return names;
  }
  std::vector<std::string> numbers;
  for (std::size_t i = 0; i < sources.size(); ++i) numbers.push_back(std::to_string(i + 1) + ":");
  return numbers;
}

CleanTracks clean(std::span<const Detections> sources, const CleanConfig& config, std::vector<std::string> id_prefix) {
  validate_fields("clean", config);
  if (id_prefix.empty()) {
    std::vector<std::string> names;
    for (const Detections& source : sources) names.push_back(source.source);
    id_prefix = id_prefixes(names);
  }
  CleanTracks result;
  TrackReport& report = result.report;
  std::size_t recordings = 0;
  for (std::size_t s = 0; s < sources.size(); ++s) {
    report.rows_read += sources[s].rows_read;
    std::map<std::string, std::size_t> recording_of;  // where there is more than one in a source
    for (CleanedTrack& track : clean_source(sources[s], id_prefix[s], config, report)) {
      report.rows_kept += track.trajectory.times_s.size();
      if (extent_m(track.trajectory) < config.standing_extent_m) ++report.standing_tracks;
      result.trajectories.push_back(std::move(track.trajectory));
      const std::string clock = sources[s].own_clocks ? track.input_id : "";
      result.trajectories.back().recording =
          recording_of.try_emplace(clock, recordings + recording_of.size()).first->second;
      result.input_ids.push_back(std::move(track.input_id));
    }
    recordings += std::max<std::size_t>(1, recording_of.size());
  }
  report.sources = sources.size();
  report.tracks_kept = result.trajectories.size();
  return result;
}

std::string to_text(const DroppedRows& dropped) {
  return "rows that " + std::string(kDropReasons[static_cast<std::size_t>(dropped.reason)].text) + ": " +
         std::to_string(dropped.rows) + " (first: " + dropped.first + ")";
}

void add(TrackReport& report, const TrackReport& more) {
  // A member that is forgotten here does not compile.
  const auto& [sources, rows_read, rows_kept, dropped, track_ids, tracks_kept, out_of_order_rows, splits_at_gaps,
               splits_at_jumps, standing_tracks, warnings] = more;
  report.sources += sources;
  report.rows_read += rows_read;
  report.rows_kept += rows_kept;
  add(report.dropped, dropped);
  report.track_ids += track_ids;
  report.tracks_kept += tracks_kept;
  report.out_of_order_rows += out_of_order_rows;
  report.splits_at_gaps += splits_at_gaps;
  report.splits_at_jumps += splits_at_jumps;
  report.standing_tracks += standing_tracks;
  report.warnings.insert(report.warnings.end(), warnings.begin(), warnings.end());
}

std::vector<std::string> to_lines(const TrackReport& report) {
  std::vector<std::string> lines;
  const auto number = [](std::size_t value) { return std::to_string(value); };
  lines.push_back(counted(report.tracks_kept, "track") + " of " + counted(report.track_ids, "id") + " in " +
                  counted(report.sources, "file") + "; " + number(report.rows_kept) + " of " +
                  number(report.rows_read) + " rows kept");
  for (const DroppedRows& entry : report.dropped) lines.push_back("dropped " + to_text(entry));
  const auto tell = [&](std::size_t count, const char* text) {
    if (count > 0) lines.push_back(text + number(count));
  };
  tell(report.out_of_order_rows, "rows out of order (sorted): ");
  tell(report.splits_at_gaps, "splits at gaps in time: ");
  tell(report.splits_at_jumps, "splits at jumps (re-used ids): ");
  tell(report.standing_tracks, "tracks that stand still (kept): ");
  for (const std::string& warning : report.warnings) lines.push_back("warning: " + warning);
  return lines;
}

}  // namespace sila
