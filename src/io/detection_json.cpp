#include "sila/io/detection_json.hpp"

#include <nlohmann/json.hpp>
#include <string>

namespace sila {
namespace {

constexpr std::size_t kLongestId = 64;

std::optional<std::string> id_of(const nlohmann::json& object) {
  const auto id = object.find("id");
  if (id == object.end()) return std::nullopt;
  if (id->is_number_integer()) return id->dump();  // its digits, however large it is
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

std::optional<Detection> detection_of(const nlohmann::json& json) {
  if (!json.is_object()) return std::nullopt;
  const auto id = id_of(json);
  const auto t_s = number_of(json, "t"), x_m = number_of(json, "x"), y_m = number_of(json, "y");
  if (!id || !t_s || !x_m || !y_m) return std::nullopt;
  Detection row{*id, *t_s, {*x_m, *y_m}};
  if (const auto label = json.find("label"); label != json.end() && label->is_string())
    row.label = label->get<std::string>();
  return row;
}

}  // namespace sila
