#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <memory>
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

/// A model and what a model file has beside it.
struct StoredModel {
  Model model;
  std::string configuration = "{}";     ///< that it was learnt with: a JSON object
  std::vector<EpisodeRecord> episodes;  ///< by number
  std::string sila_version;             ///< of the last writer; set when read
  std::uintmax_t bytes = 0;             ///< of the file; set when read
};

/// How many of the last episodes a file can take back by default.
inline constexpr int kUndoKept = 20;
/// Of how many of the last episodes a file keeps the details (`change` of their statistics).
inline constexpr int kDetailsKept = 200;

/// The parts that `ModelFile::verify` found intact.
struct VerifyReport {
  std::int64_t pages = 0;
  std::size_t episodes = 0;  ///< recorded
  std::size_t undone = 0;    ///< earlier models, which a rollback would give back
};

/// A model file that is kept open while a place is learnt: an SQLite database, one transaction an episode. Whenever the
/// process dies, the file holds the last complete episode; other processes read it in the meantime. The file comes into
/// being with the first commit. Every error is a FormatError that names the file, and leaves in it what was there
/// before.
class ModelFile {
 public:
  /// The file may be absent or empty; its folder must exist.
  /// Throws: FormatError for a folder, a path that cannot be written, a file that is no sila model, is of another
  /// schema, or damaged.
  static ModelFile open_or_create(const std::filesystem::path& path);

  /// The file must exist and may be write-protected: to read it again and again while another process learns.
  static ModelFile open(const std::filesystem::path& path);

  ModelFile(ModelFile&&) noexcept;
  ModelFile& operator=(ModelFile&&) noexcept;
  ~ModelFile();

  /// Whether no episode was committed yet: there is nothing to read.
  bool empty() const;

  /// Whether another process put something else in the file since this object last read or committed.
  /// Throws: FormatError if it cannot be read.
  bool changed_elsewhere();

  /// Throws: FormatError if the file is empty or damaged.
  StoredModel read();

  /// Makes a model the present one and adds its episode to the list, all or nothing. `rollback` gives back the earlier
  /// models.
  /// Throws: FormatError if it cannot be written, or if another process committed since this object last read or
  /// committed, whose episode would be lost; std::invalid_argument if check(model) does or the record's number is not
  /// the next.
  void commit(const Model& model, const EpisodeRecord& episode, const std::string& configuration);

  /// Puts all of `stored` in the place of the file's content: for a model that does not continue the present one, as of
  /// `sila fuse`. Nothing can be taken back then.
  void replace(const StoredModel& stored);

  /// The earliest episode after which the model can be had again; the last one if none can be taken back.
  /// Throws: as read.
  int oldest_rollback();

  /// Makes the file what it was after an episode: model, configuration, records; later episodes are removed.
  /// Throws: FormatError, which names the oldest episode that is possible, if this one is not; as commit.
  void rollback(int episode);

  /// How many episodes can be taken back at most, from the next commit on; 0 for none. Kept in the file.
  void keep_undo(int episodes);

  /// Reads every page and every kept model, without writing anything.
  /// Throws: FormatError with what is wrong and what helps.
  VerifyReport verify();

 private:
  struct State;
  explicit ModelFile(std::unique_ptr<State> state);
  std::unique_ptr<State> state_;
};

/// Reads a model file; `identical(load_model(p).model, m)` for every model `m` that was saved.
/// Throws: FormatError as ModelFile does, and if the file does not exist or is empty.
StoredModel load_model(const std::filesystem::path& path);

/// The bytes of a model file without a file, for models that travel: `model_of_bytes(model_bytes(m))` is `m`, and the
/// same content gives the same bytes.
/// Throws: FormatError as ModelFile does.
std::string model_bytes(const StoredModel& stored);
StoredModel model_of_bytes(std::string_view bytes);

/// Writes a model file, in the place of a model that is there already; throws rather than overwrite what is not a
/// model.
void save_model(const std::filesystem::path& path, const StoredModel& stored);

/// The prior of these models (sila/refine/prune.hpp) with the configuration of the first, but for the size of a pixel.
/// Throws: as make_prior.
StoredModel stored_prior(std::span<const StoredModel> models);

}  // namespace sila
