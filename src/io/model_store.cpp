#include "sila/io/model_store.hpp"

#include <fcntl.h>
#include <unistd.h>

#include <cstring>
#include <optional>
#include <stdexcept>
#include <utility>

#include "json_file.hpp"
#include "model_rows.hpp"
#include "sila/core/errors.hpp"
#include "sqlite.hpp"

namespace sila {
namespace {

namespace fs = std::filesystem;

constexpr std::int64_t kApplicationId = 0x53494C41;  // "SILA"
constexpr std::int64_t kSchema = 3;

[[noreturn]] void refuse(const fs::path& path, const std::string& found) {
  throw FormatError(path.string(), 0, "a sila model", found);
}

[[noreturn]] void refuse_write(const fs::path& path, const std::string& found) {
  throw FormatError(path.string(), 0, "a model file that can be written", found);
}

/// What an error of SQLite means for a model file, as a sentence with what to do.
[[noreturn]] void refuse(const fs::path& path, const sqlite::Error& error) {
  const std::string said = std::string(" (") + error.what() + ")";
  switch (error.primary()) {
    case SQLITE_NOTADB:
      refuse(path, "a file of another kind; give the path of a model that `sila learn` made");
    case SQLITE_BUSY:
    case SQLITE_LOCKED:
      refuse(path, "one that another process has kept locked for 10 s; try again when it is done");
    case SQLITE_PERM:
    case SQLITE_READONLY:
    case SQLITE_CANTOPEN:
      refuse_write(path, "no permission for the file or its folder" + said);
    case SQLITE_FULL:
    case SQLITE_IOERR:
      refuse_write(path, "that reading or writing failed; is the disk full?" + said);
    default:
      refuse(path, "a damaged one; restore a copy, or learn it anew" + said);
  }
}

/// Runs what talks to SQLite or makes a model of what it says, and says what went wrong with the name of the file.
template <class Action>
auto naming(const fs::path& path, Action&& action) {
  try {
    return action();
  } catch (const sqlite::Error& error) {
    refuse(path, error);
  } catch (const std::invalid_argument& error) {  // of unpack and check: bytes that make no model
    refuse(path, std::string("a damaged one; restore a copy, or learn it anew (") + error.what() + ")");
  }
}

/// Whether the database is one of ours and has a model; false if it has nothing at all.
bool identify(const fs::path& path, sqlite::Database& database) {
  const std::int64_t application = database.integer("PRAGMA application_id");
  const std::int64_t schema = database.integer("PRAGMA user_version");
  if (application == 0 && schema == 0 && database.integer("SELECT count(*) FROM sqlite_master") == 0) return false;
  if (application != kApplicationId) refuse(path, "an SQLite database of another program; choose another path");
  if (schema > kSchema) {
    refuse(path, "schema " + std::to_string(schema) + " of a newer sila (this one writes " + std::to_string(kSchema) +
                     "); update sila");
  }
  if (schema < kSchema) {
    refuse(path, "schema " + std::to_string(schema) + " of an older sila (this one writes " + std::to_string(kSchema) +
                     "); learn the model anew");
  }
  rows::require_plain(database);
  return true;
}

void create(sqlite::Database& database) {
  database.execute("PRAGMA application_id = " + std::to_string(kApplicationId) +
                   "; PRAGMA user_version = " + std::to_string(kSchema) + ";" + rows::kCreate);
}

/// Whoever uses a model parses what it was learnt with and what is told of its episodes.
void require_object(const std::string& name, const std::string& text) {
  try {
    if (json_of_text(name, text).is_object()) return;
  } catch (const FormatError& error) {
    throw std::invalid_argument(error.what());
  }
  throw std::invalid_argument(name + " is no JSON object");
}

/// What identify found to be a model.
StoredModel content_of(sqlite::Database& database) {
  rows::require_intact(database);
  StoredModel stored = rows::read(database);
  check(stored.model);
  require_object("configuration", stored.configuration);
  for (const EpisodeRecord& episode : stored.episodes) require_object("statistics", episode.statistics);
  return stored;
}

sqlite::Database open_database(const fs::path& path, int flags) {
  // An absolute path, for SQLite gives ":memory:" and "file:" a meaning of their own.
  return {fs::absolute(path).string(), SQLITE_OPEN_READWRITE | flags};
}

bool may(const fs::path& path, int what) {
  return faccessat(AT_FDCWD, path.c_str(), what, AT_EACCESS) == 0;
}

void require_regular(const fs::path& path, const fs::file_status& status) {
  if (fs::is_directory(status)) refuse(path, "a folder");
  if (fs::exists(status) && !fs::is_regular_file(status)) refuse(path, "something that is no regular file");
}

/// SQLite would find out at the first commit; better before hours of learning.
void require_writable(const fs::path& path, const fs::file_status& status) {
  const fs::path folder = path.has_parent_path() ? path.parent_path() : fs::path(".");
  if (!fs::is_directory(folder)) refuse_write(path, "that the folder " + folder.string() + " does not exist");
  if (!may(folder, W_OK | X_OK)) refuse_write(path, "no permission to write in the folder " + folder.string());
  if (fs::exists(status) && !may(path, R_OK | W_OK)) refuse_write(path, "no permission to read and write it");
}

fs::file_status status_of(const fs::path& path) {
  std::error_code error;
  return fs::status(path, error);
}

}  // namespace

struct ModelFile::State {
  fs::path path;
  std::optional<sqlite::Database> database;  ///< nothing until the file exists
  std::int64_t revision = 0;                 ///< of the file when this object last read or wrote it; 0: it was empty

  /// Opens for writing, too, where that is allowed: what a killed writer left half done must be undone before reading.
  void open() {
    naming(path, [&] {
      database = open_database(path, 0);
      if (identify(path, *database)) revision = rows::revision(*database);
    });
  }

  /// One transaction that puts `write` between the check for a rival and the new revision.
  template <class Write>
  void change(Write&& write) {
    naming(path, [&] {
      if (!database) database = open_database(path, SQLITE_OPEN_CREATE);
      sqlite::Transaction transaction(*database, "BEGIN IMMEDIATE");
      const bool has_model = identify(path, *database);
      if ((has_model ? rows::revision(*database) : 0) != revision) {
        refuse_write(path, "that another process changed it meanwhile; this change was not saved, do it again");
      }
      if (!has_model) create(*database);
      write(*database);
      transaction.commit();
      ++revision;
    });
  }
};

ModelFile::ModelFile(std::unique_ptr<State> state) : state_(std::move(state)) {}
ModelFile::ModelFile(ModelFile&&) noexcept = default;
ModelFile& ModelFile::operator=(ModelFile&&) noexcept = default;
ModelFile::~ModelFile() = default;

ModelFile ModelFile::open_or_create(const fs::path& path) {
  const fs::file_status status = status_of(path);
  require_regular(path, status);
  require_writable(path, status);
  auto state = std::make_unique<State>();
  state->path = path;
  if (fs::exists(status)) state->open();
  return ModelFile(std::move(state));
}

ModelFile ModelFile::open(const fs::path& path) {
  const fs::file_status status = status_of(path);
  if (!fs::exists(status)) refuse(path, "no such file");
  require_regular(path, status);
  if (!may(path, R_OK)) refuse(path, "no permission to read it");
  auto state = std::make_unique<State>();
  state->path = path;
  state->open();
  return ModelFile(std::move(state));
}

bool ModelFile::empty() const {
  return state_->revision == 0;
}

StoredModel ModelFile::read() {
  const fs::path& path = state_->path;
  if (!state_->database) refuse(path, "no file yet; `sila learn` makes one");
  return naming(path, [&] {
    sqlite::Database& database = *state_->database;
    const sqlite::Transaction snapshot(database, "BEGIN");  // all tables as one commit left them
    if (!identify(path, database)) refuse(path, "an empty file; `sila learn` makes a model of it");
    StoredModel stored = content_of(database);
    state_->revision = rows::revision(database);
    std::error_code error;
    stored.bytes = fs::file_size(path, error);
    return stored;
  });
}

void ModelFile::commit(const Model& model, const EpisodeRecord& episode, const std::string& configuration) {
  check(model);
  state_->change([&](sqlite::Database& database) {
    const std::int64_t last = database.integer("SELECT coalesce(max(number), 0) FROM episodes");
    if (episode.number <= last) {
      refuse_write(state_->path, "episode " + std::to_string(last) + " in it already, and this is episode " +
                                     std::to_string(episode.number));
    }
    rows::write_model(database, model, configuration, state_->revision + 1);
    rows::write_episode(database, episode);
  });
}

void ModelFile::replace(const StoredModel& stored) {
  check(stored.model);
  state_->change([&](sqlite::Database& database) {
    rows::write_model(database, stored.model, stored.configuration, state_->revision + 1);
    database.execute("DELETE FROM episodes");
    for (const EpisodeRecord& episode : stored.episodes) rows::write_episode(database, episode);
  });
}

StoredModel load_model(const fs::path& path) {
  return ModelFile::open(path).read();
}

void save_model(const fs::path& path, const StoredModel& stored) {
  ModelFile::open_or_create(path).replace(stored);
}

std::string model_bytes(const StoredModel& stored) {
  check(stored.model);
  return naming("the bytes of a model", [&] {
    sqlite::Database database(":memory:", SQLITE_OPEN_READWRITE);
    sqlite::Transaction transaction(database, "BEGIN");
    create(database);
    rows::write_model(database, stored.model, stored.configuration, 1);
    for (const EpisodeRecord& episode : stored.episodes) rows::write_episode(database, episode);
    transaction.commit();
    return database.bytes();
  });
}

StoredModel model_of_bytes(std::string_view bytes) {
  const fs::path name = "the bytes of a model";
  return naming(name, [&] {
    sqlite::Database database = sqlite::Database::of_bytes(bytes);
    if (!identify(name, database)) refuse(name, "no bytes");
    StoredModel stored = content_of(database);
    stored.bytes = bytes.size();
    return stored;
  });
}

}  // namespace sila
