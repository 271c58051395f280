#include "connection.hpp"

#include <algorithm>
#include <nlohmann/json.hpp>
#include <utility>

namespace sila::detail {

Connection::Connection(ConnectionRegistry& registry, std::size_t max_send_bytes)
    : registry_(registry), id_(registry.next_id++), queue_(max_send_bytes) {}

void Connection::announce_first(const std::string& line, const char* input, const char* output) {
  const auto report = nlohmann::json::parse(line);
  if (announced_reports_.insert(report.value("rejected", "dropped")).second)
    registry_.announce(std::string(input) + ": " + line + "; further reports of this kind are in " + output + " alone");
}

LineReceiver::LineReceiver(ConnectionRegistry& registry, StreamId stream, std::function<void(double t_s)> before)
    : registry_(registry),
      stream_(stream),
      before_(std::move(before)),
      allowance_(registry.config.max_rate_hz),
      refilled_s_(monotonic_s()) {}

LineReceiver::~LineReceiver() {
  if (registry_.engine != nullptr) registry_.engine->offer({stream_, std::nullopt, monotonic_s()});
}

/// Checks the length of a line and the rate.
std::optional<Rejection> LineReceiver::check(std::string_view line) {
  if (line.size() > static_cast<std::size_t>(registry_.config.max_line_bytes)) return Rejection::too_long;
  if (before_ && registry_.options.wait) return std::nullopt;  // a file is read as fast as it is answered
  const double now_s = monotonic_s();
  const double rate_hz = registry_.config.max_rate_hz;
  allowance_ = std::min(rate_hz, allowance_ + rate_hz * (now_s - refilled_s_));
  refilled_s_ = now_s;
  if (allowance_ < 1.0) return Rejection::too_fast;
  allowance_ -= 1.0;
  return std::nullopt;
}

void LineReceiver::receive(std::string_view line) {
  if (!line.empty() && line.back() == '\r') line.remove_suffix(1);
  if (line.empty()) return;
  ParsedLine parsed;
  if (const std::optional<Rejection> rejection = check(line)) {
    parsed.rejections = {*rejection};
  } else {
    parsed = parse_line(line, registry_.options.read, registry_.has_camera);
    // A token is accepted where none is needed.
    if (!parsed.rejections.empty() && parse_token(line)) return;
  }
  ++registry_.lines;
  for (const Rejection rejection : parsed.rejections) registry_.engine->reject(stream_, rejection);
  for (Detection& row : parsed.detections) {
    if (before_) before_(row.t_s);
    registry_.engine->offer({stream_, std::move(row), monotonic_s()});
  }
}

}  // namespace sila::detail
