import assert from "node:assert/strict";
import { test } from "node:test";
import type { Prediction } from "../src/data";
import { currentPrediction, errorsAt } from "../src/predicted";

const at = (t0: number): Prediction => ({ t0, t: [1, 2], fallback: false, novelty: 0, mhd_m: 0, best_mhd_m: 0, constant_mhd_m: 0, observed: [-1, 0, 0, 0], truth: [1, 0, 2, 0],
  constant: [1, 1, 2, 2], modes: [{ weight: 1, path: [0, 0, 0, 0], cov: [1, 0, 1, 1, 0, 1], primitives: [] }] });
const predictions = [at(10), at(11), at(12), at(13)];

test("renewed often, the latest prediction is shown", () => {
  assert.equal(currentPrediction(predictions, 9.9, "often"), undefined);
  assert.equal(currentPrediction(predictions, 11.5, "often")!.t0, 11);
});

test("renewed at the horizon, a prediction stays until it is over", () => {
  assert.deepEqual([10, 11.5, 12, 13.9].map((now) => currentPrediction(predictions, now, "horizon")!.t0), [10, 10, 12, 12]);
});

test("a prediction that was asked for is shown, whatever came before it", () => {
  assert.equal(currentPrediction(predictions, 11.5, "horizon", 11)!.t0, 11);
  assert.equal(currentPrediction(predictions, 13.2, "horizon", 11)!.t0, 13);
  assert.equal(currentPrediction(predictions, 10.5, "horizon", 11)!.t0, 10);
});

test("errors are distances at the same moment", () => {
  const { model, constant } = errorsAt(at(0), 1.5);
  assert.ok(Math.abs(model - 1.5) < 1e-12 && Math.abs(constant - 1.5) < 1e-12);
  assert.deepEqual(errorsAt(at(0), 0), { model: 0, constant: 0 });
});
