//! Units that config files may use: a closed list.

use serde::{Deserialize, Serialize};

macro_rules! units {
    ($($(#[$doc:meta])* $name:ident = $symbol:literal, $factor:expr;)*) => {
        /// A unit of measurement, written in config files by its symbol.
        #[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
        pub enum Unit {
            $($(#[$doc])* #[serde(rename = $symbol)] $name,)*
        }

        impl Unit {
            /// Symbol used in config files.
            pub fn symbol(self) -> &'static str {
                match self { $(Unit::$name => $symbol,)* }
            }

            /// Factor from this unit to SI (radians for angles).
            #[inline]
            pub fn to_si(self) -> f64 {
                match self { $(Unit::$name => $factor,)* }
            }
        }
    };
}

units! {
    /// Dimensionless.
    One = "1", 1.0;
    /// Metre.
    Metre = "m", 1.0;
    /// Centimetre.
    Centimetre = "cm", 1e-2;
    /// Millimetre.
    Millimetre = "mm", 1e-3;
    /// Cubic millimetre.
    CubicMillimetre = "mm3", 1e-9;
    /// Cubic centimetre per joule.
    CubicCentimetrePerJoule = "cm3/J", 1e-6;
    /// Square metre.
    SquareMetre = "m2", 1.0;
    /// Square centimetre.
    SquareCentimetre = "cm2", 1e-4;
    /// Per square centimetre.
    PerSquareCentimetre = "1/cm2", 1e4;
    /// Degree of arc.
    Degree = "deg", std::f64::consts::PI / 180.0;
    /// Radian.
    Radian = "rad", 1.0;
    /// Second.
    Second = "s", 1.0;
    /// Millisecond.
    Millisecond = "ms", 1e-3;
    /// Hertz.
    Hertz = "Hz", 1.0;
    /// Per second.
    PerSecond = "1/s", 1.0;
    /// Kilogram.
    Kilogram = "kg", 1.0;
    /// Kilogram square metre.
    KilogramSquareMetre = "kg m2", 1.0;
    /// Kilogram per cubic metre.
    KilogramPerCubicMetre = "kg/m3", 1.0;
    /// Newton.
    Newton = "N", 1.0;
    /// Newton per second.
    NewtonPerSecond = "N/s", 1.0;
    /// Newton metre per second.
    NewtonMetrePerSecond = "N m/s", 1.0;
    /// Newton metre.
    NewtonMetre = "N m", 1.0;
    /// Newton per metre.
    NewtonPerMetre = "N/m", 1.0;
    /// Newton second per metre.
    NewtonSecondPerMetre = "N s/m", 1.0;
    /// Newton metre per radian.
    NewtonMetrePerRadian = "N m/rad", 1.0;
    /// Newton metre second per radian.
    NewtonMetreSecondPerRadian = "N m s/rad", 1.0;
    /// Pascal.
    Pascal = "Pa", 1.0;
    /// Megapascal.
    Megapascal = "MPa", 1e6;
    /// Gigapascal.
    Gigapascal = "GPa", 1e9;
    /// Metre per second.
    MetrePerSecond = "m/s", 1.0;
    /// Radian per second.
    RadianPerSecond = "rad/s", 1.0;
    /// Metre per second squared.
    MetrePerSecondSquared = "m/s2", 1.0;
    /// Radian per second squared.
    RadianPerSecondSquared = "rad/s2", 1.0;
    /// Joule.
    Joule = "J", 1.0;
    /// Pixel.
    Pixel = "px", 1.0;
    /// Number of fruit.
    Fruit = "fruit", 1.0;
}
