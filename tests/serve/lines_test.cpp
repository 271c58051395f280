#include "sila/serve/lines.hpp"

#include <gtest/gtest.h>

#include <nlohmann/json.hpp>
#include <random>

#include "outbox.hpp"
#include "web_request.hpp"

namespace sila {
namespace {

Refusal refusal_of_line(const std::string& line) {
  const auto parsed = parse_detection(line);
  EXPECT_TRUE(std::holds_alternative<Refusal>(parsed)) << line;
  return std::holds_alternative<Refusal>(parsed) ? std::get<Refusal>(parsed) : Refusal::late;
}

TEST(Lines, ADetectionHasATimeAnIdAndAPlace) {
  for (const char* line :
       {R"({"t": 12.4, "id": "17", "x": 3, "y": -0.5})", R"({"id": 17, "y": -0.5, "x": 3.0, "t": 1.24e1, "z": [1]})"}) {
    const auto parsed = parse_detection(line);
    ASSERT_TRUE(std::holds_alternative<Detection>(parsed)) << line;
    const auto& row = std::get<Detection>(parsed);
    EXPECT_EQ(row.track, "17");
    EXPECT_EQ(row.t_s, 12.4);
    EXPECT_EQ(row.position_m, Vector2(3.0, -0.5));
  }
}

TEST(Lines, WhatIsNoDetectionIsRefusedWithItsReason) {
  for (const char* line : {"", "x", "[1]", "{", "{\"t\":1e999}", "12", "null", "\xff\xfe"})
    EXPECT_EQ(refusal_of_line(line), Refusal::not_json) << line;
  for (const char* line :
       {"{}", R"({"t":1,"id":"a","x":1})", R"({"t":"1","id":"a","x":1,"y":1})", R"({"t":1,"id":null,"x":1,"y":1})",
        R"({"t":1,"id":"","x":1,"y":1})", R"({"t":1,"id":1.5,"x":1,"y":1})", R"({"t":1,"id":"a","x":true,"y":1})"})
    EXPECT_EQ(refusal_of_line(line), Refusal::not_a_detection) << line;
  EXPECT_EQ(refusal_of_line(nlohmann::json{{"t", 1}, {"id", std::string(65, 'a')}, {"x", 1}, {"y", 1}}.dump()),
            Refusal::not_a_detection);
}

TEST(Lines, NoBytesMakeTheParserThrow) {
  for (unsigned seed = 1; seed <= 2000; ++seed) {
    std::mt19937 random(seed);
    std::string line = R"({"t": 12.4, "id": "17", "x": 3, "y": -0.5})";
    for (int k = 0; k < 4; ++k) line[random() % line.size()] = static_cast<char>(random() % 256);
    EXPECT_NO_THROW(parse_detection(line)) << "seed " << seed;
    EXPECT_NO_THROW(parse_token(line)) << "seed " << seed;
  }
  EXPECT_NO_THROW(parse_detection(std::string(100000, '[')));
}

TEST(Lines, EveryRefusalHasItsPlaceInTheList) {
  for (std::size_t i = 0; i < kRefusals.size(); ++i) {
    EXPECT_EQ(static_cast<std::size_t>(kRefusals[i].refusal), i);
    const auto told = nlohmann::json::parse(refusal_line(kRefusals[i].refusal, 3));
    EXPECT_EQ(told["refused"], std::string(kRefusals[i].name));
    EXPECT_EQ(told["count"], 3);
  }
}

TEST(Lines, TokensAreTheSameOrNot) {
  EXPECT_TRUE(same_token("secret", "secret"));
  for (const char* wrong : {"", "secre", "secret1", "Secret"}) EXPECT_FALSE(same_token(wrong, "secret"));
}

TEST(Outbox, DropsTheOldestPredictionsAndSaysHowMany) {
  for (unsigned seed = 1; seed <= 30; ++seed) {
    std::mt19937 random(seed);
    detail::Outbox box;
    std::size_t pushed = 0, dropped = 0, taken = 0, told = 0;
    for (int i = 0; i < 1000; ++i) {
      const bool droppable = random() % 5 != 0;
      std::string text = std::to_string(pushed++) + std::string(random() % 50, 'x');
      dropped += detail::push(box, std::move(text), droppable, 500);
      EXPECT_LE(box.bytes, 500u);
      std::size_t bytes = 0;
      for (const auto& line : box.lines) bytes += line.text.size();
      EXPECT_EQ(box.bytes, bytes);
      if (random() % 10 != 0) continue;
      for (const std::string& line : detail::take(box, 200)) {
        if (line.front() == '{')
          told += nlohmann::json::parse(line)["dropped"].get<std::size_t>();
        else
          ++taken;
      }
    }
    EXPECT_EQ(told + box.dropped, dropped);
    EXPECT_EQ(pushed, taken + dropped + box.lines.size());
    EXPECT_GT(dropped, 0u);
  }
}

TEST(Outbox, ALineThatAloneIsTooLongStillGoesOut) {
  detail::Outbox box;
  EXPECT_EQ(detail::push(box, std::string(1000, 'x'), true, 500), 0u);
  EXPECT_EQ(detail::take(box, 10).size(), 1u);
  EXPECT_EQ(box.bytes, 0u);
}

TEST(WebRequest, WithoutATokenOnlyThisMachineIsAnswered) {
  for (const char* host : {"localhost:8765", "127.0.0.1:8765", "[::1]:8765", "localhost"})
    EXPECT_FALSE(detail::refusal_of({"/", host, "", ""}, "")) << host;
  for (const char* host : {"evil.example:8765", "127.evil.example", "10.0.0.1", "localhost.evil.example"})
    EXPECT_TRUE(detail::refusal_of({"/", host, "", ""}, "")) << host;
}

TEST(WebRequest, PagesOfOtherSitesAreRefused) {
  EXPECT_TRUE(detail::refusal_of({"/stream", "localhost:8765", "https://evil.example", ""}, ""));
  EXPECT_TRUE(detail::refusal_of({"/stream?token=t", "host:1", "https://evil.example", ""}, "t"));
  EXPECT_FALSE(detail::refusal_of({"/live", "localhost:8765", "http://localhost:8765", ""}, ""));
}

TEST(WebRequest, ATokenIsShownAsBearerOrInTheQuery) {
  EXPECT_FALSE(detail::refusal_of({"/", "a", "", "Bearer secret"}, "secret"));
  EXPECT_FALSE(detail::refusal_of({"/?x=1&token=secret", "a", "", ""}, "secret"));
  for (const char* target : {"/", "/?token=", "/?token=wrong", "/?xtoken=secret", "/token=secret"})
    EXPECT_TRUE(detail::refusal_of({target, "localhost", "", ""}, "secret")) << target;
  EXPECT_TRUE(detail::refusal_of({"/", "localhost", "", "Basic secret"}, "secret"));
  EXPECT_EQ(detail::path_of({"/stream?token=secret", "", "", ""}), "/stream");
}

}  // namespace
}  // namespace sila
