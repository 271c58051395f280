import assert from "node:assert/strict";
import { test } from "node:test";
import type { Point } from "../src/geometry";
import { lacking, type Predicted } from "../src/predictor";
import { extended, rasterOf, walked } from "../src/trail";

const length = (path: readonly Point[]): number => path.slice(1).reduce((sum, p, i) => sum + Math.hypot(p[0] - path[i]![0], p[1] - path[i]![1]), 0);

test("a trail keeps what its reach needs and no more", () => {
  let trail: Point[] = [];
  for (let k = 0; k <= 100; ++k) trail = extended(trail, [0.3 * k, 0], 5);
  assert.deepEqual(trail.at(-1), [30, 0]);
  assert.ok(length(trail) >= 5 && length(trail) < 5.3 + 1e-9, `${length(trail)} m`);
  assert.deepEqual(extended(trail, [30.01, 0], 5), trail, "a point almost at the end changes nothing");
});

test("a walk has the chosen speed, also around a corner, and ends at the end of the trail at time 0", () => {
  const samples = walked([[0, 0], [3, 0], [3, 4]], 2, 3.2, 0.1);
  assert.deepEqual(samples.at(-1), [0, 3, 4]);
  assert.equal(samples.length, 33);
  const [t, x, y] = samples.at(-1 - 25)!;
  assert.ok(Math.abs(t + 2.5) < 1e-9 && Math.abs(x - 2) < 1e-9 && Math.abs(y) < 1e-9, "5 m back is on the first side");
  for (let k = 1; k < samples.length; ++k) assert.ok(samples[k]![0] > samples[k - 1]![0]);
});

test("a trail that is too short, a point or with a point twice is walked as far as it goes", () => {
  assert.deepEqual(walked([], 1, 3, 0.1), []);
  assert.deepEqual(walked([[1, 2]], 1, 3, 0.1), [[0, 1, 2]]);
  assert.equal(walked([[0, 0], [0, 0], [0.55, 0]], 1, 3, 0.1).length, 6);
});

test("the raster holds every mode", () => {
  const at = (x: number, y: number) => ({ weight: 0.5, primitives: [], path: [[x, y]] as Point[], covariances: [[1, 0, 0.25]] as [number, number, number][] });
  const raster = rasterOf({ modes: [at(0, 0), at(10, 5)] } as unknown as Predicted, 0, 50);
  assert.ok(raster.columns <= 51 && raster.rows <= 51);
  assert.deepEqual([raster.x0, raster.y0], [-3.5, -1.75]);
  assert.ok(raster.x0 + raster.cell * (raster.columns - 1) >= 13.5 && raster.y0 + raster.cell * (raster.rows - 1) >= 6.75);
});

test("without WebAssembly there is a sentence on what to do", () => {
  assert.match(lacking({ DecompressionStream: class {} })!, /no WebAssembly.*Firefox.*other sections/);
  assert.match(lacking({ WebAssembly: {} })!, /no DecompressionStream/);
  assert.equal(lacking({ WebAssembly: {}, DecompressionStream: class {} }), undefined);
});
