//! A script for Slurm: an array of slices, each of which goes on where it was when it is queued again.
//!
//! Whatever goes into it is a number, was checked ([`TimeLimit`], [`Partition`]), or is quoted for the shell.

use super::SweepError;
use shared_mem::typed::quoted;
use std::fmt;
use std::path::Path;
use std::str::FromStr;

/// Time of a task as Slurm takes it: `MINUTES`, `MINUTES:SECONDS`, `HH:MM:SS`, or `DAYS-` before hours, `HH:MM` or `HH:MM:SS`.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct TimeLimit(String);

impl FromStr for TimeLimit {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let (days, rest) = text.split_once('-').map_or((None, text), |(days, rest)| (Some(days), rest));
        let numbers = days.into_iter().chain(rest.split(':'));
        let is_number = |text: &str| (1..=6).contains(&text.len()) && text.bytes().all(|c| c.is_ascii_digit());
        if rest.split(':').count() <= 3 && numbers.into_iter().all(is_number) {
            Ok(Self(text.to_owned()))
        } else {
            Err("give minutes, HH:MM:SS or DAYS-HH:MM:SS".to_owned())
        }
    }
}

/// A partition of a cluster, or several with commas between.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Partition(String);

impl FromStr for Partition {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let is_name = |name: &str| !name.is_empty() && name.chars().all(in_a_name);
        if text.split(',').all(is_name) {
            Ok(Self(text.to_owned()))
        } else {
            Err("give letters, digits, ., _ and -, with commas between several".to_owned())
        }
    }
}

fn in_a_name(c: char) -> bool {
    c.is_ascii_alphanumeric() || "_-.".contains(c)
}

impl fmt::Display for TimeLimit {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.0)
    }
}

impl fmt::Display for Partition {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.0)
    }
}

/// What a slice is to have.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Wanted {
    /// Slices, as tasks of one array.
    pub slices: u32,
    /// Cores of each.
    pub cpus: u32,
    /// Time of each.
    pub time: TimeLimit,
    /// Partition; default: the cluster's.
    pub partition: Option<Partition>,
}

/// The script; `program` is the path of this program on the nodes.
///
/// # Errors
/// [`SweepError::Asked`] for a path that is no UTF-8: the script would name another.
pub fn script(sweep: &Path, program: &Path, wanted: &Wanted) -> Result<String, SweepError> {
    let Wanted { slices, cpus, time, partition } = wanted;
    if let Some(path) = [sweep, program].into_iter().find(|path| path.to_str().is_none()) {
        let what = format!("{}: the name is no UTF-8, and cannot stand in a script; rename it", path.display());
        return Err(SweepError::Asked(what));
    }
    let partition = partition.as_ref().map_or_else(String::new, |name| format!("#SBATCH --partition={name}\n"));
    let run = format!("{} sweep run {}", quoted(program), quoted(sweep));
    let name: String =
        sweep.file_name().unwrap_or_default().to_string_lossy().chars().filter(|c| in_a_name(*c)).collect();
    let name = if name.is_empty() { "sweep" } else { &name };
    Ok(format!(
        "#!/bin/bash\n#SBATCH --job-name={name}\n#SBATCH --array=1-{slices}\n#SBATCH --cpus-per-task={cpus}\n#SBATCH --time={time}\n\
         #SBATCH --requeue\n#SBATCH --open-mode=append\n{partition}\
         # A task that was ended early is queued again and goes on with the units that have no result.\n\
         exec {run} --jobs {cpus} --slice \"$SLURM_ARRAY_TASK_ID/{slices}\"\n"
    ))
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::os::unix::ffi::OsStrExt as _;
    use std::os::unix::fs::PermissionsExt as _;

    fn wanted() -> Wanted {
        Wanted { slices: 8, cpus: 4, time: "02:00:00".parse().expect("a time"), partition: "short".parse().ok() }
    }

    #[test]
    fn a_shell_takes_the_script_as_it_is_meant_whatever_folder_and_program_are_called() {
        let folder = tempfile::tempdir().expect("a folder");
        for name in [
            "sweep",
            "my sweep",
            "it's",
            "$(touch owned)",
            "`touch owned`;\"",
            "a\n#SBATCH --time=1\nb",
            "-x",
            "\u{fc}",
        ] {
            // A program that prints its words.
            let program = folder.path().join(format!("{name} program"));
            std::fs::write(&program, "#!/bin/sh\nprintf '[%s]' \"$@\"\n").expect("room");
            std::fs::set_permissions(&program, std::fs::Permissions::from_mode(0o755)).expect("a file of ours");
            let sweep = folder.path().join(name);
            let text = script(&sweep, &program, &wanted()).expect("a script");
            let said = std::process::Command::new("bash")
                .args(["-c", &text])
                .current_dir(folder.path())
                .env("SLURM_ARRAY_TASK_ID", "3")
                .output()
                .expect("a shell");
            let words = format!("[sweep][run][{}][--jobs][4][--slice][3/8]", sweep.display());
            assert_eq!(String::from_utf8_lossy(&said.stdout), words, "{}", String::from_utf8_lossy(&said.stderr));
            assert!(!folder.path().join("owned").exists(), "{name}");
            let asked: Vec<&str> = text.lines().take_while(|line| line.starts_with('#')).collect();
            assert!(asked.contains(&"#SBATCH --array=1-8") && asked.contains(&"#SBATCH --partition=short"), "{text}");
            assert_eq!(asked.iter().filter(|line| line.contains("--time=")).count(), 1, "{text}");
        }
        let no_text = Path::new(std::ffi::OsStr::from_bytes(b"/sweep\xff"));
        let said = script(no_text, Path::new("/opt/calibration"), &wanted()).expect_err("no text").to_string();
        assert!(said.contains("UTF-8"), "{said}");
    }

    #[test]
    fn only_times_and_partitions_stand_in_its_lines() {
        for time in ["30", "30:00", "02:00:00", "1-0", "1-12:30", "7-00:00:00"] {
            assert!(time.parse::<TimeLimit>().is_ok(), "{time}");
        }
        for time in [
            "",
            "-",
            "1-",
            "1-2-3",
            "1:2:3:4",
            ":",
            "1:",
            "x",
            "1 2",
            "1\n#SBATCH --uid=0",
            "$(id)",
            "1234567",
            "\u{661}",
        ] {
            assert!(time.parse::<TimeLimit>().is_err(), "{time:?}");
        }
        for partition in ["short", "gpu_a100,long-2.x"] {
            assert!(partition.parse::<Partition>().is_ok(), "{partition}");
        }
        for partition in ["", ",", "a,", "a b", "a\n#SBATCH --uid=0", "$(id)", "a;b", "a=b", "\u{fc}"] {
            assert!(partition.parse::<Partition>().is_err(), "{partition:?}");
        }
    }
}
