#pragma once

#include <optional>
#include <string>
#include <string_view>
#include <variant>

#include "sila/core/detections.hpp"
#include "sila/live/refusal.hpp"

namespace sila {

/// A line of a stream: `{"t": 12.4, "id": "17", "x": 3.1, "y": 0.4}`, seconds and metres; `id` may be a whole number,
/// `label` may be there. Other keys are ignored.
std::variant<Detection, Refusal> parse_detection(std::string_view line);

/// The token of a line `{"token": "..."}`.
std::optional<std::string> parse_token(std::string_view line);

/// What a connection is told of refused lines: `{"refused": "late", "count": 12, "why": "..."}`.
std::string refusal_line(Refusal refusal, std::size_t count);

/// What it is told of predictions that will not come: `{"dropped": 12, "why": "..."}`.
std::string dropped_line(std::size_t count, std::string_view why);

/// Whether two tokens are the same, in a time that does not tell where they differ.
bool same_token(std::string_view a, std::string_view b);

}  // namespace sila
