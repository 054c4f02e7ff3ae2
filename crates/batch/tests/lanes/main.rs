//! Lanes on the ground, in quarantine and bit by bit, with every instruction set that the processor has. The suite `steppers` of the
//! workspace compares all batches with the f64 worlds.
//!
//! The binary needs no files: it can be carried to another processor, where
//! `lanes --nocapture` prints the sets that ran.

mod ground;
mod quarantine;
mod same_bits;
mod stems;
#[path = "../trees/mod.rs"]
mod trees;

use orchard_batch::Isa;

#[test]
fn instruction_sets_of_this_processor() {
    let sets = Isa::available();
    println!("instruction sets tested: {sets:?}");
    assert_eq!((sets[0], sets.last()), (Isa::best(), Some(&Isa::BASELINE)));
    for isa in sets {
        assert!(isa.lanes().is_power_of_two());
    }
}
