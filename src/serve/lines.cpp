#include "sila/serve/lines.hpp"

#include <nlohmann/json.hpp>

namespace sila {
namespace {

constexpr std::size_t kLongestId = 64;

std::optional<std::string> id_of(const nlohmann::json& object) {
  const auto id = object.find("id");
  if (id == object.end()) return std::nullopt;
  if (id->is_number_integer()) return id->dump();
  if (!id->is_string()) return std::nullopt;
  const auto& text = id->get_ref<const std::string&>();
  if (text.empty() || text.size() > kLongestId) return std::nullopt;
  return text;
}

std::optional<double> number_of(const nlohmann::json& object, const char* key) {
  const auto value = object.find(key);
  if (value == object.end() || !value->is_number()) return std::nullopt;
  return value->get<double>();
}

}  // namespace

std::variant<Detection, Refusal> parse_detection(std::string_view line) {
  const nlohmann::json object = nlohmann::json::parse(line, nullptr, false);
  if (!object.is_object()) return Refusal::not_json;
  const auto id = id_of(object);
  const auto t_s = number_of(object, "t"), x_m = number_of(object, "x"), y_m = number_of(object, "y");
  if (!id || !t_s || !x_m || !y_m) return Refusal::not_a_detection;
  Detection row{*id, *t_s, {*x_m, *y_m}};
  if (const auto label = object.find("label"); label != object.end() && label->is_string())
    row.label = label->get<std::string>();
  return row;
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
