// The page of `sila scene edit`: a scene over tracks or over the picture of a camera, changed by hand and saved as a file.
import { applied, determinant, fitCamera, type Homography, type PointPair } from "./camera";
import { readData, type EditorData, type Scene } from "./data";
import { placedBy } from "./distances";
import { choice, h, number, plural, s, start, thead } from "./dom";
import { pointsOf, toWorld, type Point } from "./geometry";
import { backdropOf, boundsOf, PlaceMap, type Backdrop } from "./place";
import { distanceFromCurb, drawnCorner, headingOf, mapped, medianOf, moved, pointBeside, pointsIn, round, sceneText, sine, squareCorner, turned, widened, widthOf, type Axis, type SceneCorner } from "./scene_file";
import { themeButton } from "./theme";

/** Length of an axis, and where on it its width is pulled [pixels of a drawing of 480 pixels or more]. */
const axisLength = 120;
const widthAt = 165;
/** How far curbs are drawn on a picture [m]. */
const curbLength_m = 40;
const axes = [1, 2] as const;

interface Handle { element: SVGGElement; at: () => Point }

/** A number with its name; `change` gets what is typed as soon as it is one. */
function field(text: string, step: number, change: (value: number) => void): { label: HTMLLabelElement; set: (value: number) => void } {
  const input = h("input", { type: "number", step });
  input.addEventListener("input", () => { if (Number.isFinite(input.valueAsNumber)) change(input.valueAsNumber); });
  const set = (value: number): void => { if (document.activeElement !== input) input.value = Number.isFinite(value) ? String(round(value, 3)) : ""; };
  return { label: h("label", {}, h("span", {}, text), input), set };
}

class Editor {
  readonly element: HTMLElement;
  private corners: SceneCorner[];
  private chosen: number;
  /** The corner is not edited yet and is where the camera puts the tracks. */
  private follows: boolean;
  private pairs: PointPair[];
  private adding = false;
  private refused = "";
  private readonly scene: Scene;
  private readonly map: PlaceMap;
  private readonly tracks = s("path", { class: "tracks" });
  private readonly curbs = s("g");
  private readonly arrows = s("path", { class: "axis" });
  private readonly ofCorner = s("g");
  private readonly ofCamera = s("g");
  private handles: Handle[] = [];
  private readonly fields: { set: () => void }[] = [];
  private readonly form = h("div", { class: "form" });
  private readonly points = h("tbody", { id: "points" });
  /** Between the points [m], as typed; NaN for the others. */
  private readonly distances: number[][] = [];
  private readonly lengths = h("div", { class: "form lengths", id: "distances" });
  private readonly lengthState = h("p", { class: "quiet", id: "distance-state", role: "status" });
  private readonly addButton = h("button", { type: "button", id: "add", "aria-pressed": "false" }, "Add a point");
  private readonly cameraState = h("p", { class: "quiet", id: "camera-state", role: "status" });
  private readonly state = h("p", { class: "quiet", id: "state", role: "status" });
  private readonly text = h("textarea", { id: "json", readonly: true, rows: 16, spellcheck: "false", "aria-label": "The scene file" });
  private readonly saveButton = h("button", { type: "button", id: "save", class: "primary" }, "Save");

  constructor(private readonly data: EditorData, private readonly backdrop?: Backdrop) {
    this.corners = [...data.file.corners];
    this.follows = this.corners.length === 0 && data.tracks_in === "picture";
    this.chosen = Math.max(0, this.corners.findIndex((corner) => corner.primary));
    this.pairs = pointsIn(data.file);
    this.scene = { name: data.file.name, known: true, y_axis: data.file.y_axis, primary: this.chosen, corners: [] };
    const ground = data.tracks_in === "ground" ? data.tracks.flatMap(pointsOf) : [];
    const origins = this.corners.map((corner) => corner.origin);
    const all = backdrop ? { x0: 0, y0: 0, x1: backdrop.width, y1: backdrop.height } : boundsOf([...ground, ...origins], 3, 0.01, origins);
    this.map = new PlaceMap(this.scene, undefined, [], all, "Map of the tracks and the corner", backdrop);
    this.map.svg.setAttribute("role", "group");  // screen readers skip what is in an image
    this.map.show("axes", false);
    this.map.top.append(this.tracks, this.curbs, this.arrows, this.ofCorner, this.ofCamera);
    this.map.onDraw(() => this.draw());
    this.makeCornerHandles();
    this.makeForm();
    this.text.addEventListener("focus", () => this.text.select());
    this.saveButton.addEventListener("click", () => this.save());
    this.element = h("div", {},
      h("header", {}, h("div", { class: "top" }, h("div", {}, h("p", { class: "brand" }, "sila · scene editor"), h("h1", {}, "Where the corner is")), themeButton())),
      h("main", { id: "main" },
        h("section", { id: "place" }, h("h2", {}, "Corner"), h("p", { class: "lead" }, `${data.proposal} Drag the corner, the tips of its axes (along the curbs, away from the corner) and the squares on the edges of the sidewalks; the arrow keys move what has the focus.`),
          h("div", { class: "two" }, this.map.element, h("div", {}, this.form, this.state))),
        backdrop && this.cameraSection(),
        h("section", { id: "file" }, h("h2", {}, "Scene file"), h("p", { class: "lead" }, `Save it, or copy its text, and give it to sila as --scene ${data.file_name}.`), h("div", { class: "controls" }, this.saveButton), this.text)),
      h("footer", {}, `Made by sila ${data.sila}. Everything is inside this file; nothing is loaded from anywhere and nothing is sent.`));
    this.update();
  }

  private get corner(): SceneCorner | undefined {
    return this.corners[this.chosen];
  }

  private change(edited: SceneCorner | undefined): void {
    this.refused = edited ? "" : "The curbs must be 20.5 to 159.5 degrees apart.";
    if (edited) {
      this.corners[this.chosen] = edited;
      this.follows = false;
    }
    this.update();
  }

  private makeForm(): void {
    const add = (text: string, step: number, get: (corner: SceneCorner) => number, set: (corner: SceneCorner, value: number) => SceneCorner | undefined): HTMLElement => {
      const made = field(text, step, (value) => { if (this.corner) this.change(set(this.corner, value)); });
      const show = (): void => made.set(this.corner ? get(this.corner) : NaN);
      this.fields.push({ set: show });
      made.label.addEventListener("focusout", show);  // what is saved, if what was typed is not
      return made.label;
    };
    const heading = (corner: SceneCorner, axis: Axis, degrees: number): SceneCorner | undefined => {
      const angle = degrees * Math.PI / 180;
      return turned(corner, axis, [corner.origin[0] + Math.cos(angle), corner.origin[1] + Math.sin(angle)]);
    };
    const words = (text: string, value: string, change: (value: string) => void): HTMLElement => {
      const input = h("input", { type: "text", value, maxlength: 80 });
      input.addEventListener("input", () => { change(input.value); this.update(); });
      return h("label", { class: "wide" }, h("span", {}, text), input);
    };
    const name = words("Name of the corner", this.corner?.name ?? "corner", (value) => { if (this.corner) this.corners[this.chosen] = { ...this.corner, name: value }; pick.select.options[this.chosen]?.replaceChildren(value); });
    const pick = choice("Corner", this.corners.map((corner, i) => [String(i), corner.name] as const), String(this.chosen), (value) => {
      this.chosen = Number(value);
      name.querySelector("input")!.value = this.corner!.name;
      this.update();
    }, "corner");
    this.form.append(words("Name of the place", this.data.file.name, (value) => { this.data.file.name = value; }), ...(this.corners.length > 1 ? [pick.label] : []), name,
      add("x [m]", 0.1, (corner) => corner.origin[0], (corner, value) => moved(corner, [value, corner.origin[1]])),
      add("y [m]", 0.1, (corner) => corner.origin[1], (corner, value) => moved(corner, [corner.origin[0], value])),
      ...axes.flatMap((axis) => [add(`Heading of axis ${axis} [degrees]`, 1, (corner) => headingOf(corner, axis), (corner, value) => heading(corner, axis, value)),
                                 add(`Width of sidewalk ${axis} [m]`, 0.1, (corner) => widthOf(corner, axis), (corner, value) => widened(corner, axis, value))]));
  }

  /** What can be dragged, by pointer or with the arrow keys: `drag` gets the new place on the drawing. */
  private handle(label: string, shape: SVGElement, at: () => Point, drag: (to: Point) => void): Handle {
    const element = s("g", { class: "handle", tabindex: 0, role: "button", "aria-label": `${label}; the arrow keys move it` }, s("title", {}, label), s("circle", { class: "touch", r: 16 }), shape);
    let held: Point | undefined;
    element.addEventListener("pointerdown", (event) => {
      element.setPointerCapture(event.pointerId);
      element.focus();
      const [[x, y], [px, py]] = [at(), this.pointer(event)];
      held = [x - px, y - py];
    });
    element.addEventListener("pointermove", (event) => {
      const [px, py] = this.pointer(event);
      if (held) drag([px + held[0], py + held[1]]);
    });
    for (const end of ["pointerup", "pointercancel"]) element.addEventListener(end, () => { held = undefined; });
    element.addEventListener("keydown", (event) => {
      const by = ({ ArrowLeft: [-2, 0], ArrowRight: [2, 0], ArrowUp: [0, -2], ArrowDown: [0, 2] } as Record<string, Point>)[event.key];
      if (!by || event.shiftKey) return;
      event.preventDefault();
      const [x, y] = at();
      drag([x + by[0], y + by[1]]);
    });
    return { element, at };
  }

  private makeCornerHandles(): void {
    const onGround = (edit: (corner: SceneCorner, to: Point) => SceneCorner | undefined) => (pixel: Point): void => {
      const to = this.map.unproject(pixel);
      if (this.corner && to) this.change(edit(this.corner, to));
    };
    const at = (where: (corner: SceneCorner) => Point) => (): Point => this.corner ? this.map.project(where(this.corner)) : [NaN, NaN];
    const made = [this.handle("Corner", s("circle", { r: 8 }), at((corner) => corner.origin), onGround(moved))];
    for (const axis of axes) {
      made.push(this.handle(`Axis ${axis}`, s("g", {}, s("circle", { r: 10 }), s("text", { dy: "0.35em" }, axis)), at((corner) => this.onAxis(corner, axis, axisLength, 0)), onGround((corner, to) => turned(corner, axis, to))),
                this.handle(`Width of sidewalk ${axis}`, s("rect", { x: -7, y: -7, width: 14, height: 14 }), at((corner) => this.onAxis(corner, axis, widthAt, widthOf(corner, axis))), onGround((corner, to) => widened(corner, axis, distanceFromCurb(corner, axis, to)))));
    }
    this.handles = made;
    this.ofCorner.append(...made.map((handle) => handle.element));
  }

  /** A point on an axis, `pixels` of the drawing from the corner, moved `into` metres into the block. The point is nearer if the camera does not see that far. */
  private onAxis(corner: SceneCorner, axis: Axis, pixels: number, into: number): Point {
    const from = this.map.project(corner.origin);
    const away = (along: number): number => { const to = this.map.project(pointBeside(corner, axis, along, 0)); return Math.hypot(to[0] - from[0], to[1] - from[1]); };
    const wanted = pixels * Math.min(1, Math.min(...this.map.size) / 480);
    let [low, high] = [0, 200];
    for (let i = 0; i < 40; ++i) {
      const middle = (low + high) / 2;
      if (away(middle) < wanted) low = middle;  // not where it is NaN
      else high = middle;
    }
    return pointBeside(corner, axis, low, into);
  }

  private pointer(event: MouseEvent): Point {
    const box = this.map.svg.getBoundingClientRect();
    return [event.clientX - box.left, event.clientY - box.top];
  }

  private cameraSection(): HTMLElement {
    this.addButton.addEventListener("click", () => this.setAdding(!this.adding));
    const addAt = (pixel: Point): void => {
      this.pairs.push({ image: this.map.placeOf(pixel).map((value) => round(value, 1)) as Point, ground: [NaN, NaN] });
      this.setAdding(false);
      this.listPoints();
      this.update();
      this.points.querySelector<HTMLInputElement>("tr:last-child .x input")?.focus();
    };
    this.map.svg.addEventListener("click", (event) => { if (this.adding && !(event.target as Element).closest(".handle")) addAt(this.pointer(event)); });
    this.map.svg.addEventListener("keydown", (event) => { if (this.adding && event.key === "Enter") addAt([this.map.size[0] / 2, this.map.size[1] / 2]); });
    this.listPoints();
    return h("section", { id: "camera" }, h("h2", {}, "Camera"), h("p", { class: "lead" }, "Four or more points that you know in the picture and on the ground, such as corners of markings, convert pixels to metres. Add a point, click on the picture (or press Enter for its middle) and type where it is, in metres along axes of your choice: of a rectangle of 8 m by 21 m the points are 0, 0; 8, 0; 8, 21 and 0, 21. No three may lie on a line; points far apart are best, and a fifth one shows how well they agree."),
      h("div", { class: "controls" }, this.addButton), h("div", { class: "scroll" }, h("table", { class: "numbers" }, thead("point", "u [pixels]", "v [pixels]", "x [m]", "y [m]", "off by", ""), this.points)),
      h("p", { class: "lead" }, "If you do not know positions on the ground, measure the distances between the points and type them here: point 1 becomes 0, 0, and point 2 lies on the x axis. Four points need five distances; a sixth one shows how well they agree."), this.lengths, this.lengthState, this.cameraState);
  }

  private setAdding(on: boolean): void {
    this.adding = on;
    this.addButton.setAttribute("aria-pressed", String(on));
    this.addButton.textContent = on ? "Click on the picture …" : "Add a point";
    this.map.element.classList.toggle("adding", on);
  }

  /** The rows of the table and the marks on the picture, anew. */
  private listPoints(): void {
    const rows: HTMLElement[] = [];
    this.handles.splice(1 + 2 * axes.length);
    this.pairs.forEach((pair, i) => {
      const cell = (name: string, list: Point, k: 0 | 1): HTMLElement => {
        const input = h("input", { type: "number", step: "any", "aria-label": `Point ${i + 1}: ${name}`, value: Number.isFinite(list[k]) ? list[k] : "" });
        input.addEventListener("input", () => { list[k] = input.valueAsNumber; this.update(); });
        return h("td", { class: name }, input);
      };
      const remove = h("button", { type: "button", "aria-label": `Remove point ${i + 1}`, onclick: () => { for (const list of [this.pairs, this.distances, ...this.distances]) list.splice(i, 1); this.listPoints(); this.measure(); } }, "Remove");
      rows.push(h("tr", {}, h("th", { scope: "row" }, i + 1), cell("u", pair.image, 0), cell("v", pair.image, 1), cell("x", pair.ground, 0), cell("y", pair.ground, 1), h("td", { class: "residual" }), h("td", {}, remove)));
      this.handles.push(this.handle(`Point ${i + 1}`, s("g", { class: "known" }, s("path", { d: "M-12,0H-4M4,0H12M0,-12V-4M0,4V12" }), s("text", { x: 11, y: -8 }, i + 1)), () => this.map.place(pair.image), (to) => {
        [pair.image[0], pair.image[1]] = this.map.placeOf(to).map((value) => round(value, 1)) as Point;
        rows[i]!.querySelectorAll("input").forEach((input, k) => { if (k < 2) input.value = String(pair.image[k]); });
        this.update();
      }));
    });
    this.points.replaceChildren(...rows);
    this.listDistances();
    this.ofCamera.replaceChildren(...this.handles.slice(1 + 2 * axes.length).map((handle) => handle.element));
  }

  private listDistances(): void {
    const n = this.pairs.length;
    for (let i = 0; i < n; ++i) this.distances[i] = Array.from({ length: n }, (_, j) => this.distances[i]?.[j] ?? NaN);
    this.lengths.replaceChildren(...this.pairs.flatMap((_, i) => this.pairs.slice(i + 1).map((_, k) => {
      const j = i + 1 + k;
      const length = this.distances[i]![j]!;
      const input = h("input", { type: "number", step: 0.01, min: 0, value: Number.isNaN(length) ? "" : length });
      input.addEventListener("input", () => { this.distances[i]![j] = this.distances[j]![i] = input.valueAsNumber; this.measure(); });
      return h("label", {}, h("span", {}, `${i + 1} to ${j + 1} [m]`), input);
    })));
  }

  /** The places of the points by the distances between them, if any are typed. */
  private measure(): void {
    const typed = this.distances.flat().filter((length) => !Number.isNaN(length)).length / 2;
    const placed = placedBy(this.distances, this.pairs.map((pair) => pair.image));
    if (typed > 0 && typeof placed !== "string") this.pairs.forEach(({ ground }, i) => {
      [ground[0], ground[1]] = placed.points[i]!.map((value) => round(value, 3)) as Point;
      this.points.rows[i]!.querySelectorAll("input").forEach((input, k) => { if (k >= 2) input.value = String(ground[k - 2]); });
    });
    const spare = typed - (2 * this.pairs.length - 3);
    this.lengthState.textContent = typed === 0 ? "" : typeof placed === "string" ? `${placed.charAt(0).toUpperCase()}${placed.slice(1)}.` : spare > 0 ? `The distances agree within ${number(placed.residual_m)} m.` : "The distances place the points; one more would show an error.";
    this.update();
  }

  /** Puts the corner in the middle of the tracks in pixels: at each fit, because the first fits are of half-typed numbers. */
  private propose(camera: Homography): void {
    const middle = medianOf(this.data.tracks.map((track) => mapped(track, (pixel) => applied(camera, pixel))));
    const made = squareCorner(middle, this.scene.y_axis);
    this.corners = [{ ...made, name: this.corner?.name ?? made.name }];
  }

  /** Everything that follows from the corner and the points. */
  private update(): void {
    const complete = this.pairs.filter((pair) => [...pair.image, ...pair.ground].every(Number.isFinite));
    const fit = fitCamera(complete);
    const camera = typeof fit === "string" ? this.data.camera : fit.camera;
    if (this.map.backdrop) this.map.backdrop.camera = camera;
    if (camera) this.scene.y_axis = this.data.file.y_axis = determinant(camera) < 0 ? "up" : "down";
    if (camera && this.follows) this.propose(camera);
    this.scene.corners = this.corners.map(drawnCorner);
    this.points.querySelectorAll(".residual").forEach((cell, i) => { const k = complete.indexOf(this.pairs[i]!); cell.textContent = typeof fit === "string" || k < 0 ? "–" : `${number(fit.residuals_m[k]!)} m`; });
    this.cameraState.textContent = typeof fit !== "string" ? `The camera fits ${plural(complete.length, "point")}${complete.length === 4 ? " exactly, as any four do; a fifth would show an error" : ` within ${number(Math.max(...fit.residuals_m))} m`}.` : `${this.data.camera ? "The camera of the file is used until four points replace it" : "There is no camera yet"}: ${fit}.`;
    for (const one of this.fields) one.set();
    const mirrored = this.corner && (sine(this.corner) > 0) !== (this.scene.y_axis === "up");
    const hidden = this.backdrop && !camera;
    this.state.textContent = !hidden ? `${this.refused} ${mirrored ? "Axis 2 should be counter-clockwise of axis 1, seen from above: exchange their headings." : ""}`.trim() : "The corner and tracks in metres appear once the camera is known: give four points below.";
    for (const input of this.form.querySelectorAll("input")) input.disabled = !this.corner;
    this.saveButton.disabled = !this.corner;
    this.text.value = this.corner ? sceneText(this.data.file, this.corners, typeof fit === "string" ? [] : complete) : "";
    this.map.draw();
  }

  private draw(): void {
    this.tracks.setAttribute("d", this.data.tracks.map((track) => this.map.path(pointsOf(track), false, this.data.tracks_in === "picture" ? (point) => this.map.place(point) : this.map.project)).join(""));
    if (this.backdrop) this.curbs.replaceChildren(...this.scene.corners.flatMap((corner) => [0, 1].map((q) => {
      const [n1, n2] = [curbLength_m / corner.unit_m[0], curbLength_m / corner.unit_m[1]];
      const line = Array.from({ length: 161 }, (_, i): Point => i < 80 ? [q + n1 * (80 - i) / 80, q] : [q, q + n2 * (i - 80) / 80]);
      return s("path", { class: q === 0 ? "curb" : "wall", d: this.map.path(line.map((point) => toWorld(corner, point))) });
    })));
    const { corner } = this;
    this.arrows.setAttribute("d", corner ? axes.map((axis) => this.map.path([corner.origin, this.onAxis(corner, axis, axisLength, 0)])).join("") : "");
    for (const { element, at } of this.handles) {
      const [x, y] = at();
      element.setAttribute("visibility", Number.isFinite(x) ? "visible" : "hidden");
      if (Number.isFinite(x)) element.setAttribute("transform", `translate(${x.toFixed(1)} ${y.toFixed(1)})`);
    }
  }

  private save(): void {
    const address = URL.createObjectURL(new Blob([this.text.value], { type: "application/json" }));
    h("a", { href: address, download: this.data.file_name }).click();
    setTimeout(() => URL.revokeObjectURL(address), 10_000);
  }
}

start("This page", async (text) => {
  const data = readData<EditorData>(text);
  document.title = `sila: ${data.file.name}`;
  return [new Editor(data, data.picture ? await backdropOf(data.picture) : undefined).element];
});
