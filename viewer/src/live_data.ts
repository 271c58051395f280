// The messages of the live page, one JSON object each. Lengths are metres in the world frame.
import type { Homography } from "./camera";
import type { ModelData, Scene } from "./data";
import type { Bounds } from "./place";

export interface LiveMode { weight: number; path: number[]; primitives: number[] }
export interface LivePedestrian { id: string; name: string; trail: number[]; novelty?: number; fallback?: boolean; modes?: LiveMode[] }
export interface HorizonError { windows: number; mhd_m: number; constant_mhd_m: number }

export interface Hello { kind: "hello"; sila: string; scene: Scene; model: ModelData; picture?: string; camera?: Homography }
/** `scene`: that of the model, once it has learnt. */
export interface ModelMessage { kind: "model"; model: ModelData; scene?: Scene }
/** `count`: of all pedestrians; the service sends some of them. */
export interface Frame { kind: "frame"; count: number; pedestrians: LivePedestrian[] }
export interface Metrics {
  kind: "metrics";
  horizons_s: number[];
  all: HorizonError[];
  moving: HorizonError[];
  nominal: number[];
  coverage: number[][];
  scored_pedestrians: number;
  novelty: number;
  drift: { known: boolean; alarm: boolean; error_m: number; reference_m: number; half_width_m: number };
  detections: number;
  predictions: number;
  dropped: number;
  rejected: number;
  scored: number;
  pedestrians: number;
  learning: boolean;
  tracks_waiting: number;
  last_error: string;
  size: number;
  episodes: number;
  tracks: number;
  learning_curve: string;
}
export type Message = Hello | ModelMessage | Frame | Metrics;

/** A point of the curves. */
export interface Moment { at: number; mhd_m: number; constant_mhd_m: number; size: number; episodes: number }

/** `moments` and one more; beyond `limit` every second one is removed, so that a page left open for a week stays small. */
export function appended(moments: readonly Moment[], next: Moment, limit = 600): Moment[] {
  const all = [...moments, next];
  return all.length <= limit ? all : all.filter((_, i) => i % 2 === 0 || i === all.length - 1);
}

/** The point of these metrics; none while no moving pedestrian is scored. */
export function momentOf(metrics: Metrics, at: number): Moment | undefined {
  const last = metrics.moving.at(-1);
  if (!last || last.windows === 0) return undefined;
  return { at, mhd_m: last.mhd_m, constant_mhd_m: last.constant_mhd_m, size: metrics.size, episodes: metrics.episodes };
}

/** Highlight of each primitive: the largest weight of a mode that visits it. */
export function lit(pedestrians: readonly LivePedestrian[]): Map<number, number> {
  const weights = new Map<number, number>();
  for (const pedestrian of pedestrians) for (const mode of pedestrian.modes ?? []) for (const primitive of mode.primitives) weights.set(primitive, Math.max(weights.get(primitive) ?? 0, mode.weight));
  return weights;
}

/** The position of a pedestrian farther from the map is likely faulty [m]. */
const far_m = 200;

/**
 * Bounds of trails. They only grow, with a margin, so that the map rarely moves. Trails far away are left out; if most are far away,
 * the bounds begin anew with them.
 */
export function grown(box: Bounds | undefined, seen: readonly { trail: readonly number[] }[], margin: number): Bounds | undefined {
  let next = box;
  const far = [];
  for (const { trail } of seen) {
    const [lastX, lastY] = [trail.at(-2)!, trail.at(-1)!];
    if (next && (lastX < next.x0 - far_m || lastX > next.x1 + far_m || lastY < next.y0 - far_m || lastY > next.y1 + far_m)) {
      far.push({ trail });
      continue;
    }
    for (let i = 0; i + 1 < trail.length; i += 2) {
      const [x, y] = [trail[i]!, trail[i + 1]!];
      if (next && x >= next.x0 && x <= next.x1 && y >= next.y0 && y <= next.y1) continue;
      next = next ? { x0: Math.min(next.x0, x - margin), y0: Math.min(next.y0, y - margin), x1: Math.max(next.x1, x + margin), y1: Math.max(next.y1, y + margin) }
        : { x0: x - margin, y0: y - margin, x1: x + margin, y1: y + margin };
    }
  }
  return far.length > seen.length / 2 ? grown(undefined, far, margin) : next;
}
