// A picture of a simulated corner as an invented camera sees it, that camera, and the tracks in its pixels.
//   node build/browser/made_up_camera.mjs TRACKS.csv SCENE.json FOLDER
// writes FOLDER/picture.png, camera.json and mot.txt (25 frames per second).
import { readFile, writeFile } from "node:fs/promises";
import { join } from "node:path";
import { deflateSync } from "node:zlib";
import { applied, fitCamera, inverse, type PointPair } from "../src/camera";
import { toCurb, type Point } from "../src/geometry";
import { drawnCorner, type SceneFile } from "../src/scene_file";

const [tracks, scene, folder] = process.argv.slice(2) as [string, string, string];
const [width, height] = [1280, 720];
const pairs: PointPair[] = ([[[60, 690], [-10, -10]], [[1220, 690], [14, -10]], [[860, 130], [14, 24]], [[420, 130], [-10, 24]]] as [Point, Point][]).map(([image, ground]) => ({ image, ground }));
const fit = fitCamera(pairs);
if (typeof fit === "string") throw new Error(fit);

const corners = (JSON.parse(await readFile(scene, "utf8")) as SceneFile).corners.map(drawnCorner);
const colour = (ground: Point | undefined): [number, number, number] => {
  if (!ground) return [176, 200, 222];
  const blocks = corners.map((corner) => Math.min(...toCurb(corner, ground)));
  const nearest = Math.max(...blocks);
  return nearest > 1 ? [126, 148, 112] : nearest > 0 ? [196, 190, 178] : [106, 110, 116];
};
const rows = Buffer.alloc(height * (1 + 3 * width));
for (let v = 0; v < height; ++v) for (let u = 0; u < width; ++u) rows.set(colour(applied(fit.camera, [u, v])), v * (1 + 3 * width) + 1 + 3 * u);
const crc32 = (data: Buffer): number => ~data.reduce((sum, byte) => { for (let bit = 0, rest = sum ^ byte; ; rest = rest & 1 ? rest >>> 1 ^ 0xedb88320 : rest >>> 1) if (bit++ === 8) return rest; }, -1) >>> 0;
const chunk = (name: string, data: Buffer): Buffer => {
  const body = Buffer.concat([Buffer.from(name), data]);
  const [length, sum] = [Buffer.alloc(4), Buffer.alloc(4)];
  length.writeUInt32BE(data.length);
  sum.writeUInt32BE(crc32(body));
  return Buffer.concat([length, body, sum]);
};
const header = Buffer.alloc(13);
header.writeUInt32BE(width);
header.writeUInt32BE(height, 4);
header.set([8, 2], 8);
await writeFile(join(folder, "picture.png"), Buffer.concat([Buffer.from([137, 80, 78, 71, 13, 10, 26, 10]), chunk("IHDR", header), chunk("IDAT", deflateSync(rows)), chunk("IEND", Buffer.alloc(0))]));
await writeFile(join(folder, "camera.json"), JSON.stringify({ image_points: pairs.map((p) => p.image), ground_points: pairs.map((p) => p.ground) }));

const ids = new Map<string, number>();
const lines = (await readFile(tracks, "utf8")).trim().split("\n").slice(1).flatMap((line) => {
  const [id, t, x, y] = line.split(",") as [string, string, string, string];
  if (!ids.has(id)) ids.set(id, ids.size + 1);
  const pixel = applied(inverse(fit.camera), [Number(x), Number(y)]);
  if (!pixel || pixel[0] < 0 || pixel[1] < 0 || pixel[0] > width || pixel[1] > height) return [];
  return `${Math.round(25 * Number(t)) + 1},${ids.get(id)},${(pixel[0] - 10).toFixed(2)},${(pixel[1] - 50).toFixed(2)},20,50,1,-1,-1,-1`;
});
await writeFile(join(folder, "mot.txt"), lines.join("\n") + "\n");
