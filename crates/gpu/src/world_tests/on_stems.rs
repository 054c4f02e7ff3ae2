//! Fruit on stems that bend, met by a robot and by each other on the device, against f64.

use super::*;

/// Each substep from the same state has the contacts of f64 on trees as measured: dampers by ratio, fruit in clusters on stems that bend.
#[test]
fn substeps_on_stems_have_the_contacts_of_f64() {
    let Some(gpu) = device() else { return };
    let off = compare_substeps(&gpu, &seen(Preset::Calibrated), 4, 220);
    let [on_wood, on_fruit, of_fruit, _] = off.loaded;
    assert!(
        off.crowded == 0 && on_wood > 100 && on_fruit > 5 && of_fruit > 100 && off.overlooked < 80,
        "{off:?}"
    );
    // The normal of two small balls has the rounding of their places.
    assert!(off.gap < 2e-6 && off.normal < 1e-4 && off.force < 1e-3 && off.change < 1e-3, "{off:?}");
}
