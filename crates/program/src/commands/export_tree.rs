//! `orchard export-tree`: writes a tree in a file format of other tools.

use std::path::{Path, PathBuf};

use anyhow::Context;
use clap::ValueEnum;
use orchard_bench::store::write_bytes;
#[cfg(feature = "gltf")]
use orchard_exchange::gltf;
use orchard_exchange::{Wood, json, mtg, urdf, usd};
use orchard_scenario::TreeFile;
use orchard_spec::Spec;

use crate::args::{IndexArgs, Part, ScenarioArgs};
use crate::bare_tree::BareTree;
use crate::failure::Failure;
use crate::program::Program;

/// Writes a tree in a file format of other tools.
#[derive(clap::Args)]
#[command(
    after_help = "docs/exchange.md lists the content of each format. The MuJoCo model has the same equations as the simulator, with fruit;\n\
                  drag, the tether's reaction cap, rupture and contacts are left out (docs/computation/judge.md).\n\
                  With --tree FILE a digitised tree replaces the grown one; seed and tree index then only choose its leaves and fruit.\n\n\
                  Examples:\n  orchard export-tree --seed 20250704 --out tree.xml\n  \
                  orchard export-tree --seed 20250704 --format gltf --out tree.glb\n  \
                  orchard export-tree --tree measured.mtg --format mjcf --out tree.xml"
)]
pub struct Args {
    /// Seed of the population [default with a digitised tree: 0]
    #[arg(long, value_name = "S")]
    seed: Option<u64>,
    #[command(flatten)]
    index: IndexArgs,
    #[command(flatten)]
    scenario: ScenarioArgs,
    /// Format of the file
    #[arg(long, value_enum, default_value_t = Format::Mjcf)]
    format: Format,
    /// The file to write
    #[arg(long, value_name = "FILE")]
    out: PathBuf,
}

/// A file format for trees.
#[derive(Debug, Clone, Copy, ValueEnum)]
pub enum Format {
    /// MuJoCo model with springs and fruit
    Mjcf,
    /// Links and joints, without springs
    Urdf,
    /// Universal Scene Description as text, with rigid bodies and springs
    Usd,
    /// Binary glTF 2.0, the wood's shape
    Gltf,
    /// Multiscale tree graph
    Mtg,
    /// The skeleton without loss
    Json,
}

/// Time step of an MJCF file \[s\].
const TIME_STEP: f64 = 1e-3;

impl Format {
    /// Usual file extension.
    pub fn extension(self) -> &'static str {
        match self {
            Self::Mjcf => "xml",
            Self::Urdf => "urdf",
            Self::Usd => "usda",
            Self::Gltf => "glb",
            Self::Mtg => "mtg",
            Self::Json => "json",
        }
    }

    /// The file of a tree.
    pub fn write(self, tree: &BareTree) -> anyhow::Result<Vec<u8>> {
        let skeleton = &tree.skeleton;
        let wood = || Wood::new(skeleton, &tree.spec.wood);
        Ok(match self {
            Self::Mjcf => tree.mjcf(TIME_STEP)?.into_bytes(),
            Self::Urdf => urdf::write(&tree.name, &wood()?)?.into_bytes(),
            Self::Usd => usd::write(&wood()?).into_bytes(),
            #[cfg(feature = "gltf")]
            Self::Gltf => gltf::write(&wood()?)?,
            #[cfg(not(feature = "gltf"))]
            Self::Gltf => anyhow::bail!("--format gltf: this program was built without the feature `gltf`"),
            Self::Mtg => mtg::write(skeleton).into_bytes(),
            Self::Json => json::write(skeleton).into_bytes(),
        })
    }
}

pub fn run(args: &Args, program: &Program) -> Result<(), Failure> {
    let no_robot = "the file holds a tree without a robot";
    args.scenario.refuse(&[Part::Robot, Part::Camera, Part::Detector, Part::Controller], no_robot)?;
    let (index, scenario) = args.index.of(&args.scenario);
    let scenario = scenario.resolve(program)?;
    let spec = scenario.spec();
    let tree = match (scenario.digitised_tree(), args.seed) {
        (Some(file), seed) => import(spec, file, seed.unwrap_or(0), index)?,
        (None, Some(seed)) => BareTree::new(spec, seed, index).map_err(bad_tree)?,
        (None, None) => {
            return Err(Failure::BadInput("--seed S is missing: it is needed to grow a tree".to_owned()));
        }
    };
    let bytes = args.format.write(&tree)?;
    write_bytes(&args.out, &bytes).map_err(|e| Failure::of_file(&e))?;
    note!("{}: {} links, {} fruit", args.out.display(), tree.model.bodies().len(), tree.model.points().len());
    Ok(())
}

/// Error for a tree that cannot be built: trees depend on the user's input only, so it is bad input.
fn bad_tree(e: anyhow::Error) -> Failure {
    Failure::BadInput(format!("{e:#}"))
}

/// A digitised tree with the name of its file.
fn import(spec: &Spec, file: &TreeFile, seed: u64, world: u32) -> Result<BareTree, Failure> {
    let skeleton = file.skeleton(spec, seed, world);
    let stem = Path::new(file.name()).file_stem();
    let name = stem.map_or("tree".into(), |stem| stem.to_string_lossy().into_owned());
    BareTree::of_skeleton(spec, skeleton, name, seed, world).context("the imported tree").map_err(bad_tree)
}
