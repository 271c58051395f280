#include "sila/live/live.hpp"

#include <algorithm>
#include <cmath>
#include <iterator>
#include <utility>

#include "sila/core/steps.hpp"

namespace sila {
namespace {

/// Ends of tracks are looked for as often as this, on the stream's clock.
constexpr double kLookEvery_s = 0.25;

/// Judges a prediction by a path that has its future. Nothing if the path does not, or has no sample at t0.
std::optional<WindowScore> judged(const Unscored& unscored, const Trajectory& path, const LiveSettings& settings) {
  const double t0_s = unscored.prediction.t0_s;
  const auto last = std::lower_bound(path.times_s.begin(), path.times_s.end(), t0_s);
  if (last == path.times_s.end() || *last != t0_s) return std::nullopt;
  const double horizon_s = settings.episode.predict.horizon_s;
  const auto steps = static_cast<std::size_t>(steps_in(horizon_s, settings.episode.sampling.interval_s));
  if (t0_s + horizon_s > path.times_s.back() + 1e-3) return std::nullopt;
  const auto index = static_cast<std::size_t>(last - path.times_s.begin());
  Window window{unscored.observed, past(path, index, settings.episode.predict.observe_s, settings.episode.sampling),
                future(path, index, steps, settings.episode.sampling)};
  if (window.future_m.size() < steps) return std::nullopt;
  const auto references = fit_references({}, steps, settings.episode.sampling.interval_s);
  return score_window(unscored.prediction, window, std::span(references).first(1), settings.episode, settings.evaluate);
}

void account_for(Live& live, Person& person, const Unscored& unscored, const std::optional<WindowScore>& score) {
  --live.account.waiting_for_future;
  ++(score ? live.account.scored : live.account.unscorable);
  if (!score) return;
  add(person.score, *score, !unscored.prediction.regions.empty());
  if (live.keep_judged) live.judged.push_back(*score);
}

/// Whether a prediction's future is over at the end of the path, and no late detection can change it.
bool is_over(const Unscored& unscored, const Trajectory& path, const LiveSettings& settings) {
  const double t0_s = unscored.prediction.t0_s;
  return !path.times_s.empty() && t0_s >= path.times_s.front() &&
         t0_s + settings.episode.predict.horizon_s + settings.live.late_s <= path.times_s.back();
}

void mark_ripe(Live& live, StreamId id, const std::string& track, Person& person, const LiveSettings& settings) {
  if (person.ripe || person.unscored.empty()) return;
  if (!is_over(person.unscored.front(), person.track.path, settings)) return;
  person.ripe = true;
  live.ripe.emplace_back(id, track);
}

void judge_settled(Live& live, Person& person, const LiveSettings& settings) {
  const Trajectory& path = person.track.path;
  if (path.times_s.empty()) return;
  while (!person.unscored.empty() && is_over(person.unscored.front(), path, settings)) {
    account_for(live, person, person.unscored.front(), judged(person.unscored.front(), path, settings));
    person.unscored.pop_front();
  }
}

void end_person(Live& live, Person& person, const LiveSettings& settings) {
  if (person.waiting) ++live.account.superseded;
  std::vector<Trajectory> pieces = trajectories_of(person.track, settings.clean);
  for (const Unscored& unscored : person.unscored) {
    std::optional<WindowScore> score;
    for (const Trajectory& piece : pieces) {
      if (!score && piece.times_s.front() <= unscored.prediction.t0_s) score = judged(unscored, piece, settings);
    }
    account_for(live, person, unscored, score);
  }
  live.online_calibration = fitted(std::move(live.online_calibration), person.score,
                                   horizons_until(settings.episode.predict.horizon_s), settings.live.calibration_step);
  add(live.board, std::move(person.score), settings.live);
  ++live.account.tracks;
  for (Trajectory& piece : pieces) {
    const CurbFrame frame = settings.frame_for(piece);
    live.finished.push_back({std::move(piece), frame});
  }
}

/// Ends the tracks that have not gone on for longer than a gap may be, and no late detection can mend.
void end_overdue(Live& live, Stream& stream, const LiveSettings& settings) {
  const double now_s = *stream.clock.now_s;
  if (std::abs(now_s - stream.looked_s) < kLookEvery_s) return;
  stream.looked_s = now_s;
  for (auto entry = stream.people.begin(); entry != stream.people.end();) {
    Person& person = entry->second;
    const bool over = now_s > person.track.latest_s + settings.clean.max_gap_s + settings.live.late_s;
    if (over) end_person(live, person, settings);
    entry = over ? stream.people.erase(entry) : std::next(entry);
  }
}

/// Makes a prediction due where the path now ends with this detection. Says whether one was due already.
bool make_due(Live& live, StreamId id, const Detection& row, Person& person, double arrived_s,
              const LiveSettings& settings) {
  const auto next_s = next_due_s(person.due_s, row.t_s, settings.live.every_s);
  if (!next_s) {
    ++live.account.early;
    return false;
  }
  person.due_s = *next_s;
  const bool superseded = std::exchange(person.waiting, true);
  person.arrived_s = arrived_s;
  if (superseded)
    ++live.account.superseded;  // it keeps its place in the queue, and is asked with what is known then
  else
    live.queue.push(id, row.track);
  return superseded;
}

Person* find_person(Live& live, StreamId id, const std::string& track) {
  const auto stream = live.streams.find(id);
  if (stream == live.streams.end()) return nullptr;
  const auto found = stream->second.people.find(track);
  return found == stream->second.people.end() ? nullptr : &found->second;
}

/// The person of a detection, new if there was none; nothing if there is no room.
Person* person_of(Live& live, Stream& stream, const Detection& row, const LiveSettings& settings) {
  auto found = stream.people.find(row.track);
  if (found != stream.people.end() &&
      found->second.track.rows.size() >= static_cast<std::size_t>(settings.live.max_track_samples)) {
    end_person(live, found->second, settings);
    stream.people.erase(found);
    found = stream.people.end();
  }
  if (found == stream.people.end()) {
    if (stream.people.size() >= static_cast<std::size_t>(settings.live.max_ids)) return nullptr;
    found = stream.people.try_emplace(row.track).first;
  }
  return &found->second;
}

}  // namespace

void Turns::push(StreamId stream, const std::string& track) {
  waiting_[stream].push_back(track);
  ++size_;
}

std::pair<StreamId, std::string> Turns::pop() {
  auto next = waiting_.upper_bound(last_);
  if (next == waiting_.end()) next = waiting_.begin();
  last_ = next->first;
  std::pair<StreamId, std::string> who(last_, std::move(next->second.front()));
  next->second.pop_front();
  if (next->second.empty()) waiting_.erase(next);
  --size_;
  return who;
}

Heard hear(Live& live, StreamId id, const Detection& row, double arrived_s, const LiveSettings& settings) {
  if (!is_usable(row, settings.clean)) return {Refusal::not_usable, false};
  Stream& stream = live.streams[id];
  const ClockReading reading = read_stamp(stream.clock, row.t_s, !stream.people.empty(), settings.live);
  if (reading.refusal) return {reading.refusal, false};
  if (reading.set_anew) {
    ++live.account.clock_jumps;
    end_tracks(live, id, settings);
  }
  end_overdue(live, stream, settings);
  Person* const person = person_of(live, stream, row, settings);
  if (person == nullptr) return {Refusal::too_many_ids, false};
  ++live.account.taken;
  const std::optional<double> began_s =
      person->track.path.times_s.empty() ? std::nullopt : std::optional(person->track.path.times_s.front());
  if (!extend(person->track, row, settings.clean)) {
    ++live.account.early;
    return {};
  }
  const double begins_s = person->track.path.times_s.front();
  if (began_s != begins_s) person->due_s = begins_s + settings.episode.predict.observe_s;
  mark_ripe(live, id, row.track, *person, settings);
  return {std::nullopt, make_due(live, id, row, *person, arrived_s, settings)};
}

std::vector<Question> ask(Live& live, std::size_t most, const LiveSettings& settings) {
  std::vector<Question> questions;
  while (questions.size() < most && !live.queue.empty()) {
    const auto [id, track] = live.queue.pop();
    Person* const person = find_person(live, id, track);
    if (person == nullptr || !std::exchange(person->waiting, false)) continue;
    const Trajectory& path = person->track.path;
    if (path.times_s.empty()) {  // a contradiction came after the detection that it was due for
      ++live.account.superseded;
      continue;
    }
    ++live.account.answered;
    questions.push_back({id, track, person->arrived_s,
                         observe(path, path.times_s.size() - 1, settings.frame_for(path),
                                 settings.episode.predict.observe_s, settings.episode.sampling)});
  }
  return questions;
}

void keep(Live& live, const Question& question, const Prediction& prediction, const LiveSettings& settings) {
  Person* const person = find_person(live, question.stream, question.track);
  const auto most = static_cast<std::uint64_t>(settings.live.max_unscored);
  if (person == nullptr || live.account.waiting_for_future >= most) {
    ++live.account.unscored;
    return;
  }
  ++live.account.waiting_for_future;
  person->unscored.push_back({prediction, question.observed});
}

std::size_t judge_ripe(Live& live, std::size_t most, const LiveSettings& settings) {
  std::size_t people = 0;
  for (; people < most && !live.ripe.empty(); ++people) {
    const auto [id, track] = std::move(live.ripe.front());
    live.ripe.pop_front();
    Person* const person = find_person(live, id, track);
    if (person == nullptr || !std::exchange(person->ripe, false)) continue;
    judge_settled(live, *person, settings);
  }
  return people;
}

void end_tracks(Live& live, StreamId id, const LiveSettings& settings) {
  const auto stream = live.streams.find(id);
  if (stream == live.streams.end()) return;
  for (auto& [track, person] : stream->second.people) end_person(live, person, settings);
  stream->second.people.clear();
}

void end_stream(Live& live, StreamId id, const LiveSettings& settings) {
  end_tracks(live, id, settings);
  live.streams.erase(id);
}

}  // namespace sila
