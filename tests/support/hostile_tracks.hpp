#pragma once

// Tracks that no tracker should give and that some tracker will.

#include <array>
#include <cstdint>
#include <random>
#include <string>
#include <vector>

#include "support/walks.hpp"

namespace sila::testing {

enum class Hostile {
  standing,
  identical_points,
  thousand_in_one_cell,
  collinear,
  far_away,
  millimetre_grid,
  reversals,
  one_sample,
  two_samples,
  tiny_steps,
  huge_steps,
  one_huge_jump,
  many_huge_jumps,
  tracker_noise,
  late_clock,
  ordinary,
};

inline constexpr std::array kHostileNames = {
    "standing",        "identical_points", "thousand_in_one_cell", "collinear",  "far_away",   "millimetre_grid",
    "reversals",       "one_sample",       "two_samples",          "tiny_steps", "huge_steps", "one_huge_jump",
    "many_huge_jumps", "tracker_noise",    "late_clock",           "ordinary"};
inline constexpr int kHostileKinds = static_cast<int>(kHostileNames.size());

/// Draws hostile tracks; the same seed gives the same ones.
class HostileTracks {
 public:
  explicit HostileTracks(std::uint64_t seed) : random_(seed) {}

  FramedTrajectory draw(Hostile kind, const std::string& id) {
    Trajectory track = path(kind);
    track.id = id;
    return {std::move(track), square_frame()};
  }

  /// Tracks of random kinds; about one in three is an ordinary walk.
  std::vector<FramedTrajectory> mixture(int count) {
    std::vector<FramedTrajectory> tracks;
    for (int i = 0; i < count; ++i) {
      const bool usual = uniform(0.0, 1.0) < 0.3;
      const auto kind = usual ? Hostile::ordinary : static_cast<Hostile>(random_() % kHostileKinds);
      tracks.push_back(draw(kind, std::string(kHostileNames[static_cast<std::size_t>(kind)]) + std::to_string(i)));
    }
    return tracks;
  }

  /// Tracks of one kind; with `all_alike` the same one again and again.
  std::vector<FramedTrajectory> many(Hostile kind, int count, bool all_alike) {
    std::vector<FramedTrajectory> tracks;
    for (int i = 0; i < count; ++i) {
      tracks.push_back(all_alike && i > 0 ? tracks.front() : draw(kind, ""));
      tracks.back().track.id = "t" + std::to_string(i);
    }
    return tracks;
  }

  double uniform(double low, double high) { return std::uniform_real_distribution<double>(low, high)(random_); }
  std::uint64_t number() { return random_(); }

 private:
  Vector2 somewhere(double radius_m) { return {uniform(-radius_m, radius_m), uniform(-radius_m, radius_m)}; }
  Vector2 noise(double std_m) {
    std::normal_distribution<double> normal(0.0, std_m);
    return {normal(random_), normal(random_)};
  }

  Trajectory walk_somewhere(double speed_mps) {
    const Vector2 from = somewhere(14.0), over = somewhere(3.0), to = somewhere(14.0);
    return walk("", {from, over, to}, speed_mps, 0.1, 0.02, static_cast<unsigned>(random_()));
  }

  Trajectory path(Hostile kind) {
    const Vector2 place = somewhere(14.0), way = somewhere(1.0);
    switch (kind) {
      case Hostile::standing:
        return sampled(100, 0.1, [&](int) { return Vector2(place + noise(0.01)); });
      case Hostile::identical_points:
        return sampled(100, 0.1, [&](int) { return place; });
      case Hostile::thousand_in_one_cell:
        return sampled(1000, 0.05, [&](int) { return Vector2(Vector2(0.5, 0.5) + somewhere(0.45)); });
      case Hostile::collinear:
        return sampled(100, 0.1, [&](int k) { return Vector2(place + 0.1 * k * Vector2::UnitX()); });
      case Hostile::far_away:
        return sampled(100, 0.1, [&](int k) { return Vector2(Vector2(1e6, -1e6) + place + 0.1 * k * way); });
      case Hostile::millimetre_grid:
        return sampled(200, 0.05,
                       [&](int k) { return Vector2((1e3 * (place + 1e-3 * k * way)).array().round().matrix() / 1e3); });
      case Hostile::reversals:
        return sampled(150, 0.1,
                       [&](int k) { return Vector2(place + (k % 20 < 10 ? k % 20 : 20 - k % 20) * 0.15 * way); });
      case Hostile::one_sample:
        return sampled(1, 0.1, [&](int) { return place; });
      case Hostile::two_samples:
        return sampled(2, uniform(0.01, 6.0), [&](int k) { return Vector2(place + k * way); });
      case Hostile::tiny_steps:
        return sampled(2000, 1e-6, [&](int k) { return Vector2(place + 1e-3 * k * way + noise(0.01)); });
      case Hostile::huge_steps:
        return sampled(8, 59.0, [&](int) { return somewhere(14.0); });
      case Hostile::one_huge_jump: {
        Trajectory track = walk_somewhere(1.3);
        track.positions_m[random_() % track.positions_m.size()] += somewhere(1e6);
        return track;
      }
      case Hostile::many_huge_jumps:
        return sampled(80, 0.1, [&](int) { return somewhere(1e6); });
      case Hostile::tracker_noise:
        return sampled(100, 0.1, [&](int k) { return Vector2(place + 0.1 * k * way + noise(1.0)); });
      case Hostile::late_clock: {
        Trajectory track = walk_somewhere(1.3);
        for (double& time_s : track.times_s) time_s += 1e12 - 1e3;
        return track;
      }
      case Hostile::ordinary:
        return walk_somewhere(uniform(0.6, 2.0));
    }
    return {};
  }

  std::mt19937_64 random_;
};

}  // namespace sila::testing
