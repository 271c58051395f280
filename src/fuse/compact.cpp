#include "sila/fuse/compact.hpp"

#include <algorithm>
#include <bit>
#include <limits>
#include <numeric>
#include <utility>

#include "coverage.hpp"
#include "fuse_fields.hpp"

namespace sila {
namespace {

/// The model while it is compacted: transitions keep their indices, those that are gone are not `kept`.
struct Workbench {
  std::vector<Transition>& transitions;
  detail::FieldIndex index;
  std::vector<bool> kept;
  std::vector<bool> changed;     ///< in this round or the one before: only pairs with such a one are looked at
  std::vector<bool> fresh;       ///< changed since an earlier compaction left it
  std::vector<bool> old_before;  ///< that compaction looked for who speaks for it, and of what it left nobody does
};

template <class Condition>
std::vector<bool> marked(const std::vector<Transition>& transitions, Condition&& condition) {
  std::vector<bool> marks(transitions.size());
  std::transform(transitions.begin(), transitions.end(), marks.begin(), condition);
  return marks;
}

bool seen_long_ago(const Transition& transition, double episodes, const CompactConfig& config) {
  return episodes - transition.last_episode >= config.forget_after_episodes;
}

/// Less of a trajectory than this is left of nobody but who has faded (half_life_episodes).
constexpr double kFaded = 0.5;

/// The transition that speaks for `rare` with the least difference; -1 if none does. It was seen as often at least, or
/// more often than that.
int best_speaker(Workbench& bench, int rare, const std::vector<bool>& news, const detail::Coverage& coverage,
                 bool more_often) {
  const auto at = [&](int i) -> const Transition& { return bench.transitions[static_cast<std::size_t>(i)]; };
  int best = -1;
  double least = 0.0;
  std::vector<bool> may_speak = news[static_cast<std::size_t>(rare)] ? bench.kept : news;
  may_speak[static_cast<std::size_t>(rare)] = false;
  for (const int other : bench.index.candidates(at(rare), coverage.share, may_speak)) {
    if (at(other).count < at(rare).count || (more_often && at(other).count == at(rare).count)) continue;
    const auto difference = bench.index.difference(rare, at(rare), other, at(other), coverage);
    if (!difference || (best >= 0 && *difference >= least)) continue;
    best = other;
    least = *difference;
  }
  return best;
}

void absorb(Workbench& bench, int rare, int into, const FuseConfig& fusing, const OutlookConfig& outlook) {
  Transition& target = bench.transitions[static_cast<std::size_t>(into)];
  const Transition& source = bench.transitions[static_cast<std::size_t>(rare)];
  const detail::FieldSources both{{&target, &source}, {}, {}};
  Transition fused{target.from,
                   target.to,
                   target.count + source.count,
                   detail::fuse_fields(both, fusing.gp),
                   detail::fuse_outlooks(both, outlook_gp_config(outlook)),
                   std::max(target.last_episode, source.last_episode),
                   std::max(target.support, source.support)};
  target = std::move(fused);
  bench.kept[static_cast<std::size_t>(rare)] = false;
  bench.index.remove(rare);
  bench.index.replace(into, target);
  bench.changed[static_cast<std::size_t>(into)] = bench.fresh[static_cast<std::size_t>(into)] = true;
}

/// Absorbs until nothing agrees any more, for what has grown may agree with what it did not agree with before.
int absorb_rare(Workbench& bench, std::vector<bool> news, double max_count, const detail::Coverage& coverage,
                const FuseConfig& fusing, const OutlookConfig& outlook) {
  std::vector<int> order(bench.transitions.size());
  std::iota(order.begin(), order.end(), 0);
  int absorbed = 0;
  for (; std::find(news.begin(), news.end(), true) != news.end();
       news = std::exchange(bench.changed, std::vector<bool>(order.size(), false))) {
    std::stable_sort(order.begin(), order.end(), [&](int a, int b) {  // the rarest first
      return bench.transitions[static_cast<std::size_t>(a)].count <
             bench.transitions[static_cast<std::size_t>(b)].count;
    });
    for (const int rare : order) {
      if (!bench.kept[static_cast<std::size_t>(rare)]) continue;
      if (bench.transitions[static_cast<std::size_t>(rare)].count > max_count) continue;
      const int speaker = best_speaker(bench, rare, news, coverage, false);
      if (speaker < 0) continue;
      absorb(bench, rare, speaker, fusing, outlook);
      ++absorbed;
    }
  }
  return absorbed;
}

/// What was seen at most `forget_count` times, and not for long, becomes part of a transition that was seen more often
/// and knows its place, whatever that one says: of those the one that differs least. Where nobody else knows the place
/// it stays, until it has faded.
CompactReport let_go_of_old(Workbench& bench, double episodes, const CompactConfig& config, detail::Coverage coverage,
                            const FuseConfig& fusing, const OutlookConfig& outlook) {
  CompactReport report;
  coverage.agreement = std::numeric_limits<double>::infinity();
  const std::vector<bool> all(bench.transitions.size(), true);
  for (std::size_t i = 0; i < bench.transitions.size(); ++i) {
    const Transition& old = bench.transitions[i];
    if (!bench.kept[i] || old.count > config.forget_count || !seen_long_ago(old, episodes, config)) continue;
    const int speaker =
        best_speaker(bench, static_cast<int>(i), bench.old_before[i] ? bench.fresh : all, coverage, true);
    if (speaker >= 0) {
      absorb(bench, static_cast<int>(i), speaker, fusing, outlook);
      ++report.absorbed;
    } else if (old.count < kFaded) {
      bench.kept[i] = false;
      bench.index.remove(static_cast<int>(i));
      ++report.forgotten;
    }
  }
  return report;
}

}  // namespace

Settled::Settled(const Model& compacted, const CompactConfig& config) {
  for (const Transition& transition : compacted.transitions)
    old_before_[mark_of(transition)] = seen_long_ago(transition, compacted.episodes, config);
}

bool Settled::holds_as_old(const Transition& transition) const {
  const auto place = old_before_.find(mark_of(transition));
  return place != old_before_.end() && place->second;
}

Settled::Mark Settled::mark_of(const Transition& transition) {
  const SparseGp& gp = transition.field.gp;
  return {std::bit_cast<std::uint64_t>(transition.count), std::bit_cast<std::uint64_t>(gp.points),
          std::bit_cast<std::uint64_t>(gp.mean_response.sum()), std::bit_cast<std::uint64_t>(gp.response.sum())};
}

Compacted compact(Model model, const CompactConfig& config, const FuseConfig& fusing, const OutlookConfig& outlook,
                  const Settled& before) {
  validate_fields("compact", config);
  Compacted result;
  const std::size_t primitives = model.primitives.size();
  if (!config.enabled) {
    result.kept.resize(primitives);
    std::iota(result.kept.begin(), result.kept.end(), 0);
    result.model = std::move(model);
    return result;
  }
  const std::size_t transitions = model.transitions.size();
  Workbench bench{model.transitions,
                  {model.transitions, 2.0 * model.conventions.grid.cell},
                  std::vector<bool>(transitions, true),
                  std::vector<bool>(transitions, false),
                  marked(model.transitions, [&](const Transition& one) { return !before.holds(one); }),
                  marked(model.transitions, [&](const Transition& one) { return before.holds_as_old(one); })};
  const detail::Coverage coverage{config.known_ratio, config.agreement_mps / model.conventions.reference_width_m,
                                  config.agreement_share};
  std::vector<bool> news = bench.fresh;
  for (bool goes_on = true; goes_on;) {
    result.report.absorbed += absorb_rare(bench, std::move(news), config.max_count, coverage, fusing, outlook);
    const CompactReport old = let_go_of_old(bench, model.episodes, config, coverage, fusing, outlook);
    result.report.absorbed += old.absorbed, result.report.forgotten += old.forgotten;
    news = std::exchange(bench.changed, std::vector<bool>(transitions, false));
    goes_on = old.absorbed > 0;  // who took something up may agree with others now
  }
  result.kept = detail::thin_out(model, bench.kept);
  result.report.primitives = static_cast<int>(primitives - model.primitives.size());
  result.settled = Settled(model, config);
  result.model = std::move(model);
  return result;
}

}  // namespace sila
