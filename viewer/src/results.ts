// The results of `sila experiment` (docs/experiments.md): one row a method, trial, place and episode. Pure.

export interface Row {
  place: string;
  method: string;
  trial: number;
  episode: number;
  /** Learnt so far. */
  tracks: number;
  /** Weighted MHD of the moving windows at the whole horizon [m]; undefined where the episode was not scored. */
  error_m: number | undefined;
  constant_m: number | undefined;
  size: number;
  seconds: number;
}

export interface Point { tracks: number; mean: number; low: number; high: number; trials: number }
export interface Curve { method: string; points: Point[] }
export type Quantity = "error_m" | "size" | "seconds";

/** A method beside another one: difference of the error as a share of constant velocity's, with a 95 % interval. */
export interface Comparison { place: string; method: string; against: string; people: number; difference: number; low: number; high: number }

type Json = Record<string, unknown>;
export const isObject = (value: unknown): value is Json => typeof value === "object" && value !== null && !Array.isArray(value);
const listOf = (value: unknown): Json[] => Array.isArray(value) ? value.filter(isObject) : [];
const numberOf = (value: unknown): number | undefined => typeof value === "number" && Number.isFinite(value) ? value : undefined;
const textOf = (value: unknown): string => typeof value === "string" ? value : "";

function errorOf(groups: unknown, whose: "model" | "constant_velocity"): number | undefined {
  const moving = isObject(groups) ? groups["moving"] : undefined;
  const metrics = isObject(moving) ? moving[whose] : undefined;
  return isObject(metrics) ? numberOf(metrics["weighted_mhd_m"]) : undefined;
}

/** The rows of a results file; none if it has no course of learning in it. */
export function rowsOf(results: unknown): Row[] {
  if (!isObject(results)) return [];
  return listOf(results["curves"]).flatMap((curve) => {
    const checkpoints = listOf(curve["checkpoints"]);
    const last = checkpoints.at(-1)?.["places"];
    const places = isObject(last) ? Object.keys(last) : [textOf(curve["scene"])];
    return checkpoints.flatMap((checkpoint) => places.map((place) => {
      const groups = isObject(checkpoint["places"]) ? checkpoint["places"][place] : undefined;
      return { place, method: textOf(curve["method"]), trial: numberOf(curve["trial"]) ?? 1, episode: numberOf(checkpoint["episode"]) ?? 0, tracks: numberOf(checkpoint["tracks"]) ?? 0,
               error_m: errorOf(groups, "model"), constant_m: errorOf(groups, "constant_velocity"), size: numberOf(checkpoint["size"]) ?? NaN, seconds: numberOf(checkpoint["seconds"]) ?? NaN };
    }));
  });
}

export const placesOf = (rows: readonly Row[]): string[] => [...new Set(rows.map((row) => row.place))];
const mean = (values: readonly number[]): number => values.reduce((a, b) => a + b, 0) / values.length;

/** Mean over trials, and one standard deviation to each side, of a quantity after each episode. */
export function curvesOf(rows: readonly Row[], place: string, quantity: Quantity): Curve[] {
  const byMethod = new Map<string, Map<number, Row[]>>();
  for (const row of rows) {
    const value = row[quantity];
    if (row.place !== place || value === undefined || !Number.isFinite(value)) continue;
    const episodes = byMethod.get(row.method) ?? new Map<number, Row[]>();
    episodes.set(row.episode, [...(episodes.get(row.episode) ?? []), row]);
    byMethod.set(row.method, episodes);
  }
  return [...byMethod].map(([method, episodes]) => ({ method, points: [...episodes].sort(([a], [b]) => a - b).map(([, group]) => {
    const values = group.map((row) => row[quantity]!);
    const middle = mean(values);
    const deviation = values.length > 1 ? Math.sqrt(values.reduce((a, b) => a + (b - middle) ** 2, 0) / (values.length - 1)) : 0;
    return { tracks: mean(group.map((row) => row.tracks)), mean: middle, low: middle - deviation, high: middle + deviation, trials: values.length };
  }) }));
}

/** What constant velocity gives at a place, mean over trials and methods, which see the same windows [m]. */
export function constantOf(rows: readonly Row[], place: string): number | undefined {
  const values = rows.filter((row) => row.place === place && row.constant_m !== undefined).map((row) => row.constant_m!);
  return values.length > 0 ? mean(values) : undefined;
}

export function comparisonsOf(results: unknown, place: string): Comparison[] {
  if (!isObject(results)) return [];
  return listOf(results["comparisons"]).filter((c) => c["place"] === place && numberOf(c["difference"]) !== undefined)
    .map((c) => ({ place, method: textOf(c["method"]), against: textOf(c["against"]), people: numberOf(c["people"]) ?? 0, difference: numberOf(c["difference"])!, low: numberOf(c["low"]) ?? NaN, high: numberOf(c["high"]) ?? NaN }));
}
