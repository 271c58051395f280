// Whole models, behind their checksum: a sound model of which numbers are spoilt. What check() takes must be safe to
// predict with. An input is a list of changes, 12 bytes each: part, way, index, number.

#include <numeric>
#include <stdexcept>
#include <tuple>

#include "io/made_up_model.hpp"
#include "numbers.hpp"
#include "promises.hpp"
#include "sila/io/reports.hpp"
#include "sila/model/packing.hpp"
#include "sila/refine/predictor.hpp"

namespace sila::fuzz {
namespace {

struct Change {
  std::uint8_t part = 0, way = 0;
  std::uint16_t index = 0;
  double number = 0.0;
};
constexpr std::size_t kChangeBytes = 12;

Change change_at(const std::uint8_t* data) {
  Change change{data[0], data[1], 0, 0.0};
  std::memcpy(&change.index, data + 2, sizeof change.index);
  std::memcpy(&change.number, data + 4, sizeof change.number);
  return change;
}

/// Two primitives and three transitions, with everything that a model may have; small, to be quick.
Model sound_model() {
  std::mt19937_64 random(5);
  Model model = random_model(6);
  model.settings = {};
  model.refinement.residual_settings.horizon_s = 4.8;
  model.refinement.residual_settings.knots = 2;
  model.primitives.resize(2);
  model.transitions.clear();
  model.refinement.residuals.clear();
  for (const auto& [from, to] : {std::pair(0, 0), std::pair(0, 1), std::pair(1, 1)}) {
    Transition transition{from, to, 2.0, random_field(random), {{0, 2.0, 1}}};
    model.refinement.residuals.push_back(random_gp(random, kResidualInputs, 4));
    transition.field.gp.pseudo_inputs = 3.0 * random_matrix(random, 2, transition.field.gp.pseudo_inputs.cols());
    transition.field.extent = Eigen::AlignedBox2d(Vector2(-3.0, -3.0), Vector2(3.0, 3.0));
    model.transitions.push_back(std::move(transition));
  }
  for (ErrorStatistics& error_statistics : model.refinement.error_statistics) {
    error_statistics = of_one_step(error_statistics);
    for (RegressionMoments& moments : error_statistics.stacking)
      moments.features *= moments.features.transpose().eval();
    for (Densities* densities : {&error_statistics.density, &error_statistics.density_place_free}) {
      for (DensityMoments& density : *densities) density.scale.features *= density.scale.features.transpose().eval();
    }
  }
  model.refinement.prior = model.refinement.error_statistics.front();
  model.sharing = SiteSharing::apart;
  model.episodes = 2;
  model.episode_ids.resize(2);
  check(model);
  return model;
}

void apply(const Change& change, std::vector<double>& numbers) {
  const double number = change.way % 2 == 0 ? change.number : kTrouble[change.index % kTrouble.size()];
  const auto at = static_cast<std::ptrdiff_t>(numbers.empty() ? 0 : change.index % numbers.size());
  switch (change.way / 2 % 6) {
    case 0:
      numbers.insert(numbers.begin() + at, number);
      break;
    case 1:
      if (!numbers.empty()) numbers.erase(numbers.begin() + at);
      break;
    case 2:
      for (double& each : numbers) each *= number;
      break;
    default:
      if (!numbers.empty()) numbers[static_cast<std::size_t>(at)] = number;
  }
}

template <class Part>
void change_packed(Part& part, const Change& change) {
  std::vector<double> numbers = pack(part);
  apply(change, numbers);
  part = unpack<Part>(numbers);
}

int whole(double number) {
  return number > -2147483648.0 && number < 2147483647.0 ? static_cast<int>(number) : -2147483647 - 1;
}

void apply(const Change& change, Model& model) {
  Refinement& refinement = model.refinement;
  const std::size_t s = change.way / 16 % model.sites.size(), t = change.part / 16 % model.transitions.size();
  Site& site = model.sites[s];
  MotionPrimitive& primitive = model.primitives[change.index % model.primitives.size()];
  Transition& transition = model.transitions[t];
  AllSettings settings{model.settings, refinement.residual_settings};
  CellVelocity& cell = primitive.cells[change.way % primitive.cells.size()];
  switch (change.part % 16) {
    case 0:
      change_packed(settings, change);
      std::tie(model.settings, refinement.residual_settings) = settings;
      return;
    case 1:
      return change_packed(refinement.error_statistics[s], change);
    case 2:
      return change_packed(refinement.prior, change);
    case 3:
      return change_packed(site.frame, change);
    case 4:
    case 5:
      return change_packed(transition.field, change);
    case 6:
    case 7:
      return change_packed(refinement.residuals[t], change);
    case 8:
      primitive.weight = change.number;
      return;
    case 9:
      cell.velocity.x() = change.number;
      return;
    case 10:
      cell.cell.x = whole(change.number);
      return;
    case 11:
      transition.from = whole(change.number);
      return;
    case 12:
      transition.to = whole(change.number);
      return;
    case 13:
      transition.count = change.number;
      return;
    case 14:
      return change_packed(transition.sites, change);
    default:
      model.episodes = site.episodes = whole(change.number);
      model.tracks = site.tracks = model.episodes;
      return;
  }
}

CurbTrajectory observed_by(const Model& model, const Vector2& from, const Vector2& step) {
  CurbTrajectory track;
  track.id = "somebody";
  if (!model.sites.empty()) track.frame = model.sites.front().frame;
  for (int i = 0; i < 16; ++i) {
    track.times_s.push_back(i * model.settings.sample_interval_s);
    track.positions.emplace_back(from + i * step);
    track.velocities.emplace_back(step / model.settings.sample_interval_s);
  }
  return track;
}

/// A prediction has a future, whatever it says of it.
void predict_with(const Model& model) {
  RefineConfig config;
  config.horizon_s = std::min(config.horizon_s, 10.0 * model.settings.sample_interval_s);
  config.mode_horizon_s = config.horizon_s;
  try {
    const Predictor predictor(model, config);
    Workspace workspace;
    for (const auto& [from, step] :
         {std::pair(Vector2(-1.0, -1.0), Vector2(0.1, 0.1)), std::pair(Vector2(2.0, 0.5), Vector2(-0.1, 0.0))}) {
      const Prediction& prediction = predictor.predict(observed_by(model, from, step), workspace);
      require(!prediction.modes.empty() && !prediction.times_s.empty(), "there is always a prediction");
      for (const Mode& mode : prediction.modes)
        require(mode.path_m.size() == prediction.times_s.size(), "a mode is as long as the prediction");
    }
  } catch (const NumericalError&) {         // says so
  } catch (const std::invalid_argument&) {  // velocities that are beyond all numbers
  }
}

void travel(const Model& model) {
  const StoredModel sent{model, "{}", {}, {}, 0};
  const StoredModel arrived = model_of_bytes(model_bytes(sent));
  require(identical(arrived.model, model), "a model arrives as it was sent");
  require(!describe(arrived).empty(), "a model can be described");
}

}  // namespace
}  // namespace sila::fuzz

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace sila;
  using namespace sila::fuzz;
  static const Model sound = sound_model();
  Model model = sound;
  try {
    for (std::size_t at = 0; at + kChangeBytes <= size; at += kChangeBytes) apply(change_at(data + at), model);
    check(model);
  } catch (const std::invalid_argument& error) {
    require(std::string_view(error.what()).size() > 10, "the reason is said", error.what());
    return 0;
  }
  predict_with(model);
  // Some of them only: it takes longer than all else. Single bytes would not do, for most of round numbers are zero.
  if (std::accumulate(data, data + size, 0u) % 64 == 0) travel(model);
  return 0;
}

/// Changes with numbers that mean trouble; libFuzzer makes the others.
extern "C" std::size_t LLVMFuzzerCustomMutator(std::uint8_t* data, std::size_t size, std::size_t max_size,
                                               unsigned seed) {
  using namespace sila::fuzz;
  std::mt19937 random(seed);
  if (size >= kChangeBytes && random() % 3 == 0) return LLVMFuzzerMutate(data, size, max_size);
  const std::size_t changes = size / kChangeBytes, most = max_size / kChangeBytes;
  const std::size_t at = changes == 0 ? 0 : random() % std::min(changes + 1, most);
  std::uint8_t* const place = data + at * kChangeBytes;
  const auto index = static_cast<std::uint16_t>(random());
  const double number = kTrouble[random() % kTrouble.size()];
  place[0] = static_cast<std::uint8_t>(random());
  place[1] = static_cast<std::uint8_t>(random());
  std::memcpy(place + 2, &index, sizeof index);
  std::memcpy(place + 4, &number, sizeof number);
  return std::max(changes, at + 1) * kChangeBytes;
}
