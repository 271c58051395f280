// What `sila report` puts into the page (docs/viewer.md). Lengths are metres in the world frame, unless a name says otherwise.
import type { Homography } from "./camera";
import type { Corner, Grid } from "./geometry";
import type { Packed } from "./predictor";
import type { SceneFile } from "./scene_file";

export interface Scene {
  name: string;
  known: boolean;
  y_axis: "up" | "down";
  primary: number;
  corners: Corner[];
}

/** x, y and direction in degrees of each cell, one after the other; curb coordinates. */
export type Cells = number[];
/** from, to, count */
export type Transition = [number, number, number];

export interface ModelData {
  size: number;
  tracks: number;
  episodes: number;
  interval_s: number;
  grid: Grid;
  primitives: { weight: number; cells: Cells }[];
  transitions: Transition[];
}

/** What an episode did; see include/sila/io/reports.hpp. */
export interface Change {
  before: number;
  after: number;
  gone: number[];
  added: Cells[];
  fused: { primitive: number; previous: number[]; incoming: number; cells: Cells }[];
  split: [number, number, number][];
  incoming_split: number;
  transitions: Transition[];
  transitions_gone: [number, number][];
}

export interface EpisodeData {
  number: number;
  tracks: number;
  seconds: number;
  size_before: number;
  size_after: number;
  statistics: { standing?: number; unexplained?: number; change?: Change };
}

export interface Mode {
  weight: number;
  path: number[];
  cov: number[];
  primitives: number[];
}

export interface Prediction {
  t0: number;
  t: number[];
  fallback: boolean;
  novelty: number;
  mhd_m: number;
  best_mhd_m: number;
  constant_mhd_m: number;
  observed: number[];
  truth: number[];
  constant: number[];
  modes: Mode[];
}

export interface Played {
  track: string;
  t: number[];
  xy: number[];
  predictions: Prediction[];
}

export interface Metrics {
  weighted_mhd_m: number;
  ade_m: number;
  fde_m: number;
  nll: number;
  [name: string]: number;
}

export interface Group {
  windows: number;
  fallback_rate: number;
  modes: number;
  horizons: { horizon_s: number; model: Metrics; constant_velocity: Metrics }[];
}

/** Stated probabilities beside what happened, at one horizon. */
export interface ProbabilityScore {
  horizon_s: number;
  windows: number;
  brier: number;
  base_brier: number;
  calibration_error: number;
}
export interface ChangeScore extends ProbabilityScore { rate: number }
export interface OutcomeScore extends ProbabilityScore { rates: Record<string, number>; stated: Record<string, number> }

export interface Evaluation {
  groups: Record<string, Group>;
  /** start, stop */
  changes?: Record<string, ChangeScore[]>;
  /** standing, walking */
  outcomes?: Record<string, OutcomeScore[]>;
  skipped: Record<string, number>;
  tracks: number;
}

export interface Reliability {
  horizon_s: number;
  nominal: number[];
  observed: number[];
}

export interface Worst {
  track: string;
  t0: number;
  mhd_m: number;
  constant_mhd_m: number;
  reason: string;
}

/** Prequential errors of the episodes, and the curve fitted to them: asymptote + slope / sqrt(tracks), of constant velocity. */
export interface LearningCurve {
  points: { tracks: number; windows: number; model_m: number; constant_velocity_m: number }[];
  fit: { asymptote: number; slope: number; text: string; with_more: { tracks: number; ratio: number; lower: number; upper: number } } | null;
}

export interface Rows {
  rows_read: number;
  rows_kept: number;
  [name: string]: unknown;
}

export interface ReportData {
  sila: string;
  written_by?: string;
  name: string;
  bytes?: number;
  scene?: Scene;
  model?: ModelData;
  episodes?: EpisodeData[];
  learning_curve?: LearningCurve;
  configuration?: Record<string, unknown>;
  drawn_tracks?: number[][];
  evaluation?: Evaluation;
  rows?: Rows;
  predictions_scored?: number;
  tracks_scored?: number;
  horizon_s?: number;
  calibration?: Reliability[];
  worst?: Worst[];
  played?: Played[];
  results?: unknown;
  /** A data URL, and the camera that it is of. */
  picture?: string;
  camera?: Homography;
  /** What predicts on the page, or how large it would be. */
  predictor?: Packed | { bytes: number; most_bytes: number };
}

/** What `sila scene edit` puts into its page. */
export interface EditorData {
  sila: string;
  /** What is saved, but for what is edited here. */
  file: SceneFile;
  /** Under which name. */
  file_name: string;
  /** Where the corner comes from. */
  proposal: string;
  tracks: number[][];
  /** Metres on the ground, or pixels of the picture. */
  tracks_in: "ground" | "picture";
  /** A data URL. */
  picture?: string;
  /** The camera of the file. */
  camera?: Homography;
}

/** The data of the page. Throws with a sentence for people if there are none. */
export function readData<Data = ReportData>(text: string): Data {
  const data: unknown = JSON.parse(text);
  if (typeof data !== "object" || data === null || Array.isArray(data)) {
    throw new Error("This page has no data inside. `sila report` and `sila scene edit` make pages that have.");
  }
  return data as Data;
}
