//! Parses entity codes such as `^/P1/I2`, `+A2/I4`, `^<I7`.

/// Relation of an entity to the one before it.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Edge {
    /// `/`: a part of it.
    Part,
    /// `<`: continues it.
    Successor,
    /// `+`: branches off it.
    Branch,
}

/// One entity of a code.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Entity<'a> {
    /// Relation to the entity before it.
    pub edge: Edge,
    /// Name of the class.
    pub class: &'a str,
    /// Index, if given.
    pub index: Option<usize>,
}

/// Parses a code without its leading `^`.
pub fn entities(mut code: &str) -> Result<Vec<Entity<'_>>, String> {
    let whole = code;
    let mut entities = Vec::new();
    while let Some(sign) = code.chars().next() {
        let edge = match sign {
            '/' => Edge::Part,
            '<' => Edge::Successor,
            '+' => Edge::Branch,
            _ => return Err(format!("code {whole:?}: expected '/', '<' or '+' before {code:?}")),
        };
        code = &code[1..];
        let end = code.find(['/', '<', '+']).unwrap_or(code.len());
        let (name, rest) = code.split_at(end);
        code = rest;
        let digits = name.find(|c: char| c.is_ascii_digit()).unwrap_or(name.len());
        let (class, index) = name.split_at(digits);
        if class.is_empty() {
            return Err(format!(
                "code {whole:?}: a class must follow '{sign}'; series such as '<<' cannot be read"
            ));
        }
        let index = match index {
            "" => None,
            index => Some(index.parse().map_err(|e| format!("code {whole:?}: index {index:?}: {e}"))?),
        };
        entities.push(Entity { edge, class, index });
    }
    if entities.is_empty() { Err("an entity code is empty".into()) } else { Ok(entities) }
}
