#include "sila/service/stream.hpp"

#include <algorithm>
#include <cmath>
#include <iterator>

#include "clock.hpp"
#include "core/concatenate.hpp"
#include "core/unit_warnings.hpp"
#include "open_track.hpp"
#include "sila/core/companions.hpp"
#include "sila/core/counted.hpp"
#include "sila/core/sampling.hpp"

namespace sila {
namespace {

/// Interval at which the ends of tracks are checked, on the clock of the stream.
constexpr double kCheckInterval_s = 0.25;
/// Tracks by which units are checked, and detections until which there must be a prediction.
constexpr std::uint64_t kFirstTracks = 20, kFirstDetections = 10000;
/// A stream warns of its ids at this number of contradictory detections, if they are a tenth of all or more.
constexpr std::uint64_t kManyContradictory = 100;

/// The score of a prediction on a path that has its future; none if the path does not, or has no sample at t0.
std::optional<WindowScore> score_of(const Prediction& prediction, const Trajectory& path,
                                    const ServiceSettings& settings) {
  const double t0_s = prediction.t0_s;
  const auto last = std::lower_bound(path.times_s.begin(), path.times_s.end(), t0_s);
  if (last == path.times_s.end() || *last != t0_s) return std::nullopt;
  const double horizon_s = settings.episode.predict.horizon_s;
  const auto steps = static_cast<std::size_t>(steps_in(horizon_s, settings.episode.sampling.interval_s));
  if (t0_s + horizon_s > path.times_s.back() + 1e-3) return std::nullopt;
  const auto index = static_cast<std::size_t>(last - path.times_s.begin());
  Window window;
  window.observed.id = path.id;
  window.past_m = past(path, index, settings.episode.predict.observe_s, settings.episode.sampling);
  window.future_m = future(path, index, steps, settings.episode.sampling);
  if (window.future_m.size() < steps) return std::nullopt;
  const LinearReference constant_velocity =
      unfitted_reference(Reference::constant_velocity, steps, settings.episode.sampling.interval_s);
  return score_window(prediction, window, std::span(&constant_velocity, 1), settings.episode, settings.evaluate);
}

void add_score(StreamCore& core, Pedestrian& pedestrian, const Prediction& prediction,
               const std::optional<WindowScore>& score) {
  --core.counters.pending_scores;
  ++(score ? core.counters.scored : core.counters.unscorable);
  if (!score) return;
  add(pedestrian.score, *score, !prediction.regions.empty());
  if (core.keep_windows) core.windows.push_back(*score);
}

/// Whether the future of a prediction is complete on the path and no late detection can change it.
bool is_final(const Prediction& prediction, const Trajectory& path, const ServiceSettings& settings) {
  const double t0_s = prediction.t0_s;
  return !path.times_s.empty() && t0_s >= path.times_s.front() &&
         t0_s + settings.episode.predict.horizon_s + settings.service.late_s <= path.times_s.back();
}

void queue_score(StreamCore& core, StreamId id, const std::string& track, Pedestrian& pedestrian,
                 const ServiceSettings& settings) {
  if (pedestrian.score_queued || pedestrian.pending.empty()) return;
  if (!is_final(pedestrian.pending.front(), pedestrian.track.path, settings)) return;
  pedestrian.score_queued = true;
  core.due_scores.emplace_back(id, track);
}

/// `first`: after which of them nothing was predicted.
void warn_if_not_predicted(StreamCore& core, const std::string& first, const ServiceSettings& settings) {
  if (core.counters.predictions + core.counters.superseded + due_predictions(core) > 0) return;
  core.warnings.push_back("no prediction was due in the first " + first +
                          concatenate(": detections of an id are more than ", settings.clean.max_gap_s,
                                      " s apart (clean.max_gap_s), several have one time stamp, or an id is not that "
                                      "of one person"));
}

/// Warns once for a stream. `track`: that of the id of the row, without the row.
void check_ids(StreamCore& core, Stream& stream, const OpenTrack& track, const Detection& row) {
  ++stream.checked_ids;
  if (track.rows.empty() || track.rows.back().t_s != row.t_s) return;
  if ((track.rows.back().position_m - row.position_m).norm() <= CleanConfig::jump_tolerance_m) return;
  if (++stream.contradictory != kManyContradictory) return;
  if (stream.checked_ids > 10 * kManyContradictory) {
    stream.checked_ids = stream.contradictory = 0;
    return;
  }
  core.warnings.push_back(concatenate(kManyContradictory, " of ", stream.checked_ids,
                                      " detections have the id and the time of another one at another place; give each "
                                      "person an id of their own, not that of a class"));
}

/// Once, by the first tracks; before `clean`, which takes apart what moves too fast.
void check_units(StreamCore& core, const OpenTrack& track, const ServiceSettings& settings) {
  if (core.counters.tracks >= kFirstTracks) return;
  Trajectory& path = core.first_tracks.emplace_back();
  for (const Detection& row : track.rows) {
    path.times_s.push_back(row.t_s);
    path.positions_m.push_back(row.position_m);
  }
  if (core.first_tracks.size() < kFirstTracks) return;
  const std::vector<std::string> of_units =
      unit_warnings(std::exchange(core.first_tracks, {}), settings.clean.max_gap_s, true);
  core.warnings.insert(core.warnings.end(), of_units.begin(), of_units.end());
  if (of_units.empty() && core.counters.detections < kFirstDetections)
    warn_if_not_predicted(core, counted(kFirstTracks, "track"), settings);
}

void end_pedestrian(StreamCore& core, Pedestrian& pedestrian, const ServiceSettings& settings) {
  if (pedestrian.queued) ++core.counters.superseded;
  std::vector<Trajectory> trajectories = trajectories_of(pedestrian.track, settings.clean);
  for (const Prediction& prediction : pedestrian.pending) {
    std::optional<WindowScore> score;
    for (const Trajectory& path : trajectories) {
      if (!score && path.times_s.front() <= prediction.t0_s) score = score_of(prediction, path, settings);
    }
    add_score(core, pedestrian, prediction, score);
  }
  core.online_calibration = fitted(std::move(core.online_calibration), pedestrian.score,
                                   horizons_until(settings.episode.predict.horizon_s), ServiceConfig::calibration_step);
  add(core.scores, std::move(pedestrian.score), settings.service);
  check_units(core, pedestrian.track, settings);
  ++core.counters.tracks;
  for (Trajectory& path : trajectories) {
    const CurbFrame frame = settings.frame_for(path);
    core.finished.push_back({std::move(path), frame});
  }
}

/// Ends the tracks that have paused for longer than a gap may last, beyond any late detection.
void end_overdue(StreamCore& core, Stream& stream, const ServiceSettings& settings) {
  const double now_s = *stream.clock.now_s;
  if (std::abs(now_s - stream.checked_s) < kCheckInterval_s) return;
  stream.checked_s = now_s;
  for (auto entry = stream.pedestrians.begin(); entry != stream.pedestrians.end();) {
    Pedestrian& pedestrian = entry->second;
    const double gap_s = longest_gap_s(pedestrian.track, settings.clean);
    const bool ended = now_s > pedestrian.track.latest_s + gap_s + settings.service.late_s;
    if (ended) end_pedestrian(core, pedestrian, settings);
    entry = ended ? stream.pedestrians.erase(entry) : std::next(entry);
  }
}

/// Makes a prediction due at this detection, the end of the path. If an older one was due, it is superseded, and the
/// pedestrian keeps its place in the queue.
void queue_prediction(StreamCore& core, Stream& stream, const Detection& row, Pedestrian& pedestrian, double arrived_s,
                      const ServiceSettings& settings) {
  const double first_due_s = pedestrian.track.path.times_s.front() + settings.episode.predict.min_observe_s;
  const auto next_s = next_due_s(first_due_s, pedestrian.due_s, row.t_s, settings.service.stride_s);
  if (!next_s) {
    ++core.counters.not_due;
    return;
  }
  pedestrian.due_s = *next_s;
  pedestrian.arrived_s = arrived_s;
  pedestrian.stamp_s = row.t_s;
  if (std::exchange(pedestrian.queued, true))
    ++core.counters.superseded;
  else
    stream.due.push_back(row.track);
}

Pedestrian* find_pedestrian(StreamCore& core, StreamId id, const std::string& track) {
  const auto stream = core.streams.find(id);
  if (stream == core.streams.end()) return nullptr;
  const auto found = stream->second.pedestrians.find(track);
  return found == stream->second.pedestrians.end() ? nullptr : &found->second;
}

/// The pedestrian of a detection, new if there was none; null if service.max_ids tracks are open.
Pedestrian* pedestrian_of(StreamCore& core, Stream& stream, const Detection& row, const ServiceSettings& settings) {
  auto found = stream.pedestrians.find(row.track);
  if (found != stream.pedestrians.end() &&
      found->second.track.rows.size() >= static_cast<std::size_t>(settings.service.max_track_samples)) {
    end_pedestrian(core, found->second, settings);
    stream.pedestrians.erase(found);
    found = stream.pedestrians.end();
  }
  if (found == stream.pedestrians.end()) {
    if (stream.pedestrians.size() >= static_cast<std::size_t>(settings.service.max_ids)) return nullptr;
    found = stream.pedestrians.try_emplace(row.track).first;
  }
  return &found->second;
}

/// Of a pedestrian whose path ends now, among those of the same stream. People so far away are no companions.
Vector2 companions_of(const Pedestrian& pedestrian, const Stream& stream) {
  constexpr double far_m = 8.0;
  const Trajectory& own = pedestrian.track.path;
  std::vector<const Trajectory*> others;
  for (const auto& [track, other] : stream.pedestrians) {
    const Trajectory& path = other.track.path;
    if (&path == &own || path.times_s.empty()) continue;
    if ((path.positions_m.back() - own.positions_m.back()).squaredNorm() <= far_m * far_m) others.push_back(&path);
  }
  return companions_mps(own, own.times_s.size() - 1, others);
}

/// The first stream after the last served one, in a circle, that has a due prediction; null if there is none.
std::pair<const StreamId, Stream>* next_stream(StreamCore& core) {
  const auto has_due = [](const auto& stream) { return !stream.second.due.empty(); };
  const auto after = core.streams.upper_bound(core.last_served);
  auto next = std::find_if(after, core.streams.end(), has_due);
  if (next != core.streams.end()) return &*next;
  next = std::find_if(core.streams.begin(), after, has_due);
  return next == after ? nullptr : &*next;
}

}  // namespace

IngestResult ingest(StreamCore& core, StreamId id, const Detection& given, double arrived_s,
                    const ServiceSettings& settings) {
  Detection row = given;
  if (row.track.empty() || row.track.size() > kMaxIdBytes) return {Rejection::not_a_detection};
  if (settings.camera) {
    const std::optional<Vector2> ground_m = to_ground(*settings.camera, row.position_m);
    if (!ground_m) return {Rejection::not_usable};
    row.position_m = *ground_m;
  }
  if (row.label == "0") row.label = "person";  // COCO's number, as in lines of detections
  if (!is_usable(row, settings.clean)) return {Rejection::not_usable};
  Stream& stream = core.streams[id];
  const ClockReading reading = read_stamp(stream.clock, row.t_s, !stream.pedestrians.empty(), settings.service);
  stream.clock = reading.clock;
  const auto result = [&, before = core.counters.superseded](std::optional<Rejection> rejection) {
    return IngestResult{rejection, core.counters.superseded - before};
  };
  if (reading.rejection) return {reading.rejection};
  if (reading.reset) {
    ++core.counters.clock_resets;
    end_tracks(core, id, settings);
  }
  end_overdue(core, stream, settings);
  Pedestrian* const pedestrian = pedestrian_of(core, stream, row, settings);
  if (pedestrian == nullptr) return result(Rejection::too_many_ids);
  const bool said = stream.contradictory >= kManyContradictory;
  if (++core.counters.detections == kFirstDetections && core.counters.tracks < kFirstTracks && !said)
    warn_if_not_predicted(core, counted(kFirstDetections, "detection"), settings);
  check_ids(core, stream, pedestrian->track, row);
  const Trajectory& path = pedestrian->track.path;
  const auto start = [&] { return path.times_s.empty() ? std::nullopt : std::optional(path.times_s.front()); };
  const std::optional<double> before_s = start();
  if (!extend(pedestrian->track, row, settings.clean)) {
    ++core.counters.not_due;
    return result({});
  }
  if (before_s != start()) pedestrian->due_s = *start() + settings.episode.predict.min_observe_s;
  queue_score(core, id, row.track, *pedestrian, settings);
  queue_prediction(core, stream, row, *pedestrian, arrived_s, settings);
  return result({});
}

std::size_t due_predictions(const StreamCore& core) {
  std::size_t count = 0;
  for (const auto& [id, stream] : core.streams) count += stream.due.size();
  return count;
}

std::vector<PredictionRequest> take_due_requests(StreamCore& core, std::size_t count, const ServiceSettings& settings) {
  std::vector<PredictionRequest> requests;
  while (requests.size() < count) {
    auto* const next = next_stream(core);
    if (next == nullptr) break;
    auto& [id, stream] = *next;
    core.last_served = id;
    const std::string track = std::move(stream.due.front());
    stream.due.pop_front();
    Pedestrian* const pedestrian = find_pedestrian(core, id, track);
    if (pedestrian == nullptr || !std::exchange(pedestrian->queued, false)) continue;
    const Trajectory& path = pedestrian->track.path;
    // A later row contradicts the one that made the prediction due: the next one takes its place.
    if (path.times_s.empty() || path.times_s.back() < pedestrian->stamp_s) {
      pedestrian->due_s -= settings.service.stride_s;
      ++core.counters.superseded;
      continue;
    }
    ++core.counters.predictions;
    CurbTrajectory observed = observe(path, path.times_s.size() - 1, settings.frame_for(path),
                                      settings.episode.predict.observe_s, settings.episode.sampling);
    observed.companions_mps = companions_of(*pedestrian, stream);
    requests.push_back({id, track, pedestrian->arrived_s, std::move(observed)});
  }
  return requests;
}

void retain(StreamCore& core, const PredictionRequest& request, const Prediction& prediction,
            const ServiceSettings& settings) {
  Pedestrian* const pedestrian = find_pedestrian(core, request.stream, request.track);
  const auto limit = static_cast<std::uint64_t>(settings.service.max_pending_scores);
  if (pedestrian == nullptr || core.counters.pending_scores >= limit) {
    ++core.counters.not_retained;
    return;
  }
  ++core.counters.pending_scores;
  pedestrian->pending.push_back(prediction);
}

void score_due(StreamCore& core, std::size_t count, const ServiceSettings& settings) {
  for (std::size_t k = 0; k < count && !core.due_scores.empty(); ++k) {
    const auto [id, track] = std::move(core.due_scores.front());
    core.due_scores.pop_front();
    Pedestrian* const pedestrian = find_pedestrian(core, id, track);
    if (pedestrian == nullptr || !std::exchange(pedestrian->score_queued, false)) continue;
    const Trajectory& path = pedestrian->track.path;
    while (!pedestrian->pending.empty() && is_final(pedestrian->pending.front(), path, settings)) {
      const Prediction& prediction = pedestrian->pending.front();
      add_score(core, *pedestrian, prediction, score_of(prediction, path, settings));
      pedestrian->pending.pop_front();
    }
  }
}

void end_tracks(StreamCore& core, StreamId id, const ServiceSettings& settings) {
  const auto stream = core.streams.find(id);
  if (stream == core.streams.end()) return;
  for (auto& [track, pedestrian] : stream->second.pedestrians) end_pedestrian(core, pedestrian, settings);
  stream->second.pedestrians.clear();
}

void end_if_silent(StreamCore& core, StreamId id, double now_s, const ServiceSettings& settings) {
  const auto stream = core.streams.find(id);
  if (stream == core.streams.end() || !stream->second.clock.now_s) return;
  const StreamClock& clock = stream->second.clock;
  if (now_s - clock.ahead_s.value_or(*clock.now_s) >= ServiceConfig::silence_s) end_tracks(core, id, settings);
}

void end_stream(StreamCore& core, StreamId id, const ServiceSettings& settings) {
  end_tracks(core, id, settings);
  core.streams.erase(id);
}

}  // namespace sila
