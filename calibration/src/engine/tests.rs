//! Engines that fail, as shell scripts.

use super::*;
use std::time::Instant;

fn cell() -> Cell {
    let text = include_str!("../../../config/fr3_cell.toml");
    Cell::parse(text, Path::new("cell.toml")).expect("the shipped cell")
}

fn started(command: &str, limit: Duration) -> Result<(Arc<Engine>, Interrupt), EngineError> {
    let interrupt = Interrupt::default();
    let call = Call { command: command.into(), limit };
    let engine = Engine::start(call, (&cell(), Path::new("."), &["joint".into()]), &interrupt)?;
    Ok((engine, interrupt))
}

/// Writes a message without numbers.
fn says(text: &str) -> String {
    let bytes = frame::bytes(&serde_json::from_str::<Value>(text).expect("JSON"), &[]).expect("short");
    let octal: String = bytes.iter().map(|byte| format!("\\{byte:03o}")).collect();
    format!("printf '{octal}'")
}

const HELLO: &str = r#"{"message":"hello","protocol":1,"name":"script","parameters":[],"effects":{},"readings":["q"]}"#;
const PATIENCE: Duration = Duration::from_secs(20);

fn asked(engine: &Engine) -> Result<Arc<Vec<f64>>, NoStates> {
    let theta = Theta::default();
    engine.roll_out(&Question {
        theta: &theta,
        dof: 1,
        start: &[0.0, 0.0],
        before: 0,
        commands: &[0.1, 0.0],
        readings: &[Quantity::Position],
        times: &[0.0, 1e-3],
        object: None,
    })
}

#[test]
fn an_engine_that_cannot_be_greeted_is_told_in_one_line_with_a_remedy() {
    for (command, words) in [
        ("exit 3".to_owned(), "ended with exit status: 3; start it by hand"),
        ("no_such_program_at_all".to_owned(), "not found"),
        ("echo loading a model of a robot".to_owned(), "\"loading \" where a message begins"),
        (says(r#"{"message":"states"}"#), "answered the greeting with states"),
        (says(r#"{"message":"error","why":"no licence"}"#), "no licence"),
        (says(r#"{"message":"hello","protocol":3,"name":"x","readings":["q"]}"#), "version 3 of the protocol"),
        (says(r#"{"message":"bye"}"#), "cannot be read"),
        ("echo 'ImportError: no module' >&2; exit 1".to_owned(), ": ImportError: no module; start it by hand"),
    ] {
        let error = started(&command, PATIENCE).expect_err("no engine").to_string();
        assert!(error.contains(words) && !error.contains('\n'), "{command}: {error}");
    }
}

#[test]
fn an_engine_that_dies_in_a_roll_out_is_started_again_once_and_then_given_up() {
    let (engine, interrupt) = started(&format!("{}; sleep 0.1; exit 7", says(HELLO)), PATIENCE).expect("a greeting");
    let error = asked(&engine).expect_err("it dies").to_string();
    assert!(error.contains("exit status: 7"), "{error}");
    assert!(interrupt.cancelled() && engine.failure().is_some());
    assert_eq!(engine.used().started_again, 1);
    assert!(asked(&engine).is_err() && engine.used().rollouts == 1, "it is asked no more");
}

#[test]
fn a_roll_out_is_asked_again_of_a_new_process_where_all_that_run_are_about_to_end() {
    let folder = tempfile::tempdir().expect("a folder");
    let mended = folder.path().join("mended");
    let impossible = says(r#"{"message":"impossible","why":"singular"}"#);
    let script = format!(
        "[ -e '{}' ] && answers=yes; {}; [ $answers ] && {impossible} && exec cat >&2; exit 7",
        mended.display(),
        says(HELLO)
    );
    let (engine, interrupt) = started(&script, PATIENCE).expect("a greeting");
    for _ in 0..2 {
        let process = engine.another().expect("a greeting");
        locked(&engine.idle).push(process);
    }
    std::fs::write(&mended, "").expect("a mark");
    assert!(matches!(asked(&engine), Err(NoStates::Impossible(_))));
    assert!(engine.failure().is_none() && !interrupt.cancelled());
    assert_eq!(engine.used().started_again, 1);
}

#[test]
fn silence_ends_at_the_limit_and_takes_what_the_engine_started_along() {
    let script = format!("{}; sleep 600 & echo $! >&2; wait", says(HELLO));
    let (engine, _) = started(&script, Duration::from_secs(1)).expect("a greeting");
    let began = Instant::now();
    let error = asked(&engine).expect_err("it is silent").to_string();
    assert!(error.contains("for 1 s") && error.contains("--engine-limit"), "{error}");
    assert!(began.elapsed() < Duration::from_secs(5), "{:?}", began.elapsed());
    let sleeper = error.split(": ").nth(1).and_then(|words| words.split(';').next()).expect("its number");
    let state = std::process::Command::new("ps").args(["-o", "stat=", "-p", sleeper.trim()]).output().expect("ps");
    let state = String::from_utf8_lossy(&state.stdout).trim().to_owned();
    assert!(state.is_empty() || state.starts_with('Z'), "{sleeper} is {state}");
}

#[test]
fn an_answer_of_another_length_is_refused_and_one_that_says_impossible_is_none() {
    let (engine, _) = started(&format!("{}; {}; cat >&2", says(HELLO), says(r#"{"message":"states"}"#)), PATIENCE)
        .expect("a greeting");
    let error = asked(&engine).expect_err("too short").to_string();
    assert!(error.contains("sent 0 numbers where 2 rows of 1"), "{error}");
    let script = format!("{}; {}; cat >&2", says(HELLO), says(r#"{"message":"impossible","why":"singular"}"#));
    let (engine, interrupt) = started(&script, PATIENCE).expect("a greeting");
    assert!(matches!(asked(&engine), Err(NoStates::Impossible(why)) if why == "singular"));
    assert!(engine.failure().is_none() && !interrupt.cancelled());
}
