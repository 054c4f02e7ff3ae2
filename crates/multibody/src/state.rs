//! State of a world apart from its model: all that the next step depends on, to save and to restore.

use orchard_geometry::Vec3;
use serde::{Deserialize, Serialize};

use crate::contact::WarmStart;
use crate::data::{Data, forward_kinematics};
use crate::model::{Groups, Model};

/// A [`State`] of another model.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("{field} has {found} entries, the model needs {expected}")]
pub struct StateError {
    /// Array of [`Data`].
    pub field: &'static str,
    /// Entries that the model needs.
    pub expected: usize,
    /// Entries of the state.
    pub found: usize,
}

/// Defines [`State`], and both ways between it and [`Data`], from one list of arrays.
macro_rules! state_of_data {
    ($($field:ident: $entry:ty,)*) => {
        /// State and inputs of [`Data`], with the first guess of the next contact solve, which reaches the last
        /// bits of its result. Scratch is left out: a step computes it.
        ///
        /// It serialises; a binary format keeps the bits of every number.
        #[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
        pub struct State {
            $($field: Vec<$entry>,)*
            warm_start: WarmStart,
        }

        impl Data {
            /// Copies out all that the next step depends on.
            pub fn state(&self) -> State {
                // No `..`: a new field of `Data` must be sorted here into state or scratch.
                let Data {
                    $($field,)*
                    contact,
                    point_paired_force_world: _,
                    capped: _,
                    velocity_products: _,
                    kinematics: _,
                    factor: _,
                    impulse: _,
                    change: _,
                    correction: _,
                    linear: _,
                } = self;
                State { $($field: $field.clone(),)* warm_start: contact.warm_start() }
            }

            /// Checks that a state has the arrays of this model.
            ///
            /// # Errors
            /// The first array with another length.
            pub fn check(&self, state: &State) -> Result<(), StateError> {
                $(
                    let (field, expected, found) = (stringify!($field), self.$field.len(), state.$field.len());
                    if found != expected {
                        return Err(StateError { field, expected, found });
                    }
                )*
                Ok(())
            }

            /// Goes back to a state: steps from here give the same bits as they did from there. Kinematics are
            /// valid afterwards.
            ///
            /// # Errors
            /// An array has another length than this model needs; then nothing has changed.
            pub fn restore(&mut self, model: &Model, state: &State) -> Result<(), StateError> {
                self.check(state)?;
                $(self.$field.copy_from_slice(&state.$field);)*
                self.contact.set_warm_start(&state.warm_start);
                forward_kinematics(model, self);
                Ok(())
            }
        }
    };
}

state_of_data! {
    q: f64,
    v: f64,
    point_p_world: Vec3,
    point_v_world: Vec3,
    point_w_world: Vec3,
    tethered: bool,
    stiffness: f64,
    damping: f64,
    rest: f64,
    torque: f64,
    linear_drag: f64,
    angular_drag: f64,
    body_force_world: Vec3,
    body_torque_world: Vec3,
    point_force_world: Vec3,
    point_quadratic_drag: f64,
    point_spin_damping: f64,
    anchor_bias_world: Vec3,
    reaction_cap: f64,
    point_carried: bool,
    groups: Groups,
}
