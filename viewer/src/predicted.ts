// Which prediction is shown, and how far off it is. Pure.
import type { Played, Prediction } from "./data";
import { positionAt } from "./geometry";

export type Renew = "often" | "horizon";

/** The prediction that is shown at a moment: the latest one, or the one that is still being scored. From `anchor` on, that of `anchor` is the first. */
export function currentPrediction(predictions: readonly Prediction[], now: number, renew: Renew, anchor = -Infinity): Prediction | undefined {
  let shown: Prediction | undefined;
  for (const prediction of predictions) {
    if (now >= anchor - 1e-9 && prediction.t0 < anchor - 1e-9) continue;
    if (prediction.t0 > now + 1e-9) break;
    const end = shown ? shown.t0 + (shown.t.at(-1) ?? 0) : -Infinity;
    if (renew === "often" || !shown || prediction.t0 >= end - 1e-9) shown = prediction;
  }
  return shown;
}

/** Distance of the most likely mode and of constant velocity from the truth, `ahead` seconds after t0 [m]. */
export function errorsAt(prediction: Prediction, ahead: number): { model: number; constant: number } {
  const times = [0, ...prediction.t];
  const start = prediction.observed.slice(-2);
  const where = (path: readonly number[]) => positionAt(times, [...start, ...path], ahead);
  const truth = where(prediction.truth);
  const distance = (p: readonly [number, number]) => Math.hypot(p[0] - truth[0], p[1] - truth[1]);
  return { model: distance(where(prediction.modes[0]?.path ?? [])), constant: distance(where(prediction.constant)) };
}

/** Where to begin: several modes of similar weight, one of them right. */
export function mostTelling(played: readonly Played[]): { person: Played; t0: number } | undefined {
  let best: { person: Played; t0: number; worth: number } | undefined;
  for (const person of played) {
    for (const { t0, modes, mhd_m, constant_mhd_m } of person.predictions) {
      const spread = 1 - modes.reduce((sum, mode) => sum + mode.weight ** 2, 0);
      const worth = (0.05 + spread) * Math.max(0, constant_mhd_m - mhd_m);
      if (!best || worth > best.worth) best = { person, t0, worth };
    }
  }
  return best;
}
