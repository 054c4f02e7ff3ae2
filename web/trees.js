// Digitised trees that a visitor opens: a skeleton in JSON or an MTG file, by a file chooser or by drag and drop.

const $ = id => document.getElementById(id);

export class Trees {
  // `open` is called with { name, bytes } of a file, `say` with a sentence.
  constructor(open, say) {
    [this.open, this.say] = [open, say];
    this.most = Infinity;
    $("tree-file").addEventListener("change", () => { this.take($("tree-file").files[0]); $("tree-file").value = ""; });
    $("source").addEventListener("change", () => this.enable());
  }

  // The tree among files that were dropped, if there is one: a JSON file may be the spec of a policy instead.
  static async among(files) {
    for (const file of files) {
      if (/\.mtg$/i.test(file.name)) return file;
      if (/\.json$/i.test(file.name) && (await file.slice(0, 4096).text()).includes('"orchard-skeleton"')) return file;
    }
    return null;
  }

  async take(file) {
    if (!file) return undefined;
    const name = file.name.slice(0, 60);
    if (!/\.(json|mtg)$/.test(file.name)) return this.say(`“${name}” is no tree: open a skeleton, FILE.json, or an MTG file, FILE.mtg.`);
    if (file.size > this.most) return this.say(`“${name}” has more than ${this.most} bytes, the largest size that is read.`);
    try {
      return this.open({ name: file.name, bytes: await file.arrayBuffer() });
    } catch (error) {
      return this.say(`The file “${name}” cannot be read: ${error.message}. Open it again.`);
    }
  }

  // Shows the tree that options name: `ask` without a file has a grown one.
  show(ask) {
    const name = ask.tree_file ?? "";
    if (![...$("source").options].some(option => option.value === name)) $("source").append(new Option(`from ${name}`, name));
    $("source").value = name;
    $("tree-unit").value = ask.tree_unit ?? "";
    $("tree-plant").value = ask.tree_plant ?? "";
    this.enable();
  }

  // Adds the file that the controls name to options.
  add(ask) {
    if (!$("source").value) return ask;
    const [unit, plant] = ["tree-unit", "tree-plant"].map(id => $(id).disabled ? "" : $(id).value.trim());
    return { ...ask, tree_file: $("source").value, ...unit && { tree_unit: unit }, ...plant && { tree_plant: plant } };
  }

  enable() {
    // Units and plants are of MTG files.
    for (const id of ["tree-unit", "tree-plant"]) $(id).disabled = !/\.mtg$/.test($("source").value);
  }

  // Tells the assumptions made when the file was read.
  tell(notes) {
    const name = $("source").value;
    $("tree-told").textContent = name ? [`${name} is open.`, ...notes.map(note => `${note.charAt(0).toUpperCase()}${note.slice(1)}.`)].join(" ") : "";
  }
}
