// Builds the viewer.
//   node build.mjs             dist/report.html, dist/live.html and dist/editor.html: pages with everything inside
//   node build.mjs --tests     build/tests/*.mjs from tests/*.test.ts
//   node build.mjs --browser   build/browser/*.mjs from the programs of tests
import { build } from "esbuild";
import { mkdir, readFile, readdir, writeFile } from "node:fs/promises";

const here = new URL(".", import.meta.url).pathname;
const marker = '"sila-report-data"';

async function bundle(entry) {
  const result = await build({ entryPoints: [here + entry], bundle: true, minify: true, write: false, charset: "utf8",
    target: ["es2022"], format: "iife", legalComments: "none", logLevel: "warning" });
  return result.outputFiles[0].text.trim();
}

/** `name` of dist from a template, with the script and the style inside. */
async function page(entry, template, name) {
  // A closing tag within a string of the script would end the script.
  const script = (await bundle(entry)).replaceAll("</script", "<\\/script");
  const style = await bundle("src/style.css");
  const text = await readFile(here + template, "utf8");
  if (script.includes(marker) || text.split(marker).length > 2) throw new Error(`${marker} must stand once in ${template}`);
  const html = text.replace("/*style*/", () => style).replace("/*script*/", () => script);
  await mkdir(here + "dist", { recursive: true });
  await writeFile(here + "dist/" + name, html);
  console.log(`viewer: dist/${name}, ${(html.length / 1024).toFixed(0)} KiB`);
}

async function node(entries, outdir) {
  await build({ entryPoints: entries, bundle: true, platform: "node", format: "esm", target: ["node18"], outdir: here + outdir,
    outExtension: { ".js": ".mjs" }, packages: "external", logLevel: "warning" });
}

if (process.argv.includes("--tests")) {
  const files = (await readdir(here + "tests")).filter((name) => name.endsWith(".test.ts"));
  await node(files.map((name) => here + "tests/" + name), "build/tests");
} else if (process.argv.includes("--browser")) {
  await node([here + "tests/browser.ts", here + "tests/live_browser.ts", here + "tests/made_up_camera.ts", here + "tests/golden.ts"], "build/browser");
} else {
  await page("src/main.ts", "src/page.html", "report.html");
  await page("src/editor.ts", "src/page.html", "editor.html");
  await page("src/live.ts", "src/live.html", "live.html");
}
