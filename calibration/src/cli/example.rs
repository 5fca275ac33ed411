//! `calibration example`.

use super::print;
use crate::demo::example::Order;
use crate::words::words;
use serde_json::json;
use std::path::PathBuf;

#[derive(Debug, clap::Args)]
#[command(after_help = "\
A session of a simulated FR3 in which an effect acts that its cell.toml does not know, as yours may hold one: eight clips of the arm
alone, or with --strokes sixteen strokes at a box. To try check, identify, diagnose, replay, export and pages on.

Examples:
  calibration example session
  calibration diagnose session --report report.html
  calibration example session --reveal               # what was hidden; with the --seed and --strokes that it was made with
  calibration example strokes --strokes --seed 7

JSON: session, clips [file]; with --reveal: effects [{name, parameters}].")]
pub struct ExampleArguments {
    /// Folder to create.
    #[arg(value_name = "FOLDER")]
    out: PathBuf,
    /// Strokes at an object instead of the arm alone.
    #[arg(long)]
    strokes: bool,
    /// Draws what is hidden, and the motions.
    #[arg(long, value_name = "N", default_value_t = 1, value_parser = inference::seed::parse)]
    seed: u64,
    /// Says what is hidden, and writes nothing.
    #[arg(long, conflicts_with = "force")]
    reveal: bool,
    /// Replaces a session that is there already.
    #[arg(long)]
    force: bool,
    /// Prints one JSON object on stdout at the end.
    #[arg(long)]
    json: bool,
}

pub(super) fn run(arguments: ExampleArguments) -> anyhow::Result<()> {
    let ExampleArguments { out, strokes, seed, reveal, force, json } = arguments;
    let order = Order { out, force, strokes, seed };
    if reveal {
        let effects = order.hidden()?;
        let said = effects.iter().map(|effect| {
            let numbers = effect.parameters.iter().map(|(name, value)| format!("{name} {value}"));
            format!("{} ({})", words(&effect.name), numbers.collect::<Vec<_>>().join(", "))
        });
        let said = said.collect::<Vec<_>>().join(", ");
        return print(json, &json!({ "effects": effects }), said);
    }
    let written = order.write()?;
    let folder = written.session.display();
    let said = format!(
        "{} clips of a simulated FR3 in {folder}, with an effect in them that cell.toml does not know\nnext: calibration diagnose {folder} --report report.html",
        written.clips.len()
    );
    print(json, &written, said)
}
