// Input that is meant to harm, or that fuzzing found to: rejected in one sentence, in bounded time and memory.
#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

#include "io/files.hpp"
#include "io/model_tables.hpp"
#include "io/sqlite.hpp"
#include "made_up_model.hpp"
#include "model/model_parts.hpp"
#include "sila/config.hpp"
#include "sila/io/config_json.hpp"
#include "sila/io/files.hpp"
#include "sila/model/packing.hpp"

namespace sila {
namespace {

using tests::format_error_of;

std::string repeated(std::size_t count, std::string_view text) {
  std::string all;
  for (std::size_t i = 0; i < count; ++i) all += text;
  return all;
}

// Nested JSON is printed and copied by recursion: a million brackets exhausted the stack.
TEST(HarmfulJson, IsRejectedIfItIsNestedTooDeep) {
  const ScratchFolder folder;
  for (const std::string& opening : {std::string("["), std::string("{\"a\":"), std::string("/* \" */["),
                                     std::string("/**//*\"*/["), std::string("[\"\\\"\",")}) {
    const std::string closing = opening.front() == '{' ? "}" : "]";
    const std::string text = repeated(200000, opening) + "1" + repeated(200000, closing);
    const auto error = format_error_of([&] { read_scene(folder.write("s.json", text)); });
    EXPECT_TRUE(says(error.what(), "nested"));
    EXPECT_EQ(error.line, 1U);
  }
}

TEST(HarmfulJson, BracketsInTextsAndCommentsAreNoNesting) {
  const ScratchFolder folder;
  const std::string many = repeated(1000, "[{");
  const std::string text = "// \"" + many + "\n/* \"" + many + "*/" + R"({"a": ")" + many + R"(\"[", "b": [1]})";
  EXPECT_EQ(read_json(folder.write("a.json", text))["b"][0], 1);
}

TEST(HarmfulJson, ANumberBeyondAllNumbersIsRejectedWithItsLine) {
  const ScratchFolder folder;
  const auto error = format_error_of([&] { read_json(folder.write("a.json", "{\n\"x\": 1,\n\"y\": -1e999}")); });
  EXPECT_EQ(error.line, 3U);
  EXPECT_TRUE(says(error.found, "-1e999"));
}

// A key of the input stands in the message: it must not break the line or move the cursor of a terminal.
TEST(HarmfulJson, MessagesAreOneLineOfBoundedLength) {
  const ScratchFolder folder;
  const std::string key = "two\\nlines \\u001b[2J" + repeated(5000, "x");
  const std::string text = "{\"" + key + "\": {\"" + key + "\": 1}}";
  const auto path = folder.write("c.json", text);
  const auto error = format_error_of([&] { apply_json(Config{}, read_json(path), path.string()); });
  const std::string message = error.what();
  EXPECT_EQ(message.find_first_of("\n\x1b"), std::string::npos) << message;
  EXPECT_LT(message.size(), 2000U);
  EXPECT_TRUE(says(message, path.string()));
}

// Two people whose ids differ by 2^64 were one.
TEST(HarmfulTracks, WholeNumbersBeyond64BitsKeepTheirSign) {
  const ScratchFolder folder;
  const std::string text = R"({"track": {"f": 1, "p": 18446744073709551615, "x": 0, "y": 0}}
{"track": {"f": 1, "p": -1, "x": 5, "y": 5}}
)";
  const TrackFile file = read_detections(folder.write("a.ndjson", text));
  ASSERT_EQ(file.detections.rows.size(), 2U);
  EXPECT_EQ(file.detections.rows[0].track, "18446744073709551615");
  EXPECT_EQ(file.detections.rows[1].track, "-1");
}

/// A model file as a foreign program would have changed it.
std::filesystem::path changed_model(const ScratchFolder& folder, const std::string& sql) {
  const auto path = folder / "m.sila";
  std::filesystem::remove(path);
  save_model(path, stored(random_model(3)));
  tests::run_sql(path, sql);
  return path;
}

// SQL inside a file is run by its readers: a view that never ends would keep a reader for ever.
TEST(HarmfulModel, IsRejectedIfItHasMoreThanPlainTables) {
  const ScratchFolder folder;
  const std::string endless = "WITH RECURSIVE n(i) AS (SELECT 1 UNION ALL SELECT i + 1 FROM n) SELECT i AS ";
  for (const std::string& sql : {
           "DROP TABLE parts; CREATE VIEW parts AS " + endless + "hash, x'' AS content FROM n",
           std::string("CREATE TRIGGER t AFTER INSERT ON parts BEGIN DELETE FROM parts; END"),
           std::string("CREATE INDEX i ON parts (hex(zeroblob(length(hash) * 10000)))"),
           std::string("ALTER TABLE parts ADD COLUMN more TEXT AS (hex(zeroblob(1000000)))"),
           std::string("CREATE VIRTUAL TABLE v USING fts5(a)"),
       }) {
    const auto path = changed_model(folder, sql);
    EXPECT_TRUE(says(message_of<FormatError>([&] { load_model(path); }), "plain tables")) << sql;
    EXPECT_TRUE(says(message_of<FormatError>([&] { model_of_bytes(content_of(path)); }), "plain tables")) << sql;
    EXPECT_TRUE(says(message_of<FormatError>([&] { ModelFile::open_or_create(path); }), "plain tables")) << sql;
  }
}

/// The bytes of a model file that sila itself does not write, with valid hashes.
std::string forged_bytes(const StoredModel& stored) {
  sqlite::Database database(":memory:", SQLITE_OPEN_READWRITE);
  sqlite::Transaction transaction(database, "BEGIN");
  tables::create(database);
  for (const EpisodeRecord& episode : stored.episodes) tables::write_episode(database, episode);
  tables::write_model(database, stored.episodes.back().number, parts_of(stored.model, stored.configuration));
  tables::write_meta(database, {1, "forged"});
  transaction.commit();
  return database.bytes();
}

// Both are parsed by all that use a model; other text ended the program with another error than that of a bad file.
TEST(HarmfulModel, IsRejectedIfItsTextsAreNoJsonObjects) {
  EXPECT_TRUE(identical(model_of_bytes(forged_bytes(stored(random_model(3)))).model, random_model(3)));
  for (const std::string& text :
       {std::string("{"), std::string("[1]"), repeated(3000, "{\"a\":") + "1" + repeated(3000, "}")}) {
    StoredModel model = stored(random_model(3));
    model.configuration = text;
    EXPECT_TRUE(says(message_of<FormatError>([&] { model_of_bytes(forged_bytes(model)); }), "configuration"));
    model = stored(random_model(3));
    model.episodes.back().statistics = text;
    EXPECT_TRUE(says(message_of<FormatError>([&] { model_of_bytes(forged_bytes(model)); }), "statistics"));
  }
}

}  // namespace
}  // namespace sila
