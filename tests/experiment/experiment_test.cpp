#include "sila/experiment/experiment.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <set>

#include "sila/experiment/report.hpp"
#include "support/walks.hpp"

namespace sila {
namespace {

Experiment small(ExperimentKind kind) {
  Experiment experiment;
  experiment.config.kind = kind;
  experiment.config.trials = 2;
  for (unsigned seed : {1u, 2u, 3u})
    experiment.places.push_back({"place " + std::to_string(seed), testing::corner_walks(30, seed), {}});
  for (MethodKind method : {MethodKind::kinematics, MethodKind::memory})
    experiment.methods.push_back(
        MethodAtPlaces(3, {kMethodKinds[static_cast<std::size_t>(method)], method, {}, {}, {}, {}}));
  return experiment;
}

PartRow row(const std::string& place, const std::string& method, int trial, double error, unsigned people = 30) {
  PartRow made;
  made.place = place, made.method = method, made.trial = trial, made.size = 7;
  for (unsigned p = 0; p < people; ++p) {
    const double constant = 1.0 + 0.1 * p;
    const GroupSums sums{.windows = 1.0, .mhd_m = error * constant, .constant_mhd_m = constant};
    made.by_person[place + "/" + std::to_string(p)] = sums;
    made.groups["moving"] = made.groups["moving"] + sums;
  }
  return made;
}

TEST(Experiment, TakesTheSplitsThatTheOtherProgramsTake) {
  const Experiment experiment = small(ExperimentKind::one_place);
  const Split ours = split_place(experiment.places[0], experiment.config, 2);
  const Split theirs = split_tracks(experiment.places[0].tracks, 0.15, 101, SplitBy::time);
  ASSERT_EQ(ours.train.size(), theirs.train.size());
  for (std::size_t i = 0; i < ours.train.size(); ++i) EXPECT_EQ(ours.train[i].track.id, theirs.train[i].track.id);
}

TEST(Experiment, SplitsByCountsWithNobodyOnBothSides) {
  Experiment experiment = small(ExperimentKind::one_place);
  for (int i = 0; i < 10; ++i) {
    FramedTrajectory piece = experiment.places[0].tracks[static_cast<std::size_t>(i)];
    piece.track.id += "#2";
    experiment.places[0].tracks.push_back(piece);
  }
  experiment.config.test_tracks = 8, experiment.config.train_tracks = 20;
  for (int trial = 1; trial <= 10; ++trial) {
    const Split split = split_place(experiment.places[0], experiment.config, trial);
    EXPECT_GE(split.test.size(), 8u);
    EXPECT_EQ(split.train.size(), 20u);
    std::set<std::string> held;
    for (const FramedTrajectory& track : split.test) held.insert(track.track.id.substr(0, track.track.id.find('#')));
    for (const FramedTrajectory& track : split.train)
      EXPECT_FALSE(held.contains(track.track.id.substr(0, track.track.id.find('#'))));
  }
}

TEST(Experiment, RefusesASplitLargerThanTheDataUnlessFewerWillDo) {
  Experiment experiment = small(ExperimentKind::one_place);
  experiment.config.test_tracks = 13, experiment.config.train_tracks = 79;
  try {
    check(experiment);
    FAIL() << "must be refused";
  } catch (const std::invalid_argument& error) {
    EXPECT_NE(std::string(error.what()).find("place 1"), std::string::npos) << error.what();
    EXPECT_NE(std::string(error.what()).find("30 tracks"), std::string::npos) << error.what();
  }
  experiment.config.take_fewer = true;
  EXPECT_NO_THROW(check(experiment));
  const Split split = split_place(experiment.places[0], experiment.config, 1);
  EXPECT_EQ(split.test.size(), 4u);
  EXPECT_EQ(split.train.size(), 26u);
}

TEST(Experiment, RefusesEmptyPlacesRepeatedNamesAndNothingToDo) {
  Experiment experiment = small(ExperimentKind::one_place);
  experiment.places[1].tracks.clear();
  EXPECT_THROW(check(experiment), std::invalid_argument);
  experiment = small(ExperimentKind::one_place);
  experiment.methods.push_back(experiment.methods[0]);
  EXPECT_THROW(check(experiment), std::invalid_argument);
  experiment.methods.clear();
  EXPECT_THROW(check(experiment), std::invalid_argument);
  experiment = small(ExperimentKind::transfer);
  experiment.places.resize(1);
  EXPECT_THROW(check(experiment), std::invalid_argument);
}

TEST(Orders, AreAllDifferentPermutationsTheListedOneFirst) {
  const auto every = orders_of(4, 0, 1), some = orders_of(4, 5, 1), others = orders_of(4, 5, 2);
  EXPECT_EQ(every.size(), 24u);
  EXPECT_EQ(std::set(every.begin(), every.end()).size(), 24u);
  EXPECT_EQ(std::set(some.begin(), some.end()).size(), 5u);
  EXPECT_EQ(some[0], (std::vector<std::size_t>{0, 1, 2, 3}));
  EXPECT_NE(some, others);
}

TEST(Transfer, NeverLearnsAtThePlaceThatIsLeftOutButBesideIt) {
  const Experiment experiment = small(ExperimentKind::transfer);
  const std::vector<Job> jobs = jobs_of(experiment);
  EXPECT_EQ(jobs.size(), 2u * 3u * 2u * 2u);
  for (const Job& job : jobs) {
    const Course course = course_of(experiment, job);
    ASSERT_EQ(course.judged.size(), 1u);
    EXPECT_EQ(course.judged[0].name, job.scene);
    EXPECT_EQ(course.stages.size(), job.here ? 1u : 2u);
    EXPECT_EQ(job.method.ends_with(" here"), job.here);
  }
}

TEST(Places, AreLearntInTheOrderOfTheJobAndAllJudged) {
  Experiment experiment = small(ExperimentKind::places);
  experiment.config.orders = 0, experiment.config.trials = 1;
  const std::vector<Job> jobs = jobs_of(experiment);
  EXPECT_EQ(jobs.size(), 6u * 2u);
  const Course course = course_of(experiment, jobs.back());
  EXPECT_EQ(course.judged.size(), 3u);
  const auto rows = rows_of(part_json(jobs.back(), run_course(course, method_of(experiment, jobs.back()))));
  ASSERT_EQ(rows.size(), 4u);
  EXPECT_EQ(rows.back().place, "all");
  double windows = 0.0;
  for (std::size_t i = 0; i < 3; ++i) windows += rows[i].groups.at("moving").windows;
  EXPECT_EQ(rows.back().groups.at("moving").windows, windows);
  EXPECT_EQ(rows.back().groups.at("inside").windows + rows.back().groups.at("outside").windows, windows);
}

TEST(Curves, HaveALineForEveryEpisodeThatWasJudged) {
  Experiment experiment = small(ExperimentKind::one_place);
  experiment.config.every_episode = true, experiment.config.batch = 10;
  const Job job = jobs_of(experiment)[0];
  const nlohmann::json part = part_json(job, run_course(course_of(experiment, job), method_of(experiment, job)));
  const std::string csv = curves_csv(std::span(&part, 1));
  EXPECT_EQ(std::ranges::count(csv, '\n'), 1 + 3);  // 26 tracks
  EXPECT_NE(csv.find("place 1,place 1,kinematics,1,0,3,26,0,"), std::string::npos) << csv;
}

TEST(Compare, FindsTheDifferenceThatIsThereWithAnIntervalRoundIt) {
  std::vector<PartRow> rows;
  for (int trial = 1; trial <= 3; ++trial) {
    rows.push_back(row("a", "sila", trial, 0.8)), rows.push_back(row("a", "other", trial, 0.9));
    rows.push_back(row("b", "sila", trial, 0.6)), rows.push_back(row("b", "other", trial, 0.6));
  }
  rows[1].by_person["a/3"].mhd_m += 1.0;
  std::map<std::string, Comparison> found;
  for (const Comparison& c : compare(rows, "sila", 500, 1)) found[c.place + "|" + c.method + "|" + c.against] = c;
  ASSERT_EQ(found.size(), 9u);
  EXPECT_NEAR(found.at("b|sila|constant velocity").difference, -0.4, 1e-12);
  EXPECT_NEAR(found.at("b|other|sila").difference, 0.0, 1e-12);
  const Comparison& a = found.at("a|other|sila");
  EXPECT_EQ(a.people, 30u);
  EXPECT_GT(a.difference, 0.1);
  EXPECT_LE(a.low, a.difference);
  EXPECT_LT(a.difference, a.high);
  EXPECT_NEAR(a.low, 0.1, 1e-9);  // samples without the one person whose error differs
  const Comparison& mean = found.at("mean|other|sila");
  EXPECT_NEAR(mean.difference, 0.5 * a.difference, 1e-12);
}

TEST(Compare, LeavesOutTrialsThatOnlyOneOfTheTwoHas) {
  std::vector<PartRow> rows{row("a", "sila", 1, 0.8), row("a", "other", 1, 0.9), row("a", "other", 2, 5.0)};
  for (const Comparison& c : compare(rows, "sila", 100, 1)) {
    if (c.method == "other" && c.against == "sila") {
      EXPECT_NEAR(c.difference, 0.1, 1e-12);
    }
  }
}

TEST(Tables, NameEveryMethodAndAreCsvThatHoldsTogether) {
  const std::vector<PartRow> rows{row("a, b", "sila", 1, 0.8), row("a, b", "other", 1, 0.9)};
  const std::string csv = rows_csv(rows);
  EXPECT_NE(csv.find("\"a, b\",sila,1,0,30,"), std::string::npos) << csv;
  const std::vector<MethodSummary> summaries = summarise(rows);
  ASSERT_EQ(summaries.size(), 2u);
  EXPECT_NEAR(summaries[0].values[3].mean, 0.8, 1e-12);
  EXPECT_EQ(summaries[0].values[4].mean, 0.0);  // no turning window
  EXPECT_EQ(summaries[0].values[5].count, 0u);  // so no error of them
  const std::string text = tables(summaries, compare(rows, "sila", 100, 1));
  for (const char* word : {"| sila |", "| other |", "## a, b", "0.800", "–"})
    EXPECT_NE(text.find(word), std::string::npos) << word << "\n" << text;
}

}  // namespace
}  // namespace sila
