// The live page of `sila serve`: who is about, what is expected of them, how the model grows and how well it does.
import { gridY, lineY, plot, ruleY } from "@observablehq/plot";
import type { ModelData, Scene } from "./data";
import { common, figure, legend } from "./charts";
import { count, h, number, percent, plural, s, toggle } from "./dom";
import { pointsOf } from "./geometry";
import { grown, lit, momentOf, remembered, type Facts, type Frame, type Message, type Moment } from "./live_data";
import { methodColour } from "./palette";
import { PlaceMap, type Bounds } from "./place";
import { arrowPath, shapeOf, type Shape } from "./primitives";
import { themeButton } from "./theme";

const ours = methodColour.sila;
const constant = methodColour["constant velocity"];

/** The map with primitives below and people above. */
class LiveMap {
  readonly map: PlaceMap;
  private shapes: Shape[] = [];
  private readonly drawn: SVGElement[] = [];
  private readonly below = s("g", { class: "primitives" });
  private readonly people = s("g", { class: "people" });
  private frame: Frame = { kind: "frame", about: 0, people: [] };
  private box: Bounds | undefined;
  readonly visible = { primitives: true, ways: true };

  constructor(private readonly scene: Scene, model: ModelData) {
    const corner = scene.corners[scene.primary ?? 0]!;
    const [x, y] = corner.origin;
    this.map = new PlaceMap(scene, model.grid, [], { x0: x - 15, y0: y - 15, x1: x + 15, y1: y + 15 }, "Map of the place as it is now");
    this.map.show("grid", false);
    this.map.show("axes", false);
    this.map.top.append(this.below, this.people);
    this.map.onDraw(() => this.draw());
    this.learnt(model);
  }

  learnt(model: ModelData): void {
    const corner = this.scene.corners[this.scene.primary ?? 0]!;
    this.shapes = model.primitives.map((primitive, i) => shapeOf(primitive.cells, corner, model.grid, i));
    this.drawn.length = 0;
    this.drawn.push(...this.shapes.map((shape, i) => s("path", { class: "primitive", stroke: shape.colour, "data-primitive": i })));
    this.below.replaceChildren(...this.drawn);
    this.draw();
  }

  show(frame: Frame): void {
    this.frame = frame;
    const box = grown(this.box, frame.people, 6);
    if (box && box !== this.box) {
      this.box = box;
      this.map.frame(box);  // which draws
    } else {
      this.drawPeople();
    }
  }

  draw(): void {
    this.shapes.forEach((shape, i) => this.drawn[i]!.setAttribute("d", arrowPath(shape, this.map)));
    this.drawPeople();
  }

  private drawPeople(): void {
    const weights = lit(this.frame.people);
    this.below.setAttribute("visibility", this.visible.primitives ? "visible" : "hidden");
    this.drawn.forEach((path, i) => {
      const weight = weights.get(i) ?? 0;
      path.setAttribute("stroke-width", (1.1 + 2.4 * weight).toFixed(2));
      path.setAttribute("opacity", (0.22 + 0.78 * Math.sqrt(weight)).toFixed(2));
      path.classList.toggle("lit", weight > 0);
    });
    const shapes: SVGElement[] = [];
    for (const person of this.frame.people) {
      const trail = pointsOf(person.trail);
      const here = trail.at(-1);
      if (!here) continue;
      shapes.push(s("path", { class: "past", d: this.map.path(trail) }));
      if (this.visible.ways) for (const mode of [...(person.modes ?? [])].reverse()) {
        shapes.push(s("path", { class: "mode", d: this.map.path([here, ...pointsOf(mode.path)]), "stroke-width": (1 + 4.5 * mode.weight).toFixed(1), opacity: (0.2 + 0.8 * Math.sqrt(mode.weight)).toFixed(2) }));
      }
      const [x, y] = this.map.project(here);
      shapes.push(s("circle", { class: "person", cx: x, cy: y, r: 5, "data-id": person.id }, s("title", {}, person.modes ? `${person.name}, novelty ${percent(person.novelty ?? 0)}` : `${person.name}, just come`)));
    }
    this.people.replaceChildren(...shapes);
  }
}

function tile(id: string, what: string): { element: HTMLElement; set: (value: string, more: string) => void } {
  const [value, more] = [h("b", { id }, "–"), h("small", {}, "")];
  return { element: h("li", {}, value, h("span", {}, what), more), set: (text, extra) => { value.textContent = text; more.textContent = extra; } };
}

/** A chart that is drawn anew whenever there is something new. */
function chart(title: string, alt: string, draw: (width: number) => Element, note?: string): { element: HTMLElement; redraw: () => void } {
  const element = figure(title, alt, draw, note);
  const place = element.querySelector<HTMLElement>(".chart")!;
  return { element, redraw: () => { if (place.clientWidth > 0) { const made = draw(Math.floor(place.clientWidth)); made.setAttribute("aria-hidden", "true"); place.replaceChildren(made); } } };
}

class LivePage {
  readonly element: HTMLElement;
  private live: LiveMap | undefined;
  private readonly place = h("div", { id: "map" }, h("p", { class: "quiet" }, "Waiting for the service …"));
  private readonly title = h("h1", {}, "Live");
  private readonly state = h("p", { class: "state", id: "state", role: "status" }, "connecting");
  private readonly alarm = h("p", { class: "alarm", id: "alarm", role: "alert", hidden: true });
  private readonly tiles = { people: tile("people", "pedestrians now"), error: tile("error", "weighted MHD"), regions: tile("regions", "of the truths in the 90 % regions"), size: tile("size", "model size"), rate: tile("rate", "predictions a second") };
  private moments: Moment[] = [];
  private readonly began = performance.now();
  private seen: { predictions: number; at: number } | undefined;
  private readonly errors = chart("Error of the last pedestrians who moved [m]", "Error of sila and of constant velocity over time", (width) => plot({ ...common(width), x: { label: "minutes" }, y: { label: null, grid: true, zero: true },
    marks: [gridY(), ruleY([0]), lineY(this.moments, { x: "at", y: "constant_mhd_m", stroke: constant, strokeWidth: 2, strokeDasharray: "5 4" }), lineY(this.moments, { x: "at", y: "mhd_m", stroke: ours, strokeWidth: 2.5 })] }));
  private readonly growth = chart("Size of the model", "Model size over time", (width) => plot({ ...common(width), x: { label: "minutes" }, y: { label: null, grid: true, zero: true },
    marks: [gridY(), ruleY([0]), lineY(this.moments, { x: "at", y: "size", stroke: ours, strokeWidth: 2.5, curve: "step-after" })] }));
  private readonly table = h("tbody", { id: "horizons" });
  private readonly account = h("p", { class: "quiet", id: "account" });

  constructor() {
    const check = (text: string, key: "primitives" | "ways") => toggle(text, true, (on) => { if (this.live) { this.live.visible[key] = on; this.live.draw(); } });
    this.element = h("div", {},
      h("header", {}, h("div", { class: "top" }, h("div", {}, h("p", { class: "brand" }, "sila · live"), this.title), themeButton()), this.state, this.alarm, h("ul", { class: "tiles" }, ...Object.values(this.tiles).map((t) => t.element))),
      h("main", { id: "main" },
        h("section", { id: "now" }, h("h2", {}, "Now"), this.place, h("div", { class: "controls legend" }, check("primitives, lit where they are expected to be walked", "primitives"), check("ways with their weights", "ways"))),
        h("section", { id: "learning" }, h("h2", {}, "While it learns"), legend([{ name: "sila", colour: ours }, { name: "constant velocity", colour: constant, dash: true }]), h("div", { class: "charts" }, this.errors.element, this.growth.element)),
        h("section", { id: "scores" }, h("h2", {}, "How good it was lately"), h("div", { class: "scroll" }, h("table", { class: "numbers" }, h("thead", {}, h("tr", {}, ...["ahead", "judged", "sila", "constant velocity", "in 50 %", "in 90 %"].map((name) => h("th", { scope: "col" }, name)))), this.table)), this.account)));
  }

  connection(text: string): void {
    this.state.textContent = text;
  }

  take(message: Message): void {
    if (message.kind === "hello") {
      const title = message.scene.known ? message.scene.name : "a place without a name";
      this.title.textContent = title.charAt(0).toUpperCase() + title.slice(1);
      document.title = `sila live: ${title}`;
      this.live = new LiveMap(message.scene, message.model);
      this.place.replaceChildren(this.live.map.element);
      this.connection(`connected to sila ${message.sila}`);
    } else if (message.kind === "model") this.live?.learnt(message.model);
    else if (message.kind === "frame") this.live?.show(message);
    else this.tell(message);
  }

  private tell(facts: Facts): void {
    const now = (performance.now() - this.began) / 1000;
    const moment = momentOf(facts, now / 60);
    this.tiles.people.set(count(facts.pedestrians), facts.refused > 0 ? `${count(facts.refused)} lines refused so far` : "every line taken");
    if (moment) {
      const gain = 1 - moment.mhd_m / moment.constant_mhd_m;
      this.tiles.error.set(`${number(moment.mhd_m)} m`, `${count(facts.horizons_s.at(-1)!)} s ahead; ${gain >= 0 ? percent(gain) + " less" : percent(-gain) + " more"} than constant velocity`);
    }
    const ninety = facts.nominal.findIndex((p) => Math.abs(p - 0.9) < 1e-9);
    const fifty = facts.nominal.findIndex((p) => Math.abs(p - 0.5) < 1e-9);
    const held = facts.coverage.at(-1)?.[ninety] ?? -1;
    this.tiles.regions.set(held >= 0 ? percent(held) : "–", `over the last ${plural(facts.remembered, "pedestrian")}`);
    this.tiles.size.set(count(facts.size), `${plural(facts.episodes, "episode")}, ${plural(facts.tracks, "track")}${facts.learning ? "; learning" : ""}`);
    if (this.seen && now - this.seen.at >= 1) {
      this.tiles.rate.set(count(Math.round((facts.predictions - this.seen.predictions) / (now - this.seen.at))), facts.dropped > 0 ? `${count(facts.dropped)} dropped so far` : "none dropped");
      this.seen = { predictions: facts.predictions, at: now };
    }
    this.seen ??= { predictions: facts.predictions, at: now };
    this.alarm.hidden = !facts.drift.alarm && facts.last_error === "";
    this.alarm.textContent = facts.drift.alarm ? `Drift: the error of the last pedestrians is ${number(facts.drift.error_m)} m, before it was ${number(facts.drift.reference_m)} ± ${number(facts.drift.half_width_m)} m.` : facts.last_error === "" ? "" : `An episode failed: ${facts.last_error}`;
    const share = (value: number | undefined): string => value === undefined || value < 0 ? "–" : percent(value, 1);
    this.table.replaceChildren(...facts.moving.map((horizon, i) => h("tr", {}, h("th", { scope: "row" }, `${count(facts.horizons_s[i]!)} s`), h("td", {}, count(horizon.windows)), h("td", {}, `${number(horizon.mhd_m)} m`), h("td", {}, `${number(horizon.constant_mhd_m)} m`),
      h("td", {}, share(facts.coverage[i]?.[fifty])), h("td", {}, share(facts.coverage[i]?.[ninety])))));
    this.account.textContent = `${count(facts.detections)} detections, ${count(facts.predictions)} predictions, ${count(facts.scored)} of them judged by what then happened. Errors are over pedestrians who move, regions over all.`;
    const last = this.moments.at(-1);
    if (moment && (!last || moment.at - last.at > 1 / 60 || moment.episodes !== last.episodes)) {
      this.moments = remembered(this.moments, moment);
      this.errors.redraw();
      this.growth.redraw();
    }
  }
}

const page = new LivePage();
document.getElementById("app")!.replaceChildren(page.element);

/** Connects, and again when the connection goes, ever more slowly. */
function connect(wait_s: number): void {
  const address = new URL("live", location.href);
  address.protocol = location.protocol === "https:" ? "wss:" : "ws:";
  address.search = location.search;
  const socket = new WebSocket(address);
  let next = wait_s;
  socket.onmessage = (event) => { next = 1; page.take(JSON.parse(String(event.data)) as Message); };
  socket.onclose = () => {
    page.connection(`the service is gone; trying again in ${count(next)} s`);
    setTimeout(() => connect(Math.min(30, next * 2)), next * 1000);
  };
}
connect(1);
