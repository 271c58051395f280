// The predictor of sila as WebAssembly (wasm/predictor.cpp), and what it says. Draws nothing.
import type { Point } from "./geometry";

/** How the page has it: deflated, in base64. */
export interface Packed { wasm: string; model: string }

export interface PredictedMode { weight: number; primitives: number[]; path: Point[]; covariances: [number, number, number][] }
/** The region of a probability: where the score is at most the level of a step. */
export interface Region { probability: number; levels: number[] }
export interface Predicted { novelty: number; fallback: boolean; t: number[]; changes: number[]; modes: PredictedMode[]; regions: Region[] }
/** Curb frame of the site: metres; see Corner in data.ts. */
export interface Frame { origin: Point; axis_1: Point; axis_2: Point; unit_m: Point }
/** Points x0 + cell i, y0 + cell k for each i below columns and k below rows. */
export interface Raster { x0: number; y0: number; cell: number; columns: number; rows: number }

interface Exports {
  memory: WebAssembly.Memory;
  _initialize(): void;
  sila_allocate(bytes: number): number;
  sila_load(bytes: number, count: number): number;
  sila_predict(samples: number, count: number): number;
  sila_scores(step: number, x: number, y: number, cell: number, columns: number, rows: number): number;
}

/** What the browser lacks, as a sentence that says what to do; nothing if it has all. */
export function lacking(scope: { WebAssembly?: unknown; DecompressionStream?: unknown } = globalThis): string | undefined {
  const missing = typeof scope.WebAssembly !== "object" ? "WebAssembly" : typeof scope.DecompressionStream !== "function" ? "DecompressionStream" : undefined;
  return missing && `This browser has no ${missing}, or it is switched off. Allow it in the settings, or open this file in a Firefox, Chrome, Edge or Safari of 2023 or later; all other sections work without it.`;
}

async function unpacked(text: string): Promise<Uint8Array<ArrayBuffer>> {
  const bytes = Uint8Array.from(atob(text), (c) => c.charCodeAt(0));
  return new Uint8Array(await new Response(new Blob([bytes]).stream().pipeThrough(new DecompressionStream("deflate"))).arrayBuffer());
}

export class Predictor {
  private constructor(private readonly wasm: Exports, readonly frame: Frame, readonly interval_s: number, readonly observe_s: number,
                      private readonly samples: number, private readonly mostSamples: number) {}

  /** Throws with a sentence if the browser or the content does not allow it. */
  static async load(packed: Packed): Promise<Predictor> {
    const [code, model] = await Promise.all([unpacked(packed.wasm), unpacked(packed.model)]);
    let memory: WebAssembly.Memory | undefined;
    const sila_fail = (text: number): never => {
      const bytes = new Uint8Array(memory!.buffer, text);
      throw new Error(new TextDecoder().decode(bytes.slice(0, bytes.indexOf(0))));
    };
    // The C library would write messages and end the process: there is nowhere to write to.
    const none = (): number => 52;  // ENOSYS
    const system = new Proxy({}, { get: (_, name) => name === "proc_exit" ? (): never => { throw new Error("the predictor ended"); } : none });
    const { instance } = await WebAssembly.instantiate(code, { env: { sila_fail }, wasi_snapshot_preview1: system as WebAssembly.ModuleImports });
    const wasm = instance.exports as unknown as Exports;
    memory = wasm.memory;
    wasm._initialize();
    const bytes = wasm.sila_allocate(model.length);
    new Uint8Array(wasm.memory.buffer).set(model, bytes);
    const at = wasm.sila_load(bytes, model.length);
    const answer = new Float64Array(wasm.memory.buffer, at, 10);
    const pair = (i: number): Point => [answer[i]!, answer[i + 1]!];
    const mostSamples = 1024;
    return new Predictor(wasm, { origin: pair(0), axis_1: pair(2), axis_2: pair(4), unit_m: pair(6) }, answer[8]!, answer[9]!, wasm.sila_allocate(24 * mostSamples), mostSamples);
  }

  /** At the last of samples (time [s], x and y [m], times growing); of many the last ones count. */
  predict(samples: readonly [number, number, number][]): Predicted {
    const used = samples.slice(-this.mostSamples);
    new Float64Array(this.wasm.memory.buffer, this.samples, 3 * used.length).set(used.flat());
    const at = this.wasm.sila_predict(this.samples, used.length);  // which may move the memory
    return parsed(new Float64Array(this.wasm.memory.buffer, at));
  }

  /** Scores of the last prediction at a step, row by row. */
  scores(step: number, { x0, y0, cell, columns, rows }: Raster): Float64Array {
    const at = this.wasm.sila_scores(step, x0, y0, cell, columns, rows);  // which may move the memory
    return new Float64Array(this.wasm.memory.buffer, at, columns * rows);
  }
}

function parsed(numbers: Float64Array): Predicted {
  let at = 0;
  const next = (): number => numbers[at++]!;
  const take = (count: number): number[] => Array.from(numbers.subarray(at, at += count));
  const [novelty, fallback] = [next(), next() === 1];
  const [t, changes] = [take(next()), take(next())];
  const modes = Array.from({ length: next() }, (): PredictedMode => ({
    weight: next(), primitives: take(next()),
    path: t.map((): Point => [next(), next()]), covariances: t.map((): [number, number, number] => [next(), next(), next()]),
  }));
  const regions = Array.from({ length: next() }, (): Region => ({ probability: next(), levels: take(t.length) }));
  return { novelty, fallback, t, changes, modes, regions };
}
