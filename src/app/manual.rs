//! What is made of the tree of commands beside the help: completions, manual pages, and the tables of `docs/cli.md`.

use std::fmt::Write;
use std::path::Path;

use clap_complete::Shell;
use clap_mangen::Man;

use super::args;
use super::console;
use super::outcome::{Family, Outcome};
use super::output::Place;

/// Prints what makes a shell complete the command line.
///
/// # Errors
/// One sentence: standard output cannot be written.
pub(super) fn completions(shell: Shell) -> Result<(), String> {
    let mut bytes = Vec::new();
    let mut tree = args::tree();
    clap_complete::generate(shell, &mut tree, "tyndall", &mut bytes);
    console::print(&String::from_utf8_lossy(&bytes))
}

/// Prints the manual page of the program, or writes those of all commands to a directory.
///
/// # Errors
/// One sentence that says what cannot be written.
pub(super) fn man(directory: Option<&Path>) -> Result<(), String> {
    let tree = args::tree();
    let Some(directory) = directory else {
        return console::print(&String::from_utf8_lossy(&page(&tree, "tyndall")));
    };
    let subcommands = tree.get_subcommands().map(|command| {
        let name = format!("tyndall-{}", command.get_name());
        (page(command, &name), name)
    });
    for (page, name) in subcommands.chain([(page(&tree, "tyndall"), "tyndall".to_owned())]) {
        Place::new(&directory.join(format!("{name}.1")))?.write(&page)?;
    }
    Ok(())
}

fn page(command: &clap::Command, name: &str) -> Vec<u8> {
    let mut bytes = Vec::new();
    let command = command.clone().display_name(name.to_owned());
    // Memory is never full.
    let _ = Man::new(command).render(&mut bytes);
    bytes
}

/// The tables of `docs/cli.md`, by name: of commands, of their options, and of exit statuses.
pub(super) fn tables() -> Vec<(&'static str, String)> {
    let tree = args::tree();
    vec![
        ("commands", commands(&tree)),
        ("options", options(&tree)),
        ("statuses", statuses()),
    ]
}

fn commands(tree: &clap::Command) -> String {
    let mut table = "| Command | Does |\n|---|---|\n".to_owned();
    for command in tree.get_subcommands() {
        let positionals = command.get_positionals().map(|arg| {
            let name = value_names(arg);
            match (arg.is_required_set(), is_list(arg)) {
                (true, _) => name,
                (false, true) => format!("[{name}]..."),
                (false, false) => format!("[{name}]"),
            }
        });
        let mut words = vec![command.get_name().to_owned()];
        words.extend(positionals);
        let about = command
            .get_about()
            .map(ToString::to_string)
            .unwrap_or_default();
        let _ = writeln!(table, "| `tyndall {}` | {about} |", words.join(" "));
    }
    table
}

fn is_list(arg: &clap::Arg) -> bool {
    matches!(arg.get_action(), clap::ArgAction::Append)
        || arg.get_num_args().is_some_and(|n| n.max_values() > 1)
}

/// A row of the table of options.
struct Row {
    option: String,
    commands: Vec<String>,
    effect: String,
}

fn options(tree: &clap::Command) -> String {
    let mut rows: Vec<Row> = Vec::new();
    for command in tree.get_subcommands() {
        // Every command has these two, in words of clap's own.
        let is_common = |arg: &&clap::Arg| ["help", "version"].contains(&arg.get_id().as_str());
        let arguments = command.get_arguments().filter(|arg| !is_common(arg));
        for arg in arguments.filter(|arg| !arg.is_hide_set()) {
            let Some(long) = arg.get_long() else { continue };
            let mut option = format!("--{long}");
            if arg.get_action().takes_values() {
                let _ = write!(option, " {}", value_names(arg));
            }
            let effect = effect(arg);
            let name = command.get_name().to_owned();
            let is_row = |row: &&mut Row| row.option == option && row.effect == effect;
            match rows.iter_mut().find(is_row) {
                Some(row) => row.commands.push(name),
                None => rows.push(Row {
                    option,
                    commands: vec![name],
                    effect,
                }),
            }
        }
    }
    let mut table = "| Option | Of | Effect |\n|---|---|---|\n".to_owned();
    for Row {
        option,
        commands,
        effect,
    } in rows
    {
        let _ = writeln!(table, "| `{option}` | {} | {effect} |", commands.join(", "));
    }
    table += "| `--help`, `-h` | all | print help: all of it, or a summary |\n";
    table += "| `--version`, `-V` | all | print the version |\n";
    table
}

fn value_names(arg: &clap::Arg) -> String {
    let names = arg.get_value_names().unwrap_or_default();
    let names: Vec<&str> = names.iter().map(|name| name.as_str()).collect();
    names.join(" ")
}

/// The long help, or the short one.
fn effect(arg: &clap::Arg) -> String {
    let help = arg.get_long_help().or(arg.get_help());
    let mut effect = help.map(ToString::to_string).unwrap_or_default();
    if let Some(default) = arg.get_default_values().first()
        && !arg.is_hide_default_value_set()
        && arg.get_action().takes_values()
    {
        let _ = write!(effect, "; `{}` if not given", default.display());
    }
    effect.replace('|', "\\|").replace('\n', " ")
}

fn statuses() -> String {
    let mut table = "| Status |".to_owned();
    for family in Family::ALL {
        let names: Vec<String> = family
            .commands()
            .iter()
            .map(|name| format!("`{name}`"))
            .collect();
        let _ = write!(table, " {} |", names.join(", "));
    }
    table += "\n|---|";
    table += &"---|".repeat(Family::ALL.len());
    table.push('\n');
    for outcome in Outcome::ALL {
        let _ = write!(table, "| {} |", outcome.code());
        for family in Family::ALL {
            let _ = write!(table, " {} |", family.meaning(outcome).unwrap_or("–"));
        }
        table.push('\n');
    }
    table
}
