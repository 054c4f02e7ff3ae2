//! The deterministic layer: functions whose last bit differs between platforms' own libraries, through `libm`.

/// Sine and cosine.
pub fn sin_cos(x: f64) -> (f64, f64) {
    libm::sincos(x)
}

macro_rules! through_libm {
    ($($(#[$doc:meta])* $name:ident($($arg:ident),*) = $function:path;)*) => {
        $($(#[$doc])* pub fn $name($($arg: f64),*) -> f64 { $function($($arg),*) })*
    };
}

through_libm! {
    /// Sine.
    sin(x) = libm::sin;
    /// Cosine.
    cos(x) = libm::cos;
    /// Tangent.
    tan(x) = libm::tan;
    /// Arc sine.
    asin(x) = libm::asin;
    /// Arc cosine.
    acos(x) = libm::acos;
    /// Angle of the point (x, y).
    atan2(y, x) = libm::atan2;
    /// e to the x.
    exp(x) = libm::exp;
    /// Natural logarithm.
    ln(x) = libm::log;
    /// x to the y.
    pow(x, y) = libm::pow;
    /// Length of (x, y).
    hypot(x, y) = libm::hypot;
}

/// An angle brought to (-pi, pi].
pub fn wrap_angle(angle: f64) -> f64 {
    let turns = ((angle - std::f64::consts::PI) / std::f64::consts::TAU).ceil();
    angle - turns * std::f64::consts::TAU
}
