#pragma once

#include <optional>
#include <span>
#include <vector>

#include "sila/core/framed_trajectory.hpp"
#include "sila/io/scene.hpp"
#include "sila/model/model.hpp"

namespace sila {

/// The sites of a model as the corners of a scene, the first one primary. Throws: std::invalid_argument for a model
/// without sites.
Scene scene_of(const Model& model);

/// The frame that a model without a scene file began with; null for an empty model and one with scene files alone.
std::optional<CurbFrame> frame_from_tracks(const Model& model);

/// The frame of a track of a live stream: of the scene, if it has a corner; else the one that the model began with.
/// Until the first batch of a new model is complete another one stands for it, in which `from_tracks` is set.
CurbFrame live_frame(const Scene& scene, const Model& model, const Trajectory& track, CornerChoice corners);

/// The scene by which tracks are looked at, for every verb that takes a model: `given` if there is one (it has a
/// corner; its camera is kept in any case); else that of the model; for an empty model one whose frame is made of
/// `first_batch`, which the model then keeps for its life. Throws: std::invalid_argument for a given scene other than
/// the one that a model without a scene file began with; for a model of several sites without a given scene, unless
/// each track goes to the nearest; for an empty model, scene and batch together.
Scene scene_for(const Scene& given, const Model& model, std::span<const FramedTrajectory> first_batch,
                CurbScaling scaling, CornerChoice corners);

/// Tracks that are not placed yet.
std::vector<FramedTrajectory> without_frames(std::vector<Trajectory> tracks);

/// Puts each track in the frame of its corner. Throws: as nearest_corner.
void place(std::span<FramedTrajectory> tracks, const Scene& scene, CornerChoice corners);

}  // namespace sila
