import assert from "node:assert/strict";
import { test } from "node:test";
import { between, ellipseOf, ellipseOutline, ellipseScale, positionAt, toCurb, toWorld, type Corner } from "../src/geometry";

const corner: Corner = { name: "c", origin: [3, -2], axis_1: [0.8, 0.6], axis_2: [-0.2, 0.98], unit_m: [2.5, 3], widths_m: [2.5, 3] };

test("curb coordinates and metres are each other's inverse", () => {
  for (const q of [[0, 0], [1, 0], [-2, 5], [0.3, 7]] as [number, number][]) {
    const back = toCurb(corner, toWorld(corner, q));
    assert.ok(Math.hypot(back[0] - q[0], back[1] - q[1]) < 1e-12);
  }
  assert.deepEqual(toWorld(corner, [0, 0]), [3, -2]);
});

test("the ellipse of a share holds that share of a Gaussian", () => {
  for (const share of [0.5, 0.9]) {
    const scale = ellipseScale(share);
    // Mass of a 2-D standard normal within a radius, summed over rings.
    let mass = 0;
    const step = 1e-4;
    for (let r = step / 2; r < scale; r += step) mass += r * Math.exp(-r * r / 2) * step;
    assert.ok(Math.abs(mass - share) < 1e-4);
  }
});

test("an ellipse has the axes of its covariance", () => {
  const { rx, ry, angle } = ellipseOf(2.5, 1.5, 2.5, 1 - Math.exp(-0.5));  // scale 1; eigenvalues 4 and 1 at 45 degrees
  assert.ok(Math.abs(rx - 2) < 1e-12 && Math.abs(ry - 1) < 1e-12 && Math.abs(angle - Math.PI / 4) < 1e-12);
});

test("time between samples is interpolated and held at the ends", () => {
  assert.deepEqual(between([0, 1, 3], 2), { i: 1, f: 0.5 });
  assert.deepEqual(positionAt([0, 1, 3], [0, 0, 1, 1, 3, 5], 2), [2, 3]);
  assert.deepEqual(positionAt([0, 1, 3], [0, 0, 1, 1, 3, 5], 9), [3, 5]);
  assert.deepEqual(positionAt([0, 1, 3], [0, 0, 1, 1, 3, 5], -9), [0, 0]);
});

test("the outline of an ellipse lies on it", () => {
  for (const [x, y] of ellipseOutline({ rx: 3, ry: 1, angle: Math.PI / 2 })) assert.ok(Math.abs(x ** 2 + (y / 3) ** 2 - 1) < 1e-12);
});
