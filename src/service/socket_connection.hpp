#pragma once

#include <array>
#include <boost/asio/buffer.hpp>
#include <boost/asio/steady_timer.hpp>
#include <boost/asio/write.hpp>
#include <optional>
#include <utility>

#include "connection.hpp"

namespace sila::detail {

/// Lines over a stream socket, TCP or Unix, both ways.
template <class Socket>
class SocketConnection : public Connection, public std::enable_shared_from_this<SocketConnection<Socket>> {
 public:
  SocketConnection(ConnectionRegistry& registry, Socket socket)
      : Connection(registry, registry.max_send_bytes()),
        open_(registry),
        socket_(std::move(socket)),
        timer_(registry.context),
        // Room for a carriage return, which does not count.
        lines_(static_cast<std::size_t>(registry.config.max_line_bytes) + 1) {}
  ~SocketConnection() override { registry_.streams.erase(id_); }

  void start() {
    if (registry_.options.token.empty())
      admit();
    else
      expect_token();
    read();
  }
  void send(std::string line, bool droppable) override {
    registry_.slow_reader_dropped += queue_.push(std::move(line), droppable);
    if (writing_.empty()) write();
  }
  void close() override {
    timer_.cancel();
    boost::system::error_code ignored;
    socket_.close(ignored);
  }
  void finish() override {
    closing_ = true;
    if (writing_.empty()) write();
  }

 private:
  static constexpr std::size_t kBlock = 1 << 16;

  void admit() {
    receiver_.emplace(registry_, id_);
    registry_.streams[id_] = this->weak_from_this();
  }

  /// A connection without a token must not occupy a place for long.
  void expect_token() {
    timer_.expires_after(registry_.options.token_timeout);
    timer_.async_wait([weak = this->weak_from_this()](const boost::system::error_code& error) {
      const auto self = weak.lock();
      if (error || !self || self->receiver_) return;
      if (self->closing_) return self->close();
      self->reject_token();
    });
  }

  void reject_token() {
    registry_.engine->reject(0, Rejection::no_token);
    closing_ = true;
    send(rejection_line(Rejection::no_token, 1), false);
  }

  void read() {
    socket_.async_read_some(boost::asio::buffer(block_), [self = this->shared_from_this()](
                                                             const boost::system::error_code& error, std::size_t size) {
      self->lines_.append({self->block_.data(), size});
      while (const auto line = self->lines_.next()) self->take(*line);
      if (!error && self->socket_.is_open()) return self->read();
      if (const auto line = self->lines_.last()) self->take(*line);
      if (error == boost::asio::error::eof && self->receiver_) self->wait_for_answers();
    });
  }

  /// The client has sent its last line and may still read: the timer, which never ends, holds the connection until
  /// `finish` or `close`.
  void wait_for_answers() {
    receiver_.reset();
    timer_.expires_at(boost::asio::steady_timer::time_point::max());
    timer_.async_wait([self = this->shared_from_this()](const boost::system::error_code&) {});
  }

  void take(std::string_view line) {
    if (receiver_) {
      receiver_->receive(line);
    } else if (!closing_) {
      const std::optional<std::string> token = parse_token(line);
      if (token && same_token(*token, registry_.options.token))
        admit();
      else
        reject_token();
    }
  }

  void write() {
    writing_ = queue_.next_block(kBlock);
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

  OpenSocket open_;
  Socket socket_;
  boost::asio::steady_timer timer_;
  std::array<char, kBlock> block_;
  LineBuffer lines_;
  std::string writing_;
  std::optional<LineReceiver> receiver_;
  bool closing_ = false;
};

}  // namespace sila::detail
