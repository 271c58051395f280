#pragma once

#include <atomic>
#include <condition_variable>
#include <memory>
#include <mutex>
#include <string>
#include <thread>

#include "connection.hpp"

struct mosquitto;

namespace sila::detail {

struct MqttAddress {
  bool tls = false;
  std::string user, host;
  int port = 0;
  std::string topic;
};

/// `mqtt[s]://[USER@]HOST[:PORT]/TOPIC`, where TOPIC may have wildcards. Throws: std::invalid_argument.
MqttAddress parse_mqtt_address(const std::string& text);

/// Lines from a topic of an MQTT broker, predictions and reports to another; one stream, which an interrupted
/// connection does not end. The client of the broker runs in a thread of its own. Messages are sent with QoS 1.
class MqttConnection : public Connection, public std::enable_shared_from_this<MqttConnection> {
 public:
  /// Throws: std::invalid_argument for options that cannot be used, naming the option.
  explicit MqttConnection(ConnectionRegistry& registry);
  ~MqttConnection() override;

  void start();
  void send(std::string line, bool droppable) override;
  void close() override;

 private:
  void set_callbacks();
  void run();
  void stay_connected(int result);
  void wait_s(int seconds);
  void flush();
  void connected(int reason);
  void receive(std::string_view payload);
  void acknowledged(int reason);
  void publish();  // mutex_ is held
  void announce_change(const std::string& sentence);

  MqttAddress address_;
  std::unique_ptr<mosquitto, void (*)(mosquitto*)> client_;
  // Used by the thread of the client alone.
  LineReceiver* receiver_ = nullptr;
  std::string announced_;  ///< the last sentence for people
  std::string error_;      ///< the client's description of the present failure
  std::mutex mutex_;       // guards the queue and all below
  std::condition_variable changed_;
  std::size_t unacknowledged_ = 0;
  bool connected_ = false;
  bool reported_rejection_ = false;  ///< that it rejects messages
  std::atomic<bool> stopping_ = false;
  std::thread thread_;
};

}  // namespace sila::detail
