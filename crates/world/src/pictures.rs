//! Colour pictures of a world, as the robot's cameras see it.

use std::sync::Arc;

use orchard_camera::picture::{PictureStyle, ShadowMaps, Studio, look_at};
use orchard_geometry::Intrinsics;
use orchard_robot::{PictureRequest, Pictures};

use crate::World;
use crate::camera::CameraTruth;

impl World {
    /// Has the wrist camera take a colour image with each depth image, registered to it, or none. The state of the world does not depend on it.
    pub fn deliver_colour(&mut self, on: bool) {
        self.takes_colour = on;
    }

    /// An image with its colour, if the camera takes colour.
    pub(crate) fn coloured(&self, mut truth: CameraTruth) -> CameraTruth {
        if !self.takes_colour {
            return truth;
        }
        let sight = &truth.sight;
        let scene = match self.taken_at(sight.frame) {
            Some(shot) => self.picture_scene_in(&self.at(shot)),
            None => self.picture_scene(),
        };
        let colour = Studio::new(&scene, &PictureStyle::of_camera().under(self.spec().light.as_ref()))
            .picture(sight.sensor.intrinsics(), &sight.x_world_camera);
        truth.colour = Some(Arc::new(colour));
        truth
    }

    /// Has observations deliver colour pictures, or none. The state of the world does not depend on it.
    pub fn deliver_pictures(&mut self, request: Option<Arc<PictureRequest>>) {
        self.pictures = request;
    }

    /// Takes pictures of the present state.
    pub fn take_pictures(&self, request: &PictureRequest) -> Pictures {
        let PictureRequest { size: [width, height], vertical_fov, .. } = *request;
        let seen = |fov| Intrinsics::from_vertical_fov(width, height, fov);
        let style = PictureStyle {
            shadows: ShadowMaps { sun: request.sun_map, sky: request.sky_map },
            supersampling: request.supersampling,
            ..PictureStyle::default()
        };
        let style = style.under(self.spec().light.as_ref());
        let scene = self.picture_scene();
        let studio = Studio::new(&scene, &style);
        let picture = |fov, x_world_camera| {
            studio.picture(&seen(fov), &x_world_camera).pixels().as_flattened().to_vec()
        };
        let x_base_camera = look_at(&request.p_base_eye, &request.p_base_aim);
        Pictures {
            time: f64::from(self.frame()) * self.spec().sim.frame(),
            wrist: picture(self.spec().camera.view().vertical_fov.si(), self.x_world_camera()),
            base: picture(vertical_fov, self.handle().x_world_base(self.data()) * x_base_camera),
        }
    }
}
