// Policies that a visitor opens: a network (.onnx) and its spec (.json of the same name), by a file chooser or by drag and drop.

const $ = id => document.getElementById(id);
const PREFIX = "onnx:";

export class Policies {
  // `open` is called with { name, network, spec } when both files are there, `say` with a sentence.
  constructor(open, say) {
    [this.open, this.say] = [open, say];
    this.most = Infinity;
    this.files = new Map();
    $("policy").addEventListener("change", () => { this.take([...$("policy").files]); $("policy").value = ""; });
  }

  async take(files) {
    const other = files.find(file => !/\.(onnx|json)$/i.test(file.name));
    if (other) return this.say(`“${other.name.slice(0, 60)}” is no policy: open a network, FILE.onnx, and its spec, FILE.json. A tree is one file, FILE.json or FILE.mtg.`);
    const large = files.find(file => file.size > this.most);
    if (large) return this.say(`“${large.name.slice(0, 60)}” has more than ${this.most} bytes, the largest size that is read.`);
    for (const file of files) this.files.set(file.name, file);
    // The newest network, or the one whose spec came.
    const stems = files.map(file => file.name.replace(/\.[^.]*$/, ""));
    const stem = stems.find(stem => this.files.has(`${stem}.onnx`) && this.files.has(`${stem}.json`));
    if (stem === undefined) {
      const lacks = this.files.has(`${stems[0]}.onnx`) ? `its spec ${stems[0]}.json` : `its network ${stems[0]}.onnx`;
      $("policy-told").textContent = `Open ${lacks}, too: a policy is two files.`;
      return undefined;
    }
    try {
      const network = await this.files.get(`${stem}.onnx`).arrayBuffer(), spec = await this.files.get(`${stem}.json`).text();
      this.files.clear();
      $("policy-told").textContent = `${stem}.onnx is open.`;
      return this.open({ name: `${stem}.onnx`, network, spec });
    } catch (error) {
      return this.say(`The files of ${stem} cannot be read: ${error.message}. Open both again.`);
    }
  }

  // Adds the driver of a policy to the list of drivers, and returns its name.
  static driver(name) {
    const driver = `${PREFIX}${name}`;
    if (![...$("driver").options].some(option => option.value === driver)) $("driver").append(new Option(driver, driver));
    return driver;
  }
}
