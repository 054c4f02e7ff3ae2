//! The tables of metrics in the documentation are those of the code.

use std::path::Path;

use anyhow::Context;
use orchard_statistics::MetricInfo;
use orchard_tasks::component::{ReachAndGrasp, metrics as of_components};
use orchard_tasks::{detect, harvest, verify};

/// Pages with tables, and the command that writes them.
const PAGES: [&str; 2] = ["docs/benchmark-v1.md", "docs/verify.md"];
const WRITE: &str = "cargo xtask tidy --write";

/// Returns the table of a task's metrics; `None` if there is no such task.
pub fn table(task: &str) -> Option<String> {
    let infos: Vec<MetricInfo> = match task {
        "harvest" => harvest::metrics::infos().collect(),
        "detect" => detect::METRICS.iter().map(|metric| metric.info).collect(),
        "components" => of_components::<ReachAndGrasp>().iter().map(|metric| metric.info).collect(),
        "verify" => verify::METRICS.iter().map(|metric| metric.info).collect(),
        _ => return None,
    };
    Some(MetricInfo::markdown(&infos))
}

/// Compares the tables of all pages with the code; with `write`, brings them up to date instead.
pub fn check(root: &Path, write: bool) -> anyhow::Result<Vec<String>> {
    let mut errors = Vec::new();
    for page in PAGES {
        let path = root.join(page);
        let text = std::fs::read_to_string(&path).context(page)?;
        match renewed(&text) {
            Ok(new) if new == text => {}
            Ok(new) if write => std::fs::write(&path, new).context(page)?,
            Ok(_) => {
                errors.push(format!("{page}: a table of metrics differs from the code; {WRITE} renews it"))
            }
            Err(problem) => errors.push(format!("{page}: {problem}")),
        }
    }
    Ok(errors)
}

/// Returns the page with each table between `<!-- metrics of TASK -->` and `<!-- end -->` as the code has it.
fn renewed(text: &str) -> Result<String, String> {
    const BEGIN: &str = "<!-- metrics of ";
    const END: &str = "<!-- end -->";
    let mut parts = text.split(BEGIN);
    let mut new = parts.next().unwrap_or_default().to_owned();
    for part in parts {
        let (task, rest) = part.split_once(" -->\n").ok_or("a line `<!-- metrics of TASK -->` has no end")?;
        let (_, after) = rest.split_once(END).ok_or(format!("the table of {task} has no {END}"))?;
        let table = table(task).ok_or(format!("no task {task} has metrics"))?;
        new += &format!("{BEGIN}{task} -->\n{table}{END}{after}");
    }
    Ok(new)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_table_is_renewed_between_its_marks() {
        let old = "a\n<!-- metrics of detect -->\nold\n<!-- end -->\nb\n";
        let new = renewed(old).unwrap();
        assert!(
            new.starts_with("a\n<!-- metrics of detect -->\n| name |") && new.ends_with("<!-- end -->\nb\n")
        );
        assert!(new.contains("| `precision` | Precision | 1 | true positives | detections |"));
        assert_eq!(renewed(&new).unwrap(), new);
        assert!(renewed("<!-- metrics of lemon -->\n<!-- end -->").unwrap_err().contains("lemon"));
        assert!(renewed("<!-- metrics of detect -->\n").unwrap_err().contains("<!-- end -->"));
    }
}
