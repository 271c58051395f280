// What is drawn as a walk. Pure.
import type { Point } from "./geometry";
import type { Predicted, Raster } from "./predictor";

export type Sample = [number, number, number];

/** The path with one more point if that is `least_m` from its end, without what lies more than `reach_m` back from there. */
export function extended(trail: readonly Point[], point: Point, reach_m: number, least_m = 0.05): Point[] {
  const end = trail.at(-1);
  if (end && Math.hypot(point[0] - end[0], point[1] - end[1]) < least_m) return [...trail];
  const all = [...trail, point];
  let [first, length] = [all.length - 1, 0];
  while (first > 0 && length < reach_m) {
    length += Math.hypot(all[first]![0] - all[first - 1]![0], all[first]![1] - all[first - 1]![1]);
    --first;
  }
  return all.slice(first);
}

/** The last `seconds` of a path that is walked at a constant speed, with a sample each `interval_s`; the last one is at its end, at time 0. */
export function walked(trail: readonly Point[], speed_mps: number, seconds: number, interval_s: number): Sample[] {
  const samples: Sample[] = [];
  let [i, along] = [trail.length - 1, 0];  // the point behind, and how far it is from the end [m]
  const end = trail[i];
  if (!end) return samples;
  samples.push([0, ...end]);
  let [before, here]: [Point, Point] = [end, end];
  let length = 0;
  for (let k = 1; k * interval_s <= seconds + 1e-9; ++k) {
    const due = k * interval_s * speed_mps;
    while (along + length < due && i > 0) {
      along += length;
      [before, here] = [trail[i - 1]!, trail[i]!];
      length = Math.hypot(here[0] - before[0], here[1] - before[1]);
      --i;
    }
    if (along + length < due || length === 0) break;
    const share = (due - along) / length;
    samples.unshift([-k * interval_s, here[0] + share * (before[0] - here[0]), here[1] + share * (before[1] - here[1])]);
  }
  return samples;
}

/** A raster of at most `most` points along its longer side around all modes at a step. */
export function rasterOf(prediction: Predicted, step: number, most: number): Raster {
  let [x0, y0, x1, y1] = [Infinity, Infinity, -Infinity, -Infinity];
  for (const { path, covariances } of prediction.modes) {
    const [[x, y], [xx, , yy]] = [path[step]!, covariances[step]!];
    const [w, t] = [3.5 * Math.sqrt(xx), 3.5 * Math.sqrt(yy)];
    [x0, x1, y0, y1] = [Math.min(x0, x - w), Math.max(x1, x + w), Math.min(y0, y - t), Math.max(y1, y + t)];
  }
  const cell = Math.max(x1 - x0, y1 - y0) / (most - 1);
  return { x0, y0, cell, columns: Math.floor((x1 - x0) / cell) + 2, rows: Math.floor((y1 - y0) / cell) + 2 };
}
