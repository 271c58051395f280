#pragma once

#include "sila/io/scene.hpp"
#include "sila/service/stream.hpp"

namespace sila {

// The live page and the JSON messages that it receives (docs/service.md); `metrics_message` is another one.

/// The HTML of the page, which loads nothing else.
std::string live_page();

/// The scene, without corners that of the model, the model, and a picture of the scene's camera (a data URL), if there
/// is one: the first message.
std::string hello_message(const Scene& scene, const Model& model, const std::string& picture);

/// The model after an episode, and its scene: without a given one the page learns only now where primitives are.
std::string model_message(const Model& model);

/// The pedestrians with open tracks, their last seconds and their predictions.
std::string frame_message(const StreamCore& core);

}  // namespace sila
