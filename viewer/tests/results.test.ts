import assert from "node:assert/strict";
import { test } from "node:test";
import { constantOf, curvesOf, rowsOf } from "../src/results";

const scored = (mhd: number) => ({ here: { moving: { windows: 9, model: { weighted_mhd_m: mhd }, constant_velocity: { weighted_mhd_m: 0.8 } } } });
const results = { curves: [
  { scene: "here", method: "sila", trial: 1, order: 0, checkpoints: [{ episode: 1, tracks: 20, size: 10, seconds: 1 }, { episode: 2, tracks: 40, size: 14, seconds: 1, places: scored(0.6) }] },
  { scene: "here", method: "sila", trial: 2, order: 0, checkpoints: [{ episode: 1, tracks: 20, size: 12, seconds: 3 }, { episode: 2, tracks: 40, size: 18, seconds: 1, places: scored(0.4) }] },
  { scene: "here", method: "batch", trial: 1, order: 0, checkpoints: [{ episode: 1, tracks: 40, size: 9, seconds: 5, places: scored(0.5) }] },
] };

test("curves are means over trials with their standard deviation", () => {
  const [sila, batch] = curvesOf(rowsOf(results), "here", "size");
  assert.deepEqual(sila!.points.map((p) => [p.tracks, p.mean, p.trials]), [[20, 11, 2], [40, 16, 2]]);
  assert.ok(Math.abs(sila!.points[1]!.high - 16 - Math.sqrt(8)) < 1e-12);
  assert.deepEqual(batch!.points.map((p) => [p.tracks, p.mean, p.low]), [[40, 9, 9]]);
});

test("episodes that were not scored are not in the curve of errors", () => {
  const [sila] = curvesOf(rowsOf(results), "here", "error_m");
  assert.deepEqual(sila!.points.map((p) => p.tracks), [40]);
  assert.ok(Math.abs(sila!.points[0]!.mean - 0.5) < 1e-12);
  assert.ok(Math.abs(constantOf(rowsOf(results), "here")! - 0.8) < 1e-12);
});

test("what is no result has no rows", () => {
  for (const other of [undefined, null, 3, "x", [], {}, { curves: 7 }]) assert.deepEqual(rowsOf(other), []);
});
