#pragma once

#include <cstdint>
#include <deque>
#include <functional>
#include <map>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "sila/core/framed_trajectory.hpp"
#include "sila/live/clock.hpp"
#include "sila/live/online_calibration.hpp"
#include "sila/live/open_track.hpp"
#include "sila/live/scores.hpp"

namespace sila {

/// Everything that the live core is governed by.
struct LiveSettings {
  LiveConfig live;
  CleanConfig clean;
  EpisodeConfig episode;
  EvaluateConfig evaluate;
  std::function<CurbFrame(const Trajectory&)> frame_for;  ///< the corner by which a track is looked at
};

/// A prediction that waits for its future.
struct Unscored {
  Prediction prediction;
  CurbTrajectory observed;
};

/// A pedestrian whose track is open.
struct Person {
  OpenTrack track;
  double due_s = 0.0;      ///< when the next prediction is due, on the stream's clock
  bool waiting = false;    ///< a prediction is due and was not asked for yet
  bool ripe = false;       ///< is in `Live::ripe`
  double arrived_s = 0.0;  ///< when the detection came that it is due for, on the caller's clock
  std::deque<Unscored> unscored;
  PersonScore score;
};

using StreamId = std::uint64_t;

/// One tracker: ids and times are its own.
struct Stream {
  StreamClock clock;
  std::map<std::string, Person> people;
  double looked_s = 0.0;  ///< when ends of tracks were last looked for
};

/// Whose prediction is due: streams take turns, and of each the one that waits longest is first. Nobody who asks for
/// much makes another stream wait.
class Turns {
 public:
  void push(StreamId stream, const std::string& track);
  /// The next one. Precondition: not empty.
  std::pair<StreamId, std::string> pop();
  bool empty() const { return size_ == 0; }
  std::size_t size() const { return size_; }

 private:
  std::map<StreamId, std::deque<std::string>> waiting_;
  StreamId last_ = 0;  ///< whose turn it was
  std::size_t size_ = 0;
};

/// Where every detection went: taken = early + answered + superseded + those still in the queue.
struct Account {
  std::uint64_t taken = 0;
  std::uint64_t early = 0;       ///< no prediction was due: too short a track, or not yet `every_s`
  std::uint64_t answered = 0;    ///< predictions asked for
  std::uint64_t superseded = 0;  ///< predictions that were due and never asked for: a newer one took their place
  std::uint64_t scored = 0;
  std::uint64_t unscorable = 0;  ///< the track ended before the horizon
  std::uint64_t unscored = 0;    ///< left out: live.max_unscored waited already
  std::uint64_t waiting_for_future = 0;
  std::uint64_t tracks = 0;  ///< ended
  std::uint64_t clock_jumps = 0;
};

/// The live core: detections in, questions for the predictor out, its answers judged. Nothing in it waits, knows a
/// socket or a thread, and every list in it has a limit.
struct Live {
  std::map<StreamId, Stream> streams;
  Turns queue;                                        ///< whose prediction is due
  std::deque<std::pair<StreamId, std::string>> ripe;  ///< whose oldest prediction can be judged
  Scoreboard board;
  OnlineCalibration online_calibration;
  Account account;
  std::vector<FramedTrajectory> finished;  ///< to be learnt; the caller takes them
  std::vector<WindowScore> judged;         ///< since the caller last took them
  bool keep_judged = false;                ///< whether `judged` is filled
};

/// What became of a detection.
struct Heard {
  std::optional<Refusal> refusal;
  bool superseded = false;  ///< an older prediction of the same person was still waiting and will not come
};

/// A pedestrian's observed path, ready to be predicted.
struct Question {
  StreamId stream = 0;
  std::string track;
  double arrived_s = 0.0;
  CurbTrajectory observed;
};

/// Takes in one detection that came at `arrived_s`. Throws: std::invalid_argument for settings out of range.
Heard hear(Live& live, StreamId stream, const Detection& row, double arrived_s, const LiveSettings& settings);

/// The predictions that are due longest, at most so many; each person is looked at as of now.
std::vector<Question> ask(Live& live, std::size_t most, const LiveSettings& settings);

/// Keeps a prediction (as it was sent) until its future has happened.
void keep(Live& live, const Question& question, const Prediction& prediction, const LiveSettings& settings);

/// Judges predictions whose future has happened and can change no more, of at most so many pedestrians; says of how
/// many. Apart from `hear`, so that judging never delays predicting.
std::size_t judge_ripe(Live& live, std::size_t most, const LiveSettings& settings);

/// Ends every open track of a stream: after silence, or with its connection; the stream itself stays.
void end_tracks(Live& live, StreamId stream, const LiveSettings& settings);
/// The same, and forgets the stream.
void end_stream(Live& live, StreamId stream, const LiveSettings& settings);

}  // namespace sila
