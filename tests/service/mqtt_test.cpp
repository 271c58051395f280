// The service between two topics of a broker of MQTT, Debian's mosquitto. Without one these tests are skipped.
#include "service/mqtt.hpp"

#include <dlfcn.h>
#include <gtest/gtest.h>
#include <mosquitto.h>
#include <sys/wait.h>
#include <unistd.h>

#include <boost/asio/io_context.hpp>
#include <boost/asio/ip/tcp.hpp>
#include <csignal>

#include "service/running.hpp"
#include "support/message_of.hpp"
#include "support/scratch.hpp"

/// Given for each prediction that is published.
static std::atomic<int> result_of_publish = MOSQ_ERR_SUCCESS;

/// Replaces the function of the library. A lost connection gives MOSQ_ERR_NO_CONN for a message that is sent later.
int mosquitto_publish(mosquitto* client, int* id, const char* topic, int size, const void* payload, int qos,
                      bool retain) {
  static const auto publish = reinterpret_cast<decltype(&mosquitto_publish)>(dlsym(RTLD_NEXT, "mosquitto_publish"));
  const int result = publish(client, id, topic, size, payload, qos, retain);
  return topic == std::string("out") && result == MOSQ_ERR_SUCCESS ? result_of_publish.load() : result;
}

namespace sila {
namespace {

using testing::comes_true;
using testing::Running;
using tests::ScratchFolder;

constexpr const char* kMosquitto = "/usr/sbin/mosquitto";

unsigned free_port() {
  boost::asio::io_context context;
  return boost::asio::ip::tcp::acceptor(context, {boost::asio::ip::make_address("127.0.0.1"), 0})
      .local_endpoint()
      .port();
}

bool answers(unsigned port) {
  boost::asio::io_context context;
  boost::system::error_code error;
  boost::asio::ip::tcp::socket(context).connect(
      {boost::asio::ip::make_address("127.0.0.1"), static_cast<unsigned short>(port)}, error);
  return !error;
}

class Broker {
 public:
  ~Broker() { stop(); }

  void start(const std::string& settings = "allow_anonymous true\n") {
    folder.write("mosquitto.conf",
                 "user root\nlog_dest none\nlistener " + std::to_string(port) + " 127.0.0.1\n" + settings);
    process_ = fork();
    if (process_ == 0) {
      execl(kMosquitto, kMosquitto, "-c", (folder / "mosquitto.conf").c_str(), nullptr);
      _exit(127);
    }
    ASSERT_TRUE(comes_true([this] { return answers(port); }));
  }
  void stop() {
    if (process_ <= 0) return;
    kill(process_, SIGTERM);
    waitpid(std::exchange(process_, 0), nullptr, 0);
  }
  ServerOptions options(const std::string& topic = "in") const {
    ServerOptions options;
    options.mqtt = "mqtt://127.0.0.1:" + std::to_string(port) + "/" + topic;
    options.mqtt_out = "out";
    return options;
  }

  ScratchFolder folder;
  unsigned port = free_port();

 private:
  pid_t process_ = 0;
};

/// Another client of the broker, which sends detections and keeps what is published.
class Listener {
 public:
  explicit Listener(const Broker& broker) {
    mosquitto_lib_init();
    client_ = mosquitto_new("listener", false, this);
    mosquitto_message_callback_set(client_, [](mosquitto*, void* self, const mosquitto_message* message) {
      Listener& own = *static_cast<Listener*>(self);
      const std::lock_guard lock(own.mutex_);
      own.got_.push_back(nlohmann::json::parse(
          std::string(static_cast<const char*>(message->payload), static_cast<std::size_t>(message->payloadlen))));
    });
    mosquitto_connect_callback_set(
        client_, [](mosquitto* client, void*, int) { mosquitto_subscribe(client, nullptr, "out", 1); });
    mosquitto_subscribe_callback_set(
        client_, [](mosquitto*, void* self, int, int, const int*) { ++static_cast<Listener*>(self)->subscribed; });
    mosquitto_publish_callback_set(client_,
                                   [](mosquitto*, void* self, int) { ++static_cast<Listener*>(self)->acknowledged; });
    mosquitto_connect(client_, "127.0.0.1", static_cast<int>(broker.port), 10);
    mosquitto_reconnect_delay_set(client_, 1, 1, false);
    mosquitto_loop_start(client_);
    EXPECT_TRUE(comes_true([this] { return subscribed > 0; }));
  }
  ~Listener() {
    mosquitto_disconnect(client_);
    mosquitto_loop_stop(client_, false);
    mosquitto_destroy(client_);
  }
  Listener(const Listener&) = delete;
  Listener& operator=(const Listener&) = delete;

  void send(const std::string& text, bool retain = false) {
    mosquitto_publish(client_, nullptr, "in", static_cast<int>(text.size()), text.data(), 1, retain);
  }
  /// The predictions or the reports so far.
  std::vector<nlohmann::json> got(const char* key) const {
    const std::lock_guard lock(mutex_);
    std::vector<nlohmann::json> found;
    std::ranges::copy_if(got_, std::back_inserter(found), [&](const auto& line) { return line.contains(key); });
    return found;
  }
  bool has_prediction_at(double t0_s) const {
    const auto predictions = got("modes");
    return std::ranges::any_of(predictions, [&](const auto& line) { return line["t0"] == t0_s; });
  }

  std::atomic<int> subscribed = 0;
  std::atomic<int> acknowledged = 0;  ///< messages that the broker has

 private:
  mosquitto* client_;
  mutable std::mutex mutex_;
  std::vector<nlohmann::json> got_;
};

std::string step(int k) {
  return nlohmann::json{{"t", 0.1 * k}, {"id", "17"}, {"x", 0.13 * k}, {"y", 1.0}}.dump();
}

/// Sends the steps of one walker, each when the one before it is predicted.
void walk(Listener& listener, int from, int to) {
  for (int k = from; k < to; ++k) {
    listener.send(step(k));
    ASSERT_TRUE(k < 4 || comes_true([&] { return listener.has_prediction_at(0.1 * k); })) << "step " << k;
  }
}

bool says(const Running& service, const std::string& text, std::size_t times = 1) {
  return comes_true([&] {
    const auto sentences = service.announced("mqtt: ");
    return std::ranges::count_if(sentences, [&](const auto& one) { return one.find(text) != std::string::npos; }) ==
           static_cast<std::ptrdiff_t>(times);
  });
}

/// Tests with a broker, which they start.
class Mqtt : public ::testing::Test {
 protected:
  void SetUp() override {
    if (access(kMosquitto, X_OK) != 0) GTEST_SKIP() << "there is no mosquitto (tools/setup --check installs it)";
  }
  Broker broker;
};

TEST_F(Mqtt, DetectionsOfOneTopicArePredictedToAnother) {
  broker.start();
  Listener listener(broker);
  listener.send(R"({"t": 99, "id": "old", "x": 0, "y": 0})", true);  // kept by the broker, and not sent again
  ASSERT_TRUE(comes_true([&] { return listener.acknowledged == 1; }));
  Running service({}, broker.options());
  ASSERT_TRUE(says(service, ": connected; detections from in"));
  walk(listener, 0, 10);
  listener.send(step(10) + "\n\n" + step(11) + "\r\n" + step(12) + "\n");
  ASSERT_TRUE(comes_true([&] { return listener.has_prediction_at(0.1 * 12); }));
  ASSERT_TRUE(comes_true([&] { return service.server->metrics().lines == 13; }));
  EXPECT_EQ(service.server->metrics().slow_reader_dropped, 0U);
}

TEST_F(Mqtt, ABrokerMayBeAbsentAtFirstAndRestart) {
  Running service({}, broker.options());
  ASSERT_TRUE(says(service, "not reachable (Connection refused); trying again"));
  broker.start();
  Listener listener(broker);
  ASSERT_TRUE(says(service, ": connected"));
  walk(listener, 0, 10);
  broker.stop();
  ASSERT_TRUE(says(service, "not reachable", 2));
  broker.start();
  ASSERT_TRUE(says(service, ": connected", 2));
  ASSERT_TRUE(comes_true([&] { return listener.subscribed > 1; }));
  walk(listener, 10, 20);
  EXPECT_EQ(service.server->metrics().lines, 20U) << "the track goes on";
  EXPECT_EQ(service.announced("mqtt: ").size(), 4U) << "one sentence for each change";
}

TEST_F(Mqtt, PredictionsGoOnAfterMessagesThatWaitedForAConnection) {
  broker.start();
  Listener listener(broker);
  Running service({}, broker.options());
  ASSERT_TRUE(says(service, ": connected"));
  result_of_publish = MOSQ_ERR_NO_CONN;
  walk(listener, 0, 10);
  result_of_publish = MOSQ_ERR_SUCCESS;
  walk(listener, 10, 20);
  EXPECT_EQ(service.server->metrics().slow_reader_dropped, 0U);
}

TEST_F(Mqtt, NothingIsLostWhileTheServiceRestarts) {
  broker.start();
  Listener listener(broker);
  {
    Running service({}, broker.options());
    ASSERT_TRUE(says(service, ": connected"));
    walk(listener, 0, 10);
  }
  for (int k = 10; k < 20; ++k) listener.send(step(k));
  Running service({}, broker.options());
  ASSERT_TRUE(comes_true([&] { return listener.has_prediction_at(0.1 * 19); }));
  EXPECT_EQ(service.server->metrics().lines, 10U);
}

TEST_F(Mqtt, TracksThatWaitAreLearntWhenTheServiceStops) {
  broker.start();
  Listener listener(broker);
  Running service({}, broker.options());
  ASSERT_TRUE(says(service, ": connected"));
  walk(listener, 0, 30);
  listener.send(R"({"t": 9, "id": "18", "x": 0, "y": 0})");
  listener.send(R"({"t": 9.1, "id": "19", "x": 9, "y": 0})");  // the walker has gone
  ASSERT_TRUE(comes_true([&] { return service.learner->status().waiting_tracks == 1; }));
  service.stop();
  EXPECT_EQ(service.stored, 1);
}

TEST_F(Mqtt, MessagesThatAreNoDetectionsAreCountedAndReported) {
  broker.start();
  Listener listener(broker);
  Running service({.max_line_bytes = 200}, broker.options());
  ASSERT_TRUE(says(service, ": connected"));
  for (const std::string& bad : {std::string("{"), std::string("\xff\xfe\xfd"), std::string("[1]"), std::string("{}"),
                                 std::string(R"({"after": {}})"), std::string(5000, '['), std::string("\n\n")})
    listener.send(bad);
  walk(listener, 0, 10);
  const auto total = [&] {
    std::map<std::string, int> counts;
    for (const auto& report : listener.got("rejected")) counts[report["rejected"]] += report["count"].get<int>();
    return counts;
  };
  const std::map<std::string, int> expected{{"not_json", 3}, {"not_a_detection", 2}, {"too_long", 1}};
  EXPECT_TRUE(comes_true([&] { return total() == expected; }));
  EXPECT_TRUE(says(service, R"("rejected":"not_json")"));
}

TEST_F(Mqtt, EventsOfOneFrigateCameraArePredictedInPixels) {
  broker.start();
  Listener listener(broker);
  ServerOptions options = broker.options("in");
  options.read.frigate_camera = "door";
  Running service({}, options, flat_camera(0.02));
  ASSERT_TRUE(says(service, ": connected"));
  for (int k = 0; k < 10; ++k) {
    for (const char* camera : {"yard", "door"}) {
      const nlohmann::json seen{{"id", "1700000000.5-abc"},
                                {"camera", camera},
                                {"frame_time", 1.7e9 + 0.5 * k},
                                {"label", "person"},
                                {"box", {290 + 4 * k, 400, 310 + 4 * k, 500}}};
      listener.send(nlohmann::json{{"type", "update"}, {"before", seen}, {"after", seen}}.dump());
    }
    ASSERT_TRUE(k == 0 || comes_true([&] { return listener.has_prediction_at(1.7e9 + 0.5 * k); })) << k;
  }
  EXPECT_TRUE(listener.got("modes").back()["modes"][0].contains("u"));
  EXPECT_TRUE(says(service, R"("rejected":"other_camera")"));
}

TEST_F(Mqtt, TheCertificateOfTheBrokerIsChecked) {
  const std::string key = broker.folder / "key.pem", certificate = broker.folder / "certificate.pem";
  const std::string command =
      "openssl req -x509 -newkey rsa:2048 -nodes -subj /CN=broker -addext subjectAltName=IP:127.0.0.1 -keyout " + key +
      " -out " + certificate + " 2>/dev/null";
  ASSERT_EQ(std::system(command.c_str()), 0);
  const std::string with_tls = "allow_anonymous true\ncertfile " + certificate + "\nkeyfile " + key + "\n";
  ServerOptions options = broker.options();
  options.mqtt.insert(4, "s");
  {
    Running absent({}, options);
    EXPECT_TRUE(says(absent, "not reachable (no connection); trying again"));
  }
  broker.start(with_tls);
  {
    ServerOptions without_tls = options;
    without_tls.mqtt.erase(4, 1);
    Running plain({}, without_tls);
    EXPECT_TRUE(says(plain, "not reachable"));
  }
  {
    Running unknown({}, options);
    EXPECT_TRUE(says(unknown, "certificate verify failed"));
  }
  setenv("SSL_CERT_FILE", certificate.c_str(), 1);  // as if it were one of the system
  for (const std::string& ca : {std::string(), certificate}) {
    options.mqtt_ca = ca;
    Running trusting({}, options);
    EXPECT_TRUE(says(trusting, ": connected"));
    broker.stop();
    EXPECT_TRUE(says(trusting, "not reachable"));
    broker.start(with_tls);
    EXPECT_TRUE(says(trusting, ": connected", 2)) << "the certificate of " << (ca.empty() ? "the system" : "--mqtt-ca");
  }
  unsetenv("SSL_CERT_FILE");
}

TEST_F(Mqtt, ARejectedPasswordIsSaid) {
  broker.start("allow_anonymous false\n");
  ServerOptions options = broker.options();
  options.mqtt.insert(7, "me@");
  options.mqtt_password = "secret";
  Running service({}, options);
  EXPECT_TRUE(says(service, "not reachable (Not authorized); trying again"));
}

TEST(MqttOptions, AnAddressIsABrokerAndATopic) {
  const detail::MqttAddress plain = detail::parse_mqtt_address("mqtt://broker/frigate/+/events");
  EXPECT_EQ(std::tie(plain.tls, plain.user, plain.host, plain.port, plain.topic),
            std::make_tuple(false, "", "broker", 1883, "frigate/+/events"));
  const detail::MqttAddress full = detail::parse_mqtt_address("mqtts://me@[::1]:99/a");
  EXPECT_EQ(std::tie(full.tls, full.user, full.host, full.port, full.topic),
            std::make_tuple(true, "me", "::1", 99, "a"));
  EXPECT_EQ(detail::parse_mqtt_address("mqtts://h/#").port, 8883);
  for (const char* wrong : {"", "broker", "mqtt://broker", "mqtt://broker/", "http://broker/a", "mqtt://broker:x/a",
                            "mqtt://broker:99999/a", "mqtt:///a"})
    EXPECT_THROW(detail::parse_mqtt_address(wrong), std::invalid_argument) << wrong;
}

TEST(MqttOptions, OptionsThatCannotBeUsedAreNamed) {
  const auto message = [](const std::string& address, const std::string& out, const std::string& ca = {}) {
    ServerOptions options;
    options.mqtt = address;
    options.mqtt_out = out;
    options.mqtt_ca = ca;
    return message_of([&] { Running service({}, options); });
  };
  for (const auto& [address, out, option] :
       {std::tuple{"mqtt://b/a/#/b", "c", "--mqtt = a/#/b"}, std::tuple{"mqtt://b/a", "", "--mqtt needs --mqtt-out"},
        std::tuple{"mqtt://b/a", "b/#", "--mqtt-out = b/#"}, std::tuple{"mqtt://b/a/#", "a/out", "--mqtt-out = a/out"}})
    EXPECT_TRUE(sila::says(message(address, out), option));
  EXPECT_TRUE(sila::says(message("mqtts://b/a", "c", "none.pem"), "--mqtt-ca = none.pem"));
}

}  // namespace
}  // namespace sila
