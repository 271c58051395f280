// The graph of primitives: transitions and their counts.
import { forceCollide, forceLink, forceSimulation, forceX, forceY, type SimulationNodeDatum } from "d3-force";
import type { Transition } from "./data";
import type { Point } from "./geometry";
import { count, h, plural, s } from "./dom";

export interface GraphNode {
  index: number;
  centre: Point;
  colour: string;
  strength: number;
  faded: boolean;
}
interface Placed extends SimulationNodeDatum { radius: number; home: Point }

/** Places on a unit-less plane: near where the primitives are, but apart from one another. The same for the same input. */
export function layout(nodes: readonly GraphNode[], transitions: readonly Transition[], width: number, height: number, yDown: boolean): Point[] {
  const xs = nodes.map((n) => n.centre[0]), ys = nodes.map((n) => n.centre[1]);
  const [x0, x1, y0, y1] = [Math.min(...xs), Math.max(...xs), Math.min(...ys), Math.max(...ys)];
  const margin = 26;
  const crowded = crowding(nodes.length, width, height);
  const scale = Math.min((width - 2 * margin) / Math.max(1e-9, x1 - x0), (height - 2 * margin) / Math.max(1e-9, y1 - y0));
  const placed: Placed[] = nodes.map((node) => {
    const home: Point = [width / 2 + (node.centre[0] - (x0 + x1) / 2) * scale, height / 2 + (yDown ? 1 : -1) * (node.centre[1] - (y0 + y1) / 2) * scale];
    // Not all at one place, or their forces have no direction.
    return { x: home[0] + (node.index % 7) - 3, y: home[1] + (node.index % 5) - 2, home, radius: radiusOf(node, crowded) };
  });
  const links = transitions.filter(([a, b]) => a !== b).map(([source, target, n]) => ({ source, target, n }));
  forceSimulation(placed).randomSource(() => 0.5).stop()
    .force("home", forceX<Placed>((d) => d.home[0]).strength(0.25)).force("homeY", forceY<Placed>((d) => d.home[1]).strength(0.25))
    .force("apart", forceCollide<Placed>((d) => d.radius + 2 * crowded).iterations(3))
    .force("links", forceLink<Placed, { source: number; target: number; n: number }>(links).distance(30).strength(0.01))
    .tick(160);
  return placed.map((d) => [Math.min(width - d.radius - 3, Math.max(d.radius + 3, d.x ?? 0)), Math.min(height - d.radius - 3, Math.max(d.radius + 3, d.y ?? 0))]);
}

/** Smaller where there are so many that they would not fit. */
export const crowding = (nodes: number, width: number, height: number): number => Math.min(1, Math.sqrt(width * height / (1400 * Math.max(1, nodes))));
const radiusOf = (node: GraphNode, scale: number): number => scale * Math.min(15, 6.5 + 1.5 * Math.sqrt(node.strength));

export class PrimitiveGraph {
  readonly element: HTMLElement;
  private readonly svg = s("svg", { class: "graph", role: "img" });
  private nodes: readonly GraphNode[] = [];
  private transitions: readonly Transition[] = [];
  private selected: number | undefined;
  private width = 0;
  private places: Point[] = [];

  constructor(private readonly yDown: boolean, private readonly choose: (index: number | undefined) => void) {
    this.element = h("div", { class: "graph-box" }, this.svg);
    new ResizeObserver(() => {
      const width = this.element.clientWidth;
      if (width === this.width || width === 0) return;
      this.width = width;
      this.arrange();
    }).observe(this.element);
  }

  show(nodes: readonly GraphNode[], transitions: readonly Transition[]): void {
    [this.nodes, this.transitions] = [nodes, transitions];
    this.arrange();
  }

  select(index: number | undefined): void {
    this.selected = index;
    this.draw();
  }

  private radius(node: GraphNode): number {
    return radiusOf(node, crowding(this.nodes.length, this.width, this.height()));
  }

  private height(): number {
    return Math.max(300, Math.min(460, this.width));
  }

  private arrange(): void {
    if (this.width === 0) return;
    this.places = layout(this.nodes, this.transitions, this.width, this.height(), this.yDown);
    this.draw();
  }

  private draw(): void {
    if (this.width === 0) return;
    this.svg.setAttribute("viewBox", `0 0 ${this.width} ${this.height()}`);
    this.svg.setAttribute("aria-label", `Graph of ${this.nodes.length} primitives and ${this.transitions.length} transitions`);
    const most = Math.max(1, ...this.transitions.map((t) => t[2]));
    const edges = this.transitions.map((edge) => this.edge(edge, most));
    this.svg.replaceChildren(...edges.map((e) => e.line), ...this.nodes.map((node) => this.node(node)), ...edges.flatMap((e) => e.label ? [e.label] : []));
  }

  private edge([from, to, n]: Transition, most: number): { line: SVGElement; label?: SVGElement } {
    const [a, b] = [this.places[from]!, this.places[to]!];
    const lit = this.selected === undefined || this.selected === from || this.selected === to;
    const width = 0.6 + 4.5 * Math.sqrt(n / most);
    const node = this.nodes[from]!;
    const title = s("title", {}, `${from} → ${to}: ${plural(n, "track")}`);
    const style = { class: lit ? "edge" : "edge off", stroke: node.colour, "stroke-width": width.toFixed(2), fill: "none",
                    opacity: !lit ? 0.06 : this.selected === undefined ? (0.16 + 0.6 * Math.sqrt(n / most)).toFixed(2) : 0.9 };
    if (from === to) {
      return { line: s("circle", { ...style, cx: a[0], cy: a[1], r: this.radius(node) + 1 + width / 2 }, title) };
    }
    const [dx, dy] = [b[0] - a[0], b[1] - a[1]];
    const length = Math.max(1e-6, Math.hypot(dx, dy));
    const [mx, my] = [(a[0] + b[0]) / 2 - 0.16 * dy, (a[1] + b[1]) / 2 + 0.16 * dx];
    const [tx, ty] = [b[0] - mx, b[1] - my];
    const t = Math.max(1e-6, Math.hypot(tx, ty));
    const stop = this.radius(this.nodes[to]!) + 1;
    const [ex, ey] = [b[0] - tx / t * stop, b[1] - ty / t * stop];
    const angle = Math.atan2(ty, tx);
    const head = 3.5 + width;
    const side = (turn: number) => `${(ex + head * Math.cos(angle + turn)).toFixed(1)},${(ey + head * Math.sin(angle + turn)).toFixed(1)}`;
    const d = `M${a[0].toFixed(1)},${a[1].toFixed(1)}Q${mx.toFixed(1)},${my.toFixed(1)} ${ex.toFixed(1)},${ey.toFixed(1)}M${side(2.6)}L${ex.toFixed(1)},${ey.toFixed(1)}L${side(-2.6)}`;
    const line = s("path", { ...style, d }, title);
    const labelled = this.selected !== undefined && lit && length > 20;
    if (!labelled) return { line };
    return { line, label: s("text", { class: "edge-count", x: (mx + (a[0] + b[0]) / 2) / 2, y: (my + (a[1] + b[1]) / 2) / 2, dy: "0.35em" }, count(n)) };
  }

  private node(node: GraphNode): SVGElement {
    const [x, y] = this.places[node.index]!;
    const chosen = this.selected === node.index;
    const near = this.selected === undefined || chosen || this.transitions.some(([a, b]) => (a === this.selected && b === node.index) || (b === this.selected && a === node.index));
    const group = s("g", { class: chosen ? "node chosen" : "node", opacity: near && !node.faded ? 1 : 0.25 },
      s("circle", { cx: x, cy: y, r: this.radius(node), fill: node.colour }), ...(this.radius(node) >= 8.5 || (near && this.selected !== undefined) ? [s("text", { x, y, dy: "0.35em" }, node.index)] : []),
      s("title", {}, `Primitive ${node.index}`));
    group.addEventListener("click", () => this.choose(chosen ? undefined : node.index));
    return group;
  }
}
