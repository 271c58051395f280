#include "refine/overlap.hpp"

#include <cmath>

#include "core/indices.hpp"
#include "sila/refine/prune.hpp"

namespace sila {
namespace {

Eigen::AlignedBox2d box_of(const FlowField& field) {
  if (field.extent.isEmpty()) return {};
  const Vector2 reach(field.gp.kernel.length_scales(0), field.gp.kernel.length_scales(1));
  return {field.extent.min() - reach, field.extent.max() + reach};
}

}  // namespace

OverlapIndex::OverlapIndex(const std::vector<Transition>& transitions)
    : transitions_(transitions), posteriors_(transitions.size()), means_(transitions.size()) {
  for (const Transition& transition : transitions) boxes_.push_back(box_of(transition.field));
}

void OverlapIndex::replace(std::size_t transition) {
  posteriors_[transition].reset();
  means_[transition].reset();
  boxes_[transition] = box_of(transitions_[transition].field);
}

std::vector<std::size_t> OverlapIndex::candidates(std::size_t of, double share, const std::vector<bool>& wanted) const {
  const Eigen::MatrixXd& positions = transitions_[of].field.gp.pseudo_inputs;
  if (positions.cols() == 0) return {};
  const Eigen::AlignedBox2d around(positions.rowwise().minCoeff(), positions.rowwise().maxCoeff());
  const double needed = share * static_cast<double>(positions.cols());
  std::vector<std::size_t> result;
  for (std::size_t other = 0; other < boxes_.size(); ++other) {
    if (!wanted[other] || !boxes_[other].intersects(around)) continue;
    int hits = 0;
    for (Eigen::Index m = 0; m < positions.cols(); ++m) hits += boxes_[other].contains(positions.col(m)) ? 1 : 0;
    if (hits > 0 && hits >= needed) result.push_back(other);
  }
  return result;
}

const FlowPosterior& OverlapIndex::posterior(std::size_t transition) {
  std::optional<FlowPosterior>& cached = posteriors_[transition];
  const FlowField& field = transitions_[transition].field;
  if (!cached) cached.emplace(field.gp, field.second());
  return *cached;
}

const Eigen::Matrix2Xd& OverlapIndex::own_means(std::size_t transition) {
  std::optional<Eigen::Matrix2Xd>& cached = means_[transition];
  if (cached) return *cached;
  const Eigen::MatrixXd& positions = transitions_[transition].field.gp.pseudo_inputs;
  const FlowPosterior& own = posterior(transition);
  cached.emplace(2, positions.cols());
  for (Eigen::Index m = 0; m < positions.cols(); ++m) cached->col(m) = own.predict(positions.col(m)).mean;
  return *cached;
}

bool knows(const FlowPosterior& field, const FieldPrediction& predicted) {
  return field.unexplained_share(predicted) < PruneConfig::known_ratio;
}

std::optional<double> OverlapIndex::difference(std::size_t of, std::size_t by, double agreement) {
  const Eigen::MatrixXd& positions = transitions_[of].field.gp.pseudo_inputs;
  const Eigen::Matrix2Xd& own = own_means(of);
  const FlowPosterior& other = posterior(by);
  const double needed = PruneConfig::agreement_share * static_cast<double>(positions.cols());
  double squares = 0.0;
  double known = 0.0;
  for (Eigen::Index m = 0; m < positions.cols(); ++m) {
    if (known + static_cast<double>(positions.cols() - m) < needed) return std::nullopt;  // most fail early
    const FieldPrediction predicted = other.predict(positions.col(m));
    if (!knows(other, predicted)) continue;
    known += 1.0;
    squares += (predicted.mean - own.col(m)).squaredNorm();
  }
  if (known == 0.0 || known < needed) return std::nullopt;
  const double difference = std::sqrt(squares / known);
  return difference < agreement ? std::optional(difference) : std::nullopt;
}

std::vector<int> remove_transitions(Model& model, const std::vector<bool>& kept) {
  std::vector<Transition> transitions;
  std::vector<SparseGp> residuals;
  std::vector<bool> touched(model.primitives.size(), false);
  for (std::size_t i = 0; i < model.transitions.size(); ++i) {
    if (!kept[i]) continue;
    touched[static_cast<std::size_t>(model.transitions[i].from)] = true;
    touched[static_cast<std::size_t>(model.transitions[i].to)] = true;
    transitions.push_back(std::move(model.transitions[i]));
    if (!model.refinement.residuals.empty()) residuals.push_back(std::move(model.refinement.residuals[i]));
  }
  std::vector<int> stay;
  std::vector<MotionPrimitive> primitives;
  for (std::size_t p = 0; p < model.primitives.size(); ++p) {
    if (!touched[p]) continue;
    stay.push_back(static_cast<int>(p));
    primitives.push_back(std::move(model.primitives[p]));
  }
  const std::vector<int> new_index = inverse_of(stay, touched.size());
  for (Transition& transition : transitions) {
    transition.from = new_index[static_cast<std::size_t>(transition.from)];
    transition.to = new_index[static_cast<std::size_t>(transition.to)];
  }
  model.transitions = std::move(transitions);
  model.refinement.residuals = std::move(residuals);
  model.primitives = std::move(primitives);
  return stay;
}

}  // namespace sila
