// The options of a page as parts of its address, so that a link shows the same world.

const PARTS = ["preset", "seed", "tree", "tree_file", "tree_unit", "tree_plant", "foliage", "robot", "camera", "driver", "speed", "overlays"];

// Reads an address; `speeds` are the time scales that the page has. Returns the options that it names, the overlays (null without any), and a sentence
// for each that cannot be read.
export function read(search, speeds) {
  const given = new URLSearchParams(search), ask = {}, problems = [];
  let speed = "1", overlays = null;
  for (const [name, value] of given) {
    if (!PARTS.includes(name)) {
      problems.push(`The link has a part “${name.slice(0, 40)}” that this page does not know; it was left out.`);
    } else if (name === "tree") {
      if (/^\d{1,10}$/.test(value) && Number(value) < 2 ** 32) ask.tree = Number(value);
      else problems.push(`The link asks for tree “${value.slice(0, 40)}”, but a tree number is a whole number from 0 to 4294967295.`);
    } else if (name === "foliage") {
      if (value.trim() !== "" && Number.isFinite(Number(value))) ask.foliage = Number(value);
      else problems.push(`The link asks for foliage “${value.slice(0, 40)}”, which is no number.`);
    } else if (name === "speed") {
      if (speeds.includes(value)) speed = value;
      else problems.push(`The link asks for time scale “${value.slice(0, 40)}”; this page has ${speeds.join(", ")}.`);
    } else if (name === "overlays") {
      overlays = value;
    } else {
      ask[name] = value;
    }
  }
  return { ask, speed, overlays, problems };
}

// The address of options; `overlays` is null for those of a page that was just opened, `usual` are the options of such a page.
export function write(ask, speed, overlays, usual) {
  const parts = new URLSearchParams({ preset: ask.preset, seed: ask.seed, tree: ask.tree });
  for (const name of ["tree_file", "tree_unit", "tree_plant"]) if (ask[name]) parts.set(name, ask[name]);
  if (ask.robot !== usual.robot) parts.set("robot", ask.robot);
  if (ask.camera) parts.set("camera", ask.camera);
  parts.set("driver", ask.driver);
  if (ask.foliage !== undefined) parts.set("foliage", ask.foliage);
  if (speed !== "1") parts.set("speed", speed);
  if (overlays !== null) parts.set("overlays", overlays);
  return `?${parts}`;
}
