// A camera that looks at flat ground: the homography from its picture [pixels] to the ground [m]. Pure.
import type { Point } from "./geometry";

/** Row by row. */
export type Homography = readonly number[];
export interface PointPair { image: Point; ground: Point }
export interface CameraFit { camera: Homography; residuals_m: number[] }

/** The image of a point; nothing at and beyond the horizon. */
export function applied(h: Homography, [x, y]: Point): Point | undefined {
  const w = h[6]! * x + h[7]! * y + h[8]!;
  return w > 0 ? [(h[0]! * x + h[1]! * y + h[2]!) / w, (h[3]! * x + h[4]! * y + h[5]!) / w] : undefined;
}

function adjugate(m: Homography): Homography {
  const [a, b, c, d, e, f, g, h, i] = m as [number, number, number, number, number, number, number, number, number];
  return [e * i - f * h, c * h - b * i, b * f - c * e, f * g - d * i, a * i - c * g, c * d - a * f, d * h - e * g, b * g - a * h, a * e - b * d];
}

/** Positive where the ground has y downwards as the picture has: its axes are mirrored, seen from above. */
export const determinant = (m: Homography): number => { const [a, b, c] = adjugate(m); return m[0]! * a! + m[3]! * b! + m[6]! * c!; };
export function inverse(m: Homography): Homography {
  const whole = determinant(m);
  return adjugate(m).map((entry) => entry / whole);
}

const product = (a: Homography, b: Homography): Homography => a.map((_, k) => [0, 1, 2].reduce((sum, j) => sum + a[3 * Math.floor(k / 3) + j]! * b[3 * j + k % 3]!, 0));

/** Moves the middle of points to 0 and scales their mean distance from it to the square root of 2. */
function normalisation(points: readonly Point[]): Homography {
  const [mx, my] = [0, 1].map((axis) => points.reduce((sum, p) => sum + p[axis as 0 | 1], 0) / points.length) as Point;
  const scale = Math.SQRT2 / (points.reduce((sum, p) => sum + Math.hypot(p[0] - mx, p[1] - my), 0) / points.length);
  return [scale, 0, -scale * mx, 0, scale, -scale * my, 0, 0, 1];
}

/** x of A x = b by Gaussian elimination with pivoting; `rows` are those of [A b]. Nothing if A is singular. */
function solved(rows: number[][]): number[] | undefined {
  const n = rows.length;
  const largest = Math.max(...rows.flat().map(Math.abs));
  for (let k = 0; k < n; ++k) {
    const pivot = rows.slice(k).reduce((best, row, i) => Math.abs(row[k]!) > Math.abs(rows[best]![k]!) ? k + i : best, k);
    [rows[k], rows[pivot]] = [rows[pivot]!, rows[k]!];
    if (!(Math.abs(rows[k]![k]!) > 1e-10 * largest)) return undefined;
    for (let i = 0; i < n; ++i) {
      if (i === k) continue;
      const factor = rows[i]![k]! / rows[k]![k]!;
      rows[i] = rows[i]!.map((entry, j) => entry - factor * rows[k]![j]!);
    }
  }
  return rows.map((row, k) => row[n]! / row[k]!);
}

/** The camera of four or more points, by least squares in normalised coordinates, as `fit_camera` of sila, which decides on a saved camera. A text says why there is none. */
export function fitCamera(pairs: readonly PointPair[]): CameraFit | string {
  if (pairs.length < 4) return `${pairs.length} of 4 points`;
  const [ofImage, ofGround] = [normalisation(pairs.map((p) => p.image)), normalisation(pairs.map((p) => p.ground))];
  const normal = Array.from({ length: 8 }, () => new Array<number>(9).fill(0));
  for (const { image, ground } of pairs) {
    const [[x, y], [u, v]] = [applied(ofImage, image) ?? [NaN, NaN], applied(ofGround, ground) ?? [NaN, NaN]];
    for (const equation of [[x, y, 1, 0, 0, 0, -u * x, -u * y, u], [0, 0, 0, x, y, 1, -v * x, -v * y, v]])
      for (let i = 0; i < 8; ++i) for (let j = 0; j < 9; ++j) normal[i]![j]! += equation[i]! * equation[j]!;
  }
  const entries = solved(normal);
  if (!entries) return "points that repeat or lie on one line; of four points no three may";
  const h = product(inverse(ofGround), product([...entries, 1], ofImage));
  const [u, v] = pairs[0]!.image;
  const sign = Math.sign(h[6]! * u + h[7]! * v + h[8]!);
  const camera = h.map((entry) => sign * entry);
  const residuals_m = pairs.map(({ image, ground }) => { const at = applied(camera, image); return at ? Math.hypot(at[0] - ground[0], at[1] - ground[1]) : NaN; });
  return residuals_m.every(Number.isFinite) ? { camera, residuals_m } : "points that contradict each other: the horizon passes between them";
}
