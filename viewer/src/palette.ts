// Colours that people who see fewer of them can still tell apart: those of Okabe and Ito, in a circle by direction, so that
// neighbouring directions have neighbouring colours. Colour is never the only sign: primitives are arrows, too.
import { interpolateLab } from "d3-interpolate";

const circle = ["#0072b2", "#56b4e9", "#009e73", "#b8a100", "#e69f00", "#d55e00", "#cc79a7", "#8f6bb8"];

/** The colour of a direction [rad]. */
export function directionColour(angle: number): string {
  const turn = ((angle / (2 * Math.PI)) % 1 + 1) % 1 * circle.length;
  const i = Math.floor(turn);
  return interpolateLab(circle[i % circle.length]!, circle[(i + 1) % circle.length]!)(turn - i);
}

/** Colours of the page (style.css) of the methods in the learning curves and of the baselines, always the same. */
export const methodColour = { sila: "var(--sila)", accumulate: "var(--accumulate)", retrain: "var(--retrain)", batch: "var(--batch)", "constant velocity": "var(--constant)" } as const;
const others = ["var(--other-1)", "var(--other-2)", "var(--other-3)", "var(--other-4)"];

/** A second sign beside the colour: a mark for Plot, and the same for text. */
export const marks = [["circle", "●"], ["square", "■"], ["triangle", "▲"], ["diamond", "◆"], ["star", "★"], ["cross", "✚"]] as const;
export const markOf = (index: number): (typeof marks)[number] => marks[index % marks.length]!;

export function colourOfMethod(name: string, index: number): string {
  const known = Object.entries(methodColour).find(([method]) => method === name.toLowerCase());
  return known ? known[1] : others[index % others.length]!;
}
