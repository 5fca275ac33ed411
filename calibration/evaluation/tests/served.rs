//! A policy behind openpi's protocol: a small server in this process plays what a script would do, or answers with nonsense.

mod server;

use evaluation::policy::{ActionKind, Array, Keys, Policy, Served, pack};
use evaluation::rollout::{Asking, RunError, run};
use rmpv::Value;
use server::{actions, entry, serve};
use std::path::Path;
use std::sync::Arc;
use tungstenite::Message;
use twin::task::{Numbers, Run, Signs, Task};

/// What a server answers; `None` closes the connection.
type Answer = fn() -> Option<Message>;

fn task() -> Arc<Task> {
    let file = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../twin/tasks/pick_carrot.toml");
    Arc::new(Task::read(&file).expect("a task that ships"))
}

fn asking(keys: &[&str], task: &Task) -> Asking {
    let keys: Vec<String> = keys.iter().map(|key| (*key).to_owned()).collect();
    let keys = Keys::read(&keys, task).expect("keys");
    Asking { keys, actions: ActionKind::Recorded, rate: 20, chunk: Some(4) }
}

#[test]
fn a_served_policy_sees_pictures_and_numbers_and_what_it_asks_for_is_done() {
    let task = task();
    let (numbers, mut signs) = (Numbers::of(&task), Signs::default());
    let (_, shown) = task.demonstration(&Run { seed: 4, duration: task.horizon(), noise: 0.0 }).expect("a script");
    let by_heart: Vec<Vec<f32>> = shown
        .moments
        .windows(6)
        .step_by(5)
        .map(|rows| {
            let _now = numbers.state(&rows[0], &mut signs);
            numbers.action(&rows[5], &signs)
        })
        .collect();
    let mut asked = 0;
    let address = serve(move |observation| {
        let state = Array::read(entry(observation, "observation/state")).expect("an array");
        assert_eq!(state.shape, [15]);
        assert_eq!(Array::read(entry(observation, "seen")).expect("a picture").shape, [240, 320, 3]);
        assert_eq!(Array::read(entry(observation, "observation/depth/front")).expect("a picture").shape, [240, 320]);
        let gripper = Array::read(entry(observation, "observation/gripper_position")).expect("an array");
        assert!((0.0..=1.0).contains(&gripper.values[0]));
        assert!(entry(observation, "prompt").as_str().is_some_and(|prompt| prompt.contains("carrot")));
        // Two more than are taken of a chunk.
        let chunk: Vec<Vec<f32>> =
            (asked..asked + 6).map(|i: usize| by_heart[i.min(by_heart.len() - 1)].clone()).collect();
        asked += 4;
        Some(actions(&chunk))
    });
    let policy = Served::connect(&address).expect("a policy");
    assert_eq!(entry(policy.metadata(), "name").as_str(), Some("test"));
    let mut policy = Policy::Served(policy);
    let (outcome, recorded) =
        run(&task, 4, &mut policy, &asking(&["image/front=seen"], &task), || false).expect("an episode");
    assert!(outcome.success && outcome.progress == 1.0 && outcome.stills.is_empty(), "{outcome:?}");
    assert!(recorded.info.success && recorded.moments.len() > 500);
}

fn answer(actions: Value) -> Message {
    Message::Binary(pack(&Value::Map(vec![("actions".into(), actions)])).into())
}

/// An array of bytes, as numpy's come.
fn bytes(shape: [u64; 2]) -> Value {
    let key = |key: &str| Value::Binary(key.as_bytes().to_vec());
    Value::Map(vec![
        (key("__ndarray__"), true.into()),
        (key("data"), Value::Binary(vec![0; (shape[0] * shape[1]) as usize])),
        (key("dtype"), "|u1".into()),
        (key("shape"), Value::Array(shape.map(Value::from).to_vec())),
    ])
}

#[test]
fn whatever_a_server_answers_is_an_error_in_a_line_or_an_action() {
    let task = task();
    let ask = |answer: Answer| {
        let mut policy = Policy::Served(Served::connect(&serve(move |_| answer())).expect("a policy"));
        run(&task, 0, &mut policy, &asking(&[], &task), || false)
    };
    let cases: [(Answer, &str); 9] = [
        (|| Some(Message::Text("Traceback\n  File x\nValueError: no such key\n".into())), "ValueError: no such key"),
        (|| None, "fell silent"),
        (|| Some(Message::Binary(vec![0x92, 0x01].into())), "no msgpack"),
        (|| Some(Message::Binary(pack(&Value::Map(Vec::new())).into())), "no `actions`"),
        (|| Some(actions(&[vec![1.0, 2.0]])), "an action has 15 numbers"),
        (|| Some(actions(&[vec![f32::NAN; 15]])), "of an action is NaN"),
        // A row of its own for each number, in bytes and in lists, and a value for each byte.
        (|| Some(answer(bytes([2_000_000, 1]))), "[2000000, 1]; 1048576 numbers at most"),
        (|| Some(answer(Value::Array(vec![bytes([1_000_000, 1]); 2]))), "numbers at most"),
        (|| Some(answer(Value::Array(vec![Value::Array(vec![1.into()]); 1_000_000]))), "1048576 single values"),
    ];
    for (answer, words) in cases {
        let error = ask(answer).expect_err(words).to_string();
        assert!(error.contains(words) && !error.contains('\n'), "{error}");
    }
    // What would harm a robot is no error of the evaluation but a failure of the policy.
    let (outcome, _) = ask(|| Some(actions(&[vec![9.0; 15]]))).expect("an outcome");
    assert!(!outcome.success && outcome.fault.is_some() && !outcome.stills.is_empty(), "{outcome:?}");
    let absent = Served::connect("ws://127.0.0.1:9").expect_err("nobody").to_string();
    assert!(absent.contains("start its server"), "{absent}");
    let policy = Served::connect(&serve(|_| Some(actions(&[vec![0.0; 15]])))).expect("a policy");
    let mut policy = Policy::Served(policy);
    assert!(matches!(run(&task, 0, &mut policy, &asking(&[], &task), || true), Err(RunError::Interrupted)));
}
