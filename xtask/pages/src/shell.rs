//! Completions for five shells and man pages of the programs.

use std::path::Path;

use anyhow::Context;
use clap::CommandFactory;
use clap_complete::Shell;

/// Writes them into `folder`, which is made where it is missing.
pub(crate) fn run(folder: &Path) -> anyhow::Result<()> {
    std::fs::create_dir_all(folder)
        .with_context(|| format!("cannot make the folder {}", folder.display()))?;
    let programs = [
        sonel_trace::Program::command(),
        sonel_render::Arguments::command(),
        sonel_view::Arguments::command(),
        sonel_analyze::Arguments::command(),
    ];
    for command in programs {
        let mut command = command.disable_help_subcommand(true);
        let name = command.get_name().to_owned();
        for shell in [Shell::Bash, Shell::Elvish, Shell::Fish, Shell::PowerShell, Shell::Zsh] {
            clap_complete::generate_to(shell, &mut command, &name, folder)?;
        }
        clap_mangen::generate_to(command, folder)?;
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    #[test]
    fn every_program_has_completions_and_pages() {
        let folder = std::env::temp_dir().join(format!("sonel-shell-{}", std::process::id()));
        super::run(&folder).unwrap();
        let text = |name: &str| std::fs::read_to_string(folder.join(name)).unwrap();
        for program in ["sonel-trace", "sonel-render", "sonel-view", "sonel-analyze"] {
            assert!(text(&format!("{program}.bash")).contains("complete -F"), "{program}");
            assert!(text(&format!("_{program}")).starts_with("#compdef"), "{program}");
            assert!(text(&format!("{program}.fish")).contains("complete -c"), "{program}");
            assert!(text(&format!("{program}.1")).contains(".SH SYNOPSIS"), "{program}");
        }
        assert!(
            text("sonel-trace.bash").contains("materials")
                && text("sonel-trace-check.1").contains("exit code 1")
        );
        std::fs::remove_dir_all(folder).unwrap();
    }
}
