//! Apples: placement, stems, detachment and loose fruit.
