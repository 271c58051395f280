import assert from "node:assert/strict";
import { test } from "node:test";
import type { Point } from "../src/geometry";
import { placedBy, type Distances, type Placed } from "../src/distances";

/** A crooked quadrangle on the ground, and where a camera from above its near end sees it: v points down. */
const ground: Point[] = [[0, 0], [8.2, 0], [9.1, 21], [-1.4, 19.5]];
const image: Point[] = [[102, 655], [1180, 640], [890, 210], [330, 215]];
const all = (points: readonly Point[]): number[][] => points.map((p, i) => points.map((q, j) => i === j ? NaN : Math.hypot(p[0] - q[0], p[1] - q[1])));
const without = (distances: Distances, ...pairs: [number, number][]): number[][] => distances.map((row, i) => row.map((d, j) => pairs.some(([a, b]) => (a === i && b === j) || (a === j && b === i)) ? NaN : d));
const placed = (distances: Distances): Placed => { const result = placedBy(distances, image); assert.ok(typeof result !== "string", String(result)); return result; };
const near = (a: Placed, b: readonly Point[], within: number): void => a.points.forEach(([x, y], i) => assert.ok(Math.hypot(x - b[i]![0], y - b[i]![1]) < within, `point ${i + 1}: ${x}, ${y}`));

test("six distances, and any five of them, place four points", () => {
  near(placed(all(ground)), ground, 1e-9);
  assert.ok(placed(all(ground)).residual_m < 1e-9);
  for (const left of [[0, 2], [0, 3], [1, 2], [1, 3], [2, 3]] as [number, number][]) near(placed(without(all(ground), left)), ground, 1e-9);
});

test("turned or mirrored ground gives the same points: the picture tells the side", () => {
  near(placed(all(ground.map(([x, y]) => [5 - y, 7 + x]))), ground, 1e-9);
  near(placed(all(ground.map(([x, y]) => [-x, y]))), ground, 1e-9);
  near(placedBy(all(ground), image.map(([u, v]) => [u, -v])) as Placed, ground.map(([x, y]) => [x, -y]), 1e-9);
});

test("an error of one distance is shared, and shown as the residual", () => {
  const wrong = all(ground);
  wrong[0]![2] = wrong[2]![0] = wrong[0]![2]! + 0.2;
  const result = placed(wrong);
  assert.ok(result.residual_m > 0.02 && result.residual_m < 0.1, `${result.residual_m} m`);
  near(result, ground, 0.4);  // at this shape 0.3 m for 0.2 m
});

test("five points need seven distances, and more are checked", () => {
  const five = [...ground, [4, 9] as Point];
  const seen = [...image, [620, 380] as Point];
  const seven = without(all(five), [1, 3], [4, 0], [4, 1]);
  near(placedBy(seven, seen) as Placed, five, 1e-9);
});

test("distances that contradict one another or are missing are named", () => {
  const long = all(ground);
  long[1]![2] = long[2]![1] = 40;
  assert.equal(placedBy(long, image), "the distances contradict one another: points 2 and 3 are 40 m apart, but only 31.09 m by way of point 1");
  // Points 1, 2, 3 and 1, 3, 4 agree; no place of point 5 is 1 m from 2 and 1 m from 4, which are 21.7 m apart.
  const far = without(all([...ground, [4, 9]]), [1, 3], [4, 0], [4, 2]);
  for (const i of [1, 3]) far[i]![4] = far[4]![i] = 1;
  assert.equal(placedBy(far, [...image, [620, 380]]), "the distances contradict one another: no place fits those to point 5");
  assert.equal(placedBy(without(all(ground), [0, 1]), image), "the distance from point 1 to point 2 is missing");
  assert.equal(placedBy(without(all(ground), [0, 3], [1, 3]), image), "point 4 needs its distances to two other points");
  const negative = all(ground);
  negative[0]![1] = negative[1]![0] = -1;
  assert.equal(placedBy(negative, image), "a distance is not positive");
});
