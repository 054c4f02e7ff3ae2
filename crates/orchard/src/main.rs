//! The program `orchard`, with the controllers of this project.

fn main() -> std::process::ExitCode {
    orchardbench::Program::new().main()
}
