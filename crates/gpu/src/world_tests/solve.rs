//! The linear systems of contacts under load, both ways of their solution, against a factor in f64.

use nalgebra::{DMatrix, DVector};
use wgpu::{BufferBindingType, BufferUsages};

use crate::Gpu;
use crate::buffers::create_buffer;
use crate::layout::{LANES, QUAD, meeting};
use crate::pipelines::Kernels;
use crate::shader;
use crate::testing::device;

/// Numbers of a contact in the buffer of worlds: rank, columns of the root, right-hand side.
const EACH: usize = 13;
/// A kernel that solves the system of the contacts there, and puts each solution in the place of its right-hand side.
const ENTRY: &str = "
@compute @workgroup_size(LANES)
fn solve_alone(@builtin(local_invocation_index) own_thread: u32) {
    thread = own_thread;
    contacts = u32(worlds[0]);
    let at = 1u + EACH * thread;
    var own = Response(vec3f(0.0), mat3x3f(), 0u);
    var rest = vec3f(0.0);
    if thread < contacts {
        own.rank = u32(worlds[at]);
        for (var k = 0u; k < 3u; k++) {
            own.root[k] = vec3f(worlds[at + 1u + 3u * k], worlds[at + 2u + 3u * k], worlds[at + 3u + 3u * k]);
        }
        rest = vec3f(worlds[at + 10u], worlds[at + 11u], worlds[at + 12u]);
    }
    let x = solve_loaded(own, rest);
    if thread < contacts {
        for (var k = 0u; k < 3u; k++) {
            worlds[at + 10u + k] = x[k];
        }
    }
}
";

/// A number between -0.5 and 0.5.
fn number(index: usize) -> f64 {
    (index * 7919 % 1009) as f64 / 1009.0 - 0.5
}

/// Contacts with responses of some ranks, 0 for those without load.
struct System {
    ranks: Vec<usize>,
    inertia: DMatrix<f64>,
    /// Roots below each other, three rows each.
    roots: DMatrix<f64>,
    rest: DVector<f64>,
}

impl System {
    fn new(ranks: &[usize]) -> Self {
        let rows = 3 * ranks.len();
        let factor = DMatrix::from_fn(rows, rows + 3, |i, j| number(1 + i * (rows + 3) + j));
        let inertia = &factor * factor.transpose();
        let in_rank = |i: usize, k: usize| k < ranks[i / 3];
        let roots =
            DMatrix::from_fn(rows, 3, |i, k| if in_rank(i, k) { 5.0 * number(5 * i + k + 3) } else { 0.0 });
        let rest = DVector::from_fn(rows, |i, _| if in_rank(i, i % 3) { number(17 * i + 2) } else { 0.0 });
        Self { ranks: ranks.to_vec(), inertia, roots, rest }
    }

    /// The solution in f64.
    fn solution(&self) -> DVector<f64> {
        let rows = self.rest.len();
        let mut root = DMatrix::zeros(rows, rows);
        for i in (0..rows).step_by(3) {
            root.view_mut((i, i), (3, 3)).copy_from(&self.roots.view((i, 0), (3, 3)));
        }
        let matrix = DMatrix::identity(rows, rows) + root.transpose() * &self.inertia * &root;
        matrix.cholesky().unwrap().solve(&self.rest)
    }

    /// The solution of the device, and the inverse inertia that it leaves.
    fn on(&self, gpu: &Gpu) -> (Vec<f32>, Vec<f32>) {
        let contacts = self.ranks.len();
        let mut numbers = vec![contacts as f32];
        for (i, rank) in self.ranks.iter().enumerate() {
            numbers.push(*rank as f32);
            let root = (0..9).map(|k| self.roots[(3 * i + k % 3, k / 3)]);
            numbers.extend(root.chain((0..3).map(|k| self.rest[3 * i + k])).map(|x| x as f32));
        }
        let blocks = self.blocks();
        // With tables of zeros the first desk is at the start, and the blocks follow its responses.
        let before = meeting::MOST_CONTACTS * 3 * crate::layout::robot::DOFS;
        let mut meetings = vec![0.0; before];
        meetings.extend(&blocks);

        let read = BufferBindingType::Storage { read_only: true };
        let written = BufferBindingType::Storage { read_only: false };
        let uniform = BufferBindingType::Uniform;
        let kinds = [uniform, read, written, uniform, read, written, written, written, written, written];
        let kernels = Kernels::new(
            &gpu.device,
            "solve",
            shader::source_of_worlds() + &format!("const EACH: u32 = {EACH}u;") + ENTRY,
            &kinds.map(|kind| (kind, false)),
        );
        let pipeline = kernels.pipeline("solve_alone", &[]);
        let usage =
            BufferUsages::STORAGE | BufferUsages::UNIFORM | BufferUsages::COPY_DST | BufferUsages::COPY_SRC;
        let buffers: Vec<_> = (0..kinds.len())
            .map(|binding| match binding {
                5 => create_buffer(gpu, "meetings", 4 * meetings.len(), usage),
                _ => create_buffer(gpu, "other", 1 << 12, usage),
            })
            .collect();
        gpu.queue.write_buffer(&buffers[5], 0, bytemuck::cast_slice(&meetings));
        gpu.queue.write_buffer(&buffers[8], 0, bytemuck::cast_slice(&numbers));
        let entries: Vec<_> = (0..)
            .zip(&buffers)
            .map(|(binding, buffer)| wgpu::BindGroupEntry { binding, resource: buffer.as_entire_binding() })
            .collect();
        let bound = gpu.device.create_bind_group(&wgpu::BindGroupDescriptor {
            label: None,
            layout: &kernels.bindings,
            entries: &entries,
        });
        let mut encoder = gpu.device.create_command_encoder(&Default::default());
        let mut pass = encoder.begin_compute_pass(&Default::default());
        pass.set_bind_group(0, &bound, &[]);
        pass.set_pipeline(&pipeline);
        pass.dispatch_workgroups(1, 1, 1);
        drop(pass);
        gpu.queue.submit([encoder.finish()]);
        let solved = gpu.read(&[(&buffers[8], 1..1 + EACH * contacts)]).unwrap();
        let x = solved.chunks_exact(EACH).flat_map(|own: &[f32]| own[10..].to_vec()).collect();
        (x, gpu.read(&[(&buffers[5], before..before + blocks.len())]).unwrap())
    }

    /// Blocks of the inverse inertia as the kernels keep them: column by column, each of its three quads for all rows.
    fn blocks(&self) -> Vec<f32> {
        let contacts = self.ranks.len();
        let mut blocks = Vec::new();
        for column in 0..contacts {
            for k in 0..3 {
                for row in 0..contacts {
                    let quad = (0..QUAD).map(|i| match i {
                        3 => 0.0,
                        _ => self.inertia[(3 * row + i, 3 * column + k)] as f32,
                    });
                    blocks.extend(quad);
                }
            }
        }
        blocks
    }

    /// Checks the solution of the device, and that it leaves the inverse inertia as it was, both up to rounding: a hundred or so roundings of f32.
    fn check(&self, gpu: &Gpu) {
        let expected = self.solution();
        let (x, blocks) = self.on(gpu);
        let size = expected.amax();
        for (i, (x, expected)) in x.iter().zip(&expected).enumerate() {
            let off = (f64::from(*x) - expected).abs();
            assert!(off <= 1e-5 * size, "row {i}: {x}, {expected} in f64");
        }
        let size = self.inertia.amax() as f32;
        for (left, before) in blocks.iter().zip(&self.blocks()) {
            assert!((left - before).abs() <= 1e-6 * size, "{left} instead of {before}");
        }
    }
}

/// Rows for which there is a thread each are eliminated.
#[test]
fn few_rows_are_solved_as_in_f64() {
    let Some(gpu) = device() else { return };
    let system = System::new(&[3, 2, 0, 1, 3, 3, 2, 0, 3, 1, 2, 3]);
    assert!(system.ranks.iter().sum::<usize>() <= LANES);
    system.check(&gpu);
}

/// More rows are solved by a factor in blocks.
#[test]
fn more_rows_are_solved_as_in_f64() {
    let Some(gpu) = device() else { return };
    for ranks in [&[3, 3, 3, 2, 3, 0, 3, 3, 3, 1, 3, 3, 3][..], &[3; meeting::MOST_CONTACTS]] {
        let system = System::new(ranks);
        assert!(system.ranks.iter().sum::<usize>() > LANES);
        system.check(&gpu);
    }
}
