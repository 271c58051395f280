#pragma once

#include <array>
#include <optional>
#include <span>
#include <vector>

#include "sila/core/trajectory.hpp"

namespace sila {

/// A place where a model was trained, by its curb frame.
struct Site {
  CurbFrame frame;
  int episodes = 0;  ///< batches that had tracks of this site
  long tracks = 0;   ///< trajectories of this site that were learnt
};

/// Whether the sites of a model have transitions in common.
enum class SiteSharing {
  apart,   ///< a transition belongs to one site, and predictions at a known site use those of that site alone
  shared,  ///< sites are laid over each other by their frames; everything may fuse and is used everywhere (paper)
};
inline constexpr std::array<const char*, 2> kSiteSharings = {"apart", "shared"};

/// The part of a transition's count that comes from one site.
struct SiteCount {
  int site = 0;          ///< index in Model::sites
  double count = 0.0;    ///< trajectories that showed the transition there
  int last_episode = 0;  ///< in which it was last seen there, counted by Site::episodes; from 1
  bool operator==(const SiteCount&) const = default;
};

/// Whether two frames are at the same corner: origins within 1 m, axes within about 5 degrees. Source:
/// docs/decisions/0097-sites.md.
bool same_site(const CurbFrame& a, const CurbFrame& b);

/// The index of the site at this corner.
std::optional<int> find_site(const std::vector<Site>& sites, const CurbFrame& frame);

/// The same; if no site is at this corner, one without episodes and tracks is appended.
int find_or_add_site(std::vector<Site>& sites, const CurbFrame& frame);

/// The sites of the tracks of one batch, in the order of their first tracks.
std::vector<Site> sites_of(std::span<const CurbTrajectory> tracks);

/// The sites of two models: those of the first keep their indices, those that only the second has follow. Episodes
/// and tracks add.
struct JoinedSites {
  std::vector<Site> sites;
  std::vector<int> of_second;  ///< the index in `sites` of each site of the second model
};
JoinedSites join_sites(std::vector<Site> first, const std::vector<Site>& second);

/// Adds a count to a list that is sorted by site.
void add_count(std::vector<SiteCount>& counts, const SiteCount& more);
/// The sum of the counts of all sites.
double total_count(const std::vector<SiteCount>& counts);

/// Whether two lists, sorted by site, have a site in common.
bool share_a_site(const std::vector<SiteCount>& a, const std::vector<SiteCount>& b);

/// Episodes since the last observation at any of the sites, each with its own count of episodes.
int age_episodes(const std::vector<SiteCount>& counts, const std::vector<Site>& sites);

}  // namespace sila
