#include "sila/serve/lines.hpp"

#include <nlohmann/json.hpp>
#include <utility>

#include "sila/io/track_files.hpp"

namespace sila {

std::variant<Detection, Refusal> parse_detection(std::string_view line) {
  const nlohmann::json object = nlohmann::json::parse(line, nullptr, false);
  if (!object.is_object()) return Refusal::not_json;
  std::optional<Detection> row = detection_of(object);
  if (!row) return Refusal::not_a_detection;
  return *std::move(row);
}

std::optional<std::string> parse_token(std::string_view line) {
  const nlohmann::json object = nlohmann::json::parse(line, nullptr, false);
  if (!object.is_object()) return std::nullopt;
  const auto token = object.find("token");
  if (token == object.end() || !token->is_string()) return std::nullopt;
  return token->get<std::string>();
}

std::string refusal_line(Refusal refusal, std::size_t count) {
  const RefusalText& text = text_of(refusal);
  return nlohmann::ordered_json{{"refused", text.name}, {"count", count}, {"why", text.text}}.dump();
}

std::string dropped_line(std::size_t count, std::string_view why) {
  return nlohmann::ordered_json{{"dropped", count}, {"why", why}}.dump();
}

bool same_token(std::string_view a, std::string_view b) {
  unsigned different = a.size() == b.size() ? 0U : 1U;
  for (std::size_t i = 0; i < b.size(); ++i)
    different |=
        static_cast<unsigned>(static_cast<unsigned char>(i < a.size() ? a[i] : 0) ^ static_cast<unsigned char>(b[i]));
  return different == 0;
}

}  // namespace sila
