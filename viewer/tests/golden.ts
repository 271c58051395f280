// Whether the predictor of a report gives the predictions of the program, within 1e-12 of max(1, |number|).
//   node build/browser/golden.mjs REPORT.html TRACKS.csv PREDICTIONS.ndjson [PREDICTOR]
// PREDICTIONS are those of `sila predict --digits 17` on TRACKS; PREDICTOR (deflated WebAssembly in base64) is taken instead of that in the report.
import assert from "node:assert/strict";
import { readFile } from "node:fs/promises";
import { deflateSync, inflateSync } from "node:zlib";
import { readData } from "../src/data";
import { Predictor } from "../src/predictor";

interface Changes { within_s: number[]; probability: number[] }
interface Line { track: string; t0: number; novelty: number; starts?: Changes; stops?: Changes; modes: { weight: number; t?: number[]; x: number[]; y: number[]; cov: number[][]; primitives: number[] }[]; regions?: { level: number[] }[] }

const [report, tracks, predictions, other] = await Promise.all(process.argv.slice(2).map((path) => readFile(path, "utf8")));
const packed = readData(/<script id="data"[^>]*>(.*?)<\/script>/s.exec(report!)![1]!).predictor;
assert.ok(packed && "wasm" in packed, "the report has no predictor");
const predictor = await Predictor.load({ ...packed, wasm: other ?? packed.wasm });
const cut = deflateSync(inflateSync(Buffer.from(packed.model, "base64")).subarray(0, -8)).toString("base64");
await assert.rejects(Predictor.load({ wasm: other ?? packed.wasm, model: cut }), /the bytes end too early/);

const samples = new Map<string, [number, number, number][]>();
const [header, ...rows] = tracks!.trim().split("\n");
const column = (name: string): number => header!.split(",").indexOf(name);
const [id, t, x, y] = ["track_id", "t", "x", "y"].map(column) as [number, number, number, number];
for (const row of rows) {
  const cells = row.split(",");
  const track = samples.get(cells[id]!) ?? [];
  samples.set(cells[id]!, track);
  track.push([Number(cells[t]), Number(cells[x]), Number(cells[y])]);
}

const longestGap_s = 1;  // clean.max_gap_s: there the program begins another track
let [worst, numbers, lines, milliseconds] = [0, 0, 0, 0];
for (const text of predictions!.trim().split("\n")) {
  const line = JSON.parse(text) as Line;
  const until = samples.get(line.track)!.filter(([time]) => time <= line.t0);
  const gaps = until.flatMap(([time], i) => i > 0 && time - until[i - 1]![0] > longestGap_s ? [i] : []);
  const seen = until.slice(gaps.at(-1) ?? 0);
  const began = performance.now();
  const found = predictor.predict(seen);
  milliseconds += performance.now() - began;
  const changes = line.starts ?? line.stops;
  const expected = [line.novelty, ...line.modes[0]!.t!, ...changes?.probability ?? [], ...line.modes.flatMap((m) => [m.weight, ...m.x, ...m.y, ...m.cov.flat(), ...m.primitives]), ...(line.regions ?? []).flatMap((r) => r.level)];
  const given = [found.novelty, ...found.t, ...found.changes.filter((_, i) => changes?.within_s.includes(found.t[i]!)), ...found.modes.flatMap((m) => [m.weight, ...m.path.map((p) => p[0]), ...m.path.map((p) => p[1]), ...m.covariances.flat(), ...m.primitives]), ...found.regions.flatMap((r) => r.levels)];
  assert.equal(given.length, expected.length, `track ${line.track} at ${line.t0}: another shape`);
  expected.forEach((number, i) => { worst = Math.max(worst, Math.abs(number - given[i]!) / Math.max(1, Math.abs(number))); });
  [numbers, lines] = [numbers + expected.length, lines + 1];
}
assert.ok(lines > 100, `${lines} predictions are too few`);
console.log(`golden: ${lines} predictions, ${numbers} numbers, largest difference ${worst.toExponential(1)}, ${(milliseconds / lines).toFixed(2)} ms each`);
assert.ok(worst <= 1e-12, `the largest difference is ${worst}`);
