//! Trials: one policy on one task from one start in one world, and files of them.

use serde::{Deserialize, Serialize};
use shared_mem::input;
use std::collections::BTreeSet;
use std::path::{Path, PathBuf};

/// One trial.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Trial {
    /// Where: `twin`, or the name of a file of trials.
    pub world: String,
    /// Who.
    pub policy: String,
    /// Name of the task.
    pub task: String,
    /// By which the start was drawn, or whatever names it; trials with one start are compared one by one.
    pub start: Option<String>,
    /// Whether it was a success.
    pub success: bool,
    /// How far it came, 0 to 1.
    pub progress: Option<f64>,
}

/// A file of trials cannot be used.
#[derive(Debug, thiserror::Error)]
pub enum TrialsError {
    /// It cannot be read.
    #[error(transparent)]
    Input(#[from] input::InputError),
    /// Its content.
    #[error("{}{}: {what}", file.display(), line.map_or(String::new(), |line| format!(" line {line}")))]
    Content {
        /// The file.
        file: PathBuf,
        /// The line, from 1.
        line: Option<u64>,
        /// What is wrong and what to do.
        what: String,
    },
}

const COLUMNS: &str = "policy,task,start,success,progress";

/// Trials of another world: a table (CSV) with the columns policy, task, start, success and progress, in any order; start and
/// progress may be missing or empty. The world is called after the file, or as a column world says.
///
/// # Errors
/// [`TrialsError`] with file, line and remedy.
pub fn read(path: &Path) -> Result<Vec<Trial>, TrialsError> {
    parse(&input::text(path, input::Kind::List)?, path)
}

/// The same of a text; `path` names it in errors.
///
/// # Errors
/// [`TrialsError::Content`].
///
/// # Example
/// ```
/// use evaluation::{findings::findings, trial::parse};
/// use std::path::Path;
///
/// let mut text = String::from("world,policy,task,start,success\n");
/// for start in 0..20 {
///     text += &format!("laboratory,old,push,{start},{}\nlaboratory,new,push,{start},{}\n", start < 8, start < 18);
/// }
/// let trials = parse(&text, Path::new("trials.csv"))?;
/// let found = findings(&trials, &["laboratory".to_owned()], 0);
/// assert_eq!((trials.len(), found.cells.len()), (40, 2));
/// let comparison = &found.policies[0].comparison;
/// assert!(comparison.p.expect("same starts") < 0.01);
///
/// assert!(parse("world,policy\n", Path::new("trials.csv")).is_err(), "columns are missing");
/// # Ok::<(), evaluation::trial::TrialsError>(())
/// ```
pub fn parse(text: &str, path: &Path) -> Result<Vec<Trial>, TrialsError> {
    let content = |line: Option<u64>, what: String| TrialsError::Content { file: path.to_owned(), line, what };
    let mut reader = csv::ReaderBuilder::new().trim(csv::Trim::All).flexible(true).from_reader(text.as_bytes());
    let header = reader.headers().map_err(|error| content(Some(1), error.to_string()))?.clone();
    let column = |name: &str| header.iter().position(|found| found == name);
    let needed = |name: &str| {
        column(name).ok_or_else(|| content(Some(1), format!("no column is called `{name}`; the columns are {COLUMNS}")))
    };
    let (policy, task, success) = (needed("policy")?, needed("task")?, needed("success")?);
    let stem = path.file_stem().map_or_else(String::new, |stem| stem.to_string_lossy().into_owned());
    let (mut trials, mut seen) = (Vec::new(), BTreeSet::new());
    for row in reader.records() {
        let row = row.map_err(|error| content(None, error.to_string()))?;
        let line = row.position().map(csv::Position::line);
        let text = |column: Option<usize>| column.and_then(|column| row.get(column)).filter(|text| !text.is_empty());
        let named = |name: &str, column: usize| {
            text(Some(column)).map(str::to_owned).ok_or_else(|| content(line, format!("`{name}` is empty; fill it in")))
        };
        let done = match text(Some(success)).map(str::to_lowercase).as_deref() {
            Some("1" | "true" | "yes") => true,
            Some("0" | "false" | "no") => false,
            other => {
                let what = format!("`success` is {}; give 1 or 0", other.unwrap_or("empty"));
                return Err(content(line, what));
            }
        };
        let progress = text(column("progress")).map(|text| {
            let number = text.parse().ok().filter(|share| (0.0..=1.0).contains(share));
            number.ok_or_else(|| content(line, format!("`progress` is {text}; give a number from 0 to 1, or nothing")))
        });
        let start = text(column("start")).map(str::to_owned);
        let (policy, task) = (named("policy", policy)?, named("task", task)?);
        let world = text(column("world")).map_or_else(|| stem.clone(), str::to_owned);
        if start.is_some()
            && !seen.insert(
                [&world, &policy, &task].map(String::clone).into_iter().chain(start.clone()).collect::<Vec<_>>(),
            )
        {
            let start = start.unwrap_or_default();
            let what =
                format!("{policy} on {task} from start {start} stands there twice; give each trial a start of its own");
            return Err(content(line, what));
        }
        trials.push(Trial { world, policy, task, start, success: done, progress: progress.transpose()? });
    }
    if trials.is_empty() {
        return Err(content(None, format!("it holds no trials; give rows of {COLUMNS}")));
    }
    Ok(trials)
}

/// Trials as a table that [`read`] takes.
pub fn table<'a>(trials: impl IntoIterator<Item = &'a Trial>) -> String {
    let mut writer = csv::Writer::from_writer(Vec::new());
    // A vector takes whatever is written.
    let mut put = |row: [&str; 6]| drop(writer.write_record(row));
    put(["world", "policy", "task", "start", "success", "progress"]);
    for trial in trials {
        let progress = trial.progress.map_or(String::new(), |share| share.to_string());
        let start = trial.start.as_deref().unwrap_or("");
        put([&trial.world, &trial.policy, &trial.task, start, if trial.success { "1" } else { "0" }, &progress]);
    }
    writer.into_inner().map(|bytes| String::from_utf8_lossy(&bytes).into_owned()).unwrap_or_default()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn file(text: &str) -> (tempfile::TempDir, PathBuf) {
        let folder = tempfile::tempdir().expect("a folder");
        let path = folder.path().join("robot.csv");
        std::fs::write(&path, text).expect("room");
        (folder, path)
    }

    #[test]
    fn a_table_is_read_whatever_the_order_of_its_columns_and_written_so_that_it_is_read() {
        let (_folder, path) = file("task, success, policy, start\npick, 1, a, 3\npick,false,\"a, b\",\n");
        let trials = read(&path).expect("trials");
        assert_eq!(
            trials[0],
            Trial {
                world: "robot".into(),
                policy: "a".into(),
                task: "pick".into(),
                start: Some("3".into()),
                success: true,
                progress: None,
            }
        );
        assert_eq!((trials[1].policy.as_str(), trials[1].success, trials[1].start.as_ref()), ("a, b", false, None));
        let (_folder, again) = file(&table(&trials));
        assert_eq!(read(&again).expect("trials"), trials);
    }

    #[test]
    fn what_cannot_be_used_is_said_with_its_line() {
        for (text, words) in [
            ("policy,task\na,b\n", "no column is called `success`"),
            ("policy,task,success\na,b,maybe\n", "line 2: `success` is maybe; give 1 or 0"),
            ("policy,task,success,progress\na,b,1,2.0\n", "line 2: `progress` is 2.0"),
            ("policy,task,success\n,b,1\n", "line 2: `policy` is empty"),
            ("policy,task,success\n", "it holds no trials"),
            ("policy,task,start,success\na,b,1,1\na,b,1,0\n", "line 3: a on b from start 1 stands there twice"),
        ] {
            let (_folder, path) = file(text);
            let error = read(&path).expect_err(text).to_string();
            assert!(error.contains(words) && !error.contains('\n'), "{error}");
        }
    }
}
