#pragma once

#include <array>
#include <cstddef>
#include <string_view>

namespace sila {

/// Why a line of a stream, or a connection, was not taken.
enum class Refusal {
  too_long,
  not_json,
  not_a_detection,
  not_usable,
  late,
  off_clock,
  too_many_ids,
  too_fast,
  overloaded,
  too_many_connections,
  no_token,
};

struct RefusalText {
  Refusal refusal;
  std::string_view name;  ///< in JSON and metrics
  std::string_view text;  ///< for people
};

/// Every refusal once, in the order of the enumeration.
inline constexpr std::array<RefusalText, 11> kRefusals{{
    {Refusal::too_long, "too_long", "the line is longer than serve.max_line_bytes"},
    {Refusal::not_json, "not_json", "the line is not a JSON object"},
    {Refusal::not_a_detection, "not_a_detection", "a detection has the numbers t, x, y and a text or whole number id"},
    {Refusal::not_usable, "not_usable", "the position or time is absurd, or the label is not that of a pedestrian"},
    {Refusal::late, "late", "the detection is older than the newest by more than live.late_s"},
    {Refusal::off_clock, "off_clock", "the time is off the stream's clock by more than live.clock_jump_s"},
    {Refusal::too_many_ids, "too_many_ids", "live.max_ids tracks are open"},
    {Refusal::too_fast, "too_fast", "more lines a second than serve.max_rate_hz"},
    {Refusal::overloaded, "overloaded", "more lines wait than serve.max_waiting_lines"},
    {Refusal::too_many_connections, "too_many_connections", "serve.max_connections are open"},
    {Refusal::no_token, "no_token", "the token of the service is missing or wrong"},
}};

constexpr const RefusalText& text_of(Refusal refusal) {
  return kRefusals[static_cast<std::size_t>(refusal)];
}

}  // namespace sila
