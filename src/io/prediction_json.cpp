#include <algorithm>
#include <charconv>
#include <cmath>
#include <cstdint>
#include <fstream>
#include <limits>
#include <utility>

#include "io/json_file.hpp"
#include "sila/core/errors.hpp"
#include "sila/io/reports.hpp"
#include "sila/refine/outcomes.hpp"

namespace sila {
namespace {

using nlohmann::json;

nlohmann::ordered_json explanation_json(const Explanation& explanation) {
  nlohmann::ordered_json result{{"likelihood_power", explanation.likelihood_power},
                                {"effective_samples", explanation.effective_samples},
                                {"raw_novelty", explanation.raw_novelty},
                                {"at_least_as_novel", explanation.at_least_as_novel}};
  result["modes"] = nlohmann::ordered_json::array();
  for (const ModeExplanation& mode : explanation.modes) {
    nlohmann::ordered_json entry{{"weight", mode.weight},
                                 {"variant", kVariantKinds[static_cast<std::size_t>(mode.variant)]},
                                 {"primitives", mode.primitives}};
    entry["rollouts"] = nlohmann::ordered_json::array();
    for (const RolloutExplanation& rollout : mode.rollouts) {
      nlohmann::ordered_json transitions = nlohmann::ordered_json::array();
      for (const TransitionCount& use : rollout.transitions)
        transitions.push_back({{"from", use.from}, {"to", use.to}, {"tracks", use.count}});
      entry["rollouts"].push_back({{"weight", rollout.weight},
                                   {"log_likelihood", rollout.log_likelihood},
                                   {"log_prior", rollout.log_prior},
                                   {"chain_probability", rollout.chain_probability},
                                   {"transitions", std::move(transitions)}});
    }
    result["modes"].push_back(std::move(entry));
  }
  return result;
}

Mode mode_of(const json& object) {
  Mode mode;
  mode.weight = object.at("weight").get<double>();
  if (!object.contains("cov"))
    throw std::invalid_argument("a prediction with covariances, made without --no-covariances");
  const json &x = object.at("x"), &y = object.at("y"), &cov = object.at("cov");
  for (std::size_t j = 0; j < x.size(); ++j) {
    mode.path_m.emplace_back(x.at(j).get<double>(), y.at(j).get<double>());
    const double xx = cov.at(j).at(0), xy = cov.at(j).at(1), yy = cov.at(j).at(2);
    mode.covariances_m2.push_back(Matrix2{{xx, xy}, {xy, yy}});
  }
  return mode;
}

/// The probabilities of `starts` or `stops` at each time: linear between the times of `within_s`, from 0 at t0.
/// Throws: std::invalid_argument if they are no probabilities at ascending times.
std::vector<double> at_each_time(const json& changes, const std::vector<double>& times_s) {
  const auto within_s = changes.at("within_s").get<std::vector<double>>();
  const auto known = changes.at("probability").get<std::vector<double>>();
  const auto is_probability = [](double p) { return p >= 0.0 && p <= 1.0; };
  if (within_s.empty() || within_s.size() != known.size() || !(within_s.front() > 0.0) ||
      !std::ranges::is_sorted(within_s) || !std::ranges::all_of(known, is_probability))
    throw std::invalid_argument("starts or stops with a probability for each of within_s");
  std::vector<double> result;
  std::size_t next = 0;
  for (const double t : times_s) {
    while (next + 1 < within_s.size() && within_s[next] < t) ++next;
    const double from_s = next == 0 ? 0.0 : within_s[next - 1], from = next == 0 ? 0.0 : known[next - 1];
    result.push_back(t >= within_s[next] ? known[next]
                                         : from + (known[next] - from) * (t - from_s) / (within_s[next] - from_s));
  }
  return result;
}

/// Rounded weights sum to 1 as nearly as this.
constexpr double kWeightTolerance = 0.01;

/// Throws: std::invalid_argument for a prediction that is no mixture density at each of its times. JSON has no numbers
/// that are not finite.
void require_density(const Prediction& prediction) {
  const std::size_t times = prediction.times_s.size();
  const auto as_long = [&](const Mode& mode) { return mode.path_m.size() == times; };
  if (prediction.modes.empty() || !std::ranges::all_of(prediction.modes, as_long))
    throw std::invalid_argument("modes with a position for each time");
  double sum = 0.0;
  for (const Mode& mode : prediction.modes) sum += mode.weight;
  const auto is_negative = [](const Mode& mode) { return mode.weight < 0.0; };
  if (std::ranges::any_of(prediction.modes, is_negative) || !(std::abs(sum - 1.0) <= kWeightTolerance))
    throw std::invalid_argument("weights of 0 or more that sum to 1");
  const auto is_definite = [](const Matrix2& c) { return c(0, 0) > 0.0 && c.determinant() > 0.0; };
  for (const Mode& mode : prediction.modes) {
    if (!std::ranges::all_of(mode.covariances_m2, is_definite))
      throw std::invalid_argument("covariances that are positive definite");
  }
  const auto has_levels = [&](const Region& region) { return region.levels.size() == times; };
  if (!std::ranges::all_of(prediction.regions, has_levels))
    throw std::invalid_argument("regions with a level for each time");
}

Prediction prediction_of(const json& object) {
  Prediction prediction;
  prediction.t0_s = object.at("t0").get<double>();
  prediction.times_s = object.at("modes").at(0).at("t").get<std::vector<double>>();
  prediction.fallback = object.at("fallback").get<bool>();
  prediction.novelty = object.at("novelty").get<double>();
  prediction.observed_s = object.value("observed_s", 0.0);
  prediction.standing = object.contains("starts");
  const char* change = prediction.standing ? "starts" : "stops";
  if (object.contains(change)) prediction.change_probabilities = at_each_time(object.at(change), prediction.times_s);
  for (const json& mode : object.at("modes")) prediction.modes.push_back(mode_of(mode));
  if (object.contains("outcomes")) {
    const json& outcomes = object.at("outcomes");
    const json &position = outcomes.at("position"), &heading = outcomes.at("heading");
    prediction.standing = outcomes.at("standing").get<bool>();
    prediction.start_m = {position.at(0).get<double>(), position.at(1).get<double>()};
    prediction.heading = {heading.at(0).get<double>(), heading.at(1).get<double>()};
    prediction.mirrored = outcomes.value("mirrored", false);
  }
  if (!object.contains("regions")) return prediction;
  for (const json& region : object.at("regions"))
    prediction.regions.push_back(
        {region.at("probability").get<double>(), region.at("level").get<std::vector<double>>()});
  return prediction;
}

constexpr int kMaxDigits = std::numeric_limits<double>::max_digits10;
constexpr std::array kPowersOfTen{1.0, 1e1, 1e2, 1e3, 1e4, 1e5, 1e6, 1e7, 1e8, 1e9, 1e10, 1e11, 1e12, 1e13, 1e14, 1e15};
constexpr int kFull =
    static_cast<int>(kPowersOfTen.size());  ///< from this number of decimals on a number is written in full

// In a text that is built here a comma follows each value; `close` puts a bracket in the place of the last one.

/// Appends `value` rounded to `decimals`, without trailing zeros. Large values, whose last bit is coarser than that,
/// are written in full.
void add(std::string& text, double value, int decimals) {
  std::array<char, 32> buffer;
  const double scaled = decimals < kFull ? value * kPowersOfTen[static_cast<std::size_t>(decimals)] : HUGE_VAL;
  if (!std::isfinite(value)) {
    text += "null,";
  } else if (std::abs(scaled) >= 0x1p53) {
    text.append(buffer.data(), std::to_chars(buffer.data(), buffer.end(), value).ptr) += ',';
  } else {  // from the last digit to the first: less than half the time of std::to_chars with a precision
    char* first = buffer.end();
    *--first = ',';
    auto rest = static_cast<std::uint64_t>(std::abs(scaled) + 0.5);
    const bool negative = value < 0.0 && rest > 0;
    for (; decimals > 0 && rest % 10 == 0; --decimals) rest /= 10;
    const auto add_digit = [&] { *--first = static_cast<char>('0' + std::exchange(rest, rest / 10) % 10); };
    for (int i = 0; i < decimals; ++i) add_digit();
    if (decimals > 0) *--first = '.';
    do add_digit();
    while (rest > 0);
    if (negative) *--first = '-';
    text.append(first, static_cast<std::size_t>(buffer.end() - first));
  }
}

void close(std::string& text, char bracket) {
  if (text.back() == ',') text.pop_back();
  (text += bracket) += ',';
}

/// Appends `"key":[...]` with what `add_entry(i)` appends for each i below `count`.
void add_list(std::string& text, const char* key, std::size_t count, const auto& add_entry) {
  ((text += '"') += key) += "\":[";
  for (std::size_t i = 0; i < count; ++i) add_entry(i);
  close(text, ']');
}

/// Appends [xx, xy, yy] with at least `decimals`. It adds decimals until rounding changes each eigenvalue by at most a
/// hundredth of the smaller one.
void add_covariance(std::string& text, const Matrix2& c, int decimals) {
  // The smaller eigenvalue is at least determinant / trace; half a unit of error in each entry moves it by one at most.
  const double determinant = 0.01 * c.determinant(), trace = c.trace();
  while (decimals < kFull && !(determinant * kPowersOfTen[static_cast<std::size_t>(decimals)] >= trace)) ++decimals;
  text += '[';
  for (const double entry : {c(0, 0), c(0, 1), c(1, 1)}) add(text, entry, decimals);
  close(text, ']');
}

/// Weights rounded to `decimals` by the method of largest remainders. The sum stays 1 and the order stays the same.
std::vector<double> rounded_weights(const std::vector<Mode>& modes, int decimals) {
  const double unit = decimals < kFull ? kPowersOfTen[static_cast<std::size_t>(decimals)] : 0.0;
  std::vector<double> weights, remainders;
  double missing = 0.0;
  for (const Mode& mode : modes) {
    const double scaled = mode.weight * unit;
    weights.push_back(unit > 0.0 ? std::floor(scaled) / unit : mode.weight);
    remainders.push_back(scaled - std::floor(scaled));
    missing += remainders.back();
  }
  for (missing = std::round(missing); missing > 0.0; --missing) {
    const auto largest = std::ranges::max_element(remainders);
    weights[static_cast<std::size_t>(largest - remainders.begin())] += 1.0 / unit;
    *largest = 0.0;
  }
  return weights;
}

/// Appends u, v and cov_uv.
void add_image(std::string& text, const Mode& mode, const Camera& camera, const LineFormat& format) {
  std::vector<std::optional<Vector2>> path_px;
  for (const Vector2& position_m : mode.path_m) path_px.push_back(to_image(camera, position_m));
  const auto add_points = [&](const char* key, const auto& add_point) {
    add_list(text, key, path_px.size(), [&](std::size_t j) { path_px[j] ? add_point(j) : void(text += "null,"); });
  };
  add_points("u", [&](std::size_t j) { add(text, path_px[j]->x(), format.digits); });
  add_points("v", [&](std::size_t j) { add(text, path_px[j]->y(), format.digits); });
  if (!format.covariances) return;
  add_points("cov_uv", [&](std::size_t j) {
    const Matrix2 jacobian = image_jacobian(camera, mode.path_m[j]);
    add_covariance(text, jacobian * mode.covariances_m2[j] * jacobian.transpose(), format.digits + 1);
  });
}

void add_times(std::string& text, const std::vector<double>& times_s, int digits) {
  add_list(text, "t", times_s.size(), [&](std::size_t j) { add(text, times_s[j], digits); });
}

/// `nearest`: null for a mode without it; `times_s`: for one without times.
void add_mode(std::string& text, const Mode& mode, double weight, const double* nearest,
              const std::vector<double>* times_s, const Camera* camera, const LineFormat& format) {
  const std::size_t steps = mode.path_m.size();
  const int digits = format.digits;
  add(text += "{\"weight\":", weight, digits + 1);
  if (nearest != nullptr) add(text += "\"nearest\":", *nearest, digits + 1);
  if (times_s != nullptr) add_times(text, *times_s, digits);
  add_list(text, "x", steps, [&](std::size_t j) { add(text, mode.path_m[j].x(), digits); });
  add_list(text, "y", steps, [&](std::size_t j) { add(text, mode.path_m[j].y(), digits); });
  if (format.covariances)
    add_list(text, "cov", steps, [&](std::size_t j) { add_covariance(text, mode.covariances_m2[j], digits + 1); });
  if (camera != nullptr) add_image(text, mode, *camera, format);
  add_list(text, "primitives", mode.primitives.size(),
           [&](std::size_t i) { (text += std::to_string(mode.primitives[i])) += ','; });
  ((text += "\"variant\":\"") += kVariantKinds[static_cast<std::size_t>(mode.variant)]) += '"';
  close(text, '}');
}

void add_within(std::string& text, const Prediction& prediction, std::span<const std::size_t> steps, int digits) {
  add_list(text, "within_s", steps.size(), [&](std::size_t i) { add(text, prediction.times_s[steps[i]], digits); });
}

/// Appends the probabilities of having started or stopped.
void add_changes(std::string& text, const Prediction& prediction, std::span<const std::size_t> steps, int digits) {
  text += prediction.standing ? "\"starts\":{" : "\"stops\":{";
  add_within(text, prediction, steps, digits);
  add_list(text, "probability", steps.size(),
           [&](std::size_t i) { add(text, prediction.change_probabilities[steps[i]], digits + 1); });
  close(text, '}');
}

/// Appends the probabilities of outcomes, and what they refer to.
void add_outcomes(std::string& text, const Prediction& prediction, std::span<const std::size_t> steps, int digits) {
  std::vector<OutcomeProbabilities> outcomes;
  for (const std::size_t step : steps) outcomes.push_back(outcome_probabilities(prediction, step));
  const auto add_vector = [&](const char* key, const Vector2& v, int decimals) {
    add_list(text, key, 2, [&](std::size_t i) { add(text, v(static_cast<Eigen::Index>(i)), decimals); });
  };
  text += prediction.standing ? "\"outcomes\":{\"standing\":true," : "\"outcomes\":{\"standing\":false,";
  add_vector("position", prediction.start_m, digits);
  add_vector("heading", prediction.heading, digits + 1);
  if (prediction.mirrored) text += "\"mirrored\":true,";
  add_within(text, prediction, steps, digits);
  for (std::size_t k = 0; k < kOutcomeCount; ++k)
    add_list(text, kOutcomes[k], steps.size(), [&](std::size_t i) { add(text, outcomes[i][k], digits + 1); });
  close(text, '}');
}

}  // namespace

std::string prediction_line(const std::string& track, const Prediction& prediction, const Explanation* explanation,
                            const Camera* camera, const LineFormat& requested) {
  LineFormat format = requested;
  if (format.v1) format.digits = kMaxDigits;
  const int digits = format.digits;
  if (digits < 1 || digits > kMaxDigits)
    throw std::invalid_argument("prediction_line: digits = " + std::to_string(digits) + " is outside [1, 17]");
  std::string text;
  text.reserve(512 + 64 * prediction.modes.size() * prediction.times_s.size());  // enough for three digits
  text += "{\"track\":" + one_line(track);
  add(text += ",\"t0\":", prediction.t0_s, kFull);
  if (!format.v1) add(text += "\"observed_s\":", prediction.observed_s, digits);
  text += prediction.fallback ? "\"fallback\":true," : "\"fallback\":false,";
  add(text += "\"novelty\":", prediction.novelty, digits + 1);
  if (!format.v1) add_times(text, prediction.times_s, digits);
  const std::vector<std::size_t> steps = outcome_steps(prediction);
  if (!format.v1 && !prediction.change_probabilities.empty()) add_changes(text, prediction, steps, digits);
  if (format.outcomes && !prediction.heading.isZero()) add_outcomes(text, prediction, steps, digits);
  const std::vector<double> weights = rounded_weights(prediction.modes, digits + 1);
  const std::vector<double> nearest = format.outcomes ? nearest_probabilities(prediction) : std::vector<double>{};
  add_list(text, "modes", weights.size(), [&](std::size_t m) {
    const bool with_times = m == 0 || format.v1;
    add_mode(text, prediction.modes[m], weights[m], nearest.empty() ? nullptr : &nearest[m],
             with_times ? &prediction.times_s : nullptr, camera, format);
  });
  if (!prediction.regions.empty()) {
    add_list(text, "regions", prediction.regions.size(), [&](std::size_t r) {
      const std::vector<double>& levels = prediction.regions[r].levels;
      add(text += "{\"probability\":", prediction.regions[r].probability, kFull);
      add_list(text, "level", levels.size(), [&](std::size_t j) { add(text, levels[j], digits + 1); });
      close(text, '}');
    });
  }
  if (explanation != nullptr) (text += "\"explanation\":") += one_line(explanation_json(*explanation));
  close(text, '}');
  text.pop_back();
  return text;
}

RecordedPredictions read_predictions(const std::filesystem::path& path) {
  std::ifstream file(path);
  if (!file) throw FormatError(path.string(), 0, "a file of predictions", "no file that can be read");
  RecordedPredictions recorded;
  std::string line;
  for (std::size_t number = 1; std::getline(file, line); ++number) {
    const json object = json::parse(line, nullptr, false);
    if (object.is_object() && !object.contains("modes")) continue;
    try {
      Prediction prediction = prediction_of(object);
      require_density(prediction);
      const double t0_s = prediction.t0_s;
      recorded[{object.at("track").get<std::string>(), t0_s}] = std::move(prediction);
    } catch (const std::invalid_argument& error) {
      throw FormatError(path.string(), number, error.what(), line.substr(0, 80));
    } catch (const json::exception& error) {
      const std::string reason = error.what();  // "[json.exception.NAME.NUMBER] key 'track' not found"
      throw FormatError(path.string(), number, "a prediction",
                        object.is_object() ? reason.substr(reason.find("] ") + 2) : line.substr(0, 80));
    }
  }
  return recorded;
}

}  // namespace sila
