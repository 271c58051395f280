// Puts the report together.
import { readData, type ReportData } from "./data";
import { besideConstant, count, h, number, percent, plural, start } from "./dom";
import { learntSection } from "./learnt";
import { backdropOf, type Backdrop } from "./place";
import { playerSection } from "./player";
import { accuracySection, learningSection, worstSection } from "./quality";
import { settingsSection } from "./settings";
import { themeButton } from "./theme";
import { tryItSection } from "./tryit";

function tiles(data: ReportData): HTMLElement {
  const list: [string, string, string][] = [];
  const moving = data.evaluation?.groups["moving"];
  if (moving && moving.windows > 0) {
    const { horizon_s, model, constant_velocity } = moving.horizons.at(-1)!;
    list.push([`${number(model.weighted_mhd_m)} m`, `weighted MHD of moving pedestrians, ${count(horizon_s)} s ahead`, besideConstant(model.weighted_mhd_m, constant_velocity.weighted_mhd_m)]);
  }
  const regions = data.calibration?.at(-1);
  const ninety = regions?.nominal.findIndex((p) => Math.abs(p - 0.9) < 1e-9) ?? -1;
  if (regions && ninety >= 0) list.push([percent(regions.observed[ninety]!), "of all true positions", "in the nominal 90 % regions"]);
  if (data.model) {
    list.push([count(data.model.size), "model size", `${plural(data.model.primitives.length, "primitive")}, ${plural(data.model.transitions.length, "transition")}`]);
    list.push([count(data.model.tracks), "tracks learnt", `in ${plural(data.model.episodes, "episode")}`]);
    const seconds = (data.episodes ?? []).reduce((sum, e) => sum + e.seconds, 0);
    if (seconds > 0) list.push([`${number(seconds / (data.episodes ?? []).length)} s`, "for each episode", `${number(seconds, 1)} s in all`]);
  }
  return h("ul", { class: "tiles" }, ...list.map(([value, what, more]) => h("li", {}, h("b", {}, value), h("span", {}, what), h("small", {}, more))));
}

function page(data: ReportData, backdrop?: Backdrop): HTMLElement[] {
  const place = data.scene?.known ? data.scene.name : "";  // the scene of a model has no name
  const title = place || (data.model ? data.name : "Comparison of methods");
  const heading = place.charAt(0).toUpperCase() + place.slice(1) || title;
  document.title = `sila: ${title}`;
  const player = playerSection(data, backdrop);
  const sections = [learntSection(data), player?.element, tryItSection(data), accuracySection(data), learningSection(data), worstSection(data, player?.show), settingsSection(data)].filter((section) => section !== undefined);
  const links = sections.map((section) => h("a", { href: `#${section.id}` }, section.querySelector("h2")?.textContent ?? ""));
  return [h("a", { class: "skip", href: "#main" }, "To the report"),
          h("header", {}, h("div", { class: "top" }, h("div", {}, h("p", { class: "brand" }, "sila · motion at intersections"), h("h1", {}, heading)), themeButton()), tiles(data), h("nav", { "aria-label": "Sections" }, ...links)),
          h("main", { id: "main" }, ...sections),
          h("footer", {}, `Made by sila ${data.sila}. Everything is inside this file; nothing is loaded from anywhere.`)];
}

start("This report", async (text) => {
  const data = readData(text);
  return page(data, data.picture ? await backdropOf(data.picture, data.camera) : undefined);
});
