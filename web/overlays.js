// Overlays: their switches, the panel with what the wrist camera sees, the controller's log, and plots.

const $ = id => document.getElementById(id);

// Colours of marks, as crates/play has them, and of lines that stand out on every picture.
const [LIGHT, DARK, YELLOW] = ["#ffffff", "#000000", "#f0e442"];
// Plots: title, unit, and lines of a place in a sample, a name, a colour and a dash.
const SAMPLE = 5;
const PLOTS = [
  ["force, N", [[1, "on wood", "#d55e00", []], [2, "in the hand", "#0072b2", [5, 3]]]],
  ["fruit", [[3, "in the bucket", "#009e73", []], [4, "on the ground", "#b36b00", [5, 3]]]],
];

// Keys of the overlays, in their order.
const KEYS = "1234567890x";

export class Overlays {
  // `change` is called with the names after a switch was changed.
  constructor(change) {
    this.change = change;
    this.on = new Set();
    this.all = [];
    this.first = "";
    this.view = null;
    this.picture = document.createElement("canvas");
  }

  // Makes the switches: names with helps, and those that are on when a page opens.
  fill(list, first) {
    this.all = list.map(overlay => overlay.name);
    this.first = first;
    $("overlays").replaceChildren(...list.map(({ name, help }, k) => {
      const label = document.createElement("label"), box = document.createElement("input"), note = document.createElement("small");
      Object.assign(box, { type: "checkbox", id: `overlay-${name}`, value: name });
      box.setAttribute("aria-keyshortcuts", KEYS[k]);
      box.addEventListener("change", () => this.turn(name, box.checked));
      note.textContent = help;
      label.className = "check";
      label.append(box, `${KEYS[k].toUpperCase()} ${name}`, note);
      return label;
    }));
    this.set(first);
  }

  // Shows which overlays are on, without telling anybody.
  set(names) {
    const known = names === "all" ? this.all : names.split(",").map(name => name.trim());
    this.on = new Set(this.all.filter(name => known.includes(name)));
    for (const name of this.all) $(`overlay-${name}`).checked = this.on.has(name);
    this.arrange();
  }

  has(name) { return this.on.has(name); }

  names() { return this.all.filter(name => this.on.has(name)).join(",") || "none"; }

  // The part of the address: null for the overlays of a page that was just opened.
  address() {
    const before = this.first.split(",");
    return before.length === this.on.size && before.every(name => this.on.has(name)) ? null : this.names();
  }

  turn(name, on) {
    this.on[on ? "add" : "delete"](name);
    $(`overlay-${name}`).checked = on;
    this.arrange();
    this.change(this.names());
  }

  // Switches the overlay of a key; false if there is none.
  key(key) {
    const name = this.all[KEYS.indexOf(key.toLowerCase())];
    if (!name) return false;
    this.turn(name, !this.has(name));
    return true;
  }

  arrange() {
    const camera = this.has("depth") || this.has("colour");
    $("wrist").hidden = !camera || !this.view;
    $("plots").hidden = !this.has("plots");
    $("log").hidden = !this.has("plan") || !$("log").textContent;
    $("loads").hidden = !this.has("moments") && !this.has("stems");
  }

  // Another world: its camera has not taken an image yet.
  begin() {
    this.view = null;
    this.arrange();
  }

  // Takes what came with a picture of the world.
  take(view, samples, told, driver) {
    if (view) { this.view = view; this.draw(); }
    // Before the first image there is none, as after a reset.
    if (told.frame === 0 && !view) this.view = null;
    if (samples) this.plot(samples);
    const log = told.log.join("\n");
    if ($("log").textContent !== log) $("log").textContent = log;
    this.arrange();
    if ($("wrist").hidden) return;
    const parts = [`Wrist camera, ${(this.view.frame / told.frame_rate).toFixed(1)} s`];
    if (told.taken_over) parts.push("you drive");
    else if (told.state) parts.push(`${driver}: ${told.state}`);
    if (told.target_distance !== null) parts.push(`target ${told.target_distance.toFixed(2)} m away`);
    if (this.has("detections") && !this.has("colour")) parts.push(`${this.view.found.length} found`);
    const caption = parts.join(" · ");
    if ($("wrist-told").textContent !== caption) $("wrist-told").textContent = caption;
  }

  // Draws the latest view: the picture, a circle with its score for each detection, and a dashed one for the target.
  draw() {
    const { size, picture, dots, found, target } = this.view, canvas = $("wrist-picture");
    [this.picture.width, this.picture.height] = picture;
    this.picture.getContext("2d").putImageData(new ImageData(dots, ...picture), 0, 0);
    // Circles are finer than pixels.
    const wide = 480, scale = wide / size[0];
    [canvas.width, canvas.height] = [wide, Math.round(size[1] * scale)];
    const context = canvas.getContext("2d");
    context.imageSmoothingEnabled = false;
    context.drawImage(this.picture, 0, 0, canvas.width, canvas.height);
    context.font = "bold 21px system-ui, sans-serif";
    context.lineJoin = "round";
    const circle = ({ u, v, radius }, colour, dash) => {
      context.setLineDash(dash);
      for (const [width, shade] of [[7, DARK], [3, colour]]) {
        Object.assign(context, { lineWidth: width, strokeStyle: shade });
        context.beginPath();
        context.arc((u + 0.5) * scale, (v + 0.5) * scale, radius * scale, 0, 2 * Math.PI);
        context.stroke();
      }
      context.setLineDash([]);
    };
    for (const detection of found) circle(detection, LIGHT, []);
    if (target) circle({ ...target, radius: 1.35 * target.radius }, YELLOW, [14, 10]);
    // Scores beside their circles, where no other score stands; the surest first.
    const placed = [];
    for (const { u, v, radius, score } of [...found].sort((a, b) => b.score - a.score)) {
      const text = score.toFixed(2), wide = context.measureText(text).width, y = Math.min(Math.max((v + 0.5) * scale + 7, 18), canvas.height - 4);
      const free = x => x > 2 && x + wide < canvas.width - 2 && placed.every(([a, b]) => Math.abs(a - x) > wide + 4 || Math.abs(b - y) > 20);
      const x = [(u + 0.5 + radius) * scale + 6, (u + 0.5 - radius) * scale - 6 - wide].find(free);
      if (x === undefined) continue;
      placed.push([x, y]);
      Object.assign(context, { lineWidth: 5, strokeStyle: DARK, fillStyle: LIGHT });
      context.strokeText(text, x, y);
      context.fillText(text, x, y);
    }
    canvas.dataset.frame = this.view.frame;
    canvas.dataset.found = found.length;
  }

  // Draws figures over time, two plots one below the other.
  plot(samples) {
    const canvas = $("plots"), ratio = Math.min(devicePixelRatio || 1, 2);
    const [width, height] = [canvas.clientWidth || 280, canvas.clientHeight || 150];
    [canvas.width, canvas.height] = [width * ratio, height * ratio];
    const context = canvas.getContext("2d"), count = samples.length / SAMPLE;
    context.scale(ratio, ratio);
    context.font = "11px system-ui, sans-serif";
    const [from, to] = count ? [samples[0], Math.max(samples[(count - 1) * SAMPLE], samples[0] + 5)] : [0, 5];
    PLOTS.forEach(([title, lines], k) => {
      const [left, top, wide, high] = [34, k * height / 2 + 18, width - 42, height / 2 - 24];
      const values = lines.flatMap(([place]) => Array.from({ length: count }, (_, n) => samples[n * SAMPLE + place]));
      const most = values.reduce((a, b) => Math.max(a, b), 1);
      context.strokeStyle = "#8a949b";
      context.lineWidth = 1;
      context.strokeRect(left, top, wide, high);
      context.fillStyle = "#1b2328";
      context.fillText(most.toFixed(most < 10 ? 1 : 0), 4, top + 8);
      context.fillText("0", 4, top + high);
      let x = left;
      context.fillText(title, x, top - 5);
      x += context.measureText(title).width + 10;
      for (const [place, name, colour, dash] of lines) {
        Object.assign(context, { strokeStyle: colour, lineWidth: 2 });
        context.setLineDash(dash);
        context.beginPath();
        context.moveTo(x, top - 9);
        context.lineTo(x + 16, top - 9);
        context.stroke();
        context.fillText(name, x + 20, top - 5);
        x += context.measureText(name).width + 30;
        context.beginPath();
        for (let n = 0; n < count; n += 1) {
          const at = [left + wide * (samples[n * SAMPLE] - from) / (to - from), top + high * (1 - samples[n * SAMPLE + place] / most)];
          if (n === 0) context.moveTo(...at); else context.lineTo(...at);
        }
        context.stroke();
        context.setLineDash([]);
      }
    });
    canvas.dataset.samples = count;
  }
}
