#pragma once

// The program as a user runs it.

#include <gtest/gtest.h>
#include <sys/wait.h>

#include <cstdio>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "support/message_of.hpp"
#include "support/scratch.hpp"

namespace sila::tests {

namespace fs = std::filesystem;

struct Outcome {
  int code = 0;
  std::string out;  ///< stdout
  std::string err;
};

class Program : public ::testing::Test {
 protected:
  /// `before` is said to the shell first.
  Outcome run(const std::string& arguments, const std::string& before = "") const {
    const std::string err = (folder_ / "stderr").string();
    const std::string command =
        before + "cd '" + folder_.path().string() + "' && '" SILA_PROGRAM "' " + arguments + " 2>'" + err + "'";
    Outcome outcome;
    FILE* pipe = ::popen(command.c_str(), "r");
    char buffer[4096];
    for (std::size_t n; (n = std::fread(buffer, 1, sizeof buffer, pipe)) > 0;) outcome.out.append(buffer, n);
    const int status = ::pclose(pipe);
    outcome.code = WIFEXITED(status) ? WEXITSTATUS(status) : -1;
    outcome.err = content_of(err);
    return outcome;
  }

  /// The JSON on stdout.
  nlohmann::json json_of(const std::string& arguments) const { return nlohmann::json::parse(run(arguments).out); }

  /// Runs something wrong: the exit code is `code` (0: 1 or 2), one sentence on stderr has each of `words`.
  void expect_rejected(const std::string& arguments, const std::vector<std::string>& words, int code = 0) const {
    SCOPED_TRACE(arguments);
    const Outcome outcome = run(arguments);
    EXPECT_TRUE(code == 0 ? outcome.code == 1 || outcome.code == 2 : outcome.code == code)
        << "exit code " << outcome.code << "\n"
        << outcome.err;
    for (const std::string& word : words) EXPECT_TRUE(says(outcome.err, word));
  }

  void simulate() const {
    ASSERT_EQ(run("simulate --tracks 60 --seed 1 --set simulate.occlusions_per_min=0 --out tracks.csv").code, 0);
  }
  void learn() const {
    simulate();
    const Outcome outcome = run("learn tracks.csv --scene tracks.scene.json --model m.sila --batch 20");
    ASSERT_EQ(outcome.code, 0) << outcome.err;
  }

  ScratchFolder folder_;
};

}  // namespace sila::tests
