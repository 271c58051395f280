// The history of a model from its first episode on. Pure.
import type { Cells, Change, EpisodeData, ModelData, Transition } from "./data";

export type Fate = "kept" | "added" | "fused" | "part";

export interface Primitive {
  /** The same number for the same primitive in every episode. */
  key: number;
  cells: Cells;
  /** What the episode did to it; "part": a split was replaced by it and another one. */
  fate: Fate;
}

export interface Stage {
  episode: number;
  primitives: Primitive[];
  transitions: Transition[];
  added: number;
  fused: number;
  split: number;
  /** Previous primitives that are no more: fused into others, or split. */
  gone: Primitive[];
}

const edgeKey = (from: number, to: number): string => `${from} ${to}`;

function carried(transitions: readonly Transition[], places: readonly number[]): Map<string, Transition> {
  const edges = new Map<string, Transition>();
  for (const [from, to, count] of transitions) {
    const [a, b] = [places[from] ?? -1, places[to] ?? -1];
    if (a >= 0 && b >= 0) edges.set(edgeKey(a, b), [a, b, count]);
  }
  return edges;
}

/** One episode further; undefined if the change is not about this stage. */
export function step(previous: Stage, change: Change, episode: number, freshKey: () => number): Stage | undefined {
  if (change.before !== previous.primitives.length) return undefined;
  const gone = new Set(change.gone);
  const places: number[] = [];
  const primitives: Primitive[] = [];
  const lost: Primitive[] = [];
  previous.primitives.forEach((primitive, i) => {
    places.push(gone.has(i) ? -1 : primitives.length);
    if (gone.has(i)) lost.push(primitive);
    else primitives.push({ ...primitive, fate: "kept" });
  });
  for (const cells of change.added) primitives.push({ key: freshKey(), cells, fate: "added" });
  if (primitives.length !== change.after) return undefined;
  for (const fused of change.fused) {
    const target = primitives[fused.primitive];
    if (!target) return undefined;
    target.cells = fused.cells;
    target.fate = "fused";
  }
  for (const [, first, second] of change.split) {
    for (const i of [first, second]) {
      const part = primitives[i];
      if (part && part.fate === "kept") part.fate = "part";
    }
  }
  const edges = carried(previous.transitions, places);
  for (const [from, to] of change.transitions_gone) edges.delete(edgeKey(from, to));
  for (const edge of change.transitions) edges.set(edgeKey(edge[0], edge[1]), edge);
  const transitions = [...edges.values()].sort((a, b) => a[0] - b[0] || a[1] - b[1]);
  return { episode, primitives, transitions, added: change.added.length, fused: change.fused.length,
           split: change.split.length + change.incoming_split, gone: lost };
}

/** A stage for each episode, or undefined if the file does not have all changes of this model. */
export function stagesOf(model: ModelData, episodes: readonly EpisodeData[]): Stage[] | undefined {
  let key = 0;
  let stage: Stage = { episode: 0, primitives: [], transitions: [], added: 0, fused: 0, split: 0, gone: [] };
  const stages: Stage[] = [];
  for (const episode of episodes) {
    const change = episode.statistics.change;
    const next = change && step(stage, change, episode.number, () => key++);
    if (!next) return undefined;
    stages.push(next);
    stage = next;
  }
  const same = stage.primitives.length === model.primitives.length && stage.transitions.length === model.transitions.length;
  return stages.length > 0 && same ? stages : undefined;
}

/** The model alone, when its changes are not known. */
export function onlyStage(model: ModelData): Stage {
  return { episode: model.episodes, transitions: model.transitions, added: 0, fused: 0, split: 0, gone: [],
           primitives: model.primitives.map(({ cells }, key) => ({ key, cells, fate: "kept" })) };
}
