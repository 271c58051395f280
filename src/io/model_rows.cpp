#include "model_rows.hpp"

#include <zlib.h>

#include <algorithm>
#include <bit>
#include <cstddef>
#include <span>
#include <stdexcept>
#include <utility>
#include <vector>

#include "sila/model/packing.hpp"
#include "sila/version.hpp"

namespace sila::rows {
namespace {

using Bytes = std::vector<std::byte>;

/// Little endian on every machine.
template <class Unsigned>
void append(Bytes& bytes, Unsigned bits) {
  for (std::size_t i = 0; i < sizeof(Unsigned); ++i) bytes.push_back(static_cast<std::byte>((bits >> (8 * i)) & 0xffU));
}

template <class Unsigned>
std::vector<Unsigned> words(std::span<const std::byte> bytes) {
  if (bytes.size() % sizeof(Unsigned) != 0) {
    throw std::invalid_argument("a blob has " + std::to_string(bytes.size()) + " bytes, no multiple of " +
                                std::to_string(sizeof(Unsigned)));
  }
  std::vector<Unsigned> result(bytes.size() / sizeof(Unsigned), 0);
  for (std::size_t i = 0; i < bytes.size(); ++i) {
    result[i / sizeof(Unsigned)] |=
        static_cast<Unsigned>(static_cast<Unsigned>(bytes[i]) << (8 * (i % sizeof(Unsigned))));
  }
  return result;
}

Bytes to_bytes(std::span<const double> numbers) {
  Bytes bytes;
  bytes.reserve(8 * numbers.size());
  for (const double number : numbers) append(bytes, std::bit_cast<std::uint64_t>(number));
  return bytes;
}

std::vector<double> to_numbers(std::span<const std::byte> bytes) {
  std::vector<double> numbers;
  numbers.reserve(bytes.size() / 8);
  for (const std::uint64_t word : words<std::uint64_t>(bytes)) numbers.push_back(std::bit_cast<double>(word));
  return numbers;
}

Bytes cell_bytes(const MotionPrimitive& primitive) {
  Bytes bytes;
  for (const CellVelocity& entry : primitive.cells) {
    append(bytes, static_cast<std::uint32_t>(entry.cell.x));
    append(bytes, static_cast<std::uint32_t>(entry.cell.y));
  }
  return bytes;
}

Bytes velocity_bytes(const MotionPrimitive& primitive) {
  std::vector<double> numbers;
  for (const CellVelocity& entry : primitive.cells) {
    numbers.push_back(entry.velocity.x());
    numbers.push_back(entry.velocity.y());
  }
  return to_bytes(numbers);
}

std::vector<CellVelocity> cells_of(std::span<const std::byte> cells, std::span<const std::byte> velocities) {
  const std::vector<std::uint32_t> places = words<std::uint32_t>(cells);
  const std::vector<double> numbers = to_numbers(velocities);
  if (places.size() % 2 != 0 || numbers.size() != places.size()) {
    throw std::invalid_argument("a primitive has " + std::to_string(places.size()) + " cell coordinates and " +
                                std::to_string(numbers.size()) + " velocity components");
  }
  std::vector<CellVelocity> result;
  for (std::size_t i = 0; i < places.size(); i += 2) {
    const CellKey cell{static_cast<std::int32_t>(places[i]), static_cast<std::int32_t>(places[i + 1])};
    result.push_back({cell, Vector2(numbers[i], numbers[i + 1])});
  }
  return result;
}

Bytes id_bytes(const EpisodeId& id) {
  Bytes bytes;
  append(bytes, id.high);
  append(bytes, id.low);
  return bytes;
}

/// Over everything a flipped bit of which would go unnoticed: SQLite has no checksums of its own.
std::int64_t checksum(const Model& model, const std::string& configuration) {
  uLong sum = crc32_z(0, nullptr, 0);
  const auto add = [&](std::span<const std::byte> bytes) {
    sum = crc32_z(sum, reinterpret_cast<const Bytef*>(bytes.data()), bytes.size());
  };
  add(to_bytes(pack(model.conventions)));
  for (const MotionPrimitive& primitive : model.primitives) {
    add(cell_bytes(primitive));
    add(velocity_bytes(primitive));
    add(to_bytes(std::vector{primitive.weight}));
  }
  for (const Transition& transition : model.transitions) {
    add(to_bytes(std::vector<double>{static_cast<double>(transition.from), static_cast<double>(transition.to),
                                     transition.count, static_cast<double>(transition.last_episode)}));
    add(to_bytes(pack(transition.field)));
    add(to_bytes(pack(transition.outlook)));
  }
  add(to_bytes(pack(model.lessons)));
  add(to_bytes(pack(model.gait)));
  add(to_bytes(pack(model.places)));
  add(to_bytes(std::vector<double>{static_cast<double>(model.episodes), static_cast<double>(model.tracks)}));
  add(std::as_bytes(std::span(configuration)));
  for (const EpisodeId& id : model.episode_ids) add(id_bytes(id));
  return static_cast<std::int64_t>(sum);
}

template <class Count>
Count count_of(std::int64_t value) {
  if (std::in_range<Count>(value) && value >= 0) return static_cast<Count>(value);
  throw std::invalid_argument(std::to_string(value) + " is no count");
}

void write_primitives(sqlite::Database& database, const std::vector<MotionPrimitive>& primitives) {
  database.execute("DELETE FROM primitives");
  sqlite::Statement insert = database.prepare("INSERT INTO primitives VALUES (?, ?, ?, ?)");
  std::int64_t id = 0;
  for (const MotionPrimitive& primitive : primitives) {
    insert.bind(id++)
        .bind(primitive.weight)
        .bind_blob(cell_bytes(primitive))
        .bind_blob(velocity_bytes(primitive))
        .step();
  }
}

void write_transitions(sqlite::Database& database, const std::vector<Transition>& transitions) {
  database.execute("DELETE FROM transitions");
  sqlite::Statement insert = database.prepare("INSERT INTO transitions VALUES (?, ?, ?, ?, ?, ?)");
  for (const Transition& transition : transitions) {
    insert.bind(std::int64_t{transition.from}).bind(std::int64_t{transition.to}).bind(transition.count);
    insert.bind_blob(to_bytes(pack(transition.field))).bind_blob(to_bytes(pack(transition.outlook)));
    insert.bind(std::int64_t{transition.last_episode}).step();
  }
}

std::vector<MotionPrimitive> read_primitives(sqlite::Database& database) {
  std::vector<MotionPrimitive> primitives;
  sqlite::Statement row = database.prepare("SELECT id, weight, cells, velocities FROM primitives ORDER BY id");
  while (row.step()) {
    if (row.integer(0) != static_cast<std::int64_t>(primitives.size()))
      throw std::invalid_argument("a primitive is missing");
    primitives.push_back({cells_of(row.blob(2), row.blob(3)), row.real(1)});
  }
  return primitives;
}

std::vector<Transition> read_transitions(sqlite::Database& database) {
  std::vector<Transition> transitions;
  sqlite::Statement row = database.prepare(
      "SELECT from_primitive, to_primitive, count, field, outlook, last_episode FROM transitions ORDER BY "
      "from_primitive, to_primitive");
  while (row.step()) {
    transitions.push_back({count_of<int>(row.integer(0)), count_of<int>(row.integer(1)), row.real(2),
                           unpack_flow_field(to_numbers(row.blob(3))), unpack_gp(to_numbers(row.blob(4))),
                           count_of<int>(row.integer(5))});
  }
  return transitions;
}

void write_episode_ids(sqlite::Database& database, const std::vector<EpisodeId>& ids) {
  database.execute("DELETE FROM learnt");
  sqlite::Statement insert = database.prepare("INSERT INTO learnt VALUES (?)");
  for (const EpisodeId& id : ids) insert.bind_blob(id_bytes(id)).step();
}

std::vector<EpisodeId> read_episode_ids(sqlite::Database& database) {
  std::vector<EpisodeId> ids;
  sqlite::Statement row = database.prepare("SELECT episode FROM learnt");
  while (row.step()) {
    const std::vector<std::uint64_t> halves = words<std::uint64_t>(row.blob(0));
    if (halves.size() != 2) throw std::invalid_argument("the id of an episode has no 16 bytes");
    ids.push_back({halves[0], halves[1]});
  }
  std::ranges::sort(ids);
  return ids;
}

std::vector<EpisodeRecord> read_episodes(sqlite::Database& database) {
  std::vector<EpisodeRecord> episodes;
  sqlite::Statement row = database.prepare(
      "SELECT number, tracks, seconds, size_before, size_after, statistics FROM episodes ORDER BY number");
  while (row.step()) {
    episodes.push_back({count_of<int>(row.integer(0)), count_of<long>(row.integer(1)), row.real(2),
                        count_of<std::size_t>(row.integer(3)), count_of<std::size_t>(row.integer(4)), row.text(5)});
  }
  return episodes;
}

}  // namespace

const char* const kCreate = R"(
CREATE TABLE meta (          -- one row
  revision INTEGER NOT NULL,     -- how often the file was changed
  sila_version TEXT NOT NULL,    -- of the last writer
  episodes INTEGER NOT NULL,     -- that made the model
  tracks INTEGER NOT NULL,       -- learnt from
  configuration TEXT NOT NULL,   -- JSON
  conventions BLOB NOT NULL,     -- doubles: see sila/model/packing.hpp, as for all blobs of doubles, little endian
  lessons BLOB NOT NULL,         -- doubles
  gait BLOB NOT NULL,            -- doubles: the sparse GP
  places BLOB NOT NULL,          -- doubles: the frames of the corners where it was learnt
  checksum INTEGER NOT NULL      -- CRC-32 of the model and the configuration
);
CREATE TABLE primitives (
  id INTEGER PRIMARY KEY,        -- 0, 1, 2, ...
  weight REAL NOT NULL,
  cells BLOB NOT NULL,           -- 32-bit integers, little endian: x and y of each cell
  velocities BLOB NOT NULL       -- doubles: x and y of each cell
);
CREATE TABLE transitions (
  from_primitive INTEGER NOT NULL,
  to_primitive INTEGER NOT NULL,
  count REAL NOT NULL,
  field BLOB NOT NULL,           -- doubles: the sparse GP and its extent
  outlook BLOB NOT NULL,         -- doubles: the sparse GP
  last_episode INTEGER NOT NULL, -- in which it was last seen
  PRIMARY KEY (from_primitive, to_primitive)
);
CREATE TABLE episodes (
  number INTEGER PRIMARY KEY,    -- 1, 2, 3, ...
  tracks INTEGER NOT NULL,
  seconds REAL NOT NULL,
  size_before INTEGER NOT NULL,
  size_after INTEGER NOT NULL,
  statistics TEXT NOT NULL       -- JSON
);
CREATE TABLE learnt (            -- what must not be learnt again
  episode BLOB PRIMARY KEY       -- the 128 bits that stand for the content of a batch, two 64-bit integers, little endian
) WITHOUT ROWID;
)";

std::int64_t revision(sqlite::Database& database) {
  return database.integer("SELECT revision FROM meta");
}

void write_model(sqlite::Database& database, const Model& model, const std::string& configuration,
                 std::int64_t revision) {
  write_primitives(database, model.primitives);
  write_transitions(database, model.transitions);
  write_episode_ids(database, model.episode_ids);
  database.execute("DELETE FROM meta");
  sqlite::Statement insert = database.prepare("INSERT INTO meta VALUES (?, ?, ?, ?, ?, ?, ?, ?, ?, ?)");
  insert.bind(revision).bind(std::string_view(SILA_VERSION)).bind(std::int64_t{model.episodes});
  insert.bind(std::int64_t{model.tracks}).bind(std::string_view(configuration));
  insert.bind_blob(to_bytes(pack(model.conventions))).bind_blob(to_bytes(pack(model.lessons)));
  insert.bind_blob(to_bytes(pack(model.gait))).bind_blob(to_bytes(pack(model.places)));
  insert.bind(checksum(model, configuration)).step();
}

void write_episode(sqlite::Database& database, const EpisodeRecord& episode) {
  sqlite::Statement insert = database.prepare("INSERT INTO episodes VALUES (?, ?, ?, ?, ?, ?)");
  insert.bind(std::int64_t{episode.number}).bind(std::int64_t{episode.tracks}).bind(episode.seconds);
  insert.bind(static_cast<std::int64_t>(episode.size_before)).bind(static_cast<std::int64_t>(episode.size_after));
  insert.bind(std::string_view(episode.statistics)).step();
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

StoredModel read(sqlite::Database& database) {
  StoredModel stored;
  Model& model = stored.model;
  sqlite::Statement meta = database.prepare(
      "SELECT sila_version, episodes, tracks, configuration, conventions, lessons, checksum, gait, places FROM meta");
  if (!meta.step()) throw sqlite::Error(SQLITE_CORRUPT, "meta has no row");
  stored.sila_version = meta.text(0);
  model.episodes = count_of<int>(meta.integer(1));
  model.tracks = count_of<long>(meta.integer(2));
  stored.configuration = meta.text(3);
  model.conventions = unpack_conventions(to_numbers(meta.blob(4)));
  model.lessons = unpack_lessons(to_numbers(meta.blob(5)));
  model.gait = unpack_gp(to_numbers(meta.blob(7)));
  model.places = unpack_places(to_numbers(meta.blob(8)));
  model.primitives = read_primitives(database);
  model.transitions = read_transitions(database);
  model.episode_ids = read_episode_ids(database);
  stored.episodes = read_episodes(database);
  if (meta.integer(6) != checksum(model, stored.configuration))
    throw std::invalid_argument("the checksum does not agree");
  return stored;
}

}  // namespace sila::rows
