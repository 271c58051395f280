#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include "overlap.hpp"
#include "sila/refine/prune.hpp"

namespace sila {

Model k_anonymous(Model model, int min_people) {
  if (min_people < 1)
    throw std::invalid_argument("k_anonymous: min_people = " + std::to_string(min_people) + ", must be at least 1");
  const auto known = [&](int primitive) {
    return model.primitives[static_cast<std::size_t>(primitive)].support >= min_people;
  };
  std::vector<bool> kept;
  for (const Transition& transition : model.transitions)
    kept.push_back(transition.support >= min_people && known(transition.from) && known(transition.to));
  detail::remove_transitions(model, kept);
  // The sums of the path correction depend on positions, also on those where only one person was.
  for (Site& site : model.sites) {
    ErrorStatistics& all = site.error_statistics;
    if (all.empty()) continue;
    ErrorStatistics zero = zero_error_statistics(all.steps, all.interval_s, all.observe_s);
    all.correction = std::move(zero.correction);
    all.correction_share = std::move(zero.correction_share);
  }
  return model;
}

}  // namespace sila
