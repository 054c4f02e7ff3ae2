//! Parses entity codes such as `/P1/I2`, `+A2/I4`, `<I3<<I7`.

/// Relation of an entity to the one before it.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum Edge {
    /// `/`: a part of it.
    Part,
    /// `<`: continues it.
    Successor,
    /// `+`: branches off it.
    Branch,
}

/// Entities that one label stands for.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Series {
    /// The one with its index.
    One,
    /// `<<` and `++`: those from the index after the last label's up to its own, which alone has the values of the line.
    LastHasValues,
    /// `<.<` and `+.+`: the same, and all have the values of the line.
    AllHaveValues,
}

/// One label of a code.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Step<'a> {
    /// Relation to the entity before it.
    pub edge: Edge,
    /// Entities it stands for.
    pub series: Series,
    /// Name of the class.
    pub class: &'a str,
    /// Index, if given.
    pub index: Option<usize>,
}

/// Parses a code without its leading `^` or `(alias)`.
pub fn steps(mut code: &str) -> Result<Vec<Step<'_>>, String> {
    let whole = code;
    let mut steps = Vec::new();
    while let Some(sign) = code.chars().next() {
        let edge = match sign {
            '/' => Edge::Part,
            '<' => Edge::Successor,
            '+' => Edge::Branch,
            _ => return Err(format!("code {whole:?}: expected '/', '<' or '+' before {code:?}")),
        };
        code = &code[1..];
        let repeated = |mark: &str| code.strip_prefix(mark).and_then(|rest| rest.strip_prefix(sign));
        let series = match (repeated(""), repeated(".")) {
            (Some(rest), _) if edge != Edge::Part => {
                code = rest;
                Series::LastHasValues
            }
            (_, Some(rest)) if edge != Edge::Part => {
                code = rest;
                Series::AllHaveValues
            }
            _ => Series::One,
        };
        let (label, rest) = code.split_at(code.find(['/', '<', '+']).unwrap_or(code.len()));
        code = rest;
        let (class, index) = label.split_at(label.find(|c: char| c.is_ascii_digit()).unwrap_or(label.len()));
        if class.is_empty() {
            return Err(format!("code {whole:?}: a class must follow '{sign}'"));
        }
        let index = match index {
            "" => None,
            index => Some(index.parse().map_err(|e| format!("code {whole:?}: index {index:?}: {e}"))?),
        };
        steps.push(Step { edge, series, class, index });
    }
    if steps.is_empty() { Err("an entity code is empty".into()) } else { Ok(steps) }
}
