// Predictions of people that the model had not seen, played in time.
import type { Played, Prediction, ReportData } from "./data";
import { choice, h, number, percent, plural, s, toggle } from "./dom";
import { between, ellipseOf, ellipseOutline, pointAt, pointsOf, positionAt, type Point } from "./geometry";
import { boundsOf, PlaceMap, type Backdrop, type Bounds } from "./place";
import { currentPrediction, errorsAt, mostTelling, type Renew } from "./predicted";

/** On a narrower map [pixels] only the shown prediction is framed, not the whole path of a person. */
const narrow = 560;

/** The part of the place where a person and these predictions are, `least` metres at least. */
function around(path: readonly number[], predictions: readonly Prediction[], least: number): Bounds {
  const box = boundsOf([...pointsOf(path), ...predictions.flatMap((q) => [...pointsOf(q.constant), ...pointsOf(q.truth), ...q.modes.flatMap((m) => pointsOf(m.path))])], 1.5, 0);
  const [x, y] = [(box.x0 + box.x1) / 2, (box.y0 + box.y1) / 2];
  const [w, t] = [Math.max(box.x1 - box.x0, least) / 2, Math.max(box.y1 - box.y0, least) / 2];
  return { x0: x - w, x1: x + w, y0: y - t, y1: y + t };
}

export interface PlayerSection { element: HTMLElement; show: (track: string, t0: number) => void }

/** Predictions on the map, or on a picture of the camera. */
export function playerSection(data: ReportData, backdrop?: Backdrop): PlayerSection | undefined {
  const played = (data.played ?? []).filter((p) => p.predictions.length > 0);
  const scene = data.scene;
  if (!scene || played.length === 0) return undefined;
  const opening = mostTelling(played)!;
  const map = new PlaceMap(scene, undefined, data.drawn_tracks ?? [], around(opening.person.xy, opening.person.predictions, 14), "Map with the predictions of one pedestrian", backdrop);

  let person: Played = opening.person;
  let now = 0;
  let anchor = -Infinity;
  let framed: Prediction | undefined;
  let renew: Renew = "horizon";
  let speed = 1;
  let frame: number | undefined;
  const visible = { modes: true, ellipses: true, constant: true, future: true };

  const time = h("input", { type: "range", id: "time", step: 0.05, "aria-label": "Time" });
  const readout = h("p", { class: "readout", id: "readout" });
  const play = h("button", { type: "button", id: "play", class: "primary" });
  const list = choice("Pedestrian", played.map((p) => [p.track, `${p.track} · ${plural(p.predictions.length, "prediction")}`] as const), person.track, (track) => pick(track), "pedestrian");

  const end = (): number => person.t.at(-1) ?? 0;
  function pick(track: string, t0?: number): void {
    person = played.find((p) => p.track === track) ?? person;
    list.select.value = person.track;
    const first = person.predictions[0]!;
    time.min = String(person.t[0] ?? 0);
    time.max = String(end());
    anchor = t0 ?? -Infinity;
    framed = undefined;
    map.frame(around(person.xy, person.predictions, 14));
    setTime((t0 ?? first.t0) + 2.6);
  }
  function setTime(t: number): void {
    now = Math.max(person.t[0] ?? 0, Math.min(end(), t));
    time.value = String(now);
    time.setAttribute("aria-valuetext", `${number(now - (person.t[0] ?? 0), 1)} seconds`);
    draw();
  }
  function stop(): void {
    if (frame !== undefined) cancelAnimationFrame(frame);
    frame = undefined;
    play.textContent = "▶ Play";
  }
  function start(): void {
    play.textContent = "❚❚ Pause";
    if (now >= end() - 1e-6) setTime(person.predictions[0]!.t0);
    let last = performance.now();
    const tick = (stamp: number): void => {
      setTime(now + speed * Math.max(0, Math.min(0.1, (stamp - last) / 1000)));
      last = stamp;
      if (now >= end() - 1e-6) stop();
      else frame = requestAnimationFrame(tick);
    };
    frame = requestAnimationFrame(tick);
  }
  const step = (by: number): void => {
    const i = played.indexOf(person);
    pick(played[(i + by + played.length) % played.length]!.track);
  };
  play.addEventListener("click", () => frame === undefined ? start() : stop());
  time.addEventListener("input", () => { stop(); setTime(Number(time.value)); });

  function draw(): void {
    const prediction = currentPrediction(person.predictions, now, renew, anchor);
    if (prediction && prediction !== framed && map.size[0] > 0 && map.size[0] < narrow) {
      framed = prediction;
      return map.frame(around(prediction.observed, [prediction], 8));  // which draws anew
    }
    const shapes: SVGElement[] = [];
    const ahead = prediction ? Math.min(now - prediction.t0, prediction.t.at(-1) ?? 0) : 0;
    const { i } = between(person.t, now);
    const path = pointsOf(person.xy);
    const here = positionAt(person.t, person.xy, now);
    if (visible.future) shapes.push(s("path", { class: "future", d: map.path([here, ...path.slice(i + 1)]) }));
    shapes.push(s("path", { class: "past", d: map.path([...path.slice(0, i + 1), here]) }));
    if (prediction) shapes.push(...drawPrediction(prediction, ahead));
    const [x, y] = map.project(here);
    shapes.push(s("circle", { class: "person", cx: x, cy: y, r: 7 }));
    // On a picture some are where the camera does not see them.
    map.top.replaceChildren(...shapes.filter((shape) => !shape.outerHTML.includes("NaN")));
    tell(prediction, ahead);
  }

  function drawPrediction(prediction: Prediction, ahead: number): SVGElement[] {
    const [shapes, labels]: [SVGElement[], SVGElement[]] = [[], []];
    const start = pointAt(prediction.observed, prediction.observed.length / 2 - 1);
    const times = [0, ...prediction.t];
    if (visible.constant) {
      shapes.push(s("path", { class: "constant", d: map.path([start, ...pointsOf(prediction.constant)]) }));
      const [x, y] = map.project(positionAt(times, [...start, ...prediction.constant], ahead));
      shapes.push(s("rect", { class: "constant-now", x: x - 4.5, y: y - 4.5, width: 9, height: 9 }));
    }
    prediction.modes.forEach((mode, m) => {
      const whole = pointsOf(mode.path);
      const strength = 0.25 + 0.75 * Math.sqrt(mode.weight);
      if (visible.ellipses) {
        const drawn = ellipses(prediction, m, ahead);
        shapes.push(...drawn.shapes);
        labels.push(...drawn.labels);
      }
      if (visible.modes) {
        shapes.push(s("path", { class: "mode", d: map.path([start, ...whole]), "stroke-width": (1.5 + 6 * mode.weight).toFixed(1), opacity: strength.toFixed(2) }));
        const [x, y] = map.project(positionAt(times, [...start, ...mode.path], ahead));
        shapes.push(s("circle", { class: "mode-now", cx: x, cy: y, r: 3 + 2.5 * mode.weight, opacity: strength.toFixed(2) }));
        if (mode.weight >= 0.03 && whole.length > 1) {
          // Beyond the end of the path, in its direction.
          const [[ax, ay], [bx, by]] = [map.project(whole[whole.length - 2]!), map.project(whole.at(-1)!)];
          const angle = Math.atan2(by - ay, bx - ax);
          const [x, y] = [bx + 26 * Math.cos(angle), by + 16 * Math.sin(angle)];
          labels.push(s("g", { class: "weight", opacity: Math.max(0.75, strength).toFixed(2) }, s("rect", { x: x - 19, y: y - 9, width: 38, height: 18, rx: 9 }), s("text", { x, y, dy: "0.35em" }, percent(mode.weight))));
        }
      }
    });
    return [...shapes, ...labels];
  }

  /** The ellipses of one mode at one moment, each labelled with the share of the mode that it covers. */
  function ellipses(prediction: Prediction, m: number, ahead: number): { shapes: SVGElement[]; labels: SVGElement[] } {
    const mode = prediction.modes[m]!;
    const [shapes, labels]: [SVGElement[], SVGElement[]] = [[], []];
    if (mode.weight < 0.05 || ahead <= 0) return { shapes, labels };
    const times = prediction.t;
    const { i, f } = between(times, ahead);
    const grow = ahead < (times[0] ?? 0) ? (ahead / times[0]!) ** 2 : 1;
    const entry = (c: number): number => grow * ((mode.cov[3 * i + c] ?? 0) * (1 - f) + (f > 0 ? (mode.cov[3 * (i + 1) + c] ?? 0) * f : 0));
    const start = pointAt(prediction.observed, prediction.observed.length / 2 - 1);
    const [x, y] = positionAt([0, ...times], [...start, ...mode.path], ahead);
    for (const share of [0.9, 0.5]) {
      const outline = ellipseOutline(ellipseOf(entry(0), entry(1), entry(2), share)).map(([dx, dy]): Point => [x + dx, y + dy]);
      shapes.push(s("path", { class: `ellipse of-${100 * share}`, d: map.path(outline, true), opacity: (0.35 + 0.65 * mode.weight).toFixed(2) }));
      if (m > 0) continue;
      const [top] = outline.map(map.project).sort((a, b) => a[1] - b[1]);
      labels.push(s("text", { class: "share", x: map.project([x, y])[0], y: top![1] - 3 }, `${percent(share)} inside`));
    }
    return { shapes, labels };
  }

  function tell(prediction: Prediction | undefined, ahead: number): void {
    if (!prediction) {
      readout.replaceChildren(`Observed for ${number(now - (person.t[0] ?? 0), 1)} s; the first prediction is at ${number(person.predictions[0]!.t0 - (person.t[0] ?? 0), 1)} s.`);
      return;
    }
    const errors = errorsAt(prediction, ahead);
    const modes = prediction.modes.map((mode) => percent(mode.weight)).slice(0, 4).join(", ");
    readout.replaceChildren(h("strong", {}, `${number(ahead, 1)} s ahead`), ` · most likely mode off by `, h("strong", {}, `${number(errors.model)} m`), `, constant velocity by ${number(errors.constant)} m · ${plural(prediction.modes.length, "mode")}: ${modes}`,
      prediction.fallback ? " · no learnt track is near: kinematics alone" : "", ` · over all ${number(prediction.t.at(-1) ?? 0, 1)} s: weighted MHD ${number(prediction.mhd_m)} m (constant velocity ${number(prediction.constant_mhd_m)} m)`);
  }
  map.onDraw(draw);

  const redraw = (key: keyof typeof visible) => (on: boolean) => { visible[key] = on; draw(); };
  const controls = h("div", { class: "controls" }, h("div", { class: "stepper" }, h("button", { type: "button", "aria-label": "Previous pedestrian", onclick: () => step(-1) }, "◀"), list.label, h("button", { type: "button", "aria-label": "Next pedestrian", onclick: () => step(1) }, "▶")),
    choice("New prediction", [["horizon", "when the last one is over"], ["often", "every second"]] as const, renew, (value) => { renew = value; draw(); }).label,
    choice("Speed", [["0.5", "½ ×"], ["1", "1 ×"], ["2", "2 ×"], ["4", "4 ×"]] as const, "1", (value) => { speed = Number(value); }).label);
  const legend = h("div", { class: "controls legend" }, toggle("modes with their weights", true, redraw("modes")), toggle("50 % and 90 % ellipses", true, redraw("ellipses")), toggle("constant velocity", true, redraw("constant")), toggle("what happened", true, redraw("future")));
  legend.querySelectorAll("label").forEach((label, i) => label.append(h("span", { class: `swatch ${["of-modes", "of-ellipses", "of-constant", "of-future"][i]}`, "aria-hidden": "true" })));
  const element = h("section", { id: "predictions" }, h("h2", {}, "Predictions"),
    h("p", { class: "lead" }, `${plural(data.tracks_scored ?? played.length, "pedestrian")} scored, ${played.length} of them shown. Space plays, the arrow keys move through time and from one person to the next.`),
    controls, map.element, h("div", { class: "timeline" }, play, time), readout, legend);
  element.addEventListener("keydown", (event) => {
    const target = event.target as HTMLElement;
    if (target.closest("select, button, input[type=checkbox]") || event.shiftKey || event.ctrlKey || event.metaKey || event.altKey) return;
    const slider = target === time;
    if (event.key === " ") play.click();
    else if (event.key === "ArrowRight" && !slider) { stop(); setTime(now + 0.2); }
    else if (event.key === "ArrowLeft" && !slider) { stop(); setTime(now - 0.2); }
    else if (event.key === "ArrowDown" && !slider) step(1);
    else if (event.key === "ArrowUp" && !slider) step(-1);
    else return;
    event.preventDefault();
  });
  stop();
  map.show("axes", false);
  pick(person.track, opening.t0);
  return { element, show: (track, t0) => { stop(); pick(track, t0); element.scrollIntoView({ behavior: "auto", block: "start" }); } };
}
