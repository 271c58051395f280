#pragma once

#include <boost/asio/io_context.hpp>
#include <string_view>

#include "engine.hpp"
#include "lines.hpp"

namespace sila::detail {

struct ConnectionRegistry;

/// A client that is sent lines.
class Connection {
 public:
  virtual ~Connection() = default;
  virtual void send(std::string line, bool droppable) = 0;
  virtual void close() = 0;
  /// All lines of the stream are answered and sent.
  virtual void finish() {}

 protected:
  Connection(ConnectionRegistry& registry, std::size_t max_send_bytes);

  /// Announces the first report of each kind to people, who may not see the output. `line`: the report for the client;
  /// `input`, `output`: where its lines come from and go to.
  void announce_first(const std::string& line, const char* input, const char* output);

  ConnectionRegistry& registry_;
  StreamId id_;
  SendQueue queue_;

 private:
  std::set<std::string> announced_reports_;
};

/// The connections of a service and their common state. Used by the thread that runs `context` alone, except the
/// atomics.
struct ConnectionRegistry {
  ServerOptions options;
  ServiceConfig config;
  bool has_camera = false;   ///< positions are image points
  Engine* engine = nullptr;  ///< null once the service ends
  std::function<std::string()> hello;
  std::function<ServiceMetrics()> metrics;
  std::function<void(const std::string&)> announce;  ///< for people; from any thread
  std::map<StreamId, std::weak_ptr<Connection>> streams;
  std::map<StreamId, std::weak_ptr<Connection>> live_pages;
  StreamId next_id = 1;
  std::atomic<std::size_t> open = 0;  ///< sockets of every kind
  std::atomic<std::uint64_t> lines = 0;
  std::atomic<std::uint64_t> slow_reader_dropped = 0;
  boost::asio::io_context context{1};  ///< the last member: its handlers own connections that use the others

  std::size_t max_send_bytes() const { return static_cast<std::size_t>(config.max_send_queue_mb * 1e6); }
};

/// Counts an open socket during its lifetime.
class OpenSocket {
 public:
  explicit OpenSocket(ConnectionRegistry& registry) : registry_(registry) { ++registry_.open; }
  ~OpenSocket() { --registry_.open; }
  OpenSocket(const OpenSocket&) = delete;
  OpenSocket& operator=(const OpenSocket&) = delete;

 private:
  ConnectionRegistry& registry_;
};

/// Checks the lines of one stream and offers them to the engine. Ends the stream when it is destroyed.
class LineReceiver {
 public:
  /// `before`, if given, is called with the time of each detection before the engine gets it.
  LineReceiver(ConnectionRegistry& registry, StreamId stream, std::function<void(double t_s)> before = {});
  ~LineReceiver();
  LineReceiver(const LineReceiver&) = delete;
  LineReceiver& operator=(const LineReceiver&) = delete;

  /// Accepts or rejects one line without its end.
  void receive(std::string_view line);

 private:
  std::optional<Rejection> check(std::string_view line);

  ConnectionRegistry& registry_;
  StreamId stream_;
  std::function<void(double t_s)> before_;
  double allowance_;  ///< lines that may still come in this second
  double refilled_s_;
};

}  // namespace sila::detail
