//! Rows of colour pictures in the suite `images`.

use std::time::Instant;

use orchard_camera::Sensor;
use orchard_gpu::{Gpu, Lit, PictureBatch};
use orchard_policy::{Pixels, Spaces};
use orchard_scenario::Scenario;
use orchard_world::{PictureSight, World};
use rayon::prelude::*;

use crate::rows::{Effort, Row};

/// Side of the small pictures \[px\].
const SIDE: u32 = 64;
/// Times that the device draws in a round without being read.
const AGAIN: usize = 3;

/// Measures pictures of worlds at their start: those of a policy, from hand and base, and those that a detector sees beside the depth of a d435i.
pub fn rows(gpu: &Gpu, seed: u64, effort: Effort) -> anyhow::Result<Vec<Row>> {
    let (small, large, rounds) = match effort {
        Effort::Full => (512, 64, 3),
        Effort::Quick => (2, 1, 1),
    };
    let scenario = Scenario::of(&[("camera", "d435i")])?;
    let worlds: Result<Vec<World>, _> =
        (0..small).into_par_iter().map(|index| scenario.world(seed, index, 0)).collect();
    let mut worlds = worlds?;
    worlds.iter_mut().for_each(|world| world.deliver_colour(true));
    let pixels = Some(Pixels { height: SIDE, width: SIDE, ..Pixels::default() });
    let spaces = Spaces { pixels, ..Spaces::default() };
    let sensor = Sensor::new(&scenario.spec().camera);
    let (width, height) = (sensor.intrinsics().width, sensor.intrinsics().height);
    let encoding = orchard_policy::Encoding::new(
        scenario.robot(),
        &spaces,
        [width, height],
        scenario.spec().sim.frame_rate.si(),
    )?;
    let Some(request) = encoding.pictures() else { return Ok(Vec::new()) };
    let of_policy = |world: &World| world.picture_sight(request);
    let of_detector = |world: &World| {
        world.colour_sight(&world.sight_now()).unwrap_or_else(|| unreachable!("it takes colour"))
    };
    let policy = format!("{SIDE} x {SIDE}, as policies see them, from hand and base");
    let detector = format!("{width} x {height}, as detectors see them beside the depth of a d435i");
    let mut rows = of(gpu, "images.pixels_64", &policy, &worlds, of_policy, rounds)?;
    rows.extend(of(gpu, "images.colour_d435i", &detector, &worlds[..large], of_detector, rounds)?);
    Ok(rows)
}

/// Rows of the device alone, of all from worlds to pictures in memory, and of the processor.
fn of(
    gpu: &Gpu,
    name: &str,
    what: &str,
    worlds: &[World],
    sight: impl Fn(&World) -> PictureSight + Sync,
    rounds: usize,
) -> anyhow::Result<Vec<Row>> {
    let mut batch = PictureBatch::new(gpu);
    let [mut alone, mut whole, mut here] = [const { Vec::new() }; 3];
    let mut count = 0;
    // The first round warms up.
    for round in 0..=rounds {
        let start = Instant::now();
        let sights: Vec<PictureSight> = worlds.par_iter().map(&sight).collect();
        let lit = sights.iter().enumerate().map(|(place, sight)| {
            let PictureSight { visible, x_world_body, loose, style, cameras } = sight;
            batch.keep(place, visible);
            Lit { kept: Some((place, x_world_body)), loose, style: *style, cameras }
        });
        let lit: Vec<Lit<'_>> = lit.collect();
        count = batch.pictures(&lit)?.iter().flatten().count();
        let took = start.elapsed().as_secs_f64();
        let start = Instant::now();
        let drawn = batch.draw_again(AGAIN)?;
        let took_alone = start.elapsed().as_secs_f64() / AGAIN as f64;
        if round > 0 {
            whole.push(count as f64 / took);
            alone.push(drawn as f64 / took_alone);
        }
    }
    let some = &worlds[..worlds.len().min(64)];
    for _ in 0..rounds {
        let start = Instant::now();
        let drawn = some.par_iter().map(|world| sight(world).draw().len());
        let drawn: usize = drawn.sum();
        here.push(drawn as f64 / start.elapsed().as_secs_f64());
    }
    let note = format!("{count} colour pictures of distinct trees, {what}");
    let row = |name: &str, rates: Vec<f64>, what: &str| {
        Row::of_rounds(name, rates, "images/s", &format!("{note}; {what}"))
    };
    Ok(vec![
        row(&format!("{name}.device"), alone, "the device alone"),
        row(name, whole, "from worlds to pictures in the processor's memory"),
        row(&format!("{name}_processor"), here, "drawn by all cores of the processor, 64 worlds"),
    ])
}
