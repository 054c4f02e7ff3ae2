//! Search for spheres by votes: normals of a fruit's surface meet in its centre, however much of it is hidden.

use crate::cloud::{Cloud, Rectangle};
use crate::config::DetectorConfig;
use crate::noise::Noise;
use crate::posterior::Posterior;
use crate::search::Hypothesis;
use crate::sphere::Sphere;
use orchard_geometry::Vec3;

/// Spacing of the pixels that vote, over the radius of a fruit in the image.
const SPACING: f64 = 0.25;
/// Half-width of the window of a normal, over the radius of a fruit in the image.
const WINDOW: f64 = 0.25;
/// Pixels from the middle of the window to its edge.
const STEPS: usize = 2;
/// Pixels along a side of the window, and their steps from the middle.
const SIDE: usize = 2 * STEPS + 1;
const OFFSETS: [f64; SIDE] = [-2.0, -1.0, 0.0, 1.0, 2.0];
/// Least number of the window's pixels that determine a normal.
const LEAST_PIXELS: f64 = 8.0;
/// Side of a cell in which votes are counted, over the radius of a fruit.
const CELL: f64 = 0.25;
/// Least share of a fruit's disc whose votes fall into a cell and those around it.
const LEAST_SHARE: f64 = 0.03;
/// Bits of a cell's index along an axis. Cells are some millimetres wide, so the indices reach over kilometres.
const BITS: u32 = 20;

/// Passes to `judge` the spheres of largest posterior probability next to where votes meet, those with the most votes first. The search
/// ends after `fit.effort` pixel accesses per pixel of the image.
pub(crate) fn run(cloud: &Cloud, config: &DetectorConfig, mut judge: impl FnMut(Hypothesis)) {
    let (noise, posterior) = (Noise::new(config), Posterior::new(config));
    let (smallest, largest) = config.gates.radius.limit.si();
    let mut effort = cloud.len().saturating_mul(config.fit.effort.get() as usize);
    for center in centers(cloud, &noise, config.fit.prior.mean.si()) {
        let start = Sphere { center, radius: config.fit.prior.mean.si() };
        let mut accesses = 0;
        let settled = posterior.settle(cloud, &start, |pixels| accesses += pixels);
        // A sphere out of these limits is no fruit by any gate, and may be as large as the image.
        if let Some(sphere) = settled.filter(|s| (0.5 * smallest..=2.0 * largest).contains(&s.radius)) {
            let band = noise.band(sphere.center.z);
            let square = |x: f64| x * x;
            let (least, most) = (square((sphere.radius - band).max(0.0)), square(sphere.radius + band));
            let mut support = Vec::new();
            cloud.rows_in_ball(&sphere.center, sphere.radius + band, |row| {
                accesses += row.x.len();
                let mut found = support.len();
                support.resize(found + row.x.len(), 0);
                for ((&z, &x), i) in row.usable_z.iter().zip(row.x).zip(row.first..) {
                    let distance = (Vec3::new(x * z, row.y * z, z) - sphere.center).norm_squared();
                    support[found] = i;
                    found += usize::from((z > 0.0) & (distance >= least) & (distance <= most));
                }
                support.truncate(found);
            });
            judge(Hypothesis { sphere, support });
        }
        effort = effort.saturating_sub(accesses);
        if effort == 0 {
            break;
        }
    }
}

/// Returns where the normals of spheres of a radius \[m\] meet, the places with the most votes first.
fn centers(cloud: &Cloud, noise: &Noise, radius: f64) -> Vec<Vec3> {
    let cells = gathered(&votes(cloud, noise, radius));
    let mut peaks = blocks(&cells);
    peaks.retain(|block| block.highest && block.share >= LEAST_SHARE);
    // The sort is stable: equal shares stay in the order of their cells.
    peaks.sort_by(|a, b| b.share.total_cmp(&a.share));
    peaks.into_iter().map(|block| block.sum / block.share).collect()
}

/// Votes for one cell.
#[derive(Debug, Clone, Copy)]
struct Cell {
    /// Indices along z, y and x, in this order.
    key: u64,
    /// Share of a fruit's disc that votes.
    share: f64,
    /// Sum of the centres voted for, weighted by the share.
    sum: Vec3,
}

/// Votes of the pixels on a grid, one cell for each.
fn votes(cloud: &Cloud, noise: &Noise, radius: f64) -> Vec<Cell> {
    let mut out = Vec::new();
    let image = Rectangle { u: (0, cloud.width), v: (0, cloud.height) };
    let inverse: Vec<f64> = (0..cloud.len()).map(|i| 1.0 / cloud.usable_z(i)).collect();
    // A place beyond the cells, kilometres aside, is none that a camera sees; a cell has neighbours on both sides.
    let per_metre = 1.0 / (CELL * radius);
    let index = |x: f64| {
        let index = x * per_metre + f64::from(1_u32 << (BITS - 1));
        (index >= 1.0 && index < f64::from((1_u32 << BITS) - 1)).then_some(index as u64)
    };
    cloud.usable_in(image, 1, |i, p| {
        let radius_px = radius * cloud.focal / p.z;
        // A float-to-integer cast saturates.
        let every = ((SPACING * radius_px) as u32).max(1);
        let (u, v) = cloud.uv(i);
        if ![u, v].iter().all(|at| (*at as u32).is_multiple_of(every)) {
            return;
        }
        let spacing = f64::from(every);
        let Some(center) = vote(cloud, &inverse, noise, radius, (u, v), radius_px) else { return };
        if let (Some(x), Some(y), Some(z)) = (index(center.x), index(center.y), index(center.z)) {
            let share = spacing * spacing / (std::f64::consts::PI * radius_px * radius_px);
            out.push(Cell { key: (z << (2 * BITS)) | (y << BITS) | x, share, sum: center * share });
        }
    });
    out
}

/// Returns the centre of the sphere behind the plane through the pixels about one. Inverse depth is linear in the image on a plane.
fn vote(
    cloud: &Cloud,
    inverse: &[f64],
    noise: &Noise,
    radius: f64,
    (u, v): (usize, usize),
    radius_px: f64,
) -> Option<Vec3> {
    // A float-to-integer cast saturates. A sphere nearer than its radius fills any image.
    let step = ((WINDOW * radius_px / STEPS as f64 + 0.5) as usize).clamp(1, cloud.width.max(cloud.height));
    let z_seed = cloud.usable_z(v * cloud.width + u);
    let reach = radius.max(noise.jump(z_seed));
    let counts = |z: f64| (z > 0.0) & ((z - z_seed).abs() <= reach);
    let plane = whole_plane(cloud, inverse, (u, v), step, counts)
        .or_else(|| plane(cloud, inverse, (u, v), step, counts))?;
    // 1/z = m . ray, so that m . p = 1 on the plane and m points away from the camera.
    let ray = cloud.ray(u, v);
    let (m_x, m_y) = (plane.right * cloud.intrinsics.fx, plane.down * cloud.intrinsics.fy);
    let m = Vec3::new(m_x, m_y, plane.middle - m_x * ray.x - m_y * ray.y);
    let center = ray / plane.middle + m * (radius / m.norm());
    (plane.middle > 0.0 && center.z > radius && center.iter().all(|x| x.is_finite())).then_some(center)
}

/// Inverse depth \[1/m\] at a pixel of a plane, and its growth per pixel to the right and down.
struct Plane {
    middle: f64,
    right: f64,
    down: f64,
}

/// Returns the plane if all pixels of the window count: their places have known sums.
fn whole_plane(
    cloud: &Cloud,
    inverse: &[f64],
    (u, v): (usize, usize),
    step: usize,
    counts: impl Fn(f64) -> bool,
) -> Option<Plane> {
    let (u0, v0) = (u.checked_sub(STEPS * step)?, v.checked_sub(STEPS * step)?);
    if u + STEPS * step >= cloud.width || v + STEPS * step >= cloud.height {
        return None;
    }
    let (mut all, mut sum, mut right, mut down) = (true, 0.0, 0.0, 0.0);
    for (j, offset) in OFFSETS.iter().enumerate() {
        let first = (v0 + j * step) * cloud.width + u0;
        let columns = first..=first + (SIDE - 1) * step;
        let (zs, inverse) = (cloud.usable_row(columns.clone()), &inverse[columns]);
        let mut of_row = 0.0;
        for (i, at) in OFFSETS.iter().zip((0..).step_by(step)) {
            all &= counts(zs[at]);
            of_row += inverse[at];
            right += i * inverse[at];
        }
        sum += of_row;
        down += offset * of_row;
    }
    let squares = SIDE as f64 * OFFSETS.iter().map(|i| i * i).sum::<f64>() * step as f64;
    all.then_some(Plane { middle: sum / (SIDE * SIDE) as f64, right: right / squares, down: down / squares })
}

/// Returns the plane of least squares through the pixels of the window that count.
fn plane(
    cloud: &Cloud,
    inverse: &[f64],
    (u, v): (usize, usize),
    step: usize,
    counts: impl Fn(f64) -> bool,
) -> Option<Plane> {
    let within = |at: usize, k: usize, length: usize| {
        (at + k * step).checked_sub(STEPS * step).filter(|&there| there < length)
    };
    // Sums of 1, i, j, i i, i j, j j over the pixels (i, j) steps aside, and of 1, i and j times the inverse depth.
    let (mut a, mut b) = ([0.0; 6], [0.0; 3]);
    for (j, row) in (0..SIDE).filter_map(|j| Some((OFFSETS[j], within(v, j, cloud.height)?))) {
        for (i, column) in (0..SIDE).filter_map(|i| Some((OFFSETS[i], within(u, i, cloud.width)?))) {
            let at = row * cloud.width + column;
            if counts(cloud.usable_z(at)) {
                a.iter_mut().zip([1.0, i, j, i * i, i * j, j * j]).for_each(|(sum, x)| *sum += x);
                b.iter_mut().zip([1.0, i, j]).for_each(|(sum, x)| *sum += x * inverse[at]);
            }
        }
    }
    let [n, i, j, ii, ij, jj] = a;
    // About the mean. These are whole numbers, so that pixels in a line have a determinant of zero.
    let (ii, ij, jj) = (n * ii - i * i, n * ij - i * j, n * jj - j * j);
    let determinant = ii * jj - ij * ij;
    if n < LEAST_PIXELS || determinant <= 0.0 {
        return None;
    }
    let (b_i, b_j) = (n * b[1] - i * b[0], n * b[2] - j * b[0]);
    let (right, down) = ((jj * b_i - ij * b_j) / determinant, (ii * b_j - ij * b_i) / determinant);
    let middle = (b[0] - right * i - down * j) / n;
    Some(Plane { middle, right: right / step as f64, down: down / step as f64 })
}

/// Joins the votes for each cell; cells come in the order of their keys.
fn gathered(votes: &[Cell]) -> Vec<Cell> {
    // Votes for one cell stay in their order, so that sums depend on the image alone.
    let mut order: Vec<(u64, u32)> = votes.iter().zip(0..).map(|(vote, i)| (vote.key, i)).collect();
    order.sort_unstable();
    let mut out: Vec<Cell> = Vec::new();
    for vote in order.iter().map(|(_, i)| votes[*i as usize]) {
        match out.last_mut().filter(|last| last.key == vote.key) {
            Some(last) => {
                last.share += vote.share;
                last.sum += vote.sum;
            }
            None => out.push(vote),
        }
    }
    out
}

/// Votes of a cell and the 26 around it.
struct Block {
    share: f64,
    sum: Vec3,
    /// True if no cell around it has more votes.
    highest: bool,
}

/// Returns the block about each cell.
fn blocks(cells: &[Cell]) -> Vec<Block> {
    // First cell of each of nine rows of three neighbours; it only moves on from cell to cell.
    let mut rows = [0_usize; 9];
    let block = |cell: &Cell| {
        let mut block = Block { share: 0.0, sum: Vec3::zeros(), highest: true };
        for (row, start) in rows.iter_mut().enumerate() {
            // One less along each axis is the first neighbour. Keys of places in front of the camera are larger than that.
            let moved = cell.key + ((row as u64 / 3) << (2 * BITS)) + ((row as u64 % 3) << BITS);
            let first = moved - (1 << (2 * BITS)) - (1 << BITS) - 1;
            *start += cells[*start..].iter().take_while(|near| near.key < first).count();
            for near in cells[*start..].iter().take_while(|near| near.key <= first + 2) {
                block.share += near.share;
                block.sum += near.sum;
                block.highest &= (near.share, near.key) <= (cell.share, cell.key);
            }
        }
        block
    };
    cells.iter().map(block).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use orchard_geometry::{DepthImage, Image, Intrinsics};

    const CENTERS: [[f64; 3]; 2] = [[0.08, -0.05, 0.9], [-0.06, 0.04, 1.1]];

    /// Two balls in front of nothing; of the second only a crescent is seen, beside a plane in front of it.
    fn image(k: &Intrinsics) -> DepthImage {
        let mut depth = Image::filled(k.width, k.height, 0.0_f32);
        for v in 0..k.height {
            for u in 0..k.width {
                let ray = k.ray(u as f64, v as f64);
                let hit = |c: &[f64; 3]| {
                    let c = Vec3::from(*c);
                    let (along, square) = (ray.dot(&c), ray.norm_squared());
                    let root = along * along - square * (c.norm_squared() - 0.035 * 0.035);
                    (root >= 0.0).then(|| (along - root.sqrt()) / square)
                };
                let hidden = ray.x < -0.06 && ray.y > 0.0;
                let z = if hidden { Some(0.8) } else { CENTERS.iter().find_map(hit) };
                depth[(u, v)] = z.unwrap_or(0.0) as f32;
            }
        }
        depth
    }

    #[test]
    fn normals_meet_in_the_centres() {
        let k = Intrinsics::from_vertical_fov(320, 240, 0.8);
        let config = DetectorConfig::named("azure-kinect-native").unwrap();
        let cloud = Cloud::new(&image(&k), &k, None, (0.3, 2.0), 1).unwrap();
        let found = centers(&cloud, &Noise::new(&config), 0.035);
        for c in CENTERS {
            let nearest = found.iter().map(|f| (f - Vec3::from(c)).norm()).fold(f64::INFINITY, f64::min);
            assert!(nearest < 0.01, "{c:?}: {nearest}");
        }
        let mut spheres = Vec::new();
        run(&cloud, &config, |h| spheres.push(h.sphere));
        for c in CENTERS {
            let is_it =
                |s: &Sphere| (s.center - Vec3::from(c)).norm() < 1e-3 && (s.radius - 0.035).abs() < 1e-3;
            assert!(spheres.iter().any(is_it), "{c:?}: {spheres:?}");
        }
    }

    #[test]
    fn blocks_are_the_sums_over_the_neighbours() {
        let key = |x: u64, y: u64, z: u64| ((z + 9) << (2 * BITS)) | ((y + 9) << BITS) | (x + 9);
        let cells: Vec<Cell> = (0..300_u64)
            .map(|i| (i * i * 7919) % 216)
            .map(|i| Cell { key: key(i % 6, i / 6 % 6, i / 36), share: 1.0 + i as f64, sum: Vec3::zeros() })
            .collect();
        let cells = gathered(&cells);
        let place = |k: u64| [0, BITS, 2 * BITS].map(|shift| (k >> shift & ((1 << BITS) - 1)) as i64);
        for (cell, block) in cells.iter().zip(blocks(&cells)) {
            let near =
                |other: &&Cell| place(other.key).iter().zip(place(cell.key)).all(|(a, b)| (a - b).abs() <= 1);
            let sum: f64 = cells.iter().filter(near).map(|c| c.share).sum();
            assert!((block.share - sum).abs() < 1e-9);
            assert_eq!(block.highest, cells.iter().filter(near).all(|c| c.share <= cell.share));
        }
    }
}
