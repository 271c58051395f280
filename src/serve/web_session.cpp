#include "web_session.hpp"

#include <boost/beast/core.hpp>
#include <boost/beast/http.hpp>
#include <boost/beast/websocket.hpp>
#include <chrono>
#include <optional>

#include "address.hpp"
#include "outbox.hpp"
#include "sila/serve/live_page.hpp"
#include "web_request.hpp"

namespace sila::detail {
namespace {

namespace beast = boost::beast;
namespace http = beast::http;
namespace websocket = beast::websocket;
using Request = http::request<http::string_body>;
using Response = http::response<http::string_body>;

constexpr std::chrono::seconds kPatience(30);
constexpr std::size_t kMostHeader = 8192, kMostBody = 1024;
/// A message of a WebSocket may hold several lines.
constexpr std::size_t kMostMessage = 1 << 16;
/// A page that falls behind is shown what is new: older pictures are dropped.
constexpr std::size_t kMostPageBytes = 8 << 20;

/// One WebSocket: a stream of lines, or a live page that only listens.
class Socket : public Connection, public std::enable_shared_from_this<Socket> {
 public:
  Socket(Hub& hub, beast::tcp_stream stream, bool watches)
      : hub_(hub), seat_(hub), socket_(std::move(stream)), watches_(watches), id_(hub.next++) {}
  ~Socket() override {
    (watches_ ? hub_.watchers : hub_.connections).erase(id_);
    if (watches_ && hub_.engine != nullptr) hub_.engine->watch(hub_.watchers.size());
  }

  void start(const Request& request) {
    beast::get_lowest_layer(socket_).expires_never();
    socket_.set_option(websocket::stream_base::timeout::suggested(beast::role_type::server));
    socket_.read_message_max(kMostMessage);
    socket_.async_accept(request, [self = shared_from_this()](const beast::error_code& error) {
      if (!error) self->open();
    });
  }
  void send(std::string line, bool droppable) override {
    const std::size_t dropped =
        push(outbox_, std::move(line), droppable, watches_ ? kMostPageBytes : hub_.most_bytes());
    if (!watches_) hub_.dropped += dropped;
    if (!writing_) write();
  }
  void close() override { beast::get_lowest_layer(socket_).close(); }

 private:
  void open() {
    (watches_ ? hub_.watchers : hub_.connections)[id_] = weak_from_this();
    if (watches_) {
      send(hub_.hello(), false);
      hub_.engine->watch(hub_.watchers.size());
    } else {
      intake_.emplace(hub_, id_);
    }
    read();
  }

  void read() {
    socket_.async_read(buffer_, [self = shared_from_this()](const beast::error_code& error, std::size_t) {
      if (error) return;
      self->take_message();
      self->read();
    });
  }

  void take_message() {
    const std::string message = beast::buffers_to_string(buffer_.data());
    buffer_.consume(buffer_.size());
    if (!intake_) return;
    std::string_view rest(message);
    while (!rest.empty()) {
      const std::size_t end = rest.find('\n');
      intake_->line(rest.substr(0, end));
      rest = end == std::string_view::npos ? std::string_view() : rest.substr(end + 1);
    }
  }

  void write() {
    if (next_.empty()) next_ = take(outbox_, 1);
    if (next_.empty()) return;
    writing_ = true;
    text_ = std::move(next_.front());
    next_.erase(next_.begin());
    socket_.text(true);
    socket_.async_write(boost::asio::buffer(text_),
                        [self = shared_from_this()](const beast::error_code& error, std::size_t) {
                          self->writing_ = false;
                          if (error) return self->close();
                          self->write();
                        });
  }

  Hub& hub_;
  Seat seat_;
  websocket::stream<beast::tcp_stream> socket_;
  bool watches_;
  StreamId id_;
  beast::flat_buffer buffer_;
  Outbox outbox_;
  std::vector<std::string> next_;
  std::string text_;
  bool writing_ = false;
  std::optional<Intake> intake_;
};

Response response(const Request& request, http::status status, const char* type, std::string body) {
  Response answer{status, request.version()};
  answer.set(http::field::content_type, type);
  answer.set(http::field::cache_control, "no-store");
  answer.set("X-Content-Type-Options", "nosniff");
  answer.set("Referrer-Policy", "no-referrer");
  answer.keep_alive(request.keep_alive());
  answer.body() = std::move(body);
  answer.prepare_payload();
  return answer;
}

Response answer_to(Hub& hub, const Request& request, const std::string& path) {
  if (request.method() != http::verb::get && request.method() != http::verb::head)
    return response(request, http::status::method_not_allowed, "text/plain", "only GET\n");
  if (path == "/") return response(request, http::status::ok, "text/html; charset=utf-8", live_page());
  if (path == "/metrics")
    return response(request, http::status::ok, "text/plain; version=0.0.4; charset=utf-8", metrics_text(hub.facts()));
  if (path == "/healthz") return response(request, http::status::ok, "text/plain", "ok\n");
  return response(request, http::status::not_found, "text/plain",
                  "here are /, /metrics, /healthz and the WebSockets /stream and /live\n");
}

/// One HTTP connection, until it becomes a WebSocket or ends.
class Web : public std::enable_shared_from_this<Web> {
 public:
  Web(Hub& hub, boost::asio::ip::tcp::socket socket) : hub_(hub), seat_(hub), stream_(std::move(socket)) {}

  void read() {
    parser_.emplace();
    parser_->header_limit(kMostHeader);
    parser_->body_limit(kMostBody);
    stream_.expires_after(kPatience);
    http::async_read(stream_, buffer_, *parser_,
                     [self = shared_from_this()](const beast::error_code& error, std::size_t) {
                       if (!error) self->answer(self->parser_->release());
                     });
  }

 private:
  void answer(const Request& request) {
    const WebRequest asked{std::string(request.target()), std::string(request[http::field::host]),
                           std::string(request[http::field::origin]), std::string(request[http::field::authorization])};
    const std::string path = path_of(asked);
    if (const auto why = refusal_of(asked, hub_.token)) {
      ++hub_.refused_tokens;
      return write(response(request, http::status::forbidden, "text/plain", *why + "\n"));
    }
    if (!websocket::is_upgrade(request)) return write(answer_to(hub_, request, path));
    if (path != "/stream" && path != "/live")
      return write(response(request, http::status::not_found, "text/plain", "WebSockets are at /stream and /live\n"));
    std::make_shared<Socket>(hub_, std::move(stream_), path == "/live")->start(request);
  }

  void write(Response answer) {
    answer_ = std::move(answer);
    http::async_write(stream_, answer_, [self = shared_from_this()](const beast::error_code& error, std::size_t) {
      if (!error && self->answer_.keep_alive()) return self->read();
      beast::error_code ignored;
      self->stream_.socket().shutdown(boost::asio::ip::tcp::socket::shutdown_send, ignored);
    });
  }

  Hub& hub_;
  Seat seat_;
  beast::tcp_stream stream_;
  beast::flat_buffer buffer_{kMostHeader + kMostBody};
  std::optional<http::request_parser<http::string_body>> parser_;
  Response answer_;
};

}  // namespace

void serve_web(Hub& hub, boost::asio::ip::tcp::socket socket) {
  std::make_shared<Web>(hub, std::move(socket))->read();
}

}  // namespace sila::detail
