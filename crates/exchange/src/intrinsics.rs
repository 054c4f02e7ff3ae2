//! Reads and writes the intrinsics of cameras.
//!
//! Read are, told apart by their fields: our own JSON `{width, height, fx, fy, cx, cy}`; the same with RealSense's `ppx`, `ppy`, `model` and
//! `coeffs`; a ROS camera_info, as JSON or YAML of a message (`k`, `d`, `distortion_model`) or as the YAML file of a calibration
//! (`camera_matrix`, `distortion_coefficients`, `image_width`); Open3D's `PinholeCameraIntrinsic` (`intrinsic_matrix`, column by column) and
//! `PinholeCameraParameters`; BOP's `camera.json` and `scene_camera.json` (`cam_K`, `depth_scale`). Other fields are ignored.

mod lens;
#[cfg(test)]
mod tests;

use orchard_geometry::Intrinsics;
use serde::Deserialize;
use serde_json::Value;

pub use lens::Lens;

use crate::yaml;

/// Largest number of columns or rows of an image \[px\]; a larger number is taken for a typing error.
pub const MOST_SIDE: usize = 16384;
/// Largest number of pixels of an image.
pub const MOST_PIXELS: usize = 100_000_000;
/// Largest focal length and position of the axis \[px\]: enough for a field of view of a tenth of a degree.
pub const FARTHEST_PIXEL: f64 = 1e7;

/// Models of distortion that are read, by their names in ROS and RealSense files.
const MODELS: [&str; 4] = ["plumb_bob", "rational_polynomial", "brown_conrady", "distortion.brown_conrady"];
/// Most coefficients of these models.
const MOST_COEFFICIENTS: usize = 8;

/// Error of reading the intrinsics of a camera.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum IntrinsicsError {
    /// The text is neither JSON nor YAML, or a field is missing or of the wrong type.
    #[error("{field}: {problem}")]
    Json {
        /// Path of the field, `.` for the file.
        field: String,
        /// Problem, with line and column where they are known.
        problem: String,
    },
    /// A number is outside its range.
    #[error("{field} is {value}; the allowed range is {allowed}")]
    Range {
        /// Name of the field.
        field: &'static str,
        /// Value in the file.
        value: f64,
        /// Allowed range.
        allowed: String,
    },
    /// A pinhole is needed, but the camera has lens distortion.
    #[error("distortion {value} is not zero; rectify the image and give its pinhole intrinsics")]
    Distorted {
        /// First coefficient that is not zero.
        value: f64,
    },
    /// The lens distorts by a model that is not read.
    #[error(
        "distortion of {model} is not read (plumb_bob, rational_polynomial, brown_conrady with up to {MOST_COEFFICIENTS} coefficients are); \
         rectify the image and give its pinhole intrinsics"
    )]
    Model {
        /// Name of the model, or number of coefficients.
        model: String,
    },
    /// The file is of several images, and none of them is that of the depth image.
    #[error("has no image {wanted}; it has {found}")]
    Image {
        /// Number of the depth image; `-` if its name is no number.
        wanted: String,
        /// Numbers in the file.
        found: String,
    },
}

/// Camera as a file describes it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct CameraFile {
    /// Pinhole.
    pub intrinsics: Intrinsics,
    /// Distortion, if there is any.
    pub lens: Option<Lens>,
    /// Depth of value 1 \[m\], if the file states it.
    pub unit: Option<f64>,
}

/// Knowledge of the depth image, which some files leave out.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct OfImage {
    /// Columns and rows.
    pub size: Option<(usize, usize)>,
    /// Number of the image in its scene.
    pub number: Option<u64>,
}

#[derive(Deserialize)]
struct File {
    #[serde(alias = "image_width")]
    width: Option<usize>,
    #[serde(alias = "image_height")]
    height: Option<usize>,
    fx: Option<f64>,
    fy: Option<f64>,
    #[serde(alias = "ppx")]
    cx: Option<f64>,
    #[serde(alias = "ppy")]
    cy: Option<f64>,
    /// Matrix row by row: fx 0 cx 0 fy cy 0 0 1.
    #[serde(alias = "K", alias = "cam_K")]
    k: Option<[f64; 9]>,
    camera_matrix: Option<Matrix<[f64; 9]>>,
    /// Matrix column by column.
    intrinsic_matrix: Option<[f64; 9]>,
    /// Open3D's camera within parameters.
    intrinsic: Option<Box<File>>,
    #[serde(alias = "D", alias = "coeffs")]
    d: Option<Vec<f64>>,
    distortion_coefficients: Option<Matrix<Vec<f64>>>,
    #[serde(alias = "model")]
    distortion_model: Option<String>,
    /// Depth of value 1 in millimetres.
    depth_scale: Option<f64>,
}

#[derive(Deserialize)]
struct Matrix<T> {
    data: T,
}

/// Reads the intrinsics of a pinhole.
///
/// # Errors
/// As [`read_camera`], or the lens is distorted.
pub fn read(text: &str) -> Result<Intrinsics, IntrinsicsError> {
    let file = file_of(text, &OfImage::default())?;
    if let Some(value) = file.coefficients().iter().copied().find(|c| *c != 0.0) {
        return Err(IntrinsicsError::Distorted { value });
    }
    file.intrinsics(&OfImage::default())
}

/// Reads a camera; `of` is known of its image.
///
/// # Errors
/// The text is neither JSON nor YAML, a field is missing, of the wrong type or outside its range, or a model of distortion is not read.
pub fn read_camera(text: &str, of: &OfImage) -> Result<CameraFile, IntrinsicsError> {
    let file = file_of(text, of)?;
    let unit = file.depth_scale.map(|millimetres| millimetres / 1e3);
    if let Some(value) = file.depth_scale.filter(|scale| !(*scale >= SCALES.0 && *scale <= SCALES.1)) {
        let allowed = format!("[{}, {}] mm", SCALES.0, SCALES.1);
        return Err(IntrinsicsError::Range { field: "depth_scale", value, allowed });
    }
    Ok(CameraFile { intrinsics: file.intrinsics(of)?, lens: file.lens()?, unit })
}

/// Least and largest depth of value 1 \[mm\].
const SCALES: (f64, f64) = (1e-6, 1e3);

fn file_of(text: &str, of: &OfImage) -> Result<File, IntrinsicsError> {
    let problem = |field: &str, problem: String| IntrinsicsError::Json { field: field.into(), problem };
    if !text.trim_start().starts_with('{')
        && let Ok(value @ Value::Object(_)) = yaml::first_document(text)
    {
        return of_value(value, of);
    }
    if let Ok(value @ Value::Object(_)) = serde_json::from_str::<Value>(text)
        && scene(&value).is_some()
    {
        return of_value(value, of);
    }
    let mut json = serde_json::Deserializer::from_str(text);
    let file = serde_path_to_error::deserialize(&mut json)
        .map_err(|e| problem(&e.path().to_string(), e.inner().to_string()))?;
    json.end().map_err(|e| problem(".", e.to_string()))?;
    Ok(file)
}

/// The number of each image, if all fields are numbers, as in BOP's `scene_camera.json`.
fn scene(value: &Value) -> Option<Vec<u64>> {
    let fields = value.as_object().filter(|fields| !fields.is_empty())?;
    fields.keys().map(|key| key.parse().ok()).collect()
}

fn of_value(value: Value, of: &OfImage) -> Result<File, IntrinsicsError> {
    let (path, value) = match scene(&value) {
        None => (String::new(), value),
        Some(numbers) => {
            let only = if numbers.len() == 1 { numbers.first().copied() } else { None };
            let number = of.number.filter(|n| numbers.contains(n)).or(only);
            let Some(number) = number else {
                let some: Vec<String> = numbers.iter().take(10).map(u64::to_string).collect();
                let more = if numbers.len() > some.len() { " and more" } else { "" };
                let wanted = of.number.map_or_else(|| "-".to_owned(), |n| n.to_string());
                return Err(IntrinsicsError::Image { wanted, found: some.join(", ") + more });
            };
            let entry =
                value.as_object().and_then(|all| all.values().zip(&numbers).find(|(_, n)| **n == number));
            (format!("{number}."), entry.map(|(entry, _)| entry.clone()).unwrap_or_default())
        }
    };
    serde_path_to_error::deserialize(value).map_err(|e| IntrinsicsError::Json {
        field: format!("{path}{}", e.path()),
        problem: e.inner().to_string(),
    })
}

impl File {
    /// Matrix row by row.
    fn matrix(&self) -> Result<Option<[f64; 9]>, IntrinsicsError> {
        let rows = self.k.or(self.camera_matrix.as_ref().map(|m| m.data));
        let columns = self.intrinsic_matrix.map(|m| [m[0], m[3], m[6], m[1], m[4], m[7], m[2], m[5], m[8]]);
        let (field, order) =
            if rows.is_some() { ("K", "row by row") } else { ("intrinsic_matrix", "column by column") };
        let matrix = rows.or(columns);
        match matrix {
            Some(m) if m[6..] != [0.0, 0.0, 1.0] => Err(IntrinsicsError::Json {
                field: field.into(),
                problem: format!("its last row is {:?}, not 0, 0, 1: the matrix is read {order}", &m[6..]),
            }),
            matrix => Ok(matrix),
        }
    }

    fn intrinsics(&self, of: &OfImage) -> Result<Intrinsics, IntrinsicsError> {
        if let Some(inner) = &self.intrinsic {
            return inner.intrinsics(of);
        }
        let matrix = self.matrix()?;
        let missing = |field: &str, hint: &str| IntrinsicsError::Json {
            field: field.into(),
            problem: format!("is missing{hint}"),
        };
        let number = |field: &str, own: Option<f64>, at: usize| {
            own.or(matrix.map(|k| k[at])).ok_or_else(|| missing(field, " (and there is no matrix K)"))
        };
        let side = |field: &str, own: Option<usize>, known: Option<usize>| {
            own.or(known).ok_or_else(|| missing(field, ""))
        };
        let intrinsics = Intrinsics {
            width: side("width", self.width, of.size.map(|size| size.0))?,
            height: side("height", self.height, of.size.map(|size| size.1))?,
            fx: number("fx", self.fx, 0)?,
            fy: number("fy", self.fy, 4)?,
            cx: number("cx", self.cx, 2)?,
            cy: number("cy", self.cy, 5)?,
        };
        check(&intrinsics)?;
        Ok(intrinsics)
    }

    fn coefficients(&self) -> &[f64] {
        let matrix = self.distortion_coefficients.as_ref().map(|m| &m.data);
        self.d.as_ref().or(matrix).map_or(&[], Vec::as_slice)
    }

    fn lens(&self) -> Result<Option<Lens>, IntrinsicsError> {
        let all = self.coefficients();
        let Some(last) = all.iter().rposition(|c| *c != 0.0) else { return Ok(None) };
        if let Some(value) = all.iter().copied().find(|c| !c.is_finite()) {
            return Err(IntrinsicsError::Range { field: "d", value, allowed: "finite".into() });
        }
        let refuse = |model: String| Err(IntrinsicsError::Model { model });
        match &self.distortion_model {
            Some(model) if !MODELS.contains(&model.to_lowercase().as_str()) => refuse(model.clone()),
            _ if last >= MOST_COEFFICIENTS => refuse(format!("{} coefficients", all.len())),
            _ => Ok(Some(Lens::of_coefficients(all))),
        }
    }
}

fn check(k: &Intrinsics) -> Result<(), IntrinsicsError> {
    let refuse = |field, value, allowed: String| Err(IntrinsicsError::Range { field, value, allowed });
    for (field, value) in [("width", k.width), ("height", k.height)] {
        if !(1..=MOST_SIDE).contains(&value) {
            return refuse(field, value as f64, format!("[1, {MOST_SIDE}] px"));
        }
    }
    if k.width * k.height > MOST_PIXELS {
        return refuse("width x height", (k.width * k.height) as f64, format!("[1, {MOST_PIXELS}] px"));
    }
    for (field, value) in [("fx", k.fx), ("fy", k.fy)] {
        if !(value > 0.0 && value <= FARTHEST_PIXEL) {
            return refuse(field, value, format!("(0, {FARTHEST_PIXEL}] px"));
        }
    }
    for (field, value) in [("cx", k.cx), ("cy", k.cy)] {
        if !(-FARTHEST_PIXEL..=FARTHEST_PIXEL).contains(&value) {
            return refuse(field, value, format!("[-{FARTHEST_PIXEL}, {FARTHEST_PIXEL}] px"));
        }
    }
    Ok(())
}

/// Writes intrinsics; [`read`] returns the same bits.
pub fn write(intrinsics: &Intrinsics) -> String {
    let text = serde_json::to_string_pretty(intrinsics);
    text.unwrap_or_else(|e| unreachable!("six numbers have a form in JSON: {e}")) + "\n"
}
