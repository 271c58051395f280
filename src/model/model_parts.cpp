#include "model/model_parts.hpp"

#include <tbb/parallel_for.h>

#include <concepts>
#include <iterator>
#include <tuple>
#include <type_traits>
#include <utility>

#include "core/bytes.hpp"
#include "sila/core/fields.hpp"
#include "sila/model/packing.hpp"

namespace sila {
namespace {

// An archive is a Writer or a Reader; one function for both gives the members of a struct in their order.

class Writer {
 public:
  void number(const std::integral auto& count) { bytes::append(bytes_, static_cast<std::int64_t>(count)); }
  void number(const double& value) { bytes::append(bytes_, value); }
  void cell(const CellKey& cell) {
    bytes::append(bytes_, static_cast<std::uint32_t>(cell.x));
    bytes::append(bytes_, static_cast<std::uint32_t>(cell.y));
  }
  void packed(const auto& part) { bytes::append_text(bytes_, bytes::of_numbers(pack(part))); }
  void list(const auto& elements, auto&& members) {
    number(elements.size());
    for (const auto& element : elements) members(*this, element);
  }
  std::string bytes() && { return std::move(bytes_); }

 private:
  std::string bytes_;
};

/// Throws: std::invalid_argument where the bytes are none that a Writer wrote.
class Reader {
 public:
  explicit Reader(std::string_view bytes) : rest_(bytes) {}

  template <std::integral Count>
  void number(Count& count) {
    count = bytes::count_of<Count>(rest_.integer());
  }
  void number(double& value) { value = rest_.number(); }
  void cell(CellKey& cell) {
    const auto coordinates = bytes::words<std::uint32_t>(rest_.take(8));
    cell = {static_cast<std::int32_t>(coordinates[0]), static_cast<std::int32_t>(coordinates[1])};
  }
  template <class Part>
  void packed(Part& part) {
    part = unpack<Part>(bytes::to_numbers(rest_.take(rest_.word())));
  }
  void list(auto& elements, auto&& members) {
    for (std::uint64_t rest = rest_.word(); rest > 0; --rest) members(*this, elements.emplace_back());
  }
  void finish() const {
    if (!rest_.at_end()) throw invalid_argument("a part has bytes too many");
  }

 private:
  bytes::Reader rest_;
};

void stored_members(auto& archive, MaybeConst<MotionPrimitive> auto& primitive) {
  auto& [cells, weight, support] = primitive;
  archive.number(weight);
  archive.number(support);
  archive.list(cells, [](auto& inner, auto& entry) {
    inner.cell(entry.cell);
    inner.number(entry.velocity.x());
    inner.number(entry.velocity.y());
  });
}

void stored_members(auto& archive, MaybeConst<Transition> auto& transition, MaybeConst<SparseGp> auto& residual) {
  auto& [from, to, count, field, sites, support] = transition;
  archive.number(count);
  archive.number(support);
  archive.packed(sites);
  archive.packed(field);
  archive.packed(residual);
}

template <class Part>
requires PackedPart<std::remove_const_t<Part>>
void stored_members(auto& archive, Part& part) {
  archive.packed(part);
}

/// The members of a model that stand in its head.
void head_members(auto& archive, MaybeConst<Model> auto& model) {
  auto& [settings, primitives, transitions, sites, sharing, refinement, episodes, tracks, episode_ids] = model;
  archive.number(episodes);
  archive.number(tracks);
  auto number_of_sharing = static_cast<std::size_t>(sharing);
  archive.number(number_of_sharing);
  if (number_of_sharing >= kSiteSharings.size()) throw invalid_argument(number_of_sharing, " is no sharing of sites");
  AllSettings all{settings, refinement.residual_settings};
  archive.packed(all);
  if constexpr (!std::is_const_v<std::remove_reference_t<decltype(model)>>) {
    sharing = static_cast<SiteSharing>(number_of_sharing);
    std::tie(settings, refinement.residual_settings) = all;
  }
  archive.list(sites, [](auto& inner, auto& site) {
    inner.packed(site.frame);
    inner.number(site.episodes);
    inner.number(site.tracks);
  });
  archive.list(transitions, [](auto& inner, auto& transition) {
    inner.number(transition.from);
    inner.number(transition.to);
  });
}

std::string part_of(const auto&... values) {
  Writer writer;
  stored_members(writer, values...);
  return std::move(writer).bytes();
}

void read_part(const std::string& bytes, auto&... values) {
  Reader reader(bytes);
  stored_members(reader, values...);
  reader.finish();
}

/// An episode adds one id to the sorted list: of groups by the first four bits it changes one.
constexpr std::size_t kIdGroups = 16;

std::vector<std::string> grouped(const std::vector<EpisodeId>& ids) {
  std::vector<std::string> groups(kIdGroups);
  for (const EpisodeId& id : ids) {
    std::string& group = groups[id.high >> 60U];
    bytes::append(group, id.high);
    bytes::append(group, id.low);
  }
  return groups;
}

}  // namespace

ModelParts parts_of(const Model& model, const std::string& configuration) {
  const Refinement& refinement = model.refinement;
  Writer head;
  head_members(head, model);
  ModelParts result{std::move(head).bytes(), {configuration, part_of(refinement.prior)}};
  std::ranges::move(grouped(model.episode_ids), std::back_inserter(result.parts));
  for (std::size_t i = 0; i < model.sites.size(); ++i)
    result.parts.push_back(part_of(entry_of(refinement.error_statistics, i)));
  for (const MotionPrimitive& primitive : model.primitives) result.parts.push_back(part_of(primitive));
  for (std::size_t i = 0; i < model.transitions.size(); ++i)
    result.parts.push_back(part_of(model.transitions[i], entry_of(refinement.residuals, i)));
  return result;
}

ModelContent content_of(const ModelParts& parts) {
  ModelContent result;
  Model& model = result.model;
  Refinement& refinement = model.refinement;
  Reader head(parts.head);
  head_members(head, model);
  head.finish();
  const std::size_t others = 2 + kIdGroups + model.sites.size() + model.transitions.size();
  if (parts.parts.size() < others) throw invalid_argument("parts of the model are missing");
  model.primitives.resize(parts.parts.size() - others);
  refinement.error_statistics.resize(model.sites.size());
  refinement.residuals.resize(model.transitions.size());
  auto part = parts.parts.begin();
  result.configuration = *part++;
  read_part(*part++, refinement.prior);
  for (std::size_t group = 0; group < kIdGroups; ++group) {
    const std::vector<std::uint64_t> halves = bytes::words<std::uint64_t>(*part++);
    for (std::size_t i = 0; i + 1 < halves.size(); i += 2) model.episode_ids.push_back({halves[i], halves[i + 1]});
  }
  for (ErrorStatistics& statistics : refinement.error_statistics) read_part(*part++, statistics);
  for (MotionPrimitive& primitive : model.primitives) read_part(*part++, primitive);
  tbb::parallel_for(std::size_t{0}, model.transitions.size(), [&](std::size_t i) {
    read_part(part[static_cast<std::ptrdiff_t>(i)], model.transitions[i], refinement.residuals[i]);
  });
  return result;
}

}  // namespace sila
