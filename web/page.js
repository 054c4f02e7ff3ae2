// The page: controls, view and pointer. The world runs in a worker.

import { Drive } from "./drive.js";
import { read, write } from "./link.js";
import { Overlays } from "./overlays.js";
import { Policies } from "./policy.js";
import { Renderer } from "./renderer.js";
import { Trees } from "./trees.js";
import { View } from "./view.js";

const $ = id => document.getElementById(id);
const canvas = $("canvas");
const speeds = [...$("speed").options].map(option => option.value);
const link = read(location.search, speeds);

let worker = null, renderer = null, menu = null;
let running = !matchMedia("(prefers-reduced-motion: reduce)").matches;
let asked = null, told = null, dirty = true, pictured = false;
const view = new View();
const overlays = new Overlays(names => { send("show", { names }); remember(); });
const drive = new Drive(send, () => setRunning(!running));
const policies = new Policies(policy => {
  send("policy", policy);
  grow({ ...chosen(), driver: Policies.driver(policy.name) });
}, problem);
const trees = new Trees(tree => {
  send("tree", tree);
  trees.show({ ...chosen(), tree_file: tree.name });
  grow(chosen());
}, problem);

function send(kind, parts = {}) {
  worker?.postMessage({ kind, ...parts });
}

function problem(sentence) {
  $("problem").textContent = sentence;
  $("problem").hidden = !sentence;
  if (sentence) $("waiting").hidden = true;
}

// A text as the beginning of a sentence.
const sentence = text => text.charAt(0).toUpperCase() + text.slice(1);
const aspect = () => canvas.clientWidth / canvas.clientHeight;

// --- The world ---

function grow(ask) {
  asked = ask;
  problem("");
  $("waiting").textContent = "Growing the tree …";
  $("waiting").hidden = false;
  $("grow").disabled = $("next").disabled = true;
  send("grow", { ask });
}

// The options that the controls show.
function chosen() {
  const ask = { preset: $("preset").value, seed: $("seed").value.trim(), tree: Number($("tree").value), robot: $("robot").value, driver: $("driver").value };
  if ($("camera").value) ask.camera = $("camera").value;
  return trees.add($("foliage-own").checked ? ask : { ...ask, foliage: Number($("foliage").value) });
}

function show(ask) {
  if (ask.driver.startsWith("onnx:")) Policies.driver(ask.driver.slice(5));
  for (const name of ["preset", "seed", "tree", "robot", "driver"]) $(name).value = ask[name];
  trees.show(ask);
  $("camera").value = ask.camera ?? "";
  $("foliage-own").checked = ask.foliage === undefined;
  $("foliage").disabled = ask.foliage === undefined;
  if (ask.foliage !== undefined) tellFoliage(ask.foliage);
}

function tellFoliage(value) {
  $("foliage").value = value;
  $("foliage-told").textContent = Number(value).toFixed(1);
}

function setRunning(now) {
  running = now;
  $("run").textContent = running ? "Pause" : "Run";
  $("step").disabled = running;
  send("run", { running });
}

function setSpeed(value) {
  $("speed").value = value;
  send("speed", { speed: Number(value) });
  remember();
}

function remember() {
  if (asked) history.replaceState(null, "", write(asked, $("speed").value, overlays.address(), menu.defaults));
}

function next() {
  // A text that is no seed is told by the world.
  const seed = /^\d+$/.test($("seed").value.trim()) ? ((BigInt($("seed").value.trim()) + 1n) % 2n ** 64n).toString() : $("seed").value;
  grow({ ...chosen(), seed });
}

function fill(select, names) {
  select.replaceChildren(...names.map(name => new Option(name, name)));
}

const answers = {
  menu(message) {
    menu = message.menu;
    fill($("preset"), menu.presets);
    fill($("driver"), menu.drivers);
    fill($("robot"), menu.robots);
    fill($("camera"), menu.cameras);
    $("camera").prepend(new Option("as the kind of tree has it", ""));
    [policies.most, trees.most] = [menu.network_max, menu.tree_max];
    [$("foliage").min, $("foliage").max] = menu.foliage;
    overlays.fill(menu.overlays, menu.overlays_on);
    if (link.overlays !== null) {
      overlays.set(link.overlays);
      send("show", { names: link.overlays });
    }
    // Those without a value are left to the world.
    const defaults = Object.fromEntries(Object.entries(menu.defaults).filter(([, value]) => value !== null));
    grow({ ...defaults, ...link.ask });
    setSpeed(link.speed);
  },
  grown(message) {
    renderer.setMeshes(message.meshes.vertices, message.meshes.counts);
    overlays.begin();
    show(asked);
    trees.tell(message.notes);
    tellFoliage(message.told.foliage);
    view.face(message.told.p_world_base, aspect());
    tell(message.told);
    $("waiting").hidden = true;
    $("grow").disabled = $("next").disabled = false;
    problem(link.problems.splice(0).join(" "));
    remember();
    setRunning(running);
  },
  refused(message) {
    $("grow").disabled = $("next").disabled = false;
    const first = told === null;
    problem(`${sentence(message.problem)}. ${
      first ? "Choose other options and press Grow." : "The tree before stays; choose other options and press Grow."}`);
    if (first) show({ ...menu.defaults, foliage: undefined });
  },
  unshown(message) {
    overlays.set(message.overlays ?? menu.overlays_on);
    problem(`${sentence(message.problem)}. The link asks for it; use the switches under “Show”.`);
    remember();
  },
  picture(message) {
    if (message.meshes) renderer.setMeshes(message.meshes.vertices, message.meshes.counts);
    renderer.setInstances(message.instances, message.counts);
    tell(message.told, message.factor);
    drive.set(message.told.taken_over);
    overlays.take(message.wrist, message.samples, message.told, asked.driver);
    [dirty, pictured] = [true, true];
  },
  taken(message) {
    drive.set(true, message.closes);
  },
  grabbed(message) {
    if (!pointer || message.id !== pointer.id) return send("release");
    const { place } = message;
    if (!place) return point(pointer.keys ? null : { ...pointer, mode: pointer.wanted });
    const at = pointer.keys ? view.place(place, aspect()) ?? pointer.at : pointer.at;
    point({ ...pointer, mode: "pull", at, depth: view.depth(place) });
    pull();
  },
  stopped(message) {
    worker = null;
    problem(message.early
      ? `The orchard cannot start: ${message.problem}. It needs a browser with WebAssembly (any since 2021), and all files of this page beside it.`
      : `The simulation stopped: ${message.problem}. Load the page again, or take another seed.`);
  },
};

// --- Figures ---

function put(id, value) {
  if ($(id).textContent !== value) $(id).textContent = value;
}

function tell(now, factor = null) {
  told = now;
  put("time", now.time.toFixed(1));
  for (const id of ["picked", "dropped", "snapped", "hanging"]) put(id, String(now[id]));
  put("doing", now.taken_over ? "you drive" : now.state ? `${asked.driver}: ${now.state}` : "");
  put("rate", running && factor !== null ? `${factor.toFixed(factor < 10 ? 1 : 0)} × real time` : "");
  if (now.fault) problem(`This world stands still: ${now.fault}. Press Reset, or take another seed.`);
  $("pads").dataset.base = now.p_world_base.map(x => x.toFixed(3)).join(" ");
  arrow();
}

// Draws the pull: from the grabbed place to the pointer, with its size.
function arrow() {
  const pull = told?.pull;
  const ends = pull && [pull.p_world, pull.p_world_target].map(p => view.place(p, aspect()));
  $("arrow").toggleAttribute("hidden", !(ends && ends[0] && ends[1]));
  if (!(ends && ends[0] && ends[1])) return;
  const [[x, y], [u, v]] = ends.map(([x, y]) => [(x + 1) / 2 * canvas.clientWidth, (1 - y) / 2 * canvas.clientHeight]);
  const length = Math.hypot(u - x, v - y), [a, b] = length > 0 ? [(u - x) / length, (v - y) / length] : [1, 0];
  const set = (id, parts) => Object.entries(parts).forEach(([name, value]) => $(id).setAttribute(name, value));
  set("arrow-line", { x1: x, y1: y, x2: u - 10 * a, y2: v - 10 * b, visibility: length > 14 ? "visible" : "hidden" });
  set("arrow-head", { d: `M${u},${v} L${u - 16 * a - 7 * b},${v - 16 * b + 7 * a} L${u - 16 * a + 7 * b},${v - 16 * b - 7 * a} Z`,
    visibility: length > 14 ? "visible" : "hidden" });
  set("arrow-foot", { cx: x, cy: y });
  const left = u > canvas.clientWidth - 90;
  set("arrow-text", { x: left ? u - 12 : u + 12, y: Math.max(v - 8, 18), "text-anchor": left ? "end" : "start" });
  put("arrow-text", `${pull.force.toFixed(pull.force < 10 ? 1 : 0)} N`);
}

// --- Pointer and keys ---

// What the pointer, or the keyboard, does: { id, mode, at, depth }. Mode is ask until the world said whether something is grabbed.
let pointer = null, grabs = 0;
const touches = new Map();

function placeOf(event) {
  const box = canvas.getBoundingClientRect();
  return [(event.clientX - box.left) / box.width * 2 - 1, 1 - (event.clientY - box.top) / box.height * 2];
}

function point(now) {
  pointer = now;
  canvas.dataset.pointer = pointer?.mode ?? "";
}

function grab(at, wanted, keys = false) {
  const ray = view.ray(at, aspect());
  grabs += 1;
  point({ id: grabs, mode: "ask", wanted, at, keys });
  send("grab", { p: ray.p, along: ray.along, id: grabs, byKey: keys });
}

function pull() {
  send("pull", { p: view.at(pointer.at, aspect(), pointer.depth) });
}

function letGo() {
  if (pointer && (pointer.mode === "pull" || pointer.mode === "ask")) send("release");
  point(null);
}

canvas.addEventListener("pointerdown", event => {
  canvas.focus({ preventScroll: true });
  canvas.setPointerCapture(event.pointerId);
  touches.set(event.pointerId, placeOf(event));
  if (touches.size === 1 && event.button === 0 && !event.shiftKey) return grab(placeOf(event), "turn");
  letGo();
  point({ id: 0, mode: touches.size === 2 ? "pinch" : "move", at: placeOf(event) });
});

canvas.addEventListener("pointermove", event => {
  if (!touches.has(event.pointerId)) return;
  const before = touches.get(event.pointerId), now = placeOf(event);
  touches.set(event.pointerId, now);
  if (!pointer) return;
  const [right, up] = [now[0] - before[0], now[1] - before[1]];
  if (pointer.mode === "pinch" && touches.size === 2) {
    const other = [...touches].find(([id]) => id !== event.pointerId)[1], wide = aspect();
    const apart = p => Math.hypot((p[0] - other[0]) * wide, p[1] - other[1]);
    if (apart(now) > 0.01) view.zoom(apart(before) / apart(now));
    view.move(right / 4 * wide, up / 4);
  } else if (pointer.mode === "move") {
    view.move(right / 2 * aspect(), up / 2);
  } else if (pointer.mode === "turn") {
    view.turn(right * Math.min(aspect(), 1.5) * 1.6, -up * 1.2);
  } else {
    pointer.at = now;
    if (pointer.mode === "pull") pull();
  }
  dirty = true;
});

for (const name of ["pointerup", "pointercancel"]) {
  canvas.addEventListener(name, event => {
    touches.delete(event.pointerId);
    letGo();
  });
}
canvas.addEventListener("contextmenu", event => event.preventDefault());
canvas.addEventListener("wheel", event => {
  event.preventDefault();
  view.zoom(Math.exp(Math.max(-60, Math.min(60, event.deltaY)) / 400));
  dirty = true;
}, { passive: false });

const ARROWS = { ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, 1], ArrowDown: [0, -1] };

function key(event) {
  const arrow = ARROWS[event.key];
  if (arrow && pointer?.keys && pointer.mode === "pull") {
    pointer.at = pointer.at.map((x, k) => Math.max(-1, Math.min(1, x + 0.01 * arrow[k])));
    pull();
  } else if (arrow && event.shiftKey) {
    view.move(-0.05 * arrow[0], -0.05 * arrow[1]);
  } else if (arrow) {
    view.turn(0.1 * arrow[0], 0.08 * arrow[1]);
  } else if (event.key === "+" || event.key === "=") {
    view.zoom(0.9);
  } else if (event.key === "-") {
    view.zoom(1 / 0.9);
  } else if (event.key === "g" || event.key === "G") {
    if (pointer) letGo();
    else grab([0, 0], "turn", true);
  } else if (event.key === "Escape") {
    letGo();
  } else {
    return false;
  }
  dirty = true;
  return true;
}

addEventListener("dragover", event => { if (event.dataTransfer?.types.includes("Files")) event.preventDefault(); });
addEventListener("drop", async event => {
  if (!event.dataTransfer?.files.length) return;
  event.preventDefault();
  const files = [...event.dataTransfer.files], tree = await Trees.among(files);
  if (tree) trees.take(tree);
  else policies.take(files);
});

addEventListener("keydown", event => {
  if (event.ctrlKey || event.altKey || event.metaKey) return;
  const typing = event.target.closest?.("input, select, button, summary");
  const writing = event.target.closest?.("input:not([type='checkbox'], [type='range']), select");
  let done = event.target === canvas && key(event) || !writing && overlays.key(event.key) || !writing && drive.key(event);
  if (!done && !typing) {
    const pressed = { " ": "run", ".": "step", r: "reset", R: "reset", n: "next", N: "next" }[event.key];
    done = Boolean(pressed);
    if (pressed) $(pressed).click();
  }
  if (done) event.preventDefault();
});

// --- Controls ---

$("run").addEventListener("click", () => setRunning(!running));
$("step").addEventListener("click", () => { if (!running) send("step"); });
$("reset").addEventListener("click", () => { letGo(); problem(""); send("reset"); });
$("next").addEventListener("click", next);
$("speed").addEventListener("change", () => setSpeed($("speed").value));
$("foliage").addEventListener("input", () => tellFoliage($("foliage").value));
$("foliage-own").addEventListener("change", () => { $("foliage").disabled = $("foliage-own").checked; });
$("form").addEventListener("submit", event => { event.preventDefault(); grow(chosen()); });
$("share").addEventListener("click", async () => {
  remember();
  try {
    await navigator.clipboard.writeText(location.href);
    $("shared").textContent = "The link to this world is copied.";
  } catch {
    $("shared").textContent = `Copy this link: ${location.href}`;
  }
});

// --- Start ---

function frame() {
  if (dirty && renderer) {
    dirty = false;
    renderer.draw(view);
    arrow();
    if (pictured) {
      if (!document.body.dataset.pictured) document.body.dataset.pictured = String(Math.round(performance.now()));
      pictured = false;
      send("drawn");
    }
  }
  drive.wish();
  requestAnimationFrame(frame);
}

function start() {
  try {
    renderer = new Renderer(canvas);
  } catch (error) {
    return problem(`The orchard cannot be drawn: ${error.message}. Use a browser with WebGL2 (any since 2021), or switch on hardware acceleration in its settings.`);
  }
  canvas.addEventListener("webglcontextlost", event => {
    event.preventDefault();
    problem("The graphics device was lost. The picture comes back when the browser gives it again; else load the page again.");
  });
  canvas.addEventListener("webglcontextrestored", () => { renderer.start(); problem(""); dirty = true; });
  new ResizeObserver(() => { dirty = true; }).observe(canvas);
  worker = new Worker("worker.js");
  worker.onmessage = ({ data }) => answers[data.kind]?.(data);
  worker.onerror = event => answers.stopped({ problem: event.message || "its program cannot be loaded", early: true });
  requestAnimationFrame(frame);
}

start();
