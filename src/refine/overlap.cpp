#include "overlap.hpp"

#include <cmath>

namespace sila::detail {
namespace {

Eigen::AlignedBox2d box_of(const FlowField& field) {
  if (field.extent.isEmpty()) return {};
  const Vector2 reach(field.gp.kernel.length_scales(0), field.gp.kernel.length_scales(1));
  return {field.extent.min() - reach, field.extent.max() + reach};
}

}  // namespace

OverlapIndex::OverlapIndex(const std::vector<Transition>& transitions)
    : posteriors_(transitions.size()), means_(transitions.size()) {
  for (const Transition& transition : transitions) boxes_.push_back(box_of(transition.field));
}

void OverlapIndex::remove(int transition) {
  const auto at = static_cast<std::size_t>(transition);
  boxes_[at].setEmpty();
  posteriors_[at].reset();
  means_[at].reset();
}

void OverlapIndex::replace(int transition, const Transition& content) {
  remove(transition);
  boxes_[static_cast<std::size_t>(transition)] = box_of(content.field);
}

std::vector<int> OverlapIndex::candidates(const Transition& of, double share, const std::vector<bool>& wanted) const {
  const Eigen::MatrixXd& positions = of.field.gp.pseudo_inputs;
  if (positions.cols() == 0) return {};
  const Eigen::AlignedBox2d around(positions.rowwise().minCoeff(), positions.rowwise().maxCoeff());
  const double needed = share * static_cast<double>(positions.cols());
  std::vector<int> result;
  for (std::size_t other = 0; other < boxes_.size(); ++other) {
    if (!wanted[other] || !boxes_[other].intersects(around)) continue;
    int hits = 0;
    for (Eigen::Index m = 0; m < positions.cols(); ++m) hits += boxes_[other].contains(positions.col(m)) ? 1 : 0;
    if (hits > 0 && hits >= needed) result.push_back(static_cast<int>(other));
  }
  return result;
}

const FlowPosterior& OverlapIndex::posterior(int transition, const Transition& content) {
  std::optional<FlowPosterior>& cached = posteriors_[static_cast<std::size_t>(transition)];
  if (!cached) cached.emplace(content.field.gp, content.field.second());
  return *cached;
}

const Eigen::Matrix2Xd& OverlapIndex::own_means(int transition, const Transition& content) {
  std::optional<Eigen::Matrix2Xd>& cached = means_[static_cast<std::size_t>(transition)];
  if (cached) return *cached;
  const Eigen::MatrixXd& places = content.field.gp.pseudo_inputs;
  const FlowPosterior& own = posterior(transition, content);
  cached.emplace(2, places.cols());
  for (Eigen::Index m = 0; m < places.cols(); ++m) cached->col(m) = own.predict(places.col(m)).mean;
  return *cached;
}

std::optional<double> OverlapIndex::difference(int of, const Transition& rare, int by, const Transition& subsumer,
                                               const OverlapCriteria& criteria) {
  const Eigen::MatrixXd& places = rare.field.gp.pseudo_inputs;
  const Eigen::Matrix2Xd& own = own_means(of, rare);
  const FlowPosterior& other = posterior(by, subsumer);
  const double needed = criteria.share * static_cast<double>(places.cols());
  double squares = 0.0;
  double known = 0.0;
  for (Eigen::Index m = 0; m < places.cols(); ++m) {
    if (known + static_cast<double>(places.cols() - m) < needed) return std::nullopt;  // most fail early
    const FieldPrediction predicted = other.predict(places.col(m));
    if (other.unexplained_share(predicted) >= criteria.known_ratio) continue;
    known += 1.0;
    squares += (predicted.mean - own.col(m)).squaredNorm();
  }
  if (known == 0.0 || known < needed) return std::nullopt;
  const double difference = std::sqrt(squares / known);
  return difference < criteria.agreement ? std::optional(difference) : std::nullopt;
}

std::vector<int> remove_transitions(Model& model, const std::vector<bool>& kept) {
  std::vector<Transition> transitions;
  std::vector<bool> touched(model.primitives.size(), false);
  for (std::size_t i = 0; i < model.transitions.size(); ++i) {
    if (!kept[i]) continue;
    touched[static_cast<std::size_t>(model.transitions[i].from)] = true;
    touched[static_cast<std::size_t>(model.transitions[i].to)] = true;
    transitions.push_back(std::move(model.transitions[i]));
  }
  std::vector<int> stay;
  std::vector<int> place(model.primitives.size(), -1);
  std::vector<MotionPrimitive> primitives;
  for (std::size_t p = 0; p < model.primitives.size(); ++p) {
    if (!touched[p]) continue;
    place[p] = static_cast<int>(stay.size());
    stay.push_back(static_cast<int>(p));
    primitives.push_back(std::move(model.primitives[p]));
  }
  for (Transition& transition : transitions) {
    transition.from = place[static_cast<std::size_t>(transition.from)];
    transition.to = place[static_cast<std::size_t>(transition.to)];
  }
  model.transitions = std::move(transitions);
  model.primitives = std::move(primitives);
  return stay;
}

}  // namespace sila::detail
