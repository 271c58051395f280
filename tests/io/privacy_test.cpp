// A model holds no raw track: no coordinate that went in is found in the bytes of the file, in whatever form.
#include <gtest/gtest.h>

#include <array>
#include <bit>
#include <charconv>
#include <cmath>
#include <iostream>
#include <nlohmann/json.hpp>
#include <string_view>
#include <unordered_set>

#include "io/files.hpp"
#include "made_up_model.hpp"
#include "sila/io/reports.hpp"
#include "sila/io/scene.hpp"
#include "sila/io/scene_tracks.hpp"
#include "sila/sim/simulate.hpp"
#include "sila/train/episode.hpp"
#include "support/data.hpp"
#include "support/walks.hpp"

namespace sila {
namespace {

/// Eight bytes of a file as a number, first byte lowest.
std::uint64_t word_at(std::string_view bytes, std::size_t place) {
  std::uint64_t word = 0;
  for (std::size_t i = 8; i-- > 0;) word = word << 8 | static_cast<unsigned char>(bytes[place + i]);
  return word;
}

std::uint64_t reversed(std::uint64_t word) {
  std::uint64_t other = 0;
  for (int i = 0; i < 8; ++i, word >>= 8) other = other << 8 | (word & 0xffU);
  return other;
}

/// What must not be found: coordinates as doubles, points as pairs of floats, in both byte orders, and as text.
class Secrets {
 public:
  /// `steps`: of the lattices on which a model's numbers may stand, of which some are coordinates by chance; left out.
  /// So are `counts`, which are sums of round shares.
  explicit Secrets(std::vector<double> steps, std::unordered_set<double> counts = {})
      : steps_(std::move(steps)), counts_(std::move(counts)) {}

  void add(const Vector2& point) {
    for (const double coordinate : {point.x(), point.y()}) {
      ++coordinates_;
      const bool on_lattice = std::ranges::any_of(
          steps_, [&](double step) { return std::abs(coordinate / step - std::round(coordinate / step)) < 1e-9; });
      const auto bits = std::bit_cast<std::uint64_t>(coordinate);
      const bool round = (bits & 0xffffffffU) == 0;  // as 1.0 and -2.5 are, which counts and weights may be too
      if (round || on_lattice || counts_.contains(coordinate)) {
        ++left_out_;
        continue;
      }
      words_.insert(bits);
      words_.insert(reversed(bits));
      numbers_.insert(std::llround(coordinate * 1e4));
    }
    const auto floats =
        std::bit_cast<std::uint64_t>(std::array{static_cast<float>(point.x()), static_cast<float>(point.y())});
    const auto turned = std::bit_cast<std::uint64_t>(
        std::array{static_cast<float>(point.y()), static_cast<float>(point.x())});  // reversed: both swapped
    words_.insert(floats);
    words_.insert(reversed(turned));
  }

  std::size_t coordinates() const { return coordinates_; }
  double share_left_out() const { return static_cast<double>(left_out_) / static_cast<double>(coordinates_); }

  std::size_t found_in(std::string_view bytes) const {
    std::size_t found = 0;
    for (std::size_t i = 0; i + 8 <= bytes.size(); ++i) {
      if (!words_.contains(word_at(bytes, i))) continue;
      if (++found <= 3) std::cerr << "found at byte " << i << ": " << std::bit_cast<double>(word_at(bytes, i)) << "\n";
    }
    return found;
  }

  /// Numbers in texts that have at least four decimals of a coordinate; shorter ones are everywhere.
  std::size_t found_in_text(std::string_view bytes) const {
    std::size_t found = 0;
    constexpr std::string_view kDigits = "0123456789.-";
    for (std::size_t i = 0; (i = bytes.find_first_of(kDigits, i)) != std::string_view::npos;) {
      const std::string_view token = bytes.substr(i, bytes.find_first_not_of(kDigits, i) - i);
      i += token.size();
      const std::size_t point = token.find('.');
      if (point == std::string_view::npos || token.size() - point < 5) continue;
      double number = 0.0;
      const auto [end, error] = std::from_chars(token.data(), token.data() + token.size(), number);
      if (error == std::errc() && end == token.data() + token.size() && std::abs(number) < 1e9)
        found += numbers_.contains(std::llround(number * 1e4));
    }
    return found;
  }

 private:
  std::vector<double> steps_;
  std::unordered_set<double> counts_;
  std::size_t coordinates_ = 0;
  std::size_t left_out_ = 0;
  std::unordered_set<std::uint64_t> words_;
  std::unordered_set<long long> numbers_;
};

/// Learns tracks into a file, as the program does, and looks for every coordinate that was given or made of them.
void expect_no_track_in_the_model(const std::vector<FramedTrajectory>& tracks, std::size_t batch) {
  ASSERT_GE(tracks.size(), 2 * batch);
  const ScratchFolder folder;
  EpisodeConfig config;
  ModelFile file = ModelFile::open_or_create(folder / "m.sila");
  Model model;
  std::unordered_set<double> counts;
  int number = 0;
  for (std::size_t i = 0; i < tracks.size(); i += batch) {
    const auto part = std::span(tracks).subspan(i, std::min(batch, tracks.size() - i));
    Episode episode = run_episode(model, part, config);
    EpisodeRecord record{++number, episode.report.tracks, 0.5, 1, 2, "{}", 0};
    record.statistics = nlohmann::ordered_json{{"change", to_json(episode.report.change, model, episode.model)}}.dump();
    model = std::move(episode.model);
    file.commit(model, record, "{}");
    for (const ErrorStatistics& statistics : model.refinement.error_statistics) {
      for (const std::vector<double>& cell : statistics.scores) counts.insert(cell.begin(), cell.end());
    }
  }
  const double width_m = model.settings.reference_width_m;
  const auto step_of = [&](double scale_m) { return config.learn.field.gp.lattice_step * scale_m / width_m; };
  const std::vector<double> steps = {step_of(config.learn.field.length_scale_m), step_of(config.residual.place_scale_m),
                                     step_of(config.residual.velocity_scale_mps),
                                     step_of(config.residual.mean_velocity_scale_mps)};
  Secrets secrets(steps, counts);
  for (const FramedTrajectory& placed : tracks) {
    for (const Vector2& position_m : placed.track.positions_m) {
      secrets.add(position_m);
      secrets.add(to_curb(placed.frame, position_m));
    }
    const CurbTrajectory learnt = resample(placed.track, placed.frame, config.sampling);
    for (const Vector2& position : learnt.positions) secrets.add(position);
  }
  for (const Window& window : windows_of(tracks, config.sampling, config.predict, config.residual.stride_s)) {
    for (const Vector2& position : window.observed.positions) secrets.add(position);
  }
  const std::string bytes = content_of(folder / "m.sila");  // earlier models included: parts are not compressed
  EXPECT_GT(file.verify().undone, 0u);
  EXPECT_GT(secrets.coordinates(), 10000u);
  EXPECT_LT(secrets.share_left_out(), 0.1);
  EXPECT_EQ(secrets.found_in(bytes), 0u);
  EXPECT_EQ(secrets.found_in_text(bytes), 0u);
}

std::vector<FramedTrajectory> recorded(const std::string& name, std::size_t most) {
  const auto data = testing::recordings();
  if (!data) return {};
  auto path = *data / "scenes" / (name + ".json");
  if (!std::filesystem::exists(path)) path = tests::scenes_of_experiments() / (name + ".json");
  if (!std::filesystem::exists(path)) return {};
  const Scene scene = read_scene(path, *data);
  std::vector<FramedTrajectory> tracks = without_frames(read_tracks({}, scene, {}, CleanConfig{}).trajectories);
  tracks.resize(std::min(tracks.size(), most));
  place(tracks, scene, CornerChoice::primary, CurbScaling::metres);
  return tracks;
}

TEST(Privacy, TheSearchFindsWhatIsThere) {
  Secrets secrets({0.25});
  secrets.add({12.3456789, -0.98765432});
  std::string bytes = "some bytes ";
  const auto put = [&](auto number) {
    const auto raw = std::bit_cast<std::array<char, sizeof number>>(number);
    return std::string(raw.data(), raw.size());
  };
  const auto backwards = [](std::string text) { return std::string(text.rbegin(), text.rend()); };
  const std::string x = put(12.3456789), y = put(-0.98765432);
  EXPECT_EQ(secrets.found_in(bytes + x), 1u);
  EXPECT_EQ(secrets.found_in(bytes + backwards(y) + "."), 1u);
  EXPECT_EQ(secrets.found_in(bytes + put(12.3456789f) + put(-0.98765432f)), 1u);
  EXPECT_EQ(secrets.found_in(bytes + backwards(put(12.3456789f)) + backwards(put(-0.98765432f))), 1u);
  EXPECT_EQ(secrets.found_in(bytes + put(12.34)), 0u);
  EXPECT_EQ(secrets.found_in_text(R"({"at":[12.34567890,0]})"), 1u);
  EXPECT_EQ(secrets.found_in_text(R"({"at":[12.3457,0]})"), 1u);
  EXPECT_EQ(secrets.found_in_text(R"({"at":[12.3,0]})"), 0u);
}

TEST(Privacy, WhatWasRolledBackIsNotLeftInUnusedPages) {
  const ScratchFolder folder;
  ModelFile file = ModelFile::open_or_create(folder / "m.sila");
  commit(file, 1);
  Model model = random_model(2);
  Secrets secrets({1e-3});
  for (const Transition& edge : model.transitions) secrets.add(edge.field.gp.pseudo_inputs.col(0));
  file.commit(model, record(2), "{}");
  EXPECT_GT(secrets.found_in(content_of(folder / "m.sila")), 10u);
  file.rollback(1);
  EXPECT_EQ(secrets.found_in(content_of(folder / "m.sila")), 0u);
}

TEST(Privacy, AModelOfSimulatedPeopleHoldsNoneOfTheirCoordinates) {
  const CurbFrame frame = make_curb_frame({3.1, 2.7}, {1, 0.02}, {-0.03, 1}, 2.3);
  expect_no_track_in_the_model(testing::framed(simulate({.tracks = 80}).tracks, frame), 20);
}

TEST(Privacy, AModelOfOnePersonAtATimeHoldsNoneOfTheirCoordinates) {
  const CurbFrame frame = make_curb_frame({3.1, 2.7}, {1, 0}, {0, 1}, 2.3);
  expect_no_track_in_the_model(testing::framed(simulate({.tracks = 12, .seed = 5}).tracks, frame), 1);
}

TEST(Privacy, ModelsOfRecordedPeopleHoldNoneOfTheirCoordinates) {
  bool any = false;
  for (const char* name : {"vru_aschaffenburg", "zara01", "students03"}) {
    SCOPED_TRACE(name);
    const std::vector<FramedTrajectory> tracks = recorded(name, 120);
    if (tracks.empty()) continue;
    any = true;
    expect_no_track_in_the_model(tracks, 20);
  }
  if (!any) GTEST_SKIP() << "no recorded tracks here (SILA_DATA_DIR)";
}

}  // namespace
}  // namespace sila
