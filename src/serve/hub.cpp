#include "hub.hpp"

#include <algorithm>
#include <utility>

namespace sila::detail {

Intake::~Intake() {
  if (hub_.engine != nullptr) hub_.engine->offer({stream_, {}, monotonic_s(), true});
}

bool Intake::too_fast() {
  const double now_s = monotonic_s();
  const double most = hub_.config.max_rate_hz;
  if (std::exchange(first_, false)) allowance_ = most;
  allowance_ = std::min(most, allowance_ + most * (now_s - filled_s_));
  filled_s_ = now_s;
  if (allowance_ < 1.0) return true;
  allowance_ -= 1.0;
  return false;
}

std::optional<double> Intake::line(std::string_view text) {
  if (!text.empty() && text.back() == '\r') text.remove_suffix(1);
  if (text.empty()) return std::nullopt;
  if (text.size() > static_cast<std::size_t>(hub_.config.max_line_bytes)) {
    refuse(Refusal::too_long);
    return std::nullopt;
  }
  if (too_fast()) {
    refuse(Refusal::too_fast);
    return std::nullopt;
  }
  auto parsed = parse_detection(text);
  if (const Refusal* refusal = std::get_if<Refusal>(&parsed)) {
    if (!parse_token(text)) refuse(*refusal);  // a token where none is needed is no mistake
    return std::nullopt;
  }
  ++hub_.lines;
  Detection& row = std::get<Detection>(parsed);
  const double t_s = row.t_s;
  hub_.engine->offer({stream_, std::move(row), monotonic_s(), false});
  return t_s;
}

void Intake::refuse(Refusal refusal) {
  ++hub_.lines;
  hub_.engine->refuse(stream_, refusal);
}

}  // namespace sila::detail
