// The predictor for a page: a model, made ready once, and predictions of what a pointer draws. Plain numbers go in and
// out (viewer/src/predictor.ts). Nothing is thrown into JavaScript: what is wrong is said by `sila_fail`.

#include "sila/refine/predictor.hpp"

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <exception>
#include <optional>
#include <typeinfo>
#include <utility>
#include <vector>

#include "io/portable_predictor.hpp"
#include "sila/core/sampling.hpp"
#include "sila/refine/regions.hpp"

namespace sila {
namespace {

/// What was loaded, and the last prediction.
struct Session {
  explicit Session(PortablePredictor given) : loaded(std::move(given)), predictor(loaded.model, loaded.predict) {}

  PortablePredictor loaded;
  Predictor predictor;
  Workspace workspace;
  std::vector<double> numbers;  ///< the last answer
};
std::optional<Session> session;

/// A list as its length and its elements.
void add_list(std::vector<double>& numbers, const auto& list) {
  numbers.push_back(static_cast<double>(list.size()));
  numbers.insert(numbers.end(), list.begin(), list.end());
}

void add_mode(std::vector<double>& numbers, const Mode& mode) {
  numbers.push_back(mode.weight);
  add_list(numbers, mode.primitives);
  for (const Vector2& point_m : mode.path_m) numbers.insert(numbers.end(), {point_m.x(), point_m.y()});
  for (const Matrix2& c : mode.covariances_m2) numbers.insert(numbers.end(), {c(0, 0), c(0, 1), c(1, 1)});
}

}  // namespace
}  // namespace sila

using namespace sila;

extern "C" {

/// Given by the page; does not return. `text` ends with 0.
[[noreturn, clang::import_module("env"), clang::import_name("sila_fail")]] void sila_fail(const char* text);

// In the place of the exceptions of C++, for which the page would need a larger predictor and a newer browser. Every
// exception that sila throws has std::exception as the first base of its type.
void* __cxa_allocate_exception(std::size_t bytes) {
  return std::malloc(bytes);
}
[[noreturn]] void __cxa_throw(void* thrown, std::type_info*, void (*)(void*)) {
  sila_fail(static_cast<const std::exception*>(thrown)->what());
}

/// Memory that the page may write to.
void* sila_allocate(std::size_t bytes) {
  return std::malloc(bytes);
}

/// Takes the bytes of `predictor_bytes`, which may be freed then. The answer begins with the frame of the site (origin,
/// axis 1, axis 2 [m], unit [m]), then the interval between samples and the seconds that are observed at most [s].
const double* sila_load(char* bytes, std::size_t count) {
  session.emplace(predictor_of_bytes({bytes, count}));
  std::free(bytes);
  const CurbFrame& frame = session->loaded.frame;
  session->numbers.clear();
  for (const Vector2& part : {frame.origin_m, frame.axis_1, frame.axis_2, frame.unit_m})
    session->numbers.insert(session->numbers.end(), {part.x(), part.y()});
  session->numbers.push_back(session->predictor.interval_s());
  session->numbers.push_back(session->loaded.predict.observe_s);
  return session->numbers.data();
}

/// A prediction at the end of a track of `count` samples, each its time [s], x and y [m]. The answer: novelty, whether
/// it is a fallback; the times, change probabilities and modes (weight; primitives; x and y of each time; xx, xy and yy
/// of each time), each list after its length; the number of regions and for each its probability and its levels.
const double* sila_predict(const double* samples, std::size_t count) {
  Trajectory track;
  for (std::size_t i = 0; i < count; ++i, samples += 3) {
    track.times_s.push_back(samples[0]);
    track.positions_m.emplace_back(samples[1], samples[2]);
  }
  validate(track);
  const PortablePredictor& loaded = session->loaded;
  const Prediction& prediction = session->predictor.predict(
      observe(track, count - 1, loaded.frame, loaded.predict.observe_s, loaded.sampling), session->workspace);
  std::vector<double>& numbers = session->numbers;
  numbers.assign({prediction.novelty, prediction.fallback ? 1.0 : 0.0});
  add_list(numbers, prediction.times_s);
  add_list(numbers, prediction.change_probabilities);
  numbers.push_back(static_cast<double>(prediction.modes.size()));
  for (const Mode& mode : prediction.modes) add_mode(numbers, mode);
  numbers.push_back(static_cast<double>(prediction.regions.size()));
  for (const Region& region : prediction.regions) {
    numbers.push_back(region.probability);
    numbers.insert(numbers.end(), region.levels.begin(), region.levels.end());
  }
  return numbers.data();
}

/// Nonconformity scores of the last prediction at a step, on a raster of columns x rows points, row by row, the first
/// at (x, y), `cell` apart [m].
const double* sila_scores(std::size_t step, double x, double y, double cell, std::size_t columns, std::size_t rows) {
  const Prediction& prediction = session->workspace.prediction;
  // The peak is that of all points: found once.
  const Vector2 start(x, y);
  const double peak = nonconformity(prediction, step, start) + std::log(unnormalised_density(prediction, step, start));
  std::vector<double>& numbers = session->numbers;
  numbers.resize(columns * rows);
  for (std::size_t i = 0; i < numbers.size(); ++i) {
    const Vector2 point = start + cell * Vector2(static_cast<double>(i % columns), static_cast<double>(i / columns));
    numbers[i] = std::max(0.0, peak - std::log(unnormalised_density(prediction, step, point)));
  }
  return numbers.data();
}
}
