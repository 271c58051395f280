import assert from "node:assert/strict";
import { test } from "node:test";
import type { Change, EpisodeData, ModelData } from "../src/data";
import { stagesOf } from "../src/history";

const nothing: Change = { before: 0, after: 0, gone: [], added: [], fused: [], split: [], incoming_split: 0, transitions: [], transitions_gone: [] };
const first: Change = { ...nothing, after: 3, added: [[0, 0, 0], [1, 0, 90], [2, 0, 180]], transitions: [[0, 1, 4], [1, 1, 2], [1, 2, 3]] };
const second: Change = { before: 3, after: 4, gone: [1], added: [[5, 5, 0], [6, 5, 0]], fused: [{ primitive: 0, previous: [0], incoming: 1, cells: [0, 0, 10, 0, 1, 10] }],
  split: [[1, 2, 3]], incoming_split: 0, transitions: [[0, 2, 5], [2, 3, 2], [3, 1, 3]], transitions_gone: [] };

function episodes(...changes: (Change | undefined)[]): EpisodeData[] {
  return changes.map((change, i) => ({ number: i + 1, tracks: 20, seconds: 0.1, size_before: 0, size_after: 0, statistics: change ? { change } : {} }));
}
function model(primitives: number, transitions: number): ModelData {
  return { size: 0, tracks: 0, episodes: 2, interval_s: 0.2, grid: { cell: 1, origin: [0, 0], tile_cells: 8 },
    primitives: Array.from({ length: primitives }, () => ({ weight: 1, cells: [] })), transitions: Array.from({ length: transitions }, () => [0, 0, 1]) };
}

test("stages follow what the episodes say", () => {
  const stages = stagesOf(model(4, 3), episodes(first, second));
  assert.ok(stages);
  assert.equal(stages.length, 2);
  const [one, two] = [stages[0]!, stages[1]!];
  assert.deepEqual(one.primitives.map((p) => p.fate), ["added", "added", "added"]);
  assert.deepEqual(two.primitives.map((p) => p.fate), ["fused", "kept", "added", "added"]);
  assert.deepEqual(two.primitives[0]!.cells, [0, 0, 10, 0, 1, 10]);
  assert.equal(two.split, 1);
});

test("a primitive keeps its key when another one before it goes", () => {
  const two = stagesOf(model(4, 3), episodes(first, second))![1]!;
  assert.deepEqual(two.primitives.map((p) => p.key), [0, 2, 3, 4]);
  assert.deepEqual(two.gone.map((p) => p.key), [1]);
});

test("transitions of a primitive that went are gone, others keep their counts", () => {
  const two = stagesOf(model(4, 3), episodes(first, second))![1]!;
  assert.deepEqual(two.transitions, [[0, 2, 5], [2, 3, 2], [3, 1, 3]]);
});

test("an earlier stage is not changed by a later one", () => {
  const stages = stagesOf(model(4, 3), episodes(first, second))!;
  assert.deepEqual(stages[0]!.primitives[0]!.cells, [0, 0, 0]);
  assert.equal(stages[0]!.primitives[0]!.fate, "added");
});

test("changes with a gap, or of another model, give no stages", () => {
  assert.equal(stagesOf(model(4, 3), episodes(first, undefined)), undefined);
  assert.equal(stagesOf(model(4, 3), episodes(second)), undefined);
  assert.equal(stagesOf(model(5, 3), episodes(first, second)), undefined);
  assert.equal(stagesOf(model(0, 0), []), undefined);
});
