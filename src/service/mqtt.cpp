#include "mqtt.hpp"

#include <mosquitto.h>
#include <mqtt_protocol.h>
#include <poll.h>
#include <sys/socket.h>

#include <algorithm>
#include <chrono>
#include <regex>
#include <stdexcept>
#include <utility>

namespace sila::detail {
namespace {

constexpr int kKeepAlive_s = 30;
/// Time for which the broker keeps the messages of a lost connection.
constexpr unsigned kSession_s = 600;
constexpr int kFirstDelay_s = 1, kLongestDelay_s = 30;
/// Time to send the last predictions at the end.
constexpr double kFlush_s = 2.0;
/// Interval at which the client checks whether the service stops [ms].
constexpr int kStopCheck_ms = 100;
/// Predictions that the broker may have to acknowledge at once; further ones wait in the queue, which has a limit.
constexpr std::size_t kMaxUnacknowledged = 1000;
/// Reasons of MQTT from here on are failures.
constexpr int kFailure = 128;

std::invalid_argument invalid(const std::string& option, const std::string& value, const std::string& rule) {
  return std::invalid_argument("serve: " + option + " = " + value + " " + rule);
}

void require(int result, const std::string& option, const std::string& value, const std::string& rule) {
  if (result != MOSQ_ERR_SUCCESS) throw invalid(option, value, rule);
}

void require_topics(const std::string& topic, const std::string& out) {
  require(mosquitto_sub_topic_check(topic.c_str()), "--mqtt", topic, "is not a topic, such as frigate/events");
  if (out.empty())
    throw std::invalid_argument("serve: --mqtt needs --mqtt-out, a topic for predictions such as sila/door");
  require(mosquitto_pub_topic_check(out.c_str()), "--mqtt-out", out,
          "is not a topic for predictions, such as sila/door, without wildcards");
  bool matches = false;
  mosquitto_topic_matches_sub(topic.c_str(), out.c_str(), &matches);
  if (matches) throw invalid("--mqtt-out", out, "would be read again as detections: it is in the topic of --mqtt");
}

/// The asynchronous form of `connect` takes no properties and uses those of the call before it, here of one that fails
/// for its port.
void keep_session(mosquitto* client) {
  mosquitto_property* properties = nullptr;
  mosquitto_property_add_int32(&properties, MQTT_PROP_SESSION_EXPIRY_INTERVAL, kSession_s);
  mosquitto_connect_bind_v5(client, "localhost", -1, kKeepAlive_s, nullptr, properties);
  mosquitto_property_free_all(&properties);
}

/// Waits until the connection is made, or failed, and returns why; empty if it is made. With TLS mosquitto_loop does
/// not notice that it failed.
std::string connection_error(mosquitto* client, const std::atomic<bool>& stopping) {
  pollfd connecting{mosquitto_socket(client), POLLOUT, 0};
  const double until_s = monotonic_s() + kKeepAlive_s;
  while (!stopping && poll(&connecting, 1, kStopCheck_ms) == 0) {
    if (connecting.fd < 0 || monotonic_s() > until_s) return "no answer";
  }
  int error = 0;
  socklen_t size = sizeof error;
  getsockopt(connecting.fd, SOL_SOCKET, SO_ERROR, &error, &size);
  if (error != 0) return std::generic_category().message(error);
  return (connecting.revents & POLLHUP) != 0 ? "no connection" : "";  // mosquitto took the error
}

}  // namespace

MqttAddress parse_mqtt_address(const std::string& text) {
  static const std::regex form(R"((mqtts?)://(?:([^@/]*)@)?(\[[^\]/]+\]|[^:/\[\]]+)(?::(\d{1,5}))?/(.+))");
  std::smatch parts;
  const bool matches = std::regex_match(text, parts, form);
  const int port = matches && parts[4].matched ? std::stoi(parts[4]) : 0;
  if (!matches || port > 65535)
    throw invalid("--mqtt", text, "is not mqtt[s]://[USER@]HOST[:PORT]/TOPIC, as in mqtt://localhost/frigate/events");
  const bool tls = parts[1] == "mqtts";
  std::string host = parts[3];
  if (host.front() == '[') host = host.substr(1, host.size() - 2);
  return {tls, parts[2], host, port != 0 ? port : tls ? 8883 : 1883, parts[5]};
}

MqttConnection::MqttConnection(ConnectionRegistry& registry)
    : Connection(registry, registry.max_send_bytes()),
      address_(parse_mqtt_address(registry.options.mqtt)),
      client_(nullptr, mosquitto_destroy) {
  const ServerOptions& options = registry.options;
  require_topics(address_.topic, options.mqtt_out);
  static const int initialised = mosquitto_lib_init();
  // The name is the same after a restart, for which the broker keeps the messages.
  client_.reset(mosquitto_new(("sila:" + options.mqtt_out).c_str(), false, this));
  if (initialised != MOSQ_ERR_SUCCESS || !client_) throw std::runtime_error("serve: --mqtt: no memory for the client");
  mosquitto_int_option(client_.get(), MOSQ_OPT_PROTOCOL_VERSION, MQTT_PROTOCOL_V5);
  mosquitto_threaded_set(client_.get(), true);
  if (!address_.user.empty())
    mosquitto_username_pw_set(client_.get(), address_.user.c_str(), options.mqtt_password.c_str());
  if (address_.tls && options.mqtt_ca.empty()) {
    mosquitto_int_option(client_.get(), MOSQ_OPT_TLS_USE_OS_CERTS, 1);
    // With defaults libmosquitto rejects, at a reconnection, the TLS context that it made itself.
    mosquitto_int_option(client_.get(), MOSQ_OPT_SSL_CTX_WITH_DEFAULTS, 0);
  }
  if (address_.tls && !options.mqtt_ca.empty())
    require(mosquitto_tls_set(client_.get(), options.mqtt_ca.c_str(), nullptr, nullptr, nullptr, nullptr), "--mqtt-ca",
            options.mqtt_ca, "cannot be read");
  keep_session(client_.get());
  set_callbacks();
}

MqttConnection::~MqttConnection() {
  close();
  if (thread_.joinable()) thread_.join();
}

void MqttConnection::set_callbacks() {
  using Self = MqttConnection;
  mosquitto* const client = client_.get();
  mosquitto_connect_callback_set(
      client, [](mosquitto*, void* self, int reason) { static_cast<Self*>(self)->connected(reason); });
  mosquitto_disconnect_callback_set(client, [](mosquitto*, void* self, int reason) {
    if (reason >= kFailure) static_cast<Self*>(self)->error_ = mosquitto_reason_string(reason);
  });
  mosquitto_log_callback_set(client, [](mosquitto*, void* self, int level, const char* text) {
    if (level == MOSQ_LOG_ERR) static_cast<Self*>(self)->error_ = text;
  });
  mosquitto_subscribe_callback_set(client, [](mosquitto*, void* self, int, int, const int* reason) {
    Self& own = *static_cast<Self*>(self);
    const std::string& topic = own.address_.topic;
    own.announce_change(*reason < kFailure ? "connected; detections from " + topic
                                           : "the subscription to " + topic + " is rejected (" +
                                                 mosquitto_reason_string(*reason) + ")");
  });
  mosquitto_message_callback_set(client, [](mosquitto*, void* self, const mosquitto_message* message) {
    static_cast<Self*>(self)->receive(
        {static_cast<const char*>(message->payload), static_cast<std::size_t>(message->payloadlen)});
  });
  mosquitto_publish_v5_callback_set(client, [](mosquitto*, void* self, int, int reason, const mosquitto_property*) {
    static_cast<Self*>(self)->acknowledged(reason);
  });
}

void MqttConnection::start() {
  registry_.streams[id_] = weak_from_this();
  thread_ = std::thread([this] { run(); });
}

void MqttConnection::send(std::string line, bool droppable) {
  const std::lock_guard lock(mutex_);
  if (!droppable) announce_first(line, "mqtt", "the topic of --mqtt-out");
  registry_.slow_reader_dropped += queue_.push(std::move(line), droppable);
  publish();
}

void MqttConnection::close() {
  const std::lock_guard lock(mutex_);
  stopping_ = true;
  changed_.notify_all();
}

void MqttConnection::run() {
  LineReceiver receiver(registry_, id_);
  receiver_ = &receiver;
  mosquitto* const client = client_.get();
  int result = mosquitto_connect_bind_async(client, address_.host.c_str(), address_.port, kKeepAlive_s, nullptr);
  for (int delay_s = kFirstDelay_s; !stopping_; delay_s = std::min(2 * delay_s, kLongestDelay_s)) {
    const double began_s = monotonic_s();
    stay_connected(result);
    if (monotonic_s() - began_s > kLongestDelay_s) delay_s = kFirstDelay_s;
    wait_s(delay_s);
    error_.clear();
    if (!stopping_) result = mosquitto_reconnect_async(client);
  }
  flush();
}

/// Returns when the connection is lost or cannot be made, or the service stops. `result`: of the attempt to connect.
void MqttConnection::stay_connected(int result) {
  const std::string failed = result == MOSQ_ERR_SUCCESS ? connection_error(client_.get(), stopping_) : "";
  if (!failed.empty()) error_ = failed;
  while (failed.empty() && result == MOSQ_ERR_SUCCESS && !stopping_)
    result = mosquitto_loop(client_.get(), kStopCheck_ms, 1);
  if (error_.empty()) error_ = mosquitto_strerror(result);
  if (error_.ends_with('.')) error_.pop_back();
  if (!stopping_) announce_change("not reachable (" + error_ + "); trying again");
  const std::lock_guard lock(mutex_);
  if (!stopping_) connected_ = false;
}

void MqttConnection::wait_s(int seconds) {
  std::unique_lock lock(mutex_);
  changed_.wait_for(lock, std::chrono::seconds(seconds), [this] { return stopping_.load(); });
}

/// Sends the last predictions and disconnects, so that the broker keeps later messages.
void MqttConnection::flush() {
  const double until_s = monotonic_s() + kFlush_s;
  const auto waiting = [this] {
    const std::lock_guard lock(mutex_);
    return connected_ && unacknowledged_ > 0;
  };
  int result = MOSQ_ERR_SUCCESS;
  while (result == MOSQ_ERR_SUCCESS && waiting() && monotonic_s() < until_s)
    result = mosquitto_loop(client_.get(), kStopCheck_ms, 1);
  if (mosquitto_disconnect(client_.get()) == MOSQ_ERR_SUCCESS) mosquitto_loop(client_.get(), kStopCheck_ms, 1);
}

void MqttConnection::connected(int reason) {
  if (reason != 0) {
    error_ = mosquitto_reason_string(reason);
    return;
  }
  mosquitto_subscribe_v5(client_.get(), nullptr, address_.topic.c_str(), 1, MQTT_SUB_OPT_SEND_RETAIN_NEVER, nullptr);
  const std::lock_guard lock(mutex_);
  connected_ = true;
  publish();
}

void MqttConnection::receive(std::string_view payload) {
  while (!payload.empty()) {
    const std::size_t end = std::min(payload.find('\n'), payload.size());
    receiver_->receive(payload.substr(0, end));
    payload.remove_prefix(std::min(end + 1, payload.size()));
  }
}

void MqttConnection::acknowledged(int reason) {
  const std::lock_guard lock(mutex_);
  if (unacknowledged_ > 0) --unacknowledged_;
  if (reason >= kFailure) {
    ++registry_.slow_reader_dropped;
    if (!std::exchange(reported_rejection_, true))
      registry_.announce("mqtt: the broker rejects messages to " + registry_.options.mqtt_out + " (" +
                         mosquitto_reason_string(reason) + ")");
  }
  publish();
}

void MqttConnection::publish() {
  const std::string& topic = registry_.options.mqtt_out;
  while (connected_ && unacknowledged_ < kMaxUnacknowledged) {
    const std::optional<std::string> line = queue_.next();
    if (!line) return;
    const int result = mosquitto_publish(client_.get(), nullptr, topic.c_str(), static_cast<int>(line->size()),
                                         line->data(), 1, false);
    if (result == MOSQ_ERR_SUCCESS || result == MOSQ_ERR_NO_CONN)  // which is sent after the next connection
      ++unacknowledged_;
    else
      ++registry_.slow_reader_dropped;
  }
}

void MqttConnection::announce_change(const std::string& sentence) {
  if (sentence != std::exchange(announced_, sentence))
    registry_.announce("mqtt: broker " + address_.host + ":" + std::to_string(address_.port) + ": " + sentence);
}

}  // namespace sila::detail
