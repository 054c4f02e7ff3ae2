// Runs a WebAssembly program (WASI) on a folder: node --no-warnings wasm.mjs PROGRAM.wasm FOLDER. What it prints goes to the standard output.
import { readFile } from "node:fs/promises";
import { WASI } from "node:wasi";

const [program, folder] = process.argv.slice(2);
const wasi = new WASI({ version: "preview1", args: [program, "/networks"], preopens: { "/networks": folder } });
const { instance } = await WebAssembly.instantiate(await readFile(program), wasi.getImportObject());
process.exitCode = wasi.start(instance);
