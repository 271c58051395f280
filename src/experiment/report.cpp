#include "sila/experiment/report.hpp"

#include <algorithm>
#include <cmath>
#include <cstdio>

namespace sila {
namespace {

using nlohmann::json;
using nlohmann::ordered_json;

std::string number(double value, int decimals) {
  char text[64];
  std::snprintf(text, sizeof text, "%.*f", decimals, value);
  return text;
}

/// A cell of CSV; names may have commas.
std::string quoted(const std::string& text) {
  if (text.find_first_of(",\"\n") == std::string::npos) return text;
  std::string result = "\"";
  for (char c : text) result += c == '"' ? std::string("\"\"") : std::string(1, c);
  return result + "\"";
}

std::string shortest(double value) {
  return value == std::trunc(value) && std::abs(value) < 1e15 ? number(value, 0) : json(value).dump();
}

/// Values whose spread over trials tells something.
bool has_spread(const RowValue& value) {
  const std::string name = value.name;
  return name == "ratio" || name == "ade_ratio" || name == "nll" || name == "size";
}

std::string cell(const RowValue& value, const Spread& spread) {
  if (spread.count == 0) return "–";
  std::string text = number(spread.mean, value.decimals);
  if (spread.count > 1 && has_spread(value)) text += " ± " + number(spread.deviation, value.decimals);
  return text;
}

bool is_in_tables(const RowValue& value) {
  return value.title[0] != '\0';
}

std::string header(const std::string& first) {
  std::string text = "| " + first + " |", rule = "|---|";
  for (const RowValue& value : row_values()) {
    if (is_in_tables(value)) text += std::string(" ") + value.title + " |", rule += "---|";
  }
  return text + "\n" + rule + "\n";
}

std::size_t index_of(const std::string& name) {
  const auto values = row_values();
  const auto found = std::ranges::find_if(values, [&](const RowValue& value) { return value.name == name; });
  return static_cast<std::size_t>(found - values.begin());
}

/// The mean of a value over places; of the size the geometric mean, as places differ by orders of magnitude.
Spread mean_over(const std::vector<const MethodSummary*>& summaries, std::size_t v) {
  const std::string name = row_values()[v].name;
  std::vector<double> means;
  for (const MethodSummary* summary : summaries) {
    if (summary->values[v].count == 0) continue;
    if (name.starts_with("turning_r") || name.starts_with("standing_r") || name.starts_with("standing_a")) {
      const Spread& windows = summary->values[index_of(name.substr(0, name.find('_')) + "_windows")];
      if (windows.mean * static_cast<double>(windows.count) < 50.0) continue;
    }
    means.push_back(name == "size" ? std::log(std::max(1.0, summary->values[v].mean)) : summary->values[v].mean);
  }
  Spread spread = spread_of(means);
  if (name == "size") spread.mean = std::exp(spread.mean), spread.deviation = 0.0;
  return spread;
}

template <class T>
std::vector<std::string> names(std::span<const T> items, std::string T::*member) {
  std::vector<std::string> result;
  for (const T& item : items) {
    if (std::ranges::find(result, item.*member) == result.end()) result.push_back(item.*member);
  }
  return result;
}

std::string means_table(std::span<const MethodSummary> summaries) {
  std::string text =
      "## Mean over the places\n\n± is the deviation between places; size: geometric mean; turning and "
      "standing: places with at least 50 such windows in all trials.\n\n" +
      header("method");
  for (const std::string& method : names(summaries, &MethodSummary::method)) {
    std::vector<const MethodSummary*> own;
    for (const MethodSummary& summary : summaries) {
      if (summary.method == method && summary.place != "all") own.push_back(&summary);
    }
    text += "| " + method + " |";
    for (std::size_t v = 0; v < row_values().size(); ++v) {
      if (!is_in_tables(row_values()[v])) continue;
      Spread spread = mean_over(own, v);
      if (std::string(row_values()[v].name) == "size") spread.count = std::min<std::size_t>(spread.count, 1);
      text += " " + cell(row_values()[v], spread) + " |";
    }
    text += "\n";
  }
  return text + "\n";
}

std::string comparison_table(std::span<const Comparison> comparisons) {
  std::string text =
      "## Paired comparisons\n\nDifference of the weighted MHD over the moving windows of the same people in the same "
      "trials, as a share of constant velocity's error; below 0 the method is better. 95 % interval by resampling "
      "people.\n\n| place | method | against | people | difference | 95 % |\n|---|---|---|---|---|---|\n";
  for (const Comparison& c : comparisons) {
    text += "| " + c.place + " | " + c.method + " | " + c.against + " | " + std::to_string(c.people) + " | " +
            number(c.difference, 3) + " | " + number(c.low, 3) + " to " + number(c.high, 3) + " |\n";
  }
  return text;
}

}  // namespace

std::string rows_csv(std::span<const PartRow> rows) {
  std::string text = "place,method,trial,order";
  for (const RowValue& value : row_values()) text += std::string(",") + value.name;
  text += "\n";
  for (const PartRow& row : rows) {
    text += quoted(row.place) + "," + quoted(row.method) + "," + std::to_string(row.trial) + "," +
            std::to_string(row.order);
    for (const RowValue& value : row_values()) {
      const std::optional<double> found = value.of(row);
      text += "," + (found ? shortest(*found) : "");
    }
    text += "\n";
  }
  return text;
}

std::string curves_csv(std::span<const json> parts) {
  std::string text =
      "scene,place,method,trial,order,episode,tracks,size,seconds,windows,weighted_mhd_m,mean_path_mhd_m,best_mhd_m,"
      "mean_path_ade_m,nll,constant_mhd_m,constant_ade_m\n";
  for (const json& part : parts) {
    for (const json& milestone : part.at("milestones")) {
      const std::string what = quoted(part.at("scene")) + ",";
      const std::string how = quoted(part.at("method")) + "," + part.at("trial").dump() + "," +
                              part.at("order").dump() + "," + milestone.at("episode").dump() + "," +
                              milestone.at("tracks").dump() + "," + milestone.at("size").dump() + "," +
                              milestone.at("seconds").dump() + ",";
      if (!milestone.contains("places")) text += what + "," + how + ",,,,,,,\n";
      const json places = milestone.value("places", json::object());
      for (const auto& [place, groups] : places.items()) {
        if (!groups.contains("moving")) continue;
        const json& model = groups.at("moving").at("model");
        text += what + quoted(place) + "," + how + groups.at("moving").at("windows").dump();
        for (const char* name : {"weighted_mhd_m", "mean_path_mhd_m", "best_mhd_m", "mean_path_ade_m", "nll"}) {
          text += "," + model.at(name).dump();
        }
        const json& constant = groups.at("moving").at("constant_velocity");
        text += "," + constant.at("weighted_mhd_m").dump() + "," + constant.at("mean_path_ade_m").dump() + "\n";
      }
    }
  }
  return text;
}

ordered_json curves_json(std::span<const json> parts) {
  ordered_json curves = ordered_json::array();
  for (const json& part : parts) {
    ordered_json curve;
    for (const char* key : {"scene", "method", "trial", "order", "milestones"}) curve[key] = part.at(key);
    curves.push_back(std::move(curve));
  }
  return curves;
}

ordered_json to_json(std::span<const MethodSummary> summaries) {
  ordered_json list = ordered_json::array();
  for (const MethodSummary& summary : summaries) {
    ordered_json item{{"place", summary.place}, {"method", summary.method}};
    for (std::size_t v = 0; v < summary.values.size(); ++v) {
      const Spread& spread = summary.values[v];
      if (spread.count == 0) continue;
      item[row_values()[v].name] = {{"trials", spread.count}, {"mean", spread.mean}, {"deviation", spread.deviation}};
    }
    list.push_back(std::move(item));
  }
  return list;
}

ordered_json to_json(std::span<const Comparison> comparisons) {
  ordered_json list = ordered_json::array();
  for (const Comparison& c : comparisons) {
    list.push_back({{"place", c.place},
                    {"method", c.method},
                    {"against", c.against},
                    {"people", c.people},
                    {"difference", c.difference},
                    {"low", c.low},
                    {"high", c.high}});
  }
  return list;
}

std::string tables(std::span<const MethodSummary> summaries, std::span<const Comparison> comparisons) {
  std::string text = "Moving windows, mean over trials ± deviation. CV: constant velocity on the same windows.\n\n";
  const std::vector<std::string> places = names(summaries, &MethodSummary::place);
  for (const std::string& place : places) {
    text += "## " + place + "\n\n" + header("method");
    for (const MethodSummary& summary : summaries) {
      if (summary.place != place) continue;
      text += "| " + summary.method + " |";
      for (std::size_t v = 0; v < row_values().size(); ++v) {
        if (is_in_tables(row_values()[v])) text += " " + cell(row_values()[v], summary.values[v]) + " |";
      }
      text += "\n";
    }
    text += "\n";
  }
  if (places.size() > 1) text += means_table(summaries);
  return text + comparison_table(comparisons);
}

}  // namespace sila
