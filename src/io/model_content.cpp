#include "model_content.hpp"

#include <tbb/parallel_for.h>
#include <zlib.h>

#include <algorithm>
#include <array>
#include <stdexcept>
#include <utility>

#include "bytes.hpp"
#include "sila/model/packing.hpp"

namespace sila::rows {
namespace {

using bytes::append;
using bytes::of_numbers;
using bytes::to_numbers;

PrimitiveRow row_of(const MotionPrimitive& primitive) {
  PrimitiveRow row{primitive.weight, primitive.support, {}, {}};
  for (const CellVelocity& entry : primitive.cells) {
    append(row.cells, static_cast<std::uint32_t>(entry.cell.x));
    append(row.cells, static_cast<std::uint32_t>(entry.cell.y));
    append(row.velocities, entry.velocity.x());
    append(row.velocities, entry.velocity.y());
  }
  return row;
}

template <class Count>
Count count_of(std::int64_t value) {
  if (std::in_range<Count>(value) && value >= 0) return static_cast<Count>(value);
  throw std::invalid_argument(std::to_string(value) + " is no count");
}

MotionPrimitive primitive_of(const PrimitiveRow& row) {
  const std::vector<std::uint32_t> places = bytes::words<std::uint32_t>(row.cells);
  const std::vector<double> numbers = to_numbers(row.velocities);
  if (places.size() % 2 != 0 || numbers.size() != places.size()) {
    throw std::invalid_argument("a primitive has " + std::to_string(places.size()) + " cell coordinates and " +
                                std::to_string(numbers.size()) + " velocity components");
  }
  MotionPrimitive primitive{{}, row.weight, count_of<int>(row.support)};
  for (std::size_t i = 0; i < places.size(); i += 2) {
    const CellKey cell{static_cast<std::int32_t>(places[i]), static_cast<std::int32_t>(places[i + 1])};
    primitive.cells.push_back({cell, Vector2(numbers[i], numbers[i + 1])});
  }
  return primitive;
}

Transition transition_of(const TransitionRow& row) {
  return {count_of<int>(row.from),
          count_of<int>(row.to),
          row.count,
          unpack_flow_field(to_numbers(row.field)),
          unpack_gp(to_numbers(row.residual)),
          unpack_site_counts(to_numbers(row.sites)),
          count_of<int>(row.support)};
}

SiteSharing sharing_of(std::int64_t number) {
  if (number < 0 || number >= static_cast<std::int64_t>(kSiteSharings.size()))
    throw std::invalid_argument(std::to_string(number) + " is no sharing of sites");
  return static_cast<SiteSharing>(number);
}

std::string bytes_of(const EpisodeId& id) {
  std::string bytes;
  append(bytes, id.high);
  append(bytes, id.low);
  return bytes;
}

EpisodeId id_of(const std::string& bytes) {
  const std::vector<std::uint64_t> halves = bytes::words<std::uint64_t>(bytes);
  if (halves.size() != 2) throw std::invalid_argument("the id of an episode has no 16 bytes");
  return {halves[0], halves[1]};
}

std::string number_bytes(std::int64_t number) {
  const double as_double = static_cast<double>(number);
  return of_numbers({&as_double, 1});
}

}  // namespace

Content content_of(const Model& model, const std::string& configuration) {
  Content content;
  content.episodes = model.episodes;
  content.tracks = model.tracks;
  content.configuration = configuration;
  content.settings = of_numbers(pack(model.settings));
  content.sharing = static_cast<std::int64_t>(model.sharing);
  content.global_residual = of_numbers(pack(model.global_residual));
  for (const Site& site : model.sites) {
    content.sites.push_back({of_numbers(pack(site.frame)), site.episodes, site.tracks,
                             of_numbers(pack(site.error_statistics)), of_numbers(pack(site.global_residual))});
  }
  for (const MotionPrimitive& primitive : model.primitives) content.primitives.push_back(row_of(primitive));
  for (const Transition& transition : model.transitions) {
    content.transitions.push_back({transition.from, transition.to, transition.count, of_numbers(pack(transition.field)),
                                   of_numbers(pack(transition.residual)), of_numbers(pack(transition.sites)),
                                   transition.support});
  }
  for (const EpisodeId& id : model.episode_ids) content.learnt.push_back(bytes_of(id));
  return content;
}

Model model_of(const Content& content) {
  Model model;
  model.episodes = count_of<int>(content.episodes);
  model.tracks = count_of<long>(content.tracks);
  model.settings = unpack_settings(to_numbers(content.settings));
  model.sharing = sharing_of(content.sharing);
  model.global_residual = unpack_gp(to_numbers(content.global_residual));
  for (const SiteRow& row : content.sites) {
    model.sites.push_back({unpack_frame(to_numbers(row.frame)), count_of<int>(row.episodes), count_of<long>(row.tracks),
                           unpack_error_statistics(to_numbers(row.error_statistics)),
                           unpack_gp(to_numbers(row.global_residual))});
  }
  for (const PrimitiveRow& row : content.primitives) model.primitives.push_back(primitive_of(row));
  model.transitions.resize(content.transitions.size());
  tbb::parallel_for(std::size_t{0}, content.transitions.size(),
                    [&](std::size_t i) { model.transitions[i] = transition_of(content.transitions[i]); });
  for (const std::string& id : content.learnt) model.episode_ids.push_back(id_of(id));
  return model;
}

void sort_learnt(std::vector<std::string>& learnt) {
  std::ranges::sort(learnt, std::ranges::less{}, id_of);
}

std::int64_t crc(std::string_view bytes, std::int64_t before) {
  if (bytes.empty()) return before;  // zlib begins anew at a null pointer
  const auto* start = reinterpret_cast<const Bytef*>(bytes.data());
  return static_cast<std::int64_t>(crc32_z(static_cast<uLong>(before), start, bytes.size()));
}

std::int64_t checksum(const Content& content) {
  std::int64_t sum = 0;
  const auto add = [&](std::string_view bytes) { sum = crc(bytes, sum); };
  const auto add_number = [&](std::int64_t number) { add(number_bytes(number)); };
  add(content.settings);
  for (const PrimitiveRow& row : content.primitives) {
    add(row.cells);
    add(row.velocities);
    add(of_numbers({&row.weight, 1}));
    add_number(row.support);
  }
  for (const TransitionRow& row : content.transitions) {
    add_number(row.from), add_number(row.to);
    add(of_numbers({&row.count, 1}));
    add(row.sites);
    add_number(row.support);
    add(row.field), add(row.residual);
  }
  add_number(content.sharing), add(content.global_residual);
  for (const SiteRow& row : content.sites) {
    add(row.frame), add(row.error_statistics), add(row.global_residual);
    add_number(row.episodes), add_number(row.tracks);
  }
  add_number(content.episodes), add_number(content.tracks);
  add(content.configuration);
  for (const std::string& id : content.learnt) add(id);
  return sum;
}

}  // namespace sila::rows
