#pragma once

#include <array>
#include <chrono>

#include "sila/io/scene.hpp"
#include "sila/io/track_files.hpp"
#include "sila/service/learner_thread.hpp"
#include "sila/service/stream.hpp"

namespace sila {

/// Upper edges of the bins of the prediction latency [s].
inline constexpr std::array<double, 12> kLatencyEdges_s = {0.001, 0.002, 0.005, 0.01, 0.02, 0.03,
                                                           0.05,  0.1,   0.2,   0.5,  1.0,  5.0};

/// Counts of latencies by bin, and their sum [s].
struct LatencyHistogram {
  std::array<std::uint64_t, kLatencyEdges_s.size() + 1> counts = {};
  double sum_s = 0.0;
};
void add(LatencyHistogram& histogram, double seconds);

/// The state of a service as numbers.
struct ServiceMetrics {
  Counters counters;
  std::array<std::uint64_t, kRejections.size()> rejected = {};
  std::uint64_t lines = 0;                ///< read, by all connections together
  std::uint64_t slow_reader_dropped = 0;  ///< predictions that a connection did not read in time
  std::size_t connections = 0, live_pages = 0;
  std::size_t pedestrians = 0, due_predictions = 0, queued_lines = 0;
  LatencyHistogram latency;  ///< from reading a detection to sending its prediction
  std::vector<double> horizons_s;
  std::vector<HorizonSums> all, moving;  ///< over the recent pedestrians
  std::vector<std::array<double, kRegionProbabilities.size()>> coverage;
  std::size_t scored_pedestrians = 0;
  double novelty = 0.0;
  Drift drift;
  LearnerStatus learner;
  std::size_t model_size = 0, primitives = 0, transitions = 0;
  int model_episodes = 0;
  long model_tracks = 0;
};

/// Metrics of the core and the learner; those of the engine and the connections are zero.
ServiceMetrics core_metrics(const StreamCore& core, const LearnerThread& learner, const ServiceSettings& settings);

/// Text format of Prometheus, version 0.0.4.
std::string metrics_text(const ServiceMetrics& metrics);

/// JSON for the live page.
std::string metrics_message(const ServiceMetrics& metrics);

/// Addresses of a service and access to it.
struct ServerOptions {
  std::string http;     ///< ADDRESS:PORT of the page, the metrics and WebSockets; empty: none
  std::string picture;  ///< data URL of what the scene's camera sees, shown by the page; empty: none
  std::string tcp;      ///< ADDRESS:PORT for lines; empty: none
  std::string unix_path;
  std::string mqtt;           ///< mqtt[s]://[USER@]HOST[:PORT]/TOPIC of detections; empty: none
  std::string mqtt_out;       ///< topic of the predictions
  std::string mqtt_ca;        ///< certificates by which an mqtts broker is checked; empty: those of the system
  std::string mqtt_password;  ///< of USER
  std::string token;          ///< that clients must send; empty: none, loopback only
  /// A TCP or Unix connection that sends no token within this time is closed.
  std::chrono::milliseconds token_timeout = std::chrono::seconds(10);
  /// Which boxes count. Without a name no event of Frigate that names its camera does.
  ReadOptions read = {.frigate_camera = std::string()};
  bool standard_input = false;  ///< also read lines from standard input; the service ends with it
  bool wait = false;            ///< standard input waits for its answers and for learning; for files
};

/// A live service: lines of detections in, predictions out on the same connection, a page, metrics.
class Server {
 public:
  /// Listens from here on. `announce` is called from any thread with messages for people.
  /// Throws: std::invalid_argument for an invalid address or topic, or one that other machines can reach without a
  /// token; std::runtime_error if it cannot listen at an address or path.
  Server(const ServerOptions& options, const Scene& scene, ServiceSettings settings, LearnerThread& learner,
         std::function<void(const std::string&)> announce);
  ~Server();
  Server(const Server&) = delete;
  Server& operator=(const Server&) = delete;

  /// Serves until `stop`, SIGINT, SIGTERM, or the end of standard input, then ends all open tracks and learns those
  /// that wait for a batch.
  /// Throws: the exception of a prediction or of `settings.frame_for`, which ends the service;
  /// std::runtime_error if standard input could not be read or standard output not be written.
  void run();
  /// May be called from any thread.
  void stop();

  /// The ports in use; 0 for none.
  unsigned http_port() const;
  unsigned tcp_port() const;
  ServiceMetrics metrics() const;

 private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace sila
