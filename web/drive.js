// The robot driven by a person: keys, buttons on the screen and a gamepad become deflections of base and hand, each -1 to 1.

const $ = id => document.getElementById(id);

// Keys: part of the wish, axis, sign. With Shift those of the hand turn it.
const KEYS = {
  w: ["base", 0, 1], s: ["base", 0, -1], a: ["base", 1, 1], d: ["base", 1, -1], q: ["base", 2, 1], e: ["base", 2, -1],
  i: ["hand", 0, 1], k: ["hand", 0, -1], j: ["hand", 1, 1], l: ["hand", 1, -1], u: ["hand", 2, 1], o: ["hand", 2, -1],
};

// A gamepad of the standard mapping (w3.org/TR/gamepad): sticks, and buttons by their numbers.
const STICK = { baseLeft: 0, baseForward: 1, handLeft: 2, handForward: 3 };
const BUTTON = { hand: 0, turn: 2, take: 3, yawLeft: 4, yawRight: 5, down: 6, up: 7, pause: 9 };
// Deflections of a stick below this count as rest.
const REST = 0.15;

const zero = () => ({ base: [0, 0, 0], hand: [0, 0, 0], turn: [0, 0, 0] });
const limited = x => Math.max(-1, Math.min(1, x));

export class Drive {
  // `send` sends a message to the world; `pause` pauses or goes on.
  constructor(send, pause) {
    [this.send, this.pause] = [send, pause];
    [this.takenOver, this.closes, this.turns, this.shift, this.sent] = [false, false, false, false, ""];
    this.keys = new Set();
    this.held = new Map();
    this.pressed = new Set();
    $("take").addEventListener("click", () => this.take());
    $("close").addEventListener("click", () => this.close());
    $("turn").addEventListener("click", () => { this.turns = !this.turns; this.tell(); });
    for (const button of document.querySelectorAll("[data-drive]")) this.listen(button);
    addEventListener("keyup", event => { this.keys.delete(event.key.toLowerCase()); this.shift = event.shiftKey; this.wish(); });
    addEventListener("blur", () => this.rest());
    addEventListener("gamepadconnected", () => { $("gamepad").textContent = "A gamepad is there."; });
    addEventListener("gamepaddisconnected", () => { $("gamepad").textContent = "The gamepad is gone."; this.rest(); });
    this.tell();
  }

  // A button moves the robot while it is held, by pointer or by key.
  listen(button) {
    const [part, axis, sign] = button.dataset.drive.split(" ");
    const hold = by => { this.held.set(by, [part, Number(axis), Number(sign)]); button.dataset.held = "yes"; this.wish(); };
    const leave = by => { if (this.held.delete(by)) { delete button.dataset.held; this.wish(); } };
    button.addEventListener("pointerdown", event => { button.setPointerCapture(event.pointerId); hold(event.pointerId); });
    for (const name of ["pointerup", "pointercancel", "lostpointercapture"]) button.addEventListener(name, event => leave(event.pointerId));
    button.addEventListener("keydown", event => { if (event.key === " " || event.key === "Enter") { event.preventDefault(); hold(button); } });
    button.addEventListener("keyup", () => leave(button));
    button.addEventListener("blur", () => leave(button));
    button.addEventListener("contextmenu", event => event.preventDefault());
  }

  // Lets go of all controls.
  rest() {
    this.keys.clear();
    this.held.clear();
    for (const button of document.querySelectorAll("[data-held]")) delete button.dataset.held;
    this.wish();
  }

  // Takes a key that goes down; false if it is none for driving.
  key(event) {
    const name = event.key.toLowerCase();
    if (name === "t") { if (!event.repeat) this.take(); return true; }
    if (!this.takenOver) return false;
    this.shift = event.shiftKey;
    if (name === "c") { if (!event.repeat) this.close(); return true; }
    if (KEYS[name]) this.keys.add(name);
    this.wish();
    return Boolean(KEYS[name]);
  }

  take() { this.send(this.takenOver ? "giveBack" : "take"); }

  close() {
    this.closes = !this.closes;
    this.tell();
    this.wish();
  }

  // The world says who drives, and whether the hand was closed when it was taken over.
  set(takenOver, closes = this.closes) {
    if (takenOver === this.takenOver && closes === this.closes) return;
    if (takenOver !== this.takenOver) [this.takenOver, this.turns] = [takenOver, false];
    this.closes = closes;
    this.sent = "";
    this.rest();
    this.tell();
  }

  tell() {
    $("take").textContent = this.takenOver ? "Give back" : "Take over";
    $("pads").hidden = !this.takenOver;
    $("close").textContent = this.closes ? "Open" : "Close";
    $("close").setAttribute("aria-label", this.closes ? "Open the hand" : "Close the hand");
    $("turn").setAttribute("aria-pressed", String(this.turns));
    document.body.classList.toggle("driving", this.takenOver);
  }

  // What the gamepad asks for; its buttons act once when they go down.
  gamepad() {
    const pad = [...navigator.getGamepads?.() ?? []].find(pad => pad?.connected && pad.mapping === "standard");
    const wished = zero();
    if (!pad) return wished;
    const down = number => pad.buttons[number]?.pressed ?? false, value = number => pad.buttons[number]?.value ?? 0;
    const stick = number => (Math.abs(pad.axes[number] ?? 0) < REST ? 0 : -pad.axes[number]);
    const once = number => {
      const is = down(number), was = this.pressed.has(number);
      this.pressed[is ? "add" : "delete"](number);
      return is && !was;
    };
    if (once(BUTTON.take)) this.take();
    if (once(BUTTON.pause)) this.pause();
    if (once(BUTTON.hand) && this.takenOver) this.close();
    wished.base = [stick(STICK.baseForward), stick(STICK.baseLeft), value(BUTTON.yawLeft) - value(BUTTON.yawRight)];
    const three = [stick(STICK.handForward), stick(STICK.handLeft), value(BUTTON.up) - value(BUTTON.down)];
    wished[down(BUTTON.turn) ? "turn" : "hand"] = three;
    return wished;
  }

  // Sends what all controls together ask for, if it has changed. It is called with every picture, since gamepads tell nothing by themselves.
  wish() {
    const wished = this.gamepad();
    const add = ([part, axis, sign], turns) => { wished[part === "hand" && turns ? "turn" : part][axis] += sign; };
    for (const name of this.keys) add(KEYS[name], this.shift);
    for (const held of this.held.values()) add(held, this.turns);
    if (!this.takenOver) return;
    const axes = [...wished.base, ...wished.hand, ...wished.turn].map(limited);
    const text = `${axes} ${this.closes}`;
    if (text === this.sent) return;
    this.sent = text;
    this.send("wish", { axes, closes: this.closes });
  }
}
