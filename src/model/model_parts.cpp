#include "model/model_parts.hpp"

#include <tbb/parallel_for.h>

#include <concepts>
#include <iterator>
#include <stdexcept>
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
  template <std::integral Count>
  void number(const Count& count) {
    bytes::append(bytes_, static_cast<std::int64_t>(count));
  }
  void number(const double& value) { bytes::append(bytes_, value); }
  void cell(const CellKey& cell) {
    bytes::append(bytes_, static_cast<std::uint32_t>(cell.x));
    bytes::append(bytes_, static_cast<std::uint32_t>(cell.y));
  }
  template <class Part>
  void packed(const Part& part) {
    bytes::append_text(bytes_, bytes::of_numbers(pack(part)));
  }
  template <class Element, class Members>
  void list(const std::vector<Element>& elements, Members&& members) {
    number(elements.size());
    for (const Element& element : elements) members(*this, element);
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
  template <class Element, class Members>
  void list(std::vector<Element>& elements, Members&& members) {
    for (std::uint64_t rest = rest_.word(); rest > 0; --rest) members(*this, elements.emplace_back());
  }
  void finish() const {
    if (!rest_.at_end()) throw std::invalid_argument("a part has bytes too many");
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

void stored_members(auto& archive, MaybeConst<Transition> auto& transition) {
  auto& [from, to, count, field, residual, sites, support] = transition;
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
  auto& [settings, primitives, transitions, sites, sharing, prior, episodes, tracks, episode_ids] = model;
  archive.number(episodes);
  archive.number(tracks);
  auto number_of_sharing = static_cast<std::size_t>(sharing);
  archive.number(number_of_sharing);
  if (number_of_sharing >= kSiteSharings.size())
    throw std::invalid_argument(std::to_string(number_of_sharing) + " is no sharing of sites");
  if constexpr (!std::is_const_v<std::remove_reference_t<decltype(model)>>)
    sharing = static_cast<SiteSharing>(number_of_sharing);
  archive.packed(settings);
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

std::string part_of(const auto& value) {
  Writer writer;
  stored_members(writer, value);
  return std::move(writer).bytes();
}

void read_part(const std::string& bytes, auto& value) {
  Reader reader(bytes);
  stored_members(reader, value);
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
  Writer head;
  head_members(head, model);
  ModelParts result{std::move(head).bytes(), {configuration, part_of(model.prior)}};
  std::ranges::move(grouped(model.episode_ids), std::back_inserter(result.parts));
  for (const Site& site : model.sites) {
    const auto& [frame, episodes, tracks, error_statistics] = site;
    result.parts.push_back(part_of(error_statistics));
  }
  for (const MotionPrimitive& primitive : model.primitives) result.parts.push_back(part_of(primitive));
  for (const Transition& transition : model.transitions) result.parts.push_back(part_of(transition));
  return result;
}

ModelContent content_of(const ModelParts& parts) {
  ModelContent result;
  Model& model = result.model;
  Reader head(parts.head);
  head_members(head, model);
  head.finish();
  const std::size_t others = 2 + kIdGroups + model.sites.size() + model.transitions.size();
  if (parts.parts.size() < others) throw std::invalid_argument("parts of the model are missing");
  model.primitives.resize(parts.parts.size() - others);
  auto part = parts.parts.begin();
  result.configuration = *part++;
  read_part(*part++, model.prior);
  for (std::size_t group = 0; group < kIdGroups; ++group) {
    const std::vector<std::uint64_t> halves = bytes::words<std::uint64_t>(*part++);
    for (std::size_t i = 0; i + 1 < halves.size(); i += 2) model.episode_ids.push_back({halves[i], halves[i + 1]});
  }
  for (Site& site : model.sites) read_part(*part++, site.error_statistics);
  for (MotionPrimitive& primitive : model.primitives) read_part(*part++, primitive);
  tbb::parallel_for(std::size_t{0}, model.transitions.size(),
                    [&](std::size_t i) { read_part(part[static_cast<std::ptrdiff_t>(i)], model.transitions[i]); });
  return result;
}

}  // namespace sila
