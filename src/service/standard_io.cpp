#include "standard_io.hpp"

#include <poll.h>
#include <unistd.h>

#include <boost/asio/post.hpp>
#include <cerrno>
#include <chrono>
#include <future>
#include <system_error>
#include <utility>

namespace sila::detail {
namespace {

constexpr std::size_t kBlock = 1 << 16;
/// Interval at which a waiting thread checks whether the service stops.
constexpr int kCheck_ms = 100;

}  // namespace

StandardIo::StandardIo(ConnectionRegistry& registry, std::function<void()> ended)
    : Connection(registry, registry.max_send_bytes()),
      ended_(std::move(ended)),
      lines_(static_cast<std::size_t>(registry.config.max_line_bytes) + 1) {}

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
  const std::lock_guard lock(mutex_);
  if (!droppable) announce_first(line, "standard input", "standard output");
  registry_.slow_reader_dropped += queue_.push(std::move(line), droppable);
  changed_.notify_all();
}

void StandardIo::close() {
  stopping_ = true;
  const std::lock_guard lock(mutex_);
  closing_ = true;
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

/// Reads input if some comes soon: the number of bytes, 0 at the end or after an error, none if there is none yet.
std::optional<std::size_t> StandardIo::read_some(std::string& block) {
  pollfd input{STDIN_FILENO, POLLIN, 0};
  const int ready = poll(&input, 1, kCheck_ms);
  if (ready == 0) return std::nullopt;
  const ssize_t size = ready < 0 ? ready : ::read(STDIN_FILENO, block.data(), block.size());
  if (size >= 0) return static_cast<std::size_t>(size);
  if (errno == EINTR || errno == EAGAIN) return std::nullopt;
  fail("standard input cannot be read");
  return 0;
}

void StandardIo::read_lines() {
  std::optional<double> last_s;
  LineReceiver receiver(registry_, id_, [&](double t_s) {
    if (registry_.options.wait && last_s && t_s != *last_s) drain();
    last_s = t_s;
  });
  std::string block(kBlock, '\0');
  while (!stopping_) {
    const std::optional<std::size_t> size = read_some(block);
    if (!size) continue;
    if (*size == 0) break;
    lines_.append(std::string_view(block).substr(0, *size));
    while (const auto line = stopping_ ? std::nullopt : lines_.next()) receiver.receive(*line);
  }
  if (stopping_) return;
  if (const auto line = lines_.last()) receiver.receive(*line);
  drain();
}

/// False if the output is closed or cannot be written, or if a pipe stays full while the service stops.
bool StandardIo::write_all(std::string_view text) {
  while (!text.empty()) {
    const ssize_t written = ::write(STDOUT_FILENO, text.data(), text.size());
    if (written >= 0) {
      text.remove_prefix(static_cast<std::size_t>(written));
    } else if (errno == EAGAIN) {
      pollfd output{STDOUT_FILENO, POLLOUT, 0};
      if (poll(&output, 1, kCheck_ms) == 0 && stopping_) return false;
    } else if (errno != EINTR) {
      if (errno != EPIPE) fail("standard output cannot be written");
      return false;
    }
  }
  return true;
}

/// Announces the present error of the system, and keeps it for the end of the service.
void StandardIo::fail(const std::string& what) {
  const std::string why = what + ": " + std::generic_category().message(errno);
  registry_.announce(why);
  const std::lock_guard lock(mutex_);
  if (failure_.empty()) failure_ = why;
}

std::string StandardIo::failure() {
  const std::lock_guard lock(mutex_);
  return failure_;
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
    if (!written) {
      queue_ = SendQueue(registry_.max_send_bytes());
      closing_ = true;
    }
    changed_.notify_all();
  }
}

}  // namespace sila::detail
