#pragma once

// A service that runs during a test.

#include <atomic>
#include <mutex>
#include <optional>
#include <string>
#include <thread>
#include <vector>

#include "service/streams.hpp"
#include "sila/service/server.hpp"

namespace sila::testing {

class Running {
 public:
  explicit Running(const ServiceConfig& config = {}, ServerOptions options = {}, std::optional<Camera> camera = {}) {
    options.http = options.tcp = "127.0.0.1:0";
    ServiceSettings settings = service_settings();
    settings.service = config;
    settings.camera = camera;
    const SidewalkWidths widths{2.5, 2.5, 2.5};
    scene.corners.push_back({"corner", square_frame(), widths});
    learner.emplace(
        Model{}, OnlineCalibration{}, settings.episode, config,
        LearnerThread::Storage{[this](const Model&, const Episode&, const OnlineCalibration&) { ++stored; }, {}, {}});
    server.emplace(options, scene, settings, *learner, [this](const std::string& sentence) {
      const std::lock_guard lock(mutex_);
      announced_.push_back(sentence);
    });
    thread = std::thread([this] { server->run(); });
  }
  ~Running() {
    stop();
    server.reset();
  }
  Running(const Running&) = delete;
  Running& operator=(const Running&) = delete;

  void stop() {
    server->stop();
    if (thread.joinable()) thread.join();
  }

  /// The announcements that begin with `subject`.
  std::vector<std::string> announced(const std::string& subject) const {
    const std::lock_guard lock(mutex_);
    std::vector<std::string> found;
    for (const std::string& sentence : announced_) {
      if (sentence.starts_with(subject)) found.push_back(sentence);
    }
    return found;
  }

 private:
  mutable std::mutex mutex_;
  std::vector<std::string> announced_;

 public:
  Scene scene;
  std::atomic<int> stored = 0;
  std::optional<LearnerThread> learner;
  std::optional<Server> server;
  std::thread thread;
};

}  // namespace sila::testing
