// The configuration and the versions that made what is shown.
import type { ReportData } from "./data";
import { count, h } from "./dom";
import { isObject } from "./results";

/** Dotted paths and values, in order. */
export function flatten(value: unknown, prefix = ""): [string, string][] {
  if (!isObject(value)) return [[prefix, typeof value === "string" ? value : JSON.stringify(value)]];
  return Object.entries(value).flatMap(([key, inner]) => flatten(inner, prefix ? `${prefix}.${key}` : key));
}

export function settingsSection(data: ReportData): HTMLElement {
  const properties: [string, string][] = [["report by", `sila ${data.sila}`]];
  if (data.written_by) properties.push(["model written by", `sila ${data.written_by}`]);
  properties.push(["file", data.name + (data.bytes ? ` (${count(Math.round(data.bytes / 1024))} KiB)` : "")]);
  if (data.rows) properties.push(["rows of the tracks", `${count(data.rows.rows_read)} read, ${count(data.rows.rows_kept)} kept`]);
  const body = h("tbody");
  const rows = flatten(data.configuration ?? (isObject(data.results) ? data.results["configuration"] ?? data.results["experiment"] ?? {} : {})).filter(([path]) => path);
  const fill = (filter: string): void => {
    const wanted = filter.trim().toLowerCase();
    body.replaceChildren(...rows.filter(([path, value]) => `${path} ${value}`.toLowerCase().includes(wanted)).map(([path, value]) => h("tr", {}, h("th", { scope: "row" }, path), h("td", {}, value))));
  };
  const search = h("input", { type: "search", id: "filter", placeholder: "e.g. threshold" });
  search.addEventListener("input", () => fill(search.value));
  fill("");
  return h("section", { id: "made" }, h("h2", {}, "Versions and settings"), h("dl", { class: "properties" }, ...properties.flatMap(([name, value]) => [h("dt", {}, name), h("dd", {}, value)])),
    rows.length > 0 ? h("details", {}, h("summary", {}, `Configuration: ${rows.length} values`), h("label", { class: "choice" }, h("span", {}, "Find"), search), h("div", { class: "scroll tall" }, h("table", { class: "settings" }, body))) : undefined);
}
