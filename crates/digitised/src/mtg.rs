//! Reads and writes wood as a multiscale tree graph (MTG), the text format of digitised plants.
//!
//! The writer uses two scales: the plant `P` and its internodes `I`. An internode has the position of its tip and its diameter;
//! its base is its parent's tip.
//! Grammar: C. Godin, Y. Caraglio, "A multiscale model of plant topological structures" (1998), as AMAPmod codes it.

mod code;
mod graph;
mod head;
mod parts;
mod read;
mod shape;
mod thickness;
mod unit;

use std::fmt::Write;

use orchard_quantity::{Quantity, from_toml};
use orchard_treegen::{Segment, Skeleton};
use serde::Deserialize;

pub use read::{Choice, Import, read, read_with};
pub use unit::{Measure, Units};

/// Figures of the reader for what files leave open: `configs/import/mtg.toml`.
#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields)]
struct Figures {
    shortest: Quantity,
    tallest: Quantity,
    thickest: Quantity,
    tip_diameter: Quantity,
    pipe_exponent: Quantity,
    insertion_angle: Quantity,
    divergence: Quantity,
}

impl Figures {
    fn embedded() -> Self {
        let text = include_str!("../configs/import/mtg.toml");
        from_toml("import/mtg.toml", text).unwrap_or_else(|e| unreachable!("embedded file: {e}"))
    }
}

/// Names and types of the feature columns, which follow the codes.
const FEATURES: [(&str, &str); 5] =
    [("XX", "REAL"), ("YY", "REAL"), ("ZZ", "REAL"), ("TopDia", "REAL"), ("Order", "INT")];

/// Writes the wood of a skeleton. Internode `I<n>` is segment n - 1. Fruit sites, leaves and the segments' roll about
/// their own axes are lost.
pub fn write(skeleton: &Skeleton) -> String {
    let lines = lines(skeleton);
    // One column for the plant and the trunk, one more for each branching, and at least one.
    let columns = 1 + lines.iter().map(|line| line.column).max().unwrap_or(0);
    let mut text = HEAD.to_owned();
    let mut put = |line: std::fmt::Arguments| {
        text.write_fmt(line).unwrap_or_else(|e| unreachable!("a string takes all text: {e}"));
    };
    for (name, kind) in FEATURES {
        put(format_args!("{name}\t{kind}\n"));
    }
    put(format_args!("\nMTG:\nENTITY-CODE{}", "\t".repeat(columns - 1)));
    for (name, _) in FEATURES {
        put(format_args!("\t{name}"));
    }
    let base = "\t".repeat(columns);
    put(format_args!("\n/P1{base}0.0\t0.0\t0.0\n"));
    for Line { segment, column, edge } in lines {
        let Segment { radius, order, .. } = skeleton.segments[segment];
        let tip = skeleton.segments[segment].p_tip_world();
        let (before, after) = ("\t".repeat(column), "\t".repeat(columns - column));
        put(format_args!("{before}{edge}I{}{after}", segment + 1));
        put(format_args!("{:?}\t{:?}\t{:?}\t{:?}\t{order}\n", tip.x, tip.y, tip.z, 2.0 * radius));
    }
    text
}

const HEAD: &str = "# unit: m
CODE:\tFORM-A

CLASSES:
SYMBOL\tSCALE\tDECOMPOSITION\tINDEXATION\tDEFINITION
$\t0\tFREE\tFREE\tIMPLICIT
P\t1\tFREE\tFREE\tEXPLICIT
I\t2\tFREE\tFREE\tEXPLICIT

DESCRIPTION:
LEFT\tRIGHT\tRELTYPE\tMAX
I\tI\t+\t?
I\tI\t<\t?

FEATURES:
NAME\tTYPE
";

struct Line {
    segment: usize,
    column: usize,
    edge: &'static str,
}

/// Orders the segments axis by axis: the branches of a segment come between it and its successor, one column further right.
fn lines(skeleton: &Skeleton) -> Vec<Line> {
    let children = skeleton.children();
    let roots = (0..skeleton.segments.len()).rev().filter(|&i| skeleton.segments[i].parent.is_none());
    let mut open: Vec<Line> = roots.map(|segment| Line { segment, column: 0, edge: "^/" }).collect();
    let mut lines = Vec::with_capacity(skeleton.segments.len());
    while let Some(line) = open.pop() {
        let order = |i: usize| skeleton.segments[i].order;
        let branches = &children[line.segment];
        let successor = branches.iter().copied().find(|&i| order(i) == order(line.segment));
        if let Some(segment) = successor {
            open.push(Line { segment, column: line.column, edge: "^<" });
        }
        for &segment in branches.iter().rev().filter(|&&i| Some(i) != successor) {
            open.push(Line { segment, column: line.column + 1, edge: "+" });
        }
        lines.push(line);
    }
    lines
}
