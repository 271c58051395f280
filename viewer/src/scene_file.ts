// The scene file that the editor changes (docs/formats.md). Pure; lengths are metres on the ground.
import type { PointPair } from "./camera";
import { alongCurbs, pointAt, type Corner, type Point } from "./geometry";

export interface SceneCorner {
  name: string;
  primary: boolean;
  origin: Point;
  axis_1: Point;
  axis_2: Point;
  sidewalk_width_m: number;
  sidewalk_width_1_m: number;
  sidewalk_width_2_m: number;
}
export interface SceneFile {
  name: string;
  y_axis: "up" | "down";
  corners: SceneCorner[];
  camera?: { image_points?: Point[]; ground_points?: Point[]; [key: string]: unknown };
  [key: string]: unknown;
}
export type Axis = 1 | 2;

/** Of the angle between the curbs, as sila demands. */
const leastSine = 0.35;
const leastWidth_m = 0.3;

export const round = (value: number, decimals: number): number => Number(value.toFixed(decimals));
export const axisOf = (corner: SceneCorner, axis: Axis): Point => axis === 1 ? corner.axis_1 : corner.axis_2;
export const widthOf = (corner: SceneCorner, axis: Axis): number => axis === 1 ? corner.sidewalk_width_1_m : corner.sidewalk_width_2_m;
export const headingOf = (corner: SceneCorner, axis: Axis): number => Math.atan2(axisOf(corner, axis)[1], axisOf(corner, axis)[0]) * 180 / Math.PI;
/** Sine of the angle from axis 1 to axis 2. */
export const sine = ({ axis_1, axis_2 }: SceneCorner): number => (axis_1[0] * axis_2[1] - axis_1[1] * axis_2[0]) / (Math.hypot(...axis_1) * Math.hypot(...axis_2));

/** A right-angled corner at a point, axis 2 counter-clockwise of axis 1 seen from above. */
export function squareCorner([x, y]: Point, y_axis: "up" | "down"): SceneCorner {
  const [axis_1, axis_2]: [Point, Point] = y_axis === "up" ? [[1, 0], [0, 1]] : [[0, 1], [1, 0]];
  return { name: "corner", primary: true, origin: [round(x, 3), round(y, 3)], axis_1, axis_2, sidewalk_width_m: 3, sidewalk_width_1_m: 3, sidewalk_width_2_m: 3 };
}

export const moved = (corner: SceneCorner, [x, y]: Point): SceneCorner => ({ ...corner, origin: [round(x, 3), round(y, 3)] });

/** With an axis towards a point; nothing if the curbs would be near parallel. */
export function turned(corner: SceneCorner, axis: Axis, towards: Point): SceneCorner | undefined {
  const [dx, dy] = [towards[0] - corner.origin[0], towards[1] - corner.origin[1]];
  const length = Math.hypot(dx, dy);
  const result = { ...corner, [`axis_${axis}`]: [round(dx / length, 6), round(dy / length, 6)] as Point };
  return Math.abs(sine(result)) > leastSine ? result : undefined;
}

/** From a curb into the block, of length 1. */
export function inward(corner: SceneCorner, axis: Axis): Point {
  const [[x, y], other] = [axisOf(corner, axis), axisOf(corner, axis === 1 ? 2 : 1)];
  const side = Math.sign(x * other[1] - y * other[0]) / Math.hypot(x, y);
  return [-y * side, x * side];
}

/** With another width of the sidewalk along an axis; the mean width follows. */
export function widened(corner: SceneCorner, axis: Axis, width_m: number): SceneCorner {
  const width = Math.max(leastWidth_m, round(width_m, 2));
  return { ...corner, [`sidewalk_width_${axis}_m`]: width, sidewalk_width_m: round((width + widthOf(corner, axis === 1 ? 2 : 1)) / 2, 3) };
}

/** Distance of a point from a curb, positive on the side of the block. */
export function distanceFromCurb(corner: SceneCorner, axis: Axis, [x, y]: Point): number {
  const [nx, ny] = inward(corner, axis);
  return (x - corner.origin[0]) * nx + (y - corner.origin[1]) * ny;
}

/** `along` metres along the curb and `into` metres into the block. */
export function pointBeside(corner: SceneCorner, axis: Axis, along: number, into: number): Point {
  const [[x, y], [nx, ny]] = [axisOf(corner, axis), inward(corner, axis)];
  const length = Math.hypot(x, y);
  return [corner.origin[0] + along * x / length + into * nx, corner.origin[1] + along * y / length + into * ny];
}

/** For the map: curb units in which each sidewalk is one unit wide. */
export function drawnCorner({ name, origin, axis_1, axis_2, sidewalk_width_1_m, sidewalk_width_2_m }: SceneCorner): Corner {
  return alongCurbs({ name, origin, axis_1, axis_2, widths_m: [sidewalk_width_1_m, sidewalk_width_2_m] });
}

/** The median of the points of paths. */
export function medianOf(paths: readonly (readonly number[])[]): Point {
  const middle = (axis: 0 | 1): number => { const values = paths.flatMap((path) => path.filter((_, i) => i % 2 === axis)).sort((a, b) => a - b); return values[Math.floor(values.length / 2)] ?? 0; };
  return [middle(0), middle(1)];
}

/** The points of the camera that a file has. */
export function pointsIn({ camera }: SceneFile): PointPair[] {
  return (camera?.image_points ?? []).map((image, i) => ({ image, ground: camera?.ground_points?.[i] ?? [NaN, NaN] }));
}

const primaryOf = (corners: readonly SceneCorner[]): SceneCorner | undefined => corners.find((corner) => corner.primary) ?? corners[0];
/** All but the name. */
const shapeOf = (corner: SceneCorner | undefined): string => JSON.stringify({ ...corner, name: undefined });
/** Without what `sila scene make` states about the corner that it proposes. */
const ofProposal = { origin_uncertainty_m: undefined, axis_uncertainty_deg: undefined, tracks: undefined };

/** The file with its corners (the primary one also at the first level) and, if there are points, the camera of these; all else as it was. */
export function sceneText(file: SceneFile, corners: readonly SceneCorner[], pairs: readonly PointPair[]): string {
  const primary = primaryOf(corners);
  const { name, primary: _, ...first } = primary ?? { name: "", primary: true };
  const camera = pairs.length > 0 ? { camera: { image_points: pairs.map((p) => p.image), ground_points: pairs.map((p) => p.ground) } } : {};
  const text = JSON.stringify({ ...file, ...(shapeOf(primary) === shapeOf(primaryOf(file.corners)) ? {} : ofProposal), ...first, primary_corner: name, corners, ...camera }, null, 2);
  return text.replace(/\[\s+(-?[\d.e+-]+),\s+(-?[\d.e+-]+)\s+\]/g, "[$1, $2]") + "\n";
}

/** x, y, x, y, ... of a path mapped point by point; points without an image are left out. */
export function mapped(path: readonly number[], map: (point: Point) => Point | undefined): number[] {
  return Array.from({ length: path.length / 2 }, (_, i) => map(pointAt(path, i)) ?? []).flat();
}
