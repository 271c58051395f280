#pragma once

#include <atomic>
#include <condition_variable>
#include <deque>
#include <exception>
#include <map>
#include <mutex>
#include <optional>
#include <set>
#include <thread>
#include <utility>

#include "sila/service/server.hpp"

namespace sila {

/// A detection of a stream, or its end.
struct StreamEvent {
  StreamId stream = 0;
  std::optional<Detection> detection;  ///< none: the stream has ended
  double arrived_s = 0.0;              ///< by `monotonic_s`
};

/// A line for a connection. Predictions may be dropped for newer ones, reports of drops and rejections may not.
struct OutgoingLine {
  StreamId stream = 0;
  std::string text;
  bool droppable = true;
};

/// Seconds on the monotonic clock.
double monotonic_s();

/// Something that is done once per interval.
struct Timer {
  double interval_s;
  double last_s = 0.0;
  /// Whether the interval has passed; if so, the next one begins.
  bool has_passed(double now_s);
};

/// Runs the stream core in a thread of its own: takes events, sends lines, passes finished tracks to the learner.
class Engine {
 public:
  /// Called on the thread of the engine; must return at once.
  struct Output {
    std::function<void(std::vector<OutgoingLine>)> send;
    std::function<void(std::string)> show;     ///< JSON for every live page
    std::function<void()> failed = {};         ///< the engine has ended by an exception
    std::function<void(StreamId)> ended = {};  ///< an ended stream is answered; after its last `send`
    std::function<void(const std::string&)> warn = {};
  };

  /// `stepwise`: predictions, scores and learning happen in `drain` alone, so that they depend on what was offered but
  /// not on when it came.
  Engine(ServiceSettings settings, LearnerThread& learner, Output output, bool stepwise);
  ~Engine();
  Engine(const Engine&) = delete;
  Engine& operator=(const Engine&) = delete;

  /// Takes an event, or rejects it if service.max_queued_lines are queued and its stream has more than its share of
  /// them. The end of a stream is always taken.
  void offer(StreamEvent event);
  /// Counts a rejected line; its connection gets one report a second. Stream 0 is no connection.
  void reject(StreamId stream, Rejection rejection);
  /// Returns when everything offered so far is answered; stepwise also when whole batches of it are learnt.
  void drain();
  /// Throws: the exception that ended the engine, if one did. Then `drain` returns at once.
  void rethrow_failure() const;
  /// Metrics without those of the connections, at most half a second old.
  ServiceMetrics metrics() const;
  /// Sets the number of open live pages; with none, nothing is shown.
  void set_live_pages(std::size_t count) { live_pages_ = count; }

 private:
  enum class Step { none, requested, running };

  void run();
  void work();
  bool wait_for_work(bool busy);
  void ingest_queued();
  void ingest_event(const StreamEvent& event);
  std::vector<StreamId> queued_streams() const;
  bool has_queued(StreamId stream) const;
  std::optional<StreamEvent> next_event(StreamId stream);
  bool predict_and_score();
  void send_predictions(const std::vector<PredictionRequest>& requests);
  void end_silent_streams(double now_s);
  void end_streams();
  void report(double now_s);
  void report_losses();
  void count_rejection(StreamId stream, Rejection rejection);  // mutex_ is held
  void update_metrics();
  void update_page();

  ServiceSettings settings_;
  LearnerThread& learner_;
  Output output_;
  bool stepwise_;

  // Used by the thread of the engine alone.
  StreamCore core_;
  std::map<StreamId, std::size_t> superseded_;  // not reported yet
  std::map<StreamId, double> last_arrival_s_;
  std::set<StreamId> ending_;  // their lines have ended
  LatencyHistogram latency_;
  Timer losses_timer_{1.0}, metrics_timer_{0.25}, page_timer_{ServiceConfig::page_interval_s};
  int shown_episodes_ = -1;

  std::atomic<std::size_t> live_pages_ = 0;
  mutable std::mutex mutex_;  // guards all below
  std::condition_variable changed_;
  std::map<StreamId, std::deque<StreamEvent>> queue_;  // of streams that have any
  std::size_t queued_ = 0;
  std::map<std::pair<StreamId, Rejection>, std::size_t> rejected_;  // not reported yet
  std::array<std::uint64_t, kRejections.size()> rejected_total_ = {};
  Step step_ = Step::none;
  bool idle_ = true;
  bool stopping_ = false;
  std::exception_ptr failure_;
  ServiceMetrics metrics_;
  std::thread thread_;
};

}  // namespace sila
