//! Presets of the crate, and the rules by which a config overrides its base.

use orchard_quantity::{self as quantity, ConfigError, from_table, overlay, parse};
use std::fmt;
use std::str::FromStr;

use crate::Spec;
use crate::camera;

macro_rules! presets {
    ($($(#[$doc:meta])* $variant:ident = $name:literal;)*) => {
        /// A config that comes with the crate.
        #[derive(Debug, Clone, Copy, PartialEq, Eq)]
        pub enum Preset {
            $($(#[$doc])* $variant,)*
        }

        impl Preset {
            /// All presets.
            pub const ALL: &[Self] = &[$(Self::$variant,)*];

            /// Name in configs and on command lines.
            pub fn name(self) -> &'static str {
                match self { $(Self::$variant => $name,)* }
            }

            /// Config file as TOML text.
            pub fn toml(self) -> &'static str {
                match self {
                    $(Self::$variant => include_str!(concat!("../configs/", $name, "/world.toml")),)*
                }
            }
        }
    };
}

presets! {
    /// The figures of the OrchardBench paper, completed by those of its released code.
    Paper = "paper";
    /// The paper's canonical tree, which uses no random numbers.
    Ternary = "ternary";
    /// The paper's figures with every axis of the domain randomisation at strength 1.
    Randomised = "randomised";
    /// The paper's figures with wood as measured on living trees.
    MeasuredWood = "measured-wood";
    /// Tall spindle: a tall, slender central leader with weak, pendant laterals, on a wire.
    TallSpindle = "tall-spindle";
    /// V-trellis: two leaders that lean into the alleys.
    VTrellis = "v-trellis";
    /// Vertical UFO: upright fruiting offshoots on a trunk laid along the lowest wire.
    VerticalUfo = "vertical-ufo";
    /// Eight-year-old dwarf trees, fitted to measured ones.
    Calibrated = "calibrated";
    /// Eight-year-old trees on rootstocks from dwarf to vigorous, fitted to measured ones.
    CalibratedMature = "calibrated-mature";
    /// Four-year-old unpruned trees, fitted to measured ones.
    CalibratedYoung = "calibrated-young";
}

impl fmt::Display for Preset {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.name())
    }
}

impl FromStr for Preset {
    type Err = String;

    fn from_str(name: &str) -> Result<Self, String> {
        Self::ALL.iter().copied().find(|preset| preset.name() == name).ok_or_else(|| {
            let names: Vec<&str> = Self::ALL.iter().map(|preset| preset.name()).collect();
            format!("no preset '{name}'; the presets are: {}", names.join(", "))
        })
    }
}

/// Field with the name of the base preset.
const BASE: &str = "base";

/// Field with the config's own name.
const NAME: &str = "preset";

/// Tables of which a config chooses one entry; a different choice replaces the base's table entirely.
const CHOICES: [&str; 5] = ["grammar", CAMERA, "pull_strength", "twist_strength", "spur_strength"];

/// Table that chooses a camera.
const CAMERA: &str = "camera";

/// Bases of a part of a world: their names and TOML texts.
type Bases = &'static [(&'static str, &'static str)];

/// Parts of a world that come with the crate: path of their table, and its bases.
const PARTS: [(&[&str], Bases); 6] = [
    (&["fruit", "stem"], &[("measured", include_str!("../configs/stem/measured.toml"))]),
    (&["fruit", "cluster"], &[("measured", include_str!("../configs/cluster/measured.toml"))]),
    (&["wind"], &[("measured", include_str!("../configs/wind/measured.toml"))]),
    (&["sensing"], &[("ideal", include_str!("../configs/sensing/ideal.toml"))]),
    (&["light"], &[("day", include_str!("../configs/light/day.toml"))]),
    (&["fault"], &[("standard", include_str!("../configs/fault/standard.toml"))]),
];

/// Completes the parts of a world from the bases that they name.
fn complete_parts(file: &str, table: &mut toml::Table) -> Result<(), ConfigError> {
    for (path, bases) in PARTS {
        let [above @ .., part] = path else { continue };
        let within = above.iter().try_fold(&mut *table, |table, step| table.get_mut(*step)?.as_table_mut());
        let Some(toml::Value::Table(given)) = within.and_then(|table| table.get_mut(*part)) else {
            continue;
        };
        let toml_of = |name: &str| {
            let base = bases.iter().find(|(known, _)| *known == name).map(|(_, toml)| *toml);
            let known: Vec<&str> = bases.iter().map(|(known, _)| *known).collect();
            base.ok_or_else(|| format!("no {part} '{name}'; the {part}s are: {}", known.join(", ")))
        };
        *given = quantity::with_base(file, std::mem::take(given), &toml_of, &CHOICES)
            .map_err(|error| ConfigError { field: format!("{}.{}", path.join("."), error.field), ..error })?;
    }
    Ok(())
}

/// Reads a spec; fields that it omits have the base's values.
pub(crate) fn read(file: &str, text: &str) -> Result<Spec, ConfigError> {
    complete(file, with_base(file, text)?)
}

/// The spec with a config's changes laid over it.
pub(crate) fn overlaid(spec: &Spec, file: &str, changes: toml::Table) -> Result<Spec, ConfigError> {
    let error = |problem: String| ConfigError { file: file.to_owned(), field: ".".to_owned(), problem };
    let mut table = toml::Table::try_from(spec).map_err(|e| error(e.to_string()))?;
    overlay(&mut table, changes, &CHOICES);
    complete(file, table)
}

/// Completes the parts that name a camera or a base of their own, and reads the spec.
fn complete(file: &str, mut table: toml::Table) -> Result<Spec, ConfigError> {
    if let Some(toml::Value::Table(cameras)) = table.get_mut(CAMERA) {
        camera::complete(cameras)?;
    }
    complete_parts(file, &mut table)?;
    from_table(file, table)
}

/// Table of a config with all fields of its base.
fn with_base(file: &str, text: &str) -> Result<toml::Table, ConfigError> {
    let mut table = parse(file, text)?;
    let Some(base) = table.remove(BASE) else { return Ok(table) };
    let named =
        base.as_str().ok_or_else(|| "the name of a preset is text".to_owned()).and_then(Preset::from_str);
    let preset =
        named.map_err(|problem| ConfigError { file: file.to_owned(), field: BASE.to_owned(), problem })?;
    let mut whole = with_base(preset.name(), preset.toml())?;
    // A changed config needs its own name.
    whole.remove(NAME);
    overlay(&mut whole, table, &CHOICES);
    Ok(whole)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::camera::CameraSpec;
    use crate::tree::Grammar;

    #[test]
    fn every_preset_reads_and_knows_its_name() {
        for &preset in Preset::ALL {
            let spec = read(preset.name(), preset.toml()).unwrap();
            assert_eq!(spec.preset, preset.name());
            assert_eq!(preset.name().parse(), Ok(preset));
        }
        let e = "lemon".parse::<Preset>().unwrap_err();
        assert!(e.contains("'lemon'") && e.contains("paper, ternary"), "{e}");
    }

    #[test]
    fn a_config_holds_the_differences_from_its_base() {
        let text = "preset = 'mine'\nbase = 'paper'\n[wood]\nrigid = true\n\
                    density = { value = 900, range = [780, 1000], unit = 'kg/m3', source = 'x' }";
        let mine = read("mine.toml", text).unwrap();
        let paper = Spec::paper();
        assert_eq!(mine.wood.density.si(), 900.0);
        assert_eq!(mine.wood.density.source(), "x");
        let wood =
            crate::wood::WoodSpec { density: paper.wood.density.clone(), rigid: false, ..mine.wood.clone() };
        assert!(mine.wood.rigid);
        assert_eq!(Spec { preset: paper.preset.clone(), wood, ..mine }, paper);
    }

    #[test]
    fn another_grammar_replaces_the_bases() {
        let ternary = Spec::preset(Preset::Ternary);
        assert!(matches!(ternary.tree.grammar, Grammar::Ternary(_)));
        // Omitted parameters of the same grammar keep their values.
        let text = "preset = 'two'\nbase = 'ternary'\n[tree.grammar.ternary]\n\
                    derivations = { value = 2, range = [0, 8], unit = 'derivations', source = 'x' }";
        let Grammar::Ternary(two) = read("x", text).unwrap().tree.grammar else { panic!("another grammar") };
        let Grammar::Ternary(four) = ternary.tree.grammar else { panic!("another grammar") };
        assert_eq!(two.derivations.get(), 2);
        assert_eq!(crate::tree::TernarySpec { derivations: four.derivations.clone(), ..two }, four);
    }

    #[test]
    fn a_config_chooses_a_camera_and_changes_its_figures() {
        for (name, _) in CameraSpec::FILES {
            let text = format!("preset = 'x'\nbase = 'paper'\n[camera.{name}]");
            let camera = read("x", &text).unwrap().camera;
            assert_eq!((camera.name(), &camera), (*name, &CameraSpec::named(name).unwrap()));
        }
        let text = "preset = 'x'\nbase = 'paper'\n[camera.paper.view]\n\
                    width = { value = 64, range = [1, 8192], unit = 'px', source = 'x' }";
        let camera = read("x", text).unwrap().camera;
        assert_eq!((camera.view().width.get(), camera.view().height.get()), (64, 144));
        let e = CameraSpec::named("eye").unwrap_err();
        assert!(e.starts_with("no camera 'eye'; the cameras are: ideal, paper"), "{e}");
        let e = CameraSpec::from_toml("c.toml", "[ideal]\nrange = 3").unwrap_err().to_string();
        assert!(e.starts_with("c.toml: ideal.range"), "{e}");
        for (view, field) in [
            ("width = { value = 0, range = [0, 9], unit = 'px', source = 'x' }", "width: 0 "),
            ("height = { value = 9000, range = [0, 9999], unit = 'px', source = 'x' }", "height: 9000 "),
            (
                "vertical_fov = { value = 200, range = [0, 360], unit = 'deg', source = 'x' }",
                "vertical_fov: 200 ",
            ),
            (
                "horizontal_fov = { value = 0, range = [0, 360], unit = 'deg', source = 'x' }",
                "horizontal_fov: 0 ",
            ),
        ] {
            let e =
                CameraSpec::from_toml("c.toml", &format!("[ideal.view]\n{view}")).unwrap_err().to_string();
            assert!(e.starts_with(&format!("c.toml: ideal.view.{field}")), "{e}");
        }
        let negative = "[d435i]\nbaseline = { value = -50, range = [-99, 99], unit = 'mm', source = 'x' }";
        let e = CameraSpec::from_toml("c.toml", negative).unwrap_err().to_string();
        assert_eq!(e, "c.toml: d435i.baseline: -50 is not greater than 0");
        let e = CameraSpec::from_toml("c.toml", "[eye]").unwrap_err().to_string();
        assert!(e.starts_with("c.toml: ") && e.contains("`eye`, expected one of `ideal`"), "{e}");
    }

    #[test]
    fn changes_are_laid_over_a_spec_and_change_nothing_else() {
        let paper = Spec::paper();
        let laid = |text: &str| paper.overlaid("x.toml", parse("x.toml", text).unwrap());
        assert_eq!(laid("").unwrap(), paper);
        let windy = laid("[wind]\nbase = 'measured'").unwrap();
        assert_eq!(windy.wind, Spec::preset(Preset::Calibrated).wind);
        assert_eq!(Spec { wind: None, ..windy.clone() }, paper);
        // A part that is there already stays as it is.
        assert_eq!(windy.overlaid("x.toml", parse("x", "[wind]\nbase = 'measured'").unwrap()), Ok(windy));
        let e = laid("[wind]\nbase = 'gale'").unwrap_err().to_string();
        assert_eq!(e, "x.toml: wind.base: no wind 'gale'; the winds are: measured");
        let e = laid("[wood]\nweight = 1").unwrap_err().to_string();
        assert!(e.starts_with("x.toml: wood.weight"), "{e}");
        let e = laid("[sensing]\nbase = 'ideal'\n[sensing.odometry]\nslip = 1").unwrap_err().to_string();
        assert!(e.starts_with("x.toml: sensing.odometry.slip"), "{e}");
        let long = "[sensing]\nbase = 'ideal'\ncamera_delay = { value = 11, range = [0, 99], unit = 's', source = 'x' }";
        let e = laid(long).unwrap_err().to_string();
        assert_eq!(e, "x.toml: sensing.camera_delay: 11 is outside the range [0, 10] s of a delay");
        let low = "[light]\nbase = 'day'\nsun_elevation = { value = 8, range = [0, 90], unit = 'deg', source = 'x' }";
        let light = laid(low).unwrap().light.unwrap();
        assert_eq!((light.sun_elevation.value(), light.sun_strength.value()), (8.0, 1.0));
        let e = laid("[light]\nbase = 'night'").unwrap_err().to_string();
        assert_eq!(e, "x.toml: light.base: no light 'night'; the lights are: day");
        let e = laid(&low.replace("value = 8", "value = 95")).unwrap_err().to_string();
        assert!(e.starts_with("x.toml: light.sun_elevation"), "{e}");
        let fault = |rest: &str| laid(&format!("[fault]\nbase = 'standard'\n{rest}"));
        let dead = fault("kind = 'camera_dead'").unwrap().fault.unwrap();
        assert!(dead.lasts(dead.from.si()) && !dead.lasts(dead.until.si()));
        assert!(!fault("").unwrap().fault.unwrap().lasts(dead.from.si()), "nothing fails");
        let e = fault("kind = 'camera_stolen'").unwrap_err().to_string();
        assert!(e.starts_with("x.toml: fault.kind") && e.contains("`camera_dead`"), "{e}");
        let e = fault("until = { value = 3, range = [0, 36000], unit = 's', source = 'x' }")
            .unwrap_err()
            .to_string();
        assert_eq!(e, "x.toml: fault: until 3 s is before from 15 s");
        let e = fault("delay = { value = 11, range = [0, 99], unit = 's', source = 'x' }")
            .unwrap_err()
            .to_string();
        assert_eq!(e, "x.toml: fault.delay: 11 is outside the range [0, 10] s of a delay");
    }

    #[test]
    fn errors_name_the_field() {
        let error = |text: &str| read("a.toml", text).unwrap_err().to_string();
        assert!(
            error("base = 'lemon'").starts_with("a.toml: base: no preset 'lemon'; the presets are: paper")
        );
        assert_eq!(error("base = 3"), "a.toml: base: the name of a preset is text");
        let e = error("base = 'paper'\n[tree.grammar.quaternary]\nn = 4");
        assert!(e.starts_with("a.toml: tree.grammar") && e.contains("quaternary"), "{e}");
        let e = error(
            "base = 'paper'\n[tree.grammar.central-leader]\nlimbs = { low = 3, high = 60, range = [1, 24], unit = 'limbs', source = 'x' }",
        );
        assert!(e.starts_with("a.toml: tree.grammar.central-leader.limbs: 60 is outside"), "{e}");
        let e = error("base = 'paper'");
        assert!(e.contains("missing field `preset`"), "{e}");
        let e = error("base = 'paper'\n[wood]\nweight = 1");
        assert!(e.starts_with("a.toml: wood.weight"), "{e}");
    }
}
