//! The example of docs/controllers.md runs, and the page shows it as it is.

#[path = "../examples/third_controller.rs"]
mod example;

#[test]
fn the_example_runs() {
    example::main().expect("a tuning seed");
}

#[test]
fn the_page_shows_the_example() {
    let root = concat!(env!("CARGO_MANIFEST_DIR"), "/../..");
    let page = std::fs::read_to_string(format!("{root}/docs/controllers.md")).expect("the page");
    assert!(page.contains(&format!("```rust\n{}```", include_str!("../examples/third_controller.rs"))));
}
