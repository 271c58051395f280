#pragma once

#include <atomic>
#include <condition_variable>
#include <functional>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <thread>

#include "connection.hpp"

namespace sila::detail {

/// Lines from standard input, predictions to standard output. It has threads of its own, since files and terminals
/// cannot be read asynchronously.
class StandardIo : public Connection, public std::enable_shared_from_this<StandardIo> {
 public:
  /// With `options.wait` the next time stamp is read when the last one is answered and written. `ended` is called at
  /// the end of the input, when everything is written.
  StandardIo(ConnectionRegistry& registry, std::function<void()> ended);
  ~StandardIo() override;

  void start();
  void send(std::string line, bool droppable) override;
  void close() override;
  /// Returns when no more input is read, soon after `close`.
  void join_reader();
  /// Why input could not be read or predictions could not be written; empty if all could.
  std::string failure();

 private:
  void read();
  void read_lines();
  std::optional<std::size_t> read_some(std::string& block);
  void write();
  bool write_all(std::string_view text);
  void fail(const std::string& what);
  void drain();

  std::function<void()> ended_;
  LineBuffer lines_;
  std::mutex mutex_;  // guards the queue, the flags of writing and the failure
  std::condition_variable changed_;
  bool writing_ = false, closing_ = false;
  std::string failure_;
  std::atomic<bool> stopping_ = false;
  std::thread reader_, writer_;
};

}  // namespace sila::detail
