#include <cmath>
#include <iterator>
#include <utility>

#include "refine/error_statistics.hpp"
#include "train/steps.hpp"

namespace sila {
namespace {

/// The tracks of each site: of those of the model, then of new ones in the order of their first tracks.
std::vector<std::vector<FramedTrajectory>> tracks_by_site(std::vector<Site> sites,
                                                          std::span<const FramedTrajectory> tracks) {
  std::vector<std::vector<FramedTrajectory>> groups(sites.size());
  for (const FramedTrajectory& track : tracks) {
    const auto site = static_cast<std::size_t>(find_or_add_site(sites, track.frame));
    groups.resize(sites.size());
    groups[site].push_back(track);
  }
  std::erase_if(groups, [](const auto& group) { return group.empty(); });
  return groups;
}

/// The observed times of windows that are cut short, in whole intervals, so that each has its own class.
std::vector<double> shorter_observed_s(const EpisodeConfig& config) {
  const double interval_s = config.sampling.interval_s;
  std::vector<double> shorter_s;
  for (const double seconds : kShorterObserved_s) {
    const double cut_s = interval_s * std::ceil(seconds / interval_s - 1e-6);
    const bool again = !shorter_s.empty() && cut_s == shorter_s.back();
    if (!again && cut_s < config.predict.observe_s - interval_s - 1e-6) shorter_s.push_back(cut_s);
  }
  return shorter_s;
}

/// The errors of a predictor on tracks that its model has not learnt; `unseen`: the tracks of each site, `present`: all
/// people of the batch.
BatchErrors errors_by(const Predictor& predictor, std::span<const std::vector<FramedTrajectory>> unseen,
                      const PresentPeople& present, const EpisodeConfig& config) {
  // Every other window is used a second time, cut short as if the person had just appeared, and each track has windows
  // at its beginning, where people differ (docs/decisions/0112, 0133).
  const std::vector<double> shorter_s = shorter_observed_s(config);
  BatchErrors errors;
  for (const std::vector<FramedTrajectory>& tracks : unseen) {
    const auto windows = [&](double stride_s, std::span<const double> observed_s) {
      return windows_of(tracks, config.sampling, config.predict, stride_s, observed_s, &present);
    };
    std::vector<Window> all = windows(config.error_statistics.stride_s, {});
    if (!shorter_s.empty())
      std::ranges::move(windows(2.0 * config.error_statistics.stride_s, shorter_s), std::back_inserter(all));
    std::ranges::move(first_windows_of(tracks, config.sampling, config.predict, shorter_s, present),
                      std::back_inserter(all));
    GatheredErrors gathered = gather_errors(predictor, all);
    errors.sites.push_back({tracks.front().frame, std::move(gathered.statistics)});
    errors.path += gathered.path;
  }
  return errors;
}

/// No model can predict the first batch of a site. It is split into this number of parts; a model of the earlier parts
/// predicts each, and the errors become the error statistics of the site. Source: docs/decisions/0115.
constexpr std::size_t kFirstParts = 4;
/// A part has at least this number of tracks, else the batch is not split.
constexpr std::size_t kLeastPartTracks = 2;

ErrorStatistics first_statistics(std::span<const FramedTrajectory> batch, const EpisodeConfig& config,
                                 const ErrorStatistics& prior) {
  Model model;
  model.refinement.prior = prior;
  if (batch.size() < kFirstParts * kLeastPartTracks)
    return error_statistics_on(model, batch, config).front().statistics;
  for (std::size_t part = 0; part < kFirstParts; ++part) {
    const std::size_t begin = batch.size() * part / kFirstParts, end = batch.size() * (part + 1) / kFirstParts;
    model = run_episode(model, batch.subspan(begin, end - begin), config).model;
  }
  return std::move(model.refinement.error_statistics.front());
}

BatchErrors errors_on(const Model& model, std::span<const std::vector<FramedTrajectory>> unseen,
                      const PresentPeople& present, const EpisodeConfig& config) {
  if (unseen.empty()) return {};
  Model with_settings = model;
  with_settings.settings = settings_for(model, unseen.front().front().frame, config);
  return errors_by(Predictor(with_settings, config.predict), unseen, present, config);
}

}  // namespace

BatchErrors recent_errors(const Model& previous, std::span<const FramedTrajectory> batch, const EpisodeConfig& config,
                          const Predictor* predictor) {
  const PresentPeople present(batch);
  std::vector<std::vector<FramedTrajectory>> by_site = tracks_by_site(previous.sites, batch);
  const auto first = std::stable_partition(by_site.begin(), by_site.end(), [&](const auto& tracks) {
    return find_site(previous.sites, tracks.front().frame).has_value();
  });
  const std::span known(by_site.begin(), first);
  BatchErrors recent =
      predictor ? errors_by(*predictor, known, present, config) : errors_on(previous, known, present, config);
  for (const std::vector<FramedTrajectory>& tracks : std::span(first, by_site.end()))
    recent.sites.push_back({tracks.front().frame, first_statistics(tracks, config, previous.refinement.prior)});
  return recent;
}

std::vector<SiteErrors> error_statistics_on(const Model& model, std::span<const FramedTrajectory> unseen,
                                            const EpisodeConfig& config) {
  return errors_on(model, tracks_by_site(model.sites, unseen), PresentPeople(unseen), config).sites;
}

}  // namespace sila
