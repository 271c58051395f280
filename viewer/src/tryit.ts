// A pedestrian to be dragged, and what the model predicts meanwhile.
import { contours } from "d3-contour";
import type { ReportData, Scene } from "./data";
import { h, number, percent, s, toggle } from "./dom";
import { pointsOf, toWorld, type Corner, type Point } from "./geometry";
import { boundsOf, PlaceMap } from "./place";
import { mostTelling } from "./predicted";
import { lacking, Predictor, type Predicted } from "./predictor";
import { extended, rasterOf, walked } from "./trail";

const rasterPoints = 56;
const stepByKey_m = 0.25;

/** Where a walk may begin: as the pedestrian whose predictions are shown first, else along curb 1. */
function firstTrail(data: ReportData, corner: Corner): Point[] {
  const opening = mostTelling(data.played ?? []);
  const observed = opening?.person.predictions.find((p) => p.t0 === opening.t0)?.observed;
  if (observed && observed.length >= 4) return pointsOf(observed);
  const across = 0.5 * corner.widths_m[0] / corner.unit_m[1];
  return [8, 4].map((along_m) => toWorld(corner, [along_m / corner.unit_m[0], across]));
}

class TryIt {
  readonly element: HTMLElement;
  private readonly map: PlaceMap;
  private trail: Point[];
  private speed_mps = 1.4;
  private ahead_s = 3;
  private frame: number | undefined;
  private readonly visible = { modes: true, regions: true };
  private readonly drawn = s("g");
  private readonly handle = s("g", { class: "handle pedestrian", role: "button", tabindex: 0, "aria-label": "Pedestrian: drag, or move by arrow keys" }, s("circle", { class: "touch", r: 22 }), s("circle", { class: "person", r: 8 }));
  private readonly readout = h("p", { class: "readout", id: "try-readout" });

  constructor(data: ReportData, scene: Scene, private readonly predictor: Predictor) {
    const begin = firstTrail(data, scene.corners[scene.primary]!);
    this.trail = begin;
    const [x, y] = begin.at(-1)!;
    this.map = new PlaceMap(scene, undefined, data.drawn_tracks ?? [], boundsOf([[x - 11, y - 11], [x + 11, y + 11]], 0, 0), "Map with a pedestrian to drag");
    this.map.svg.setAttribute("role", "group");  // screen readers skip what is in an image
    this.map.show("axes", false);
    this.map.top.append(this.drawn, this.handle);
    this.map.onDraw(() => this.draw());
    const check = (text: string, key: "modes" | "regions") => toggle(text, true, (on) => { this.visible[key] = on; this.draw(); });
    const last = this.predictor.predict(this.samples()).t.at(-1) ?? 1;
    const slider = (id: string, text: string, min: number, max: number, step: number, value: number, unit: string, change: (value: number) => void) => {
      const words = h("output", {}, `${number(value, 1)} ${unit}`);
      const input = h("input", { id, type: "range", min, max, step, value, oninput: () => { words.textContent = `${number(Number(input.value), 1)} ${unit}`; change(Number(input.value)); this.draw(); } });
      return h("label", { class: "choice" }, h("span", {}, text), input, words);
    };
    this.element = h("div", {},
      h("div", { class: "controls" }, slider("try-speed", "Walks at", 0.5, 2.5, 0.1, this.speed_mps, "m/s", (value) => { this.speed_mps = value; }),
        slider("try-ahead", "Regions after", this.predictor.interval_s, last, this.predictor.interval_s, this.ahead_s = Math.min(this.ahead_s, last), "s", (value) => { this.ahead_s = value; }),
        check("Modes", "modes"), check("Regions", "regions"), h("button", { type: "button", id: "try-again", onclick: () => { this.trail = begin; this.draw(); } }, "Start again")),
      this.map.element, this.readout,
      h("ul", { class: "keys" }, ...["Modes, by weight", "Nominal 50 % and 90 % regions"].map((text, i) => h("li", {}, h("i", { class: `swatch ${["", "of-ellipses"][i]}`, "aria-hidden": "true" }), text))));
    this.listen();
  }

  private listen(): void {
    this.handle.addEventListener("pointerdown", (event) => { this.handle.setPointerCapture(event.pointerId); event.preventDefault(); this.handle.focus(); });
    this.handle.addEventListener("pointermove", (event) => {
      if (!this.handle.hasPointerCapture(event.pointerId)) return;
      const box = this.map.svg.getBoundingClientRect();
      for (const part of event.getCoalescedEvents().concat(event)) this.move(this.map.unproject([part.clientX - box.left, part.clientY - box.top])!);
    });
    const keys: Record<string, Point> = { ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, -1], ArrowDown: [0, 1] };
    this.handle.addEventListener("keydown", (event) => {
      const by = keys[event.key];
      if (!by || event.shiftKey) return;
      const [x, y] = this.map.project(this.trail.at(-1)!);
      const pixels = stepByKey_m * this.map.pixelsPerMetre();
      this.move(this.map.unproject([x + by[0] * pixels, y + by[1] * pixels])!);
      event.preventDefault();
    });
  }

  /** Goes on to a point; drawn once in each frame of the browser. */
  private move(point: Point): void {
    this.trail = extended(this.trail, point, 2.5 * this.predictor.observe_s);
    this.frame ??= requestAnimationFrame(() => this.draw());
  }

  private samples(): [number, number, number][] {
    return walked(this.trail, this.speed_mps, this.predictor.observe_s, 0.5 * this.predictor.interval_s);
  }

  private draw(): void {
    if (this.frame !== undefined) cancelAnimationFrame(this.frame);
    this.frame = undefined;
    const samples = this.samples();
    const here = this.trail.at(-1)!;
    const prediction = this.predictor.predict(samples);
    const step = Math.max(0, prediction.t.filter((t) => t <= this.ahead_s + 1e-9).length - 1);
    const shapes: SVGElement[] = [];
    if (this.visible.regions) shapes.push(...this.regions(prediction, step));
    if (this.visible.modes) for (const { weight, path } of [...prediction.modes].reverse()) {
      const [x, y] = this.map.project(path[step]!);
      const opacity = (0.25 + 0.75 * Math.sqrt(weight)).toFixed(2);
      shapes.push(s("path", { class: "mode", d: this.map.path([here, ...path]), "stroke-width": (1.5 + 6 * weight).toFixed(1), opacity }), s("circle", { class: "mode-now", cx: x, cy: y, r: 3 + 2.5 * weight, opacity }));
    }
    shapes.push(s("path", { class: "past", d: this.map.path(samples.map(([, x, y]): Point => [x, y])) }));
    this.drawn.replaceChildren(...shapes);
    const [x, y] = this.map.project(here);
    this.handle.setAttribute("transform", `translate(${x} ${y})`);
    this.tell(prediction);
  }

  /** Outlines of the nominal 90 % and 50 % regions. */
  private regions(prediction: Predicted, step: number): SVGElement[] {
    const raster = rasterOf(prediction, step, rasterPoints);
    const scores = prediction.regions.length > 0 ? Array.from(this.predictor.scores(step, raster), (score) => -score) : [];
    const outline = contours().size([raster.columns, raster.rows]);
    return [0.9, 0.5].flatMap((share) => {
      const region = prediction.regions.find(({ probability }) => Math.abs(probability - share) < 1e-9);
      if (!region) return [];
      // Rings are in cells, whose middles are half a cell from their corners.
      const rings = outline.contour(scores, -region.levels[step]!).coordinates.flat();
      const d = rings.map((ring) => this.map.path(ring.map(([i, k]): Point => [raster.x0 + (i! - 0.5) * raster.cell, raster.y0 + (k! - 0.5) * raster.cell]), true)).join("");
      return [s("path", { class: `ellipse region of-${100 * share}`, d, "fill-rule": "evenodd" })];
    });
  }

  private tell({ modes, novelty, fallback, regions }: Predicted): void {
    const first = modes[0]!;
    this.readout.textContent = `${modes.length} modes, the most likely with a weight of ${percent(first.weight)}. ${fallback ? "No track walked like this: kinematics alone. " : ""}`
      + `Novelty: ${percent(novelty)} of the pedestrians so far were better known.${regions.length > 0 ? "" : " The model has no calibrated regions yet."}`;
  }
}

/** The section; nothing if the page has no model that could predict. */
export function tryItSection(data: ReportData): HTMLElement | undefined {
  const packed = data.predictor;
  if (!packed || !data.scene) return undefined;
  const place = h("div", { id: "try-place" }, h("p", { class: "quiet" }, "The model is being loaded …"));
  const lead = "Drag the pedestrian along a short path, or move it by the arrow keys: it walks along what you draw, and the model predicts in this page.";
  const element = h("section", { id: "try" }, h("h2", {}, "Try it"), h("p", { class: "lead" }, lead), place);
  const say = (text: string): void => place.replaceChildren(h("p", { class: "alarm", role: "alert" }, text));
  if ("bytes" in packed) {
    say(`The model is too large for this page (${number(packed.bytes / 1e6, 1)} MB of at most ${number(packed.most_bytes / 1e6, 1)} MB). \`sila serve\` predicts with it on its live page.`);
    return element;
  }
  const missing = lacking();
  if (missing) {
    say(missing);
    return element;
  }
  Predictor.load(packed).then((predictor) => {
    const corner: Corner = { name: "", widths_m: [1, 1], ...predictor.frame };
    place.replaceChildren(new TryIt(data, data.scene!.known ? data.scene! : { ...data.scene!, primary: 0, corners: [corner] }, predictor).element);
  }).catch((error: unknown) => say(`The model cannot be loaded: ${error instanceof Error ? error.message : String(error)}. Make the report anew, or open it in another browser.`));
  return element;
}
