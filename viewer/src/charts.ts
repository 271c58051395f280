// Charts of Observable Plot, drawn anew when their width changes, in the colours of the page.
import { h } from "./dom";

/** A figure that is drawn for its width; `draw` returns the chart. */
export function figure(title: string, alt: string, draw: (width: number) => Element, note?: string): HTMLElement {
  const place = h("div", { class: "chart", role: "img", "aria-label": alt });
  let width = 0;
  new ResizeObserver(() => {
    const now = Math.floor(place.clientWidth);
    if (now === width || now === 0) return;
    width = now;
    const chart = draw(width);
    chart.setAttribute("aria-hidden", "true");
    place.replaceChildren(chart);
  }).observe(place);
  return h("figure", {}, h("figcaption", {}, title), place, note ? h("p", { class: "quiet" }, note) : undefined);
}

/** What all charts have in common. */
export const common = (width: number) => ({ width, height: Math.max(200, Math.min(300, width * 0.62)), marginLeft: 48, marginRight: 14, marginTop: 26, marginBottom: 38,
  style: { background: "transparent", color: "var(--text)", fontSize: "12px", overflow: "visible" } });

export interface LegendEntry { name: string; colour: string; dash?: boolean; mark?: string }

export function legend(entries: readonly LegendEntry[]): HTMLElement {
  return h("ul", { class: "keys" }, ...entries.map(({ name, colour, dash, mark }) => h("li", {}, mark ? h("span", { class: "mark", style: `--c:${colour}` }, mark) : h("span", { class: dash ? "line dash" : "line", style: `--c:${colour}` }), name)));
}
