#include "sila/serve/server.hpp"

#include <sys/stat.h>
#include <unistd.h>

#include <boost/asio/ip/tcp.hpp>
#include <boost/asio/local/stream_protocol.hpp>
#include <boost/asio/post.hpp>
#include <boost/asio/signal_set.hpp>
#include <csignal>
#include <optional>
#include <stdexcept>

#include "address.hpp"
#include "hub.hpp"
#include "line_session.hpp"
#include "sila/serve/live_page.hpp"
#include "standard_io.hpp"
#include "web_session.hpp"

namespace sila {
namespace {

using boost::asio::ip::tcp;
using Local = boost::asio::local::stream_protocol;

void require_private(const std::string& option, const detail::Address& address, const std::string& token) {
  if (detail::is_loopback(address) || !token.empty()) return;
  throw std::invalid_argument("serve: " + option + " = " + address.host + ":" + std::to_string(address.port) +
                              " can be reached from elsewhere; that needs a token");
}

tcp::acceptor listen_at(boost::asio::io_context& context, const detail::Address& address) {
  const tcp::endpoint endpoint(boost::asio::ip::make_address(address.host), address.port);
  try {
    return {context, endpoint};
  } catch (const boost::system::system_error& error) {
    throw std::runtime_error("serve: cannot listen at " + address.host + ":" + std::to_string(address.port) + ": " +
                             error.code().message());
  }
}

/// A socket that nobody listens at any more is in the way of a new one.
Local::acceptor listen_at(boost::asio::io_context& context, const std::string& path) {
  struct stat status {};
  if (stat(path.c_str(), &status) == 0 && S_ISSOCK(status.st_mode)) {
    Local::socket probe(context);
    boost::system::error_code error;
    probe.connect(Local::endpoint(path), error);
    if (!error) throw std::runtime_error("serve: a pedestrian listens at " + path + " already");
    unlink(path.c_str());
  }
  try {
    const mode_t before = umask(0077);  // for its owner alone
    Local::acceptor acceptor(context, Local::endpoint(path));
    umask(before);
    return acceptor;
  } catch (const boost::system::system_error& error) {
    throw std::runtime_error("serve: cannot listen at " + path + ": " + error.code().message());
  }
}

/// Says why, and hangs up.
template <class Socket>
void turn_away(Socket socket) {
  auto held = std::make_shared<Socket>(std::move(socket));
  auto text = std::make_shared<std::string>(refusal_line(Refusal::too_many_connections, 1) + "\n");
  boost::asio::async_write(*held, boost::asio::buffer(*text),
                           [held, text](const boost::system::error_code&, std::size_t) {});
}

template <class Acceptor, class Start>
void accept_all(detail::Hub& hub, Acceptor& acceptor, Start start) {
  acceptor.async_accept([&hub, &acceptor, start](const boost::system::error_code& error, auto socket) {
    if (!acceptor.is_open()) return;
    if (!error) {
      if (hub.open < static_cast<std::size_t>(hub.config.max_connections)) {
        start(std::move(socket));
      } else {
        ++hub.refused_connections;
        turn_away(std::move(socket));
      }
    }
    accept_all(hub, acceptor, start);
  });
}

}  // namespace

struct Server::State {
  detail::Hub hub;
  Learner& learner;
  Scene scene;
  ServeOptions options;
  std::optional<tcp::acceptor> http, lines;
  std::optional<Local::acceptor> local;
  boost::asio::signal_set signals{hub.context, SIGINT, SIGTERM};
  std::shared_ptr<detail::StandardIo> standard;
  bool input_ended = false;
  std::unique_ptr<Engine> engine;

  State(const ServeOptions& asked, const Scene& place, Learner& teacher)
      : learner(teacher), scene(place), options(asked) {
    hub.config = asked.config;
    hub.token = asked.token;
    hub.token_patience = asked.token_patience;
  }

  Facts facts() const {
    Facts facts = engine->facts();
    facts.lines = hub.lines, facts.dropped_outgoing = hub.dropped;
    facts.refused[static_cast<std::size_t>(Refusal::too_many_connections)] += hub.refused_connections;
    facts.refused[static_cast<std::size_t>(Refusal::no_token)] += hub.refused_tokens;
    facts.connections = hub.open;
    return facts;
  }

  void listen(const std::function<void(const std::string&)>& announce);
  void hand_over(std::vector<Line> answers);
  void show(const std::string& message);
  void close();
};

void Server::State::listen(const std::function<void(const std::string&)>& announce) {
  const auto at = [](const tcp::acceptor& acceptor) {
    const tcp::endpoint end = acceptor.local_endpoint();
    const std::string host = end.address().to_string();
    return (end.address().is_v6() ? "[" + host + "]" : host) + ":" + std::to_string(end.port());
  };
  if (!options.http.empty()) {
    const detail::Address address = detail::parse_address("--http", options.http);
    require_private("--http", address, options.token);
    http.emplace(listen_at(hub.context, address));
    accept_all(hub, *http, [this](tcp::socket socket) { detail::serve_web(hub, std::move(socket)); });
    announce("page and metrics at http://" + at(*http) + "/, WebSocket at ws://" + at(*http) + "/stream");
  }
  if (!options.tcp.empty()) {
    const detail::Address address = detail::parse_address("--tcp", options.tcp);
    require_private("--tcp", address, options.token);
    lines.emplace(listen_at(hub.context, address));
    accept_all(hub, *lines, [this](tcp::socket socket) {
      boost::system::error_code ignored;
      socket.set_option(tcp::no_delay(true), ignored);
      socket.set_option(boost::asio::socket_base::keep_alive(true), ignored);
      std::make_shared<detail::LineSession<tcp::socket>>(hub, std::move(socket))->start();
    });
    announce("lines at tcp:" + at(*lines));
  }
  if (options.unix_path.empty()) return;
  local.emplace(listen_at(hub.context, options.unix_path));
  accept_all(hub, *local, [this](Local::socket socket) {
    std::make_shared<detail::LineSession<Local::socket>>(hub, std::move(socket))->start();
  });
  announce("lines at unix:" + options.unix_path);
}

void Server::State::hand_over(std::vector<Line> answers) {
  boost::asio::post(hub.context, [this, answers = std::move(answers)]() mutable {
    for (Line& line : answers) {
      const auto found = hub.connections.find(line.stream);
      if (found == hub.connections.end()) continue;
      if (const auto connection = found->second.lock()) connection->send(std::move(line.text), line.droppable);
    }
  });
}

void Server::State::show(const std::string& message) {
  boost::asio::post(hub.context, [this, message] {
    for (const auto& [id, watcher] : hub.watchers) {
      if (const auto connection = watcher.lock()) connection->send(message, true);
    }
  });
}

void Server::State::close() {
  boost::system::error_code ignored;
  if (http) http->close(ignored);
  if (lines) lines->close(ignored);
  if (local) local->close(ignored), unlink(options.unix_path.c_str());
  for (const auto* all : {&hub.connections, &hub.watchers}) {
    for (const auto& [id, weak] : *all) {
      if (const auto connection = weak.lock()) connection->close();
    }
  }
  hub.context.stop();
}

Server::Server(const ServeOptions& options, const Scene& scene, LiveSettings settings, Learner& learner,
               OnlineCalibration online_calibration, std::function<void(const OnlineCalibration&)> keep_calibration,
               std::function<void(const std::string&)> announce)
    : state_(std::make_unique<State>(options, scene, learner)) {
  State& state = *state_;
  validate_fields("serve", options.config);
  Engine::Outlets outlets{[&state](std::vector<Line> lines) { state.hand_over(std::move(lines)); },
                          [&state](const std::string& message) { state.show(message); }, std::move(keep_calibration)};
  state.engine = std::make_unique<Engine>(std::move(settings), options.config, learner, std::move(online_calibration),
                                          std::move(outlets));
  state.hub.engine = state.engine.get();
  state.hub.facts = [&state] { return state.facts(); };
  state.hub.hello = [&state] { return hello_message(state.scene, state.learner.snapshot()->model); };
  state.listen(announce);
  state.signals.async_wait([&state](const boost::system::error_code& error, int) {
    if (!error) state.close();
  });
  if (!options.standard_input) return;
  state.standard = std::make_shared<detail::StandardIo>(state.hub, options.wait, [&state] {
    boost::asio::post(state.hub.context, [&state] { state.input_ended = true, state.close(); });
  });
}

Server::~Server() {
  state_->standard.reset();
  state_->hub.engine = nullptr;
  state_->engine.reset();
}

bool Server::run() {
  if (state_->standard) state_->standard->start();
  const auto work = boost::asio::make_work_guard(state_->hub.context);
  state_->hub.context.run();
  return state_->input_ended;
}

void Server::stop() {
  boost::asio::post(state_->hub.context, [this] { state_->close(); });
}

unsigned Server::http_port() const {
  return state_->http ? state_->http->local_endpoint().port() : 0U;
}

unsigned Server::tcp_port() const {
  return state_->lines ? state_->lines->local_endpoint().port() : 0U;
}

Facts Server::facts() const {
  return state_->facts();
}

}  // namespace sila
