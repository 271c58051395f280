#include "sila/evaluate/training_support.hpp"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <map>
#include <numbers>
#include <set>

#include "core/kinematics.hpp"

namespace sila {
namespace {

constexpr double kAlike_m = 2.0;
constexpr double kAlike_mps = 0.5;
constexpr double kStays_m = 1.0;
constexpr double kFullTurn_rad = 2.0 * std::numbers::pi;
constexpr double kGap_rad = 20.0 * std::numbers::pi / 180.0;
constexpr double kLeastShare = 0.15;
constexpr std::size_t kLeastPeople = 12;
constexpr double kLeastProbability = 1e-4;
/// Numbers of radii of equal probability, and of directions, at which a Gaussian is evaluated.
constexpr int kRadii = 8, kDirections = 16;

double direction_of(const Vector2& way) {
  return std::atan2(way.y(), way.x());
}

Vector2 velocity_of(const Window& window, double interval_s) {
  return (constant_velocity(window.past_m, 1, interval_s).front() - window.past_m.back()) / interval_s;
}

/// Directions separated at their gaps round the circle.
std::vector<std::vector<double>> clusters_of(std::vector<double> directions_rad) {
  std::vector<std::vector<double>> clusters;
  if (directions_rad.empty()) return clusters;
  std::ranges::sort(directions_rad);
  for (const double direction : directions_rad) {
    if (clusters.empty() || direction - clusters.back().back() >= kGap_rad) clusters.emplace_back();
    clusters.back().push_back(direction);
  }
  if (clusters.size() > 1 && directions_rad.front() + kFullTurn_rad - directions_rad.back() < kGap_rad) {
    for (const double direction : clusters.front()) clusters.back().push_back(direction + kFullTurn_rad);
    clusters.erase(clusters.begin());
  }
  return clusters;
}

std::size_t nearest_way(std::span<const Way> ways, const Vector2& way_m) {
  const auto stays = std::ranges::find(ways, true, &Way::stays);
  const auto index = [&](auto way) { return static_cast<std::size_t>(way - ways.begin()); };
  if (stays != ways.end() && way_m.norm() < kStays_m) return index(stays);
  const double direction = direction_of(way_m);
  return index(std::ranges::min_element(ways, {}, [&](const Way& way) {
    return way.stays ? kFullTurn_rad : std::abs(std::remainder(way.direction_rad - direction, kFullTurn_rad));
  }));
}

std::pair<int, int> cell_at(const Vector2& position_m) {
  return {static_cast<int>(std::floor(position_m.x())), static_cast<int>(std::floor(position_m.y()))};
}

}  // namespace

std::vector<Passage> passages_of(std::span<const Window> windows, double interval_s) {
  std::vector<Passage> passages;
  for (const Window& window : windows)
    passages.push_back({person_of(window.observed.id), window.past_m.back(), velocity_of(window, interval_s),
                        window.future_m.back() - window.past_m.back()});
  return passages;
}

std::vector<Way> ways_on(std::span<const Passage> passages, const Window& window, double interval_s) {
  const Vector2 here = window.past_m.back(), velocity = velocity_of(window, interval_s);
  std::map<std::string, const Passage*> people;  // of each person the most similar passage
  const auto difference = [&](const Passage& passage) {
    return (passage.position_m - here).norm() / kAlike_m + (passage.velocity_mps - velocity).norm() / kAlike_mps;
  };
  for (const Passage& passage : passages) {
    if ((passage.position_m - here).norm() > kAlike_m || (passage.velocity_mps - velocity).norm() > kAlike_mps)
      continue;
    const Passage*& best = people[passage.person];
    if (best == nullptr || difference(passage) < difference(*best)) best = &passage;
  }
  if (people.size() < kLeastPeople) return {};
  const double share_of_person = 1.0 / static_cast<double>(people.size());
  Way stay{true, 0.0, 0.0};
  std::vector<double> directions_rad;
  for (const auto& [id, passage] : people) {
    if (passage->way_m.norm() < kStays_m)
      stay.share += share_of_person;
    else
      directions_rad.push_back(direction_of(passage->way_m));
  }
  std::vector<Way> ways{stay};
  for (const std::vector<double>& cluster : clusters_of(std::move(directions_rad))) {
    Vector2 sum = Vector2::Zero();
    for (const double direction : cluster) sum += Vector2(std::cos(direction), std::sin(direction));
    ways.push_back({false, direction_of(sum), share_of_person * static_cast<double>(cluster.size())});
  }
  std::erase_if(ways, [](const Way& way) { return way.share < kLeastShare; });
  return ways;
}

std::optional<double> probability_of_way_taken(const Prediction& prediction, const Window& window,
                                               std::span<const Way> ways) {
  if (ways.size() < 2) return std::nullopt;
  const Vector2 here = window.past_m.back();
  const std::size_t taken = nearest_way(ways, window.future_m.back() - here);
  double probability = 0.0;
  for (const Mode& mode : prediction.modes) {
    const Matrix2 factor = mode.covariances_m2.back().llt().matrixL();
    int hits = 0;
    for (int r = 0; r < kRadii; ++r) {
      const double radius = std::sqrt(-2.0 * std::log(1.0 - (r + 0.5) / kRadii));  // of a Gaussian in two dimensions
      for (int d = 0; d < kDirections; ++d) {
        const double angle = kFullTurn_rad * (d + 0.5 * (r % 2)) / kDirections;
        const Vector2 point = mode.path_m.back() + factor * radius * Vector2(std::cos(angle), std::sin(angle));
        hits += nearest_way(ways, point - here) == taken ? 1 : 0;
      }
    }
    probability += mode.weight * hits / (kRadii * kDirections);
  }
  return std::max(probability, kLeastProbability);
}

CoveredArea covered_area(std::span<const FramedTrajectory> tracks) {
  std::set<std::pair<int, int>> touched, covered;
  for (const FramedTrajectory& framed : tracks) {
    for (const Vector2& position_m : framed.track.positions_m) touched.insert(cell_at(position_m));
  }
  for (const auto& [x, y] : touched) {
    for (int dx = -1; dx <= 1; ++dx) {
      for (int dy = -1; dy <= 1; ++dy) covered.emplace(x + dx, y + dy);
    }
  }
  return {covered.begin(), covered.end()};
}

bool contains(const CoveredArea& area, const Vector2& position_m) {
  return std::ranges::binary_search(area, cell_at(position_m));
}

}  // namespace sila
