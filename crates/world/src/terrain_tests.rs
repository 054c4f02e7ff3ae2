use super::*;
use orchard_spec::{Preset, Spec};

const EXTENT: f64 = 10.0;

fn spec() -> TerrainSpec {
    Spec::paper().terrain.with_amplitude(0.2).unwrap()
}

fn field(spec: &TerrainSpec, seed: u64) -> HeightField {
    height_field(spec, EXTENT, seed, 0).unwrap()
}

/// Points all over the ground that are no nodes.
fn places(seed: u64) -> impl Iterator<Item = [f64; 2]> {
    let mut draws = Stream::new(seed, 0, Purpose::Test);
    (0..2000).map(move |_| [0, 1].map(|_| draws.uniform(-EXTENT, EXTENT)))
}

#[test]
fn the_ground_repeats_itself() {
    let spec = spec();
    let field = field(&spec, 7);
    let period = spec.period.si();
    let cells = spec.grid_cells.get() as usize;
    let (columns, heights) = (field.columns(), field.heights());
    for (index, z) in heights.iter().enumerate() {
        let (column, row) = (index % columns, index / columns);
        if column + cells < columns {
            assert_eq!(*z, heights[index + cells], "column {column}, row {row}");
        }
        if row + cells < field.rows() {
            assert_eq!(*z, heights[index + cells * columns], "column {column}, row {row}");
        }
    }
    for [x, y] in places(1) {
        let z = field.height(x, y).unwrap();
        for (x, y) in [(x + period, y), (x, y + period), (x - period, y - period)] {
            // Round-off of positions of 10 m, times a slope below 2.
            let same = field.height(x, y).is_none_or(|there| (there - z).abs() < 1e-14);
            assert!(same, "({x}, {y})");
        }
    }
}

#[test]
fn the_largest_deviation_is_the_amplitude() {
    let base = spec();
    for seed in 0..50 {
        let high = field(&base, seed);
        let low = field(&base.with_amplitude(0.03).unwrap(), seed);
        for (field, amplitude) in [(&high, 0.2), (&low, 0.03)] {
            let largest = field.heights().iter().fold(0.0_f64, |largest, z| largest.max(z.abs()));
            assert_eq!(largest, amplitude, "seed {seed}");
        }
        for (high, low) in high.heights().iter().zip(low.heights()) {
            assert!((high * 0.03 - low * 0.2).abs() < 1e-17, "another shape at another amplitude");
        }
    }
}

#[test]
fn bumps_of_no_height_are_a_plane() {
    let field = field(&spec().with_amplitude(0.0).unwrap(), 3);
    assert!(field.heights().iter().all(|z| *z == 0.0));
}

#[test]
fn the_trunk_stands_on_a_disc_that_rises_smoothly() {
    let spec = spec();
    let (radius, width) = (spec.flat_radius.si(), spec.blend_width.si());
    for seed in 0..20 {
        let field = field(&spec, seed);
        let mut draws = Stream::new(seed, 0, Purpose::Test);
        for _ in 0..500 {
            let (sin, cos) = math::sin_cos(draws.uniform(0.0, std::f64::consts::TAU));
            let r = draws.uniform(0.0, radius);
            assert_eq!(field.height(r * cos, r * sin), Some(0.0), "seed {seed}");
        }
    }
    // Continuous with its slope at both ends of the ring: 3 s^2 - 2 s^3 leaves 0 and reaches 1 within 3 s^2.
    let first = radius + std::f64::consts::SQRT_2 * spec.spacing();
    let mut last = 0.0;
    for step in 0..=1000 {
        let s = f64::from(step) / 1000.0;
        let share = rise(&spec, first + s * width);
        // 1.5 is the steepest slope of the curve.
        assert!((0.0..=1.5e-3 + 1e-12).contains(&(share - last)), "{s}: {last} -> {share}");
        assert!(share <= 3.0 * s * s + 1e-12 && 1.0 - share <= 3.0 * (1.0 - s) * (1.0 - s) + 1e-12, "{s}");
        last = share;
    }
    assert_eq!((rise(&spec, 0.0), rise(&spec, first - 1e-9), last), (0.0, 0.0, 1.0));
    let abrupt = TerrainSpec { blend_width: spec.blend_width.with_value(0.0).unwrap(), ..spec };
    assert_eq!((rise(&abrupt, first - 1e-9), rise(&abrupt, first + 1e-9)), (0.0, 1.0));
}

/// One octave beyond the disc: at the lattice's corners the stream's own numbers, in between their bilinear mean.
#[test]
fn one_octave_is_the_lattice_of_draws() {
    let base = spec();
    // Middles of the lattice's cells are nodes.
    let grid_cells = base.grid_cells.with_value(64).unwrap();
    let spec = TerrainSpec { octaves: base.octaves.with_value(1).unwrap(), grid_cells, ..base };
    let (n, cells) = (spec.lattice_cells.get() as usize, spec.grid_cells.get() as usize);
    let (seed, step) = (11, cells / n);
    let mut draws = Stream::new(seed, 0, Purpose::Terrain);
    let values: Vec<f64> = (0..n * n).map(|_| draws.uniform(-1.0, 1.0)).collect();
    let field = field(&spec, seed);
    let middle = (field.columns() - 1) / 2;
    let height =
        |column: usize, row: usize| field.heights()[(middle + row) * field.columns() + middle + column];
    // Far from every trunk: 2 cells of the lattice, 3 m, along one axis.
    let scale = height(2 * step, step) / values[n + 2];
    assert!(scale > 0.0);
    for row in 0..n {
        let corner = height(2 * step, row * step);
        assert!((corner - scale * values[row * n + 2]).abs() < 1e-15, "row {row}");
        let next = (row + 1) % n;
        let between = height(2 * step, row * step + step / 2);
        let mean = 0.5 * (values[row * n + 2] + values[next * n + 2]);
        assert!((between - scale * mean).abs() < 1e-15, "row {row}");
        let right = height(2 * step + step / 2, row * step + step / 2);
        let around = [values[row * n + 2], values[row * n + 3], values[next * n + 2], values[next * n + 3]];
        let mean = 0.25 * around.iter().sum::<f64>();
        // Lies near the trunk of the next period in the first and last row.
        assert!((right - scale * mean).abs() < 1e-15, "row {row}");
    }
}

#[test]
fn every_world_has_its_own_ground_and_has_it_again() {
    let spec = spec();
    let make = |seed, world| height_field(&spec, EXTENT, seed, world).unwrap();
    assert_eq!(make(5, 2), make(5, 2));
    assert!(make(5, 2) != make(5, 3) && make(5, 2) != make(6, 2));
}

#[test]
fn the_field_reaches_as_far_as_the_world() {
    for extent in [1.0, 9.97, 10.0] {
        let field = height_field(&spec(), extent, 0, 0).unwrap();
        let reach = field.bounds().max.x;
        assert!(reach >= extent && reach < extent + spec().spacing(), "{extent}: {reach}");
    }
}

#[test]
fn what_does_not_fit_together_is_refused() {
    let text = |from: &str, to: &str| {
        let text = Preset::Paper.toml().replacen(from, to, 1);
        assert_ne!(text, Preset::Paper.toml(), "{from}");
        Spec::from_toml("world.toml", &text).unwrap()
    };
    let refused = |spec: &Spec, extent| height_field(&spec.terrain, extent, 0, 0).unwrap_err().to_string();
    let fine = text("octaves = { value = 3,", "octaves = { value = 6,");
    assert_eq!(
        refused(&fine, EXTENT),
        "terrain: the last of 6 octaves has 128 cells a period, more than the 60 of terrain.grid_cells"
    );
    let absurd = text("octaves = { value = 3, range = [1, 6]", "octaves = { value = 900, range = [1, 900]");
    assert!(refused(&absurd, EXTENT).contains("of 900 octaves"), "{}", refused(&absurd, EXTENT));
    for cells in ["grid_cells = { value = 60, range = [8,", "lattice_cells = { value = 4, range = [1,"] {
        let none = cells.split(" = { value").next().map(|name| format!("{name} = {{ value = 0, range = [0,"));
        assert!(refused(&text(cells, &none.unwrap()), EXTENT).contains("must be above 0"));
    }
    let wide = refused(&Spec::paper(), 1000.0);
    assert!(wide.starts_with("terrain: 400040001 nodes for sim.plausible_extent = 1000 m"), "{wide}");
    let e = Spec::paper().terrain.with_amplitude(0.21).unwrap_err();
    assert_eq!(e, "0.21 is outside the allowed range [0, 0.2] m");
}

#[test]
fn a_slope_adds_a_plane_through_the_foot_of_the_trunk() {
    let slope = "[terrain.slope]\nangle = { value = 10, range = [0, 45], unit = 'deg', source = 'x' }\n\
                 bearing = { value = 90, range = [-360, 360], unit = 'deg', source = 'x' }";
    let steep = Spec { terrain: spec(), ..Spec::paper() }.overlaid("x", slope.parse().unwrap()).unwrap();
    let sloped = field(&steep.terrain, 7);
    let level = field(&spec(), 7);
    assert_eq!(sloped.height(0.0, 0.0), Some(0.0));
    for [x, y] in places(2) {
        let rise = sloped.height(x, y).unwrap() - level.height(x, y).unwrap();
        assert!((rise - y * math::tan(10.0_f64.to_radians())).abs() < 1e-12, "{rise} at {y}");
    }
}
