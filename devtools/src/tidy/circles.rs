//! Finds circular imports between the files of a crate.
//!
//! Files that import each other, directly or indirectly, can only be understood, tested and moved together. A module and its submodules
//! count as one: a parent may re-export items of its children, and children may use items of their parent.

use std::collections::{BTreeMap, BTreeSet};
use std::path::Path;

use anyhow::Context;
use syn::visit::{self, Visit};

use crate::workspace;

/// The circular imports of all crates, one line each.
pub fn check(root: &Path) -> anyhow::Result<Vec<String>> {
    let mut errors = Vec::new();
    let crates = std::fs::read_dir(root.join("crates")).context("crates")?;
    let mut folders: Vec<_> =
        crates.map(|entry| Ok(entry?.path().join("src"))).collect::<anyhow::Result<_>>()?;
    folders.push(root.join("devtools/src"));
    folders.sort();
    for folder in folders {
        let graph = graph(&folder)?;
        for circle in circles(&graph) {
            let name = workspace::relative(root, &folder);
            errors.push(format!("{name}: circular import: {}", circle.join(", ")));
        }
    }
    Ok(errors)
}

/// A module's path within its crate.
type Module = Vec<String>;
/// Modules, each with the modules that it uses.
type Graph = BTreeMap<Module, BTreeSet<Module>>;

fn graph(folder: &Path) -> anyhow::Result<Graph> {
    let mut texts = BTreeMap::new();
    for file in workspace::files(folder, &["rs"])? {
        let relative = workspace::relative(folder, &file);
        let text = std::fs::read_to_string(&file).with_context(|| relative.clone())?;
        texts.insert(module(&relative), text);
    }
    let modules: BTreeSet<Module> = texts.keys().cloned().collect();
    let exports = texts.get(&Module::new()).map(|root| exports(root)).transpose()?.unwrap_or_default();
    texts
        .into_iter()
        .map(|(own, text)| {
            let file = syn::parse_file(&text).with_context(|| own.join("::"))?;
            let mut uses = Uses { own: &own, depth: 0, paths: Vec::new() };
            uses.visit_file(&file);
            let used = uses.paths.iter().filter_map(|path| {
                // A name of the crate's root is that of the module that it comes from.
                let origin = path.first().and_then(|name| exports.get(name));
                file_of(path, &modules).or_else(|| file_of(origin?, &modules))
            });
            let apart = |other: &Module| !other.starts_with(&own) && !own.starts_with(other);
            let used = used.filter(apart).collect();
            Ok((own, used))
        })
        .collect()
}

/// Names that the root of a crate exports again, each with its path in the crate.
fn exports(root: &str) -> anyhow::Result<BTreeMap<String, Vec<String>>> {
    let mut exports = BTreeMap::new();
    for item in syn::parse_file(root).context("lib.rs")?.items {
        if let syn::Item::Use(item) = item {
            leaves(&mut Vec::new(), &item.tree, &mut exports);
        }
    }
    Ok(exports)
}

fn leaves(before: &mut Vec<String>, tree: &syn::UseTree, exports: &mut BTreeMap<String, Vec<String>>) {
    match tree {
        syn::UseTree::Path(path) => {
            before.push(path.ident.to_string());
            leaves(before, &path.tree, exports);
            before.pop();
        }
        syn::UseTree::Group(group) => group.items.iter().for_each(|item| leaves(before, item, exports)),
        syn::UseTree::Name(name) => export(before, &name.ident, &name.ident, exports),
        syn::UseTree::Rename(name) => export(before, &name.ident, &name.rename, exports),
        syn::UseTree::Glob(_) => {}
    }
}

fn export(
    before: &[String],
    own: &syn::Ident,
    name: &syn::Ident,
    exports: &mut BTreeMap<String, Vec<String>>,
) {
    let path = before.iter().filter(|part| !["crate", "self"].contains(&part.as_str())).cloned();
    exports.insert(name.to_string(), path.chain([own.to_string()]).collect());
}

/// The module that a file holds.
fn module(file: &str) -> Module {
    let stem = file.trim_end_matches(".rs");
    let parts = stem.split('/').filter(|part| !["lib", "main", "mod"].contains(part));
    parts.map(str::to_owned).collect()
}

/// The file of a path: the deepest module on it.
fn file_of(path: &[String], modules: &BTreeSet<Module>) -> Option<Module> {
    (1..=path.len()).rev().map(|n| path[..n].to_vec()).find(|module| modules.contains(module))
}

/// Collects the paths of a file that begin at its crate, from the crate's root.
struct Uses<'a> {
    own: &'a Module,
    /// Number of inline modules around the current position.
    depth: usize,
    paths: Vec<Vec<String>>,
}

impl Uses<'_> {
    fn add(&mut self, path: &[String]) {
        let ups = path.iter().take_while(|part| *part == "super").count();
        match path.first().map(String::as_str) {
            Some("crate") => self.paths.push(path[1..].to_vec()),
            // Modules within the file are the file's own.
            Some("super") if ups > self.depth => {
                let kept = self.own.len().saturating_sub(ups - self.depth);
                self.paths.push(self.own[..kept].iter().chain(&path[ups..]).cloned().collect());
            }
            _ => {}
        }
    }

    fn tree(&mut self, before: &mut Vec<String>, tree: &syn::UseTree) {
        match tree {
            syn::UseTree::Path(path) => {
                before.push(path.ident.to_string());
                self.tree(before, &path.tree);
                before.pop();
            }
            syn::UseTree::Group(group) => group.items.iter().for_each(|item| self.tree(before, item)),
            syn::UseTree::Name(name) => self.leaf(before, name.ident.to_string()),
            syn::UseTree::Rename(name) => self.leaf(before, name.ident.to_string()),
            syn::UseTree::Glob(_) => self.add(before),
        }
    }

    fn leaf(&mut self, before: &[String], name: String) {
        let path: Vec<String> = before.iter().cloned().chain([name]).collect();
        self.add(&path);
    }
}

impl<'ast> Visit<'ast> for Uses<'_> {
    fn visit_item_use(&mut self, item: &'ast syn::ItemUse) {
        self.tree(&mut Vec::new(), &item.tree);
    }

    fn visit_path(&mut self, path: &'ast syn::Path) {
        let parts: Vec<String> = path.segments.iter().map(|segment| segment.ident.to_string()).collect();
        self.add(&parts);
        visit::visit_path(self, path);
    }

    fn visit_item_mod(&mut self, item: &'ast syn::ItemMod) {
        // Tests may compare with anything.
        let is_test = item.attrs.iter().any(|attribute| {
            attribute.path().is_ident("cfg")
                && attribute.parse_args::<syn::Ident>().is_ok_and(|what| what == "test")
        });
        if !is_test {
            self.depth += 1;
            visit::visit_item_mod(self, item);
            self.depth -= 1;
        }
    }
}

/// Groups of modules that reach each other, of two and more, sorted.
fn circles(graph: &Graph) -> Vec<Vec<String>> {
    let reach: BTreeMap<&Module, BTreeSet<&Module>> =
        graph.keys().map(|module| (module, reached(graph, module))).collect();
    let mut circles = BTreeSet::new();
    for (module, reached) in &reach {
        let circle: BTreeSet<String> = reached
            .iter()
            .filter(|other| reach.get(**other).is_some_and(|back| back.contains(module)))
            .map(|module| module.join("::"))
            .collect();
        if circle.len() > 1 {
            circles.insert(circle.into_iter().collect::<Vec<_>>());
        }
    }
    circles.into_iter().collect()
}

fn reached<'a>(graph: &'a Graph, from: &'a Module) -> BTreeSet<&'a Module> {
    let mut reached = BTreeSet::new();
    let mut open = vec![from];
    while let Some(module) = open.pop() {
        for used in graph.get(module).into_iter().flatten() {
            if reached.insert(used) {
                open.push(used);
            }
        }
    }
    reached
}

#[cfg(test)]
mod tests {
    use super::super::fixture::folder;
    use super::*;

    #[test]
    fn circles_are_found_and_families_are_none() {
        let crate_of = |b: &str| {
            folder(&[
                ("crates/x/src/lib.rs", "mod a; mod b; pub use a::A;"),
                ("crates/x/src/a.rs", "mod inner; use crate::b::B; pub use inner::C; pub struct A(B);"),
                ("crates/x/src/a/inner.rs", "use super::A; pub struct C;"),
                ("crates/x/src/b.rs", b),
                ("devtools/src/main.rs", "fn main() {}"),
            ])
        };
        let circle = ["crates/x/src: circular import: a, b"];
        assert_eq!(check(crate_of("pub struct B; fn f() { crate::a::g() }").path()).unwrap(), circle);
        assert_eq!(check(crate_of("use super::a::{A}; pub struct B;").path()).unwrap(), circle);
        // A name that the crate's root exports again is one of its module.
        assert_eq!(check(crate_of("use crate::A; pub struct B;").path()).unwrap(), circle);
        let tests = "pub struct B; #[cfg(test)] mod tests { use crate::a::A; }";
        assert!(check(crate_of(tests).path()).unwrap().is_empty());
    }
}
