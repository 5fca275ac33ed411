//! Engines that fail, as shell scripts.

use super::*;
use std::time::Instant;

fn cell() -> Cell {
    let text = include_str!("../../../../config/fr3_cell.toml");
    Cell::parse(text, Path::new("cell.toml")).expect("the shipped cell")
}

fn started(command: &str, limit: Duration) -> Result<(Arc<Engine>, Interrupt), EngineError> {
    let interrupt = Interrupt::default();
    let call = Call { command: command.into(), limit };
    let engine = Engine::start(call, &cell(), Path::new("."), &["joint".into()], &interrupt)?;
    Ok((engine, interrupt))
}

/// Writes a message without numbers.
fn says(text: &str) -> String {
    says_with(text, &[])
}

/// Writes a message with numbers.
fn says_with(text: &str, numbers: &[f64]) -> String {
    let bytes = frame::bytes(&serde_json::from_str::<Value>(text).expect("JSON"), numbers).expect("short");
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
    end(&[sleeper.trim().to_owned()]);
}

/// Whether a process has ended; its parent may not know yet.
fn is_gone(pid: &str) -> bool {
    let state = std::fs::read_to_string(format!("/proc/{pid}/stat")).unwrap_or_default();
    state.is_empty() || state.contains(") Z ")
}

/// Waits for the end of processes: what was killed takes a moment.
fn end(pids: &[String]) {
    let began = Instant::now();
    while let Some(pid) = pids.iter().find(|pid| !is_gone(pid)) {
        assert!(began.elapsed() < PATIENCE, "{pid} runs");
        std::thread::yield_now();
    }
}

/// Starts a process that leaves group, session and parent, and writes its number into `file`.
fn leaves(file: &Path) -> String {
    format!("(setsid sh -c 'echo $$ >> {}; exec sleep 600' </dev/null >/dev/null 2>&1 &)", file.display())
}

/// The numbers of so many processes, once they are there.
fn numbers(file: &Path, count: usize) -> Vec<String> {
    let began = Instant::now();
    loop {
        let pids: Vec<String> = std::fs::read_to_string(file).unwrap_or_default().lines().map(str::to_owned).collect();
        if pids.len() >= count {
            return pids;
        }
        assert!(began.elapsed() < PATIENCE, "{pids:?}");
        std::thread::yield_now();
    }
}

#[test]
fn what_left_the_engines_group_and_session_ends_with_it_and_what_another_process_started_does_not() {
    let folder = tempfile::tempdir().expect("a folder");
    let [file, other] = ["pids", "other"].map(|name| folder.path().join(name));
    // One process that is silent and given up, and one that ends with its input.
    let silent = format!("{0}; {0}; {1}; sleep 600", leaves(&file), says(HELLO));
    let (engine, _) = started(&silent, Duration::from_secs(5)).expect("a greeting");
    let (beside, _) =
        started(&format!("{}; {}; exec cat >&2", leaves(&other), says(HELLO)), PATIENCE).expect("a greeting");
    let (pids, others) = (numbers(&file, 2), numbers(&other, 1));
    assert!(pids.iter().chain(&others).all(|pid| !is_gone(pid)), "they run");
    assert!(asked(&engine).is_err());
    end(&pids);
    assert!(others.iter().all(|pid| !is_gone(pid)), "{others:?} are another engine's");
    drop(beside);
    end(&others);
}

#[test]
fn states_that_no_arm_has_are_no_answer_and_said_by_name() {
    for (states, says_of_it) in [
        ([0.1, 1e308], "q of joint 1 at 0.001 s is 1e308 rad, beyond 1e6"),
        ([-1e30, 0.1], "q of joint 1 at 0.000 s is -1e30 rad, beyond 1e6"),
        ([0.1, f64::NAN], "a state of the engine is no number: q of joint 1 at 0.001 s"),
        ([f64::NEG_INFINITY, 0.1], "a state of the engine is no number: q of joint 1 at 0.000 s"),
    ] {
        let answer = says_with(r#"{"message":"states"}"#, &states);
        let (engine, interrupt) =
            started(&format!("{}; {answer}; cat >&2", says(HELLO)), PATIENCE).expect("a greeting");
        let error = asked(&engine).expect_err("no states");
        assert!(matches!(&error, NoStates::Impossible(why) if why.contains(says_of_it)), "{error}");
        assert!(engine.failure().is_none() && !interrupt.cancelled(), "others may do");
    }
    let answer = says_with(r#"{"message":"states"}"#, &[-0.0, 5e-324]);
    let (engine, _) = started(&format!("{}; {answer}; cat >&2", says(HELLO)), PATIENCE).expect("a greeting");
    assert_eq!(*asked(&engine).expect("states"), [0.0, 5e-324]);
}

#[test]
fn an_answer_of_more_numbers_than_were_asked_for_is_refused_before_they_are_read() {
    let text = r#"{"message":"states"}"#;
    let lengths = [text.len() as u32, 1 << 27].map(u32::to_le_bytes).concat();
    let octal: String = lengths.iter().map(|byte| format!("\\{byte:03o}")).collect();
    for before in [String::new(), format!("{}; ", says(HELLO))] {
        // Nothing of the numbers ever comes.
        let begun = started(&format!("{before}printf '{octal}'; printf '{text}'; sleep 600"), PATIENCE);
        let error = match begun {
            Ok((engine, _)) => asked(&engine).expect_err("too many").to_string(),
            Err(error) => error.to_string(),
        };
        assert!(error.contains("begins an answer of 134217728 numbers where fewer"), "{error}");
    }
}

#[test]
fn an_engine_that_ends_in_the_middle_of_a_long_line_is_quoted_in_a_short_one() {
    let script = format!("{}; head -c 20000000 /dev/zero | tr '\\0' x >&2; exit 7", says(HELLO));
    let (engine, _) = started(&script, PATIENCE).expect("a greeting");
    let error = asked(&engine).expect_err("it dies").to_string();
    assert!(error.contains(": xxx") && error.contains("exit status: 7"), "{error}");
    assert!(error.len() < script.len() + 500, "{} letters", error.len());
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
