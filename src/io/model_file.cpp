#include "sila/io/model_file.hpp"

#include <unistd.h>

#include <map>
#include <nlohmann/json.hpp>
#include <optional>
#include <stdexcept>
#include <utility>

#include "json_file.hpp"
#include "model_path.hpp"
#include "model_rows.hpp"
#include "sila/core/errors.hpp"
#include "sila/version.hpp"
#include "sqlite.hpp"
#include "undo_step.hpp"

namespace sila {
namespace {

namespace fs = std::filesystem;

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

/// Whether a database that is one of ours has a model; false if it has nothing at all.
bool has_model(const fs::path& path, sqlite::Database& database) {
  const std::int64_t application = database.integer("PRAGMA application_id");
  const std::int64_t schema = database.integer("PRAGMA user_version");
  if (application == 0 && schema == 0 && database.integer("SELECT count(*) FROM sqlite_master") == 0) return false;
  if (application != rows::kApplicationId) refuse(path, "an SQLite database of another program; choose another path");
  const std::string found = "schema " + std::to_string(schema) + " of ", ours = std::to_string(rows::kSchema);
  if (schema > rows::kSchema) refuse(path, found + "a newer sila (this one writes " + ours + "); update sila");
  if (schema < rows::kSchema) {
    refuse(path, found + "an older sila (this one writes " + ours +
                     "); learn the model anew by `sila learn TRACKS --model NEW.sila`, or open it with the sila that " +
                     "wrote it");
  }
  rows::require_plain(database);
  return true;
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
StoredModel stored_in(sqlite::Database& database) {
  rows::require_intact(database);
  StoredModel stored;
  stored.sila_version = rows::read_facts(database).sila_version;
  rows::Content content = rows::read_content(database);
  stored.model = rows::model_of(content);
  stored.configuration = std::move(content.configuration);
  stored.episodes = rows::read_episodes(database);
  check(stored.model);
  require_object("configuration", stored.configuration);
  for (const EpisodeRecord& episode : stored.episodes) require_object("statistics", episode.statistics);
  return stored;
}

/// Takes the details out of records that are no longer among the last ones, and returns those as they were.
std::map<int, std::string> shorten_records(sqlite::Database& database, int last) {
  std::map<int, std::string> before;
  for (EpisodeRecord& episode : rows::detailed_episodes(database, last - kDetailsKept)) {
    nlohmann::ordered_json statistics = nlohmann::ordered_json::parse(episode.statistics, nullptr, false);
    if (!statistics.is_object() || statistics.erase("change") == 0) continue;
    before[episode.number] = std::exchange(episode.statistics, statistics.dump());
    rows::remove_episode(database, episode.number);
    rows::write_episode(database, episode);
  }
  return before;
}

/// Going back through the episodes of a file, which stays as it is.
class WayBack {
 public:
  explicit WayBack(sqlite::Database& database)
      : database_(database),
        content_(rows::read_content(database)),
        episodes_(rows::read_episodes(database)),
        steps_(rows::undo_steps(database)) {
    for (std::size_t i = 0; i < steps_.size(); ++i) {
      const std::size_t at = episodes_.size() - steps_.size() + i;
      if (steps_.size() > episodes_.size() || episodes_[at].number != steps_[i])
        throw std::invalid_argument("the steps of undo are not those of the last episodes");
    }
  }

  const rows::Content& content() const { return content_; }
  const std::vector<EpisodeRecord>& episodes() const { return episodes_; }
  const std::vector<int>& steps() const { return steps_; }
  int last() const { return episodes_.empty() ? 0 : episodes_.back().number; }
  /// The earliest episode that can be reached.
  int oldest() const {
    return steps_.size() < episodes_.size() ? episodes_[episodes_.size() - steps_.size() - 1].number : last();
  }

  void step() {
    rows::Earlier earlier = rows::apply_undo(content_, rows::read_undo(database_, steps_.back()));
    content_ = std::move(earlier.content);
    steps_.pop_back();
    episodes_.pop_back();
    for (EpisodeRecord& episode : episodes_) {
      const auto found = earlier.statistics.find(episode.number);
      if (found != earlier.statistics.end()) episode.statistics = std::move(found->second);
    }
  }

 private:
  sqlite::Database& database_;
  rows::Content content_;
  std::vector<EpisodeRecord> episodes_;
  std::vector<int> steps_;
};

sqlite::Database open_database(const fs::path& path, int flags) {
  // An absolute path, for SQLite gives ":memory:" and "file:" a meaning of their own.
  sqlite::Database database(fs::absolute(path).string(), SQLITE_OPEN_READWRITE | flags);
  database.execute(
      "PRAGMA secure_delete = ON");  // not everywhere the default; what is forgotten must not stay in pages
  return database;
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
      if (has_model(path, *database)) revision = rows::revision(*database);
    });
  }

  std::int64_t revision_now() { return has_model(path, *database) ? rows::revision(*database) : 0; }

  /// One transaction that puts `write(database, facts)` between the check for a rival and the new revision. `write`
  /// finds the tables of the present schema, and the facts as they are to be; it ends with rows::write_content.
  template <class Write>
  void change(Write&& write) {
    naming(path, [&] {
      if (!database) database = open_database(path, SQLITE_OPEN_CREATE);
      sqlite::Transaction transaction(*database, "BEGIN IMMEDIATE");
      const bool is_model = has_model(path, *database);
      if ((is_model ? rows::revision(*database) : 0) != revision) {
        refuse_write(path, "that another process changed it meanwhile; this change was not saved, do it again");
      }
      if (!is_model) rows::create(*database);
      rows::FileFacts facts = is_model ? rows::read_facts(*database) : rows::FileFacts{};
      facts.revision = revision + 1;
      facts.sila_version = SILA_VERSION;
      write(*database, facts);
      transaction.commit();
      ++revision;
    });
  }

  /// Runs `look(database)` on all tables as one commit left them.
  template <class Look>
  auto look(Look&& look) {
    if (!database) refuse(path, "no file yet; `sila learn` makes one");
    return naming(path, [&] {
      const sqlite::Transaction snapshot(*database, "BEGIN");
      if (!has_model(path, *database)) refuse(path, "an empty file; `sila learn` makes a model of it");
      return look(*database);
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

bool ModelFile::changed_elsewhere() {
  State& state = *state_;
  if (!state.database && !fs::exists(state.path)) return false;
  return naming(state.path, [&] {
    if (!state.database) state.database = open_database(state.path, 0);
    const sqlite::Transaction snapshot(*state.database, "BEGIN");
    return state.revision_now() != state.revision;
  });
}

StoredModel ModelFile::read() {
  return state_->look([&](sqlite::Database& database) {
    StoredModel stored = stored_in(database);
    state_->revision = rows::revision(database);
    std::error_code error;
    stored.bytes = fs::file_size(state_->path, error);
    return stored;
  });
}

void ModelFile::commit(const Model& model, const EpisodeRecord& episode, const std::string& configuration) {
  check(model);
  state_->change([&](sqlite::Database& database, const rows::FileFacts& facts) {
    const std::int64_t last = database.integer("SELECT coalesce(max(number), 0) FROM episodes");
    if (episode.number <= last) {
      refuse_write(state_->path, "episode " + std::to_string(last) + " in it already, and this is episode " +
                                     std::to_string(episode.number));
    }
    const rows::Content next = rows::content_of(model, configuration);
    std::map<int, std::string> shortened = shorten_records(database, episode.number);
    if (last > 0 && facts.undo_kept > 0)
      rows::write_undo(database, episode.number, make_undo({rows::read_content(database), std::move(shortened)}, next));
    rows::keep_undo(database, facts.undo_kept);
    rows::write_episode(database, episode);
    rows::write_content(database, next, facts);
  });
}

void ModelFile::replace(const StoredModel& stored) {
  check(stored.model);
  state_->change([&](sqlite::Database& database, const rows::FileFacts& facts) {
    rows::keep_undo(database, 0);
    database.execute("DELETE FROM episodes");
    for (const EpisodeRecord& episode : stored.episodes) rows::write_episode(database, episode);
    rows::write_content(database, rows::content_of(stored.model, stored.configuration), facts);
  });
}

int ModelFile::oldest_rollback() {
  return state_->look([&](sqlite::Database& database) { return WayBack(database).oldest(); });
}

void ModelFile::rollback(int episode) {
  const fs::path& path = state_->path;
  if (!state_->database) refuse(path, "no file yet; `sila learn` makes one");
  state_->change([&](sqlite::Database& database, const rows::FileFacts& facts) {
    WayBack way(database);
    if (episode > way.last() || episode < way.oldest()) {
      throw FormatError(path.string(), 0, "a model that can be rolled back to episode " + std::to_string(episode),
                        way.oldest() == way.last()
                            ? "one of which no episode can be taken back; its last is " + std::to_string(way.last())
                            : "one whose oldest possible is " + std::to_string(way.oldest()) + " and its last " +
                                  std::to_string(way.last()));
    }
    while (way.last() > episode) {
      const int taken_back = way.last();
      way.step();
      rows::remove_undo(database, taken_back);
    }
    database.execute("DELETE FROM episodes");
    for (const EpisodeRecord& record : way.episodes()) rows::write_episode(database, record);
    check(rows::model_of(way.content()));
    rows::write_content(database, way.content(), facts);
  });
}

void ModelFile::keep_undo(int episodes) {
  if (episodes < 0) throw std::invalid_argument("keep_undo: " + std::to_string(episodes) + " is less than none");
  if (!state_->database) refuse(state_->path, "no file yet; `sila learn` makes one");
  state_->change([&](sqlite::Database& database, rows::FileFacts facts) {
    facts.undo_kept = episodes;
    rows::keep_undo(database, episodes);
    rows::write_content(database, rows::read_content(database), facts);
  });
}

VerifyReport ModelFile::verify() {
  return state_->look([&](sqlite::Database& database) {
    VerifyReport report;
    report.pages = database.integer("PRAGMA page_count");
    const StoredModel stored = stored_in(database);
    report.episodes = stored.episodes.size();
    rows::require_all_intact(database);
    try {
      WayBack way(database);
      for (; !way.steps().empty(); ++report.undone) {
        way.step();
        check(rows::model_of(way.content()));
      }
    } catch (const std::invalid_argument& error) {
      refuse(state_->path, std::string("a sound model whose history is damaged (") + error.what() +
                               "); it can be used and learnt on, `sila rollback --keep 0` forgets the history");
    }
    return report;
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
    rows::create(database);
    for (const EpisodeRecord& episode : stored.episodes) rows::write_episode(database, episode);
    rows::write_content(database, rows::content_of(stored.model, stored.configuration), {1, SILA_VERSION});
    transaction.commit();
    return database.bytes();
  });
}

StoredModel model_of_bytes(std::string_view bytes) {
  const fs::path name = "the bytes of a model";
  return naming(name, [&] {
    sqlite::Database database = sqlite::Database::of_bytes(bytes);
    if (!has_model(name, database)) refuse(name, "no bytes");
    StoredModel stored = stored_in(database);
    stored.bytes = bytes.size();
    return stored;
  });
}

}  // namespace sila
