#pragma once

#include <Eigen/Geometry>
#include <compare>
#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <type_traits>
#include <vector>

#include "sila/core/grid.hpp"
#include "sila/core/trajectory.hpp"
#include "sila/gp/sparse_gp.hpp"
#include "sila/model/refinement.hpp"
#include "sila/model/site.hpp"

namespace sila {

/// Settings that stay the same for the life of a model, because its parts are compared: fixed by its first episode.
struct ModelSettings {
  Grid grid;
  CurbScaling scaling = CurbScaling::metres;
  double sample_interval_s = 0.2;
  double reference_width_m = 1.0;  ///< [m] of one curb unit, by which configured metres became units

  bool operator==(const ModelSettings&) const = default;
};

/// 128 bits that identify the tracks of an episode.
struct EpisodeId {
  std::uint64_t high = 0;
  std::uint64_t low = 0;
  auto operator<=>(const EpisodeId&) const = default;
};

/// The same tracks at the same corners have the same id, whatever their names, recordings and order; any other bit of a
/// track or a frame changes the id. The same on every machine.
EpisodeId episode_id(std::span<const FramedTrajectory> batch);

/// 32 hexadecimal digits; they sort as the ids do.
std::string to_text(const EpisodeId& id);
/// Throws: std::invalid_argument for anything but 32 hexadecimal digits.
EpisodeId episode_id_of(const std::string& text);

/// The arrow of a motion primitive in one cell.
struct CellVelocity {
  CellKey cell;
  Vector2 velocity = Vector2::Zero();  ///< length <= 1: a direction, shortened where the members of a fusion disagree
};

/// A motion primitive: a local pattern of normalised velocities on the grid.
/// Invariant: cells sorted, each once; lengths in (0, 1].
struct MotionPrimitive {
  std::vector<CellVelocity> cells;
  double weight = 1.0;  ///< how many primitives of how many batches were fused into it
  int support = 0;      ///< lower bound of the number of different tracks that showed it
};

/// Eigen's box, but copying it is known not to throw. Otherwise a list of fields that grows would copy all their
/// matrices instead of moving them.
struct Extent : Eigen::AlignedBox2d {
  using Eigen::AlignedBox2d::AlignedBox2d;
  Extent() = default;
  Extent(const Eigen::AlignedBox2d& box) : Eigen::AlignedBox2d(box) {}
  Extent(const Extent&) noexcept = default;
  Extent& operator=(const Extent&) noexcept = default;
};

/// Position -> velocity, both in curb coordinates: one sparse GP with two inputs and two outputs, or one for each
/// component of the velocity; and the box of its data. All fields of a model are of one of the two kinds.
struct FlowField {
  SparseGp gp;         ///< of both components, or of that along axis 1
  Extent extent;       ///< of the positions that it was fitted to [curb units]
  SparseGp gp_y = {};  ///< of the component along axis 2; no output: `gp` has both

  bool independent() const { return gp_y.mean.size() > 0; }
  const SparseGp* second() const { return independent() ? &gp_y : nullptr; }
};

/// A transition between two primitives (or from one to itself): the number of tracks, and the velocities along it.
/// Count and field are kept together so that the paper's R_edges and R_GP cannot disagree.
struct Transition {
  int from = 0;  ///< index of a primitive of the same model, 0-based
  int to = 0;
  double count = 0.0;  ///< trajectories that showed it, T(from, to)
  FlowField field;
  std::vector<SiteCount> sites = {};  ///< `count` by site; sorted by site
  int support = 0;                    ///< lower bound of the number of different tracks that showed it
};

static_assert(std::is_nothrow_move_constructible_v<Transition>, "a list of transitions moves them where it grows");

/// A model of one or several sites: the paper's M = {D, R}, and the refinement. It has no raw track.
/// Invariant: `check(model)` passes.
struct Model {
  ModelSettings settings;
  std::vector<MotionPrimitive> primitives;  ///< D
  std::vector<Transition> transitions;      ///< R, sorted by (from, to), each pair once
  std::vector<Site> sites;                  ///< where it was trained, in the order of training
  SiteSharing sharing = SiteSharing::apart;
  Refinement refinement;  ///< nothing of it is used by learn, fuse and predict
  int episodes = 0;
  long tracks = 0;                     ///< trajectories learnt from
  std::vector<EpisodeId> episode_ids;  ///< of the batches learnt, which are not learnt again; sorted, each once

  bool empty() const { return primitives.empty(); }
};

/// The result of one batch, M'(n): a model and the samples of each of its transitions. A stored model holds no raw
/// tracks; an increment does, until it is fused. Invariant: check(model); each list has an entry for each transition,
/// or is empty when the data are gone (model + model).
struct Increment {
  Model model;
  std::vector<GpData> samples;                ///< d_2 of the paper: positions [curb units], velocities [curb units/s]
  std::vector<GpData> residual_samples = {};  ///< of the residual GPs: states 6 x m, residuals m x 2 per knot
};

/// The paper's model size: |D| + |R|.
std::size_t size(const Model& model);

/// Throws: std::invalid_argument if `sharing` is `apart` and the model has shared sites; `function` names the caller.
void require_separable(const std::string& function, const Model& model, SiteSharing sharing);

/// Throws std::invalid_argument naming the first part that breaks an invariant: unsorted or repeated cells, arrows
/// longer than 1, transitions out of order, endpoints that do not exist, counts that are not positive, a GP with wrong
/// shapes or NaN, counts by site that do not add up or name no site, a transition of several sites though they are
/// apart, lists of the refinement that have not one entry for each transition or site.
void check(const Model& model);

}  // namespace sila
