// Results as `sila experiment` writes them (docs/experiments.md), of no experiment: numbers for the tests of the page.
let state = 1;
const random = () => (state = (state * 48271) % 2147483647) / 2147483647 - 0.5;
const methods = { sila: [0.62, 60, 0.25], accumulate: [0.6, 130, 0.22], retrain: [0.61, 45, 0.9], batch: [0.58, 48, 3] };
const curves = [];
for (const scene of ["made-up crossing", "made-up corner"]) {
  for (let trial = 1; trial <= 5; ++trial) {
    for (const [method, [error, size, seconds]] of Object.entries(methods)) {
      const shift = 0.03 * random();
      const episodes = method === "batch" ? [12] : Array.from({ length: 12 }, (_, i) => i + 1);
      curves.push({ scene, method, trial, order: 0, checkpoints: episodes.map((n, i) => ({
        episode: i + 1, tracks: 20 * n, size: Math.round(size * (method === "accumulate" ? n / 3 : Math.sqrt(n)) * (1 + 0.1 * random())),
        seconds: seconds * (method === "retrain" ? n / 4 : 1) * (1 + 0.2 * random()),
        places: { [scene]: { moving: { windows: 200, model: { weighted_mhd_m: error + 0.2 / n + shift + 0.01 * random() }, constant_velocity: { weighted_mhd_m: 0.78 + shift } } } } })) });
    }
  }
}
const comparisons = ["made-up crossing", "made-up corner"].flatMap((place) => Object.entries(methods).map(([method, [error]]) => (
  { place, method, against: "constant velocity", people: 300, difference: error / 0.78 - 1, low: error / 0.78 - 1.03, high: error / 0.78 - 0.97 })));
console.log(JSON.stringify({ version: "0.0.0", command: "made up", seed: 1, experiment: { trials: 5, batch: 20 }, summary: [], comparisons, curves }));
