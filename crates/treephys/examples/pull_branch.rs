//! Grows a tree, pulls its last twig down harder and harder, and prints which joint breaks.

use orchard_geometry::Vec3;
use orchard_multibody::{Data, Groups, ModelBuilder, StepReport, equilibrium, step};
use orchard_spec::Spec;
use orchard_treegen::grow;
use orchard_treephys::{Rupture, TreeBody, TreeGroups, step_settings};

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let spec = Spec::paper();
    let skeleton = grow(&spec, 1, 0)?; // seed 1, tree 0

    // One link a segment; this tree touches nothing.
    let mut builder = ModelBuilder::new();
    let groups = TreeGroups { wood: Groups::NONE, debris: Groups::NONE };
    let tree = TreeBody::add_to(&mut builder, &skeleton, &spec.wood, groups);
    let model = builder.build()?;
    let mut data = Data::new(&model);
    tree.reset(&model, &mut data, &spec.wood);
    let settings = step_settings(&spec.sim);
    equilibrium(&model, &mut data, &settings.gravity, 1e-12)?; // sags under its own weight; tolerance in [rad]

    let mut rupture = Rupture::new(&tree);
    let mut report = StepReport::default();
    let twig = tree.bodies[tree.len() - 1];
    for frame in 1..=180 {
        let pull = 0.5 * f64::from(frame); // [N]
        data.body_force_world[twig.index()] = Vec3::new(0.0, 0.0, -pull);
        for _ in 0..spec.sim.substeps.get() {
            rupture.begin_substep(&tree, &model, &mut data, &spec.wood, settings.h);
            step(&model, &mut data, &settings, &mut report);
        }
        let gravity = spec.sim.gravity.si(); // [m/s^2]
        for segment in rupture.end_frame(&tree, &model, &mut data, &spec.wood, gravity) {
            println!("frame {frame}, {pull} N: the joint at the base of segment {segment} broke");
        }
    }
    println!("largest bending moment over rupture moment: {:.2}", rupture.peak_ratio());
    Ok(())
}
