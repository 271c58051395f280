// The bytes of model files: a sound file with bytes spoilt, or with tables changed as a foreign program would.

#include <sqlite3.h>

#include <array>
#include <cstring>
#include <memory>

#include "io/made_up_model.hpp"
#include "numbers.hpp"
#include "promises.hpp"
#include "sila/io/files.hpp"
#include "sila/model/packing.hpp"
#include "support/scratch.hpp"

namespace sila::fuzz {
namespace {

struct Close {
  void operator()(sqlite3* database) const { sqlite3_close(database); }
};

/// The same file with the smallest pages that there are: half as many bytes, and most are ours instead of SQLite's.
std::string in_small_pages(const std::string& bytes) {
  const tests::ScratchFolder folder;
  const std::string path = (folder / "m.sila").string();
  write_file(path, bytes);
  sqlite3* opened = nullptr;
  const int code = sqlite3_open(path.c_str(), &opened);
  std::unique_ptr<sqlite3, Close> database(opened);
  require(code == SQLITE_OK &&
              sqlite3_exec(opened, "PRAGMA page_size = 512; VACUUM", nullptr, nullptr, nullptr) == SQLITE_OK,
          "SQLite can make pages small");
  database.reset();
  return content_of(path);
}

std::string sound_bytes() {
  Model model = random_model(3);
  model.primitives.resize(2);
  model.transitions.resize(1);
  model.refinement.residuals.resize(1);
  model.transitions[0].from = model.transitions[0].to = 0;
  for (ErrorStatistics& statistics : model.refinement.error_statistics) statistics = of_one_step(statistics);
  model.refinement.prior = of_one_step(model.refinement.prior);
  return in_small_pages(model_bytes(stored(model)));
}

/// The file after some SQL; as it was if SQLite rejects it.
std::string after(const std::string& bytes, const std::string& sql) {
  sqlite3* opened = nullptr;
  if (sqlite3_open(":memory:", &opened) != SQLITE_OK) return bytes;
  const std::unique_ptr<sqlite3, Close> database(opened);
  const auto size = static_cast<sqlite3_int64>(bytes.size());
  auto* const copy = static_cast<unsigned char*>(sqlite3_malloc64(bytes.size()));
  std::memcpy(copy, bytes.data(), bytes.size());
  if (sqlite3_deserialize(opened, "main", copy, size, size,
                          SQLITE_DESERIALIZE_FREEONCLOSE | SQLITE_DESERIALIZE_RESIZEABLE) != SQLITE_OK)
    return bytes;
  sqlite3_exec(opened, sql.c_str(), nullptr, nullptr, nullptr);
  sqlite3_int64 length = 0;
  unsigned char* const changed = sqlite3_serialize(opened, "main", &length, 0);
  if (changed == nullptr) return bytes;
  std::string result(reinterpret_cast<const char*>(changed), static_cast<std::size_t>(length));
  sqlite3_free(changed);
  return result;
}

std::string some_sql(std::mt19937& random) {
  static constexpr std::array<const char*, 16> columns = {
      "meta.revision",    "meta.sila_version",    "meta.rollbacks",  "meta.hash",
      "models.episode",   "models.hash",          "models.head",     "models.parts",
      "parts.hash",       "parts.content",        "episodes.number", "episodes.tracks",
      "episodes.seconds", "episodes.size_before", "episodes.hash",   "episodes.statistics"};
  static constexpr std::array<const char*, 18> values = {"0",
                                                         "-1",
                                                         "1",
                                                         "2147483648",
                                                         "9223372036854775807",
                                                         "1e300",
                                                         "9e999",
                                                         "-9e999",
                                                         "0.5",
                                                         "'x'",
                                                         "'{}'",
                                                         "x''",
                                                         "x'00'",
                                                         "zeroblob(4096)",
                                                         "randomblob(8)",
                                                         "randomblob(64)",
                                                         "randomblob(16)",
                                                         "NULL"};
  static constexpr std::array<const char*, 12> statements = {"DELETE FROM meta",
                                                             "DELETE FROM parts",
                                                             "DROP TABLE models",
                                                             "DROP TABLE episodes",
                                                             "INSERT INTO meta SELECT * FROM meta",
                                                             "PRAGMA user_version = 99",
                                                             "PRAGMA user_version = 0",
                                                             "PRAGMA application_id = 1",
                                                             "CREATE VIEW v AS SELECT 1",
                                                             "ALTER TABLE models RENAME COLUMN head TO h",
                                                             "CREATE TABLE more (a CHECK (a > 1) DEFAULT 3)",
                                                             "DROP TABLE models; CREATE VIEW models AS SELECT 1"};
  if (random() % 8 == 0) return statements[random() % statements.size()];
  const std::string column = columns[random() % columns.size()];
  const std::size_t dot = column.find('.');
  const std::string table = column.substr(0, dot), name = column.substr(dot + 1);
  const std::string value = values[random() % values.size()];
  return "UPDATE " + table + " SET " + name + " = " + value;
}

}  // namespace
}  // namespace sila::fuzz

/// Without what costs an input more than reading it: SQLite's own locks and counts.
extern "C" int LLVMFuzzerInitialize(int*, char***) {
  const bool set = sqlite3_config(SQLITE_CONFIG_SINGLETHREAD) == SQLITE_OK &&
                   sqlite3_config(SQLITE_CONFIG_MEMSTATUS, 0) == SQLITE_OK;
  sila::fuzz::require(set, "SQLite can be configured before it is used");
  return 0;
}

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace sila;
  using namespace sila::fuzz;
  StoredModel read;
  if (accepts("the bytes of a model", 0, [&] { read = model_of_bytes({reinterpret_cast<const char*>(data), size}); })) {
    check(read.model);
    require(identical(model_of_bytes(model_bytes(read)).model, read.model), "what was read can be written");
  }
  return 0;
}

extern "C" std::size_t LLVMFuzzerCustomMutator(std::uint8_t* data, std::size_t size, std::size_t max_size,
                                               unsigned seed) {
  using namespace sila::fuzz;
  static const std::string sound = sound_bytes();
  std::mt19937 random(seed);
  std::string bytes(reinterpret_cast<const char*>(data), size);
  if (size < sound.size() / 2 || random() % 16 == 0) bytes = sound;
  if (random() % 3 == 0) bytes = after(bytes, some_sql(random));
  const std::size_t length = std::min(bytes.size(), max_size);
  std::memcpy(data, bytes.data(), length);
  if (random() % 2 == 0) return length;
  // A few bytes at once: a file of pages is seldom helped by what libFuzzer does to all of it.
  const std::size_t window = std::min<std::size_t>(length, 16), at = random() % (length - window + 1);
  std::array<std::uint8_t, 16> part{};
  std::copy_n(data + at, window, part.begin());
  LLVMFuzzerMutate(part.data(), window, window);
  std::copy_n(part.begin(), window, data + at);
  return length;
}
