#include "standard_io.hpp"

#include <poll.h>
#include <unistd.h>

#include <boost/asio/post.hpp>
#include <chrono>
#include <future>
#include <optional>
#include <utility>

namespace sila::detail {
namespace {

constexpr std::size_t kBlock = 1 << 16;
constexpr int kLook_ms = 100;

/// Waits for input, but looks up now and then; the bytes read, 0 at the end, negative if there is nothing yet.
ssize_t read_some(char* data, std::size_t size) {
  pollfd input{STDIN_FILENO, POLLIN, 0};
  if (poll(&input, 1, kLook_ms) <= 0) return -1;
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

StandardIo::StandardIo(Hub& hub, bool wait, std::function<void()> ended)
    : hub_(hub), stream_(hub.next++), wait_(wait), ended_(std::move(ended)) {}

StandardIo::~StandardIo() {
  close();
  if (reader_.joinable()) reader_.join();
  if (writer_.joinable()) writer_.join();
}

void StandardIo::start() {
  hub_.connections[stream_] = weak_from_this();
  if (wait_) hub_.engine->go_step_by_step();
  reader_ = std::thread([this] { read(); });
  writer_ = std::thread([this] { write(); });
}

void StandardIo::send(std::string line, bool droppable) {
  {
    const std::lock_guard lock(mutex_);
    hub_.dropped += push(outbox_, std::move(line), droppable, hub_.most_bytes());
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

/// Returns when everything read so far is answered, and the answers are written; if it waits, also when it is learnt.
void StandardIo::let_through() {
  if (wait_)
    hub_.engine->settle();
  else
    hub_.engine->drain();
  const auto sent = std::make_shared<std::promise<void>>();  // behind the answers that the engine has posted
  boost::asio::post(hub_.context, [sent] { sent->set_value(); });
  const std::future<void> seen = sent->get_future();
  while (!stopping_ && seen.wait_for(std::chrono::milliseconds(kLook_ms)) != std::future_status::ready) continue;
  std::unique_lock lock(mutex_);
  changed_.wait(lock, [this] { return closing_ || (outbox_.lines.empty() && !writing_); });
}

void StandardIo::read() {
  {
    Intake intake(hub_, stream_);
    std::string buffer(kBlock, '\0'), rest;
    std::optional<double> now_s;
    const auto most = static_cast<std::size_t>(hub_.config.max_line_bytes);
    bool skipping = false;
    while (!stopping_) {
      const ssize_t count = read_some(buffer.data(), buffer.size());
      if (count < 0) continue;
      if (count == 0) break;
      rest.append(buffer, 0, static_cast<std::size_t>(count));
      std::size_t begin = 0;
      for (std::size_t end = 0; !stopping_ && (end = rest.find('\n', begin)) != std::string::npos; begin = end + 1) {
        if (std::exchange(skipping, false)) continue;
        const auto t_s = intake.line(std::string_view(rest).substr(begin, end - begin));
        if (wait_ && t_s && t_s != std::exchange(now_s, t_s)) let_through();
      }
      rest.erase(0, begin);
      if (rest.size() <= most) continue;
      if (!std::exchange(skipping, true)) intake.refuse(Refusal::too_long);
      rest.clear();
    }
    if (!stopping_ && !rest.empty() && !skipping) intake.line(rest);
    if (!stopping_) let_through();
  }
  if (stopping_) return;
  let_through();  // what the end of the stream made of it
  ended_();
}

void StandardIo::write() {
  std::unique_lock lock(mutex_);
  while (true) {
    changed_.wait(lock, [this] { return closing_ || !outbox_.lines.empty(); });
    if (outbox_.lines.empty()) return;
    std::string text;
    for (std::string& line : take(outbox_, kBlock)) text += std::move(line) + '\n';
    writing_ = true;
    lock.unlock();
    const bool written = write_all(text);
    lock.lock();
    writing_ = false;
    if (!written) outbox_ = {}, closing_ = true;  // nobody reads any more
    changed_.notify_all();
  }
}

}  // namespace sila::detail
