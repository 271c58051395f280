#pragma once

#include <boost/asio/buffer.hpp>
#include <boost/asio/read_until.hpp>
#include <boost/asio/steady_timer.hpp>
#include <boost/asio/write.hpp>
#include <optional>
#include <utility>

#include "hub.hpp"
#include "outbox.hpp"

namespace sila::detail {

/// Lines over a stream socket, TCP or Unix, both ways.
template <class Socket>
class LineSession : public Connection, public std::enable_shared_from_this<LineSession<Socket>> {
 public:
  LineSession(Hub& hub, Socket socket) : hub_(hub), seat_(hub), socket_(std::move(socket)), patience_(hub.context) {}
  ~LineSession() override {
    if (intake_) hub_.connections.erase(intake_->stream());
  }

  void start() {
    if (hub_.token.empty())
      admit();
    else
      expect_token();
    read();
  }
  void send(std::string line, bool droppable) override {
    hub_.dropped += push(outbox_, std::move(line), droppable, hub_.most_bytes());
    if (writing_.empty()) write();
  }
  void close() override {
    boost::system::error_code ignored;
    socket_.close(ignored);
  }

 private:
  void admit() {
    intake_.emplace(hub_, hub_.next++);
    hub_.connections[intake_->stream()] = this->weak_from_this();
  }

  /// Who shows no token takes a place from who has one, but not for long.
  void expect_token() {
    patience_.expires_after(hub_.token_patience);
    patience_.async_wait([weak = this->weak_from_this()](const boost::system::error_code& error) {
      const auto self = weak.lock();
      if (!error && self && !self->intake_) self->turn_away();
    });
  }

  void turn_away() {
    if (std::exchange(refused_, true)) return close();
    ++hub_.refused_tokens;
    closing_ = true;
    send(refusal_line(Refusal::no_token, 1), false);
  }

  void read() {
    const auto most = static_cast<std::size_t>(hub_.config.max_line_bytes) + 2;
    boost::asio::async_read_until(socket_, boost::asio::dynamic_buffer(buffer_, most), '\n',
                                  [self = this->shared_from_this()](const boost::system::error_code& error,
                                                                    std::size_t) { self->have_read(error); });
  }

  void have_read(const boost::system::error_code& error) {
    if (error == boost::asio::error::not_found) {  // no line ends within its limit: forget it until it does
      if (!std::exchange(skipping_, true) && intake_) intake_->refuse(Refusal::too_long);
      buffer_.clear();
      return read();
    }
    take_lines();
    if (!error && socket_.is_open()) return read();
    if (!buffer_.empty() && !skipping_) line(buffer_);  // the last line need not end
  }

  void take_lines() {
    std::size_t begin = 0;
    for (std::size_t end = 0; (end = buffer_.find('\n', begin)) != std::string::npos; begin = end + 1) {
      if (!std::exchange(skipping_, false)) line(std::string_view(buffer_).substr(begin, end - begin));
    }
    buffer_.erase(0, begin);
  }

  void line(std::string_view text) {
    if (intake_) {
      intake_->line(text);
      return;
    }
    if (const auto token = parse_token(text); token && same_token(*token, hub_.token)) return admit();
    if (!refused_) turn_away();
  }

  void write() {
    for (std::string& line : take(outbox_, 1 << 16)) writing_ += std::move(line) + '\n';
    if (writing_.empty()) {
      if (closing_) close();
      return;
    }
    boost::asio::async_write(socket_, boost::asio::buffer(writing_),
                             [self = this->shared_from_this()](const boost::system::error_code& error, std::size_t) {
                               self->writing_.clear();
                               if (error) return self->close();
                               self->write();
                             });
  }

  Hub& hub_;
  Seat seat_;
  Socket socket_;
  boost::asio::steady_timer patience_;
  std::string buffer_, writing_;
  Outbox outbox_;
  std::optional<Intake> intake_;
  bool skipping_ = false, refused_ = false, closing_ = false;
};

}  // namespace sila::detail
