//! Every command line of the pages and of `--help` is one that the programs take, every command named in their text has the options that it is named with, and every block
//! of TOML or JSON is valid.

use std::path::Path;

use anyhow::Context;
use clap::{Command, CommandFactory};

use crate::workspace::{files, relative};

/// Pages that are read beside docs/.
const BESIDE: [&str; 1] = ["README.md"];
/// Parts of a shell line that end a command.
const ENDS: [&str; 8] = ["|", ";", "&&", "||", ">", "<", "then", "done"];

/// Reads all pages under `root`.
pub fn check(root: &Path) -> anyhow::Result<Vec<String>> {
    let mut pages = files(&root.join("docs"), &["md"])?;
    pages.extend(BESIDE.iter().map(|page| root.join(page)).filter(|page| page.exists()));
    let programs = [("orchard", orchard_program::command_line()), ("xtask", crate::Cli::command())];
    let mut errors = Vec::new();
    for (_, program) in &programs {
        of_help(program, &programs, &mut errors);
    }
    for path in pages {
        let name = relative(root, &path);
        let text = std::fs::read_to_string(&path).with_context(|| name.clone())?;
        for (line, problem) in of_page(&text, &programs) {
            errors.push(format!("{name}:{line}: {problem}"));
        }
    }
    Ok(errors)
}

/// Examples in the help of a command, and of those below it, that their program refuses. Words after three spaces explain an example.
fn of_help(command: &Command, programs: &[(&str, Command)], errors: &mut Vec<String>) {
    let help = command.get_after_long_help().or(command.get_after_help()).map(ToString::to_string);
    for line in help.as_deref().unwrap_or_default().lines().filter(|line| line.starts_with("  ")) {
        let example = line.trim().split("   ").next().unwrap_or_default();
        let problem = refused(example, programs);
        errors.extend(
            problem.map(|problem| format!("--help of {}: `{example}`: {problem}", command.get_name())),
        );
    }
    for below in command.get_subcommands() {
        of_help(below, programs, errors);
    }
}

/// Problems of a page, each with its line.
fn of_page(text: &str, programs: &[(&str, Command)]) -> Vec<(usize, String)> {
    let mut found = Vec::new();
    // Line of the first fence, language, and text so far of the block that is open.
    let mut open: Option<(usize, &str, String)> = None;
    for (i, line) in text.lines().enumerate() {
        match (open.take(), line.trim_start().strip_prefix("```")) {
            (None, Some(info)) => {
                open = Some((i + 1, info.split([' ', '{']).next().unwrap_or_default(), String::new()));
            }
            (None, None) => found.extend(of_text(line, programs).into_iter().map(|problem| (i + 1, problem))),
            (Some((begin, language, text)), Some(_)) => match language {
                "sh" => found.extend(of_shell(&text, programs).map(|(at, problem)| (begin + at, problem))),
                "toml" => found.extend(
                    text.parse::<toml::Table>().err().map(|e| (begin, format!("not TOML: {}", e.message()))),
                ),
                "json" => found.extend(
                    serde_json::from_str::<serde_json::Value>(&text)
                        .err()
                        .map(|e| (begin, format!("not JSON: {e}"))),
                ),
                _ => {}
            },
            (Some((begin, language, text)), None) => {
                open = Some((begin, language, format!("{text}{line}\n")))
            }
        }
    }
    found
}

/// Commands and options in a line of text that no program has. Values there may be placeholders, so they are not read.
fn of_text(line: &str, programs: &[(&str, Command)]) -> Vec<String> {
    let mut found = Vec::new();
    for code in line.split('`').skip(1).step_by(2) {
        let code = code.strip_prefix("cargo ").unwrap_or(code);
        let mut words = code.split([' ', '=']);
        let name = words.next().unwrap_or_default();
        let Some((_, program)) = programs.iter().find(|(other, _)| *other == name) else { continue };
        let (mut command, mut is_named) = (program, true);
        for word in words {
            let below = command.find_subcommand(word).or_else(|| {
                // Every other command of `cargo xtask` is one of the program's.
                (name == "xtask" && is_named).then(|| programs[0].1.find_subcommand(word)).flatten()
            });
            let is_first = std::mem::take(&mut is_named);
            match (below, word.strip_prefix("--")) {
                (Some(below), _) => command = below,
                (None, Some(option)) if !has(command, option) => {
                    found.push(format!("`{code}`: {} has no option --{option}", command.get_name()));
                }
                (None, None) if is_first && word.chars().all(|c| c.is_ascii_lowercase() || c == '-') => {
                    found.push(format!("`{code}`: {name} has no command {word}"));
                }
                _ => {}
            }
        }
    }
    found
}

/// True if a command has an option.
fn has(command: &Command, option: &str) -> bool {
    let is_it = |arg: &clap::Arg| arg.get_long() == Some(option);
    ["help", "version", ""].contains(&option) || command.get_arguments().any(is_it)
}

/// Command lines of a block that their program refuses, each with its line in the block, from 1.
fn of_shell(block: &str, programs: &[(&str, Command)]) -> impl Iterator<Item = (usize, String)> {
    let mut found = Vec::new();
    let (mut whole, mut begin) = (String::new(), 1);
    for (i, line) in block.lines().enumerate() {
        if whole.is_empty() {
            begin = i + 1;
        }
        if let Some(part) = line.strip_suffix('\\') {
            whole += part;
            continue;
        }
        let line = std::mem::take(&mut whole) + line;
        found.extend(refused(&line, programs).map(|problem| (begin, problem)));
    }
    found.into_iter()
}

/// Why a program refuses the command in a line, if there is one and it does.
fn refused(line: &str, programs: &[(&str, Command)]) -> Option<String> {
    let words = shlex::split(line.replace(';', " ; ").as_str())?;
    let words: Vec<String> = words.iter().map(|word| filled(word)).collect();
    let calls = |i: usize, name: &str| match name {
        "orchard" => {
            words[i] == name && (i == 0 || ENDS.contains(&words[i - 1].as_str()) || words[i - 1] == "do")
        }
        _ => words[i] == name && i > 0 && words[i - 1] == "cargo",
    };
    let (at, command) = (0..words.len()).find_map(|i| {
        let (_, command) = programs.iter().find(|(name, _)| calls(i, name))?;
        Some((i, command))
    })?;
    let end =
        words[at..].iter().position(|word| ENDS.contains(&word.as_str())).map_or(words.len(), |n| at + n);
    let words = &words[at..end];
    // Every other command of `cargo xtask` is one of the program's.
    let is_own = words.get(1).is_some_and(|word| command.find_subcommand(word).is_some());
    let command = if is_own { command } else { &programs[0].1 };
    let refused = command.clone().try_get_matches_from(words).err()?;
    refused.use_stderr().then(|| refused.to_string().lines().next().unwrap_or_default().to_owned())
}

/// A word with 1 in place of each variable of the shell.
fn filled(word: &str) -> String {
    let mut parts = word.split('$');
    let first = parts.next().unwrap_or_default().to_owned();
    let is_name = |c: char| c.is_ascii_alphanumeric() || c == '_';
    first + &parts.map(|part| format!("1{}", part.trim_start_matches(is_name))).collect::<String>()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn problems(page: &str) -> Vec<(usize, String)> {
        of_page(page, &[("orchard", orchard_program::command_line()), ("xtask", crate::Cli::command())])
    }

    #[test]
    fn the_commands_of_this_workspace_are_taken() {
        assert_eq!(check(&crate::workspace::root()).unwrap(), Vec::<String>::new());
    }

    #[test]
    fn a_command_that_is_refused_is_named_with_its_line() {
        let page = "A\n```sh\norchard presets   # all\nfor i in 1 2; do orchard bench-v1 \\\n  --trees 1 --shard $i/2 --leaves 3; done\ncargo xtask tidy --wrong\n\
                    cargo xtask presets | sort\n```\n";
        let found = problems(page);
        assert_eq!(found.iter().map(|(line, _)| *line).collect::<Vec<_>>(), [4, 6], "{found:?}");
        assert!(found[0].1.contains("'--leaves'") && found[1].1.contains("'--wrong'"), "{found:?}");
    }

    #[test]
    fn options_of_commands_in_the_text_are_looked_for() {
        let page = "Take `orchard bench-v1 --tasks NAME --leaves 3`, `cargo xtask tidy --write`,\n`cargo xtask bench-v1 --shard I/N`, `orchard grow`, `orchard` and `orchard-bench`.";
        let found = problems(page);
        assert_eq!(found.iter().map(|(line, _)| *line).collect::<Vec<_>>(), [1, 2], "{found:?}");
        assert!(
            found[0].1.ends_with("bench-v1 has no option --leaves")
                && found[1].1.ends_with("no command grow"),
            "{found:?}"
        );
    }

    #[test]
    fn an_example_of_help_that_is_refused_is_named() {
        let command =
            Command::new("x").after_help("Examples:\n  orchard presets   all\n  orchard bench-v1 --leaves 3");
        let mut errors = Vec::new();
        of_help(&command, &[("orchard", orchard_program::command_line())], &mut errors);
        assert!(
            errors.len() == 1 && errors[0].starts_with("--help of x: `orchard bench-v1 --leaves 3`"),
            "{errors:?}"
        );
    }

    #[test]
    fn blocks_of_data_are_read() {
        let found = problems("```toml\na = \n```\n```json title=\"x\"\n{\"a\": 1}\n```\n```json\n{a}\n```\n");
        assert_eq!(found.iter().map(|(line, _)| *line).collect::<Vec<_>>(), [1, 7], "{found:?}");
    }
}
