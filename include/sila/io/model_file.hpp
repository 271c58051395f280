#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <memory>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "sila/model/model.hpp"

namespace sila {

/// The record of an episode in the file, beside the model after it.
struct EpisodeRecord {
  int number = 0;               ///< 1-based
  long tracks = 0;              ///< trajectories of its batch
  double seconds = 0.0;         ///< that learning and fusing took [s]
  std::size_t size_before = 0;  ///< of the model
  std::size_t size_after = 0;
  std::string statistics = "{}";  ///< all else that is kept: a JSON object
  std::int64_t committed_s = 0;   ///< when: seconds since 1970, UTC; 0: not known
};

/// A model, and the other content of a model file.
struct StoredModel {
  Model model;
  std::string configuration = "{}";     ///< that it was learnt with: a JSON object, see config_of (sila/config.hpp)
  std::vector<EpisodeRecord> episodes;  ///< by number
  std::string sila_version;             ///< of the last writer; set when read
  std::uintmax_t bytes = 0;             ///< of the file; set when read
};

/// The number of the last recorded episode, which the next one follows; 0 without records.
int last_episode(const StoredModel& stored);

/// Number of the last episodes that a rollback can remove, by default.
inline constexpr int kUndoKept = 20;
/// Number of the last episodes whose details (`change` of their statistics) a file keeps.
inline constexpr int kDetailsKept = 200;

/// The parts that `ModelFile::verify` found intact.
struct VerifyReport {
  std::int64_t pages = 0;
  std::size_t episodes = 0;  ///< recorded
  std::size_t undone = 0;    ///< earlier models, which a rollback would restore
};

/// A model file that is kept open while a place is learnt: an SQLite database, one transaction per episode. If the
/// process dies, the file holds the last complete episode; other processes can read it at any time. The first commit
/// creates the file. Every error is a FormatError that names the file, and leaves its content unchanged.
class ModelFile {
 public:
  /// The file may be absent or empty; its folder must exist.
  /// Throws: FormatError for a folder, a path that cannot be written, a file that is no sila model, is of another
  /// schema, or damaged.
  static ModelFile open_or_create(const std::filesystem::path& path);

  /// For reading repeatedly while another process learns. The file must exist and may be write-protected; if it is not,
  /// `commit` and the other changes work, too.
  static ModelFile open(const std::filesystem::path& path);

  ModelFile(ModelFile&&) noexcept;
  ModelFile& operator=(ModelFile&&) noexcept;
  ~ModelFile();

  /// Whether no episode was committed yet: there is nothing to read.
  bool empty() const;

  /// Whether another process changed or replaced the file since this object last read or committed.
  /// Throws: FormatError if it cannot be read.
  bool changed_elsewhere();

  /// `accept`, if given, sees the content; if it throws, the file remains one that was changed elsewhere.
  /// Throws: FormatError if the file is empty or damaged, and what `accept` throws.
  StoredModel read(const std::function<void(const StoredModel&)>& accept = {});

  /// Stores a model as the current one and adds its episode to the list, all or nothing. `rollback` restores earlier
  /// models.
  /// Throws: FormatError if it cannot be written, or if another process committed since this object last read or
  /// committed, whose episode would be lost, or if the record's number is not above that of the last episode;
  /// std::invalid_argument if check(model) does, if the number is below 1, or if the configuration or the statistics
  /// are no JSON object.
  void commit(const Model& model, const EpisodeRecord& episode, const std::string& configuration);

  /// Replaces the whole content of the file, for a model that does not continue the stored one, such as that of
  /// `sila fuse`. No rollback is possible then.
  void replace(const StoredModel& stored);

  /// The earliest episode to which a rollback is possible; the last episode if no rollback is.
  /// Throws: as read.
  int oldest_rollback();

  /// Restores model, configuration and records as they were after an episode; later episodes are removed.
  /// Throws: FormatError, which names the oldest possible episode, if this one is not possible; as commit.
  void rollback(int episode);

  /// Sets the maximum number of episodes that a rollback can remove, from the next commit on; 0: none. The file keeps
  /// it.
  void keep_undo(int episodes);

  /// Reads every page and every kept model, without writing anything.
  /// Throws: FormatError that names the damage and the remedy.
  VerifyReport verify();

 private:
  struct State;
  explicit ModelFile(std::unique_ptr<State> state);
  std::unique_ptr<State> state_;
};

/// Reads a model file; `identical(load_model(p).model, m)` for every model `m` that was saved.
/// Throws: FormatError as ModelFile does, and if the file does not exist or is empty.
StoredModel load_model(const std::filesystem::path& path);

/// The bytes of a model file without a file, to send a model: `model_of_bytes(model_bytes(m))` is `m`, and the same
/// content gives the same bytes.
/// Throws: FormatError as ModelFile does.
std::string model_bytes(const StoredModel& stored);
StoredModel model_of_bytes(std::string_view bytes);

/// Writes a model file; replaces a model file at `path`. Throws: FormatError if the file at `path` is not a model.
void save_model(const std::filesystem::path& path, const StoredModel& stored);

/// The prior of these models (make_prior, sila/refine/prune.hpp) with the configuration of the first, without its
/// `metres_per_pixel`.
/// Throws: as make_prior.
StoredModel stored_prior(std::span<const StoredModel> models);

}  // namespace sila
