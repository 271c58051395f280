#pragma once

#include <optional>
#include <span>
#include <string>
#include <vector>

#include "sila/predict/prediction.hpp"
#include "sila/refine/error_statistics.hpp"

namespace sila {

/// How a training window came along and where it led, in the world frame.
struct Passage {
  std::string person;
  Vector2 position_m = Vector2::Zero();
  Vector2 velocity_mps = Vector2::Zero();  ///< of the last 0.8 s
  Vector2 way_m = Vector2::Zero();         ///< displacement from t0 to the horizon
};

/// Where windows with their whole future led.
std::vector<Passage> passages_of(std::span<const Window* const> windows, double interval_s);

/// A way on from one place: to stay, or a direction.
struct Way {
  bool stays = false;
  double direction_rad = 0.0;
  double share = 0.0;  ///< of the people who came along in the same way
};

/// The ways that people took who came along in the same way: within 2 m and 0.5 m/s. People who went less than 1 m
/// stay; the directions of the others are parted where they leave a gap of at least 20 degrees. Only ways that at least
/// 15 % took; none unless at least 12 people came along in the same way.
std::vector<Way> ways_on(std::span<const Passage> passages, const Window& window, double interval_s);

/// At a fork, which is where `ways` are two or more: the probability that a prediction gives, at the whole horizon, to
/// the way that the window took. Every place belongs to the way it is nearest to: within 1 m of the start to staying,
/// else to the nearest direction. At least 1e-4. Nothing elsewhere.
/// Differs from a likelihood: only the choice of the way counts, not how far along it the person went.
std::optional<double> probability_of_way_taken(const Prediction& prediction, const Window& window,
                                               std::span<const Way> ways);

}  // namespace sila
