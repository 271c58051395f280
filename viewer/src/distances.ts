// Where points are on the ground, by the distances between them. Pure.
import type { Point } from "./geometry";

/** Row i has the distances of point i to the others [m]; NaN where none was measured. Symmetric. */
export type Distances = readonly (readonly number[])[];
export interface Placed { points: Point[]; residual_m: number }

const between = (a: Point, b: Point): number => Math.hypot(a[0] - b[0], a[1] - b[1]);
/** On which side of the line from a to b a point is; in a picture, where v points down, mirrored against the ground. */
const side = (a: Point, b: Point, p: Point): number => Math.sign((b[0] - a[0]) * (p[1] - a[1]) - (b[1] - a[1]) * (p[0] - a[0]));
const metres = (value: number): string => `${Math.round(value * 100) / 100} m`;

/** The points of a triangle whose longest side is longer than the way over the third point. */
function contradiction(distances: Distances): string | undefined {
  for (let k = 0; k < distances.length; ++k) for (let i = 0; i < k; ++i) for (let j = 0; j < i; ++j)
    for (const [a, b, over] of [[j, i, k], [j, k, i], [i, k, j]] as const) {
      const [direct, detour] = [distances[a]![b]!, distances[a]![over]! + distances[over]![b]!];
      if (direct > detour) return `the distances contradict one another: points ${a + 1} and ${b + 1} are ${metres(direct)} apart, but only ${metres(detour)} by way of point ${over + 1}`;
    }
  return undefined;
}

/** The point at distances from a and b, on the side of the line through them that the picture shows; NaN if the circles do not meet. */
function trilaterated(a: Point, b: Point, [fromA, fromB]: readonly [number, number], left: number): Point {
  const base = between(a, b);
  const along = (fromA * fromA - fromB * fromB + base * base) / (2 * base);
  const aside = left * Math.sqrt(fromA * fromA - along * along);
  const [ex, ey] = [(b[0] - a[0]) / base, (b[1] - a[1]) / base];
  return [a[0] + along * ex - aside * ey, a[1] + along * ey + aside * ex];
}

/** Descends on the sum of squared residuals; a step of 1 over the number of points never increases it (majorisation, as in multidimensional scaling). */
function adjusted(start: readonly Point[], distances: Distances): Point[] {
  let points = [...start];
  for (let step = 0; step < 1000; ++step) points = points.map((p, i) => points.reduce((sum: Point, q, j) => {
    const [length, wanted] = [between(p, q), distances[i]![j]!];
    const share = i === j || !(length > 0) || Number.isNaN(wanted) ? 0 : (wanted / length - 1) / points.length;
    return [sum[0] + share * (p[0] - q[0]), sum[1] + share * (p[1] - q[1])];
  }, p));
  return points;
}

/** The points in metres: the first at 0, 0, the second on the x axis, y counter-clockwise of it seen from above. Each further one needs distances to two placed before it; which of the two
 *  places is meant is seen in the picture. More distances than needed are met as well as they can be. A text says why there is none. */
export function placedBy(distances: Distances, image: readonly Point[]): Placed | string {
  if (distances.some((row) => row.some((d) => d <= 0))) return "a distance is not positive";
  const wrong = contradiction(distances);
  if (wrong) return wrong;
  if (!(distances[0]?.[1]! > 0)) return "the distance from point 1 to point 2 is missing";
  const placed = new Map<number, Point>([[0, [0, 0]], [1, [distances[0]![1]!, 0]]]);
  for (let tries = 0; tries < image.length; ++tries) image.forEach((seen, k) => {
    const [a, b] = [...placed.keys()].filter((i) => distances[k]![i]! > 0);
    if (placed.has(k) || a === undefined || b === undefined) return;
    placed.set(k, trilaterated(placed.get(a)!, placed.get(b)!, [distances[k]![a]!, distances[k]![b]!], -side(image[a]!, image[b]!, seen)));
  });
  const missing = image.findIndex((_, k) => !placed.has(k));
  if (missing >= 0) return `point ${missing + 1} needs its distances to two other points`;
  const start = image.map((_, k) => placed.get(k)!);
  const apart = start.findIndex((p) => !p.every(Number.isFinite));
  if (apart >= 0) return `the distances contradict one another: no place fits those to point ${apart + 1}`;
  const points = adjusted(start, distances);
  const residual_m = Math.max(...points.flatMap((p, i) => points.slice(0, i).map((q, j) => Math.abs(between(p, q) - distances[i]![j]!)).filter((d) => !Number.isNaN(d))));
  const [[x0, y0], length] = [points[0]!, between(points[0]!, points[1]!)];
  const [ex, ey] = [(points[1]![0] - x0) / length, (points[1]![1] - y0) / length];
  return { points: points.map(([x, y]) => [(x - x0) * ex + (y - y0) * ey, (y - y0) * ex - (x - x0) * ey]), residual_m };
}
