//! Computes every network of a folder and prints the bits of its outputs, a line each: `cargo run -p orchard-network --example outputs -- FOLDER`.
//!
//! `NAME.onnx` gets the numbers of `NAME.in`: those of its inputs, one after another, least significant byte first. `cargo xtask check-network`
//! runs this program here and in WebAssembly and compares.

use std::error::Error;
use std::fs;
use std::path::Path;

use orchard_network::{Kind, Network, Port, Tensor, Values};

/// The next array of an input in a list of bytes.
fn array(port: &Port, bytes: &mut &[u8]) -> Option<Tensor> {
    let shape: Vec<usize> = port.shape.iter().map(|d| d.unwrap_or(1)).collect();
    let n: usize = shape.iter().product();
    let size = match port.kind {
        Kind::F32 => 4,
        Kind::I64 => 8,
        Kind::U8 | Kind::Bool => 1,
    };
    let (own, rest) = bytes.split_at_checked(n * size)?;
    *bytes = rest;
    let values = match port.kind {
        Kind::F32 => Values::F32(own.as_chunks().0.iter().map(|x| f32::from_le_bytes(*x)).collect()),
        Kind::I64 => Values::I64(own.as_chunks().0.iter().map(|x| i64::from_le_bytes(*x)).collect()),
        Kind::U8 => Values::U8(own.to_vec()),
        Kind::Bool => Values::Bool(own.iter().map(|x| *x != 0).collect()),
    };
    Tensor::new(shape, values)
}

/// Outputs as 32-bit numbers, in bits.
fn bits(tensor: &Tensor) -> Vec<u32> {
    let of = |x: f32| x.to_bits();
    match tensor.values() {
        Values::F32(v) => v.iter().map(|&x| of(x)).collect(),
        Values::I64(v) => v.iter().map(|&x| of(x as f32)).collect(),
        Values::U8(v) => v.iter().map(|&x| of(f32::from(x))).collect(),
        Values::Bool(v) => v.iter().map(|&x| of(f32::from(x))).collect(),
    }
}

fn outputs(file: &Path) -> Result<String, Box<dyn Error>> {
    let network = Network::from_bytes(&fs::read(file)?)?;
    let input = fs::read(file.with_extension("in"))?;
    let mut rest = input.as_slice();
    let arrays: Option<Vec<Tensor>> = network.inputs().iter().map(|port| array(port, &mut rest)).collect();
    let mut line = String::new();
    for tensor in network.run(arrays.ok_or("too few numbers")?)? {
        let shape: Vec<String> = tensor.shape().iter().map(ToString::to_string).collect();
        let bits: Vec<String> = bits(&tensor).iter().map(|x| format!("{x:08x}")).collect();
        line += &format!(
            " {} {}",
            if shape.is_empty() { "1".to_owned() } else { shape.join("x") },
            bits.join(",")
        );
    }
    Ok(line)
}

fn main() -> Result<(), Box<dyn Error>> {
    let folder = std::env::args().nth(1).unwrap_or_else(|| ".".to_owned());
    let mut files: Vec<_> =
        fs::read_dir(folder)?.map(|entry| entry.map(|e| e.path())).collect::<Result<_, _>>()?;
    files.retain(|path| path.extension().is_some_and(|extension| extension == "onnx"));
    files.sort();
    for file in files {
        let name = file.file_stem().unwrap_or_default().to_string_lossy().into_owned();
        match outputs(&file) {
            Ok(line) => println!("{name}{line}"),
            Err(e) => println!("{name} error: {e}"),
        }
    }
    Ok(())
}
