//! Commands and options as a page.

use clap::{Arg, Command};

/// A page on a program: a section for every command that has options or none below it.
pub fn page(mut program: Command, intro: &str) -> String {
    program.build();
    let mut text = format!("# {}\n\n{intro}\n", program.get_name());
    section(&program, &mut text);
    text
}

fn section(command: &Command, text: &mut String) {
    let below: Vec<&Command> =
        command.get_subcommands().filter(|c| !c.is_hide_set() && c.get_name() != "help").collect();
    let name = command.get_bin_name().unwrap_or(command.get_name()).to_owned();
    *text += &format!("\n## {name}\n\n");
    if let Some(about) = command.get_long_about().or(command.get_about()) {
        *text += &format!("{}\n\n", escaped(&about.to_string()));
    }
    if below.is_empty() {
        let usage = command.clone().render_usage().to_string();
        *text += &format!("```text\n{}\n```\n\n", usage.trim_start_matches("Usage: "));
    }
    let is_shown = |arg: &&Arg| !arg.is_hide_set() && !["help", "version"].contains(&arg.get_id().as_str());
    let rows: String = command.get_arguments().filter(is_shown).map(row).collect();
    if !rows.is_empty() {
        *text += &format!("| option | meaning |\n|---|---|\n{rows}\n");
    }
    if let Some(more) = command.get_after_long_help().or(command.get_after_help()) {
        *text += &format!("```text\n{more}\n```\n");
    }
    for command in below {
        section(command, text);
    }
}

fn row(arg: &Arg) -> String {
    let takes_value = arg.get_action().takes_values();
    let value =
        arg.get_value_names().and_then(|names| names.first()).map_or(String::new(), |name| format!("{name}"));
    let option = match (arg.get_long(), takes_value) {
        (Some(long), true) => format!("`--{long} {value}`"),
        (Some(long), false) => format!("`--{long}`"),
        (None, _) => format!("`{value}`"),
    };
    let help = arg
        .get_long_help()
        .or(arg.get_help())
        .map_or(String::new(), |help| help.to_string().replace('\n', " "));
    let choices: Vec<String> = match takes_value {
        true => arg
            .get_possible_values()
            .iter()
            .filter(|v| !v.is_hide_set())
            .map(|v| format!("`{}`", v.get_name()))
            .collect(),
        false => Vec::new(),
    };
    let choices = if choices.is_empty() { String::new() } else { format!("; one of {}", choices.join(", ")) };
    let defaults: Vec<String> = match takes_value {
        true => arg.get_default_values().iter().map(|v| format!("`{}`", v.to_string_lossy())).collect(),
        false => Vec::new(),
    };
    let defaults =
        if defaults.is_empty() { String::new() } else { format!(" [default: {}]", defaults.join(", ")) };
    let help = escaped(help.trim_end_matches('.')).replace('|', "\\|");
    format!("| {option} | {help}{choices}{defaults} |\n")
}

/// Text in which no character begins an element of HTML. Code between backticks stays as it is.
pub fn escaped(text: &str) -> String {
    let parts = text.split('`').enumerate();
    let parts =
        parts.map(
            |(i, part)| {
                if i % 2 == 0 { part.replace('<', "&lt;").replace('*', "\\*") } else { part.to_owned() }
            },
        );
    parts.collect::<Vec<_>>().join("`")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_command_becomes_a_section_with_its_options() {
        let grow = Command::new("grow")
            .about("Grows a tree of <wood>")
            .after_help("Needs rain.")
            .arg(Arg::new("seed").long("seed").value_name("S").default_value("7").help("Seed | number"))
            .arg(Arg::new("kind").long("kind").value_parser(["apple", "pear"]).help("Kind."));
        let text = page(Command::new("orchard").subcommand(grow), "All.");
        assert!(text.starts_with("# orchard\n\nAll.\n\n## orchard\n"), "{text}");
        assert!(
            text.contains("\n## orchard grow\n\nGrows a tree of &lt;wood>\n\n```text\norchard grow"),
            "{text}"
        );
        assert!(text.contains("| `--seed S` | Seed \\| number [default: `7`] |\n"), "{text}");
        assert!(text.contains("Kind; one of `apple`, `pear` |\n"), "{text}");
        assert!(text.contains("```text\nNeeds rain.\n```\n"), "{text}");
    }
}
