#include "model_rows.hpp"

#include <algorithm>
#include <stdexcept>
#include <utility>

#include "bytes.hpp"
#include "sila/version.hpp"

namespace sila::rows {
namespace {

const char* const kTables = R"(
CREATE TABLE meta (          -- one row
  revision INTEGER NOT NULL,     -- how often the file was changed
  sila_version TEXT NOT NULL,    -- of the last writer
  episodes INTEGER NOT NULL,     -- that made the model
  tracks INTEGER NOT NULL,       -- learnt from
  configuration TEXT NOT NULL,   -- JSON
  settings BLOB NOT NULL,        -- doubles: see sila/model/packing.hpp, as for all blobs of doubles, little endian
  sharing INTEGER NOT NULL,      -- of its sites: 0 apart, 1 shared
  global_residual BLOB NOT NULL, -- doubles: the sparse GP of all sites
  checksum INTEGER NOT NULL,     -- CRC-32 of the model and the configuration
  undo_kept INTEGER NOT NULL,    -- how many episodes can be taken back at most
  log_checksum INTEGER NOT NULL  -- CRC-32 of the rest of this row and of the checksums of all episodes
);
CREATE TABLE sites (
  id INTEGER PRIMARY KEY,        -- 0, 1, 2, ...
  frame BLOB NOT NULL,           -- doubles: of the corner
  episodes INTEGER NOT NULL,     -- that had tracks of this site
  tracks INTEGER NOT NULL,       -- of this site learnt from
  error_statistics BLOB NOT NULL, -- doubles: error statistics of predictions at this site
  global_residual BLOB NOT NULL  -- doubles: the sparse GP
);
CREATE TABLE primitives (
  id INTEGER PRIMARY KEY,        -- 0, 1, 2, ...
  weight REAL NOT NULL,
  support INTEGER NOT NULL,      -- at least so many different tracks showed it
  cells BLOB NOT NULL,           -- 32-bit integers, little endian: x and y of each cell
  velocities BLOB NOT NULL       -- doubles: x and y of each cell
);
CREATE TABLE transitions (
  from_primitive INTEGER NOT NULL,
  to_primitive INTEGER NOT NULL,
  count REAL NOT NULL,
  field BLOB NOT NULL,           -- doubles: the sparse GP and its extent
  residual BLOB NOT NULL,        -- doubles: the sparse GP
  sites BLOB NOT NULL,           -- doubles: id, count and last episode (of the site) of each site that showed it
  support INTEGER NOT NULL,      -- at least so many different tracks showed it
  PRIMARY KEY (from_primitive, to_primitive)
);
CREATE TABLE episodes (
  number INTEGER PRIMARY KEY,    -- 1, 2, 3, ...
  tracks INTEGER NOT NULL,
  seconds REAL NOT NULL,         -- that learning it took
  size_before INTEGER NOT NULL,
  size_after INTEGER NOT NULL,
  committed_s INTEGER NOT NULL,  -- when: seconds since 1970, UTC; 0: not known
  checksum INTEGER NOT NULL,     -- CRC-32 of the rest of the row
  statistics TEXT NOT NULL       -- JSON
);
CREATE TABLE learnt (            -- what must not be learnt again
  episode BLOB PRIMARY KEY       -- the 128 bits that stand for the content of a batch, two 64-bit integers, little endian
) WITHOUT ROWID;
CREATE TABLE undo (
  episode INTEGER PRIMARY KEY,   -- that this takes back
  checksum INTEGER NOT NULL,     -- CRC-32 of the number and the step
  step BLOB NOT NULL             -- what the episode replaced: src/io/undo_step.hpp
);
)";

std::int64_t checksum_of(const EpisodeRecord& episode) {
  std::string bytes;
  bytes::append(bytes, std::int64_t{episode.number});
  bytes::append(bytes, std::int64_t{episode.tracks});
  bytes::append(bytes, episode.seconds + 0.0);  // + 0.0: SQLite knows no -0
  bytes::append(bytes, static_cast<std::int64_t>(episode.size_before));
  bytes::append(bytes, static_cast<std::int64_t>(episode.size_after));
  bytes::append(bytes, episode.committed_s);
  return crc(bytes + episode.statistics);
}

std::int64_t checksum_of_step(int episode, const std::string& step) {
  std::string bytes;
  bytes::append(bytes, std::int64_t{episode});
  return crc(step, crc(bytes));
}

std::int64_t log_checksum(sqlite::Database& database, const FileFacts& facts) {
  std::string bytes;
  bytes::append(bytes, facts.revision);
  bytes::append(bytes, std::int64_t{facts.undo_kept});
  bytes += facts.sila_version;
  sqlite::Statement row = database.prepare("SELECT checksum FROM episodes ORDER BY number");
  while (row.step()) bytes::append(bytes, row.integer(0));
  return crc(bytes);
}

template <class Count>
Count row_count(std::int64_t value) {
  if (std::in_range<Count>(value) && value >= 0) return static_cast<Count>(value);
  throw std::invalid_argument(std::to_string(value) + " is no count");
}

void write_primitives(sqlite::Database& database, const std::vector<PrimitiveRow>& primitives) {
  database.execute("DELETE FROM primitives");
  sqlite::Statement insert = database.prepare("INSERT INTO primitives VALUES (?, ?, ?, ?, ?)");
  std::int64_t id = 0;
  for (const PrimitiveRow& row : primitives)
    insert.bind(id++).bind(row.weight).bind(row.support).bind_blob(row.cells).bind_blob(row.velocities).step();
}

void write_transitions(sqlite::Database& database, const std::vector<TransitionRow>& transitions) {
  database.execute("DELETE FROM transitions");
  sqlite::Statement insert = database.prepare("INSERT INTO transitions VALUES (?, ?, ?, ?, ?, ?, ?)");
  for (const TransitionRow& row : transitions) {
    insert.bind(row.from).bind(row.to).bind(row.count).bind_blob(row.field).bind_blob(row.residual);
    insert.bind_blob(row.sites).bind(row.support).step();
  }
}

void write_sites(sqlite::Database& database, const std::vector<SiteRow>& sites) {
  database.execute("DELETE FROM sites");
  sqlite::Statement insert = database.prepare("INSERT INTO sites VALUES (?, ?, ?, ?, ?, ?)");
  std::int64_t id = 0;
  for (const SiteRow& row : sites)
    insert.bind(id++)
        .bind_blob(row.frame)
        .bind(row.episodes)
        .bind(row.tracks)
        .bind_blob(row.error_statistics)
        .bind_blob(row.global_residual)
        .step();
}

void write_learnt(sqlite::Database& database, const std::vector<std::string>& ids) {
  database.execute("DELETE FROM learnt");
  sqlite::Statement insert = database.prepare("INSERT INTO learnt VALUES (?)");
  for (const std::string& id : ids) insert.bind_blob(id).step();
}

void write_facts(sqlite::Database& database, const Content& content, const FileFacts& facts) {
  database.execute("DELETE FROM meta");
  sqlite::Statement insert = database.prepare("INSERT INTO meta VALUES (?, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?)");
  insert.bind(facts.revision).bind(std::string_view(facts.sila_version)).bind(content.episodes).bind(content.tracks);
  insert.bind(std::string_view(content.configuration)).bind_blob(content.settings).bind(content.sharing);
  insert.bind_blob(content.global_residual).bind(checksum(content)).bind(std::int64_t{facts.undo_kept});
  insert.bind(log_checksum(database, facts)).step();
}

void read_sites(sqlite::Database& database, Content& content) {
  sqlite::Statement row =
      database.prepare("SELECT id, frame, episodes, tracks, error_statistics, global_residual FROM sites ORDER BY id");
  while (row.step()) {
    if (row.integer(0) != static_cast<std::int64_t>(content.sites.size()))
      throw std::invalid_argument("a site is missing");
    content.sites.push_back({row.blob(1), row.integer(2), row.integer(3), row.blob(4), row.blob(5)});
  }
}

void read_primitives(sqlite::Database& database, Content& content) {
  sqlite::Statement row = database.prepare("SELECT id, weight, cells, velocities, support FROM primitives ORDER BY id");
  while (row.step()) {
    if (row.integer(0) != static_cast<std::int64_t>(content.primitives.size()))
      throw std::invalid_argument("a primitive is missing");
    content.primitives.push_back({row.real(1), row.integer(4), row.blob(2), row.blob(3)});
  }
}

void read_transitions(sqlite::Database& database, Content& content) {
  sqlite::Statement row = database.prepare(
      "SELECT from_primitive, to_primitive, count, field, residual, sites, support FROM transitions ORDER BY "
      "from_primitive, to_primitive");
  while (row.step()) {
    content.transitions.push_back(
        {row.integer(0), row.integer(1), row.real(2), row.blob(3), row.blob(4), row.blob(5), row.integer(6)});
  }
}

std::vector<EpisodeRecord> select_episodes(sqlite::Database& database, const std::string& which) {
  std::vector<EpisodeRecord> episodes;
  sqlite::Statement row = database.prepare(
      "SELECT number, tracks, seconds, size_before, size_after, statistics, committed_s, checksum FROM episodes " +
      which);
  while (row.step()) {
    episodes.push_back({row_count<int>(row.integer(0)), row_count<long>(row.integer(1)), row.real(2),
                        row_count<std::size_t>(row.integer(3)), row_count<std::size_t>(row.integer(4)), row.text(5),
                        row.integer(6)});
    if (row.integer(7) != checksum_of(episodes.back())) {
      throw std::invalid_argument("the checksum of the record of episode " + std::to_string(episodes.back().number) +
                                  " does not agree");
    }
  }
  return episodes;
}

}  // namespace

void create(sqlite::Database& database) {
  database.execute("PRAGMA application_id = " + std::to_string(kApplicationId) +
                   "; PRAGMA user_version = " + std::to_string(kSchema) + ";" + kTables);
}

std::int64_t revision(sqlite::Database& database) {
  return database.integer("SELECT revision FROM meta");
}

FileFacts read_facts(sqlite::Database& database) {
  sqlite::Statement row = database.prepare("SELECT revision, sila_version, undo_kept, log_checksum FROM meta");
  if (!row.step()) throw sqlite::Error(SQLITE_CORRUPT, "meta has no row");
  const FileFacts facts{row.integer(0), row.text(1), row_count<int>(row.integer(2))};
  if (row.integer(3) != log_checksum(database, facts))
    throw std::invalid_argument("the checksum of the episodes does not agree");
  return facts;
}

Content read_content(sqlite::Database& database) {
  Content content;
  sqlite::Statement meta = database.prepare(
      "SELECT episodes, tracks, configuration, settings, sharing, global_residual, checksum FROM meta");
  if (!meta.step()) throw sqlite::Error(SQLITE_CORRUPT, "meta has no row");
  content.episodes = meta.integer(0);
  content.tracks = meta.integer(1);
  content.configuration = meta.text(2);
  content.settings = meta.blob(3);
  content.sharing = meta.integer(4);
  content.global_residual = meta.blob(5);
  read_sites(database, content);
  read_primitives(database, content);
  read_transitions(database, content);
  sqlite::Statement learnt = database.prepare("SELECT episode FROM learnt");
  while (learnt.step()) content.learnt.push_back(learnt.blob(0));
  sort_learnt(content.learnt);
  if (meta.integer(6) != checksum(content)) throw std::invalid_argument("the checksum does not agree");
  return content;
}

std::vector<EpisodeRecord> read_episodes(sqlite::Database& database) {
  return select_episodes(database, "ORDER BY number");
}

std::vector<EpisodeRecord> detailed_episodes(sqlite::Database& database, int last) {
  return select_episodes(database, "WHERE number <= " + std::to_string(last) +
                                       R"( AND instr(statistics, '"change"') > 0 ORDER BY number)");
}

void write_content(sqlite::Database& database, const Content& content, const FileFacts& facts) {
  write_sites(database, content.sites);
  write_primitives(database, content.primitives);
  write_transitions(database, content.transitions);
  write_learnt(database, content.learnt);
  write_facts(database, content, facts);
}

void write_episode(sqlite::Database& database, const EpisodeRecord& episode) {
  sqlite::Statement insert = database.prepare("INSERT INTO episodes VALUES (?, ?, ?, ?, ?, ?, ?, ?)");
  insert.bind(std::int64_t{episode.number}).bind(std::int64_t{episode.tracks}).bind(episode.seconds);
  insert.bind(static_cast<std::int64_t>(episode.size_before)).bind(static_cast<std::int64_t>(episode.size_after));
  insert.bind(episode.committed_s).bind(checksum_of(episode)).bind(std::string_view(episode.statistics)).step();
}

void remove_episode(sqlite::Database& database, int number) {
  database.prepare("DELETE FROM episodes WHERE number = ?").bind(std::int64_t{number}).step();
}

std::vector<int> undo_steps(sqlite::Database& database) {
  std::vector<int> numbers;
  sqlite::Statement row = database.prepare("SELECT episode FROM undo ORDER BY episode");
  while (row.step()) numbers.push_back(row_count<int>(row.integer(0)));
  return numbers;
}

std::string read_undo(sqlite::Database& database, int episode) {
  sqlite::Statement row = database.prepare("SELECT checksum, step FROM undo WHERE episode = ?");
  const std::string name = "the step that takes back episode " + std::to_string(episode);
  if (!row.bind(std::int64_t{episode}).step()) throw std::invalid_argument(name + " is missing");
  std::string step = row.blob(1);
  if (row.integer(0) != checksum_of_step(episode, step))
    throw std::invalid_argument("the checksum of " + name + " does not agree");
  return step;
}

void write_undo(sqlite::Database& database, int episode, const std::string& step) {
  sqlite::Statement insert = database.prepare("INSERT INTO undo VALUES (?, ?, ?)");
  insert.bind(std::int64_t{episode}).bind(checksum_of_step(episode, step)).bind_blob(step).step();
}

void remove_undo(sqlite::Database& database, int episode) {
  database.prepare("DELETE FROM undo WHERE episode = ?").bind(std::int64_t{episode}).step();
}

void keep_undo(sqlite::Database& database, int steps) {
  database.prepare("DELETE FROM undo WHERE episode NOT IN (SELECT episode FROM undo ORDER BY episode DESC LIMIT ?)")
      .bind(std::int64_t{steps})
      .step();
}

void require_plain(sqlite::Database& database) {
  constexpr std::string_view others =
      "SELECT count(*) FROM sqlite_schema WHERE NOT (type = 'table' AND rootpage > 0 OR type = 'index' AND sql IS "
      "NULL)";
  constexpr std::string_view computed =
      "SELECT count(*) FROM sqlite_schema AS tables, pragma_table_xinfo(tables.name) AS columns "
      "WHERE tables.type = 'table' AND columns.hidden <> 0";
  if (database.integer(others) + database.integer(computed) > 0)
    throw std::invalid_argument("it has more than plain tables");
  database.execute("PRAGMA ignore_check_constraints = ON");  // they are programs as well
}

void require_intact(sqlite::Database& database) {
  sqlite::Statement findings = database.prepare("PRAGMA quick_check(1)");
  const std::string finding = findings.step() ? findings.text(0) : "no answer to quick_check";
  if (finding != "ok") throw sqlite::Error(SQLITE_CORRUPT, finding);
}

void require_all_intact(sqlite::Database& database) {
  sqlite::Statement findings = database.prepare("PRAGMA integrity_check(1)");
  const std::string finding = findings.step() ? findings.text(0) : "no answer to integrity_check";
  if (finding != "ok") throw sqlite::Error(SQLITE_CORRUPT, finding);
  sqlite::Database fresh(":memory:", SQLITE_OPEN_READWRITE);
  create(fresh);
  const char* const tables = "SELECT name, coalesce(sql, '') FROM sqlite_master ORDER BY name";
  sqlite::Statement ours = database.prepare(tables), wanted = fresh.prepare(tables);
  for (bool more = true; more;) {
    more = wanted.step();
    if (ours.step() != more || (more && (ours.text(0) != wanted.text(0) || ours.text(1) != wanted.text(1))))
      throw sqlite::Error(SQLITE_CORRUPT, "the tables are not those that sila makes");
  }
}

}  // namespace sila::rows
