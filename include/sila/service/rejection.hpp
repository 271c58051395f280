#pragma once

#include <array>
#include <cstddef>
#include <string_view>

namespace sila {

/// Why a line of a stream, or a connection, is rejected.
enum class Rejection {
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
  other_camera,
  no_camera,
};

struct RejectionText {
  Rejection rejection;
  std::string_view name;  ///< in JSON and metrics
  std::string_view text;  ///< for people
};

/// Every rejection once, in the order of the enumeration.
inline constexpr std::array<RejectionText, 13> kRejections{{
    {Rejection::too_long, "too_long", "the line is longer than service.max_line_bytes"},
    {Rejection::not_json, "not_json",
     "the line is not a JSON object; the service reads NDJSON (docs/service.md), such as `sila replay TRACKS` writes"},
    {Rejection::not_a_detection, "not_a_detection",
     "a detection has the numbers t, x, y and a text or whole number id"},
    {Rejection::not_usable, "not_usable",
     "the position (metres) or time (seconds) is absurd, or the label is not that of a pedestrian"},
    {Rejection::late, "late", "the detection is older than the newest by more than service.late_s"},
    {Rejection::off_clock, "off_clock", "the time is off the clock of the stream by more than 10 s; t is in seconds"},
    {Rejection::too_many_ids, "too_many_ids", "service.max_ids tracks are open"},
    {Rejection::too_fast, "too_fast", "more lines per second than service.max_rate_hz"},
    {Rejection::overloaded, "overloaded", "service.max_queued_lines are queued, more than a fair share by this client"},
    {Rejection::too_many_connections, "too_many_connections", "service.max_connections are open"},
    {Rejection::no_token, "no_token", "the token of the service is missing or wrong"},
    {Rejection::other_camera, "other_camera",
     "the event is of another camera than --frigate-camera names, or that option is missing"},
    {Rejection::no_camera, "no_camera", "boxes are image points, which need a camera file (--camera)"},
}};

constexpr const RejectionText& text_of(Rejection rejection) {
  return kRejections[static_cast<std::size_t>(rejection)];
}

}  // namespace sila
