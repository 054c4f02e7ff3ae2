//! Parts of pages that the code writes: the text between `<!-- NAME -->` and `<!-- end of NAME -->`.

use std::path::Path;

use anyhow::Context;

/// Command that brings the parts up to date.
const WRITE: &str = "cargo xtask tidy --write";

/// Compares the part `name` of a page with `new`; with `write`, puts `new` there instead. Returns what is wrong, a line each.
///
/// # Errors
///
/// The page cannot be read or written.
pub fn keep(root: &Path, page: &str, name: &str, new: &str, write: bool) -> anyhow::Result<Vec<String>> {
    let path = root.join(page);
    let text = std::fs::read_to_string(&path).with_context(|| page.to_owned())?;
    let (begin, end) = (format!("<!-- {name} -->\n"), format!("<!-- end of {name} -->"));
    let parts = text
        .split_once(&begin)
        .and_then(|(before, rest)| rest.split_once(&end).map(|(old, after)| (before, old, after)));
    Ok(match parts {
        None => vec![format!("{page} lacks the lines `{}` and `{end}`", begin.trim())],
        Some((_, old, _)) if old == new => Vec::new(),
        Some((before, _, after)) if write => {
            std::fs::write(&path, format!("{before}{begin}{new}{end}{after}"))
                .with_context(|| page.to_owned())?;
            Vec::new()
        }
        Some(_) => {
            vec![format!("{page}: the part `{name}` differs from what the code says; {WRITE} renews it")]
        }
    })
}

#[cfg(test)]
mod tests {
    use super::super::fixture::folder;
    use super::*;

    #[test]
    fn a_part_is_renewed_between_its_marks() {
        let folder = folder(&[("page.md", "a\n<!-- x -->\nold\n<!-- end of x -->\nb\n"), ("bare.md", "a")]);
        let root = folder.path();
        assert_eq!(
            keep(root, "bare.md", "x", "new\n", true).unwrap(),
            ["bare.md lacks the lines `<!-- x -->` and `<!-- end of x -->`"]
        );
        let errors = keep(root, "page.md", "x", "new\n", false).unwrap();
        assert!(errors[0].starts_with("page.md: the part `x` differs"), "{errors:?}");
        assert!(keep(root, "page.md", "x", "new\n", true).unwrap().is_empty());
        let text = std::fs::read_to_string(root.join("page.md")).unwrap();
        assert_eq!(text, "a\n<!-- x -->\nnew\n<!-- end of x -->\nb\n");
        assert!(keep(root, "missing.md", "x", "", false).is_err());
    }
}
