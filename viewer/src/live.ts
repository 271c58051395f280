// The live page of `sila serve`: pedestrians and their predictions, the size of the model, errors and coverage.
import { gridY, lineY, plot, ruleY } from "@observablehq/plot";
import type { ModelData, Scene } from "./data";
import { common, legend, redrawable } from "./charts";
import { besideConstant, count, h, number, percent, plural, s, thead, toggle } from "./dom";
import { pointsOf } from "./geometry";
import { appended, grown, lit, momentOf, type Frame, type Message, type Metrics, type Moment } from "./live_data";
import { methodColour } from "./palette";
import { backdropOf, PlaceMap, type Backdrop, type Bounds } from "./place";
import { arrowPath, shapeOf, type Shape } from "./primitives";
import { themeButton } from "./theme";

const ours = methodColour.sila;
const constant = methodColour["constant velocity"];

/** The map, or the picture of a camera, with primitives below and pedestrians above. */
class LiveMap {
  readonly map: PlaceMap;
  private shapes: Shape[] = [];
  private readonly drawn: SVGElement[] = [];
  private readonly below = s("g", { class: "primitives" });
  private readonly pedestrians = s("g", { class: "pedestrians" });
  private frame: Frame = { kind: "frame", count: 0, pedestrians: [] };
  private box: Bounds | undefined;

  constructor(private readonly scene: Scene, model: ModelData, private readonly visible: { primitives: boolean; modes: boolean }, backdrop?: Backdrop) {
    const corner = scene.corners[scene.primary]!;
    const [x, y] = corner.origin;
    this.map = new PlaceMap(scene, model.grid, [], { x0: x - 15, y0: y - 15, x1: x + 15, y1: y + 15 }, "Map of the scene now", backdrop);
    this.map.show("grid", false);
    this.map.show("axes", false);
    this.map.top.append(this.below, this.pedestrians);
    this.map.onDraw(() => this.draw());
    this.learnt(model);
  }

  learnt(model: ModelData, scene?: Scene): void {
    // Without a scene file the service has no corner before the first episode. The map draws the same object.
    if (scene && !this.scene.known) Object.assign(this.scene, scene);
    const corner = this.scene.corners[this.scene.primary]!;
    this.shapes = model.primitives.map((primitive, i) => shapeOf(primitive.cells, corner, model.grid, i));
    this.drawn.length = 0;
    this.drawn.push(...this.shapes.map((shape, i) => s("path", { class: "primitive", stroke: shape.colour, "data-primitive": i })));
    this.below.replaceChildren(...this.drawn);
    if (!this.reach(this.shapes.map(({ arrows }) => ({ trail: arrows.flatMap(({ to }) => to) })), 2)) this.map.draw();
  }

  show(frame: Frame): void {
    this.frame = frame;
    if (!this.reach(frame.pedestrians, 6)) this.drawPedestrians();
  }

  /** Enlarges the map so that it has these trails, and draws it then; whether it was too small. */
  private reach(seen: readonly { trail: readonly number[] }[], margin_m: number): boolean {
    const box = this.map.backdrop ? undefined : grown(this.box, seen, margin_m);  // a picture is shown whole
    if (!box || box === this.box) return false;
    this.box = box;
    this.map.frame(box);
    return true;
  }

  draw(): void {
    this.shapes.forEach((shape, i) => this.drawn[i]!.setAttribute("d", arrowPath(shape, this.map)));
    this.drawPedestrians();
  }

  private drawPedestrians(): void {
    const weights = lit(this.frame.pedestrians);
    this.below.setAttribute("visibility", this.visible.primitives ? "visible" : "hidden");
    this.drawn.forEach((path, i) => {
      const weight = weights.get(i) ?? 0;
      path.setAttribute("stroke-width", (1.1 + 2.4 * weight).toFixed(2));
      path.setAttribute("opacity", (0.22 + 0.78 * Math.sqrt(weight)).toFixed(2));
      path.classList.toggle("lit", weight > 0);
    });
    const shapes: SVGElement[] = [];
    for (const pedestrian of this.frame.pedestrians) {
      const trail = pointsOf(pedestrian.trail);
      const here = trail.at(-1);
      if (!here) continue;
      shapes.push(s("path", { class: "past", d: this.map.path(trail) }));
      if (this.visible.modes) for (const mode of [...(pedestrian.modes ?? [])].reverse()) {
        shapes.push(s("path", { class: "mode", d: this.map.path([here, ...pointsOf(mode.path)]), "stroke-width": (1 + 4.5 * mode.weight).toFixed(1), opacity: (0.2 + 0.8 * Math.sqrt(mode.weight)).toFixed(2) }));
      }
      const [x, y] = this.map.project(here);  // NaN where the camera of a picture does not see it
      if (Number.isFinite(x)) shapes.push(s("circle", { class: "person", cx: x, cy: y, r: 5, "data-id": pedestrian.id }, s("title", {}, pedestrian.modes ? `${pedestrian.name}, novelty ${percent(pedestrian.novelty ?? 0)}` : `${pedestrian.name}, not predicted yet`)));
    }
    this.pedestrians.replaceChildren(...shapes);
  }
}

function tile(id: string, what: string): { element: HTMLElement; set: (value: string, more: string) => void } {
  const [value, more] = [h("b", { id }, "–"), h("small", {}, "")];
  return { element: h("li", {}, value, h("span", {}, what), more), set: (text, extra) => { value.textContent = text; more.textContent = extra; } };
}

class LivePage {
  readonly element: HTMLElement;
  private live: LiveMap | undefined;
  /** By the check boxes; a new connection does not change them. */
  private readonly visible = { primitives: true, modes: true };
  private readonly place = h("div", { id: "map" }, h("p", { class: "quiet" }, "Waiting for the service …"));
  private readonly undrawn = h("p", { class: "quiet", id: "undrawn" });
  private readonly title = h("h1", {}, "Live");
  private readonly state = h("p", { class: "state", id: "state", role: "status" }, "connecting");
  private readonly alarm = h("p", { class: "alarm", id: "alarm", role: "alert", hidden: true });
  private readonly tiles = { pedestrians: tile("pedestrians", "pedestrians now"), error: tile("error", "weighted MHD"), regions: tile("regions", "coverage of the 90 % regions"), size: tile("size", "model size"), rate: tile("rate", "predictions a second") };
  private moments: Moment[] = [];
  private readonly began = performance.now();
  private seen: { predictions: number; at: number } | undefined;
  private readonly errors = redrawable("Error of the last moving pedestrians [m]", "Error of sila and of constant velocity over time", (width) => plot({ ...common(width), x: { label: "minutes" }, y: { label: null, grid: true, zero: true },
    marks: [gridY(), ruleY([0]), lineY(this.moments, { x: "at", y: "constant_mhd_m", stroke: constant, strokeWidth: 2, strokeDasharray: "5 4" }), lineY(this.moments, { x: "at", y: "mhd_m", stroke: ours, strokeWidth: 2.5 })] }));
  private readonly growth = redrawable("Size of the model", "Model size over time", (width) => plot({ ...common(width), x: { label: "minutes" }, y: { label: null, grid: true, zero: true },
    marks: [gridY(), ruleY([0]), lineY(this.moments, { x: "at", y: "size", stroke: ours, strokeWidth: 2.5, curve: "step-after" })] }));
  private readonly expectation = h("p", { class: "quiet", id: "expectation" });
  private readonly table = h("tbody", { id: "horizons" });
  private readonly counters = h("p", { class: "quiet", id: "counters" });

  constructor() {
    const check = (text: string, key: "primitives" | "modes") => toggle(text, true, (on) => { this.visible[key] = on; this.live?.draw(); });
    this.element = h("div", {},
      h("header", {}, h("div", { class: "top" }, h("div", {}, h("p", { class: "brand" }, "sila · live"), this.title), themeButton()), this.state, this.alarm, h("ul", { class: "tiles" }, ...Object.values(this.tiles).map((t) => t.element))),
      h("main", { id: "main" },
        h("section", { id: "now" }, h("h2", {}, "Now"), this.place, h("div", { class: "controls legend" }, check("primitives, highlighted where they are predicted", "primitives"), check("predicted paths, by weight", "modes")), this.undrawn),
        h("section", { id: "learning" }, h("h2", {}, "While it learns"), legend([{ name: "sila", colour: ours }, { name: "constant velocity", colour: constant, dash: true }]), h("div", { class: "charts" }, this.errors.element, this.growth.element), this.expectation),
        h("section", { id: "scores" }, h("h2", {}, "Recent errors and coverage"), h("div", { class: "scroll" }, h("table", { class: "numbers" }, thead("horizon", "windows", "sila", "constant velocity", "coverage of 50 %", "of 90 %"), this.table)), this.counters)));
  }

  connection(text: string): void {
    this.state.textContent = text;
  }

  async take(message: Message): Promise<void> {
    if (message.kind === "hello") {
      const title = (message.scene.known && message.scene.name) || "a scene without a name";
      this.title.textContent = title.charAt(0).toUpperCase() + title.slice(1);
      document.title = `sila live: ${title}`;
      const backdrop = message.picture ? await backdropOf(message.picture) : undefined;
      this.live = new LiveMap(message.scene, message.model, this.visible, backdrop);
      this.seen = undefined;  // a restarted service counts from 0
      if (backdrop) backdrop.camera = message.camera;  // only now: without a camera a picture is shown whole
      this.place.replaceChildren(this.live.map.element);
      this.connection(`connected to sila ${message.sila}`);
    } else if (message.kind === "model") this.live?.learnt(message.model, message.scene);
    else if (message.kind === "frame") {
      this.live?.show(message);
      const drawn = message.pedestrians.length;
      this.undrawn.textContent = drawn < message.count ? `${count(drawn)} of ${count(message.count)} pedestrians are drawn.` : "";
    } else this.showMetrics(message);
  }

  private showMetrics(metrics: Metrics): void {
    const now = (performance.now() - this.began) / 1000;
    const moment = momentOf(metrics, now / 60);
    this.tiles.pedestrians.set(count(metrics.pedestrians), metrics.rejected > 0 ? `${count(metrics.rejected)} lines rejected so far` : "no line rejected");
    if (moment) this.tiles.error.set(`${number(moment.mhd_m)} m`, `${count(metrics.horizons_s.at(-1)!)} s horizon; ${besideConstant(moment.mhd_m, moment.constant_mhd_m)}`);
    const ninety = metrics.nominal.findIndex((p) => Math.abs(p - 0.9) < 1e-9);
    const fifty = metrics.nominal.findIndex((p) => Math.abs(p - 0.5) < 1e-9);
    const coverage = metrics.coverage.at(-1)?.[ninety] ?? -1;
    this.tiles.regions.set(coverage >= 0 ? percent(coverage) : "–", `over the last ${plural(metrics.scored_pedestrians, "pedestrian")}`);
    this.tiles.size.set(count(metrics.size), `${plural(metrics.episodes, "episode")}, ${plural(metrics.tracks, "track")}${metrics.learning ? "; learning" : ""}`);
    if (this.seen && now - this.seen.at >= 1) {
      this.tiles.rate.set(count(Math.round((metrics.predictions - this.seen.predictions) / (now - this.seen.at))), metrics.dropped > 0 ? `${count(metrics.dropped)} dropped so far` : "none dropped");
      this.seen = { predictions: metrics.predictions, at: now };
    }
    this.seen ??= { predictions: metrics.predictions, at: now };
    const { alarm, error_m, reference_m, half_width_m } = metrics.drift;
    const alarms = [alarm && `Drift: the error of the last pedestrians is ${number(error_m)} m, that of earlier ones ${number(reference_m)} ± ${number(half_width_m)} m.`, metrics.last_error && `An episode failed: ${metrics.last_error}`].filter(Boolean).join(" ");
    if (this.alarm.textContent !== alarms) this.alarm.textContent = alarms;  // a screen reader reads each change
    this.alarm.hidden = alarms === "";
    const share = (value: number | undefined): string => value === undefined || value < 0 ? "–" : percent(value, 1);
    this.table.replaceChildren(...metrics.moving.map((horizon, i) => h("tr", {}, h("th", { scope: "row" }, `${count(metrics.horizons_s[i]!)} s`), h("td", {}, count(horizon.windows)), h("td", {}, `${number(horizon.mhd_m)} m`), h("td", {}, `${number(horizon.constant_mhd_m)} m`),
      h("td", {}, share(metrics.coverage[i]?.[fifty])), h("td", {}, share(metrics.coverage[i]?.[ninety])))));
    this.expectation.textContent = metrics.learning_curve === "" ? "" : `Expected error: ${metrics.learning_curve}.`;
    this.counters.textContent = `${count(metrics.detections)} detections, ${count(metrics.predictions)} predictions, ${count(metrics.scored)} of them scored. Errors are over moving pedestrians, coverage over all.`;
    const last = this.moments.at(-1);
    if (moment && (!last || moment.at - last.at > 1 / 60 || moment.episodes !== last.episodes)) {
      this.moments = appended(this.moments, moment);
      this.errors.redraw();
      this.growth.redraw();
    }
  }
}

const page = new LivePage();
document.getElementById("app")!.replaceChildren(page.element);

/** The service sends five messages a second; without any for this time the connection is lost, which a browser may not notice. */
const silence_s = 10;

/** Connects, and again after increasing times when the connection closes. */
function connect(wait_s: number): void {
  const address = new URL("live", location.href);
  address.protocol = location.protocol === "https:" ? "wss:" : "ws:";
  address.search = location.search;
  const socket = new WebSocket(address);
  let [next, shown] = [wait_s, Promise.resolve()];  // one message after another: a picture takes a while
  let silence: number | undefined;
  socket.onmessage = (event) => {
    next = 1;
    clearTimeout(silence);
    silence = window.setTimeout(() => socket.close(), silence_s * 1000);
    shown = shown.then(() => page.take(JSON.parse(String(event.data)) as Message)).catch((error: unknown) => page.connection(`This page cannot be shown: ${String(error)}`));
  };
  socket.onclose = () => {
    page.connection(`the connection is closed; trying again in ${count(next)} s`);
    setTimeout(() => connect(Math.min(30, next * 2)), next * 1000);
  };
}
connect(1);
