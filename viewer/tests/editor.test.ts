import assert from "node:assert/strict";
import { test } from "node:test";
import { applied, determinant, fitCamera, inverse, type CameraFit, type PointPair } from "../src/camera";
import type { Point } from "../src/geometry";
import { distanceFromCurb, drawnCorner, mapped, medianOf, moved, pointBeside, pointsIn, sceneText, sine, squareCorner, turned, widened, type SceneFile } from "../src/scene_file";

const near = (a: readonly number[], b: readonly number[], within = 1e-9): void => a.forEach((value, i) => assert.ok(Math.abs(value - b[i]!) < within, `${a} is not ${b}`));
/** A street seen from above its near end. */
const pairs: PointPair[] = ([[[102, 655], [0, 0]], [[1180, 640], [8.2, 0]], [[890, 210], [8.2, 21]], [[330, 215], [0, 21]]] as [Point, Point][]).map(([image, ground]) => ({ image, ground }));
const corner = { ...squareCorner([4, 2], "up"), axis_2: [-0.6, 0.8] as Point };

test("a camera of four points puts each where it is, and back", () => {
  const fit = fitCamera(pairs);
  assert.ok(typeof fit !== "string");
  for (const { image, ground } of pairs) {
    near(applied(fit.camera, image)!, ground, 1e-6);
    near(applied(inverse(fit.camera), ground)!, image, 1e-3);
  }
  near(fit.residuals_m, [0, 0, 0, 0], 1e-6);
  assert.ok(determinant(fit.camera) < 0, "y of the ground is counter-clockwise of x, seen from above");
  assert.equal(applied(fit.camera, [640, -400]), undefined, "above the horizon");
});

test("more than four points are fitted, and a wrong one has the largest residual", () => {
  const { camera } = fitCamera(pairs) as CameraFit;
  const more: PointPair[] = [[500, 500], [700, 300], [600, 400], [900, 550]].map((image) => ({ image: image as Point, ground: applied(camera, image as Point)! }));
  more[2]!.ground[0] += 0.5;
  const { residuals_m } = fitCamera([...pairs, ...more]) as CameraFit;
  assert.equal(residuals_m.indexOf(Math.max(...residuals_m)), 6);
  assert.ok(residuals_m[6]! > 0.1 && residuals_m[6]! < 0.5);
});

test("points that give no camera are named as such", () => {
  assert.equal(fitCamera(pairs.slice(0, 3)), "3 of 4 points");
  assert.match(fitCamera([0, 1, 2, 3].map((i) => ({ image: [i, 2 * i], ground: [i, i] }))) as string, /one line/);
  assert.match(fitCamera(pairs.map((pair) => ({ ...pair, image: [7, 7] }))) as string, /repeat/);
  const crossed = pairs.map((pair, i) => ({ image: pair.image, ground: pairs[[0, 2, 1, 3][i]!]!.ground }));
  assert.match(fitCamera(crossed) as string, /horizon/);
});

test("a corner is moved, turned and widened", () => {
  assert.deepEqual(moved(corner, [1.23456, -2]).origin, [1.235, -2]);
  assert.deepEqual(turned(corner, 1, [4 + 4, 2 + 3])!.axis_1, [0.8, 0.6]);
  assert.equal(turned(corner, 1, pointBeside(corner, 2, 5, 0)), undefined, "no curb along the other");
  assert.equal(turned(corner, 1, corner.origin), undefined);
  const wide = widened(corner, 1, 4.123);
  assert.deepEqual([wide.sidewalk_width_1_m, wide.sidewalk_width_2_m, wide.sidewalk_width_m], [4.12, 3, 3.56]);
  assert.equal(widened(corner, 2, -5).sidewalk_width_2_m, 0.3);
  for (const axis of [1, 2] as const) assert.ok(Math.abs(distanceFromCurb(corner, axis, pointBeside(corner, axis, 7, 2.5)) - 2.5) < 1e-12);
  assert.ok(distanceFromCurb(corner, 1, [4, 3]) > 0, "the block is between the curbs");
  near(drawnCorner(corner).unit_m, [3 / 0.8, 3 / 0.8]);
  assert.ok(sine(squareCorner([0, 0], "up")) > 0 && sine(squareCorner([0, 0], "down")) < 0);
});

test("a file keeps what is not edited", () => {
  const file: SceneFile = { name: "here", y_axis: "up", note: "kept", corners: [], files: [{ path: "a.csv" }], camera: { homography: [[1, 0, 0]] } };
  const other = { ...squareCorner([9, 9], "up"), name: "other", primary: false };
  const text = sceneText(file, [other, corner], []);
  const saved = JSON.parse(text) as SceneFile & typeof corner & { primary_corner: string };
  assert.deepEqual([saved.origin, saved["primary_corner"], saved.corners.length, saved["note"], saved.name], [[4, 2], "corner", 2, "kept", "here"]);
  assert.deepEqual(saved.camera, file.camera);
  assert.match(text, /"origin": \[4, 2\]/);
  const withPoints = JSON.parse(sceneText(file, [corner], pairs)) as SceneFile;
  assert.deepEqual(Object.keys(withPoints.camera!), ["image_points", "ground_points"]);
  assert.deepEqual(pointsIn(withPoints), pairs);
});

test("uncertainties of a proposal are dropped with its corner", () => {
  const file: SceneFile = { name: "here", y_axis: "up", origin_uncertainty_m: 0.4, axis_uncertainty_deg: 2, tracks: 30, corners: [{ ...corner, primary: true }] };
  const kept = (edited: typeof corner): unknown[] => { const saved = JSON.parse(sceneText(file, [edited], [])) as SceneFile; return [saved["origin_uncertainty_m"], saved["axis_uncertainty_deg"], saved["tracks"]]; };
  assert.deepEqual(kept({ ...corner, name: "north" }), [0.4, 2, 30]);
  for (const edited of [moved(corner, [5, 2]), turned(corner, 1, [8, 3])!, widened(corner, 2, 4)]) assert.deepEqual(kept(edited), [undefined, undefined, undefined]);
});

test("paths are mapped and have a median", () => {
  assert.deepEqual(mapped([1, 2, 3, 4], ([x, y]) => x > 2 ? [y, x] : undefined), [4, 3]);
  assert.deepEqual(medianOf([[0, 0, 1, 10], [2, 5]]), [1, 5]);
});
