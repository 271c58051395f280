#include "coverage.hpp"

#include <algorithm>
#include <cmath>

#include "sila/core/buckets.hpp"

namespace sila::detail {
FieldIndex::FieldIndex(const std::vector<Transition>& transitions, double bucket_size)
    : bucket_size_(bucket_size),
      posteriors_(transitions.size()),
      means_(transitions.size()),
      boxes_(transitions.size()) {
  for (std::size_t i = 0; i < transitions.size(); ++i) insert(static_cast<int>(i), transitions[i]);
}

void FieldIndex::insert(int transition, const Transition& content) {
  const auto at = static_cast<std::size_t>(transition);
  if (content.field.extent.isEmpty()) return;
  const SparseGp& gp = content.field.gp;
  const Vector2 reach(gp.kernel.length_scales(0), gp.kernel.length_scales(1));
  boxes_[at] = Eigen::AlignedBox2d(content.field.extent.min() - reach, content.field.extent.max() + reach);
  const auto enter = [transition](std::vector<int>& list) {
    if (std::find(list.begin(), list.end(), transition) == list.end()) list.push_back(transition);
  };
  if (!(count_buckets(boxes_[at].min(), boxes_[at].max(), bucket_size_) <= kMostBuckets)) {
    for (auto& [key, bucket] : buckets_) std::erase(bucket, transition);  // where it was when it was narrower
    return enter(wide_);
  }
  if (std::find(wide_.begin(), wide_.end(), transition) != wide_.end()) return;
  for_each_bucket(boxes_[at].min(), boxes_[at].max(), bucket_size_,
                  [&](std::int64_t key, const Vector2&) { enter(buckets_[key]); });
}

void FieldIndex::remove(int transition) {
  boxes_[static_cast<std::size_t>(transition)].setEmpty();
  posteriors_[static_cast<std::size_t>(transition)].reset();
  means_[static_cast<std::size_t>(transition)].reset();
}

void FieldIndex::replace(int transition, const Transition& content) {
  posteriors_[static_cast<std::size_t>(transition)].reset();
  means_[static_cast<std::size_t>(transition)].reset();
  insert(transition, content);
}

std::vector<int> FieldIndex::candidates(const Transition& of, double share, const std::vector<bool>& wanted) const {
  const Eigen::MatrixXd& places = of.field.gp.pseudo_inputs;
  std::vector<int> hits(boxes_.size(), 0);
  for (Eigen::Index m = 0; m < places.cols(); ++m) {
    const Vector2 place = places.col(m);
    const auto count = [&](const std::vector<int>& list) {
      for (const int index : list) {
        const auto other = static_cast<std::size_t>(index);
        if (wanted[other] && boxes_[other].contains(place)) ++hits[other];
      }
    };
    count(wide_);
    const auto found = buckets_.find(bucket_of(places.col(m), bucket_size_));
    if (found != buckets_.end()) count(found->second);
  }
  std::vector<int> result;
  for (std::size_t other = 0; other < hits.size(); ++other) {
    if (hits[other] > 0 && hits[other] >= share * static_cast<double>(places.cols()))
      result.push_back(static_cast<int>(other));
  }
  return result;
}

const FlowPosterior& FieldIndex::posterior(int transition, const Transition& content) {
  std::optional<FlowPosterior>& cached = posteriors_[static_cast<std::size_t>(transition)];
  if (!cached) cached.emplace(content.field.gp, content.field.second());
  return *cached;
}

const Eigen::Matrix2Xd& FieldIndex::own_means(int transition, const Transition& content) {
  std::optional<Eigen::Matrix2Xd>& cached = means_[static_cast<std::size_t>(transition)];
  if (cached) return *cached;
  const Eigen::MatrixXd& places = content.field.gp.pseudo_inputs;
  const FlowPosterior& own = posterior(transition, content);
  cached.emplace(2, places.cols());
  for (Eigen::Index m = 0; m < places.cols(); ++m) cached->col(m) = own.predict(places.col(m)).mean;
  return *cached;
}

std::optional<double> FieldIndex::difference(int of, const Transition& asked, int by, const Transition& speaker,
                                             const Coverage& coverage) {
  const Eigen::MatrixXd& places = asked.field.gp.pseudo_inputs;
  const Eigen::Matrix2Xd& own = own_means(of, asked);
  const FlowPosterior& other = posterior(by, speaker);
  const double needed = coverage.share * static_cast<double>(places.cols());
  double squares = 0.0;
  double known = 0.0;
  for (Eigen::Index m = 0; m < places.cols(); ++m) {
    if (known + static_cast<double>(places.cols() - m) < needed) return std::nullopt;  // most fail early
    const FieldPrediction said = other.predict(places.col(m));
    if (other.unexplained_share(said) >= coverage.known_ratio) continue;
    known += 1.0;
    squares += (said.mean - own.col(m)).squaredNorm();
  }
  if (known == 0.0 || known < needed) return std::nullopt;
  const double difference = std::sqrt(squares / known);
  return difference < coverage.agreement ? std::optional(difference) : std::nullopt;
}

std::vector<int> thin_out(Model& model, const std::vector<bool>& kept) {
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
