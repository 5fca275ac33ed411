//! A script for Slurm: an array of slices, each of which goes on where it was when it is queued again.

use shared_mem::typed::quoted;
use std::path::Path;

/// What a slice is to have.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Wanted {
    /// Slices, as tasks of one array.
    pub slices: u32,
    /// Cores of each.
    pub cpus: u32,
    /// Time of each, as Slurm writes it.
    pub time: String,
    /// Partition; default: the cluster's.
    pub partition: Option<String>,
}

/// The script; `program` is the path of this program on the nodes.
#[must_use]
pub fn script(sweep: &Path, program: &Path, wanted: &Wanted) -> String {
    let Wanted { slices, cpus, time, partition } = wanted;
    let partition = partition.as_ref().map_or_else(String::new, |name| format!("#SBATCH --partition={name}\n"));
    let run = format!("{} sweep run {}", quoted(program), quoted(sweep));
    let name = sweep.file_name().unwrap_or_default().to_string_lossy();
    let name: String = name.chars().filter(|c| c.is_ascii_alphanumeric() || "_-.".contains(*c)).collect();
    format!(
        "#!/bin/bash\n#SBATCH --job-name={name}\n#SBATCH --array=1-{slices}\n#SBATCH --cpus-per-task={cpus}\n#SBATCH --time={time}\n\
         #SBATCH --requeue\n#SBATCH --open-mode=append\n{partition}\
         # A task that was ended early is queued again and goes on with the units that have no result.\n\
         exec {run} --jobs {cpus} --slice \"$SLURM_ARRAY_TASK_ID/{slices}\"\n"
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_shell_takes_the_script_whatever_the_folder_is_called() {
        let wanted = Wanted { slices: 8, cpus: 4, time: "02:00:00".into(), partition: Some("short".into()) };
        let text = script(Path::new("my sweep"), Path::new("/opt/calibration"), &wanted);
        assert!(text.contains("--array=1-8\n") && text.contains("--partition=short\n"), "{text}");
        assert!(text.contains("'my sweep' --jobs 4 --slice \"$SLURM_ARRAY_TASK_ID/8\""), "{text}");
        let said = std::process::Command::new("bash").args(["-n", "-c", &text]).output().expect("a shell");
        assert!(said.status.success(), "{}", String::from_utf8_lossy(&said.stderr));
    }
}
