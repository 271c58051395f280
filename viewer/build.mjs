// Builds the viewer.
//   node build.mjs             dist/report.html: one page, everything inside
//   node build.mjs --tests     build/tests/*.mjs from tests/*.test.ts
//   node build.mjs --browser   build/browser/browser.mjs from tests/browser.ts
import { build } from "esbuild";
import { mkdir, readFile, readdir, writeFile } from "node:fs/promises";

const here = new URL(".", import.meta.url).pathname;
const marker = '"sila-report-data"';

async function page() {
  const bundle = async (entry) => {
    const result = await build({ entryPoints: [here + entry], bundle: true, minify: true, write: false, charset: "utf8",
      target: ["es2022"], format: "iife", legalComments: "none", logLevel: "warning" });
    return result.outputFiles[0].text.trim();
  };
  // A closing tag within a string of the script would end the script.
  const script = (await bundle("src/main.ts")).replaceAll("</script", "<\\/script");
  const style = await bundle("src/style.css");
  const template = await readFile(here + "src/page.html", "utf8");
  if (script.includes(marker) || template.split(marker).length !== 2) throw new Error(`${marker} must stand once in src/page.html`);
  const html = template.replace("/*style*/", () => style).replace("/*script*/", () => script);
  await mkdir(here + "dist", { recursive: true });
  await writeFile(here + "dist/report.html", html);
  console.log(`viewer: dist/report.html, ${(html.length / 1024).toFixed(0)} KiB`);
}

async function node(entries, outdir) {
  await build({ entryPoints: entries, bundle: true, platform: "node", format: "esm", target: ["node18"], outdir: here + outdir,
    outExtension: { ".js": ".mjs" }, packages: "external", logLevel: "warning" });
}

if (process.argv.includes("--tests")) {
  const files = (await readdir(here + "tests")).filter((name) => name.endsWith(".test.ts"));
  await node(files.map((name) => here + "tests/" + name), "build/tests");
} else if (process.argv.includes("--browser")) {
  await node([here + "tests/browser.ts"], "build/browser");
} else {
  await page();
}
