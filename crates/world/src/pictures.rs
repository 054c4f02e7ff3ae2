//! Colour pictures of a world, as the robot's cameras see it.

use std::sync::Arc;

use orchard_camera::picture::{PictureStyle, ShadowMaps, Studio, look_at};
use orchard_camera::{MovingScene, Scene};
use orchard_geometry::{Image, Intrinsics, Pose};
use orchard_robot::{PictureRequest, Pictures};

use crate::World;
use crate::camera::{CameraTruth, Sight};

/// Colour pictures before they are drawn: a scene in its light, and the cameras that see it.
#[derive(Debug, Clone)]
pub struct PictureSight {
    /// What moves with bodies.
    pub visible: Arc<MovingScene>,
    /// Pose of each body of it.
    pub x_world_body: Vec<Pose>,
    /// Stems, posed in the world.
    pub loose: Scene,
    /// Light and image quality.
    pub style: PictureStyle,
    /// Cameras with their poses.
    pub cameras: Vec<(Intrinsics, Pose)>,
}

impl PictureSight {
    /// The scene that they show.
    pub fn scene(&self) -> Scene {
        let mut scene = self.visible.posed(&self.x_world_body);
        scene.items.extend_from_slice(&self.loose.items);
        scene
    }

    /// Draws the pictures (sRGB), one a camera.
    pub fn draw(&self) -> Vec<Image<[u8; 3]>> {
        let scene = self.scene();
        let studio = Studio::new(&scene, &self.style);
        self.cameras.iter().map(|(k, x_world_camera)| studio.picture(k, x_world_camera)).collect()
    }
}

impl World {
    /// Has the wrist camera take a colour image with each depth image, registered to it, or none. The state of the world does not depend on it.
    pub fn deliver_colour(&mut self, on: bool) {
        self.takes_colour = on;
    }

    /// The colour image of a depth image, before it is drawn; `None` if the camera takes no colour.
    pub fn colour_sight(&self, sight: &Sight) -> Option<PictureSight> {
        let stems = || match self.taken_at(sight.frame) {
            Some(shot) => self.stems_in(&self.at(shot)),
            None => self.stems_in(&self.state.data),
        };
        self.takes_colour.then(|| PictureSight {
            visible: self.pictured().clone(),
            x_world_body: sight.x_world_body.clone(),
            loose: stems(),
            style: PictureStyle::of_camera().under(self.spec().light.as_ref()),
            cameras: vec![(*sight.sensor.intrinsics(), sight.x_world_camera)],
        })
    }

    /// An image with its colour, if the camera takes colour and it has none.
    pub(crate) fn coloured(&self, mut truth: CameraTruth) -> CameraTruth {
        if truth.colour.is_some() {
            return truth;
        }
        let drawn = self.colour_sight(&truth.sight).map(|sight| sight.draw());
        truth.colour = drawn.and_then(|drawn| drawn.into_iter().next()).map(Arc::new);
        truth
    }

    /// Has observations deliver colour pictures, or none. The state of the world does not depend on it.
    pub fn deliver_pictures(&mut self, request: Option<Arc<PictureRequest>>) {
        self.pictures = request;
    }

    /// Pictures of the present state, before they are drawn: of the camera on the hand, and of the one on the base.
    ///
    /// # Panics
    /// The world is behind ([`World::is_behind`]).
    pub fn picture_sight(&self, request: &PictureRequest) -> PictureSight {
        assert!(!self.is_behind(), "wood and fruit are behind the robot");
        let PictureRequest { size: [width, height], vertical_fov, .. } = *request;
        let seen = |fov| Intrinsics::from_vertical_fov(width, height, fov);
        let style = PictureStyle {
            shadows: ShadowMaps { sun: request.sun_map, sky: request.sky_map },
            supersampling: request.supersampling,
            ..PictureStyle::default()
        };
        let x_base_camera = look_at(&request.p_base_eye, &request.p_base_aim);
        let wrist = (seen(self.spec().camera.view().vertical_fov.si()), self.x_world_camera());
        let base = (seen(vertical_fov), self.handle().x_world_base(self.data()) * x_base_camera);
        PictureSight {
            visible: self.pictured().clone(),
            x_world_body: self.x_world_visible(self.data()),
            loose: self.stems_in(self.data()),
            style: style.under(self.spec().light.as_ref()),
            cameras: vec![wrist, base],
        }
    }

    /// The pictures of [`Self::picture_sight`], drawn here or elsewhere: rows of pixels.
    pub fn pictures_of(&self, wrist: Vec<u8>, base: Vec<u8>) -> Pictures {
        Pictures { time: f64::from(self.frame()) * self.spec().sim.frame(), wrist, base }
    }

    /// Takes pictures of the present state.
    pub fn take_pictures(&self, request: &PictureRequest) -> Pictures {
        let drawn = self.picture_sight(request).draw();
        let [wrist, base] = [0, 1].map(|k| drawn[k].pixels().as_flattened().to_vec());
        self.pictures_of(wrist, base)
    }
}
