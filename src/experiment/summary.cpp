#include "sila/experiment/summary.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <random>

namespace sila {
namespace {

constexpr const char* kConstantVelocity = "constant velocity";
constexpr const char* kMeanOfPlaces = "mean";

using Member = double GroupSums::*;

const GroupSums* group_of(const PartRow& row, const char* name) {
  const auto found = row.groups.find(name);
  return found == row.groups.end() || !(found->second.windows > 0.0) ? nullptr : &found->second;
}

/// A sum over a group, relative to another sum over it.
std::optional<double> ratio(const PartRow& row, const char* group, Member member,
                            Member to = &GroupSums::constant_mhd_m) {
  const GroupSums* sums = group_of(row, group);
  return sums && sums->*to > 0.0 ? std::optional(sums->*member / (sums->*to)) : std::nullopt;
}

std::optional<double> per_window(const PartRow& row, Member member) {
  return ratio(row, "moving", member, &GroupSums::windows);
}

std::optional<double> windows(const PartRow& row, const char* group) {
  const GroupSums* sums = group_of(row, group);
  return sums ? sums->windows : 0.0;
}

/// Of standing windows: relative to the better of constant velocity and "stays".
std::optional<double> standing(const PartRow& row, Member member, Member constant, Member stays) {
  const std::optional<double> a = ratio(row, "standing", member, constant), b = ratio(row, "standing", member, stays);
  return a && b ? std::optional(std::max(*a, *b)) : a ? a : b;
}

constexpr std::array<RowValue, 34> kRowValues{{
    {"windows", "moving windows", 0, [](const PartRow& r) { return windows(r, "moving"); }},
    {"weighted_mhd_m", "wMHD [m]", 3, [](const PartRow& r) { return per_window(r, &GroupSums::mhd_m); }},
    {"constant_mhd_m", "CV [m]", 3, [](const PartRow& r) { return per_window(r, &GroupSums::constant_mhd_m); }},
    {"ratio", "wMHD / CV", 3, [](const PartRow& r) { return ratio(r, "moving", &GroupSums::mhd_m); }},
    {"ade_m", "ADE [m]", 3, [](const PartRow& r) { return per_window(r, &GroupSums::ade_m); }},
    {"ade_ratio", "ADE / CV", 3,
     [](const PartRow& r) { return ratio(r, "moving", &GroupSums::ade_m, &GroupSums::constant_ade_m); }},
    {"fde_m", "FDE [m]", 3, [](const PartRow& r) { return per_window(r, &GroupSums::fde_m); }},
    {"fde_ratio", "FDE / CV", 3,
     [](const PartRow& r) { return ratio(r, "moving", &GroupSums::fde_m, &GroupSums::constant_fde_m); }},
    {"linear_ratio", "linear: wMHD / CV", 3,
     [](const PartRow& r) { return ratio(r, "moving", &GroupSums::linear_mhd_m); }},
    {"linear_ade_ratio", "", 3,
     [](const PartRow& r) { return ratio(r, "moving", &GroupSums::linear_ade_m, &GroupSums::constant_ade_m); }},
    {"damped_ratio", "damped: wMHD / CV", 3,
     [](const PartRow& r) { return ratio(r, "moving", &GroupSums::damped_mhd_m); }},
    {"all_ratio", "all / CV", 3, [](const PartRow& r) { return ratio(r, "all", &GroupSums::mhd_m); }},
    {"turning_windows", "", 0, [](const PartRow& r) { return windows(r, "turning"); }},
    {"turning_ratio", "turning / CV", 3, [](const PartRow& r) { return ratio(r, "turning", &GroupSums::mhd_m); }},
    {"standing_windows", "", 0, [](const PartRow& r) { return windows(r, "standing"); }},
    {"standing_ratio", "standing / better of CV and stays", 3,
     [](const PartRow& r) {
       return standing(r, &GroupSums::mhd_m, &GroupSums::constant_mhd_m, &GroupSums::stays_mhd_m);
     }},
    {"standing_ade_ratio", "standing: ADE / better", 3,
     [](const PartRow& r) {
       return standing(r, &GroupSums::ade_m, &GroupSums::constant_ade_m, &GroupSums::stays_ade_m);
     }},
    {"fork_windows", "windows at forks", 0, [](const PartRow& r) { return windows(r, "forks"); }},
    {"fork_log_probability", "forks: log p of the way taken", 3,
     [](const PartRow& r) { return ratio(r, "forks", &GroupSums::way_log_probability, &GroupSums::windows); }},
    {"fork_ade_ratio", "forks: ADE / CV", 3,
     [](const PartRow& r) { return ratio(r, "forks", &GroupSums::ade_m, &GroupSums::constant_ade_m); }},
    {"inside_ratio", "", 3, [](const PartRow& r) { return ratio(r, "inside", &GroupSums::mhd_m); }},
    {"outside_windows", "", 0, [](const PartRow& r) { return windows(r, "outside"); }},
    {"mean_path_ratio", "", 3, [](const PartRow& r) { return ratio(r, "moving", &GroupSums::mean_path_mhd_m); }},
    {"best_ratio", "", 3, [](const PartRow& r) { return ratio(r, "moving", &GroupSums::best_mhd_m); }},
    {"best_ade_ratio", "best ADE / CV", 3,
     [](const PartRow& r) { return ratio(r, "moving", &GroupSums::best_ade_m, &GroupSums::constant_ade_m); }},
    {"nll", "NLL", 2, [](const PartRow& r) { return per_window(r, &GroupSums::nll); }},
    {"linear_nll", "NLL of linear", 2, [](const PartRow& r) { return per_window(r, &GroupSums::linear_nll); }},
    {"constant_nll", "NLL of CV", 2, [](const PartRow& r) { return per_window(r, &GroupSums::constant_nll); }},
    {"inside_50", "in 50 %", 2, [](const PartRow& r) { return per_window(r, &GroupSums::inside_50); }},
    {"inside_90", "in 90 %", 2, [](const PartRow& r) { return per_window(r, &GroupSums::inside_90); }},
    {"fallback", "", 3, [](const PartRow& r) { return per_window(r, &GroupSums::fallbacks); }},
    {"size", "size", 0, [](const PartRow& r) { return std::optional<double>(static_cast<double>(r.size)); }},
    {"seconds_per_episode", "s per episode", 3,
     [](const PartRow& r) { return std::optional<double>(r.seconds_per_episode); }},
    {"people", "", 0, [](const PartRow& r) { return std::optional<double>(static_cast<double>(r.by_person.size())); }},
}};

/// A method's and another's errors on one person, and constant velocity's.
struct Pair {
  double method_m = 0.0;
  double other_m = 0.0;
  double constant_m = 0.0;
};

using RowKey = std::tuple<std::string, int, int>;  ///< place, trial, order

/// The errors of two methods, person by person, over the trials that both have. Null for `other`: constant velocity.
std::vector<Pair> pairs_of(std::span<const PartRow> rows, const std::string& place, const std::string& method,
                           const std::string* other) {
  std::map<RowKey, const PartRow*> others;
  for (const PartRow& row : rows) {
    if (other != nullptr && row.place == place && row.method == *other) others[{place, row.trial, row.order}] = &row;
  }
  std::map<std::string, Pair> people;
  for (const PartRow& row : rows) {
    if (row.place != place || row.method != method) continue;
    const auto partner = others.find({place, row.trial, row.order});
    if (other != nullptr && partner == others.end()) continue;
    for (const auto& [person, sums] : row.by_person) {
      double other_m = sums.constant_mhd_m;
      if (other != nullptr) {
        const auto same = partner->second->by_person.find(person);
        if (same == partner->second->by_person.end()) continue;
        other_m = same->second.mhd_m;
      }
      Pair& pair = people[person];
      pair.method_m += sums.mhd_m, pair.other_m += other_m, pair.constant_m += sums.constant_mhd_m;
    }
  }
  std::vector<Pair> pairs;
  for (const auto& [person, pair] : people) pairs.push_back(pair);
  return pairs;
}

double difference_of(const Pair& sum) {
  return (sum.method_m - sum.other_m) / std::max(sum.constant_m, 1e-12);
}

Pair operator+(const Pair& a, const Pair& b) {
  return {a.method_m + b.method_m, a.other_m + b.other_m, a.constant_m + b.constant_m};
}

/// The difference on the people themselves, then on resampled people.
std::vector<double> resampled(const std::vector<Pair>& pairs, int bootstraps, std::uint64_t seed) {
  Pair whole;
  for (const Pair& pair : pairs) whole = whole + pair;
  std::vector<double> differences{difference_of(whole)};
  std::mt19937_64 random(seed);
  for (int b = 0; b < bootstraps; ++b) {
    Pair sum;
    for (std::size_t i = 0; i < pairs.size(); ++i) sum = sum + pairs[random() % pairs.size()];
    differences.push_back(difference_of(sum));
  }
  return differences;
}

/// The first difference, and the interval that holds 95 % of the others.
void set_interval(Comparison& comparison, std::vector<double> differences) {
  comparison.difference = differences.front();
  const auto begin = differences.begin() + 1;
  std::sort(begin, differences.end());
  const double last = static_cast<double>(differences.size() - 2);
  comparison.low = begin[static_cast<std::ptrdiff_t>(std::lround(0.025 * last))];
  comparison.high = begin[static_cast<std::ptrdiff_t>(std::lround(0.975 * last))];
}

std::vector<std::string> firsts(std::span<const PartRow> rows, std::string PartRow::*member) {
  std::vector<std::string> names;
  for (const PartRow& row : rows) {
    if (std::ranges::find(names, row.*member) == names.end()) names.push_back(row.*member);
  }
  return names;
}

}  // namespace

Spread spread_of(std::span<const double> values) {
  Spread spread{values.size(), 0.0, 0.0};
  if (values.empty()) return spread;
  for (double value : values) spread.mean += value / static_cast<double>(values.size());
  if (values.size() < 2) return spread;
  for (double value : values) spread.deviation += (value - spread.mean) * (value - spread.mean);
  spread.deviation = std::sqrt(spread.deviation / static_cast<double>(values.size() - 1));
  return spread;
}

std::span<const RowValue> row_values() {
  return kRowValues;
}

std::vector<MethodSummary> summarise(std::span<const PartRow> rows) {
  std::vector<MethodSummary> summaries;
  for (const std::string& place : firsts(rows, &PartRow::place)) {
    for (const std::string& method : firsts(rows, &PartRow::method)) {
      std::vector<std::vector<double>> values(kRowValues.size());
      for (const PartRow& row : rows) {
        if (row.place != place || row.method != method) continue;
        for (std::size_t v = 0; v < values.size(); ++v) {
          if (const std::optional<double> value = kRowValues[v].of(row)) values[v].push_back(*value);
        }
      }
      if (values.back().empty()) continue;
      MethodSummary summary{place, method, {}};
      for (const std::vector<double>& each : values) summary.values.push_back(spread_of(each));
      summaries.push_back(std::move(summary));
    }
  }
  return summaries;
}

std::vector<Comparison> compare(std::span<const PartRow> rows, const std::string& reference, int bootstraps,
                                std::uint64_t seed) {
  std::vector<Comparison> comparisons;
  const std::vector<std::string> places = firsts(rows, &PartRow::place);
  for (const std::string& method : firsts(rows, &PartRow::method)) {
    for (const std::string* other : {static_cast<const std::string*>(nullptr), &reference}) {
      if (other != nullptr && method == reference) continue;
      Comparison mean{kMeanOfPlaces, method, other == nullptr ? kConstantVelocity : reference, 0, 0.0, 0.0, 0.0};
      std::vector<double> sums;
      std::size_t count = 0;
      for (const std::string& place : places) {
        const std::vector<Pair> pairs = pairs_of(rows, place, method, other);
        if (pairs.empty()) continue;
        const std::vector<double> differences = resampled(pairs, bootstraps, seed + count);
        Comparison comparison = mean;
        comparison.place = place, comparison.people = pairs.size();
        set_interval(comparison, differences);
        comparisons.push_back(comparison);
        if (place == "all") continue;  // is the sum of the others already
        sums.resize(differences.size(), 0.0);
        for (std::size_t b = 0; b < sums.size(); ++b) sums[b] += differences[b];
        mean.people += pairs.size(), ++count;
      }
      if (count < 2) continue;
      for (double& sum : sums) sum /= static_cast<double>(count);
      set_interval(mean, std::move(sums));
      comparisons.push_back(mean);
    }
  }
  return comparisons;
}

}  // namespace sila
