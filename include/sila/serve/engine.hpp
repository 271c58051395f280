#pragma once

#include <condition_variable>
#include <deque>
#include <functional>
#include <map>
#include <mutex>
#include <optional>
#include <string>
#include <thread>
#include <vector>

#include "sila/serve/config.hpp"
#include "sila/serve/facts.hpp"

namespace sila {

/// What a connection hands over: a detection, or with `ended` that nothing more will come.
struct Event {
  StreamId stream = 0;
  Detection row = {};
  double arrived_s = 0.0;  ///< monotonic clock
  bool ended = false;
};

/// A line for a connection. Predictions may be dropped for newer ones, what tells of drops and refusals may not.
struct Line {
  StreamId stream = 0;
  std::string text;
  bool droppable = true;
};

/// Seconds on a clock that never jumps.
double monotonic_s();

/// The live core at work, in a thread of its own: takes events, answers with lines, gives ended tracks to the learner.
class Engine {
 public:
  /// Called on the engine's thread; must not wait.
  struct Outlets {
    std::function<void(std::vector<Line>)> lines;  ///< for connections
    std::function<void(std::string)> page;         ///< JSON for every live page
    std::function<void(const OnlineCalibration&)>
        online_calibration;  ///< what keeps the regions true, for who restarts
  };

  Engine(LiveSettings settings, const ServeConfig& serve, Learner& learner, OnlineCalibration online_calibration,
         Outlets outlets);
  ~Engine();
  Engine(const Engine&) = delete;
  Engine& operator=(const Engine&) = delete;

  /// Takes an event, or counts it as refused if too many wait already and more than its share of them are its stream's.
  /// The end of a stream is always taken.
  void offer(Event event);
  /// Counts a line that is refused; its connection is told of all of them once a second.
  void refuse(StreamId stream, Refusal refusal);
  /// Events and predictions that wait.
  std::size_t backlog() const;
  /// Returns when everything offered so far is answered.
  void drain();
  /// From now on nothing is predicted, judged or given to the learner but while a pedestrian settles: what is answered
  /// then depends on what was offered alone, not on how fast it came.
  void go_step_by_step();
  /// As drain, and whole batches of what has ended are learnt: what comes next does not depend on how long that took.
  void settle();
  /// As of half a second ago at most.
  Facts facts() const;
  /// Whether anybody looks at the live page.
  void watch(std::size_t watchers);

 private:
  void run();
  void take();
  void take(const Event& event);
  std::vector<StreamId> speaking() const;
  std::optional<Event> next_of(StreamId stream);
  bool work();
  void tell_refusals();
  void publish();
  void draw();

  LiveSettings settings_;
  ServeConfig serve_;
  Learner& learner_;
  Outlets outlets_;

  Live live_;                                   // of the engine's thread alone, as is all until the mutex
  std::map<StreamId, std::size_t> superseded_;  // since connections were last told
  std::map<StreamId, double> heard_s_;
  LatencyHistogram latency_;
  double told_s_ = 0.0, published_s_ = 0.0, drawn_s_ = 0.0;
  int drawn_episodes_ = -1;

  mutable std::mutex mutex_;
  std::condition_variable changed_;
  std::map<StreamId, std::deque<Event>> inbox_;  // of streams that have any
  std::size_t inbox_size_ = 0;
  std::map<std::pair<StreamId, Refusal>, std::size_t> refused_;  // since connections were last told
  std::array<std::uint64_t, kRefusals.size()> refused_in_all_ = {};
  std::size_t waiting_ = 0;  // of the core, as of its last step
  bool idle_ = true;
  bool stepwise_ = false;
  bool held_ = false;  // between two steps
  bool owed_ = false;  // a step was asked for and not begun
  bool stopping_ = false;
  std::size_t watchers_ = 0;
  Facts facts_;
  std::thread thread_;
};

}  // namespace sila
