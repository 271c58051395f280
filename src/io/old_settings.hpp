#pragma once

#include <string_view>
#include <utility>

namespace sila {

/// Earlier names of fields and groups, and those that they have now.
inline constexpr std::pair<std::string_view, std::string_view> kRenamed[] = {
    {"outlook", "residual"},
    {"lessons", "error_statistics"},
    {"blend", "stacking"},
    {"alternatives", "mode_variants"},
    {"max_asked", "max_shortlisted"},
    {"gp.fusion", "gp_fusion"},
    {"field.gp", "field"},
    {"field.hyperparameters", "field.pseudo_inputs"},
    {"fuse.gp", "fuse"},
    {"live.every_s", "service.stride_s"},
    {"serve.max_waiting_lines", "service.max_queued_lines"},
    {"live", "service"},
    {"serve", "service"},
    {"works_m", "construction_length_m"},
    {"smoothing_s", "acceleration_density"},
    {"smoothing_intervals", "acceleration_density"},
    {"compact", "prune"},
    {"model", "budget"},
    {"evaluate.every_s", "evaluate.stride_s"},
    {"evidence_s", "likelihood_s"},
};

/// Last names of fields that are constants now, with the group where another has a field of that name. Spaces on both
/// sides of each.
inline constexpr std::string_view kConstants =
    " jump_tolerance_m max_abs_position_m standing_extent_m min_speed_mps activeness_weight gain_m dilation_cells"
    " segmentation min_coefficient switch_penalty min_run_samples drop_below every_s warm_up_rounds knots"
    " signal_std_mps noise_std_mps min_seen_share selection_stop keep_pseudo_inputs_share settled_share"
    " global_scale_mps gait_scale_mps max_count agreement_share agreement_mps max_branches support_ratio leave_ratio"
    " min_relative_weight chaining max_effective_samples gait_examples_elsewhere stacking_ridge stacking_class_ridge"
    " blend_ridge blend_class_ridge variant_reach alternative_reach own_speed_relaxation_s noise_correlation_s"
    " moving_m turning_rad clock_jump_s drift_pedestrians drift_deviations constant_mean alpha min_points_to_optimise"
    " max_iterations gradient_tolerance relative_tolerance min_length_scale max_length_scale_extents"
    " min_noise_variance min_noise_to_signal pooling_rounds lattice_step page_every_s decay memory_windows mean"
    " case_3_fuses_stronger max_outgoing_mb max_send_queue_mb silence_s tile_cells sparsity road_width_m"
    " arrivals_per_s mean_speed_mps speed_std_mps signal_cycle_s walk_phase_s run_m global_pseudo_inputs"
    " gait_pseudo_inputs variant_weight alternative_weight known_ratio expire_count forget_count clock_patience"
    " group_share turn_share jaywalk_share stop_share stand_share dictionary.max_primitives field.length_scale_m"
    " fuse.max_pseudo_inputs max_fused_pseudo_inputs expire_after_episodes forget_after_episodes half_life_episodes"
    " max_track_samples max_pending_scores max_unscored max_waiting_tracks scored_pedestrians remembered"
    " trained_sites_only known_places_only calibration_step tuning_step ";

}  // namespace sila
