#include "clock.hpp"

#include <gtest/gtest.h>

#include <random>

namespace sila {
namespace {

/// Reads a stamp and moves the clock.
ClockReading read(StreamClock& clock, double t_s, bool any_track) {
  const ClockReading reading = read_stamp(clock, t_s, any_track, ServiceConfig{});
  clock = reading.clock;
  return reading;
}

TEST(StreamClock, OneStrayStampNeverMovesTheClock) {
  for (unsigned seed = 1; seed <= 50; ++seed) {
    std::mt19937 random(seed);
    std::uniform_real_distribution<double> anywhere(-1e9, 1e9), uniform(0.0, 1.0);
    StreamClock clock;
    double now_s = 100.0;
    read(clock, now_s, false);
    for (int i = 0; i < 500; ++i) {
      if (uniform(random) < 0.4) {
        const double stray_s = anywhere(random);
        if (std::abs(stray_s - now_s) < 100.0) continue;
        EXPECT_EQ(read(clock, stray_s, true).rejection, Rejection::off_clock);
      }
      now_s += 0.1;
      EXPECT_FALSE(read(clock, now_s, true).rejection);
      EXPECT_DOUBLE_EQ(*clock.now_s, now_s);
    }
  }
}

TEST(StreamClock, OneStampAheadMovesTheClockOnlyIfANewerOneFollows) {
  for (const double ahead_s : {0.6, 3.0, 9.9}) {
    StreamClock clock;
    read(clock, 0.0, false);
    for (int k = 0; k < 5; ++k) EXPECT_FALSE(read(clock, ahead_s, true).rejection) << "the rows of one frame";
    EXPECT_EQ(*clock.now_s, 0.0);
    StreamClock after_pause = clock;
    EXPECT_FALSE(read(after_pause, ahead_s + 0.2, true).rejection);
    EXPECT_EQ(*after_pause.now_s, ahead_s + 0.2);
    EXPECT_FALSE(read(clock, 0.1, true).rejection);
    EXPECT_FALSE(read(clock, 0.2, true).rejection);
    EXPECT_EQ(*clock.now_s, 0.2);
  }
}

TEST(StreamClock, ManyAgreeingStampsResetTheClock) {
  const ServiceConfig config;
  for (const double jump_s : {-5000.0, 5000.0}) {
    StreamClock clock;
    read(clock, 0.0, false);
    for (int i = 1; i < config.clock_patience; ++i)
      EXPECT_EQ(read(clock, jump_s + 0.1 * i, true).rejection, Rejection::off_clock);
    const ClockReading last = read(clock, jump_s + 1.0, true);
    EXPECT_TRUE(last.reset);
    EXPECT_FALSE(last.rejection);
    EXPECT_FALSE(read(clock, jump_s + 1.1, true).rejection);
  }
}

TEST(StreamClock, WithoutAnOpenTrackAnyTimeIsAccepted) {
  StreamClock clock;
  for (const double t_s : {0.0, 1e6, -5.0, 3.0}) {
    EXPECT_FALSE(read(clock, t_s, false).rejection);
    EXPECT_EQ(*clock.now_s, t_s);
  }
}

TEST(StreamClock, FollowsAClockThatWasSetBackALittle) {
  StreamClock clock;
  read(clock, 100.0, false);
  for (int k = 0; k < 10; ++k) EXPECT_EQ(read(clock, 97.0 + 0.1 * k, true).rejection, Rejection::late);
  EXPECT_TRUE(read(clock, 98.0, true).reset);
  EXPECT_FALSE(read(clock, 98.1, true).rejection);
}

TEST(StreamClock, SlightlyLateStampsBetweenOthersNeverResetTheClock) {
  StreamClock clock;
  for (int k = 0; k < 100; ++k) {
    EXPECT_FALSE(read(clock, 0.1 * k, k > 0).rejection);
    EXPECT_TRUE(k == 0 || read(clock, 0.1 * k - 2.0, true).rejection == Rejection::late);
  }
}

TEST(StreamClock, SlightlyLateStampsNeverResetTheClock) {
  const ServiceConfig config;
  StreamClock clock;
  read(clock, 100.0, false);
  EXPECT_FALSE(read(clock, 100.0 - 0.9 * config.late_s, true).rejection);
  for (int i = 0; i < 100; ++i) EXPECT_EQ(read(clock, 100.0 - 2.0 * config.late_s, true).rejection, Rejection::late);
  EXPECT_EQ(*clock.now_s, 100.0);
}

}  // namespace
}  // namespace sila
