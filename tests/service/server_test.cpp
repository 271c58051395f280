// The service over real sockets, on ports that the system chooses.
#include "sila/service/server.hpp"

#include <gtest/gtest.h>

#include <boost/asio/ip/tcp.hpp>
#include <boost/asio/local/stream_protocol.hpp>
#include <boost/asio/read.hpp>
#include <boost/asio/read_until.hpp>
#include <boost/asio/write.hpp>
#include <boost/beast/core.hpp>
#include <boost/beast/http.hpp>
#include <boost/beast/websocket.hpp>
#include <filesystem>

#include "service/running.hpp"
#include "sila/service/replay.hpp"
#include "support/message_of.hpp"
#include "support/scratch.hpp"

namespace sila {
namespace {

namespace asio = boost::asio;
namespace beast = boost::beast;
using asio::ip::tcp;
using testing::comes_true;
using testing::corner_walks;
using testing::Running;

std::string line_of(const Detection& row) {
  return nlohmann::json{{"t", row.t_s}, {"id", row.track}, {"x", row.position_m.x()}, {"y", row.position_m.y()}}.dump();
}

tcp::endpoint loopback(unsigned port) {
  return {asio::ip::make_address("127.0.0.1"), static_cast<unsigned short>(port)};
}

/// A client that sends lines and waits for answers.
class Client {
 public:
  explicit Client(unsigned port) : socket_(context_) { socket_.connect(loopback(port)); }
  void send(const std::string& line) { asio::write(socket_, asio::buffer(line + "\n")); }
  void send(const Detection& row) { send(line_of(row)); }
  void end() { socket_.shutdown(tcp::socket::shutdown_send); }
  /// The next line; none when the service closed the connection.
  std::optional<nlohmann::json> receive() {
    boost::system::error_code error;
    const std::size_t size = asio::read_until(socket_, asio::dynamic_buffer(buffer_), '\n', error);
    if (error) return std::nullopt;
    const auto json = nlohmann::json::parse(buffer_.substr(0, size));
    buffer_.erase(0, size);
    return json;
  }

 private:
  asio::io_context context_;
  tcp::socket socket_;
  std::string buffer_;
};

std::string get(unsigned port, const std::string& target, const std::string& authorization = {}) {
  asio::io_context context;
  tcp::socket socket(context);
  socket.connect(loopback(port));
  beast::http::request<beast::http::empty_body> request{beast::http::verb::get, target, 11};
  request.set(beast::http::field::host, "localhost");
  if (!authorization.empty()) request.set(beast::http::field::authorization, authorization);
  beast::http::write(socket, request);
  beast::flat_buffer buffer;
  beast::http::response<beast::http::string_body> response;
  beast::http::read(socket, buffer, response);
  return std::to_string(response.result_int()) + "\n" + response.body();
}

std::vector<Detection> one_walker(double seconds) {
  std::vector<Detection> rows;
  for (int k = 0; k <= static_cast<int>(10.0 * seconds); ++k) rows.push_back({"17", 0.1 * k, {0.13 * k, 1.0}});
  return rows;
}

TEST(Server, AnswersEachDueDetectionWithAPrediction) {
  Running service;
  Client client(service.server->tcp_port());
  for (const Detection& row : one_walker(5.0)) {
    client.send(row);
    if (row.t_s < 0.4 - 1e-9) continue;
    const auto prediction = client.receive();
    ASSERT_TRUE(prediction);
    EXPECT_EQ((*prediction)["track"], "17");
    EXPECT_EQ((*prediction)["t0"].get<double>(), row.t_s);
    EXPECT_EQ((*prediction)["t"].size(), 25u);
  }
}

TEST(Server, AnswersAClientThatHasClosedItsSendingSide) {
  Running service;
  Client client(service.server->tcp_port());
  client.send("nonsense");
  for (const Detection& row : one_walker(1.0)) client.send(row);
  client.end();
  std::vector<nlohmann::json> answers;
  while (const auto line = client.receive()) answers.push_back(*line);
  const auto has = [&](const char* key) {
    return std::ranges::any_of(answers, [&](auto& line) { return line.contains(key); });
  };
  EXPECT_TRUE(has("rejected"));
  EXPECT_TRUE(has("modes"));
  EXPECT_TRUE(comes_true([&] { return service.server->metrics().connections == 0; }));
}

TEST(Server, ReportsRejectedLines) {
  Running service(ServiceConfig{.max_line_bytes = 100});
  Client client(service.server->tcp_port());
  client.send("nonsense");
  client.send(std::string(5000, 'x'));
  client.send(R"({"t": 1, "id": "a", "x": 1, "y": 1e300})");
  std::map<std::string, int> rejected;
  while (rejected.size() < 3) {
    const auto message = client.receive();
    ASSERT_TRUE(message && message->contains("rejected"));
    rejected[(*message)["rejected"]] += (*message)["count"].get<int>();
  }
  EXPECT_EQ(rejected, (std::map<std::string, int>{{"not_json", 1}, {"not_usable", 1}, {"too_long", 1}}));
}

TEST(Server, AFastClientDoesNotSlowDownOthers) {
  Running service(ServiceConfig{.max_rate_hz = 50.0});
  Client fast(service.server->tcp_port()), calm(service.server->tcp_port());
  // Together below min_observe_s, so that no prediction comes whichever of them are accepted.
  for (int k = 0; k < 500; ++k) fast.send(Detection{"a", 0.0005 * k, {0.0, 0.0}});
  int rejected = 0;
  while (rejected < 400) {
    const auto message = fast.receive();
    ASSERT_TRUE(message);
    EXPECT_EQ((*message)["rejected"], "too_fast");
    rejected += (*message)["count"].get<int>();
  }
  for (const Detection& row : one_walker(3.3)) calm.send(row);
  EXPECT_TRUE(calm.receive()->contains("modes"));
}

/// Lines of one track that leaps at each line; its path is cleaned again each time, which is costly.
std::string leaps(int first, int count) {
  std::string lines;
  for (int k = first; k < first + count; ++k)
    lines += nlohmann::json{{"t", 1e-4 * k}, {"id", "a"}, {"x", 1000.0 * (k % 2)}, {"y", 0.0}}.dump() + "\n";
  return lines;
}

TEST(Server, AClientThatSendsLittleIsAnsweredBesideAFlood) {
  Running service(ServiceConfig{.max_rate_hz = 1e6, .max_queued_lines = 500});
  Client greedy(service.server->tcp_port()), calm(service.server->tcp_port());
  std::atomic<bool> enough = false;
  std::thread flood([&] {
    for (int k = 0; !enough; k += 1000) greedy.send(leaps(k, 1000));
  });
  // Before that come predictions of accepted lines. What follows a gap of rejected lines may be off the clock.
  auto message = greedy.receive();
  while (message && (message->contains("modes") || message->value("rejected", "") == "off_clock"))
    message = greedy.receive();
  EXPECT_EQ(message.value_or(nlohmann::json::object()).value("rejected", ""), "overloaded");
  for (const Detection& row : one_walker(3.3)) calm.send(row);
  const auto answer = calm.receive();
  enough = true;
  flood.join();
  ASSERT_TRUE(answer);
  EXPECT_TRUE(answer->contains("modes")) << *answer;
}

TEST(Server, RejectsConnectionsBeyondTheLimit) {
  Running service(ServiceConfig{.max_connections = 2});
  Client first(service.server->tcp_port()), second(service.server->tcp_port()), third(service.server->tcp_port());
  EXPECT_EQ((*third.receive())["rejected"], "too_many_connections");
  EXPECT_FALSE(third.receive());
  EXPECT_EQ(get(service.server->http_port(), "/healthz"), "200\nok\n") << "monitoring still gets answers";
}

TEST(Server, RejectsClientsWithoutTheToken) {
  ServerOptions options;
  options.token = "secret";
  Running service({}, options);
  Client stranger(service.server->tcp_port());
  stranger.send(Detection{"a", 0.0, {0.0, 0.0}});
  EXPECT_EQ((*stranger.receive())["rejected"], "no_token");
  EXPECT_FALSE(stranger.receive());
  Client friendly(service.server->tcp_port());
  friendly.send(R"({"token": "secret"})");
  for (const Detection& row : one_walker(3.3)) friendly.send(row);
  EXPECT_TRUE(friendly.receive()->contains("modes"));
  EXPECT_EQ(get(service.server->http_port(), "/metrics").substr(0, 3), "403");
  EXPECT_EQ(get(service.server->http_port(), "/metrics?token=secret").substr(0, 3), "200");
  EXPECT_EQ(get(service.server->http_port(), "/metrics", "Bearer secret").substr(0, 3), "200");
}

TEST(Server, ClosesConnectionsThatSendNoTokenInTime) {
  ServerOptions options;
  options.token = "secret";
  options.token_timeout = std::chrono::milliseconds(300);
  Running service({.max_connections = 2}, options);
  Client friendly(service.server->tcp_port());
  friendly.send(R"({"token": "secret"})");
  Client silent(service.server->tcp_port());
  EXPECT_EQ((*silent.receive())["rejected"], "no_token");
  EXPECT_FALSE(silent.receive());
  for (const Detection& row : one_walker(3.3)) friendly.send(row);
  EXPECT_TRUE(friendly.receive()->contains("modes"));
}

TEST(Server, ListensBeyondLoopbackOnlyWithAToken) {
  ServiceSettings settings = testing::service_settings();
  LearnerThread learner(Model{}, {}, settings.episode, settings.service, {});
  ServerOptions options;
  options.tcp = "0.0.0.0:0";
  int announced = 0;
  const auto start = [&] { Server(options, Scene{}, settings, learner, [&](const std::string&) { ++announced; }); };
  EXPECT_THROW(start(), std::invalid_argument);
  options.token = "secret";
  EXPECT_NO_THROW(start());
  EXPECT_EQ(announced, 1);
  options.http = "127.0.0.1:0";
  options.tcp = "nowhere";
  EXPECT_THROW(start(), std::invalid_argument);
  EXPECT_EQ(announced, 1);
}

TEST(Server, ServesThePageAndTheMetrics) {
  Running service;
  const unsigned port = service.server->http_port();
  EXPECT_EQ(get(port, "/").substr(0, 20), "200\n<!doctype html>\n");
  EXPECT_EQ(get(port, "/healthz"), "200\nok\n");
  EXPECT_EQ(get(port, "/etc/passwd").substr(0, 3), "404");
  Client client(service.server->tcp_port());
  for (const Detection& row : one_walker(4.0)) {
    client.send(row);
    if (row.t_s >= 0.4 - 1e-9) {
      ASSERT_TRUE(client.receive());
    }
  }
  std::string metrics;
  comes_true([&] { return (metrics = get(port, "/metrics")).find("sila_predictions_total 37") != std::string::npos; });
  for (const char* sample :
       {"sila_lines_total 41", "sila_detections_total 41", "sila_predictions_total 37", "sila_pedestrians 1",
        "sila_prediction_seconds_bucket{le=\"+Inf\"} 37", "# TYPE sila_prediction_seconds histogram"})
    EXPECT_TRUE(says(metrics, sample));
}

TEST(Server, AnswersHeadWithoutABody) {
  Running service;
  asio::io_context context;
  tcp::socket socket(context);
  socket.connect(loopback(service.server->http_port()));
  const std::string request = "HEAD /healthz HTTP/1.1\r\nHost: localhost\r\nConnection: close\r\n\r\n";
  asio::write(socket, asio::buffer(request));
  std::string answer;
  boost::system::error_code end;
  asio::read(socket, asio::dynamic_buffer(answer), end);
  EXPECT_TRUE(says(answer, "200 OK"));
  EXPECT_TRUE(says(answer, "Content-Length: 3\r\n"));
  EXPECT_TRUE(answer.ends_with("\r\n\r\n")) << answer;
}

TEST(Server, WebSocketsCarryLinesAndThePage) {
  Running service;
  asio::io_context context;
  const auto open = [&](const std::string& path) {
    auto socket = std::make_unique<beast::websocket::stream<tcp::socket>>(context);
    socket->next_layer().connect(loopback(service.server->http_port()));
    socket->handshake("localhost", path);
    return socket;
  };
  const auto receive = [](auto& socket) {
    beast::flat_buffer buffer;
    socket->read(buffer);
    return nlohmann::json::parse(beast::buffers_to_string(buffer.data()));
  };
  const auto page = open("/live"), stream = open("/stream");
  const auto hello = receive(page);
  EXPECT_EQ(hello["kind"], "hello");
  EXPECT_TRUE(hello["scene"]["known"].template get<bool>());
  std::string message;
  for (const Detection& row : one_walker(4.0)) message += line_of(row) + "\n";
  stream->write(asio::buffer(message));
  EXPECT_TRUE(receive(stream).contains("modes"));
  bool metrics = false, pedestrians = false;
  for (int k = 0; k < 40 && !(metrics && pedestrians); ++k) {
    const auto shown = receive(page);
    metrics = metrics || (shown["kind"] == "metrics" && shown["pedestrians"] == 1);
    pedestrians = pedestrians || (shown["kind"] == "frame" && shown["pedestrians"].size() == 1 &&
                                  shown["pedestrians"][0].contains("modes"));
  }
  EXPECT_TRUE(metrics && pedestrians);
}

TEST(Server, LearnsWhilePredictingAndTheRestAtItsEnd) {
  Running service(ServiceConfig{.batch = 10});
  std::vector<Trajectory> tracks = testing::paths_of(corner_walks(25, 3));
  CleanTracks clean;
  for (Trajectory& track : tracks) clean.trajectories.push_back(std::move(track));
  const std::vector<TimedLine> lines = timed_lines(clean, 0.3);
  const std::string address = "tcp:127.0.0.1:" + std::to_string(service.server->tcp_port());
  const ReplayReport report = replay_to(address, "", lines, 20.0, 0.5, [](const std::string&) {});
  EXPECT_EQ(report.sent, lines.size());
  EXPECT_GT(report.predictions, 0u);
  EXPECT_EQ(report.rejected, 0u);
  comes_true([&] { return service.stored >= 2; });
  EXPECT_EQ(service.stored, 2);
  Counters counters;  // at most half a second old
  comes_true([&] { return (counters = service.server->metrics().counters).detections >= lines.size(); });
  EXPECT_EQ(counters.detections, lines.size());
  EXPECT_EQ(counters.detections, counters.not_due + counters.predictions + counters.superseded);
  EXPECT_TRUE(comes_true([&] { return service.learner->status().waiting_tracks > 0; }));
  service.stop();
  EXPECT_EQ(service.stored, 3);
}

TEST(Server, LearnsTheOpenTracksOfAllConnectionsWhenItStops) {
  Running service;
  Client client(service.server->tcp_port());
  asio::io_context context;
  beast::websocket::stream<tcp::socket> socket(context);
  socket.next_layer().connect(loopback(service.server->http_port()));
  socket.handshake("localhost", "/stream");
  for (const Detection& row : one_walker(4.0)) {
    client.send(row);
    const nlohmann::json line{{"t", row.t_s}, {"id", row.track}, {"x", row.position_m.x()}, {"y", 2.0}};
    socket.write(asio::buffer(line.dump()));
  }
  EXPECT_TRUE(comes_true([&] { return service.server->metrics().counters.detections >= 82; }));
  EXPECT_EQ(service.learner->status().waiting_tracks, 0u);
  service.stop();
  EXPECT_EQ(service.learner->status().learnt_tracks, 2u);
}

TEST(Server, EndsWithTheExceptionOfItsEngine) {
  ServiceSettings settings = testing::service_settings();
  settings.frame_for = [](const Trajectory&) -> CurbFrame { throw std::runtime_error("no frame"); };
  LearnerThread learner(Model{}, {}, settings.episode, settings.service, {});
  ServerOptions options;
  options.tcp = "127.0.0.1:0";
  Server server(options, Scene{}, settings, learner, [](const std::string&) {});
  Client client(server.tcp_port());
  for (const Detection& row : one_walker(1.0)) client.send(row);
  EXPECT_THROW(server.run(), std::runtime_error);
}

TEST(Server, AReplayEndsWhenTheServiceDoes) {
  Running service;
  const std::string address = "tcp:127.0.0.1:" + std::to_string(service.server->tcp_port());
  std::vector<TimedLine> lines;
  for (int k = 0; k < 1200; ++k) lines.push_back({0.05 * k, "a", 0.05 * k, R"({"t": 0, "id": "a", "x": 1, "y": 1})"});
  std::thread end([&] {
    comes_true([&] { return service.server->metrics().connections > 0; });
    service.server->stop();
  });
  const auto replay = [&] { replay_to(address, "", lines, 1.0, 0.0, [](const std::string&) {}); };
  EXPECT_TRUE(says(message_of<std::runtime_error>(replay), "closed the connection after"));
  end.join();
}

TEST(Server, AUnixSocketIsForItsOwnerAlone) {
  const tests::ScratchFolder folder;
  const auto path = folder / "service.sock";
  ServerOptions options;
  options.unix_path = path;
  {
    Running service({}, options);
    EXPECT_EQ(std::filesystem::status(path).permissions() & std::filesystem::perms::others_all,
              std::filesystem::perms::none);
    std::vector<TimedLine> lines;
    for (const Detection& row : one_walker(4.0)) lines.push_back({row.t_s, row.track, row.t_s, line_of(row)});
    EXPECT_GT(replay_to("unix:" + path.string(), "", lines, 10.0, 2.0, [](const std::string&) {}).predictions, 0u);
  }
  EXPECT_FALSE(std::filesystem::exists(path));
}

}  // namespace
}  // namespace sila
