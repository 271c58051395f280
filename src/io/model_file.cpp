#include "sila/io/model_file.hpp"

#include <unistd.h>

#include <algorithm>
#include <utility>

#include "json_file.hpp"
#include "model_path.hpp"
#include "model_tables.hpp"
#include "sila/core/errors.hpp"
#include "sila/refine/prune.hpp"
#include "sila/version.hpp"

namespace sila {
namespace {

namespace fs = std::filesystem;

/// Runs an action that uses SQLite or makes a model of its content; its errors become a FormatError with the name of
/// the file.
template <class Action>
auto naming(const fs::path& path, Action&& action) {
  try {
    return action();
  } catch (const sqlite::Error& error) {
    reject(path, error);
  } catch (const std::invalid_argument& error) {  // of unpack and check: bytes that make no model
    reject(path, std::string("a damaged one; restore a copy, or learn it anew (") + error.what() + ")");
  }
}

/// Whether a database that is one of ours has a model; false if it has nothing at all.
bool has_model(const fs::path& path, sqlite::Database& database) {
  const std::int64_t application = database.integer("PRAGMA application_id");
  const std::int64_t schema = database.integer("PRAGMA user_version");
  if (application == 0 && schema == 0 && database.integer("SELECT count(*) FROM sqlite_master") == 0) return false;
  if (application != tables::kApplicationId) reject(path, "an SQLite database of another program; choose another path");
  const std::string found = "schema " + std::to_string(schema) + " of ", ours = std::to_string(tables::kSchema);
  if (schema > tables::kSchema) reject(path, found + "a newer sila (this one writes " + ours + "); update sila");
  if (schema < tables::kSchema) {
    reject(path, found + "an older sila (this one writes " + ours +
                     "); learn the model anew by `sila learn TRACKS --model NEW.sila`, or open it with the sila that " +
                     "wrote it");
  }
  tables::require_plain(database);
  return true;
}

/// Configuration and statistics are parsed by all that use a model: they are checked before they are written, too.
void require_object(const std::string& name, const std::string& text) {
  try {
    if (json_of_text(name, text).is_object()) return;
  } catch (const FormatError& error) {
    throw std::invalid_argument(error.what());
  }
  throw std::invalid_argument(name + ": expected a JSON object, found " + text.substr(0, 40));
}

void require_objects(const std::string& configuration, std::span<const EpisodeRecord> episodes) {
  require_object("configuration", configuration);
  for (const EpisodeRecord& episode : episodes) require_object("statistics", episode.statistics);
}

/// Records without the details of those up to a number.
std::vector<EpisodeRecord> shortened(std::vector<EpisodeRecord> episodes, int until) {
  for (EpisodeRecord& episode : episodes) {
    if (episode.number > until || episode.statistics.find("\"change\"") == std::string::npos) continue;
    nlohmann::ordered_json statistics = nlohmann::ordered_json::parse(episode.statistics, nullptr, false);
    if (statistics.is_object() && statistics.erase("change") > 0) episode.statistics = statistics.dump();
  }
  return episodes;
}

/// The present model of a database that has one.
StoredModel stored_in(sqlite::Database& database) {
  tables::require_intact(database);
  StoredModel stored;
  stored.sila_version = tables::read_meta(database).sila_version;
  stored.episodes = tables::read_episodes(database);
  const int last = last_episode(stored);
  stored.episodes = shortened(std::move(stored.episodes), last - kDetailsKept);  // a rollback may need more details
  ModelContent content = tables::read_model(database, last);
  stored.model = std::move(content.model);
  check(stored.model);
  require_objects(content.configuration, stored.episodes);
  stored.configuration = content.configuration;
  return stored;
}

/// Writes all of a model but its earlier ones.
void write_stored(sqlite::Database& database, const StoredModel& stored) {
  const int last = last_episode(stored);
  for (const EpisodeRecord& episode : shortened(stored.episodes, last - kDetailsKept))
    tables::write_episode(database, episode);
  tables::write_model(database, last, parts_of(stored.model, stored.configuration));
}

/// The episodes that a rollback can reach, ascending; the last is the present one.
std::vector<int> reachable(sqlite::Database& database) {
  std::vector<int> kept = tables::kept_models(database), numbers{0};
  for (const EpisodeRecord& episode : tables::read_episodes(database)) numbers.push_back(episode.number);
  const auto last = std::mismatch(kept.rbegin(), kept.rend(), numbers.rbegin(), numbers.rend()).first;
  if (kept.empty() || last != kept.rend())
    throw std::invalid_argument("the kept models are not those of the last episodes");
  return kept;
}

sqlite::Database open_database(const fs::path& path, int flags) {
  // An absolute path, for SQLite gives ":memory:" and "file:" a meaning of their own.
  sqlite::Database database(fs::absolute(path).string(), SQLITE_OPEN_READWRITE | flags);
  database.execute("PRAGMA secure_delete = ON");  // not everywhere the default; what was removed must not stay in pages
  return database;
}

}  // namespace

int last_episode(const StoredModel& stored) {
  return stored.episodes.empty() ? 0 : stored.episodes.back().number;
}

struct ModelFile::State {
  fs::path path;
  std::optional<sqlite::Database> database;  ///< nothing until the file exists
  tables::Revision revision;                 ///< of the file when this object last read or wrote it

  /// Opens for writing, too, where that is allowed: what a killed writer left half done must be undone before reading.
  State(const fs::path& path_, bool exists) : path(path_) {
    if (!exists) return;
    naming(path, [&] {
      database = open_database(path, 0);
      revision = revision_now();
    });
  }

  /// Another file may have taken the place of the one that is open, and SQLite may not notice that its pages are
  /// others.
  void open_anew() { database = open_database(path, database ? 0 : SQLITE_OPEN_CREATE); }

  tables::Revision revision_now() {
    return has_model(path, *database) ? tables::revision(*database) : tables::Revision{};
  }

  /// One transaction that runs `write(database, meta)` between the check that no other process has committed and the
  /// new revision. `write` finds the tables of the present schema, and meta as it is to be.
  template <class Write>
  void change(Write&& write) {
    naming(path, [&] {
      open_anew();
      sqlite::Transaction transaction(*database, "BEGIN IMMEDIATE");
      if (revision_now() != revision) {
        reject_write(path, "that another process changed it meanwhile; this change was not saved, do it again");
      }
      const bool is_model = revision.number > 0;
      if (!is_model) tables::create(*database);
      tables::Meta meta = is_model ? tables::read_meta(*database) : tables::Meta{};
      ++meta.revision;
      meta.sila_version = build_version();
      write(*database, meta);
      tables::write_meta(*database, meta);
      tables::Revision written = revision_now();
      transaction.commit();
      revision = std::move(written);
    });
  }

  /// Runs `look(database)` on all tables as one commit left them.
  template <class Look>
  auto look(Look&& look) {
    if (!database) reject(path, "no file yet; `sila learn` makes one");
    return naming(path, [&] {
      const sqlite::Transaction snapshot(*database, "BEGIN");
      if (!has_model(path, *database)) reject(path, "an empty file; `sila learn` makes a model of it");
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
  return ModelFile(std::make_unique<State>(path, fs::exists(status)));
}

ModelFile ModelFile::open(const fs::path& path) {
  const fs::file_status status = status_of(path);
  if (!fs::exists(status)) reject(path, "no such file");
  require_regular(path, status);
  if (!may(path, R_OK)) reject(path, "no permission to read it");
  return ModelFile(std::make_unique<State>(path, true));
}

bool ModelFile::empty() const {
  return state_->revision.number == 0;
}

bool ModelFile::changed_elsewhere() {
  State& state = *state_;
  if (!fs::exists(state.path)) return false;
  return naming(state.path, [&] {
    state.open_anew();
    const sqlite::Transaction snapshot(*state.database, "BEGIN");
    return state.revision_now() != state.revision;
  });
}

StoredModel ModelFile::read(const std::function<void(const StoredModel&)>& accept) {
  return state_->look([&](sqlite::Database& database) {
    StoredModel stored = stored_in(database);
    if (accept) accept(stored);
    state_->revision = tables::revision(database);
    std::error_code error;
    stored.bytes = fs::file_size(state_->path, error);
    return stored;
  });
}

void ModelFile::commit(const Model& model, const EpisodeRecord& episode, const std::string& configuration) {
  if (episode.number < 1)
    throw std::invalid_argument("commit: episode.number = " + std::to_string(episode.number) + ", must be at least 1");
  check(model);
  require_objects(configuration, std::span(&episode, 1));
  const ModelParts parts = parts_of(model, configuration);
  state_->change([&](sqlite::Database& database, const tables::Meta& meta) {
    const std::int64_t last = database.integer("SELECT coalesce(max(number), 0) FROM episodes");
    if (episode.number <= last) {
      reject_write(state_->path, "episode " + std::to_string(last) + " in it already, and this is episode " +
                                     std::to_string(episode.number));
    }
    tables::keep_models(database, std::max(meta.rollbacks, 1));  // first, so that new parts take the place of old ones
    tables::write_episode(database, episode);
    tables::write_model(database, episode.number, parts);
    if (meta.rollbacks == 0) tables::keep_models(database, 1);
    const int detailed_until = tables::kept_models(database).front() - kDetailsKept;
    const std::string detailed =
        "number <= " + std::to_string(detailed_until) + R"( AND instr(statistics, '"change"') > 0)";
    for (const EpisodeRecord& old : shortened(tables::read_episodes(database, detailed), detailed_until))
      tables::write_episode(database, old);
  });
}

void ModelFile::replace(const StoredModel& stored) {
  check(stored.model);
  require_objects(stored.configuration, stored.episodes);
  state_->change([&](sqlite::Database& database, const tables::Meta&) {
    tables::remove_after(database, -1);
    write_stored(database, stored);
  });
}

int ModelFile::oldest_rollback() {
  return state_->look([&](sqlite::Database& database) { return reachable(database).front(); });
}

void ModelFile::rollback(int episode) {
  const fs::path& path = state_->path;
  oldest_rollback();  // rejects a file without a model
  state_->change([&](sqlite::Database& database, const tables::Meta&) {
    const std::vector<int> possible = reachable(database);
    if (!std::ranges::binary_search(possible, episode)) {
      const std::string last = std::to_string(possible.back());
      throw FormatError(path.string(), 0, "a model that can be rolled back to episode " + std::to_string(episode),
                        possible.size() == 1 ? "one whose last episode is " + last + " and that keeps no earlier model"
                                             : "one that keeps the models from episode " +
                                                   std::to_string(possible.front()) + " to " + last);
    }
    check(tables::read_model(database, episode).model);
    tables::remove_after(database, episode);
  });
}

void ModelFile::keep_undo(int episodes) {
  if (episodes < 0) throw std::invalid_argument("keep_undo: " + std::to_string(episodes) + " is less than none");
  oldest_rollback();  // rejects a file without a model
  state_->change([&](sqlite::Database& database, tables::Meta& meta) {
    meta.rollbacks = episodes;
    tables::keep_models(database, std::int64_t{episodes} + 1);
  });
}

VerifyReport ModelFile::verify() {
  return state_->look([&](sqlite::Database& database) {
    VerifyReport report;
    report.pages = database.integer("PRAGMA page_count");
    report.episodes = stored_in(database).episodes.size();
    tables::require_all_intact(database);
    try {
      std::vector<int> earlier = reachable(database);
      earlier.pop_back();
      for (const int episode : earlier) check(tables::read_model(database, episode).model);
      if (!tables::unnamed_parts(database).empty()) throw std::invalid_argument("it has parts of no model");
      report.undone = earlier.size();
    } catch (const std::invalid_argument& error) {
      reject(state_->path, std::string("a sound model whose history is damaged (") + error.what() +
                               "); it can be used and learnt on, `sila rollback --keep 0` removes the history");
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
  require_objects(stored.configuration, stored.episodes);
  return naming("the bytes of a model", [&] {
    sqlite::Database database(":memory:", SQLITE_OPEN_READWRITE);
    sqlite::Transaction transaction(database, "BEGIN");
    tables::create(database);
    write_stored(database, stored);
    tables::write_meta(database, {1, std::string(build_version())});
    transaction.commit();
    return database.bytes();
  });
}

StoredModel model_of_bytes(std::string_view bytes) {
  const fs::path name = "the bytes of a model";
  return naming(name, [&] {
    sqlite::Database database = sqlite::Database::of_bytes(bytes);
    if (!has_model(name, database)) reject(name, "no bytes");
    StoredModel stored = stored_in(database);
    stored.bytes = bytes.size();
    return stored;
  });
}

StoredModel stored_prior(std::span<const StoredModel> models) {
  std::vector<Model> contents;
  for (const StoredModel& stored : models) contents.push_back(stored.model);
  StoredModel prior;
  prior.model = make_prior(contents);
  auto configuration = nlohmann::ordered_json::parse(models.front().configuration);
  configuration.erase("metres_per_pixel");  // each place measures its own
  prior.configuration = configuration.dump();
  return prior;
}

}  // namespace sila
