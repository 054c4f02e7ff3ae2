//! Reads and writes pinhole intrinsics as JSON.
//!
//! Three forms are read: our own `{width, height, fx, fy, cx, cy}`, the same with RealSense's `ppx`, `ppy` and `coeffs`, and
//! a ROS camera_info with the matrix `K` (or `k`) row by row and the distortion `D` (or `d`). Other fields are ignored.

use orchard_geometry::Intrinsics;
use serde::Deserialize;

/// Largest number of columns or rows of an image \[px\]; a larger number is taken for a typing error.
pub const MOST_PIXELS: usize = 8192;
/// Largest focal length and position of the axis \[px\]: enough for a field of view of a tenth of a degree.
pub const FARTHEST_PIXEL: f64 = 1e7;

/// Error of reading the intrinsics of a pinhole camera.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum IntrinsicsError {
    /// The text is not JSON, or a field is missing or of the wrong type.
    #[error("{field}: {problem}")]
    Json {
        /// Path of the field, `.` for the file.
        field: String,
        /// Problem, with line and column.
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
    /// The camera has lens distortion, so that it is no pinhole.
    #[error("distortion {value} is not zero; rectify the image and give its pinhole intrinsics")]
    Distorted {
        /// First coefficient that is not zero.
        value: f64,
    },
}

#[derive(Deserialize)]
struct File {
    width: usize,
    height: usize,
    fx: Option<f64>,
    fy: Option<f64>,
    #[serde(alias = "ppx")]
    cx: Option<f64>,
    #[serde(alias = "ppy")]
    cy: Option<f64>,
    /// Matrix row by row: fx 0 cx 0 fy cy 0 0 1.
    #[serde(alias = "K")]
    k: Option<[f64; 9]>,
    #[serde(default, alias = "D", alias = "coeffs")]
    d: Vec<f64>,
}

/// Reads intrinsics.
///
/// # Errors
/// A field is missing, of the wrong type or outside its range, or the lens is distorted.
pub fn read(text: &str) -> Result<Intrinsics, IntrinsicsError> {
    let mut json = serde_json::Deserializer::from_str(text);
    let file: File = serde_path_to_error::deserialize(&mut json).map_err(|e| IntrinsicsError::Json {
        field: e.path().to_string(),
        problem: e.into_inner().to_string(),
    })?;
    let trailing = |e: serde_json::Error| IntrinsicsError::Json { field: ".".into(), problem: e.to_string() };
    json.end().map_err(trailing)?;
    let of_matrix = |at: usize| file.k.map(|k| k[at]);
    let number = |field: &'static str, own: Option<f64>, at: usize| {
        own.or(of_matrix(at)).ok_or(IntrinsicsError::Json {
            field: field.into(),
            problem: "is missing (and there is no matrix K)".into(),
        })
    };
    let intrinsics = Intrinsics {
        width: file.width,
        height: file.height,
        fx: number("fx", file.fx, 0)?,
        fy: number("fy", file.fy, 4)?,
        cx: number("cx", file.cx, 2)?,
        cy: number("cy", file.cy, 5)?,
    };
    if let Some(value) = file.d.iter().copied().find(|c| *c != 0.0) {
        return Err(IntrinsicsError::Distorted { value });
    }
    check(&intrinsics)?;
    Ok(intrinsics)
}

fn check(k: &Intrinsics) -> Result<(), IntrinsicsError> {
    let refuse = |field, value, allowed: String| Err(IntrinsicsError::Range { field, value, allowed });
    for (field, value) in [("width", k.width), ("height", k.height)] {
        if !(1..=MOST_PIXELS).contains(&value) {
            return refuse(field, value as f64, format!("[1, {MOST_PIXELS}] px"));
        }
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

#[cfg(test)]
mod tests {
    use super::*;

    const K: Intrinsics =
        Intrinsics { width: 640, height: 480, fx: 610.5, fy: 611.25, cx: 319.5, cy: 240.125 };

    #[test]
    fn written_intrinsics_read_back() {
        assert_eq!(read(&write(&K)), Ok(K));
    }

    #[test]
    fn realsense_and_ros_forms_are_read() {
        let realsense = r#"{"width": 640, "height": 480, "ppx": 319.5, "ppy": 240.125, "fx": 610.5, "fy": 611.25,
            "model": "distortion.brown_conrady", "coeffs": [0.0, 0.0, 0.0, 0.0, 0.0]}"#;
        assert_eq!(read(realsense), Ok(K));
        for [k, d] in [["K", "D"], ["k", "d"]] {
            let ros = format!(
                r#"{{"header": {{"frame_id": "camera"}}, "height": 480, "width": 640, "distortion_model": "plumb_bob",
                "{d}": [0, 0, 0, 0, 0], "{k}": [610.5, 0, 319.5, 0, 611.25, 240.125, 0, 0, 1]}}"#
            );
            assert_eq!(read(&ros), Ok(K));
        }
    }

    #[test]
    fn errors_name_the_field() {
        let text = write(&K);
        for (from, to, message) in [
            ("610.5", "-1.0", "fx is -1; the allowed range is (0, 10000000] px"),
            ("611.25", "0", "fy is 0; the allowed range is (0, 10000000] px"),
            ("319.5", "1e300", "cx is 1000"),
            ("640", "0", "width is 0; the allowed range is [1, 8192] px"),
            ("640", "-3", "width: invalid value: integer `-3`"),
            ("610.5", "\"wide\"", "fx: invalid type: string \"wide\""),
            ("\"fy\"", "\"f_y\"", "fy: is missing"),
            ("\"cx\"", "\"d\": [0.1], \"cx\"", "distortion 0.1 is not zero"),
            ("\"cx\"", "\"ppx\": 3, \"cx\"", "duplicate field"),
            ("}", "", "EOF while parsing"),
            ("}", "} x", "trailing characters at line"),
        ] {
            let bad = text.replacen(from, to, 1);
            let error = read(&bad).unwrap_err().to_string();
            assert!(error.contains(message), "{error}");
        }
    }
}
