#include <Eigen/Core>
#include <algorithm>

#include "learn/steps.hpp"

namespace sila {
namespace {

/// Primitives used less by a track do not label it.
constexpr double kMinCoefficient = 0.1;
/// Total score that a change of primitive must gain [samples].
constexpr double kSwitchPenalty = 1.5;
/// Shorter runs join the run before [samples].
constexpr std::size_t kMinRunSamples = 3;

Vector2 arrow_at(const MotionPrimitive& primitive, const CellKey& cell) {
  const auto arrow = std::ranges::lower_bound(primitive.cells, cell, {}, &CellVelocity::cell);
  return arrow != primitive.cells.end() && arrow->cell == cell ? arrow->velocity : Vector2(Vector2::Zero());
}

/// Scores, one row a sample, one column a label.
Eigen::MatrixXd label_scores(const CurbTrajectory& track, std::span<const Coefficient> labels,
                             std::span<const MotionPrimitive> primitives, const Grid& grid) {
  const auto samples = static_cast<Eigen::Index>(track.positions.size());
  Eigen::MatrixXd scores = Eigen::MatrixXd::Zero(samples, static_cast<Eigen::Index>(labels.size()));
  for (Eigen::Index t = 0; t < samples; ++t) {
    const Vector2& velocity = track.velocities[static_cast<std::size_t>(t)];
    if (velocity.isZero() || velocity_to_world(track.frame, velocity).norm() < DictionaryConfig::min_speed_mps)
      continue;
    const CellKey cell = cell_of(grid, track.positions[static_cast<std::size_t>(t)]);
    for (std::size_t k = 0; k < labels.size(); ++k) {
      const Vector2 arrow = arrow_at(primitives[static_cast<std::size_t>(labels[k].primitive)], cell);
      scores(t, static_cast<Eigen::Index>(k)) = labels[k].value * arrow.dot(velocity.normalized());
    }
  }
  return scores;
}

/// The label sequence with the highest total score, minus the penalties of changes (Viterbi); the lower label wins
/// ties.
std::vector<Eigen::Index> best_labels(const Eigen::MatrixXd& scores) {
  const Eigen::Index samples = scores.rows(), labels = scores.cols();
  Eigen::MatrixXi before = Eigen::MatrixXi::Zero(samples, labels);
  Eigen::RowVectorXd total = scores.row(0);
  for (Eigen::Index t = 1; t < samples; ++t) {
    Eigen::Index best = 0;
    const double changed = total.maxCoeff(&best) - kSwitchPenalty;
    Eigen::RowVectorXd next(labels);
    for (Eigen::Index k = 0; k < labels; ++k) {
      const bool stays = total(k) >= changed;
      next(k) = scores(t, k) + (stays ? total(k) : changed);
      before(t, k) = static_cast<int>(stays ? k : best);
    }
    total = next;
  }
  std::vector<Eigen::Index> path(static_cast<std::size_t>(samples));
  total.maxCoeff(&path.back());
  for (Eigen::Index t = samples - 1; t > 0; --t)
    path[static_cast<std::size_t>(t - 1)] = before(t, path[static_cast<std::size_t>(t)]);
  return path;
}

std::vector<Segment> runs_of(const std::vector<Eigen::Index>& path, std::span<const Coefficient> labels) {
  std::vector<Segment> runs;
  for (std::size_t t = 0; t < path.size(); ++t) {
    const int primitive = labels[static_cast<std::size_t>(path[t])].primitive;
    if (runs.empty() || runs.back().primitive != primitive) runs.push_back({primitive, t, t});
    runs.back().end = t + 1;
  }
  return runs;
}

/// Short runs join the one before (a short first run joins the next); equal neighbours become one.
std::vector<Segment> without_short_runs(const std::vector<Segment>& runs) {
  std::vector<Segment> kept;
  for (const Segment& run : runs) {
    const bool is_short = run.end - run.begin < kMinRunSamples;
    if (!kept.empty() && (is_short || kept.back().primitive == run.primitive)) {
      kept.back().end = run.end;
    } else if (kept.size() == 1 && kept.back().end - kept.back().begin < kMinRunSamples) {
      kept.back() = {run.primitive, kept.back().begin, run.end};
    } else {
      kept.push_back(run);
    }
  }
  return kept;
}

}  // namespace

std::vector<Segment> segment(const CurbTrajectory& track, std::span<const Coefficient> code,
                             std::span<const MotionPrimitive> primitives, const Grid& grid) {
  std::vector<Coefficient> labels;
  for (const Coefficient& used : code) {
    if (used.value > kMinCoefficient) labels.push_back(used);
  }
  if (labels.empty() || track.positions.empty()) return {};
  const Eigen::MatrixXd scores = label_scores(track, labels, primitives, grid);
  return without_short_runs(runs_of(best_labels(scores), labels));
}

}  // namespace sila
