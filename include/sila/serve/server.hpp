#pragma once

#include <chrono>
#include <functional>
#include <memory>
#include <string>

#include "sila/io/scene.hpp"
#include "sila/serve/engine.hpp"

namespace sila {

/// Where a service listens, and to whom.
struct ServeOptions {
  ServeConfig config;
  std::string http;  ///< ADDRESS:PORT of the page, the metrics and WebSockets; empty: none
  std::string tcp;   ///< ADDRESS:PORT for lines; empty: none
  std::string unix_path;
  std::string token;  ///< that clients must show; empty: none, for loopback only
  /// Within which a TCP or Unix connection must show the token: until then it takes a place from who has one.
  std::chrono::milliseconds token_patience = std::chrono::seconds(10);
  bool standard_input = false;  ///< also lines from standard input; the service ends with it
  bool wait = false;            ///< standard input waits until it is answered; for files
};

/// A live service: lines of detections in, predictions out on the same connection, a page, metrics.
class Server {
 public:
  /// Listens from here on. `announce` is told, from any thread, what people should know.
  /// Throws: std::invalid_argument for an address that is none, or one that others can reach without a token;
  /// std::runtime_error if an address or path cannot be listened at.
  Server(const ServeOptions& options, const Scene& scene, LiveSettings settings, Learner& learner,
         OnlineCalibration online_calibration, std::function<void(const OnlineCalibration&)> keep_calibration,
         std::function<void(const std::string&)> announce);
  ~Server();
  Server(const Server&) = delete;
  Server& operator=(const Server&) = delete;

  /// Serves until `stop`, SIGINT, SIGTERM, or the end of standard input; true if it was the last of these.
  bool run();
  /// From any thread.
  void stop();

  /// The ports that are listened at; 0 for none.
  unsigned http_port() const;
  unsigned tcp_port() const;
  Facts facts() const;

 private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace sila
