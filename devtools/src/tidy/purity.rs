//! Checks that crates from `quantity` to `learned`, `play`, `report`, `web` and `web-batch` open no files and read no clock.
//!
//! The source is read as Rust tokens, so that comments and strings do not count and
//! `use std::{fs, time::Instant}` does.

use std::path::Path;

use anyhow::Context;
use proc_macro2::{Delimiter, TokenStream, TokenTree};

use super::LAYERS;
use crate::workspace::{files, relative};

/// The last of the lowest crates under the rule, and more crates.
const LAST: &str = "learned";
const ABOVE: [&str; 4] = ["play", "report", "web", "web-batch"];

/// Modules of the standard library that reach outside the process or to a clock.
const BANNED: [&str; 5] = ["fs", "net", "time", "env", "process"];

/// Reads the sources of every crate under the rule.
pub fn check(root: &Path) -> anyhow::Result<Vec<String>> {
    let mut errors = Vec::new();
    let last = LAYERS.iter().position(|l| *l == LAST).unwrap_or(LAYERS.len() - 1);
    for name in LAYERS[..=last].iter().chain(&ABOVE) {
        for path in files(&root.join("crates").join(name).join("src"), &["rs"])? {
            let text = std::fs::read_to_string(&path)?;
            let tokens: TokenStream = text
                .parse()
                .map_err(|e| anyhow::anyhow!("{e}"))
                .with_context(|| format!("{} is not valid Rust", path.display()))?;
            let mut found = Vec::new();
            scan(tokens, &mut found);
            for (line, module) in found {
                errors.push(format!(
                    "{}:{line}: std::{module} in crate {name}, which opens no files and reads no clock",
                    relative(root, &path)
                ));
            }
        }
    }
    Ok(errors)
}

/// Line and module of every banned path in a stream of tokens.
fn scan(tokens: TokenStream, found: &mut Vec<(usize, String)>) {
    let tokens: Vec<TokenTree> = tokens.into_iter().collect();
    for (i, token) in tokens.iter().enumerate() {
        match token {
            TokenTree::Group(group) => scan(group.stream(), found),
            TokenTree::Ident(ident) if *ident == "std" && separated(&tokens, i) => match tokens.get(i + 3) {
                Some(TokenTree::Ident(module)) => note(module, found),
                Some(TokenTree::Group(group)) if group.delimiter() == Delimiter::Brace => {
                    heads(group.stream(), found);
                }
                _ => {}
            },
            _ => {}
        }
    }
}

/// The first identifiers of the items of a use list.
fn heads(list: TokenStream, found: &mut Vec<(usize, String)>) {
    let mut at_head = true;
    for token in list {
        match token {
            TokenTree::Ident(module) if at_head => {
                note(&module, found);
                at_head = false;
            }
            TokenTree::Punct(p) if p.as_char() == ',' => at_head = true,
            _ => at_head = false,
        }
    }
}

fn note(module: &proc_macro2::Ident, found: &mut Vec<(usize, String)>) {
    let name = module.to_string();
    if BANNED.contains(&name.as_str()) {
        found.push((module.span().start().line, name));
    }
}

/// True if `::` follows token `i`.
fn separated(tokens: &[TokenTree], i: usize) -> bool {
    let colon = |t: Option<&TokenTree>| matches!(t, Some(TokenTree::Punct(p)) if p.as_char() == ':');
    colon(tokens.get(i + 1)) && colon(tokens.get(i + 2))
}

#[cfg(test)]
mod tests {
    use super::super::fixture::folder;
    use super::*;

    fn check_source(krate: &str, text: &str) -> Vec<String> {
        let folder = folder(&[(&format!("crates/{krate}/src/a/b.rs"), text)]);
        check(folder.path()).unwrap()
    }

    #[test]
    fn banned_paths_are_found_however_they_are_written() {
        for (text, line, module) in [
            ("use std::fs;", 1, "fs"),
            ("\nfn f() {\n    let t = std::time::Instant::now();\n}", 3, "time"),
            ("use std::{collections::BTreeMap, net::TcpStream};", 1, "net"),
            ("fn f() { g!(\"{}\", ::std::env::args()); }", 1, "env"),
        ] {
            let errors = check_source("geometry", text);
            let expected = format!(
                "crates/geometry/src/a/b.rs:{line}: std::{module} in crate geometry, which opens no files and reads no clock"
            );
            assert_eq!(errors, [expected], "{text}");
        }
    }

    #[test]
    fn comments_strings_and_other_modules_do_not_count() {
        let text = "// std::fs\n/// std::time\nuse std::{fmt, collections::{btree_map, BTreeMap}};\n\
                    const A: &str = \"std::fs\";\nmod time { pub struct Instant; }";
        assert_eq!(check_source("picker", text), Vec::<String>::new());
    }

    #[test]
    fn crates_above_may_open_files() {
        assert_eq!(check_source("bench", "use std::fs;"), Vec::<String>::new());
        for above in ABOVE {
            assert_eq!(check_source(above, "use std::fs;").len(), 1);
        }
    }
}
