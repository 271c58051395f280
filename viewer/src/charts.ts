// Charts of Observable Plot, drawn anew when their width changes, in the colours of the page.
import { h } from "./dom";

/** A figure that is drawn for its width, and again with new data by `redraw`; `draw` returns the chart. */
export function redrawable(title: string, alt: string, draw: (width: number) => Element, note?: string): { element: HTMLElement; redraw: () => void } {
  const place = h("div", { class: "chart", role: "img", "aria-label": alt });
  let width = 0;
  const redraw = (): void => {
    width = Math.floor(place.clientWidth);
    if (width === 0) return;
    const chart = draw(width);
    chart.setAttribute("aria-hidden", "true");
    place.replaceChildren(chart);
  };
  new ResizeObserver(() => { if (Math.floor(place.clientWidth) !== width) redraw(); }).observe(place);
  return { element: h("figure", {}, h("figcaption", {}, title), place, note ? h("p", { class: "quiet" }, note) : undefined), redraw };
}

export const figure = (...given: Parameters<typeof redrawable>): HTMLElement => redrawable(...given).element;

/** What all charts have in common. */
export const common = (width: number) => ({ width, height: Math.max(200, Math.min(300, width * 0.62)), marginLeft: 48, marginRight: 14, marginTop: 26, marginBottom: 38,
  style: { background: "transparent", color: "var(--text)", fontSize: "12px", overflow: "visible" } });

export interface LegendEntry { name: string; colour: string; dash?: boolean; mark?: string }

export function legend(entries: readonly LegendEntry[]): HTMLElement {
  return h("ul", { class: "keys" }, ...entries.map(({ name, colour, dash, mark }) => h("li", {}, mark ? h("span", { class: "mark", style: `--c:${colour}` }, mark) : h("span", { class: dash ? "line dash" : "line", style: `--c:${colour}` }), name)));
}
