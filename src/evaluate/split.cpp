#include <algorithm>
#include <iterator>
#include <limits>
#include <map>
#include <random>
#include <span>
#include <utility>

#include "core/concatenate.hpp"
#include "core/unit_warnings.hpp"
#include "sila/evaluate/training_support.hpp"

namespace sila {
namespace {

/// The tracklets of one person, and when the person was there [s], on the clock of the recording.
struct Person {
  std::vector<FramedTrajectory> tracklets;
  double begin_s = std::numeric_limits<double>::infinity();
  double end_s = -std::numeric_limits<double>::infinity();

  std::size_t recording() const { return tracklets.front().track.recording; }
};

/// Fisher-Yates on raw bits: std::shuffle gives other orders with other standard libraries.
template <class T>
void shuffle(std::vector<T>& items, std::mt19937_64& random) {
  for (std::size_t i = items.size(); i > 1; --i) std::swap(items[i - 1], items[random() % i]);
}

/// The people of the tracks, sorted by id.
std::vector<Person> people_of(std::vector<FramedTrajectory> tracks) {
  std::map<std::string, Person> people;
  for (FramedTrajectory& framed : tracks) {
    validate(framed.track);
    const std::vector<double>& times_s = framed.track.times_s;
    Person& person = people[person_of(framed.track.id)];
    person.begin_s = std::min(person.begin_s, times_s.front());
    person.end_s = std::max(person.end_s, times_s.back());
    person.tracklets.push_back(std::move(framed));
  }
  std::vector<Person> result;
  for (auto& [id, person] : people) result.push_back(std::move(person));
  return result;
}

/// Tracks of one recording that all begin at one instant are on clocks of their own: there is no block of time.
void require_clock(std::span<const Person> recording) {
  const auto begins_with_first = [&](const Person& person) { return person.begin_s == recording.front().begin_s; };
  if (recording.size() < 2 || !std::ranges::all_of(recording, begins_with_first)) return;
  throw invalid_argument("split: all ", recording.size(), " tracks begin at t = ",
                         std::to_string(recording.front().begin_s),  // a time since 1970 needs all its digits
                         " s, so they have no common clock; split by track (split=track), or give each recording a "
                         "file of its own");
}

/// The people of each recording, sorted by begin.
std::vector<std::vector<Person>> recordings_of(std::vector<Person> people) {
  std::map<std::size_t, std::vector<Person>> by_recording;
  for (Person& person : people) by_recording[person.recording()].push_back(std::move(person));
  std::vector<std::vector<Person>> recordings;
  for (auto& [number, recording] : by_recording) {
    if (by_recording.size() == 1) require_clock(recording);
    std::ranges::stable_sort(recording, {}, &Person::begin_s);
    recordings.push_back(std::move(recording));
  }
  return recordings;
}

/// A block of time of one recording.
struct Block {
  std::size_t recording = 0;
  double begin_s = 0.0;
  double end_s = 0.0;
};

/// The 75 % quantile of the times that the people of a recording stay [s].
double usual_stay_s(std::span<const Person> people, std::size_t recording) {
  std::vector<double> stays_s;
  for (const Person& person : people) {
    if (person.recording() == recording) stays_s.push_back(person.end_s - person.begin_s);
  }
  return quantile(std::move(stays_s), 0.75);
}

/// The blocks of held-back people. Neighbours of one recording make one block: from the first begin of them until a
/// usual stay after the last.
std::vector<Block> blocks_of(std::span<const Person> ordered, const std::vector<bool>& held) {
  std::vector<Block> blocks;
  double stay_s = 0.0;
  for (std::size_t i = 0; i < ordered.size(); ++i) {
    if (!held[i]) continue;
    const bool same_block = i > 0 && held[i - 1] && ordered[i - 1].recording() == ordered[i].recording();
    if (!same_block) {
      blocks.push_back({ordered[i].recording(), ordered[i].begin_s, 0.0});
      stay_s = usual_stay_s(ordered, ordered[i].recording());
    }
    blocks.back().end_s = ordered[i].begin_s + stay_s;
  }
  return blocks;
}

bool near(const Block& block, const Person& person) {
  return block.recording == person.recording() && person.begin_s <= block.end_s + kEmbargo_s &&
         block.begin_s <= person.end_s + kEmbargo_s;
}

/// A person's tracklets until the end of the block in which the person came; those of one sample are dropped.
Person until(Person person, std::span<const Block> blocks) {
  const auto within = [&](const Block& block) {
    return block.recording == person.recording() && block.begin_s <= person.begin_s && person.begin_s <= block.end_s;
  };
  const auto block = std::ranges::find_if(blocks, within);
  for (FramedTrajectory& framed : person.tracklets) {
    Trajectory& track = framed.track;
    const auto end = std::ranges::upper_bound(track.times_s, block->end_s) - track.times_s.begin();
    track.times_s.resize(static_cast<std::size_t>(end));
    track.positions_m.resize(static_cast<std::size_t>(end));
  }
  std::erase_if(person.tracklets, [](const FramedTrajectory& framed) { return framed.track.times_s.size() < 2; });
  return person;
}

void move_tracklets(Person& person, std::vector<FramedTrajectory>& side) {
  std::ranges::move(person.tracklets, std::back_inserter(side));
}

Split split_by_time(std::vector<Person> people, std::size_t test_people, std::mt19937_64& random) {
  std::vector<std::vector<Person>> recordings = recordings_of(std::move(people));
  shuffle(recordings, random);
  std::vector<Person> ordered;
  for (std::vector<Person>& recording : recordings) std::ranges::move(recording, std::back_inserter(ordered));
  if (ordered.empty()) return {};
  const std::size_t from = random() % ordered.size();
  std::vector<bool> held(ordered.size());
  for (std::size_t i = 0; i < ordered.size(); ++i) held[i] = (i + ordered.size() - from) % ordered.size() < test_people;
  const std::vector<Block> blocks = blocks_of(ordered, held);
  Split split;
  for (std::size_t i = 0; i < ordered.size(); ++i) {
    if (held[i]) {
      Person person = until(std::move(ordered[i]), blocks);
      move_tracklets(person, split.test);
    } else if (std::ranges::none_of(blocks, [&](const Block& block) { return near(block, ordered[i]); })) {
      move_tracklets(ordered[i], split.train);
    }
  }
  return split;
}

Split split_by_track(std::vector<Person> people, std::size_t test_people, std::mt19937_64& random) {
  shuffle(people, random);
  Split split;
  for (std::size_t i = 0; i < people.size(); ++i) move_tracklets(people[i], i < test_people ? split.test : split.train);
  return split;
}

}  // namespace

std::string person_of(const std::string& track_id) {
  const std::size_t mark = track_id.find_last_not_of("0123456789");
  const bool later = mark != std::string::npos && track_id[mark] == '#' && mark + 1 < track_id.size();
  // "#7" and, of several files, "video:#7" are ids of the input.
  return later && mark > 0 && track_id[mark - 1] != ':' ? track_id.substr(0, mark) : track_id;
}

Split split_people(std::vector<FramedTrajectory> tracks, std::size_t test_people, std::uint64_t seed, SplitBy by) {
  std::mt19937_64 random(seed);
  std::vector<Person> people = people_of(std::move(tracks));
  return by == SplitBy::time ? split_by_time(std::move(people), test_people, random)
                             : split_by_track(std::move(people), test_people, random);
}

Split split_tracks(std::vector<FramedTrajectory> tracks, double test_share, std::uint64_t seed, SplitBy by) {
  if (!(test_share >= 0.0 && test_share < 1.0))
    throw invalid_argument("split_tracks: test_share = ", test_share, " is outside [0, 1)");
  const double people = static_cast<double>(people_of(tracks).size());
  return split_people(std::move(tracks), static_cast<std::size_t>(test_share * people), seed, by);
}

}  // namespace sila
