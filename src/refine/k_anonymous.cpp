#include <stdexcept>
#include <string>
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
  for (Site& site : model.sites) forget_positions(site.error_statistics);
  return model;
}

}  // namespace sila
