#include "standard_io.hpp"

#include <poll.h>
#include <unistd.h>

#include <boost/asio/post.hpp>
#include <chrono>
#include <future>
#include <optional>
#include <string_view>
#include <utility>

namespace sila::detail {
namespace {

constexpr std::size_t kBlock = 1 << 16;
/// Interval at which a waiting thread checks whether the service stops.
constexpr int kCheck_ms = 100;

/// Reads input if some comes soon: the number of bytes, 0 at the end, negative if there is none yet.
ssize_t read_some(char* data, std::size_t size) {
  pollfd input{STDIN_FILENO, POLLIN, 0};
  if (poll(&input, 1, kCheck_ms) <= 0) return -1;
  return ::read(STDIN_FILENO, data, size);
}

bool write_all(std::string_view text) {
  while (!text.empty()) {
    const ssize_t written = ::write(STDOUT_FILENO, text.data(), text.size());
    if (written <= 0) return false;
    text.remove_prefix(static_cast<std::size_t>(written));
  }
  return true;
}

}  // namespace

StandardIo::StandardIo(ConnectionRegistry& registry, std::function<void()> ended)
    : registry_(registry),
      id_(registry.next_id++),
      ended_(std::move(ended)),
      lines_(static_cast<std::size_t>(registry.config.max_line_bytes) + 1),
      queue_(registry.max_send_bytes()) {}

StandardIo::~StandardIo() {
  close();
  join_reader();
  if (writer_.joinable()) writer_.join();
}

void StandardIo::start() {
  registry_.streams[id_] = weak_from_this();
  reader_ = std::thread([this] { read(); });
  writer_ = std::thread([this] { write(); });
}

void StandardIo::send(std::string line, bool droppable) {
  {
    const std::lock_guard lock(mutex_);
    if (!droppable) announcer_.announce(registry_, line, "standard input", "standard output");
    registry_.slow_reader_dropped += queue_.push(std::move(line), droppable);
  }
  changed_.notify_all();
}

void StandardIo::close() {
  stopping_ = true;
  {
    const std::lock_guard lock(mutex_);
    closing_ = true;
  }
  changed_.notify_all();
}

void StandardIo::join_reader() {
  if (reader_.joinable()) reader_.join();
}

/// Returns when everything read so far is answered and the answers are written.
void StandardIo::drain() {
  registry_.engine->drain();
  const auto sent = std::make_shared<std::promise<void>>();  // behind the answers that the engine has posted
  boost::asio::post(registry_.context, [sent] { sent->set_value(); });
  const std::future<void> done = sent->get_future();
  while (!stopping_ && done.wait_for(std::chrono::milliseconds(kCheck_ms)) != std::future_status::ready) continue;
  std::unique_lock lock(mutex_);
  changed_.wait(lock, [this] { return closing_ || (queue_.empty() && !writing_); });
}

void StandardIo::read() {
  read_lines();
  if (stopping_) return;
  drain();  // the end of the stream may have made something due
  ended_();
}

void StandardIo::read_lines() {
  std::optional<double> last_s;
  LineReceiver receiver(registry_, id_, [&](double t_s) {
    if (registry_.options.wait && last_s && t_s != *last_s) drain();
    last_s = t_s;
  });
  std::string block(kBlock, '\0');
  while (!stopping_) {
    const ssize_t size = read_some(block.data(), block.size());
    if (size == 0) break;
    if (size < 0) continue;
    lines_.append(std::string_view(block).substr(0, static_cast<std::size_t>(size)));
    while (const auto line = stopping_ ? std::nullopt : lines_.next()) receiver.receive(*line);
  }
  if (stopping_) return;
  if (const auto line = lines_.last()) receiver.receive(*line);
  drain();
}

void StandardIo::write() {
  std::unique_lock lock(mutex_);
  while (true) {
    changed_.wait(lock, [this] { return closing_ || !queue_.empty(); });
    if (queue_.empty()) return;
    const std::string text = queue_.next_block(kBlock);
    writing_ = true;
    lock.unlock();
    const bool written = write_all(text);
    lock.lock();
    writing_ = false;
    if (!written) {  // the output is closed
      queue_ = SendQueue(registry_.max_send_bytes());
      closing_ = true;
    }
    changed_.notify_all();
  }
}

}  // namespace sila::detail
