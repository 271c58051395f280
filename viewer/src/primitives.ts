// Primitives as arrows on the map, in the colour of their direction.
import type { Cells } from "./data";
import { cellCentre, meanDirection, toWorld, vectorToWorld, type Corner, type Grid, type Point } from "./geometry";
import type { PlaceMap } from "./place";
import { directionColour } from "./palette";

export interface Shape {
  centre: Point;
  colour: string;
  arrows: { from: Point; to: Point }[];
}

/** Arrows of a primitive in metres. Primitives that share a cell are shifted aside a little, so that both are seen. */
export function shapeOf(cells: Cells, corner: Corner, grid: Grid, key: number): Shape {
  const arrows: Shape["arrows"] = [];
  const directions: number[] = [];
  const aside = ((key * 5) % 7 - 3) / 3 * 0.22 * grid.cell;
  let [sx, sy] = [0, 0];
  for (let i = 0; i + 2 < cells.length; i += 3) {
    const angle = cells[i + 2]! * Math.PI / 180;
    const along: Point = [Math.cos(angle) * 0.4 * grid.cell, Math.sin(angle) * 0.4 * grid.cell];
    const [cx, cy] = cellCentre(grid, cells[i]!, cells[i + 1]!);
    const middle: Point = [cx - Math.sin(angle) * aside, cy + Math.cos(angle) * aside];
    arrows.push({ from: toWorld(corner, [middle[0] - along[0], middle[1] - along[1]]), to: toWorld(corner, [middle[0] + along[0], middle[1] + along[1]]) });
    const [wx, wy] = vectorToWorld(corner, along);
    directions.push(Math.atan2(wy, wx) * 180 / Math.PI);
    const [px, py] = toWorld(corner, [cx, cy]);
    [sx, sy] = [sx + px, sy + py];
  }
  const n = Math.max(1, arrows.length);
  return { centre: [sx / n, sy / n], colour: directionColour(meanDirection(directions)), arrows };
}

/** The arrows as one path of the map. */
export function arrowPath(shape: Shape, map: PlaceMap): string {
  let text = "";
  for (const { from, to } of shape.arrows) {
    const [[ax, ay], [bx, by]] = [map.project(from), map.project(to)];
    if (!Number.isFinite(ax + bx)) continue;  // the camera of a picture does not see it
    const angle = Math.atan2(by - ay, bx - ax);
    const head = Math.min(7, 0.45 * Math.hypot(bx - ax, by - ay));
    const side = (turn: number) => `${(bx + head * Math.cos(angle + turn)).toFixed(1)},${(by + head * Math.sin(angle + turn)).toFixed(1)}`;
    text += `M${ax.toFixed(1)},${ay.toFixed(1)}L${bx.toFixed(1)},${by.toFixed(1)}M${side(2.55)}L${bx.toFixed(1)},${by.toFixed(1)}L${side(-2.55)}`;
  }
  return text;
}
