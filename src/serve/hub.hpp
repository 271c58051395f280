#pragma once

#include <atomic>
#include <boost/asio/io_context.hpp>
#include <chrono>
#include <functional>
#include <map>
#include <memory>
#include <string>
#include <string_view>

#include "sila/serve/engine.hpp"
#include "sila/serve/lines.hpp"

namespace sila::detail {

/// Whoever is sent lines.
class Connection {
 public:
  virtual ~Connection() = default;
  virtual void send(std::string line, bool droppable) = 0;
  virtual void close() = 0;
};

/// What the connections of a service share. All of it is used by the thread that runs `context`, but for the atomics.
struct Hub {
  ServeConfig config;
  std::string token;
  std::chrono::milliseconds token_patience{};  ///< a connection of lines shows its token within this time
  Engine* engine = nullptr;                    ///< null once the service ends
  std::function<std::string()> hello;          ///< what a live page is told first
  std::function<Facts()> facts;
  std::map<StreamId, std::weak_ptr<Connection>> connections;
  std::map<StreamId, std::weak_ptr<Connection>> watchers;
  StreamId next = 1;
  std::atomic<std::size_t> open = 0;  ///< sockets of every kind
  std::atomic<std::uint64_t> lines = 0;
  std::atomic<std::uint64_t> dropped = 0;
  std::atomic<std::uint64_t> refused_connections = 0, refused_tokens = 0;
  boost::asio::io_context context{1};  ///< the last member: what waits in it holds connections, and these the hub

  std::size_t most_bytes() const { return static_cast<std::size_t>(config.max_outgoing_mb * 1e6); }
};

/// Counts an open socket as long as it lives.
class Seat {
 public:
  explicit Seat(Hub& hub) : hub_(hub) { ++hub_.open; }
  ~Seat() { --hub_.open; }
  Seat(const Seat&) = delete;
  Seat& operator=(const Seat&) = delete;

 private:
  Hub& hub_;
};

/// A stream's lines on their way to the engine. Ends the stream when it goes.
class Intake {
 public:
  Intake(Hub& hub, StreamId stream) : hub_(hub), stream_(stream), filled_s_(monotonic_s()) {}
  ~Intake();
  Intake(const Intake&) = delete;
  Intake& operator=(const Intake&) = delete;

  /// Takes or refuses one line, without its end; says the detection's time if it was one.
  std::optional<double> line(std::string_view text);
  void refuse(Refusal refusal);
  StreamId stream() const { return stream_; }

 private:
  bool too_fast();

  Hub& hub_;
  StreamId stream_;
  double allowance_ = 0.0;  ///< lines that may still come in this second
  double filled_s_;
  bool first_ = true;
};

}  // namespace sila::detail
