//! Colour pictures of the camera on the hand and of a fixed camera on the base.

use orchard_camera::picture::{PictureStyle, ShadowMaps, Studio, look_at};
use orchard_geometry::{Intrinsics, Pose, Vec3};
use orchard_policy::{PixelReading, Pixels, SettingError};
use orchard_quantity::Quantity;
use orchard_scenario::Scenario;
use orchard_world::World;
use serde::{Deserialize, Serialize};

use crate::rules::PixelRules;

/// The cameras of a scenario's robot.
pub(crate) struct Cameras {
    /// Frames from picture to picture.
    period: u32,
    wrist: Intrinsics,
    base: Intrinsics,
    x_base_camera: Pose,
    style: PictureStyle,
}

/// The pictures of a frame.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub(crate) struct Pictures {
    frame: u32,
    wrist: Vec<u8>,
    base: Vec<u8>,
}

impl Cameras {
    pub fn new(pixels: &Pixels, scenario: &Scenario, rules: &PixelRules) -> Result<Self, SettingError> {
        let (spec, arm) = (scenario.spec(), scenario.robot().kinematics());
        let seen = |fov: &Quantity| {
            Intrinsics::from_vertical_fov(pixels.width as usize, pixels.height as usize, fov.si())
        };
        let p_base = |from: &[Quantity; 3]| {
            arm.shoulder() + Vec3::new(from[0].si(), from[1].si(), from[2].si()) * arm.length()
        };
        let maps = ShadowMaps { sun: rules.sun_map.get() as usize, sky: rules.sky_map.get() as usize };
        Ok(Self {
            period: pixels.frames(spec.sim.frame_rate.si())?,
            wrist: seen(&spec.camera.view().vertical_fov),
            base: seen(&rules.vertical_fov),
            x_base_camera: look_at(&p_base(&rules.eye), &p_base(&rules.aim)),
            style: PictureStyle {
                shadows: maps,
                supersampling: rules.supersampling.get() as usize,
                ..PictureStyle::default()
            },
        })
    }

    /// True if pictures are taken in a frame.
    pub fn take_in(&self, frame: u32) -> bool {
        frame.is_multiple_of(self.period)
    }

    /// Takes pictures of a world as it is now.
    pub fn take(&self, world: &World) -> Pictures {
        let scene = world.picture_scene();
        let studio = Studio::new(&scene, &self.style);
        let x_world_base = world.handle().x_world_base(world.data());
        let picture = |intrinsics, x_world_camera| {
            studio.picture(intrinsics, &x_world_camera).pixels().as_flattened().to_vec()
        };
        Pictures {
            frame: world.frame(),
            wrist: picture(&self.wrist, world.x_world_camera()),
            base: picture(&self.base, x_world_base * self.x_base_camera),
        }
    }
}

impl Pictures {
    /// The pictures as they are read, with frames of a length \[s\].
    pub fn reading(&self, frame: f64) -> PixelReading<'_> {
        PixelReading { wrist: &self.wrist, base: &self.base, time: f64::from(self.frame) * frame }
    }

    /// True if they have the size of a setting.
    pub fn fit(&self, pixels: &Pixels) -> bool {
        let size = 3 * pixels.width as usize * pixels.height as usize;
        self.wrist.len() == size && self.base.len() == size
    }
}
