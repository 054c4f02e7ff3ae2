// The page of many trees: WebAssembly grows and packs them, WebGPU steps them, a canvas shows them as lines.

const $ = id => document.getElementById(id);
// Frames that are submitted at once, which is how often a picture is drawn.
const FRAMES = 6;
// Distance of the rules of successive frames in their buffer [bytes], which every device allows.
const STRIDE = 256;
const COLOURS = { wood: "#5b4636", hanging: "#e69f00", fallen: "#cc79a7" };

const decoder = new TextDecoder();
let wasm = null, device = null, batch = null, running = true;

function problem(sentence) {
  $("problem").textContent = sentence;
  $("problem").hidden = !sentence;
  if (sentence) $("waiting").hidden = true;
}

function wait(words) {
  $("waiting").textContent = words;
  $("waiting").hidden = !words;
  return new Promise(resolve => setTimeout(resolve));
}

const output = () => new Uint8Array(wasm.memory.buffer, wasm.output(), wasm.output_bytes());

// Calls a function of the program; throws the sentence that it answers if it fails.
function call(name, ...given) {
  const answer = wasm[name](...given);
  if (!answer) throw new Error(decoder.decode(output()));
  return answer;
}

function give(bytes) {
  // First: it may move the memory.
  const place = wasm.input(bytes.length);
  new Uint8Array(wasm.memory.buffer, place, bytes.length).set(bytes);
}

// Opens the program and a device, once.
async function open() {
  if (!navigator.gpu) throw new Error("this browser has no WebGPU. Use one that has it (Chrome or Edge since 113, Safari since 26, Firefox since 141 on Windows), or switch it on");
  if (!wasm) {
    const answer = await fetch("batch.wasm");
    if (!answer.ok) throw new Error(`batch.wasm: ${answer.status} ${answer.statusText}`);
    const { instance } = await WebAssembly.instantiate(await answer.arrayBuffer(), {});
    wasm = instance.exports;
    wasm.begin();
  }
  if (device) return;
  const adapter = await navigator.gpu.requestAdapter({ powerPreference: "high-performance" });
  if (!adapter) throw new Error("WebGPU is here, but finds no graphics device. Switch on hardware acceleration in the browser's settings");
  const most = adapter.limits;
  device = await adapter.requestDevice({ requiredLimits: {
    maxStorageBufferBindingSize: most.maxStorageBufferBindingSize,
    maxBufferSize: most.maxBufferSize,
    maxComputeInvocationsPerWorkgroup: most.maxComputeInvocationsPerWorkgroup,
  } });
  device.lost.then(lost => {
    [device, batch] = [null, null];
    if (lost.reason !== "destroyed") problem(`The graphics device was lost: ${lost.message} Press “Grow and shake” to open it again.`);
  });
}

// The kernels and buffers of the packed trees.
async function build(packed) {
  const { THREADS, size } = { THREADS: packed.threads, size: bytes => Math.max(16, Math.ceil(bytes / 16) * 16) };
  const has = device.limits.maxComputeInvocationsPerWorkgroup;
  if (THREADS > has) throw new Error(`the device runs ${has} threads in a workgroup; ${THREADS} are needed`);
  const large = packed.buffers.find(buffer => buffer.bytes > device.limits.maxStorageBufferBindingSize);
  if (large) throw new Error(`the buffer of ${large.name} has ${large.bytes} bytes, and the device binds at most ${device.limits.maxStorageBufferBindingSize}. Take fewer trees`);
  device.pushErrorScope("validation");
  const { COMPUTE } = GPUShaderStage, { STORAGE, UNIFORM, COPY_DST, COPY_SRC, MAP_READ } = GPUBufferUsage;
  const rules = device.createBuffer({ size: STRIDE * FRAMES, usage: UNIFORM | COPY_DST });
  call("rules", 1);
  const words = output().length;
  const buffers = packed.buffers.map((buffer, number) => {
    const made = device.createBuffer({ size: size(buffer.bytes), usage: STORAGE | COPY_DST | COPY_SRC });
    call("contents", number);
    if (buffer.bytes) device.queue.writeBuffer(made, 0, output());
    return made;
  });
  const layout = device.createBindGroupLayout({ entries: [
    { binding: 0, visibility: COMPUTE, buffer: { type: "uniform", hasDynamicOffset: true } },
    ...packed.buffers.map((buffer, number) => (
      { binding: number + 1, visibility: COMPUTE, buffer: { type: buffer.is_read_only ? "read-only-storage" : "storage" } })),
  ] });
  const module = device.createShaderModule({ code: packed.source });
  const pipelines = await Promise.all(packed.kernels.map(kernel => device.createComputePipelineAsync({
    layout: device.createPipelineLayout({ bindGroupLayouts: [layout] }),
    compute: { module, entryPoint: kernel.entry, constants: kernel.constants },
  })));
  const group = device.createBindGroup({ layout, entries: [
    { binding: 0, resource: { buffer: rules, size: words } },
    ...buffers.map((buffer, number) => ({ binding: number + 1, resource: { buffer } })),
  ] });
  const state = packed.buffers.flatMap(({ name, bytes }, number) => (["states", "links", "fruit", "worlds"].includes(name) && bytes
    ? [{ number, bytes, copy: device.createBuffer({ size: size(bytes), usage: MAP_READ | COPY_DST }) }] : []));
  const error = await device.popErrorScope();
  if (error) throw new Error(error.message);
  return { ...packed, rules, buffers, pipelines, group, state, frame: 0 };
}

// Steps some frames of the batch and takes the state that they leave; returns the time that it took [s], or null if another batch has come.
async function advance(frames) {
  const start = performance.now(), own = batch, { state } = batch;
  for (let slot = 0; slot < frames; slot += 1) {
    call("rules", batch.frame + slot + 1);
    device.queue.writeBuffer(batch.rules, slot * STRIDE, output());
  }
  const encoder = device.createCommandEncoder(), pass = encoder.beginComputePass();
  for (let slot = 0; slot < frames; slot += 1) {
    pass.setBindGroup(0, batch.group, [slot * STRIDE]);
    for (const [k, { groups }] of batch.kernels.entries()) {
      pass.setPipeline(batch.pipelines[k]);
      pass.dispatchWorkgroups(...groups);
    }
  }
  pass.end();
  for (const { number, bytes, copy } of state) encoder.copyBufferToBuffer(batch.buffers[number], 0, copy, 0, Math.ceil(bytes / 4) * 4);
  device.queue.submit([encoder.finish()]);
  for (const { number, bytes, copy } of state) {
    await copy.mapAsync(GPUMapMode.READ);
    if (batch !== own) return null;
    give(new Uint8Array(copy.getMappedRange(), 0, bytes));
    copy.unmap();
    call("take", number);
  }
  batch.frame += frames;
  return (performance.now() - start) / 1000;
}

function draw(worlds) {
  call("picture");
  const bytes = output(), words = new DataView(bytes.buffer, bytes.byteOffset, bytes.length);
  const canvas = $("canvas"), ink = canvas.getContext("2d");
  const wide = canvas.clientWidth, columns = Math.max(1, Math.min(worlds, Math.floor(wide / Math.max(44, wide / Math.ceil(Math.sqrt(worlds * 1.6))))));
  const cell = wide / columns, tall = cell * 1.25, rows = Math.ceil(worlds / columns), dense = window.devicePixelRatio || 1;
  if (canvas.width !== Math.round(wide * dense) || canvas.height !== Math.round(rows * tall * dense)) {
    canvas.style.height = `${rows * tall}px`;
    [canvas.width, canvas.height] = [Math.round(wide * dense), Math.round(rows * tall * dense)];
  }
  ink.setTransform(dense, 0, 0, dense, 0, 0);
  ink.clearRect(0, 0, wide, rows * tall);
  const counts = Array.from({ length: worlds }, (_, k) => [words.getUint32(8 * k, true), words.getUint32(8 * k + 4, true)]);
  const number = k => words.getFloat32(8 * worlds + 4 * k, true);
  const segments = counts.reduce((sum, [own]) => sum + own, 0);
  let line = 0, dot = 5 * segments;
  // A cell holds every tree as it stood in the first picture.
  batch.reach ??= Array.from({ length: segments }, (_, k) => [number(5 * k + 2), number(5 * k + 3)])
    .reduce(({ left, right, high }, [x, z]) => ({ left: Math.min(left, x), right: Math.max(right, x), high: Math.max(high, z) }), { left: -0.2, right: 0.2, high: 0.5 });
  const { left, right, high } = batch.reach;
  const scale = Math.min(0.92 * tall / high, 0.96 * cell / (right - left));
  for (const [k, [own, fruit]] of counts.entries()) {
    const x = (k % columns + 0.5) * cell - scale * (left + right) / 2, y = (Math.floor(k / columns) + 0.97) * tall;
    ink.strokeStyle = COLOURS.wood;
    ink.lineCap = "round";
    for (let end = line + 5 * own; line < end; line += 5) {
      ink.lineWidth = Math.max(0.5, 2 * scale * number(line + 4));
      ink.beginPath();
      ink.moveTo(x + scale * number(line), y - scale * number(line + 1));
      ink.lineTo(x + scale * number(line + 2), y - scale * number(line + 3));
      ink.stroke();
    }
    for (let end = dot + 4 * fruit; dot < end; dot += 4) {
      ink.fillStyle = number(dot + 3) ? COLOURS.hanging : COLOURS.fallen;
      ink.beginPath();
      ink.arc(x + scale * number(dot), y - scale * number(dot + 1), Math.max(1, scale * number(dot + 2)), 0, 2 * Math.PI);
      ink.fill();
    }
  }
  document.body.dataset.pictured = String(batch.frame);
}

let turns = 0;

// Grows trees, builds their batch, and steps it until others are asked for.
async function grow() {
  turns += 1;
  const turn = turns, worlds = Number($("worlds").value);
  problem("");
  $("grow").disabled = $("run").disabled = true;
  batch = null;
  delete document.body.dataset.pictured;
  try {
    if (!/^\d{1,10}$/.test($("seed").value.trim()) || Number($("seed").value) >= 2 ** 32) throw new Error(`seed “${$("seed").value.slice(0, 40)}” is no whole number from 0 to 4294967295`);
    await wait("Opening the graphics device …");
    await open();
    give(new TextEncoder().encode(JSON.stringify({ preset: $("preset").value, seed: Number($("seed").value), worlds, shake: Number($("shake").value) })));
    call("stand");
    for (let k = 1; call("grow_one") === 2; k += 1) if (k % 4 === 0) await wait(`Growing the trees: ${k} of ${worlds} …`);
    call("pack");
    const packed = JSON.parse(decoder.decode(output()));
    await wait("Compiling the kernels for this device …");
    batch = await build(packed);
    await wait("");
    draw(worlds);
    $("run").disabled = false;
    setRunning(true);
  } catch (error) {
    stop(error);
  }
  $("grow").disabled = false;
  let rate = null;
  while (batch && turn === turns) {
    try {
      if (running) {
        const seconds = await advance(FRAMES);
        if (seconds === null) return;
        const now = worlds * FRAMES * batch.substeps / seconds;
        rate = rate === null ? now : 0.8 * rate + 0.2 * now;
        tell(worlds, rate);
        draw(worlds);
      }
    } catch (error) {
      if (turn === turns) stop(error);
      return;
    }
    await new Promise(resolve => (document.hidden || !running ? setTimeout(resolve, 100) : requestAnimationFrame(resolve)));
  }
}

function tell(worlds, rate) {
  call("figures");
  const { snapped, detached, stopped } = JSON.parse(decoder.decode(output()));
  const seconds = (batch.frame / 60).toFixed(1), thousands = rate < 1e4 ? rate.toFixed(0) : `${(rate / 1000).toFixed(0)} thousand`;
  $("told").textContent = `${worlds} trees, ${seconds} s after the shake: ${thousands} substeps of a tree per second; ${snapped} joints broke, ${detached} fruit came off.`
    + (stopped ? ` ${stopped} trees stand still: they were no longer finite.` : "");
  document.body.dataset.rate = String(rate);
}

function stop(error) {
  let words = error.message;
  if (wasm && error instanceof WebAssembly.RuntimeError) {
    words = decoder.decode(new Uint8Array(wasm.memory.buffer, wasm.last_words(), wasm.last_words_bytes())) || words;
    wasm = null;
  }
  batch = null;
  problem(`The trees cannot be stepped here: ${words}.`);
}

function setRunning(now) {
  running = now;
  $("run").textContent = running ? "Pause" : "Run";
}

$("form").addEventListener("submit", event => { event.preventDefault(); grow(); });
$("run").addEventListener("click", () => setRunning(!running));

// For checks: steps trees some frames from the start, without pictures, and returns the joint angles of some.
window.anglesAfter = async ({ asked, frames, trees }) => {
  turns += 1;
  await open();
  give(new TextEncoder().encode(JSON.stringify(asked)));
  call("stand");
  while (call("grow_one") === 2) { /* the next */ }
  call("pack");
  batch = await build(JSON.parse(decoder.decode(output())));
  for (let left = frames; left > 0; left -= FRAMES) await advance(Math.min(FRAMES, left));
  batch = null;
  return trees.map(index => {
    call("angles", index);
    return [...new Float64Array(output().slice().buffer)];
  });
};

if (!new URLSearchParams(location.search).has("wait")) grow();
