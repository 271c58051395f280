// The map of a place: roadway, blocks, sidewalks, curb axes, grid and tracks, with room on top for whoever draws more.
// It zooms and pans by mouse, by fingers and by keyboard. Instead of the roadway there may be a picture of a camera.
import { select } from "d3-selection";
import { zoom, zoomIdentity, type D3ZoomEvent, type ZoomTransform } from "d3-zoom";
import { applied, inverse, type Homography } from "./camera";
import type { Scene } from "./data";
import { h, s } from "./dom";
import { alongCurbs, pointsOf, toCurb, toWorld, type Grid, type Point } from "./geometry";

export interface Bounds { x0: number; y0: number; x1: number; y1: number }
export type Layer = "grid" | "tracks" | "axes";

/** A picture of the place and its camera, if that is known. */
export interface Backdrop { url: string; width: number; height: number; camera?: Homography | undefined }

/** What a data URL shows, or what is wrong with it. */
export async function backdropOf(url: string, camera?: Homography): Promise<Backdrop> {
  const image = new Image();
  image.src = url;
  try {
    await image.decode();
  } catch {
    throw new Error("the picture inside cannot be decoded");
  }
  return { url, width: image.naturalWidth, height: image.naturalHeight, camera };
}

/** The box of points, without the outermost share of each side but with all of `whole`. */
export function boundsOf(points: readonly Point[], margin_m: number, trim = 0.01, whole: readonly Point[] = []): Bounds {
  const range = (axis: 0 | 1): [number, number] => {
    const values = points.map((p) => p[axis]).sort((a, b) => a - b);
    const pick = (q: number): number => values[Math.min(values.length - 1, Math.max(0, Math.round(q * (values.length - 1))))] ?? 0;
    const kept = whole.map((p) => p[axis]);
    return [Math.min(pick(trim), ...kept) - margin_m, Math.max(pick(1 - trim), ...kept) + margin_m];
  };
  const [[x0, x1], [y0, y1]] = [range(0), range(1)];
  return { x0, x1, y0, y1 };
}

export class PlaceMap {
  readonly element: HTMLElement;
  /** Where others draw; emptied by them alone. */
  readonly top: SVGGElement;
  readonly svg: SVGSVGElement;
  private picture: SVGImageElement | undefined;
  private readonly base: SVGGElement;
  private readonly ground: SVGGElement;
  private readonly above: SVGGElement;
  private readonly scaleBar: SVGGElement;
  private transform: ZoomTransform = zoomIdentity;
  private readonly behaviour = zoom<SVGSVGElement, unknown>();
  private readonly hidden = new Set<Layer>();
  private width = 0;
  private height = 0;
  private readonly listeners: (() => void)[] = [];

  constructor(private readonly scene: Scene, private readonly grid: Grid | undefined, private readonly tracks: readonly number[][],
              private bounds: Bounds, label: string, readonly backdrop?: Backdrop) {
    this.bounds = this.drawnBounds(bounds);
    this.ground = s("g", { class: "ground" });
    this.base = s("g", { class: "base" });
    this.top = s("g");
    this.above = s("g", { class: "above" });
    this.scaleBar = s("g", { class: "scale" });
    this.svg = s("svg", { class: "place", role: "img", "aria-label": label, tabindex: 0 }, this.ground, this.base, this.top, this.above, this.scaleBar);
    const button = (text: string, title: string, act: () => void) => h("button", { type: "button", title, "aria-label": title, onclick: act }, text);
    const buttons = h("div", { class: "zoom" }, button("+", "Closer", () => this.by(1.5)), button("−", "Farther", () => this.by(1 / 1.5)),
                      button("⤢", "Whole place", () => this.fit()));
    this.element = h("div", { class: backdrop ? "map on-picture" : "map" }, this.svg, buttons);
    this.listen();
  }

  /** Called after every change of size or zoom. */
  onDraw(listener: () => void): void {
    this.listeners.push(listener);
  }

  /** Metres to pixels of the drawing; NaN for what the camera of the picture cannot see. */
  project = (point: Point): Point => {
    const { backdrop } = this;
    if (!backdrop) return this.place(point);
    const pixel = backdrop.camera && applied(inverse(backdrop.camera), point);
    return pixel ? this.place(pixel) : [NaN, NaN];
  };

  /** What is drawn, metres or without a camera pixels of the picture, to pixels of the drawing. */
  place([x, y]: Point): Point {
    const up = this.backdrop || this.scene.y_axis === "down" ? 1 : -1;
    const [cx, cy] = [(this.bounds.x0 + this.bounds.x1) / 2, (this.bounds.y0 + this.bounds.y1) / 2];
    return this.transform.apply([this.width / 2 + (x - cx) * this.fitted(), this.height / 2 + up * (y - cy) * this.fitted()]);
  }

  /** The inverse of `place`. */
  placeOf(pixel: Point): Point {
    const [px, py] = this.transform.invert(pixel);
    const up = this.backdrop || this.scene.y_axis === "down" ? 1 : -1;
    return [(this.bounds.x0 + this.bounds.x1) / 2 + (px - this.width / 2) / this.fitted(), (this.bounds.y0 + this.bounds.y1) / 2 + up * (py - this.height / 2) / this.fitted()];
  }

  /** The inverse of `project`; nothing above the horizon. */
  unproject(pixel: Point): Point | undefined {
    const point = this.placeOf(pixel);
    return this.backdrop ? this.backdrop.camera && applied(this.backdrop.camera, point) : point;
  }

  /** Bounds in metres in what is drawn: of a picture the part that shows them. */
  private drawnBounds(bounds: Bounds): Bounds {
    if (!this.backdrop) return bounds;
    const { width, height, camera } = this.backdrop;
    const whole = { x0: 0, y0: 0, x1: width, y1: height };
    if (!camera) return whole;
    const toImage = inverse(camera);
    const [w, t] = [bounds.x1 - bounds.x0, bounds.y1 - bounds.y0];
    const seen = Array.from({ length: 25 }, (_, i) => applied(toImage, [bounds.x0 + w * (i % 5) / 4, bounds.y0 + t * Math.floor(i / 5) / 4])).filter((p) => p !== undefined);
    const box = boundsOf(seen, 0, 0);
    const part = { x0: Math.max(0, box.x0), y0: Math.max(0, box.y0), x1: Math.min(width, box.x1), y1: Math.min(height, box.y1) };
    return part.x1 - part.x0 > 1 && part.y1 - part.y0 > 1 ? part : whole;
  }

  /** Shows another part of the place. */
  frame(bounds: Bounds): void {
    this.bounds = this.drawnBounds(bounds);
    this.fit();  // which draws
  }

  pixelsPerMetre(): number {
    return this.fitted() * this.transform.k;
  }

  get size(): [number, number] {
    return [this.width, this.height];
  }

  path(points: readonly Point[], closed = false, by: (point: Point) => Point = this.project): string {
    let [text, seen] = ["", false];
    for (const point of points) {
      const [x, y] = by(point);
      if (Number.isFinite(x)) text += `${seen ? "L" : "M"}${x.toFixed(1)},${y.toFixed(1)}`;
      seen = Number.isFinite(x);
    }
    return closed && text ? text + "Z" : text;
  }

  show(layer: Layer, on: boolean): void {
    if (on) this.hidden.delete(layer);
    else this.hidden.add(layer);
    this.draw();
  }

  fit(): void {
    select(this.svg).call(this.behaviour.transform, zoomIdentity);
  }

  private fitted(): number {
    return Math.min(this.width / (this.bounds.x1 - this.bounds.x0), this.height / (this.bounds.y1 - this.bounds.y0));
  }

  private by(factor: number): void {
    select(this.svg).call(this.behaviour.scaleBy, factor);
  }

  private listen(): void {
    this.behaviour.scaleExtent([0.2, 20]).extent(() => [[0, 0], [this.width, this.height]])
      // What can be dragged is not for panning. The wheel scrolls the page and one finger, too, unless one means the map.
      .filter((event: Event) => !(event.target as Element).closest(".handle") && (event.type === "wheel" ? (event as WheelEvent).ctrlKey || (event as WheelEvent).metaKey
        : event.type.startsWith("touch") ? (event as TouchEvent).touches.length > 1 : !(event as MouseEvent).button))
      .on("zoom", (event: D3ZoomEvent<SVGSVGElement, unknown>) => { this.transform = event.transform; this.draw(); });
    select(this.svg).call(this.behaviour).on("dblclick.zoom", null);
    this.svg.addEventListener("keydown", (event) => {
      const pan: Record<string, [number, number]> = { ArrowLeft: [60, 0], ArrowRight: [-60, 0], ArrowUp: [0, 60], ArrowDown: [0, -60] };
      const shift = event.shiftKey ? pan[event.key] : undefined;
      if (shift) select(this.svg).call(this.behaviour.translateBy, shift[0] / this.transform.k, shift[1] / this.transform.k);
      else if (event.key === "+") this.by(1.5);
      else if (event.key === "-") this.by(1 / 1.5);
      else if (event.key === "0") this.fit();
      else return;
      event.preventDefault();
    });
    new ResizeObserver(() => this.resize()).observe(this.element);
  }

  private resize(): void {
    const box = this.svg.getBoundingClientRect();  // within the border of the element
    if (box.width === 0 || (box.width === this.width && box.height === this.height)) return;
    [this.width, this.height] = [box.width, box.height];
    this.svg.setAttribute("viewBox", `0 0 ${box.width} ${box.height}`);
    this.draw();
  }

  draw(): void {
    if (this.width === 0) return;
    this.ground.replaceChildren(...(this.backdrop ? [this.image(this.backdrop)] : this.blocks()));
    this.base.replaceChildren(...(this.hidden.has("tracks") ? [] : this.trackPaths()), ...(this.hidden.has("grid") ? [] : this.gridLines()));
    this.above.replaceChildren(...(this.hidden.has("axes") ? [] : this.axes()));
    this.drawScale();
    for (const listener of this.listeners) listener();
  }

  private image({ url, width, height }: Backdrop): SVGElement {
    const [[x, y], [right, bottom]] = [this.place([0, 0]), this.place([width, height])];
    this.picture ??= s("image", { href: url, preserveAspectRatio: "none" });
    for (const [name, value] of Object.entries({ x, y, width: right - x, height: bottom - y })) this.picture.setAttribute(name, String(value));
    return this.picture;
  }

  /** What a person sees around the corner, in metres. */
  private reach(): number {
    return 20 * Math.hypot(this.bounds.x1 - this.bounds.x0, this.bounds.y1 - this.bounds.y0);
  }

  /** Each corner is a block with a sidewalk along two curbs. */
  private blocks(): SVGElement[] {
    const shapes: SVGElement[] = [];
    const corners = this.scene.corners.map(alongCurbs);
    for (const part of ["walk", "block"] as const) {
      for (const corner of corners) {
        const [l1, l2] = [this.reach() / corner.unit_m[0], this.reach() / corner.unit_m[1]];
        const from = part === "walk" ? 0 : 1;
        const outline: Point[] = [[from, from], [l1, from], [l1, l2], [from, l2]];
        shapes.push(s("path", { class: part, d: this.path(outline.map((q) => toWorld(corner, q)), true) }));
      }
    }
    for (const corner of corners) {
      const [l1, l2] = [this.reach() / corner.unit_m[0], this.reach() / corner.unit_m[1]];
      shapes.push(s("path", { class: "curb", d: this.path(([[l1, 0], [0, 0], [0, l2]] as Point[]).map((q) => toWorld(corner, q))) }));
    }
    return shapes;
  }

  private gridLines(): SVGElement[] {
    const corner = this.scene.corners[this.scene.primary];
    const grid = this.grid;
    if (!corner || !grid || this.backdrop) return [];
    const [w, t] = [this.width, this.height];
    const curb = ([[0, 0], [w, 0], [w, t], [0, t]] as Point[]).map((pixel) => toCurb(corner, this.placeOf(pixel)));
    const range = (axis: 0 | 1): [number, number] => {
      const values = curb.map((q) => (q[axis] - grid.origin[axis]) / grid.cell);
      return [Math.floor(Math.min(...values)), Math.ceil(Math.max(...values))];
    };
    const [[a0, a1], [b0, b1]] = [range(0), range(1)];
    if (a1 - a0 + b1 - b0 > 500) return [];  // so far away that it would be a grey veil
    let lines = "";
    const at = (a: number, b: number): Point => toWorld(corner, [grid.origin[0] + a * grid.cell, grid.origin[1] + b * grid.cell]);
    for (let a = a0; a <= a1; ++a) lines += this.path([at(a, b0), at(a, b1)]);
    for (let b = b0; b <= b1; ++b) lines += this.path([at(a0, b), at(a1, b)]);
    return [s("path", { class: "grid", d: lines })];
  }

  private trackPaths(): SVGElement[] {
    return [s("path", { class: "tracks", d: this.tracks.map((track) => this.path(pointsOf(track))).join("") })];
  }

  private axes(): SVGElement[] {
    const primary = this.scene.corners[this.scene.primary];
    if (!primary || this.backdrop) return [];
    const corner = alongCurbs(primary);
    const length = 0.28 * Math.min(this.bounds.x1 - this.bounds.x0, this.bounds.y1 - this.bounds.y0);
    const shapes: SVGElement[] = [];
    ([1, 2] as const).forEach((name) => {
      const axis = name === 1 ? corner.axis_1 : corner.axis_2;
      const tip: Point = [corner.origin[0] + length * axis[0], corner.origin[1] + length * axis[1]];
      const [[ax, ay], [bx, by]] = [this.project(corner.origin), this.project(tip)];
      const angle = Math.atan2(by - ay, bx - ax);
      const head = [2.6, -2.6].map((turn) => `M${bx},${by}L${bx + 9 * Math.cos(angle + turn)},${by + 9 * Math.sin(angle + turn)}`).join("");
      shapes.push(s("path", { class: "axis", d: `M${ax},${ay}L${bx},${by}${head}` }),
                  s("text", { class: "axis-name", x: bx + 12 * Math.cos(angle), y: by + 12 * Math.sin(angle), "text-anchor": Math.cos(angle) < -0.3 ? "end" : Math.cos(angle) > 0.3 ? "start" : "middle", dy: "0.35em" }, `curb ${name}`));
    });
    const [ox, oy] = this.project(corner.origin);
    shapes.push(s("circle", { class: "origin", cx: ox, cy: oy, r: 4 }));
    return shapes;
  }

  private drawScale(): void {
    if (this.backdrop) return;
    const k = this.pixelsPerMetre();
    const metres = [1, 2, 5, 10, 20, 50, 100].find((m) => m * k > 50) ?? 200;
    const y = this.height - 14;
    this.scaleBar.replaceChildren(s("path", { d: `M14,${y - 5}V${y}H${14 + metres * k}V${y - 5}` }), s("text", { x: 20 + metres * k, y: y + 1 }, `${metres} m`));
  }
}
