#include "sila/io/detection_json.hpp"

#include <nlohmann/json.hpp>
#include <string>

#include "json_values.hpp"

namespace sila {
namespace {

constexpr std::size_t kLongestId = 64;

}  // namespace

std::optional<Detection> detection_of(const nlohmann::json& json) {
  if (!json.is_object()) return std::nullopt;
  const auto id = id_in(json, "id");
  const auto t_s = number_in(json, "t"), x_m = number_in(json, "x"), y_m = number_in(json, "y");
  if (!id || id->empty() || id->size() > kLongestId || !t_s || !x_m || !y_m) return std::nullopt;
  Detection row{*id, *t_s, {*x_m, *y_m}};
  if (const auto label = json.find("label"); label != json.end() && label->is_string())
    row.label = label->get<std::string>();
  return row;
}

}  // namespace sila
