#include "report/predictor_data.hpp"

#include <zlib.h>

#include <stdexcept>
#include <string>
#include <string_view>

#include "base64.hpp"
#include "embedded_predictor.hpp"
#include "io/portable_predictor.hpp"

namespace sila {
namespace {

std::string deflated(std::string_view bytes) {
  uLongf size = compressBound(bytes.size());
  std::string result(size, '\0');
  const int status = compress2(reinterpret_cast<Bytef*>(result.data()), &size,
                               reinterpret_cast<const Bytef*>(bytes.data()), bytes.size(), Z_BEST_COMPRESSION);
  if (status != Z_OK) throw std::runtime_error("report: zlib failed with status " + std::to_string(status));
  result.resize(size);
  return result;
}

/// Of the primary corner, by which the page draws; else of the first site.
const CurbFrame* frame_of(const ReportInput& input) {
  const Scene& scene = input.scene;
  if (!scene.corners.empty()) return &scene.corners.at(static_cast<std::size_t>(scene.primary)).frame;
  const std::vector<Site>& sites = input.stored.model.sites;
  return sites.empty() ? nullptr : &sites.front().frame;
}

}  // namespace

nlohmann::ordered_json predictor_json(const ReportInput& input, std::size_t most_bytes) {
  const CurbFrame* const frame = frame_of(input);
  if (!frame) return nullptr;
  const EpisodeConfig& config = input.episode;
  std::string wasm;
  for (const char* piece : detail::kEmbeddedPredictor) wasm += piece;
  std::string model =
      detail::base64(deflated(predictor_bytes({input.stored.model, *frame, config.sampling, config.predict})));
  if (const std::size_t bytes = wasm.size() + model.size(); bytes > most_bytes)
    return {{"bytes", bytes}, {"most_bytes", most_bytes}};
  return {{"wasm", std::move(wasm)}, {"model", std::move(model)}};
}

}  // namespace sila
