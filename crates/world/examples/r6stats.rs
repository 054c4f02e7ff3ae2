use orchard_spec::*;
use std::sync::Arc;
fn q(mut v: Vec<f64>) -> String {
    v.sort_by(f64::total_cmp);
    let n = v.len();
    format!("{:.2} {:.2} {:.2} {:.2} {:.2}", v[0], v[n / 10], v[n / 2], v[n * 9 / 10], v[n - 1])
}
fn main() {
    let spec = Arc::new(Spec::preset(Preset::Randomised));
    let paper = Arc::new(Spec::paper());
    let robot = Arc::new(orchard_robot::RobotModel::paper());
    let (mut h, mut f, mut l, mut kept, mut rt) = (vec![], vec![], vec![], vec![], vec![]);
    for w in 0..1000 {
        let p = orchard_world::Planting::draw(&spec, 1, w, 0).unwrap();
        let b = orchard_world::Planting::draw(&paper, 1, w, 0).unwrap();
        h.push(p.skeleton.segments.iter().map(|s| s.p_tip_world().z).fold(0.0, f64::max));
        f.push(p.fruit.len() as f64);
        l.push(p.skeleton.leaves.len() as f64);
        kept.push(p.fruit.len() as f64 / b.fruit.len() as f64);
        rt.push(p.skeleton.segments[0].radius * 1e3);
        if w < 512 {
            orchard_world::World::new(spec.clone(), robot.clone(), 1, w)
                .unwrap_or_else(|e| panic!("{w}: {e}"));
        }
    }
    println!("height {}\nfruit {}\nkept {}\nleaves {}\ntrunk {}", q(h), q(f), q(kept), q(l), q(rt));
    let mut s2 = Spec::clone(&spec);
    for &a in randomisation::Axis::ALL {
        let d = s2.randomisation.strength_mut(a);
        *d = d.with_value(2.0).unwrap();
    }
    let s2 = Arc::new(s2);
    let mut bad = 0;
    for w in 0..1000 {
        if let Err(e) = orchard_world::World::new(s2.clone(), robot.clone(), 1, w) {
            bad += 1;
            println!("{w}: {e}");
        }
    }
    println!("strength 2: {bad} of 1000 fail");
    let mut bad = 0;
    for w in 0..10000 {
        if let Err(e) = orchard_world::Planting::draw(&spec, 2, w, 0) {
            bad += 1;
            println!("{w}: {e}");
        }
    }
    println!("strength 1: {bad} of 10000 plantings fail");
}
