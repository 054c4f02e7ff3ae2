//! Newton's method with a line search on the contact problem, over any representation of its unknown.
//!
//! The step's velocity change u beyond the free one minimises the convex cost
//! `E = 1/2 u^T A u + sum l(v_free + J u)`, `dl/dv = -gamma`. At the minimum, `A u = J^T gamma`. An
//! [`Unknown`] chooses the numbers that represent u and the solver of the direction
//! `(A + J^T G J) du = J^T gamma - A u`, `G = -d gamma/dv = L L^T`.

use orchard_geometry::Vec3;

use super::block::Block;
use super::law::Response;

/// Residual at which the solve ends, relative to the impulses.
const TOLERANCE: f64 = 1e-10;
/// Newton iterations before the solve gives up and keeps its best impulses.
const MAX_ITERATIONS: usize = 100;
/// The line search ends when the slope has fallen to this share of the slope at its start.
const SLOPE_SHARE: f64 = 0.1;
/// Evaluations of one line search.
const MAX_EVALUATIONS: usize = 30;

/// Outcome of a solve.
#[derive(Debug, Clone, Copy)]
pub(super) struct Outcome {
    pub iterations: usize,
    /// Iterations of the linear solves inside, if they iterate.
    pub linear_iterations: usize,
    pub residual: f64,
    pub converged: bool,
}

/// A Newton direction du, with the products that the line search needs.
#[derive(Debug, Clone, Copy)]
pub(super) struct Direction {
    /// `du^T A u`.
    pub slope: f64,
    /// `du^T A du`.
    pub curvature: f64,
    /// Iterations of the linear solve.
    pub iterations: usize,
}

/// A representation of the velocity change u.
pub(super) trait Unknown {
    /// Sets u to the velocity change by the blocks' guessed impulses; writes `J u`.
    fn start(&mut self, blocks: &[Block], change: &mut [Vec3]);

    /// Size of `J^T gamma - A u` relative to the larger of its parts, in a norm that weighs it by inverse inertia.
    fn residual(&mut self, blocks: &[Block], responses: &[Response]) -> f64;

    /// Finds the Newton direction at the last residual; writes `J du`.
    fn direction(&mut self, responses: &[Response], residual: f64, change: &mut [Vec3]) -> Direction;

    /// Moves u by `length` times the last direction.
    fn advance(&mut self, length: f64);
}

/// Solution and buffers.
#[derive(Debug, Clone, Default)]
pub(super) struct Newton {
    /// Impulse of each block, on the friction cone.
    pub impulses: Vec<Vec3>,
    v: Vec<Vec3>,
    dv: Vec<Vec3>,
    responses: Vec<Response>,
}

impl Newton {
    /// Solves for the impulses of all blocks, from their first guesses.
    pub fn solve(&mut self, blocks: &[Block], unknown: &mut impl Unknown) -> Outcome {
        for buffer in [&mut self.v, &mut self.dv] {
            buffer.clear();
            buffer.resize(blocks.len(), Vec3::zeros());
        }
        unknown.start(blocks, &mut self.v);
        for (v, block) in self.v.iter_mut().zip(blocks) {
            *v += block.v_free;
        }
        let (mut iterations, mut linear_iterations) = (0, 0);
        let outcome = loop {
            self.responses.clear();
            self.responses.extend(blocks.iter().zip(&self.v).map(|(block, v)| block.law.respond(v)));
            let residual = unknown.residual(blocks, &self.responses);
            let converged = residual <= TOLERANCE;
            if converged || iterations == MAX_ITERATIONS {
                break Outcome { iterations, linear_iterations, residual, converged };
            }
            iterations += 1;
            let direction = unknown.direction(&self.responses, residual, &mut self.dv);
            linear_iterations += direction.iterations;
            let length = self.search_line(blocks, &direction);
            unknown.advance(length);
            for (v, dv) in self.v.iter_mut().zip(&self.dv) {
                *v += dv * length;
            }
        };
        self.impulses.clear();
        self.impulses.extend(self.responses.iter().map(|response| response.impulse));
        outcome
    }

    /// Slope of the cost at a length along the direction.
    fn slope(&self, blocks: &[Block], direction: &Direction, length: f64) -> f64 {
        let mut slope = direction.slope + direction.curvature * length;
        for ((block, v), dv) in blocks.iter().zip(&self.v).zip(&self.dv) {
            slope -= dv.dot(&block.law.respond(&(v + dv * length)).impulse);
        }
        slope
    }

    /// Length that minimises the cost along the direction, to a share of its first slope: the full step unless
    /// it overshoots, else the root of the slope by the Illinois variant of the false position.
    fn search_line(&self, blocks: &[Block], direction: &Direction) -> f64 {
        let falls = self.dv.iter().zip(&self.responses).map(|(dv, response)| dv.dot(&response.impulse));
        let (mut low, mut slope_low) = (0.0, falls.fold(direction.slope, |slope, fall| slope - fall));
        let (mut high, mut slope_high) = (1.0, self.slope(blocks, direction, 1.0));
        let goal = SLOPE_SHARE * slope_low.abs();
        if slope_high <= goal {
            return 1.0;
        }
        if slope_low >= 0.0 {
            // Descent is lost in round-off.
            return 1.0;
        }
        for _ in 0..MAX_EVALUATIONS {
            let length = low - slope_low * (high - low) / (slope_high - slope_low);
            let slope = self.slope(blocks, direction, length);
            if slope.abs() <= goal {
                return length;
            }
            if slope < 0.0 {
                (low, slope_low) = (length, slope);
                slope_high *= 0.5;
            } else {
                (high, slope_high) = (length, slope);
                slope_low *= 0.5;
            }
        }
        low
    }
}
