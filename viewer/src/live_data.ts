// What `sila serve` sends to its live page (docs/live.md), one JSON object a message. Lengths are metres in the world frame.
import type { ModelData, Scene } from "./data";

export interface LiveMode { weight: number; path: number[]; primitives: number[] }
export interface LivePerson { id: string; name: string; trail: number[]; novelty?: number; fallback?: boolean; modes?: LiveMode[] }
export interface HorizonError { windows: number; mhd_m: number; constant_mhd_m: number }

export interface Hello { kind: "hello"; sila: string; scene: Scene; model: ModelData }
export interface ModelMessage { kind: "model"; model: ModelData }
export interface Frame { kind: "frame"; about: number; people: LivePerson[] }
export interface Facts {
  kind: "facts";
  horizons_s: number[];
  all: HorizonError[];
  moving: HorizonError[];
  nominal: number[];
  coverage: number[][];
  remembered: number;
  novelty: number;
  drift: { known: boolean; alarm: boolean; error_m: number; reference_m: number; half_width_m: number };
  detections: number;
  predictions: number;
  dropped: number;
  refused: number;
  scored: number;
  pedestrians: number;
  learning: boolean;
  tracks_waiting: number;
  last_error: string;
  size: number;
  episodes: number;
  tracks: number;
}
export type Message = Hello | ModelMessage | Frame | Facts;

/** A point of the curves: what was true when so many predictions had been judged. */
export interface Moment { at: number; mhd_m: number; constant_mhd_m: number; size: number; episodes: number }

/** `moments` and one more, thinned to half where there are too many, so that a page left open for a week stays small. */
export function remembered(moments: readonly Moment[], next: Moment, most = 600): Moment[] {
  const all = [...moments, next];
  return all.length <= most ? all : all.filter((_, i) => i % 2 === 0 || i === all.length - 1);
}

/** The moment of these facts; nothing while nobody who moved was judged. */
export function momentOf(facts: Facts, at: number): Moment | undefined {
  const last = facts.moving.at(-1);
  if (!last || last.windows === 0) return undefined;
  return { at, mhd_m: last.mhd_m, constant_mhd_m: last.constant_mhd_m, size: facts.size, episodes: facts.episodes };
}

/** How strongly each primitive is lit: the largest weight of a mode that visits it. */
export function lit(people: readonly LivePerson[]): Map<number, number> {
  const weights = new Map<number, number>();
  for (const person of people) for (const mode of person.modes ?? []) for (const primitive of mode.primitives) weights.set(primitive, Math.max(weights.get(primitive) ?? 0, mode.weight));
  return weights;
}

/** Where people walk: a box that grows with whoever comes, so that the map is still most of the time. */
export function grown(box: { x0: number; y0: number; x1: number; y1: number } | undefined, people: readonly LivePerson[], margin: number): { x0: number; y0: number; x1: number; y1: number } | undefined {
  let next = box;
  for (const { trail } of people) {
    for (let i = 0; i + 1 < trail.length; i += 2) {
      const [x, y] = [trail[i]!, trail[i + 1]!];
      if (next && x >= next.x0 && x <= next.x1 && y >= next.y0 && y <= next.y1) continue;
      next = next ? { x0: Math.min(next.x0, x - margin), y0: Math.min(next.y0, y - margin), x1: Math.max(next.x1, x + margin), y1: Math.max(next.y1, y + margin) }
        : { x0: x - margin, y0: y - margin, x1: x + margin, y1: y + margin };
    }
  }
  return next;
}
