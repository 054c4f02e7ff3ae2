//! Laws of a batch's worlds that need more numbers or another kernel than the paper's.

use orchard_batch::Plant;

/// Laws that hold in every world of a batch. The kernels are specialised by them, so that worlds without them pay nothing.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub(crate) struct Laws {
    /// Dampers hold damping ratios: each joint has its own, and the springs lead (`orchard_treephys::TreeBody::lead_springs`).
    pub modal: bool,
}

impl Laws {
    /// Number of different laws.
    pub const COUNT: usize = 2;

    /// Laws of a plant.
    pub fn of(plant: &Plant) -> Self {
        Self { modal: plant.tree.is_modal }
    }

    /// Number of these laws among all.
    pub fn index(self) -> usize {
        usize::from(self.modal)
    }

    /// Constants that specialise the kernels.
    pub fn constants(self) -> Vec<(&'static str, f64)> {
        let all = [("MODAL", self.modal)];
        all.into_iter().filter(|(_, holds)| *holds).map(|(name, _)| (name, 1.0)).collect()
    }
}
