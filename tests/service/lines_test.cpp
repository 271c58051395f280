#include "lines.hpp"

#include <gtest/gtest.h>

#include <nlohmann/json.hpp>
#include <random>

#include "web_request.hpp"

namespace sila {
namespace {

Rejection rejection_of_line(const std::string& line) {
  const ParsedLine parsed = parse_line(line, {}, false);
  EXPECT_TRUE(parsed.detections.empty() && parsed.rejections.size() == 1) << line;
  return parsed.rejections.empty() ? Rejection::late : parsed.rejections.front();
}

TEST(Lines, ParsesADetection) {
  for (const char* line :
       {R"({"t": 12.4, "id": "17", "x": 3, "y": -0.5})", R"({"id": 17, "y": -0.5, "x": 3.0, "t": 1.24e1, "z": [1]})"}) {
    const ParsedLine parsed = parse_line(line, {}, false);
    ASSERT_EQ(parsed.detections.size(), 1u) << line;
    EXPECT_TRUE(parsed.rejections.empty());
    const Detection& row = parsed.detections.front();
    EXPECT_EQ(row.track, "17");
    EXPECT_EQ(row.t_s, 12.4);
    EXPECT_EQ(row.position_m, Vector2(3.0, -0.5));
  }
}

TEST(Lines, ParsesAnEventOfTheFrigateCameraThatIsNamed) {
  const std::string event =
      R"({"after": {"id": "a.1", "camera": "yard", "frame_time": 7.5, "label": "person", "box": [100, 90, 140, 170]}})";
  const auto parse = [&](const std::optional<std::string>& camera) {
    return parse_line(event, {.frigate_camera = camera}, true);
  };
  EXPECT_EQ(parse("door").rejections, std::vector{Rejection::other_camera});
  EXPECT_EQ(parse("").rejections, std::vector{Rejection::other_camera});
  const ParsedLine parsed = parse("yard");
  ASSERT_EQ(parsed.detections.size(), 1u);
  EXPECT_EQ(parsed.detections[0].position_m, Vector2(120.0, 170.0));
  EXPECT_EQ(parsed.detections[0].t_s, 7.5);
  EXPECT_EQ(rejection_of_line(event), Rejection::no_camera);
}

TEST(Lines, ParsesEveryObjectOfAnAxisFrame) {
  const std::string frame = R"({"frame": {"timestamp": "1970-01-01T00:00:10.5Z", "observations": [)"
                            R"({"track_id": "4", "class": {"type": "Human"},)"
                            R"("bounding_box": {"left": 0.25, "top": 0.5, "right": 0.75, "bottom": 0.875}},)"
                            R"({"track_id": "5", "bounding_box": {"left": 0, "top": 0, "right": 1, "bottom": 1}},)"
                            R"({"track_id": "6", "class": {"type": "Human"}}]}})";
  const ParsedLine parsed = parse_line(frame, {.person_classes = {"unknown"}}, true);
  ASSERT_EQ(parsed.detections.size(), 2u);
  EXPECT_EQ(parsed.detections[0].position_m, Vector2(0.5, 0.875));
  EXPECT_EQ(parsed.detections[0].t_s, 10.5);
  EXPECT_EQ(parsed.detections[1].label, "person") << "asked for";
  EXPECT_NE(parsed.detections[0].label, "person");
  EXPECT_EQ(parsed.rejections, std::vector{Rejection::not_a_detection});
}

TEST(Lines, RejectsOtherLinesWithTheReason) {
  for (const char* line : {"", "x", "[1]", "{", "{\"t\":1e999}", "12", "null", "\xff\xfe"})
    EXPECT_EQ(rejection_of_line(line), Rejection::not_json) << line;
  for (const char* line :
       {"{}", R"({"t":1,"id":"a","x":1})", R"({"t":"1","id":"a","x":1,"y":1})", R"({"t":1,"id":null,"x":1,"y":1})",
        R"({"t":1,"id":"","x":1,"y":1})", R"({"t":1,"id":1.5,"x":1,"y":1})", R"({"t":1,"id":"a","x":true,"y":1})"})
    EXPECT_EQ(rejection_of_line(line), Rejection::not_a_detection) << line;
  EXPECT_EQ(rejection_of_line(nlohmann::json{{"t", 1}, {"id", std::string(65, 'a')}, {"x", 1}, {"y", 1}}.dump()),
            Rejection::not_a_detection);
}

TEST(Lines, NoBytesMakeTheParserThrow) {
  for (unsigned seed = 1; seed <= 2000; ++seed) {
    std::mt19937 random(seed);
    std::string line = R"({"t": 12.4, "id": "17", "x": 3, "y": -0.5})";
    for (int k = 0; k < 4; ++k) line[random() % line.size()] = static_cast<char>(random() % 256);
    EXPECT_NO_THROW(parse_line(line, {}, false)) << "seed " << seed;
    EXPECT_NO_THROW(parse_token(line)) << "seed " << seed;
  }
  EXPECT_NO_THROW(parse_line(std::string(100000, '['), {}, false));
  const std::string deep = std::string(200000, '[') + std::string(200000, ']');
  const std::string event = R"({"after":{"id":)" + deep + R"(,"box":[1,2,3,4]}})";
  EXPECT_EQ(parse_line(event, {}, true).rejections, std::vector{Rejection::not_json});
}

TEST(Lines, EveryRejectionIsInTheList) {
  for (std::size_t i = 0; i < kRejections.size(); ++i) {
    EXPECT_EQ(static_cast<std::size_t>(kRejections[i].rejection), i);
    const auto rejected = nlohmann::json::parse(rejection_line(kRejections[i].rejection, 3));
    EXPECT_EQ(rejected["rejected"], std::string(kRejections[i].name));
    EXPECT_EQ(rejected["count"], 3);
  }
}

TEST(Lines, ComparesTokens) {
  EXPECT_TRUE(same_token("secret", "secret"));
  for (const char* wrong : {"", "secre", "secret1", "Secret"}) EXPECT_FALSE(same_token(wrong, "secret"));
}

TEST(LineBuffer, CutsBlocksOfAnySizeIntoLines) {
  const std::string input = "one\n\n" + std::string(20, 'x') + "\ntwo\r\n" + std::string(9, 'y');
  for (std::size_t size = 1; size <= input.size(); ++size) {
    LineBuffer buffer(10);
    std::vector<std::string> lines;
    for (std::size_t begin = 0; begin < input.size(); begin += size) {
      buffer.append(std::string_view(input).substr(begin, size));
      while (const auto line = buffer.next()) lines.push_back(*line);
    }
    if (const auto line = buffer.last()) lines.push_back(*line);
    ASSERT_EQ(lines.size(), 5u) << "block size " << size;
    EXPECT_GT(lines[2].size(), 10u);
    lines[2].clear();
    EXPECT_EQ(lines, (std::vector<std::string>{"one", "", "", "two\r", std::string(9, 'y')}));
  }
}

TEST(LineBuffer, KeepsNoMoreThanTheLimitOfAnEndlessLine) {
  LineBuffer buffer(10);
  std::size_t lines = 0;
  for (int i = 0; i < 1000; ++i) {
    buffer.append("xxxxx");
    while (const auto line = buffer.next()) {
      ++lines;
      EXPECT_EQ(line->size(), 11u);
    }
  }
  EXPECT_EQ(lines, 1u);
  EXPECT_FALSE(buffer.last());
}

TEST(SendQueue, DropsTheOldestPredictionsAndReportsThem) {
  for (unsigned seed = 1; seed <= 30; ++seed) {
    std::mt19937 random(seed);
    SendQueue queue(500);
    std::size_t pushed = 0, dropped = 0, taken = 0, reported = 0;
    const auto take = [&] {
      const std::optional<std::string> line = queue.next();
      if (line && line->front() == '{')
        reported += nlohmann::json::parse(*line)["dropped"].get<std::size_t>();
      else if (line)
        ++taken;
      return line.has_value();
    };
    for (int i = 0; i < 1000; ++i) {
      const bool droppable = random() % 5 != 0;
      std::string text = std::to_string(pushed++) + std::string(random() % 50, 'x');
      dropped += queue.push(std::move(text), droppable);
      EXPECT_LE(queue.bytes(), 500u);
      for (auto k = random() % 10 == 0 ? random() % 12 : 0; k > 0; --k) take();
    }
    while (take()) continue;
    EXPECT_TRUE(queue.empty());
    EXPECT_EQ(queue.bytes(), 0u);
    EXPECT_EQ(reported, dropped);
    EXPECT_EQ(pushed, taken + dropped);
    EXPECT_GT(dropped, 0u);
  }
  SendQueue queue(8);
  for (const char* text : {"old", "kept", "new"}) queue.push(text, true);
  EXPECT_EQ(nlohmann::json::parse(queue.next().value())["dropped"], 1);
  EXPECT_EQ(queue.next(), "kept");
  EXPECT_EQ(queue.next(), "new");
}

TEST(SendQueue, SendsASingleLineOverTheLimit) {
  SendQueue queue(500);
  EXPECT_EQ(queue.push(std::string(1000, 'x'), true), 0u);
  EXPECT_EQ(queue.next(), std::string(1000, 'x'));
  EXPECT_EQ(queue.bytes(), 0u);
}

TEST(WebRequest, WithoutATokenOnlyLoopbackIsAnswered) {
  for (const char* host : {"localhost:8765", "127.0.0.1:8765", "[::1]:8765", "localhost"})
    EXPECT_FALSE(detail::rejection_of({"/", host, "", ""}, "")) << host;
  for (const char* host : {"evil.example:8765", "127.evil.example", "10.0.0.1", "localhost.evil.example"})
    EXPECT_TRUE(detail::rejection_of({"/", host, "", ""}, "")) << host;
}

TEST(WebRequest, RejectsPagesOfOtherSites) {
  EXPECT_TRUE(detail::rejection_of({"/stream", "localhost:8765", "https://evil.example", ""}, ""));
  EXPECT_TRUE(detail::rejection_of({"/stream?token=t", "host:1", "https://evil.example", ""}, "t"));
  EXPECT_FALSE(detail::rejection_of({"/live", "localhost:8765", "http://localhost:8765", ""}, ""));
}

TEST(WebRequest, ATokenIsABearerOrInTheQuery) {
  EXPECT_FALSE(detail::rejection_of({"/", "a", "", "Bearer secret"}, "secret"));
  EXPECT_FALSE(detail::rejection_of({"/?x=1&token=secret", "a", "", ""}, "secret"));
  for (const char* target : {"/", "/?token=", "/?token=wrong", "/?xtoken=secret", "/token=secret"})
    EXPECT_TRUE(detail::rejection_of({target, "localhost", "", ""}, "secret")) << target;
  EXPECT_TRUE(detail::rejection_of({"/", "localhost", "", "Basic secret"}, "secret"));
  EXPECT_EQ(detail::path_of({"/stream?token=secret", "", "", ""}), "/stream");
}

}  // namespace
}  // namespace sila
