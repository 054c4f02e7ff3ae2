//! A small quadratic program over joint velocities: bounds, rows on distances, slacks.

use crate::joint_values::{JointVector, MAX_ARM_DOF};
use clarabel::algebra::CscMatrix;
use clarabel::solver::{DefaultSettings, DefaultSolver, IPSolver, NonnegativeConeT, SolverStatus};
use nalgebra::{DMatrix, DVector, SMatrix};

/// Constraint `gradient . v >= least`; with a penalty, `gradient . v + s >= least` at the cost `penalty s`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Row {
    pub gradient: JointVector,
    pub least: f64,
    pub penalty: Option<f64>,
}

type Hessian = SMatrix<f64, MAX_ARM_DOF, MAX_ARM_DOF>;

/// Quadratic program: minimise `v . H v / 2 - g . v + sum penalty s` within the bounds and rows.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Problem {
    /// Number of joints: further rows and columns play no part.
    dof: usize,
    hessian: Hessian,
    gradient: JointVector,
    pub lower: JointVector,
    pub upper: JointVector,
    pub rows: Vec<Row>,
}

/// Solution of a quadratic program.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Solution {
    pub v: JointVector,
    /// Largest slack.
    pub slack: f64,
    /// True if no row was active.
    pub is_free: bool,
}

/// Least half-width of a range of velocities for the interior-point method [rad/s]; the result is cut to the true range.
const INTERIOR: f64 = 1e-6;

/// Accuracy of the interior-point method at speeds of about 1 m/s, far below the resolution of the servos.
const TOLERANCE: f64 = 1e-7;

/// Curvature of the penalty on a slack, which keeps the minimum unique.
const SLACK_CURVATURE: f64 = 1e-3;

/// Largest number of changes of the active set before the search gives up.
const SWITCHES: usize = 24;

/// Least magnitude of a multiplier of the wrong sign that counts, as a share of the largest gradient \[1\].
const WRONG_SIGN: f64 = 1e-12;

impl Problem {
    pub fn new(dof: usize, hessian: Hessian, gradient: JointVector) -> Self {
        let unbounded = JointVector::repeat(f64::INFINITY);
        Self { dof, hessian, gradient, lower: -unbounded, upper: unbounded, rows: Vec::new() }
    }

    /// Solves the program; `None` if it has no solution or none is found.
    ///
    /// In most steps the minimum over the bounds alone meets all rows and is the solution. Otherwise the interior-point method takes the
    /// broken rows, and adds rows until none is broken: rows that the solution meets do not change it.
    pub fn solve(&self, iterations: u32) -> Option<Solution> {
        let mut taken = vec![false; self.rows.len()];
        let mut found = match self.within_bounds() {
            Some(v) => Solution { v, slack: 0.0, is_free: true },
            None => return self.by_interior_point(&self.rows.iter().collect::<Vec<_>>(), iterations),
        };
        loop {
            let mut is_met = true;
            for (row, taken) in self.rows.iter().zip(&mut taken) {
                if !*taken && self.dot(&row.gradient, &found.v) < row.least {
                    (*taken, is_met) = (true, false);
                }
            }
            if is_met {
                return Some(found);
            }
            let rows: Vec<&Row> = self.rows.iter().zip(&taken).filter(|t| *t.1).map(|t| t.0).collect();
            found = self.by_interior_point(&rows, iterations)?;
        }
    }

    /// Scalar product over the joints, summed in their order.
    fn dot(&self, a: &JointVector, b: &JointVector) -> f64 {
        a.rows(0, self.dof).dot(&b.rows(0, self.dof))
    }

    /// Minimises over the bounds by an active-set search and checks the Karush-Kuhn-Tucker conditions at the end.
    fn within_bounds(&self) -> Option<JointVector> {
        let mut fixed = [None; MAX_ARM_DOF];
        for _ in 0..SWITCHES {
            let v = self.with_fixed(&fixed)?;
            let beyond = |i: usize| (v[i] - self.upper[i]).max(self.lower[i] - v[i]);
            let worst = (0..self.dof).filter(|&i| fixed[i].is_none()).fold(
                None,
                |worst: Option<usize>, i| match worst {
                    Some(w) if beyond(w) >= beyond(i) => worst,
                    _ => Some(i),
                },
            );
            if let Some(i) = worst.filter(|&i| beyond(i) > 0.0) {
                fixed[i] = Some(if v[i] > self.upper[i] { self.upper[i] } else { self.lower[i] });
                continue;
            }
            // The multiplier of an active bound must point outwards.
            let pull = self.gradient - self.hessian * v;
            let tolerance = WRONG_SIGN * self.gradient.amax();
            let inward = |i: usize| match fixed[i] {
                Some(x) if self.lower[i] < self.upper[i] => {
                    if x == self.upper[i] {
                        -pull[i]
                    } else {
                        pull[i]
                    }
                }
                _ => 0.0,
            };
            let release = (0..self.dof).reduce(|a, b| if inward(b) > inward(a) { b } else { a })?;
            if inward(release) <= tolerance {
                return Some(v);
            }
            fixed[release] = None;
        }
        None
    }

    /// Minimises with some velocities fixed.
    fn with_fixed(&self, fixed: &[Option<f64>; MAX_ARM_DOF]) -> Option<JointVector> {
        let mut matrix = self.hessian;
        let mut right = self.gradient;
        for (i, value) in fixed.iter().enumerate() {
            let Some(value) = value else { continue };
            right -= self.hessian.column(i) * *value;
            matrix.row_mut(i).fill(0.0);
            matrix.column_mut(i).fill(0.0);
            matrix[(i, i)] = 1.0;
        }
        for (i, value) in fixed.iter().enumerate() {
            if let Some(value) = value {
                right[i] = *value;
            }
        }
        Some(matrix.cholesky()?.solve(&right))
    }

    fn by_interior_point(&self, rows: &[&Row], iterations: u32) -> Option<Solution> {
        let soft: Vec<usize> = (0..rows.len()).filter(|&k| rows[k].penalty.is_some()).collect();
        let dof = self.dof;
        let variables = dof + soft.len();
        let first_row = 2 * dof;
        let first_slack = first_row + rows.len();
        let mut a = DMatrix::zeros(first_slack + soft.len(), variables);
        let mut b = vec![0.0; first_slack + soft.len()];
        for i in 0..dof {
            let middle = 0.5 * (self.lower[i] + self.upper[i]);
            let half = (0.5 * (self.upper[i] - self.lower[i])).max(INTERIOR);
            (a[(i, i)], b[i]) = (1.0, middle + half);
            (a[(dof + i, i)], b[dof + i]) = (-1.0, half - middle);
        }
        for (k, row) in rows.iter().enumerate() {
            for i in 0..dof {
                a[(first_row + k, i)] = -row.gradient[i];
            }
            b[first_row + k] = -row.least;
        }
        let mut p = DMatrix::zeros(variables, variables);
        let mut q = DVector::zeros(variables);
        p.view_mut((0, 0), (dof, dof)).copy_from(&self.hessian.view((0, 0), (dof, dof)));
        q.rows_mut(0, dof).copy_from(&-self.gradient.rows(0, dof));
        for (s, &k) in soft.iter().enumerate() {
            let column = dof + s;
            a[(first_row + k, column)] = -1.0;
            a[(first_slack + s, column)] = -1.0;
            p[(column, column)] = SLACK_CURVATURE;
            q[column] = rows[k].penalty.unwrap_or_default();
        }
        let settings = DefaultSettings {
            verbose: false,
            max_iter: iterations,
            max_threads: 1,
            presolve_enable: false,
            iterative_refinement_enable: false,
            tol_gap_abs: TOLERANCE,
            tol_gap_rel: TOLERANCE,
            tol_feas: TOLERANCE,
            ..DefaultSettings::default()
        };
        let cones = [NonnegativeConeT(b.len())];
        let p = sparse(&p, |i, j| i <= j);
        let mut solver =
            DefaultSolver::new(&p, q.as_slice(), &sparse(&a, |_, _| true), &b, &cones, settings).ok()?;
        solver.solve();
        let solved = matches!(solver.solution.status, SolverStatus::Solved | SolverStatus::AlmostSolved);
        let x = &solver.solution.x;
        if !solved || x.iter().any(|x| !x.is_finite()) {
            return None;
        }
        let slack = x[dof..].iter().copied().fold(0.0, f64::max);
        let v = JointVector::from_fn(|i, _| if i < dof { x[i] } else { 0.0 });
        Some(Solution { v, slack, is_free: false })
    }
}

/// The entries of a matrix that are not zero, by columns.
fn sparse(matrix: &DMatrix<f64>, keep: impl Fn(usize, usize) -> bool) -> CscMatrix<f64> {
    let (mut starts, mut places, mut values) = (vec![0], Vec::new(), Vec::new());
    for j in 0..matrix.ncols() {
        for i in 0..matrix.nrows() {
            if matrix[(i, j)] != 0.0 && keep(i, j) {
                places.push(i);
                values.push(matrix[(i, j)]);
            }
        }
        starts.push(places.len());
    }
    CscMatrix::new(matrix.nrows(), matrix.ncols(), starts, places, values)
}
