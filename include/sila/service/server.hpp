#pragma once

#include <chrono>
#include <functional>
#include <memory>
#include <string>

#include "sila/io/scene.hpp"
#include "sila/io/track_files.hpp"
#include "sila/service/metrics.hpp"

namespace sila {

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

  /// Serves until `stop`, SIGINT, SIGTERM, or the end of standard input; true for the last of these.
  bool run();
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
