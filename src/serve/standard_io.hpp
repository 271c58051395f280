#pragma once

#include <condition_variable>
#include <functional>
#include <mutex>
#include <thread>

#include "hub.hpp"
#include "outbox.hpp"

namespace sila::detail {

/// Lines from standard input, predictions to standard output. Threads of its own: files and terminals know no
/// asynchronous reading.
class StandardIo : public Connection, public std::enable_shared_from_this<StandardIo> {
 public:
  /// `wait`: the next time stamp is read when the last one is answered and written. `ended` is called at the end of the
  /// input, when all is written.
  StandardIo(Hub& hub, bool wait, std::function<void()> ended);
  ~StandardIo() override;

  void start();
  void send(std::string line, bool droppable) override;
  void close() override;

 private:
  void read();
  void write();
  void let_through();

  Hub& hub_;
  StreamId stream_;
  bool wait_;
  std::function<void()> ended_;
  std::mutex mutex_;
  std::condition_variable changed_;
  Outbox outbox_;
  bool writing_ = false, closing_ = false;
  std::atomic<bool> stopping_ = false;
  std::thread reader_, writer_;
};

}  // namespace sila::detail
