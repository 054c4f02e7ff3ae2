//! Numbers of the arm's joints, as many as the arm has.

use serde::{Deserialize, Serialize};

/// Largest number of arm joints.
pub const MAX_ARM_DOF: usize = 8;

/// One number for each joint of an arm, from the shoulder out; the rows beyond its joints are zero.
pub type JointVector = nalgebra::SVector<f64, MAX_ARM_DOF>;

/// One number for each joint of an arm, from the shoulder out. It derefs to a slice and is serialised as a sequence.
#[derive(Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(try_from = "Vec<f64>", into = "Vec<f64>")]
pub struct JointValues {
    values: JointVector,
    dof: usize,
}

impl JointValues {
    /// Makes `dof` zeros, at most [`MAX_ARM_DOF`].
    pub fn zeros(dof: usize) -> Self {
        Self { values: JointVector::zeros(), dof: dof.min(MAX_ARM_DOF) }
    }

    /// Makes the first `dof` numbers of a vector, at most [`MAX_ARM_DOF`].
    pub fn of(vector: &JointVector, dof: usize) -> Self {
        let mut values = Self::zeros(dof);
        let dof = values.dof;
        values.copy_from_slice(&vector.as_slice()[..dof]);
        values
    }

    /// Makes `dof` numbers from their indices, at most [`MAX_ARM_DOF`].
    pub fn from_fn(dof: usize, mut number: impl FnMut(usize) -> f64) -> Self {
        let mut values = Self::zeros(dof);
        for (i, value) in values.iter_mut().enumerate() {
            *value = number(i);
        }
        values
    }

    /// The numbers as a vector of [`MAX_ARM_DOF`] rows; the rows beyond the arm's joints are zero.
    pub fn vector(&self) -> JointVector {
        self.values
    }
}

impl std::ops::Deref for JointValues {
    type Target = [f64];

    fn deref(&self) -> &[f64] {
        &self.values.as_slice()[..self.dof]
    }
}

impl std::ops::DerefMut for JointValues {
    fn deref_mut(&mut self) -> &mut [f64] {
        &mut self.values.as_mut_slice()[..self.dof]
    }
}

impl<'a> IntoIterator for &'a JointValues {
    type Item = &'a f64;
    type IntoIter = std::slice::Iter<'a, f64>;

    fn into_iter(self) -> Self::IntoIter {
        self.iter()
    }
}

impl std::fmt::Debug for JointValues {
    fn fmt(&self, f: &mut std::fmt::Formatter) -> std::fmt::Result {
        std::fmt::Debug::fmt(&**self, f)
    }
}

/// More numbers than an arm can have joints.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
#[error("{0} numbers for the joints of an arm, which has at most {MAX_ARM_DOF}")]
pub struct TooManyJoints(pub usize);

impl TryFrom<&[f64]> for JointValues {
    type Error = TooManyJoints;

    fn try_from(numbers: &[f64]) -> Result<Self, TooManyJoints> {
        if numbers.len() > MAX_ARM_DOF {
            return Err(TooManyJoints(numbers.len()));
        }
        Ok(Self::from_fn(numbers.len(), |i| numbers[i]))
    }
}

impl TryFrom<Vec<f64>> for JointValues {
    type Error = TooManyJoints;

    fn try_from(numbers: Vec<f64>) -> Result<Self, TooManyJoints> {
        numbers.as_slice().try_into()
    }
}

impl From<JointValues> for Vec<f64> {
    fn from(values: JointValues) -> Self {
        values.to_vec()
    }
}

impl<const N: usize> From<[f64; N]> for JointValues {
    fn from(numbers: [f64; N]) -> Self {
        const { assert!(N <= MAX_ARM_DOF, "an arm has at most 8 joints") };
        Self::from_fn(N, |i| numbers[i])
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_come_and_go_as_sequences() {
        let six = JointValues::from([1.0, 2.0, 3.0, 4.0, 5.0, -0.0]);
        assert_eq!((six.len(), six[5].to_bits()), (6, (-0.0_f64).to_bits()));
        assert_eq!(JointValues::try_from(six.to_vec()).unwrap(), six);
        assert_eq!(JointValues::of(&six.vector(), 6), six);
        assert_eq!(six.vector().as_slice()[6..], [0.0; 2]);
        assert_eq!(JointValues::try_from(vec![0.0; 9]), Err(TooManyJoints(9)));
    }
}
