// Curb coordinates, cells and ellipses. Pure.

export type Point = [number, number];

/** Where two curbs meet, in the world frame; `unit_m`: metres a curb unit, along each axis of the curb coordinates;
    `curbs`: the directions of the curbs, where they differ from the axes. */
export interface Corner {
  name: string;
  origin: Point;
  axis_1: Point;
  axis_2: Point;
  curbs?: [Point, Point];
  unit_m: Point;
  widths_m: [number, number];
}

export interface Grid {
  cell: number;
  origin: Point;
  tile_cells: number;
}

/** The corner in coordinates along its curbs, in which each sidewalk is one unit wide. */
export function alongCurbs(corner: Omit<Corner, "unit_m">): Corner {
  const [axis_1, axis_2] = corner.curbs ?? [corner.axis_1, corner.axis_2];
  const sine = Math.abs(axis_1[0] * axis_2[1] - axis_1[1] * axis_2[0]);
  return { ...corner, axis_1, axis_2, unit_m: [corner.widths_m[1] / sine, corner.widths_m[0] / sine] };
}

/** Curb coordinates [curb units] to metres. */
export function toWorld(corner: Corner, [q1, q2]: Point): Point {
  const [u1, u2] = [corner.unit_m[0] * q1, corner.unit_m[1] * q2];
  return [corner.origin[0] + corner.axis_1[0] * u1 + corner.axis_2[0] * u2,
          corner.origin[1] + corner.axis_1[1] * u1 + corner.axis_2[1] * u2];
}

/** A velocity or displacement in curb coordinates to metres. */
export function vectorToWorld(corner: Corner, [q1, q2]: Point): Point {
  const [u1, u2] = [corner.unit_m[0] * q1, corner.unit_m[1] * q2];
  return [corner.axis_1[0] * u1 + corner.axis_2[0] * u2, corner.axis_1[1] * u1 + corner.axis_2[1] * u2];
}

export function toCurb(corner: Corner, [x, y]: Point): Point {
  const [dx, dy] = [x - corner.origin[0], y - corner.origin[1]];
  const [a, b, c, d] = [corner.axis_1[0] * corner.unit_m[0], corner.axis_2[0] * corner.unit_m[1],
                        corner.axis_1[1] * corner.unit_m[0], corner.axis_2[1] * corner.unit_m[1]];
  const determinant = a * d - b * c;
  return [(d * dx - b * dy) / determinant, (a * dy - c * dx) / determinant];
}

/** The middle of a cell in curb coordinates. */
export function cellCentre(grid: Grid, x: number, y: number): Point {
  return [grid.origin[0] + (x + 0.5) * grid.cell, grid.origin[1] + (y + 0.5) * grid.cell];
}

/** The factor by which the standard ellipse of a 2-D Gaussian must grow to hold this share of it. */
export function ellipseScale(share: number): number {
  return Math.sqrt(-2 * Math.log(1 - share));
}

export interface Ellipse {
  rx: number;
  ry: number;
  angle: number;
}

/** Half axes [m] and the angle of the first of them [rad] of the ellipse that holds `share` of a Gaussian. */
export function ellipseOf(xx: number, xy: number, yy: number, share: number): Ellipse {
  const middle = (xx + yy) / 2;
  const radius = Math.hypot((xx - yy) / 2, xy);
  const scale = ellipseScale(share);
  return { rx: scale * Math.sqrt(Math.max(0, middle + radius)), ry: scale * Math.sqrt(Math.max(0, middle - radius)),
           angle: 0.5 * Math.atan2(2 * xy, xx - yy) };
}

/** Points of an ellipse about 0, counter-clockwise. */
export function ellipseOutline({ rx, ry, angle }: Ellipse): Point[] {
  const [c, s] = [Math.cos(angle), Math.sin(angle)];
  return Array.from({ length: 48 }, (_, i) => {
    const [x, y] = [rx * Math.cos(2 * Math.PI * i / 48), ry * Math.sin(2 * Math.PI * i / 48)];
    return [c * x - s * y, s * x + c * y];
  });
}

export const pointAt = (path: readonly number[], i: number): Point => [path[2 * i] ?? NaN, path[2 * i + 1] ?? NaN];
export const pointsOf = (path: readonly number[]): Point[] => Array.from({ length: path.length / 2 }, (_, i) => pointAt(path, i));

/** Linear interpolation in a list of growing times; held at its ends. */
export function between(times: readonly number[], t: number): { i: number; f: number } {
  const last = times.length - 1;
  if (last < 0) return { i: 0, f: 0 };
  if (t <= times[0]!) return { i: 0, f: 0 };
  if (t >= times[last]!) return { i: last, f: 0 };
  let i = 0;
  while (times[i + 1]! <= t) ++i;
  return { i, f: (t - times[i]!) / (times[i + 1]! - times[i]!) };
}

export function positionAt(times: readonly number[], path: readonly number[], t: number): Point {
  const { i, f } = between(times, t);
  const [a, b] = [pointAt(path, i), f > 0 ? pointAt(path, i + 1) : pointAt(path, i)];
  return [a[0] + f * (b[0] - a[0]), a[1] + f * (b[1] - a[1])];
}

/** The mean direction of directions in degrees [rad]. */
export function meanDirection(degrees: readonly number[]): number {
  let [x, y] = [0, 0];
  for (const d of degrees) [x, y] = [x + Math.cos(d * Math.PI / 180), y + Math.sin(d * Math.PI / 180)];
  return Math.atan2(y, x);
}
