//! Depth cameras with the view and the errors of a config.

mod noise;
mod registration;
mod stereo;
mod time_of_flight;
mod window;

pub use noise::FieldScale;
pub use registration::CoveredPixels;
pub use stereo::StereoErrors;
pub use time_of_flight::TimeOfFlightErrors;

use registration::register;

use crate::{Frame, Label, NO_INSTANCE, Scene, render};
use orchard_geometry::{DepthImage, Intrinsics, Pose, Vec3, math};
use orchard_spec::camera::{CameraSpec, Measurement, NativeSpec, ViewSpec};

/// Range of depths that keeps all surfaces.
const EVERYWHERE: (f64, f64) = (0.0, f64::INFINITY);

/// A depth camera.
#[derive(Debug, Clone, PartialEq)]
pub struct Sensor {
    spec: CameraSpec,
    intrinsics: Intrinsics,
}

/// Key of an image's noise: two images with the same key and scene have the same bits.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct ImageKey {
    /// Seed of the population.
    pub seed: u64,
    /// Index of the world under its seed.
    pub world: u32,
    /// Frame in which the image is taken, or its number among the images of a world.
    pub frame: u32,
}

/// One image: the measured depth and the truth.
#[derive(Debug, Clone, PartialEq)]
pub struct Capture {
    /// Measured depth along the optical axis \[m\], 0 without a measurement.
    pub measured: DepthImage,
    /// True depth, label and instance of every pixel within the camera's range and the fields of view of its lenses.
    pub truth: Frame,
}

/// An exact image that is to be drawn.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Exposure {
    /// Intrinsics.
    pub intrinsics: Intrinsics,
    /// Pose of the optical frame.
    pub x_world_camera: Pose,
    /// Least depth \[m\]; a nearer surface hides what is behind it and is invalid.
    pub near: f64,
    /// Largest depth \[m\].
    pub far: f64,
}

impl Exposure {
    /// Draws the image on the processor.
    pub fn draw(&self, scene: &Scene) -> Frame {
        let mut frame = Frame::new(self.intrinsics.width, self.intrinsics.height);
        render(scene, &self.intrinsics, &self.x_world_camera, self.near, self.far, &mut frame);
        frame
    }
}

impl Sensor {
    /// Makes the camera of a spec.
    pub fn new(spec: &CameraSpec) -> Self {
        Self { spec: spec.clone(), intrinsics: intrinsics(spec.view()) }
    }

    /// Replaces the intrinsics.
    #[must_use]
    pub fn with_intrinsics(self, intrinsics: Intrinsics) -> Self {
        Self { intrinsics, ..self }
    }

    /// Intrinsics of the camera.
    pub fn intrinsics(&self) -> &Intrinsics {
        &self.intrinsics
    }

    /// Takes an image; `x_world_camera` is the pose of the optical frame.
    pub fn capture(&self, scene: &Scene, x_world_camera: &Pose, key: ImageKey) -> Capture {
        let seen = self.exposure(x_world_camera).draw(scene);
        let measured = self.measure(&seen.depth, key);
        let truth =
            if self.sees_what_it_shows() { self.in_range(seen) } else { self.truth(scene, x_world_camera) };
        Capture { measured, truth }
    }

    /// The exact image from which the camera measures: that of its imager, with finer pixels where one gathers light of several rays.
    pub fn exposure(&self, x_world_camera: &Pose) -> Exposure {
        let mut x_world_imager = *x_world_camera;
        let imager = match self.spec.native() {
            None => self.intrinsics,
            Some(native) => {
                let right = Vec3::new(native.right.si(), 0.0, 0.0);
                x_world_imager.translation.vector -= x_world_camera.rotation * right;
                of_lens(native)
            }
        };
        // Surfaces out of range still hide others, give windows texture to match and return light.
        let (intrinsics, (near, far)) = match self.spec.measurement() {
            Measurement::Exact => (imager, self.spec.range()),
            Measurement::Stereo(_) => (imager, EVERYWHERE),
            Measurement::TimeOfFlight(_) => (finer(&imager, TimeOfFlightErrors::RAYS), EVERYWHERE),
        };
        Exposure { intrinsics, x_world_camera: x_world_imager, near, far }
    }

    /// Makes the measured depth \[m\], 0 without a measurement, from the depths of [`Self::exposure`], drawn by any renderer.
    pub fn measure(&self, seen: &DepthImage, key: ImageKey) -> DepthImage {
        let imager = self.imager();
        let measured = match self.spec.measurement() {
            Measurement::Exact => seen.clone(),
            Measurement::Stereo(spec) => {
                stereo::measure(&StereoErrors::new(spec, (imager.width, imager.height), imager.fx), seen, key)
            }
            Measurement::TimeOfFlight(spec) => {
                let errors = TimeOfFlightErrors::new(spec, (imager.width, imager.height));
                time_of_flight::measure(&errors, seen, key)
            }
        };
        match self.spec.native() {
            None => measured,
            Some(native) => {
                register(&measured, &imager, &self.intrinsics, native.right.si(), native.bridge.si())
            }
        }
    }

    /// Errors of a stereo camera, for kernels that add them elsewhere; `None` for cameras of other kinds.
    pub fn stereo(&self) -> Option<StereoErrors> {
        let imager = self.imager();
        match self.spec.measurement() {
            Measurement::Stereo(spec) => {
                Some(StereoErrors::new(spec, (imager.width, imager.height), imager.fx))
            }
            Measurement::Exact | Measurement::TimeOfFlight(_) => None,
        }
    }

    /// Errors of a time-of-flight camera, for kernels that add them elsewhere; `None` for cameras of other kinds.
    pub fn time_of_flight(&self) -> Option<TimeOfFlightErrors> {
        let imager = self.imager();
        match self.spec.measurement() {
            Measurement::TimeOfFlight(spec) => {
                Some(TimeOfFlightErrors::new(spec, (imager.width, imager.height)))
            }
            Measurement::Exact | Measurement::Stereo(_) => None,
        }
    }

    /// The pixels that those of the depth imager cover, if images are registered to the view of another camera.
    pub fn covered(&self) -> Option<CoveredPixels> {
        let native = self.spec.native()?;
        let (right, bridge) = (native.right.si(), native.bridge.si());
        Some(CoveredPixels { imager: of_lens(native), camera: self.intrinsics, right, bridge })
    }

    /// Spec of the camera.
    pub fn spec(&self) -> &CameraSpec {
        &self.spec
    }

    /// Intrinsics of the imager that measures.
    fn imager(&self) -> Intrinsics {
        self.spec.native().map_or(self.intrinsics, of_lens)
    }

    /// Draws the truth of an image ([`Capture::truth`]).
    pub fn truth(&self, scene: &Scene, x_world_camera: &Pose) -> Frame {
        let (near, far) = EVERYWHERE;
        let exposure = Exposure { intrinsics: self.intrinsics, x_world_camera: *x_world_camera, near, far };
        self.in_range(exposure.draw(scene))
    }

    /// True if the exact image from which the camera measures has the pixels of its own.
    fn sees_what_it_shows(&self) -> bool {
        self.spec.native().is_none() && !matches!(self.spec.measurement(), Measurement::TimeOfFlight(_))
    }

    /// Keeps the pixels that the camera could measure.
    fn in_range(&self, mut truth: Frame) -> Frame {
        keep_range(&mut truth, self.spec.range());
        if !matches!(self.spec.measurement(), Measurement::Exact) {
            self.keep_field(&mut truth);
        }
        truth
    }

    /// Invalidates pixels of surfaces that do not lie in the fields of view of all lenses that a measurement needs: the depth imager, and
    /// the second imager of a stereo camera.
    fn keep_field(&self, frame: &mut Frame) {
        let native = self.spec.native();
        let imager = self.imager();
        let right = native.map_or(0.0, |native| native.right.si());
        let baseline = match self.spec.measurement() {
            Measurement::Stereo(spec) => spec.baseline.si(),
            _ => 0.0,
        };
        let within = |x: f64, length: usize| x >= -0.5 && x < length as f64 - 0.5;
        let k = self.intrinsics;
        keep(frame, |i, z| {
            let p = k.back_project((i % k.width) as f64, (i / k.width) as f64, z);
            let u = |x: f64| imager.fx * x / z + imager.cx;
            within(u(p.x + right), imager.width)
                && within(u(p.x + right - baseline), imager.width)
                && within(imager.fy * p.y / z + imager.cy, imager.height)
        });
    }
}

/// Intrinsics of the same view with `n` pixels for each pixel along each side.
fn finer(k: &Intrinsics, n: usize) -> Intrinsics {
    let by = n as f64;
    // The middle of pixel 0 is the middle of its n finer pixels.
    let moved = |c: f64| by * c + 0.5 * (by - 1.0);
    Intrinsics {
        width: k.width * n,
        height: k.height * n,
        fx: by * k.fx,
        fy: by * k.fy,
        cx: moved(k.cx),
        cy: moved(k.cy),
    }
}

/// Invalidates pixels nearer or farther than a range \[m\].
fn keep_range(frame: &mut Frame, (near, far): (f64, f64)) {
    keep(frame, |_, z| (near..=far).contains(&z));
}

/// Invalidates pixels that a condition on index and depth \[m\] refuses.
fn keep(frame: &mut Frame, wanted: impl Fn(usize, f64) -> bool) {
    let pixels = frame.depth.pixels_mut().iter_mut().zip(frame.label.pixels_mut());
    for (i, ((depth, label), instance)) in pixels.zip(frame.instance.pixels_mut()).enumerate() {
        if !wanted(i, f64::from(*depth)) {
            (*depth, *label, *instance) = (0.0, Label::None, NO_INSTANCE);
        }
    }
}

/// Pinhole intrinsics of a depth imager.
fn of_lens(native: &NativeSpec) -> Intrinsics {
    let (width, height) = (native.width.get() as usize, native.height.get() as usize);
    let square = Intrinsics::from_vertical_fov(width, height, native.vertical_fov.si());
    Intrinsics { fx: focal(width, native.horizontal_fov.si()), ..square }
}

/// Focal length \[px\] of a width and a horizontal field of view.
fn focal(width: usize, fov: f64) -> f64 {
    0.5 * width as f64 / math::tan(0.5 * fov)
}

/// Pinhole intrinsics of a view: f = n / (2 tan(fov / 2)), the axis in the middle of the image.
fn intrinsics(view: &ViewSpec) -> Intrinsics {
    let (width, height) = (view.width.get() as usize, view.height.get() as usize);
    let square = Intrinsics::from_vertical_fov(width, height, view.vertical_fov.si());
    match &view.horizontal_fov {
        None => square,
        Some(fov) => Intrinsics { fx: focal(width, fov.si()), ..square },
    }
}
