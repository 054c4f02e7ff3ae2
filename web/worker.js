// Runs one world in WebAssembly, apart from the page, so that the page never waits for it.
//
// It takes { kind, .. } messages: grow, show, policy, tree, take, giveBack, wish, run, speed, step, reset, grab, pull, release, drawn, check, time. It answers with menu, grown,
// refused, unshown, taken, picture, grabbed, checked, timed, stopped.

// Time of a turn of stepping [ms]; messages are read between turns.
const TURN = 12;
// Frames that a slow machine may be behind before they are left out.
const BEHIND = 6;

const decoder = new TextDecoder();
let wasm = null;
let running = false, speed = 1, rate = 60;
let due = 0, last = 0, grown = false, changed = false, drawn = true;
// Overlays, null for those that a world begins with; meshes that the page has; frame of the samples that it has.
let overlays = null, meshes = 0, sampled = -1;
let measured = { frames: 0, since: 0, factor: null };

const output = () => new Uint8Array(wasm.memory.buffer, wasm.output(), wasm.output_bytes());
const text = () => decoder.decode(output());
const floats = () => new Float32Array(wasm.memory.buffer, wasm.floats(), wasm.floats_count()).slice();

function give(given) {
  const bytes = typeof given === "string" ? new TextEncoder().encode(given) : new Uint8Array(given);
  // First: it may move the memory.
  const place = wasm.input(bytes.length);
  new Uint8Array(wasm.memory.buffer, place, bytes.length).set(bytes);
}

// Null before the first world.
function told() {
  wasm.tell();
  return JSON.parse(text() || "null");
}

// Grows a world; returns why not, or null.
function grow(ask) {
  give(JSON.stringify(ask));
  if (!wasm.grow()) return text();
  rate = told().frame_rate;
  [grown, due, sampled] = [true, 0, -1];
  return null;
}

// Switches overlays; returns why not, or null.
function show(names) {
  give(names);
  if (!wasm.show()) return text();
  overlays = names;
  changed = true;
  return null;
}

// The latest view of the wrist camera, if the page does not have it.
function wrist() {
  if (!wasm.wrist()) return null;
  return { ...JSON.parse(text()), dots: new Uint8ClampedArray(wasm.memory.buffer, wasm.dots(), wasm.dots_bytes()).slice() };
}

// Figures over time, a new one every tenth of a second.
function samples(now) {
  const frame = Math.floor(now.frame / 6);
  if (!(overlays === "all" || overlays?.includes("plots")) || frame === sampled) return null;
  sampled = frame;
  wasm.samples();
  return floats();
}

function send() {
  wasm.picture();
  const counts = JSON.parse(text()), instances = floats(), now = told();
  [changed, drawn] = [false, false];
  const more = counts.length === meshes ? null : takeMeshes();
  const message = { kind: "picture", counts, instances, meshes: more, told: now, factor: measured.factor, wrist: wrist(), samples: samples(now) };
  postMessage(message, [instances.buffer]);
}

function takeMeshes() {
  wasm.meshes();
  const counts = JSON.parse(text());
  meshes = counts.length;
  return { counts, vertices: floats() };
}

function turn() {
  const now = performance.now();
  if (running && grown) {
    due = Math.min(due + (now - last) / 1000 * rate * speed, Math.max(BEHIND, speed * BEHIND));
    while (due >= 1 && performance.now() < now + TURN) {
      wasm.step(1);
      due -= 1;
      measured.frames += 1;
      changed = true;
    }
    if (now - measured.since > 1000) {
      measured.factor = measured.frames / rate / ((now - measured.since) / 1000);
      [measured.frames, measured.since] = [0, now];
    }
  }
  last = now;
  if (changed && drawn && grown) send();
}

function loop() {
  guarded(turn);
  if (wasm) setTimeout(loop, running ? 2 : 25);
}

const actions = {
  grow({ ask }) {
    const problem = grow(ask);
    if (problem !== null) return postMessage({ kind: "refused", problem });
    const unknown = overlays === null ? null : show(overlays);
    wasm.notes();
    const notes = JSON.parse(text()), made = takeMeshes();
    postMessage({ kind: "grown", meshes: made, notes, told: told() }, [made.vertices.buffer]);
    if (unknown !== null) {
      overlays = null;
      postMessage({ kind: "unshown", problem: unknown, overlays });
    }
    measured = { frames: 0, since: performance.now(), factor: null };
    [changed, drawn] = [true, true];
  },
  show({ names }) {
    const before = overlays, problem = grown ? show(names) : (overlays = names, null);
    if (problem !== null) postMessage({ kind: "unshown", problem, overlays: before });
    sampled = -1;
  },
  // Takes the files of a policy, which a driver of its name then needs no more.
  policy({ name, network, spec }) {
    for (const [part, given] of [name, network, spec].entries()) { give(given); wasm.policy(part); }
  },
  // Takes the file of a digitised tree, which options name from then on.
  tree({ name, bytes }) {
    for (const [part, given] of [name, bytes].entries()) { give(given); wasm.tree(part); }
  },
  take() {
    postMessage({ kind: "taken", closes: wasm.take_over() === 1 });
    changed = true;
  },
  giveBack() { wasm.give_back(); changed = true; },
  wish({ axes, closes }) { wasm.wish(...axes, closes ? 1 : 0); },
  run(message) {
    running = message.running;
    measured = { frames: 0, since: performance.now(), factor: null };
    [due, last, changed] = [0, performance.now(), true];
  },
  speed(message) { speed = message.speed; },
  step() { wasm.step(1); changed = true; },
  reset() { wasm.reset(); [due, changed, sampled] = [0, true, -1]; },
  grab({ p, along, id, byKey }) {
    wasm.grab(...p, ...along, byKey ? 1 : 0);
    postMessage({ kind: "grabbed", id, place: told()?.pull?.p_world ?? null });
    changed = true;
  },
  pull({ p }) { wasm.pull_to(...p); changed = true; },
  release() { wasm.release(); changed = true; },
  drawn() { drawn = true; },
  // Steps an episode at full speed and returns the digests of all frames, hexadecimal, for comparison with another machine.
  check({ ask, frames, policy }) {
    if (policy) actions.policy({ ...policy, network: Uint8Array.from(atob(policy.network), c => c.charCodeAt(0)) });
    const problem = grow(ask);
    if (problem !== null) return postMessage({ kind: "refused", problem });
    const start = performance.now(), digests = [];
    for (let frame = 0; frame < frames; frame += 1) {
      wasm.step_watched(1);
      digests.push(Array.from(output(), byte => byte.toString(16).padStart(2, "0")).join(""));
    }
    postMessage({ kind: "checked", digests, seconds: (performance.now() - start) / 1000, told: told() });
  },
  // Steps an episode at full speed without digests: how fast it is.
  time({ ask, frames }) {
    const problem = grow(ask);
    if (problem !== null) return postMessage({ kind: "refused", problem });
    const start = performance.now();
    wasm.step(frames);
    postMessage({ kind: "timed", seconds: (performance.now() - start) / 1000, told: told() });
  },
};

// Calls, and tells the page if WebAssembly stopped.
function guarded(call) {
  try {
    call();
  } catch (error) {
    let words = String(error);
    if (wasm) {
      const said = new Uint8Array(wasm.memory.buffer, wasm.last_words(), wasm.last_words_bytes());
      if (said.length) words = decoder.decode(said);
    }
    wasm = null;
    postMessage({ kind: "stopped", problem: words });
  }
}

async function begin() {
  if (typeof WebAssembly !== "object") throw new Error("no WebAssembly");
  const answer = await fetch("orchard.wasm");
  if (!answer.ok) throw new Error(`orchard.wasm: ${answer.status} ${answer.statusText}`);
  // Not while streaming: that needs a server which knows the type of the file.
  const { instance } = await WebAssembly.instantiate(await answer.arrayBuffer(), {});
  wasm = instance.exports;
  wasm.begin();
  wasm.offer();
  postMessage({ kind: "menu", menu: JSON.parse(text()) });
  loop();
}

onmessage = ({ data }) => { if (wasm) guarded(() => actions[data.kind](data)); };
begin().catch(error => postMessage({ kind: "stopped", problem: String(error.message || error), early: true }));
