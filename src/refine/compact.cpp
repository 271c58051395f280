#include "sila/refine/compact.hpp"

#include <algorithm>
#include <bit>
#include <limits>
#include <numeric>
#include <utility>

#include "coverage.hpp"
#include "sila/fuse/fuse_fields.hpp"
#include "sila/refine/refine.hpp"

namespace sila {
namespace {

/// The model while it is compacted: transitions keep their indices, those that are gone are not `kept`.
struct Workbench {
  std::vector<Transition>& transitions;
  const std::vector<Site>& sites;
  bool apart;  ///< a transition absorbs nothing of another site
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

bool seen_long_ago(const Transition& transition, const std::vector<Site>& sites, const CompactConfig& config) {
  return age_episodes(transition.sites, sites) >= config.forget_after_episodes;
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
    if (bench.apart && !share_a_site(at(other).sites, at(rare).sites)) continue;
    const auto difference = bench.index.difference(rare, at(rare), other, at(other), coverage);
    if (!difference || (best >= 0 && *difference >= least)) continue;
    best = other;
    least = *difference;
  }
  return best;
}

void absorb(Workbench& bench, int rare, int into, const FuseConfig& fusing, const ResidualConfig& residual) {
  Transition& target = bench.transitions[static_cast<std::size_t>(into)];
  const Transition& source = bench.transitions[static_cast<std::size_t>(rare)];
  const FieldSources both{{&target, &source}, {}, {}};
  std::vector<SiteCount> sites = target.sites;
  for (const SiteCount& part : source.sites) add_count(sites, part);
  Transition fused{target.from,
                   target.to,
                   target.count + source.count,
                   fuse_fields(both, fusing.gp),
                   merge_residuals(target.residual, source.residual, residual),
                   std::move(sites),
                   std::max(target.support, source.support)};
  target = std::move(fused);
  bench.kept[static_cast<std::size_t>(rare)] = false;
  bench.index.remove(rare);
  bench.index.replace(into, target);
  bench.changed[static_cast<std::size_t>(into)] = bench.fresh[static_cast<std::size_t>(into)] = true;
}

/// Absorbs until nothing agrees any more, for what has grown may agree with what it did not agree with before.
int absorb_rare(Workbench& bench, std::vector<bool> news, double max_count, const detail::Coverage& coverage,
                const FuseConfig& fusing, const ResidualConfig& residual) {
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
      absorb(bench, rare, speaker, fusing, residual);
      ++absorbed;
    }
  }
  return absorbed;
}

/// What was seen at most `forget_count` times, and not for long, becomes part of a transition that was seen more often
/// and knows its place, whatever that one says: of those the one that differs least. Where nobody else knows the place
/// it stays, until it has faded.
CompactReport let_go_of_old(Workbench& bench, const CompactConfig& config, detail::Coverage coverage,
                            const FuseConfig& fusing, const ResidualConfig& residual) {
  CompactReport report;
  coverage.agreement = std::numeric_limits<double>::infinity();
  const std::vector<bool> all(bench.transitions.size(), true);
  for (std::size_t i = 0; i < bench.transitions.size(); ++i) {
    const Transition& old = bench.transitions[i];
    if (!bench.kept[i] || old.count > config.forget_count || !seen_long_ago(old, bench.sites, config)) continue;
    const int speaker =
        best_speaker(bench, static_cast<int>(i), bench.old_before[i] ? bench.fresh : all, coverage, true);
    if (speaker >= 0) {
      absorb(bench, static_cast<int>(i), speaker, fusing, residual);
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
    old_before_[mark_of(transition)] = seen_long_ago(transition, compacted.sites, config);
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

Compacted compact(Model model, const CompactConfig& config, const FuseConfig& fusing, const ResidualConfig& residual,
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
                  model.sites,
                  model.sharing == SiteSharing::apart,
                  {model.transitions, 2.0 * model.settings.grid.cell},
                  std::vector<bool>(transitions, true),
                  std::vector<bool>(transitions, false),
                  marked(model.transitions, [&](const Transition& one) { return !before.holds(one); }),
                  marked(model.transitions, [&](const Transition& one) { return before.holds_as_old(one); })};
  const detail::Coverage coverage{config.known_ratio, config.agreement_mps / model.settings.reference_width_m,
                                  config.agreement_share};
  std::vector<bool> news = bench.fresh;
  for (bool goes_on = true; goes_on;) {
    result.report.absorbed += absorb_rare(bench, std::move(news), config.max_count, coverage, fusing, residual);
    const CompactReport old = let_go_of_old(bench, config, coverage, fusing, residual);
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
