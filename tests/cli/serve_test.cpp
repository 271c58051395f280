#include <fcntl.h>
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <cstdlib>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <thread>

#include "program.hpp"

// The service on standard input and output.
namespace sila::tests {
namespace {

/// The detections of one person at 10 Hz; the speed of the person is 1 m/s.
std::string one_walker(int detections) {
  std::string lines;
  for (int k = 0; k < detections; ++k)
    lines += nlohmann::json{{"t", 0.1 * k}, {"id", "a"}, {"x", 0.1 * k}, {"y", 0.0}}.dump() + "\n";
  return lines;
}

TEST_F(Program, PredictsAtEachDetectionIfStandardInputWaits) {
  std::string lines;
  for (int k = 0; k < 20; ++k) {  // who comes first changes from one time stamp to the next
    for (int i = 0; i < 2; ++i) {
      const int id = (k + i) % 2;
      lines +=
          nlohmann::json{{"t", 0.1 * k}, {"id", std::to_string(id)}, {"x", 0.1 * k}, {"y", 5.0 * id}}.dump() + "\n";
    }
  }
  folder_.write("lines.ndjson", lines);
  const Outcome served =
      run("serve --stdin --wait --http off --set service.max_rate_hz=1 --model s.sila < lines.ndjson");
  ASSERT_EQ(served.code, 0) << served.err;
  EXPECT_EQ(std::count(served.out.begin(), served.out.end(), '\n'), 2 * 16) << "one from 0.4 s on for each detection";
  EXPECT_FALSE(says(served.out, "dropped"));
  EXPECT_FALSE(says(served.out, "rejected")) << "a file has no rate";
}

TEST_F(Program, AServiceThatReadsAFileTakesAQuietTimeAsTheEndOfAllTracks) {
  std::string lines;
  for (int k = 0; k < 60; ++k) {
    const double t_s = 60.0 * (k / 20) + 0.1 * (k % 20);
    lines +=
        nlohmann::json{{"t", t_s}, {"id", std::to_string(k / 20)}, {"x", 0.13 * (k % 20)}, {"y", 0.0}}.dump() + "\n";
  }
  folder_.write("lines.ndjson", lines);
  const std::string out = run("serve --stdin --wait --http off --model s.sila < lines.ndjson").out;
  EXPECT_EQ(std::count(out.begin(), out.end(), '\n'), 3 * 16) << "one from 0.4 s on for each detection";
  EXPECT_FALSE(says(out, "off_clock"));
}

TEST_F(Program, AServiceLearnsItsTracksBeforeAHangupEndsIt) {
  folder_.write("lines.ndjson", one_walker(40));
  const std::string feed =
      "cd '" + folder_.path().string() + "' && mkfifo f && { (cat lines.ndjson; sleep 4) > f & } && ";
  const std::string serve = "timeout --preserve-status --signal=HUP 2 '" SILA_PROGRAM "' serve --stdin --http off";
  EXPECT_EQ(std::system((feed + serve + " --model s.sila < f > out").c_str()), 0);
  EXPECT_TRUE(std::filesystem::exists(folder_ / "s.sila"));
}

TEST_F(Program, SaysThatStandardInputOrOutputOfAServiceFailed) {
  folder_.write("lines.ndjson", one_walker(8));
  const std::string serve = "serve --stdin --wait --http off --model s.sila ";
  const std::string no_endless_loop = "ulimit -t 20; ";
  for (const auto& [files, what] :
       {std::pair{"< lines.ndjson > /dev/full", "standard output cannot be written: "},
        std::pair{"< .", "standard input cannot be read: "}, std::pair{"<&-", "standard input is closed"}}) {
    const Outcome outcome = run(serve + files, no_endless_loop);
    EXPECT_EQ(outcome.code, 1) << files << outcome.err;
    EXPECT_TRUE(says(outcome.err, std::string("sila: serve: ") + what)) << files;
  }
}

TEST_F(Program, AServiceWritesAllPredictionsToASlowPipeThatDoesNotBlock) {
  folder_.write("lines.ndjson", one_walker(200));
  int ends[2];
  ASSERT_EQ(::pipe(ends), 0);
  ASSERT_EQ(::fcntl(ends[1], F_SETFL, O_NONBLOCK), 0);
  std::thread service([&] {
    run("serve --stdin --wait --http off --model s.sila < lines.ndjson >&" + std::to_string(ends[1]));
    ::close(ends[1]);
  });
  std::this_thread::sleep_for(std::chrono::milliseconds(500));
  std::string out;
  char buffer[4096];
  for (ssize_t n; (n = ::read(ends[0], buffer, sizeof buffer)) > 0;) out.append(buffer, static_cast<std::size_t>(n));
  service.join();
  ::close(ends[0]);
  EXPECT_EQ(std::count(out.begin(), out.end(), '\n'), 196) << "one from 0.4 s on for each detection";
}

TEST_F(Program, ServesASceneWithACameraOnlyIfItsUseIsSaid) {
  simulate();
  nlohmann::json scene = nlohmann::json::parse(content_of(folder_ / "tracks.scene.json"));
  scene["camera"] = {{"homography", {{0.5, 0, 0}, {0, 0.5, 0}, {0, 0, 1}}}};
  folder_.write("seen.json", scene.dump());
  std::string lines;
  for (int k = 0; k < 8; ++k)
    lines += nlohmann::json{{"t", 0.1 * k}, {"id", "a"}, {"x", 10.0 + 0.3 * k}, {"y", 9.0}}.dump() + "\n";
  folder_.write("lines.ndjson", lines);
  const std::string serve = "serve --stdin --wait --http off --scene seen.json --model s.sila < lines.ndjson";
  expect_rejected(serve, {"seen.json has a camera", "--camera seen.json", "--camera off"});
  EXPECT_TRUE(says(run(serve + " --camera seen.json").out, "\"u\":"));
  const std::string metres = run(serve + " --camera off").out;
  EXPECT_TRUE(says(metres, "\"modes\":"));
  EXPECT_FALSE(says(metres, "\"u\":"));
}

}  // namespace
}  // namespace sila::tests
