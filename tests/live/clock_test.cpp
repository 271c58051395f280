#include "sila/live/clock.hpp"

#include <gtest/gtest.h>

#include <random>

namespace sila {
namespace {

TEST(StreamClock, OneStrayStampNeverMovesTheClockOfOthers) {
  const LiveConfig config;
  for (unsigned seed = 1; seed <= 50; ++seed) {
    std::mt19937 random(seed);
    std::uniform_real_distribution<double> anywhere(-1e9, 1e9), uniform(0.0, 1.0);
    StreamClock clock;
    double now_s = 100.0;
    read_stamp(clock, now_s, false, config);
    for (int i = 0; i < 500; ++i) {
      if (uniform(random) < 0.4) {
        const double stray_s = anywhere(random);
        if (std::abs(stray_s - now_s) < 100.0) continue;
        EXPECT_EQ(read_stamp(clock, stray_s, true, config).refusal, Refusal::off_clock);
      }
      now_s += 0.1;
      EXPECT_FALSE(read_stamp(clock, now_s, true, config).refusal);
      EXPECT_DOUBLE_EQ(*clock.now_s, now_s);
    }
  }
}

TEST(StreamClock, ManyStampsThatAgreeSetTheClockAnew) {
  const LiveConfig config;
  for (const double jump_s : {-5000.0, 5000.0}) {
    StreamClock clock;
    read_stamp(clock, 0.0, false, config);
    for (int i = 1; i < config.clock_patience; ++i)
      EXPECT_EQ(read_stamp(clock, jump_s + 0.1 * i, true, config).refusal, Refusal::off_clock);
    const ClockReading last = read_stamp(clock, jump_s + 1.0, true, config);
    EXPECT_TRUE(last.set_anew);
    EXPECT_FALSE(last.refusal);
    EXPECT_FALSE(read_stamp(clock, jump_s + 1.1, true, config).refusal);
  }
}

TEST(StreamClock, WhileNobodyIsAboutAnyTimeIsBelieved) {
  const LiveConfig config;
  StreamClock clock;
  for (const double t_s : {0.0, 1e6, -5.0, 3.0}) {
    EXPECT_FALSE(read_stamp(clock, t_s, false, config).refusal);
    EXPECT_EQ(*clock.now_s, t_s);
  }
}

TEST(StreamClock, LateByALittleIsLateHoweverOften) {
  const LiveConfig config;
  StreamClock clock;
  read_stamp(clock, 100.0, false, config);
  EXPECT_FALSE(read_stamp(clock, 100.0 - 0.9 * config.late_s, true, config).refusal);
  for (int i = 0; i < 100; ++i)
    EXPECT_EQ(read_stamp(clock, 100.0 - 2.0 * config.late_s, true, config).refusal, Refusal::late);
  EXPECT_EQ(*clock.now_s, 100.0);
}

}  // namespace
}  // namespace sila
