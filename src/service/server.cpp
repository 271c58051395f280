#include "sila/service/server.hpp"

#include <sys/stat.h>
#include <unistd.h>

#include <boost/asio/local/stream_protocol.hpp>
#include <boost/asio/post.hpp>
#include <boost/asio/signal_set.hpp>
#include <csignal>
#include <stdexcept>

#include "address.hpp"
#include "live_page.hpp"
#include "mqtt.hpp"
#include "socket_connection.hpp"
#include "standard_io.hpp"
#include "web_session.hpp"

namespace sila {
namespace {

using boost::asio::ip::tcp;
using Local = boost::asio::local::stream_protocol;

/// HTTP connections beyond `service.max_connections`: monitoring gets its answers while trackers have taken all places.
constexpr std::size_t kHttpReserve = 8;

std::string text_of(const tcp::endpoint& end) {
  const std::string host = end.address().to_string();
  return (end.address().is_v6() ? "[" + host + "]" : host) + ":" + std::to_string(end.port());
}

std::runtime_error cannot_listen(const std::string& where, const std::string& why) {
  return std::runtime_error("serve: cannot listen at " + where + ": " + why);
}

/// An address that other machines can reach needs a token.
tcp::acceptor listen_at(detail::ConnectionRegistry& registry, const std::string& option, const std::string& address) {
  const tcp::endpoint end = detail::parse_endpoint(option, address);
  if (!end.address().is_loopback() && registry.options.token.empty())
    throw std::invalid_argument("serve: " + option + " = " + text_of(end) +
                                " can be reached from other machines, which needs a token");
  try {
    return {registry.context, end};
  } catch (const boost::system::system_error& error) {
    const bool in_use = error.code() == boost::asio::error::address_in_use;
    throw cannot_listen(
        text_of(end),
        error.code().message() + (in_use ? "; give another port (--http, --tcp), 0 for any that is free" : ""));
  }
}

/// Removes a socket file that no process listens at; it would be in the way of a new one.
void remove_stale_socket(boost::asio::io_context& context, const std::string& path) {
  struct stat status {};
  if (stat(path.c_str(), &status) != 0 || !S_ISSOCK(status.st_mode)) return;
  Local::socket probe(context);
  boost::system::error_code error;
  probe.connect(Local::endpoint(path), error);
  if (!error) throw cannot_listen(path, "another process listens there");
  unlink(path.c_str());
}

/// The socket is for its owner alone.
Local::acceptor listen_at(boost::asio::io_context& context, const std::string& path) {
  remove_stale_socket(context, path);
  const mode_t before = umask(0077);
  try {
    Local::acceptor acceptor(context, Local::endpoint(path));
    umask(before);
    return acceptor;
  } catch (const boost::system::system_error& error) {
    umask(before);
    throw cannot_listen(path, error.code().message());
  }
}

/// Sends the reason and closes the socket.
template <class Socket>
void turn_away(Socket socket) {
  auto held = std::make_shared<Socket>(std::move(socket));
  auto text = std::make_shared<std::string>(rejection_line(Rejection::too_many_connections, 1) + "\n");
  boost::asio::async_write(*held, boost::asio::buffer(*text),
                           [held, text](const boost::system::error_code&, std::size_t) {});
}

/// `reserve`: how many connections beyond `service.max_connections` are accepted.
template <class Acceptor, class Start>
void accept_all(detail::ConnectionRegistry& registry, Acceptor& acceptor, std::size_t reserve, Start start) {
  acceptor.async_accept([&registry, &acceptor, reserve, start](const boost::system::error_code& error, auto socket) {
    if (!acceptor.is_open()) return;
    if (!error && registry.open < static_cast<std::size_t>(registry.config.max_connections) + reserve) {
      start(std::move(socket));
    } else if (!error) {
      registry.engine->reject(0, Rejection::too_many_connections);
      turn_away(std::move(socket));
    }
    accept_all(registry, acceptor, reserve, start);
  });
}

}  // namespace

struct Server::State {
  explicit State(LearnerThread& learner_) : learner(learner_) {
    struct sigaction at_hangup = {};
    sigaction(SIGHUP, nullptr, &at_hangup);
    if (at_hangup.sa_handler != SIG_IGN) signals.add(SIGHUP);  // ignored under nohup
  }

  LearnerThread& learner;
  detail::ConnectionRegistry registry{};
  std::optional<tcp::acceptor> http, lines;
  std::optional<Local::acceptor> local;
  boost::asio::signal_set signals{registry.context, SIGINT, SIGTERM};
  std::shared_ptr<detail::StandardIo> standard;
  std::shared_ptr<detail::MqttConnection> mqtt;
  std::unique_ptr<Engine> engine;
  std::vector<std::string> listening;  ///< announced once all addresses are open

  ServiceMetrics metrics() const;
  void listen_http();
  void listen_tcp();
  void listen_unix();
  void send(std::vector<OutgoingLine> outgoing);
  void show(std::string message);
  void finish(StreamId stream);
  void close();
  void end_streams();
};

ServiceMetrics Server::State::metrics() const {
  ServiceMetrics metrics = engine->metrics();
  metrics.lines = registry.lines;
  metrics.slow_reader_dropped = registry.slow_reader_dropped;
  metrics.connections = registry.open;
  return metrics;
}

void Server::State::listen_http() {
  http.emplace(listen_at(registry, "--http", registry.options.http));
  accept_all(registry, *http, kHttpReserve,
             [this](tcp::socket socket) { detail::serve_web(registry, std::move(socket)); });
  const std::string end = text_of(http->local_endpoint());
  listening.push_back("page and metrics at http://" + end + "/, WebSocket at ws://" + end + "/stream");
}

void Server::State::listen_tcp() {
  lines.emplace(listen_at(registry, "--tcp", registry.options.tcp));
  accept_all(registry, *lines, 0, [this](tcp::socket socket) {
    boost::system::error_code ignored;
    socket.set_option(tcp::no_delay(true), ignored);
    socket.set_option(boost::asio::socket_base::keep_alive(true), ignored);
    std::make_shared<detail::SocketConnection<tcp::socket>>(registry, std::move(socket))->start();
  });
  listening.push_back("lines at tcp:" + text_of(lines->local_endpoint()));
}

void Server::State::listen_unix() {
  local.emplace(listen_at(registry.context, registry.options.unix_path));
  accept_all(registry, *local, 0, [this](Local::socket socket) {
    std::make_shared<detail::SocketConnection<Local::socket>>(registry, std::move(socket))->start();
  });
  listening.push_back("lines at unix:" + registry.options.unix_path);
}

void Server::State::send(std::vector<OutgoingLine> outgoing) {
  boost::asio::post(registry.context, [this, outgoing = std::move(outgoing)]() mutable {
    for (OutgoingLine& line : outgoing) {
      const auto found = registry.streams.find(line.stream);
      if (found == registry.streams.end()) continue;
      if (const auto connection = found->second.lock()) connection->send(std::move(line.text), line.droppable);
    }
  });
}

void Server::State::show(std::string message) {
  boost::asio::post(registry.context, [this, message = std::move(message)] {
    for (const auto& [id, page] : registry.live_pages) {
      if (const auto connection = page.lock()) connection->send(message, true);
    }
  });
}

void Server::State::finish(StreamId stream) {
  boost::asio::post(registry.context, [this, stream] {
    const auto found = registry.streams.find(stream);
    if (found == registry.streams.end()) return;
    if (const auto connection = found->second.lock()) connection->finish();
  });
}

void Server::State::close() {
  boost::system::error_code ignored;
  if (http) http->close(ignored);
  if (lines) lines->close(ignored);
  if (local) {
    local->close(ignored);
    unlink(registry.options.unix_path.c_str());
  }
  for (const auto* all : {&registry.streams, &registry.live_pages}) {
    for (const auto& [id, weak] : *all) {
      if (const auto connection = weak.lock()) connection->close();
    }
  }
  registry.context.stop();
}

/// Ends the streams that are open when the connections are closed, so that their tracks are learnt.
void Server::State::end_streams() {
  if (standard) standard->join_reader();  // else they could still offer detections
  mqtt.reset();
  for (const auto& [id, connection] : registry.streams) engine->offer({id, std::nullopt, monotonic_s()});
}

Server::Server(const ServerOptions& options, const Scene& scene, ServiceSettings settings, LearnerThread& learner,
               std::function<void(const std::string&)> announce)
    : state_(std::make_unique<State>(learner)) {
  State& state = *state_;
  validate_fields("service", settings.service);
  state.registry.options = options;
  state.registry.config = settings.service;
  state.registry.has_camera = settings.camera.has_value();
  const auto close = [&state] { boost::asio::post(state.registry.context, [&state] { state.close(); }); };
  state.engine = std::make_unique<Engine>(
      std::move(settings), learner,
      Engine::Output{[&state](std::vector<OutgoingLine> lines) { state.send(std::move(lines)); },
                     [&state](std::string message) { state.show(std::move(message)); }, close,
                     [&state](StreamId stream) { state.finish(stream); },
                     [&state](const std::string& warning) { state.registry.announce("warning: " + warning); }},
      options.standard_input && options.wait);
  state.registry.engine = state.engine.get();
  state.registry.metrics = [&state] { return state.metrics(); };
  if (!options.picture.empty() && !scene.camera)
    throw std::invalid_argument("serve: picture is given, but the scene has no camera, by which metres become pixels");
  state.registry.hello = [scene, &learner, picture = options.picture] {
    return hello_message(scene, learner.snapshot()->model, picture);
  };
  if (!options.http.empty()) state.listen_http();
  if (!options.tcp.empty()) state.listen_tcp();
  if (!options.unix_path.empty()) state.listen_unix();
  if (!options.mqtt.empty()) state.mqtt = std::make_shared<detail::MqttConnection>(state.registry);
  for (const std::string& where : state.listening) announce(where);
  state.registry.announce = std::move(announce);
  state.signals.async_wait([&state](const boost::system::error_code& error, int) {
    if (!error) state.close();
  });
  if (!options.standard_input) return;
  state.standard = std::make_shared<detail::StandardIo>(state.registry, close);
}

Server::~Server() {
  state_->standard.reset();
  state_->mqtt.reset();
  state_->registry.engine = nullptr;
  state_->engine.reset();
}

void Server::run() {
  if (state_->standard) state_->standard->start();
  if (state_->mqtt) state_->mqtt->start();
  const auto work = boost::asio::make_work_guard(state_->registry.context);
  state_->registry.context.run();
  state_->end_streams();
  state_->engine->drain();  // else the learner would get the last finished tracks one by one
  const LearnerStatus left = state_->learner.status();
  if (left.learning || left.waiting_tracks > 0) state_->registry.announce("learning the tracks that are finished");
  state_->learner.drain();
  state_->engine->rethrow_failure();
  const std::string failure = state_->standard ? state_->standard->failure() : "";
  if (!failure.empty()) throw std::runtime_error("serve: " + failure);
}

void Server::stop() {
  boost::asio::post(state_->registry.context, [this] { state_->close(); });
}

unsigned Server::http_port() const {
  return state_->http ? state_->http->local_endpoint().port() : 0U;
}

unsigned Server::tcp_port() const {
  return state_->lines ? state_->lines->local_endpoint().port() : 0U;
}

ServiceMetrics Server::metrics() const {
  return state_->metrics();
}

}  // namespace sila
