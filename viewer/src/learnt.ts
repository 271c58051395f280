// "What was learnt": the map with its primitives, the episodes, and the graph.
import type { EpisodeData, ReportData, Transition } from "./data";
import { count, h, number, plural, s, toggle } from "./dom";
import { toWorld, cellCentre, pointsOf } from "./geometry";
import { PrimitiveGraph, type GraphNode } from "./graph";
import { onlyStage, stagesOf, type Fate, type Primitive, type Stage } from "./history";
import { boundsOf, PlaceMap } from "./place";
import { arrowPath, shapeOf, type Shape } from "./primitives";

const signs: Record<Fate, string> = { kept: "", added: "+", fused: "∪", part: "÷" };

export function learntSection(data: ReportData): HTMLElement | undefined {
  const { model, scene } = data;
  const corner = scene?.corners[scene.primary];
  if (!model || !scene || !corner) return undefined;
  const whole = stagesOf(model, data.episodes ?? []);
  const stages = whole ?? [onlyStage(model)];
  const grid = model.grid;
  const points = model.primitives.flatMap(({ cells }) => {
    const centres = [];
    for (let i = 0; i + 2 < cells.length; i += 3) centres.push(toWorld(corner, cellCentre(grid, cells[i]!, cells[i + 1]!)));
    return centres;
  });
  const map = new PlaceMap(scene, grid, data.drawn_tracks ?? [], boundsOf(points.length > 0 ? points : (data.drawn_tracks ?? []).flatMap(pointsOf), 1.5),
                           "Map of the place with the primitives that were learnt");
  const strength = new Map<number, number>();
  stages.at(-1)!.primitives.forEach((p, i) => strength.set(p.key, model.primitives[i]?.weight ?? 1));

  let at = stages.length - 1;
  let selected: number | undefined;
  let highlight = false;
  const shapes = new Map<string, Shape>();
  const shape = (p: Primitive): Shape => {
    const id = `${p.key}:${p.cells.join()}`;
    const known = shapes.get(id) ?? shapeOf(p.cells, corner, grid, p.key);
    shapes.set(id, known);
    return known;
  };
  const stage = (): Stage => stages[at]!;

  const choose = (index: number | undefined): void => {
    selected = index !== undefined && index >= 0 && index < stage().primitives.length ? index : undefined;
    graph.select(selected);
    drawMap();
    describe();
  };
  const graph = new PrimitiveGraph(scene.y_axis === "down", choose);
  const card = h("div", { class: "card", id: "primitive-card", "aria-live": "polite" });
  const picker = h("select", { id: "primitive", "aria-label": "Primitive" });
  picker.addEventListener("change", () => choose(picker.value === "" ? undefined : Number(picker.value)));

  function drawMap(): void {
    const group = document.createDocumentFragment();
    const labels: SVGElement[] = [];
    stage().primitives.forEach((primitive, i) => {
      const { colour, centre } = shape(primitive);
      const changed = primitive.fate !== "kept";
      const strong = selected === i || (selected === undefined && highlight && changed);
      const weak = selected !== undefined ? selected !== i : highlight && !changed;
      const d = arrowPath(shape(primitive), map);
      if (strong) group.append(s("path", { class: "halo", d }));
      const arrows = s("path", { class: `primitive${strong ? " strong" : ""}${weak ? " weak" : ""}`, d, stroke: colour, "stroke-width": (1.3 + 0.5 * Math.min(3, Math.sqrt((strength.get(primitive.key) ?? 1) - 1 + 0.01))).toFixed(2) });
      arrows.append(s("title", {}, `Primitive ${i}`));
      arrows.addEventListener("click", () => choose(selected === i ? undefined : i));
      group.append(arrows);
      if (strong) {
        const [x, y] = map.project(centre);
        labels.push(s("g", { class: "tag" }, s("circle", { cx: x, cy: y, r: 11, stroke: colour }), s("text", { x, y, dy: "0.35em" }, highlight && selected === undefined ? signs[primitive.fate] : i)));
      }
    });
    map.top.replaceChildren(group, ...labels);
  }

  function describe(): void {
    const { primitives, transitions } = stage();
    picker.replaceChildren(h("option", { value: "" }, `all ${primitives.length}`), ...primitives.map((_, i) => h("option", { value: i }, `primitive ${i}`)));
    picker.value = selected === undefined ? "" : String(selected);
    if (selected === undefined) {
      const busiest = [...transitions].sort((a, b) => b[2] - a[2]).slice(0, 6);
      card.replaceChildren(h("p", {}, `${plural(primitives.length, "primitive")}, ${plural(transitions.length, "transition")}. Choose one on the map, in the graph or in the list.`),
                           transitionTable("Busiest transitions", busiest));
      return;
    }
    const primitive = primitives[selected]!;
    const to = transitions.filter(([a]) => a === selected).sort((a, b) => b[2] - a[2]);
    const from = transitions.filter(([a, b]) => b === selected && a !== selected).sort((a, b) => b[2] - a[2]);
    const weight = strength.get(primitive.key);
    card.replaceChildren(h("p", {}, h("strong", {}, `Primitive ${selected}`), `: ${plural(primitive.cells.length / 3, "cell")}`,
                           weight !== undefined && at === stages.length - 1 ? `, made of ${count(weight)} that were learnt in batches` : ""),
                         transitionTable("Then", to), transitionTable("Before", from));
  }

  function transitionTable(title: string, rows: readonly Transition[]): HTMLElement {
    const most = Math.max(1, ...rows.map((r) => r[2]));
    if (rows.length === 0) return h("p", { class: "quiet" }, `${title}: nothing`);
    return h("table", { class: "bars" }, h("caption", {}, title), ...rows.slice(0, 8).map(([a, b, n]) =>
      h("tr", {}, h("th", { scope: "row" }, `${a} → ${b}`), h("td", {}, h("span", { class: "bar", style: `width:${(100 * n / most).toFixed(0)}%` }), h("span", { class: "value" }, count(n))))));
  }

  function show(next: number, marked: boolean): void {
    at = Math.max(0, Math.min(stages.length - 1, next));
    highlight = marked;
    selected = undefined;
    const nodes: GraphNode[] = stage().primitives.map((p, index) => ({ index, centre: shape(p).centre, colour: shape(p).colour,
      strength: strength.get(p.key) ?? 1, faded: highlight && p.fate === "kept" }));
    graph.show(nodes, stage().transitions);
    graph.select(selected);
    drawMap();
    describe();
  }
  map.onDraw(drawMap);

  const layers = h("div", { class: "controls" }, h("label", { class: "choice" }, h("span", {}, "Show"), picker),
    toggle("tracks", true, (on) => map.show("tracks", on)), toggle("grid", true, (on) => map.show("grid", on)), toggle("curb axes", true, (on) => map.show("axes", on)));
  const section = h("section", { id: "learnt" }, h("h2", {}, "What was learnt"),
    h("p", { class: "lead" }, "A motion primitive is a pattern of motion that many tracks share. Its arrows, one in each cell of the grid, have the colour of its mean direction. ",
      scene.known ? "" : "No scene was given: the model is drawn at a right-angled corner."),
    layers, h("div", { class: "two" }, h("div", {}, map.element, whole ? episodeBar(stages, data.episodes ?? [], (n, marked) => show(n, marked)) : noStory(data)),
      h("div", {}, h("h3", {}, "Transitions"), graph.element, card)));
  show(at, false);
  return section;
}

function noStory(data: ReportData): HTMLElement {
  const some = (data.episodes ?? []).length;
  return h("p", { class: "quiet" }, some > 0 ? "The model file does not have the changes of all its episodes, so only the present model is shown." : "The model file has no record of its episodes.");
}

/** The slider over the episodes, with what each one did. */
function episodeBar(stages: readonly Stage[], episodes: readonly EpisodeData[], show: (index: number, marked: boolean) => void): HTMLElement {
  const last = stages.length - 1;
  const slider = h("input", { type: "range", id: "episode", min: 0, max: last, step: 1, value: last, "aria-label": "Episode" });
  const words = h("p", { class: "episode-words", id: "episode-words", "aria-live": "polite" });
  const strip = h("div", { class: "strip", "aria-hidden": "true" });
  const most = Math.max(1, ...stages.map((stage) => stage.added + stage.fused + stage.split));
  const columns = stages.map((stage, i) => {
    const part = (kind: string, n: number) => h("i", { class: kind, style: `height:${(100 * n / most).toFixed(1)}%` });
    const column = h("button", { type: "button", tabindex: -1, title: `Episode ${stage.episode}` }, part("split", stage.split), part("fused", stage.fused), part("added", stage.added));
    column.addEventListener("click", () => go(i));
    return column;
  });
  strip.append(...columns);
  let timer: number | undefined;
  const play = h("button", { type: "button", id: "grow", class: "primary" }, "▶ Play the episodes");
  const stop = (): void => {
    window.clearInterval(timer);
    timer = undefined;
    play.textContent = "▶ Play the episodes";
  };
  function say(index: number): void {
    const [stage, episode] = [stages[index]!, episodes[index]!];
    slider.value = String(index);
    slider.setAttribute("aria-valuetext", `Episode ${stage.episode} of ${stages.length}`);
    columns.forEach((column, i) => column.classList.toggle("now", i === index));
    words.replaceChildren(h("strong", {}, `Episode ${stage.episode} of ${stages.length}`), ` · ${plural(episode.tracks, "track")} in ${number(episode.seconds)} s · size ${episode.size_before} → ${episode.size_after}: `,
      h("span", { class: "key added" }, `+ ${stage.added} added`), " ", h("span", { class: "key fused" }, `∪ ${stage.fused} fused`), " ", h("span", { class: "key split" }, `÷ ${stage.split} split`));
  }
  function go(index: number): void {
    say(index);
    show(index, true);
  }
  slider.addEventListener("input", () => { stop(); go(Number(slider.value)); });
  const whole = h("button", { type: "button", onclick: () => { stop(); say(last); show(last, false); } }, "Whole model");
  play.addEventListener("click", () => {
    if (timer !== undefined) return stop();
    play.textContent = "❚❚ Pause";
    let index = Number(slider.value) >= last ? -1 : Number(slider.value);
    const tick = (): void => {
      go(++index);
      if (index >= last) { stop(); }
    };
    tick();
    timer = window.setInterval(tick, Math.max(250, Math.min(900, 12000 / stages.length)));
  });
  say(last);
  return h("div", { class: "episodes" }, words, strip, slider, h("div", { class: "controls" }, play, whole));
}

