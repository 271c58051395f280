// The section "Try it" of a report, for browser.ts.
import assert from "node:assert/strict";
import { readFile, writeFile } from "node:fs/promises";
import { join } from "node:path";
import { pathToFileURL } from "node:url";
import type { Page } from "playwright-core";
import { modelReport, nameless, pictures, text, visiting, type BrowserTest } from "./visit";

export const tryTests: BrowserTest[] = [
  ["predicts for a pedestrian that is dragged", (browser) => visiting(browser, modelReport, {}, async (page) => {
    await page.waitForSelector("#try .mode");
    const pedestrian = page.locator("#try .pedestrian");
    const drawn = (): Promise<string[]> => page.$$eval("#try .mode, #try .region", (all) => all.map((e) => e.getAttribute("d") ?? ""));
    const mouseAt = async (): Promise<[number, number]> => {
      const { x, y, width, height } = (await pedestrian.locator(".touch").boundingBox())!;
      return [x + width / 2, y + height / 2];
    };
    await page.locator("#try .map").scrollIntoViewIfNeeded();
    const before = await drawn();
    assert.equal(await page.locator("#try .region").count(), 2);
    const [x, y] = await mouseAt();
    await page.mouse.move(x, y);
    await page.mouse.down();
    for (let k = 1; k <= 20; ++k) await page.mouse.move(x + 5 * k, y - 3 * k);
    await page.waitForTimeout(100);
    const [there, shown] = [await mouseAt(), await drawn()];
    assert.ok(Math.hypot(there[0] - x - 100, there[1] - y + 60) < 1, "the pedestrian is where the mouse is");
    assert.ok(shown.every((d) => d && !d.includes("NaN") && !before.includes(d)), "every mode and region follows");
    const region = (await page.locator("#try .region").last().boundingBox())!;
    assert.ok((region.x + region.width / 2 - there[0]) * 5 + (region.y + region.height / 2 - there[1]) * -3 > 0, "the region lies ahead of the pedestrian");
    await page.locator("#try").screenshot({ path: join(pictures, "try.png") });
    const frames = await framesOf(page, there);
    console.log(`      ${frames.map((n) => n.toFixed(0)).join(", ")} frames a second`);
    assert.ok(Math.max(...frames) >= 30, "30 frames a second");
    await page.mouse.up();
    await page.locator("#try-ahead").fill("5");
    const later = (await page.locator("#try .region").first().boundingBox())!;
    await page.locator("#try-ahead").fill("1");
    const sooner = (await page.locator("#try .region").first().boundingBox())!;
    assert.ok(later.width * later.height > 2 * sooner.width * sooner.height, "regions grow with time");
    await page.getByRole("button", { name: "Start again" }).click();
    await page.locator("#try-ahead").fill("3");
    assert.deepEqual(await drawn(), before);
    await pedestrian.focus();
    for (let k = 0; k < 8; ++k) await page.keyboard.press("ArrowUp");
    await page.evaluate(() => new Promise(requestAnimationFrame)); // the page draws once in each frame
    assert.ok((await mouseAt())[1] < y - 20);
    assert.match(await text(page, "#try-readout"), /^\d+ modes, the most likely with a weight of \d+ %\. /);
    await page.locator("#try .toggle", { hasText: "Regions" }).locator("input").uncheck();
    assert.equal(await page.locator("#try .region").count(), 0);
    assert.deepEqual(await nameless(page), []);
  })],
  ["says what to do where the page cannot predict", async (browser) => {
    const html = await readFile(modelReport, "utf8");
    const data = JSON.parse(/<script id="data"[^>]*>(.*?)<\/script>/s.exec(html)![1]!) as { predictor: { wasm: string; model: string } };
    const alerted = async (predictor: object, init?: string): Promise<string> => {
      const file = join(pictures, "no-predictor.html");
      await writeFile(file, html.replace(/(<script id="data"[^>]*>).*?(<\/script>)/s, (_, begin: string, end: string) => begin + JSON.stringify({ ...data, predictor }).replaceAll("<", "\\u003c") + end));
      const page = await browser.newPage();
      if (init) await page.addInitScript(init);
      await page.goto(pathToFileURL(file).href);
      const said = await page.locator("#try [role=alert]").innerText();
      assert.ok(await page.locator("#learnt .primitive").count() > 10, "the other sections are there");
      await page.close();
      return said;
    };
    assert.match(await alerted(data.predictor, "delete globalThis.WebAssembly"), /no WebAssembly, or it is switched off\. Allow it .* or open this file in/);
    assert.match(await alerted(data.predictor, "delete globalThis.DecompressionStream"), /no DecompressionStream.*or open this file in/);
    assert.match(await alerted({ bytes: 5_100_000, most_bytes: 2_200_000 }), /too large for this page \(5\.1 MB of at most 2\.2 MB\)\. `sila serve`/);
    assert.match(await alerted({ wasm: data.predictor.wasm, model: data.predictor.model.slice(0, 4000) }), /^The model cannot be loaded: .*Make the report anew/);
  }],
];

/** Frames a second in which the pedestrian of "Try it", held by the mouse, was drawn with its predictions, of seconds with a move in each frame of the browser: until one has 30, at most eight, for other processes may be busy. */
function framesOf(page: Page, [x, y]: [number, number]): Promise<number[]> {
  return page.evaluate(async ([x, y]) => {
    const handle = document.querySelector("#try .pedestrian")!;
    let drawn = 0;
    new MutationObserver(() => ++drawn).observe(handle, { attributes: true, attributeFilter: ["transform"] });
    const frames: number[] = [];
    while (frames.length < 8 && !(Math.max(...frames) >= 30)) {
      drawn = 0;
      const began = performance.now();
      let now = began;
      while (now < began + 1000) {
        const angle = now / 400;
        handle.dispatchEvent(new PointerEvent("pointermove", { pointerId: 1, clientX: x + 60 * Math.sin(angle), clientY: y + 60 * (Math.cos(angle) - 1) }));
        now = await new Promise<number>((resolve) => requestAnimationFrame(resolve));
      }
      frames.push(1000 * drawn / (performance.now() - began));
    }
    return frames;
  }, [x, y] as const);
}
