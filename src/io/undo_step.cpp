#include "undo_step.hpp"

#include <algorithm>
#include <iterator>
#include <stdexcept>
#include <string_view>
#include <unordered_map>
#include <utility>
#include <vector>

#include "bytes.hpp"

// A step (numbers have 8 bytes, a text is its length and itself):
//   checksum of the earlier content, its episodes, tracks and sharing of sites;
//   configuration, conventions, global residual GP: each 1 if it is that of the newer content, else 0 and the text;
//   how many sites, each: episodes, tracks, frame, error statistics, global residual GP;
//   how many primitives, each: weight, support, cells, velocities;
//   how many transitions, each: from, to, count, support, field, residual GP, sites;
//   how many ids that the newer content has and the earlier has not, and they; the other way round;
//   how many shortened records, each: number, statistics.
// Frame, error statistics, global residual GP, cells, velocities, field, residual GP, sites: 1 + the index of a row of
// the newer content that has the same, or 0 and the text.
namespace sila::rows {
namespace {

using bytes::append;
using bytes::append_text;
using bytes::Reader;

/// A column of big values: writes and reads those of earlier rows by their place in the newer ones.
template <class Row>
class Column {
 public:
  Column(const std::vector<Row>& next, std::string Row::*member) : next_(next), member_(member) {}

  void index() {
    for (std::size_t i = 0; i < next_.size(); ++i) places_.try_emplace(next_[i].*member_, i);
  }
  void write(std::string& bytes, const Row& earlier) const {
    const auto found = places_.find(earlier.*member_);
    append(bytes, found == places_.end() ? std::uint64_t{0} : std::uint64_t{found->second + 1});
    if (found == places_.end()) append_text(bytes, earlier.*member_);
  }
  std::string read(Reader& reader) const {
    const std::uint64_t place = reader.word();
    if (place > next_.size()) throw std::invalid_argument("a step of undo names a row that does not exist");
    return place == 0 ? reader.text() : next_[place - 1].*member_;
  }

 private:
  const std::vector<Row>& next_;
  std::string Row::*member_;
  std::unordered_map<std::string_view, std::size_t> places_;
};

constexpr std::string Content::*kWholes[] = {&Content::configuration, &Content::settings, &Content::global_residual};

void write_ids(std::string& bytes, const std::vector<std::string>& have, const std::vector<std::string>& have_not) {
  std::vector<std::string> sorted = have, others = have_not, rest;
  std::ranges::sort(sorted), std::ranges::sort(others);
  std::ranges::set_difference(sorted, others, std::back_inserter(rest));
  append(bytes, std::uint64_t{rest.size()});
  for (const std::string& id : rest) append_text(bytes, id);
}

/// A length, each element of which takes at least one byte of what is left.
template <class Action>
void each(Reader& reader, Action&& action) {
  for (std::uint64_t rest = reader.word(); rest > 0; --rest) action();
}

std::vector<std::string> earlier_ids(Reader& reader, std::vector<std::string> ids) {
  std::vector<std::string> gone;
  each(reader, [&] { gone.push_back(reader.text()); });
  std::ranges::sort(gone);
  std::erase_if(ids, [&](const std::string& id) { return std::ranges::binary_search(gone, id); });
  each(reader, [&] { ids.push_back(reader.text()); });
  sort_learnt(ids);
  return ids;
}

}  // namespace

std::string make_undo(const Earlier& earlier, const Content& next) {
  const Content& content = earlier.content;
  std::string bytes;
  append(bytes, checksum(content)), append(bytes, content.episodes), append(bytes, content.tracks);
  append(bytes, content.sharing);
  for (const auto whole : kWholes) {
    const bool same = content.*whole == next.*whole;
    append(bytes, std::uint64_t{same});
    if (!same) append_text(bytes, content.*whole);
  }
  Column frames(next.sites, &SiteRow::frame), error_statistics(next.sites, &SiteRow::error_statistics);
  Column global_residuals(next.sites, &SiteRow::global_residual);
  frames.index(), error_statistics.index(), global_residuals.index();
  append(bytes, std::uint64_t{content.sites.size()});
  for (const SiteRow& row : content.sites) {
    append(bytes, row.episodes), append(bytes, row.tracks);
    frames.write(bytes, row), error_statistics.write(bytes, row), global_residuals.write(bytes, row);
  }
  Column cells(next.primitives, &PrimitiveRow::cells), velocities(next.primitives, &PrimitiveRow::velocities);
  Column fields(next.transitions, &TransitionRow::field), residuals(next.transitions, &TransitionRow::residual);
  Column sites(next.transitions, &TransitionRow::sites);
  cells.index(), velocities.index(), fields.index(), residuals.index(), sites.index();
  append(bytes, std::uint64_t{content.primitives.size()});
  for (const PrimitiveRow& row : content.primitives) {
    append(bytes, row.weight), append(bytes, row.support);
    cells.write(bytes, row), velocities.write(bytes, row);
  }
  append(bytes, std::uint64_t{content.transitions.size()});
  for (const TransitionRow& row : content.transitions) {
    append(bytes, row.from), append(bytes, row.to), append(bytes, row.count);
    append(bytes, row.support);
    fields.write(bytes, row), residuals.write(bytes, row), sites.write(bytes, row);
  }
  write_ids(bytes, next.learnt, content.learnt), write_ids(bytes, content.learnt, next.learnt);
  append(bytes, std::uint64_t{earlier.statistics.size()});
  for (const auto& [number, statistics] : earlier.statistics)
    append(bytes, std::int64_t{number}), append_text(bytes, statistics);
  return bytes;
}

Earlier apply_undo(const Content& next, const std::string& step) {
  Reader reader(step);
  Earlier earlier;
  Content& content = earlier.content;
  const std::int64_t wanted = reader.integer();
  content.episodes = reader.integer(), content.tracks = reader.integer();
  content.sharing = reader.integer();
  for (const auto whole : kWholes) content.*whole = reader.word() == 1 ? next.*whole : reader.text();
  const Column frames(next.sites, &SiteRow::frame), error_statistics(next.sites, &SiteRow::error_statistics);
  const Column global_residuals(next.sites, &SiteRow::global_residual);
  each(reader, [&] {
    SiteRow& row = content.sites.emplace_back();
    row.episodes = reader.integer(), row.tracks = reader.integer();
    row.frame = frames.read(reader), row.error_statistics = error_statistics.read(reader),
    row.global_residual = global_residuals.read(reader);
  });
  const Column cells(next.primitives, &PrimitiveRow::cells), velocities(next.primitives, &PrimitiveRow::velocities);
  const Column fields(next.transitions, &TransitionRow::field), residuals(next.transitions, &TransitionRow::residual);
  const Column sites(next.transitions, &TransitionRow::sites);
  each(reader, [&] {
    PrimitiveRow& row = content.primitives.emplace_back();
    row.weight = reader.number(), row.support = reader.integer();
    row.cells = cells.read(reader), row.velocities = velocities.read(reader);
  });
  each(reader, [&] {
    TransitionRow& row = content.transitions.emplace_back();
    row.from = reader.integer(), row.to = reader.integer(), row.count = reader.number();
    row.support = reader.integer();
    row.field = fields.read(reader), row.residual = residuals.read(reader), row.sites = sites.read(reader);
  });
  content.learnt = earlier_ids(reader, next.learnt);
  each(reader, [&] {
    const auto number = static_cast<int>(reader.integer());
    earlier.statistics[number] = reader.text();
  });
  if (!reader.at_end() || checksum(content) != wanted)
    throw std::invalid_argument("a step of undo is not one of this model");
  return earlier;
}

}  // namespace sila::rows
