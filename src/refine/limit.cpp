#include "sila/refine/limit.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <numeric>
#include <stdexcept>
#include <tuple>
#include <utility>

#include "coverage.hpp"
#include "sila/gp/fuse_gps.hpp"
#include "sila/model/packing.hpp"

namespace sila {
namespace {

/// Of a transition whose field is known to others altogether: its residual GP goes as well.
constexpr double kLeastUncovered = 0.25;
/// Where bytes are short all residual GPs are made this narrow [pseudo-inputs], then this, before any transition goes.
constexpr std::array kNarrower{60, 30};

/// A pseudo-input of a transition.
struct Place {
  std::size_t transition = 0;
  std::size_t input = 0;
};

/// Who speaks for whom, while transitions go.
struct Ledger {
  std::vector<std::vector<int>> speakers;      ///< of each pseudo-input: how many others know it and agree
  std::vector<std::vector<Place>> speaks_for;  ///< of each transition
  std::vector<bool> kept;
  std::vector<double> bytes;
};

/// Notes the pseudo-inputs of `of` for which `by` speaks.
void note(Ledger& ledger, detail::FieldIndex& index, const std::vector<Transition>& transitions, std::size_t of,
          std::size_t by, const detail::Coverage& coverage) {
  const Eigen::Matrix2Xd& own = index.own_means(static_cast<int>(of), transitions[of]);
  const FlowPosterior& other = index.posterior(static_cast<int>(by), transitions[by]);
  const Eigen::MatrixXd& places = transitions[of].field.gp.pseudo_inputs;
  for (Eigen::Index m = 0; m < places.cols(); ++m) {
    const FieldPrediction said = other.predict(places.col(m));
    if (other.unexplained_share(said) >= coverage.known_ratio) continue;
    if ((said.mean - own.col(m)).norm() >= coverage.agreement) continue;
    ++ledger.speakers[of][static_cast<std::size_t>(m)];
    ledger.speaks_for[by].push_back({of, static_cast<std::size_t>(m)});
  }
}

Ledger ledger_of(const Model& model, const CompactConfig& config) {
  const std::vector<Transition>& transitions = model.transitions;
  const bool apart = model.sharing == SiteSharing::apart;
  Ledger ledger;
  ledger.speaks_for.resize(transitions.size());
  ledger.kept.assign(transitions.size(), true);
  for (const Transition& transition : transitions) {
    ledger.speakers.emplace_back(static_cast<std::size_t>(transition.field.gp.pseudo_inputs.cols()), 0);
    ledger.bytes.push_back(static_cast<double>(packed_bytes(transition)));
  }
  const detail::Coverage coverage{config.known_ratio, config.agreement_mps / model.settings.reference_width_m, 0.0};
  detail::FieldIndex index(transitions, 2.0 * model.settings.grid.cell);
  for (std::size_t of = 0; of < transitions.size(); ++of) {
    for (const int by : index.candidates(transitions[of], coverage.share, ledger.kept)) {
      const auto other = static_cast<std::size_t>(by);
      if (other == of || (apart && !share_a_site(transitions[of].sites, transitions[other].sites))) continue;
      note(ledger, index, transitions, of, other, coverage);
    }
  }
  return ledger;
}

double worth(const Ledger& ledger, const std::vector<Transition>& transitions, std::size_t i) {
  const std::vector<int>& speakers = ledger.speakers[i];
  const auto alone = static_cast<double>(std::count(speakers.begin(), speakers.end(), 0));
  const double uncovered = speakers.empty() ? 1.0 : alone / static_cast<double>(speakers.size());
  return transitions[i].count * std::max(kLeastUncovered, uncovered);
}

void give_up(Ledger& ledger, const Transition& transition, std::size_t i, LimitReport& report) {
  ledger.kept[i] = false;
  for (const Place& place : ledger.speaks_for[i]) --ledger.speakers[place.transition][place.input];
  ++report.transitions;
  report.count += transition.count;
}

/// The primitives that transitions touch, each with the worth of those transitions; negative: none touches it.
std::vector<double> worth_of_primitives(const Ledger& ledger, const Model& model) {
  std::vector<double> sums(model.primitives.size(), -1.0);
  for (std::size_t i = 0; i < model.transitions.size(); ++i) {
    if (!ledger.kept[i]) continue;
    const Transition& transition = model.transitions[i];
    const double here = worth(ledger, model.transitions, i);
    for (const int p : {transition.from, transition.to}) {
      double& sum = sums[static_cast<std::size_t>(p)];
      sum = std::max(sum, 0.0) + here;
    }
  }
  return sums;
}

void keep_to_primitives(Ledger& ledger, const Model& model, double most, LimitReport& report) {
  while (true) {
    const std::vector<double> sums = worth_of_primitives(ledger, model);
    const auto touched = std::count_if(sums.begin(), sums.end(), [](double sum) { return sum >= 0.0; });
    if (static_cast<double>(touched) <= most) return;
    std::size_t least = sums.size();
    for (std::size_t p = 0; p < sums.size(); ++p) {
      if (sums[p] >= 0.0 && (least == sums.size() || sums[p] < sums[least])) least = p;
    }
    for (std::size_t i = 0; i < model.transitions.size(); ++i) {
      const Transition& transition = model.transitions[i];
      const auto p = static_cast<int>(least);
      if (ledger.kept[i] && (transition.from == p || transition.to == p)) give_up(ledger, transition, i, report);
    }
  }
}

/// Bytes of the primitives that transitions touch.
double bytes_of_primitives(const Ledger& ledger, const Model& model) {
  const std::vector<double> sums = worth_of_primitives(ledger, model);
  double bytes = 0.0;
  for (std::size_t p = 0; p < sums.size(); ++p) {
    if (sums[p] >= 0.0) bytes += static_cast<double>(packed_bytes(model.primitives[p]));
  }
  return bytes;
}

/// Makes residual GPs narrower, those of transitions that were seen least first, until there is nothing too much.
void reduce_residuals(Ledger& ledger, std::vector<Transition>& transitions, double too_much, LimitReport& report) {
  std::vector<std::size_t> order(transitions.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  std::ranges::stable_sort(order, {}, [&](std::size_t i) { return transitions[i].count; });
  for (const int most : kNarrower) {
    for (const std::size_t i : order) {
      if (too_much <= 0.0) return;
      Transition& transition = transitions[i];
      if (!ledger.kept[i] || transition.residual.pseudo_inputs.cols() <= most) continue;
      transition.residual = reduce_pseudo_inputs(transition.residual, most);
      const double before = std::exchange(ledger.bytes[i], static_cast<double>(packed_bytes(transition)));
      too_much -= before - ledger.bytes[i];
      ++report.narrowed;
    }
  }
}

double bytes_of_transitions(const Ledger& ledger) {
  double bytes = 0.0;
  for (std::size_t i = 0; i < ledger.kept.size(); ++i) bytes += ledger.kept[i] ? ledger.bytes[i] : 0.0;
  return bytes;
}

void keep_to_bytes(Ledger& ledger, Model& model, double most, LimitReport& report) {
  const std::size_t count = model.transitions.size();
  reduce_residuals(ledger, model.transitions, bytes_of_transitions(ledger) + bytes_of_primitives(ledger, model) - most,
                   report);
  double transitions = bytes_of_transitions(ledger);
  while (transitions > 0.0 && transitions + bytes_of_primitives(ledger, model) > most) {
    const auto rank = [&](std::size_t i) {
      return std::tuple(worth(ledger, model.transitions, i) / ledger.bytes[i],
                        -age_episodes(model.transitions[i].sites, model.sites), i);
    };
    std::size_t least = count;
    for (std::size_t i = 0; i < count; ++i) {
      if (ledger.kept[i] && (least == count || rank(i) < rank(least))) least = i;
    }
    transitions = std::max(0.0, transitions - ledger.bytes[least]);
    give_up(ledger, model.transitions[least], least, report);
    if (std::find(ledger.kept.begin(), ledger.kept.end(), true) == ledger.kept.end()) return;
  }
}

[[noreturn]] void refuse(const ModelLimits& limits) {
  const auto text = [](double value) { return std::isinf(value) ? "inf" : std::to_string(std::llround(value)); };
  throw std::invalid_argument("limit: model.max_primitives = " + text(limits.max_primitives) +
                              " and model.max_bytes = " + text(limits.max_bytes) +
                              " leave no room for a single transition, they must allow for the smallest usable model");
}

}  // namespace

Limited limit(Model model, const ModelLimits& limits, const CompactConfig& coverage) {
  validate_fields("limit", limits);
  Limited result;
  const std::size_t before = model.primitives.size();
  const bool few = static_cast<double>(before) <= limits.max_primitives;
  if (few && (std::isinf(limits.max_bytes) || static_cast<double>(packed_bytes(model)) <= limits.max_bytes)) {
    result.kept.resize(before);
    std::iota(result.kept.begin(), result.kept.end(), 0);
    result.model = std::move(model);
    return result;
  }
  Ledger ledger = ledger_of(model, coverage);
  keep_to_primitives(ledger, model, limits.max_primitives, result.report);
  if (!std::isinf(limits.max_bytes)) {
    Model rest = model;
    rest.primitives.clear(), rest.transitions.clear();
    keep_to_bytes(ledger, model, limits.max_bytes - static_cast<double>(packed_bytes(rest)), result.report);
  }
  result.kept = detail::thin_out(model, ledger.kept);
  if (model.transitions.empty()) refuse(limits);
  result.report.primitives = static_cast<int>(before - model.primitives.size());
  result.model = std::move(model);
  return result;
}

}  // namespace sila
