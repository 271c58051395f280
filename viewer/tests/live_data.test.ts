import assert from "node:assert/strict";
import { test } from "node:test";
import { appended, grown, lit, momentOf, type Metrics, type Moment } from "../src/live_data";

const moment = (at: number): Moment => ({ at, mhd_m: 1, constant_mhd_m: 2, size: 3, episodes: 4 });

test("a page left open keeps the first and the last moment and never too many", () => {
  let moments: Moment[] = [];
  for (let i = 0; i < 5000; ++i) {
    moments = appended(moments, moment(i), 100);
    assert.ok(moments.length <= 100);
    assert.equal(moments[0]!.at, 0);
    assert.equal(moments.at(-1)!.at, i);
  }
  assert.ok(moments.every((m, i) => i === 0 || m.at > moments[i - 1]!.at));
});

test("no scored pedestrian makes no moment", () => {
  const metrics = { moving: [], size: 1, episodes: 1 } as unknown as Metrics;
  assert.equal(momentOf(metrics, 1), undefined);
  assert.equal(momentOf({ ...metrics, moving: [{ windows: 0, mhd_m: 0, constant_mhd_m: 0 }] }, 1), undefined);
  assert.equal(momentOf({ ...metrics, moving: [{ windows: 2, mhd_m: 0.5, constant_mhd_m: 1 }] }, 1)!.mhd_m, 0.5);
});

test("a primitive is highlighted by the most likely mode that visits it", () => {
  const pedestrian = (weight: number, primitives: number[]) => ({ id: "1:a", name: "a", trail: [0, 0], modes: [{ weight, path: [], primitives }] });
  assert.deepEqual([...lit([pedestrian(0.2, [1, 2]), pedestrian(0.7, [2])])], [[1, 0.2], [2, 0.7]]);
});

test("the box of the map grows only when a pedestrian leaves it", () => {
  const at = (x: number, y: number) => [{ id: "1:a", name: "a", trail: [x, y] }];
  const box = grown(undefined, at(0, 0), 5)!;
  assert.deepEqual(box, { x0: -5, y0: -5, x1: 5, y1: 5 });
  assert.equal(grown(box, at(4, -4), 5), box);
  assert.deepEqual(grown(box, at(8, 0), 5), { x0: -5, y0: -5, x1: 13, y1: 5 });
});

test("one position far away does not enlarge the map, most positions move it", () => {
  const at = (...xs: number[]) => xs.map((x) => ({ trail: [x, 0] }));
  const box = { x0: -5, y0: -5, x1: 5, y1: 5 };
  assert.equal(grown(box, at(0, 1e6), 5), box);
  assert.deepEqual(grown(undefined, at(1e6, 0, 1), 5), { x0: -5, y0: -5, x1: 5, y1: 5 });
  assert.deepEqual(grown(box, at(1e6), 5), { x0: 1e6 - 5, y0: -5, x1: 1e6 + 5, y1: 5 });
});
