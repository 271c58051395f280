#pragma once

#include <string>

#include "sila/io/scene.hpp"
#include "sila/serve/facts.hpp"

namespace sila {

// What the live page is sent, one JSON object a message (docs/live.md).

/// The page itself; it fetches everything else from where it came.
std::string live_page();

/// The place and the model as of now: for a page that has just opened.
std::string hello_message(const Scene& scene, const Model& model);

/// The model after an episode.
std::string model_message(const Model& model);

/// Who is about, where they were lately and what is expected of them.
std::string frame_message(const Live& live);

}  // namespace sila
