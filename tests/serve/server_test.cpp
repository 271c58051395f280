// The service over real sockets, on ports that the system chooses.
#include "sila/serve/server.hpp"

#include <gtest/gtest.h>

#include <boost/asio/ip/tcp.hpp>
#include <boost/asio/local/stream_protocol.hpp>
#include <boost/asio/read_until.hpp>
#include <boost/asio/write.hpp>
#include <boost/beast/core.hpp>
#include <boost/beast/http.hpp>
#include <boost/beast/websocket.hpp>
#include <filesystem>

#include "live/streams.hpp"
#include "sila/serve/replay.hpp"
#include "support/scratch.hpp"

namespace sila {
namespace {

namespace asio = boost::asio;
namespace beast = boost::beast;
using asio::ip::tcp;
using testing::corner_walks;

class Running {
 public:
  explicit Running(ServeOptions options = {}, LiveConfig live = {}) {
    options.http = options.tcp = "127.0.0.1:0";
    LiveSettings settings = testing::live_settings();
    settings.live = live;
    const SidewalkWidths widths{2.5, 2.5, 2.5};
    scene.corners.push_back({"corner", testing::square_frame(), widths});
    learner.emplace(Model{}, settings.episode, live, [this](const Model&, const Episode&) { ++kept; });
    server.emplace(
        options, scene, settings, *learner, OnlineCalibration{}, [](const OnlineCalibration&) {},
        [](const std::string&) {});
    thread = std::thread([this] { server->run(); });
  }
  ~Running() {
    server->stop();
    thread.join();
    server.reset();
  }

  Scene scene;
  std::atomic<int> kept = 0;
  std::optional<Learner> learner;
  std::optional<Server> server;
  std::thread thread;
};

/// A client that speaks in lines and waits for what it wants to hear.
class Client {
 public:
  explicit Client(unsigned port) : socket_(context_) {
    socket_.connect({asio::ip::make_address("127.0.0.1"), static_cast<unsigned short>(port)});
  }
  void say(const std::string& line) { asio::write(socket_, asio::buffer(line + "\n")); }
  void say(const Detection& row) {
    say(nlohmann::json{{"t", row.t_s}, {"id", row.track}, {"x", row.position_m.x()}, {"y", row.position_m.y()}}.dump());
  }
  /// The next line; nothing when the service hung up.
  std::optional<nlohmann::json> hear() {
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
  socket.connect({asio::ip::make_address("127.0.0.1"), static_cast<unsigned short>(port)});
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

TEST(Server, AnswersEachDetectionThatIsDueWithAPrediction) {
  Running service;
  Client client(service.server->tcp_port());
  for (const Detection& row : one_walker(5.0)) {
    client.say(row);
    if (row.t_s < 3.2 - 1e-9) continue;
    const auto prediction = client.hear();
    ASSERT_TRUE(prediction);
    EXPECT_EQ((*prediction)["track"], "17");
    EXPECT_EQ((*prediction)["t0"].get<double>(), row.t_s);
    EXPECT_EQ((*prediction)["modes"][0]["t"].size(), 25u);
  }
}

TEST(Server, SaysWhatItRefuses) {
  ServeOptions options;
  options.config.max_line_bytes = 100;
  Running service(options);
  Client client(service.server->tcp_port());
  client.say("nonsense");
  client.say(std::string(5000, 'x'));
  client.say(R"({"t": 1, "id": "a", "x": 1, "y": 1e300})");
  std::map<std::string, int> refused;
  while (refused.size() < 3) {
    const auto told = client.hear();
    ASSERT_TRUE(told && told->contains("refused"));
    refused[(*told)["refused"]] += (*told)["count"].get<int>();
  }
  EXPECT_EQ(refused, (std::map<std::string, int>{{"not_json", 1}, {"not_usable", 1}, {"too_long", 1}}));
}

TEST(Server, SlowsNobodyDownForOneWhoIsTooFast) {
  ServeOptions options;
  options.config.max_rate_hz = 50.0;
  Running service(options);
  Client fast(service.server->tcp_port()), calm(service.server->tcp_port());
  for (int k = 0; k < 500; ++k) fast.say(Detection{"a", 0.001 * k, {0.0, 0.0}});
  int refused = 0;
  while (refused < 400) {
    const auto told = fast.hear();
    ASSERT_TRUE(told);
    EXPECT_EQ((*told)["refused"], "too_fast");
    refused += (*told)["count"].get<int>();
  }
  for (const Detection& row : one_walker(3.3)) calm.say(row);
  EXPECT_TRUE(calm.hear()->contains("modes"));
}

/// Lines of one track that leaps at each of them: its path is made anew each time, which takes long.
std::string leaps(int first, int count) {
  std::string lines;
  for (int k = first; k < first + count; ++k)
    lines += nlohmann::json{{"t", 1e-4 * k}, {"id", "a"}, {"x", 1000.0 * (k % 2)}, {"y", 0.0}}.dump() + "\n";
  return lines;
}

TEST(Server, HearsWhoSendsLittleHoweverMuchAnotherSends) {
  ServeOptions options;
  options.config.max_waiting_lines = 500;
  options.config.max_rate_hz = 1e6;
  Running service(options);
  Client greedy(service.server->tcp_port()), calm(service.server->tcp_port());
  std::atomic<bool> enough = false;
  std::thread flood([&] {
    for (int k = 0; !enough; k += 1000) greedy.say(leaps(k, 1000));
  });
  auto refusal = greedy.hear();
  while (refusal && refusal->contains("modes")) refusal = greedy.hear();  // predictions of lines that were taken
  EXPECT_EQ(refusal.value_or(nlohmann::json::object()).value("refused", ""), "overloaded");
  for (const Detection& row : one_walker(3.3)) calm.say(row);
  const auto answer = calm.hear();
  enough = true;
  flood.join();
  ASSERT_TRUE(answer);
  EXPECT_TRUE(answer->contains("modes")) << *answer;
}

TEST(Server, TurnsAwayWhoComesWhenAllPlacesAreTaken) {
  ServeOptions options;
  options.config.max_connections = 2;
  Running service(options);
  Client first(service.server->tcp_port()), second(service.server->tcp_port()), third(service.server->tcp_port());
  EXPECT_EQ((*third.hear())["refused"], "too_many_connections");
  EXPECT_FALSE(third.hear());
}

TEST(Server, WithATokenNobodyIsHeardWithoutIt) {
  ServeOptions options;
  options.token = "secret";
  Running service(options);
  Client stranger(service.server->tcp_port());
  stranger.say(Detection{"a", 0.0, {0.0, 0.0}});
  EXPECT_EQ((*stranger.hear())["refused"], "no_token");
  EXPECT_FALSE(stranger.hear());
  Client friendly(service.server->tcp_port());
  friendly.say(R"({"token": "secret"})");
  for (const Detection& row : one_walker(3.3)) friendly.say(row);
  EXPECT_TRUE(friendly.hear()->contains("modes"));
  EXPECT_EQ(get(service.server->http_port(), "/metrics").substr(0, 3), "403");
  EXPECT_EQ(get(service.server->http_port(), "/metrics?token=secret").substr(0, 3), "200");
  EXPECT_EQ(get(service.server->http_port(), "/metrics", "Bearer secret").substr(0, 3), "200");
}

TEST(Server, WhoShowsNoTokenInTimeLosesThePlace) {
  ServeOptions options;
  options.token = "secret";
  options.config.max_connections = 2;
  options.token_patience = std::chrono::milliseconds(300);
  Running service(options);
  Client friendly(service.server->tcp_port());
  friendly.say(R"({"token": "secret"})");
  Client silent(service.server->tcp_port());
  EXPECT_EQ((*silent.hear())["refused"], "no_token");
  EXPECT_FALSE(silent.hear());
  for (const Detection& row : one_walker(3.3)) friendly.say(row);
  EXPECT_TRUE(friendly.hear()->contains("modes"));
}

TEST(Server, DoesNotListenElsewhereWithoutAToken) {
  LiveSettings settings = testing::live_settings();
  Learner learner(Model{}, settings.episode, settings.live, [](const Model&, const Episode&) {});
  ServeOptions options;
  options.tcp = "0.0.0.0:0";
  const auto start = [&] {
    Server(
        options, Scene{}, settings, learner, OnlineCalibration{}, [](const OnlineCalibration&) {},
        [](const std::string&) {});
  };
  EXPECT_THROW(start(), std::invalid_argument);
  options.token = "secret";
  EXPECT_NO_THROW(start());
  options.tcp = "nowhere";
  EXPECT_THROW(start(), std::invalid_argument);
}

TEST(Server, ServesThePageAndTheMetrics) {
  Running service;
  const unsigned port = service.server->http_port();
  EXPECT_EQ(get(port, "/").substr(0, 20), "200\n<!doctype html>\n");
  EXPECT_EQ(get(port, "/healthz"), "200\nok\n");
  EXPECT_EQ(get(port, "/etc/passwd").substr(0, 3), "404");
  Client client(service.server->tcp_port());
  for (const Detection& row : one_walker(4.0)) {
    client.say(row);
    if (row.t_s >= 3.2 - 1e-9) {
      ASSERT_TRUE(client.hear());
    }
  }
  std::string metrics;
  for (int tries = 0; tries < 100 && metrics.find("sila_predictions_total 9") == std::string::npos; ++tries) {
    std::this_thread::sleep_for(std::chrono::milliseconds(50));
    metrics = get(port, "/metrics");
  }
  for (const char* sample :
       {"sila_lines_total 41", "sila_detections_total 41", "sila_predictions_total 9", "sila_pedestrians 1",
        "sila_prediction_seconds_bucket{le=\"+Inf\"} 9", "# TYPE sila_prediction_seconds histogram"})
    EXPECT_NE(metrics.find(sample), std::string::npos) << sample;
}

TEST(Server, WebSocketsCarryLinesAndThePage) {
  Running service;
  asio::io_context context;
  const auto open = [&](const std::string& path) {
    auto socket = std::make_unique<beast::websocket::stream<tcp::socket>>(context);
    socket->next_layer().connect(
        {asio::ip::make_address("127.0.0.1"), static_cast<unsigned short>(service.server->http_port())});
    socket->handshake("localhost", path);
    return socket;
  };
  const auto hear = [](auto& socket) {
    beast::flat_buffer buffer;
    socket->read(buffer);
    return nlohmann::json::parse(beast::buffers_to_string(buffer.data()));
  };
  const auto page = open("/live"), stream = open("/stream");
  const auto hello = hear(page);
  EXPECT_EQ(hello["kind"], "hello");
  EXPECT_TRUE(hello["scene"]["known"].template get<bool>());
  std::string message;
  for (const Detection& row : one_walker(4.0)) {
    message +=
        nlohmann::json{{"t", row.t_s}, {"id", row.track}, {"x", row.position_m.x()}, {"y", row.position_m.y()}}.dump() +
        "\n";
  }
  stream->write(asio::buffer(message));
  EXPECT_TRUE(hear(stream).contains("modes"));
  bool facts = false, people = false;
  for (int k = 0; k < 40 && !(facts && people); ++k) {
    const auto shown = hear(page);
    facts = facts || (shown["kind"] == "facts" && shown["pedestrians"] == 1);
    people =
        people || (shown["kind"] == "frame" && shown["people"].size() == 1 && shown["people"][0].contains("modes"));
  }
  EXPECT_TRUE(facts && people);
}

TEST(Server, LearnsWhilePredicting) {
  LiveConfig live;
  live.batch = 10;
  Running service({}, live);
  std::vector<Trajectory> tracks = testing::paths_of(corner_walks(25, 3));
  CleanTracks clean;
  for (Trajectory& track : tracks) clean.trajectories.push_back(std::move(track));
  const std::vector<TimedLine> lines = timed_lines(clean, 0.3);
  const std::string address = "tcp:127.0.0.1:" + std::to_string(service.server->tcp_port());
  const ReplayReport report = replay_to(address, "", lines, 20.0, 0.5, [](const std::string&) {});
  EXPECT_EQ(report.sent, lines.size());
  EXPECT_GT(report.predictions, 0u);
  EXPECT_EQ(report.refused, 0u);
  for (int tries = 0; tries < 200 && service.kept < 2; ++tries)
    std::this_thread::sleep_for(std::chrono::milliseconds(50));
  EXPECT_EQ(service.kept, 2);
  const Account account = service.server->facts().account;
  EXPECT_EQ(account.taken, lines.size());
  EXPECT_EQ(account.taken, account.early + account.answered + account.superseded);
}

TEST(Server, AUnixSocketIsForItsOwnerAlone) {
  const tests::ScratchFolder folder;
  const auto path = folder / "service.sock";
  ServeOptions options;
  options.unix_path = path;
  {
    Running service(options);
    EXPECT_EQ(std::filesystem::status(path).permissions() & std::filesystem::perms::others_all,
              std::filesystem::perms::none);
    std::vector<TimedLine> lines;
    for (const Detection& row : one_walker(4.0)) {
      lines.push_back(
          {row.t_s, row.track, row.t_s,
           nlohmann::json{{"t", row.t_s}, {"id", row.track}, {"x", row.position_m.x()}, {"y", 1.0}}.dump()});
    }
    EXPECT_GT(replay_to("unix:" + path.string(), "", lines, 10.0, 0.3, [](const std::string&) {}).predictions, 0u);
  }
  EXPECT_FALSE(std::filesystem::exists(path));
}

}  // namespace
}  // namespace sila
