// Elements in one line.
type Child = Node | string | number | undefined | null | false;
type Attributes = Record<string, string | number | boolean | undefined | ((event: never) => void)>;

function fill<E extends Element>(element: E, attributes: Attributes, children: Child[]): E {
  for (const [name, value] of Object.entries(attributes)) {
    if (value === undefined || value === false) continue;
    if (typeof value === "function") element.addEventListener(name.replace(/^on/, ""), value as EventListener);
    else element.setAttribute(name, value === true ? "" : String(value));
  }
  for (const child of children) if (child !== undefined && child !== null && child !== false) element.append(child instanceof Node ? child : String(child));
  return element;
}

export function h<K extends keyof HTMLElementTagNameMap>(tag: K, attributes: Attributes = {}, ...children: Child[]): HTMLElementTagNameMap[K] {
  return fill(document.createElement(tag), attributes, children);
}

export function s<K extends keyof SVGElementTagNameMap>(tag: K, attributes: Attributes = {}, ...children: Child[]): SVGElementTagNameMap[K] {
  return fill(document.createElementNS("http://www.w3.org/2000/svg", tag), attributes, children);
}

/** The head of a table. */
export const thead = (...names: string[]): HTMLElement => h("thead", {}, h("tr", {}, ...names.map((name) => h("th", { scope: "col" }, name))));

export const number = (value: number, digits = 2): string => value.toLocaleString("en", { minimumFractionDigits: digits, maximumFractionDigits: digits });
export const count = (value: number): string => value.toLocaleString("en", { maximumFractionDigits: 1 });
export const percent = (share: number, digits = 0): string => `${number(100 * share, digits)} %`;
export const plural = (n: number, one: string, many = one + "s"): string => `${count(n)} ${n === 1 ? one : many}`;
/** An error as a share of that of constant velocity, in words. */
export const besideConstant = (error_m: number, constant_m: number): string => `${percent(Math.abs(1 - error_m / constant_m))} ${error_m <= constant_m ? "less" : "more"} than constant velocity`;

/** Shows what `open` makes of the data of the page, or why `what` cannot be shown. */
export function start(what: string, open: (data: string) => Promise<HTMLElement[]>): void {
  const app = document.getElementById("app")!;
  open(document.getElementById("data")?.textContent ?? "").then((elements) => app.replaceChildren(...elements)).catch((error: unknown) => {
    app.replaceChildren(h("p", { class: "failure", role: "alert" }, `${what} cannot be shown: ${error instanceof Error ? error.message : String(error)}`));
    throw error;
  });
}

/** A check box with its text. */
export function toggle(text: string, checked: boolean, change: (on: boolean) => void, id?: string): HTMLLabelElement {
  const box = h("input", { type: "checkbox", id });
  box.checked = checked;
  box.addEventListener("change", () => change(box.checked));
  return h("label", { class: "toggle" }, box, text);
}

/** A drop-down list with its text. */
export function choice<T extends string>(text: string, options: readonly (readonly [T, string])[], value: T, change: (value: T) => void, id?: string): { label: HTMLLabelElement; select: HTMLSelectElement } {
  const select = h("select", { id }, ...options.map(([key, name]) => h("option", { value: key }, name)));
  select.value = value;
  select.addEventListener("change", () => change(select.value as T));
  return { label: h("label", { class: "choice" }, h("span", {}, text), select), select };
}
