//! Does nothing: with a build script, cargo sets the features of the build dependencies.

fn main() {
    println!("cargo::rerun-if-changed=build.rs");
}
