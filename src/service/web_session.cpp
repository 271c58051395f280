#include "web_session.hpp"

#include <boost/beast/core.hpp>
#include <boost/beast/http.hpp>
#include <boost/beast/websocket.hpp>
#include <chrono>

#include "live_page.hpp"
#include "web_request.hpp"

namespace sila::detail {
namespace {

namespace beast = boost::beast;
namespace http = beast::http;
namespace websocket = beast::websocket;
using Request = http::request<http::string_body>;
using Response = http::response<http::string_body>;

constexpr std::chrono::seconds kTimeout(30);
constexpr std::size_t kMaxHeader = 8192, kMaxBody = 1024;
/// A message of a WebSocket may have several lines.
constexpr std::size_t kMaxMessage = 1 << 16;
/// If a page reads too slowly, old messages are dropped.
constexpr std::size_t kMaxPageBytes = 8 << 20;

/// One WebSocket: a stream of lines, or a live page, which only reads.
class WebSocketConnection : public Connection, public std::enable_shared_from_this<WebSocketConnection> {
 public:
  WebSocketConnection(ConnectionRegistry& registry, beast::tcp_stream stream, bool is_page)
      : Connection(registry, is_page ? kMaxPageBytes : registry.max_send_bytes()),
        open_(registry),
        socket_(std::move(stream)),
        is_page_(is_page) {}
  ~WebSocketConnection() override {
    connections().erase(id_);
    count_pages();
  }

  void start(const Request& request) {
    beast::get_lowest_layer(socket_).expires_never();
    socket_.set_option(websocket::stream_base::timeout::suggested(beast::role_type::server));
    socket_.read_message_max(kMaxMessage);
    socket_.async_accept(request, [self = shared_from_this()](const beast::error_code& error) {
      if (!error) self->accepted();
    });
  }
  void send(std::string line, bool droppable) override {
    const std::size_t dropped = queue_.push(std::move(line), droppable);
    if (!is_page_) registry_.slow_reader_dropped += dropped;
    if (!writing_) write();
  }
  void close() override { beast::get_lowest_layer(socket_).close(); }

 private:
  std::map<StreamId, std::weak_ptr<Connection>>& connections() {
    return is_page_ ? registry_.live_pages : registry_.streams;
  }
  void count_pages() {
    if (registry_.engine != nullptr) registry_.engine->set_live_pages(registry_.live_pages.size());
  }

  void accepted() {
    connections()[id_] = weak_from_this();
    count_pages();
    if (is_page_)
      send(registry_.hello(), false);
    else
      receiver_.emplace(registry_, id_);
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
    if (!receiver_) return;
    LineBuffer lines(kMaxMessage);
    lines.append(message);
    while (const auto line = lines.next()) receiver_->receive(*line);
    if (const auto line = lines.last()) receiver_->receive(*line);
  }

  void write() {
    std::optional<std::string> line = queue_.next();
    if (!line) return;
    writing_ = true;
    text_ = *std::move(line);
    socket_.text(true);
    socket_.async_write(boost::asio::buffer(text_),
                        [self = shared_from_this()](const beast::error_code& error, std::size_t) {
                          self->writing_ = false;
                          if (error) return self->close();
                          self->write();
                        });
  }

  OpenSocket open_;
  websocket::stream<beast::tcp_stream> socket_;
  bool is_page_;
  beast::flat_buffer buffer_;
  std::string text_;
  bool writing_ = false;
  std::optional<LineReceiver> receiver_;
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
  if (request.method() == http::verb::head) answer.body().clear();  // its length remains
  return answer;
}

Response answer_to(const ConnectionRegistry& registry, const Request& request, const std::string& path) {
  if (request.method() != http::verb::get && request.method() != http::verb::head)
    return response(request, http::status::method_not_allowed, "text/plain", "only GET\n");
  if (path == "/") return response(request, http::status::ok, "text/html; charset=utf-8", live_page());
  if (path == "/metrics")
    return response(request, http::status::ok, "text/plain; version=0.0.4; charset=utf-8",
                    metrics_text(registry.metrics()));
  if (path == "/healthz") return response(request, http::status::ok, "text/plain", "ok\n");
  return response(request, http::status::not_found, "text/plain",
                  "available: /, /metrics, /healthz and the WebSockets /stream and /live\n");
}

/// One HTTP connection, until it becomes a WebSocket or ends.
class HttpConnection : public std::enable_shared_from_this<HttpConnection> {
 public:
  HttpConnection(ConnectionRegistry& registry, boost::asio::ip::tcp::socket socket)
      : registry_(registry), open_(registry), stream_(std::move(socket)) {}

  void read() {
    parser_.emplace();
    parser_->header_limit(kMaxHeader);
    parser_->body_limit(kMaxBody);
    stream_.expires_after(kTimeout);
    http::async_read(stream_, buffer_, *parser_,
                     [self = shared_from_this()](const beast::error_code& error, std::size_t) {
                       if (!error) self->answer(self->parser_->release());
                     });
  }

 private:
  void answer(const Request& request) {
    const WebRequest web_request{std::string(request.target()), std::string(request[http::field::host]),
                                 std::string(request[http::field::origin]),
                                 std::string(request[http::field::authorization])};
    const std::string path = path_of(web_request);
    if (const auto why = rejection_of(web_request, registry_.options.token)) {
      registry_.engine->reject(0, Rejection::no_token);
      return write(response(request, http::status::forbidden, "text/plain", *why + "\n"));
    }
    if (!websocket::is_upgrade(request)) return write(answer_to(registry_, request, path));
    if (path != "/stream" && path != "/live")
      return write(response(request, http::status::not_found, "text/plain", "WebSockets are at /stream and /live\n"));
    std::make_shared<WebSocketConnection>(registry_, std::move(stream_), path == "/live")->start(request);
  }

  void write(Response answer) {
    answer_ = std::move(answer);
    http::async_write(stream_, answer_, [self = shared_from_this()](const beast::error_code& error, std::size_t) {
      if (!error && self->answer_.keep_alive()) return self->read();
      beast::error_code ignored;
      self->stream_.socket().shutdown(boost::asio::ip::tcp::socket::shutdown_send, ignored);
    });
  }

  ConnectionRegistry& registry_;
  OpenSocket open_;
  beast::tcp_stream stream_;
  beast::flat_buffer buffer_{kMaxHeader + kMaxBody};
  std::optional<http::request_parser<http::string_body>> parser_;
  Response answer_;
};

}  // namespace

void serve_web(ConnectionRegistry& registry, boost::asio::ip::tcp::socket socket) {
  std::make_shared<HttpConnection>(registry, std::move(socket))->read();
}

}  // namespace sila::detail
