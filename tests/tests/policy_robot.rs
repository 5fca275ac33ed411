//! A policy on the arm of a running bridge: what it sees is what the arm does, and what it asks for is gone for within the bridge's limits.

use evaluation::policy::{Array, pack, unpack};
use rmpv::Value;
use std::net::TcpListener;
use std::sync::{Arc, Mutex};
use std::time::Duration;
use tests::Cell;
use tests::texts::root;
use tungstenite::Message;

fn entry<'a>(observation: &'a Value, key: &str) -> &'a Value {
    let pairs = observation.as_map().expect("a map");
    &pairs.iter().find(|(found, _)| found.as_str() == Some(key)).unwrap_or_else(|| panic!("no {key}")).1
}

/// Serves one client; `act` gets the joints that the arm has.
fn serve(act: impl Fn(&[f32]) -> Vec<f32> + Send + 'static) -> (String, Arc<Mutex<Vec<Vec<f32>>>>) {
    let listener = TcpListener::bind("127.0.0.1:0").expect("a port");
    let address = format!("ws://{}", listener.local_addr().expect("an address"));
    let seen = Arc::new(Mutex::new(Vec::new()));
    let noted = Arc::clone(&seen);
    std::thread::spawn(move || {
        let (stream, _) = listener.accept().expect("a client");
        let mut socket = tungstenite::accept(stream).expect("a handshake");
        socket.send(Message::Binary(pack(&Value::Map(Vec::new())).into())).expect("a client");
        while let Ok(Message::Binary(bytes)) = socket.read() {
            let observation = unpack(&bytes).expect("an observation");
            assert!(observation.as_map().is_some_and(|map| {
                map.iter().all(|(key, _)| key.as_str() != Some("observation/environment_state"))
            }));
            let joints = Array::read(entry(&observation, "observation/joint_position")).expect("an array").values;
            let row = act(&joints).iter().map(|value| Value::from(*value)).collect();
            noted.lock().expect("a list").push(joints);
            let rows = Value::Array(vec![Value::Array(row)]);
            let answer = pack(&Value::Map(vec![("actions".into(), rows)]));
            // Longer than a bridge waits for a stream that falls silent.
            std::thread::sleep(Duration::from_millis(250));
            if socket.send(Message::Binary(answer.into())).is_err() {
                break;
            }
        }
    });
    (address, seen)
}

#[test]
fn a_policy_acts_on_the_arm_of_a_running_bridge_and_what_is_beyond_its_limits_ends_the_episode() {
    let cell = Cell::shipped();
    let bridge = cell.start_bridge(&["--gripper", "sim"]);
    let text = std::fs::read_to_string(root().join("twin/tasks/pick_carrot.toml")).expect("a task that ships");
    std::fs::write(cell.path("task.toml"), text.replace("horizon = 10.0", "horizon = 2.5")).expect("room");
    let run = |address: &str, more: &[&str]| {
        let mut line =
            vec!["policy", "run", "--task", "{dir}/task.toml", "--policy", address, "--robot", "--cell", "{cell}"];
        line.extend(["--actions", "joints", "--rate", "10", "--json"]);
        line.extend(more);
        cell.start("calibration", &line).wait(Duration::from_secs(90)).succeeded().json()
    };
    let first = Mutex::new(None);
    let (address, seen) = serve(move |joints| {
        let mut first = first.lock().expect("joints");
        let mut wanted: Vec<f32> = first.get_or_insert_with(|| joints.to_vec()).clone();
        wanted[0] += 0.15;
        wanted.push(0.5);
        wanted
    });
    let answer = run(&address, &["--record", "{dir}/tried"]);
    let episode = &answer["episodes"][0];
    assert!(episode["fault"].is_null() && episode["success"].is_null(), "{answer}");
    assert!(episode["duration_s"].as_f64().is_some_and(|seconds| seconds >= 2.5), "{answer}");
    let seen = seen.lock().expect("a list");
    let went = seen.last().expect("observations")[0] - seen[0][0];
    assert!((went - 0.15).abs() < 0.03, "{went}");
    assert!(Cell::size(&cell.path("tried/robot_000.mcap")) > 10_000);

    let (address, _) = serve(|joints| joints.iter().map(|_| 9.0).chain([0.0]).collect());
    let answer = run(&address, &[]);
    assert!(answer["episodes"][0]["fault"].is_string(), "{answer}");
    // What is no target at all is never sent, and nothing is waited for.
    let (address, _) = serve(|joints| joints.iter().map(|_| 3e38).chain([0.0]).collect());
    let answer = run(&address, &[]);
    let fault = answer["episodes"][0]["fault"].as_str().unwrap_or("none");
    assert!(fault.contains("no target may be"), "{answer}");
    assert!(bridge.interrupt().status.success());
}
