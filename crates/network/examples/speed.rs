//! Times a network on zeros: `cargo run --release -p orchard-network --example speed -- FILE.onnx`.

use std::error::Error;
use std::time::Instant;

use orchard_network::{Network, Port, Tensor};

fn main() -> Result<(), Box<dyn Error>> {
    let file = std::env::args().nth(1).ok_or("give the file of a network")?;
    let network = Network::from_bytes(&std::fs::read(&file)?)?;
    let inputs: Vec<Tensor> = network.inputs().iter().map(Port::zeros).collect::<Result<_, _>>()?;
    let mut times = Vec::new();
    for _ in 0..200 {
        let start = Instant::now();
        network.run(inputs.clone())?;
        times.push(start.elapsed().as_secs_f64());
    }
    times.sort_by(f64::total_cmp);
    println!(
        "{file}: {:.3} ms (median of {} runs), {:.3} ms at best",
        1e3 * times[100],
        times.len(),
        1e3 * times[0]
    );
    Ok(())
}
