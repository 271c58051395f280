#include "sila/model/site.hpp"

#include <algorithm>
#include <limits>

namespace sila {
namespace {

constexpr double kSameOrigin_m = 1.0;
constexpr double kSameAxisCosine = 0.996;

}  // namespace

bool same_site(const CurbFrame& a, const CurbFrame& b) {
  return (a.origin_m - b.origin_m).norm() <= kSameOrigin_m && a.axis_1.dot(b.axis_1) >= kSameAxisCosine &&
         a.axis_2.dot(b.axis_2) >= kSameAxisCosine;
}

std::optional<int> find_site(const std::vector<Site>& sites, const CurbFrame& frame) {
  const auto found = std::ranges::find_if(sites, [&](const Site& site) { return same_site(site.frame, frame); });
  if (found == sites.end()) return std::nullopt;
  return static_cast<int>(found - sites.begin());
}

int find_or_add_site(std::vector<Site>& sites, const CurbFrame& frame) {
  if (const auto known = find_site(sites, frame)) return *known;
  sites.push_back({frame, 0, 0});
  return static_cast<int>(sites.size()) - 1;
}

std::vector<Site> sites_of(std::span<const CurbTrajectory> tracks) {
  std::vector<Site> sites;
  for (const CurbTrajectory& track : tracks) {
    Site& site = sites[static_cast<std::size_t>(find_or_add_site(sites, track.frame))];
    site.episodes = 1;
    site.tracks += 1;
  }
  return sites;
}

JoinedSites join_sites(std::vector<Site> first, const std::vector<Site>& second) {
  JoinedSites joined{std::move(first), {}};
  for (const Site& more : second) {
    joined.of_second.push_back(find_or_add_site(joined.sites, more.frame));
    Site& site = joined.sites[static_cast<std::size_t>(joined.of_second.back())];
    site.episodes += more.episodes;
    site.tracks += more.tracks;
  }
  return joined;
}

void add_count(std::vector<SiteCount>& counts, const SiteCount& more) {
  const auto known = std::ranges::lower_bound(counts, more.site, {}, &SiteCount::site);
  if (known == counts.end() || known->site != more.site) {
    counts.insert(known, more);
    return;
  }
  known->count += more.count;
  known->last_episode = std::max(known->last_episode, more.last_episode);
}

double total_count(const std::vector<SiteCount>& counts) {
  double total = 0.0;
  for (const SiteCount& part : counts) total += part.count;
  return total;
}

bool share_a_site(const std::vector<SiteCount>& a, const std::vector<SiteCount>& b) {
  return std::ranges::any_of(
      a, [&](const SiteCount& part) { return std::ranges::binary_search(b, part.site, {}, &SiteCount::site); });
}

int age_episodes(const std::vector<SiteCount>& counts, const std::vector<Site>& sites) {
  int age = std::numeric_limits<int>::max();
  for (const SiteCount& part : counts)
    age = std::min(age, sites[static_cast<std::size_t>(part.site)].episodes - part.last_episode);
  return age;
}

}  // namespace sila
