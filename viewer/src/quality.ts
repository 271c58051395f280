// Accuracy of the predictions: learning curves, errors by horizon, calibration, and the largest errors.
import { areaY, axisX, barY, dot, gridY, line, lineY, link, plot, ruleX, ruleY, text } from "@observablehq/plot";
import type { EpisodeData, Evaluation, LearningCurve, ProbabilityScore, ReportData } from "./data";
import { common, figure, legend } from "./charts";
import { choice, count, h, number, percent, plural, thead } from "./dom";
import { colourOfMethod, markOf, methodColour } from "./palette";
import { comparisonsOf, constantOf, curvesOf, placesOf, rowsOf, type Comparison, type Quantity, type Row } from "./results";

const ours = methodColour.sila;
const constant = methodColour["constant velocity"];

/** Errors and size while the model learnt. */
export function learningSection(data: ReportData): HTMLElement | undefined {
  const rows = rowsOf(data.results);
  const episodes = data.episodes ?? [];
  if (rows.length === 0 && episodes.length < 2) return undefined;
  const section = h("section", { id: "learning" }, h("h2", {}, "Learning curves"));
  if (rows.length > 0) section.append(...experimentCurves(data.results, rows));
  else section.append(h("p", { class: "lead" }, "Of this model file. Error curves with their spread over trials, beside other methods, come from `sila experiment`: add its results.json by --results."));
  if (episodes.length >= 2 && rows.length === 0) section.append(h("div", { class: "charts" }, errorFigure(data.learning_curve), sizeFigure(episodes), secondsFigure(episodes)));
  return section;
}

/** Errors on each batch before it was learnt, the fitted curve, and what half as many tracks again would give. */
function errorFigure(curve: LearningCurve | undefined): HTMLElement | undefined {
  if (!curve || curve.points.length < 2) return undefined;
  const points = curve.points.map((p) => ({ tracks: p.tracks, ratio: p.model_m / p.constant_velocity_m }));
  const fit = curve.fit;
  const first = points[0]!.tracks;
  const fitted = fit ? Array.from({ length: 61 }, (_, i) => first + (fit.with_more.tracks - first) * i / 60).map((n) => [n, fit.asymptote + fit.slope / Math.sqrt(n)] as [number, number]) : [];
  const words = fit ? `Fitted: ${fit.text}. The bar is the 90 % interval.` : undefined;
  return figure("Error on each batch before it was learnt, relative to constant velocity", words ?? "Prequential errors of the episodes", (width) => plot({ ...common(width),
    x: { label: "tracks learnt", zero: true, nice: true }, y: { label: null, grid: true, nice: true },
    marks: [ruleY([1], { stroke: constant, strokeDasharray: "5 4", strokeWidth: 2 }), dot(points, { x: "tracks", y: "ratio", fill: ours, r: 3 }), line(fitted, { stroke: ours, strokeWidth: 2.2 }),
      ...(fit ? [ruleX([fit.with_more], { x: "tracks", y1: "lower", y2: "upper", stroke: ours, strokeWidth: 2 }), dot([fit.with_more], { x: "tracks", y: "ratio", stroke: ours, fill: "var(--page)", r: 4 })] : [])] }), words);
}

function sizeFigure(episodes: readonly EpisodeData[]): HTMLElement {
  return figure("Size of the model (primitives and transitions)", "Model size after each episode", (width) => plot({ ...common(width),
    x: { label: "episode", ticks: Math.min(10, episodes.length) }, y: { label: null, zero: true, grid: true },
    marks: [ruleY([0]), areaY(episodes, { x: "number", y: "size_after", fill: ours, fillOpacity: 0.15 }), lineY(episodes, { x: "number", y: "size_after", stroke: ours, strokeWidth: 2.5 }),
            dot(episodes.slice(-1), { x: "number", y: "size_after", fill: ours }), text(episodes.slice(-1), { x: "number", y: "size_after", text: (e: EpisodeData) => String(e.size_after), dy: -12, fill: "currentColor" })] }));
}

function secondsFigure(episodes: readonly EpisodeData[]): HTMLElement {
  return figure("Seconds for each episode", "Seconds that each episode took", (width) => plot({ ...common(width), x: { label: "episode", axis: null }, y: { label: null, zero: true },
    marks: [gridY(), barY(episodes, { x: "number", y: "seconds", fill: ours, inset: 0.5 }), ruleY([0]), axisX({ ticks: episodes.filter((_, i) => i % Math.ceil(episodes.length / 10) === 0).map((e) => e.number), label: "episode", tickSize: 0 })] }));
}

function experimentCurves(results: unknown, rows: readonly Row[]): HTMLElement[] {
  const places = placesOf(rows);
  const methods = [...new Set(rows.map((row) => row.method))];
  const charts = h("div", { class: "charts" });
  const show = (place: string): void => {
    const trials = new Set(rows.filter((row) => row.place === place).map((row) => row.trial)).size;
    const spread = `Mean of ${plural(trials, "trial")}; the band is one standard deviation to each side.`;
    charts.replaceChildren(
      curveFigure("Weighted MHD on held-back pedestrians who move [m]", rows, place, "error_m", methods, spread, constantOf(rows, place)),
      curveFigure("Size of the model", rows, place, "size", methods),
      curveFigure("Seconds for each episode", rows, place, "seconds", methods));
    const comparisons = comparisonsOf(results, place).filter((c) => c.against === "constant velocity");
    if (comparisons.length > 0) charts.append(comparisonFigure(comparisons, methods));
  };
  const picker = choice("Place", places.map((place) => [place, place || "all"] as const), places[0]!, show, "place");
  const entries = methods.map((name, i) => ({ name, colour: colourOfMethod(name, i), mark: markOf(i)[1] }));
  show(places[0]!);
  return [h("div", { class: "controls" }, places.length > 1 && picker.label, legend([...entries, { name: "constant velocity", colour: constant, dash: true }])), charts];
}

function curveFigure(title: string, rows: readonly Row[], place: string, quantity: Quantity, methods: readonly string[], note?: string, cv?: number): HTMLElement {
  const curves = curvesOf(rows, place, quantity);
  const ends = curves.map((c) => `${c.method} ends at ${number(c.points.at(-1)?.mean ?? NaN, quantity === "size" ? 0 : 3)}`).join(", ");
  return figure(title, `${title} over the tracks learnt: ${ends}`, (width) => plot({ ...common(width),
    x: { label: "tracks learnt", zero: true, nice: true }, y: { label: null, grid: true, zero: quantity !== "error_m", nice: true },
    marks: [...(cv !== undefined ? [ruleY([cv], { stroke: constant, strokeDasharray: "5 4", strokeWidth: 2 })] : []),
      ...curves.flatMap(({ method, points }) => {
        const colour = colourOfMethod(method, methods.indexOf(method));
        const end = dot(points.slice(-1), { x: "tracks", y: "mean", fill: colour, r: 5, symbol: markOf(methods.indexOf(method))[0] });
        if (points.length > 1) return [areaY(points, { x: "tracks", y1: "low", y2: "high", fill: colour, fillOpacity: 0.15 }), lineY(points, { x: "tracks", y: "mean", stroke: colour, strokeWidth: 2.2 }), end];
        return [ruleX(points, { x: "tracks", y1: "low", y2: "high", stroke: colour, strokeWidth: 2 }), end];
      })] }), note);
}

function comparisonFigure(comparisons: readonly Comparison[], methods: readonly string[]): HTMLElement {
  const rows = comparisons.map((c) => ({ ...c, low: 100 * c.low, high: 100 * c.high, middle: 100 * c.difference }));
  const words = rows.map((c) => `${c.method} ${number(c.middle, 1)} %`).join(", ");
  return figure("Error relative to constant velocity [%], for the same people in the same trials", `Differences: ${words}`, (width) => plot({ ...common(width), height: 60 + 28 * rows.length, marginLeft: 120,
    x: { label: "smaller is better", grid: true, nice: true }, y: { label: null, domain: methods.filter((m) => rows.some((r) => r.method === m)) },
    marks: [ruleX([0], { stroke: constant, strokeWidth: 2, strokeDasharray: "5 4" }),
      ...rows.flatMap((c) => [link([c], { x1: "low", x2: "high", y1: "method", y2: "method", stroke: colourOfMethod(c.method, methods.indexOf(c.method)), strokeWidth: 3 }),
                              dot([c], { x: "middle", y: "method", r: 6, symbol: markOf(methods.indexOf(c.method))[0], fill: colourOfMethod(c.method, methods.indexOf(c.method)) })])] }),
    "The bar is the 95 % interval by resampling people.");
}

/** Errors by horizon, and the coverage of the nominal regions. */
export function accuracySection(data: ReportData): HTMLElement | undefined {
  const evaluation = data.evaluation;
  if (!evaluation) return undefined;
  const names = Object.keys(evaluation.groups).filter((name) => (evaluation.groups[name]?.windows ?? 0) > 0);
  const charts = h("div", { class: "charts" });
  const group = evaluation.groups["moving"];
  if (group && group.windows > 0) {
    charts.append(figure("Weighted MHD of moving pedestrians [m], by how far ahead", "Errors of sila and constant velocity by horizon", (width) => plot({ ...common(width),
      x: { label: "seconds ahead", ticks: group.horizons.map((x) => x.horizon_s), tickFormat: count }, y: { label: null, grid: true, zero: true },
      marks: [ruleY([0]), line(group.horizons.map((x) => [x.horizon_s, x.constant_velocity.weighted_mhd_m]), { stroke: constant, strokeWidth: 2, strokeDasharray: "5 4", marker: "dot" }),
              line(group.horizons.map((x) => [x.horizon_s, x.model.weighted_mhd_m]), { stroke: ours, strokeWidth: 2.5, marker: "dot" })] })));
  }
  const diagrams = data.calibration ?? [];
  if (diagrams.length > 0) charts.append(calibrationFigure(data));
  const skipped = Object.entries(evaluation.skipped);
  const section = h("section", { id: "accuracy" }, h("h2", {}, "Accuracy"), h("p", { class: "lead" }, calibrationWords(data)), legend([{ name: "sila", colour: ours }, { name: "constant velocity", colour: constant, dash: true }]), charts,
    h("div", { class: "scroll" }, h("table", { class: "numbers" }, h("caption", {}, "At the whole horizon; metres, smaller is better"),
      thead("group", "windows", "weighted MHD", "constant velocity", "change", "ADE", "FDE", "kinematics alone", "modes"),
      h("tbody", {}, ...names.map((name) => {
        const g = evaluation.groups[name]!;
        const { model, constant_velocity } = g.horizons.at(-1)!;
        const change = model.weighted_mhd_m / constant_velocity.weighted_mhd_m - 1;
        return h("tr", {}, h("th", { scope: "row" }, name), ...[count(g.windows), number(model.weighted_mhd_m, 3), number(constant_velocity.weighted_mhd_m, 3), `${change > 0 ? "+" : "−"}${number(Math.abs(100 * change), 1)} %`,
          number(model.ade_m, 3), number(model.fde_m, 3), percent(g.fallback_rate), number(g.modes, 1)].map((cell) => h("td", {}, cell)));
      })))),
    reliabilityTable(evaluation),
    skipped.length > 0 ? h("p", { class: "quiet" }, `Not scored: ${skipped.map(([reason, n]) => `${plural(n, "track")}, ${reason}`).join("; ")}.`) : undefined);
  return section;
}

/** Whether people who stand start, people who walk stop, and where both will be: stated probabilities and what happened. */
function reliabilityTable(evaluation: Evaluation): HTMLElement | undefined {
  const percents = (values: Record<string, number>): string => Object.entries(values).map(([name, share]) => `${name} ${percent(share)}`).join(", ");
  const row = (who: string, score: ProbabilityScore, happened: string): HTMLElement => h("tr", {}, h("th", { scope: "row" }, who),
    ...[count(score.horizon_s), count(score.windows), happened, number(score.brier, 3), number(score.base_brier, 3), number(score.calibration_error, 3)].map((cell) => h("td", {}, cell)));
  const rows = [
    ...(["start", "stop"] as const).flatMap((what) => (evaluation.changes?.[what] ?? []).map((score) => row(what === "start" ? "standing: starts" : "walking: stops", score, percent(score.rate)))),
    ...(["standing", "walking"] as const).flatMap((who) => (evaluation.outcomes?.[who] ?? []).map((score) => row(`${who}: where`, score, percents(score.rates)))),
  ];
  if (rows.length === 0) return undefined;
  return h("div", { class: "scroll" }, h("table", { class: "numbers", id: "reliability" },
    h("caption", {}, "Stated probabilities of starting, of stopping, and of where a person will be. Smaller is better; the base rate is that of these predictions"),
    thead("group", "seconds ahead", "predictions", "happened", "Brier score", "of the base rate", "calibration error"),
    h("tbody", {}, ...rows)));
}

function calibrationFigure(data: ReportData): HTMLElement {
  const diagrams = data.calibration!;
  const n = Math.max(1, data.tracks_scored ?? 1);
  const shown = diagrams.length > 3 ? [diagrams[0]!, diagrams[Math.floor((diagrams.length - 1) / 2)]!, diagrams.at(-1)!] : diagrams;
  const colours = ["var(--other-2)", "var(--retrain)", "var(--sila)"].slice(-shown.length);
  const band = Array.from({ length: 41 }, (_, i) => ({ p: i / 40, low: Math.max(0, i / 40 - 2 * Math.sqrt(i / 40 * (1 - i / 40) / n)), high: Math.min(1, i / 40 + 2 * Math.sqrt(i / 40 * (1 - i / 40) / n)) }));
  const percents = { ticks: [0, 0.25, 0.5, 0.75, 1], tickFormat: (v: number) => `${Math.round(100 * v)}` };
  const figureElement = figure("Calibration: share of outcomes that the nominal regions covered", "Reliability diagram", (width) => plot({ ...common(width),
    x: { label: "nominal [%]", domain: [0, 1], ...percents }, y: { label: null, domain: [0, 1], grid: true, ...percents },
    marks: [areaY(band, { x: "p", y1: "low", y2: "high", fill: "currentColor", fillOpacity: 0.08 }), line([[0, 0], [1, 1]], { stroke: "currentColor", strokeOpacity: 0.5, strokeDasharray: "2 3" }),
      ...shown.flatMap((d, i) => {
        const points = d.nominal.map((p, k): [number, number] => [p, d.observed[k]!]);
        return [line([[0, 0], ...points, [1, 1]], { stroke: colours[i]!, strokeWidth: 2.2 }), dot(points, { fill: colours[i]!, r: 4, symbol: markOf(i)[0] })];
      })] }),
    `Below the diagonal the regions are too small. ${plural(n, "pedestrian")} cannot show a difference from perfect calibration inside the grey band.`);
  figureElement.append(legend(shown.map((d, i) => ({ name: `${count(d.horizon_s)} s ahead`, colour: colours[i]!, mark: markOf(i)[1] }))));
  return figureElement;
}

/** In words what the regions of the longest horizon cover. */
export function calibrationWords(data: ReportData): string {
  const last = data.calibration?.at(-1);
  const scored = data.predictions_scored ?? 0;
  const of = (p: number): string => {
    const i = last?.nominal.findIndex((nominal) => Math.abs(nominal - p) < 1e-9) ?? -1;
    return i >= 0 ? percent(last!.observed[i]!) : "?";
  };
  if (!last) return "No prediction has its whole future in the tracks.";
  return `${plural(scored, "prediction")} of ${plural(data.tracks_scored ?? 0, "pedestrian")} with their whole future recorded. ${count(last.horizon_s)} s ahead, the 50 % region covered ${of(0.5)} of the true positions and the 90 % region ${of(0.9)}.`;
}

export function worstSection(data: ReportData, show: ((track: string, t0: number) => void) | undefined): HTMLElement | undefined {
  const worst = data.worst ?? [];
  if (worst.length === 0) return undefined;
  const playable = new Set((data.played ?? []).map((p) => p.track));
  const most = Math.max(...worst.map((w) => w.mhd_m));
  return h("section", { id: "worst" }, h("h2", {}, "Largest errors"), h("p", { class: "lead" }, "The worst prediction of each of these pedestrians, and why."),
    h("ol", { class: "worst" }, ...worst.map((w) => h("li", {}, h("div", { class: "worst-bar", "aria-hidden": "true", style: `--share:${(100 * w.mhd_m / most).toFixed(0)}%` }),
      h("div", {}, h("strong", {}, w.reason), h("p", { class: "quiet" }, `Pedestrian ${w.track} at ${number(w.t0, 1)} s: weighted MHD ${number(w.mhd_m)} m; constant velocity ${number(w.constant_mhd_m)} m`)),
      show && playable.has(w.track) ? h("button", { type: "button", onclick: () => show(w.track, w.t0), "aria-label": `Show the prediction for pedestrian ${w.track}` }, "Show") : undefined))));
}
