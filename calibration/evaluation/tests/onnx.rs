//! A policy in an ONNX file. The model is written here, byte by byte: one that repeats the state it sees and adds the mean of two
//! pictures to each number. `ORT_DYLIB_PATH` has to name ONNX Runtime's library.

mod model;

use evaluation::policy::{ActionKind, Array, Keys, Policy, Seen, Source};
use evaluation::rollout::{Asking, run};
use model::{bytes, node, number, tensor, written};
use rmpv::Value;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use twin::task::{Acting, Numbers, Signs, Task};

/// ONNX version 8, operators of version 13.
fn model(state: &str, rows: u64, actions: u64) -> Vec<u8> {
    let flat = bytes(5, &[bytes(1, b"keepdims"), number(3, 0), number(20, 2)].concat());
    let graph = [
        node("ReduceMean", &["observation.images.front"], "mean", &flat),
        node("Add", &[state, "mean"], "action", &[]),
        bytes(2, b"policy"),
        tensor(11, state, &[1, actions]),
        tensor(11, "observation.images.front", &[1, 2, 3, rows, 320]),
        tensor(12, "action", &[1, actions]),
    ];
    [number(1, 8), bytes(7, &graph.concat()), bytes(8, &number(2, 13))].concat()
}

fn open(file: PathBuf) -> Result<Policy, String> {
    Policy::open(&Source::Onnx(file)).map(|policy| policy.expect("no script")).map_err(|error| error.to_string())
}

fn task() -> Arc<Task> {
    let file = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../twin/tasks/pick_carrot.toml");
    Arc::new(Task::read(&file).expect("a task that ships"))
}

/// What is seen at a start.
fn observation(task: &Arc<Task>) -> Value {
    let acting = Acting::begin(task, 4).expect("a start");
    let (now, shown) = (acting.now().expect("a moment"), acting.seen().expect("a moment"));
    let joints = shown.arm.as_ref().map(|arm| &arm.q);
    let pictures = task.cameras().iter().map(|camera| Some(task.view(camera).draw(&shown.poses, joints))).collect();
    let seen = Seen { task, numbers: &Numbers::of(task), now, surroundings: true, pictures };
    seen.message(&Keys::default(), &mut Signs::default())
}

fn numbers(observation: &Value, key: &str) -> Vec<f32> {
    let pairs = observation.as_map().expect("a map");
    let found = pairs.iter().find(|(name, _)| name.as_str() == Some(key)).expect("a key that is seen");
    Array::read(&found.1).expect("an array").values
}

#[test]
#[ignore = "needs ONNX Runtime: ORT_DYLIB_PATH=LIBRARY cargo test --release --workspace --test onnx -- --ignored"]
fn a_network_gets_what_is_seen_and_its_output_is_the_action() {
    let (folder, task) = (tempfile::tempdir().expect("a folder"), task());
    let mut policy = open(written(folder.path(), "a.onnx", &model("observation.state", 240, 15))).expect("a model");
    let seen = observation(&task);
    let state = numbers(&seen, "observation/state");
    let picture = numbers(&seen, "observation/image/front");
    let mean = picture.iter().map(|value| f64::from(*value)).sum::<f64>() / picture.len() as f64 / 255.0;
    let actions = policy.actions(&seen).expect("actions");
    let [action]: [&[f32]; 1] = actions.iter().collect::<Vec<_>>().try_into().expect("one action");
    for (action, state) in action.iter().zip(&state) {
        assert!((f64::from(action - state) - mean).abs() < 1e-4, "{action} of {state} and {mean}");
    }
    // Moving to where everything is, plus 0.3 to 0.6 rad, is an episode that ends without success.
    let asking = Asking { keys: Keys::default(), actions: ActionKind::Recorded, rate: 20, chunk: None };
    let (outcome, recorded) = run(&task, 4, &mut policy, &asking, || false).expect("an episode");
    assert!(!outcome.success && !recorded.moments.is_empty(), "{outcome:?}");
}

#[test]
#[ignore = "needs ONNX Runtime: ORT_DYLIB_PATH=LIBRARY cargo test --release --workspace --test onnx -- --ignored"]
fn a_file_of_no_use_is_an_error_in_a_line_that_says_why() {
    let (folder, task) = (tempfile::tempdir().expect("a folder"), task());
    let of = |name: &str, bytes: &[u8]| {
        let opened = open(written(folder.path(), name, bytes));
        opened.and_then(|mut policy| policy.actions(&observation(&task)).map_err(|error| error.to_string()))
    };
    let whole = model("observation.state", 240, 15);
    let cases = [
        (of("empty.onnx", b""), "no policy that can be computed"),
        (of("cut.onnx", &whole[..whole.len() / 2]), "no policy that can be computed"),
        (of("named.onnx", &model("tokens", 240, 15)), "say which it is with --key OURS=tokens"),
        (of("narrow.onnx", &model("observation.state", 240, 14)), "has the shape [1, 14], where [.., 15] is seen"),
        (of("low.onnx", &model("observation.state", 120, 15)), "where [.., 3, 240, 320] or [.., 240, 320, 3] is seen"),
    ];
    for (found, words) in cases {
        let error = found.expect_err(words);
        assert!(error.contains(words) && !error.contains('\n'), "{error}");
    }
}
