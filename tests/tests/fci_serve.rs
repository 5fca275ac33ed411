//! The bridge on the served robot, in processes of their own: what is captured over the Franka Control Interface is what
//! the twin of that cell does under the same commands.

use std::net::{TcpListener, TcpStream};
use std::time::Duration;
use tests::{Cell, Program};

/// Starts a robot that waits for its client, and returns where it listens.
fn serve(cell: &Cell, more: &[&str]) -> (Program, String) {
    let port = TcpListener::bind("127.0.0.1:0").and_then(|l| l.local_addr()).expect("a free port").port().to_string();
    let arguments = ["serve", "--cell", "{cell}", "--port", &port, "--no-hand", "--lock-step", "--json"];
    let arguments = [&arguments, more].concat();
    let mut robot = cell.start("rt_bridge", &arguments);
    let address = format!("127.0.0.1:{port}");
    Cell::until("a robot that listens", Duration::from_secs(20), || {
        assert!(robot.is_running(), "the robot ended before it listened");
        TcpStream::connect(&address).is_ok()
    });
    (robot, address)
}

#[test]
fn an_excitation_captured_over_the_interface_is_what_the_twin_does() {
    let cell = Cell::shipped();
    let (robot, address) = serve(&cell, &[]);
    let arm = format!("fci://{address}");
    let bridge = ["run", "--cell", "{cell}", "--arm", &arm, "--realtime", "ignore", "--json"];
    let bridge = cell.start("rt_bridge", &bridge);
    assert!(cell.wait_for_states(Duration::from_secs(20)), "no states of the served robot");
    let capture = ["capture", "excitation", "--cell", "{cell}", "--clips", "1", "--out", "{dir}/session", "--json"];
    let _captured = cell.start("calibration", &capture).wait(Duration::from_secs(120)).succeeded();
    let bridge = bridge.interrupt().succeeded().json();
    assert_eq!(bridge["faults"].as_array().map(Vec::len), Some(0), "{bridge}");
    let robot = robot.interrupt().succeeded().json();
    assert_eq!([&robot["motions"], &robot["reflexes"], &robot["lost_commands"]], [1, 0, 0], "{robot}");

    let replay = cell.start("twin", &["replay", "{dir}/session", "--json"]);
    let answer = replay.wait(Duration::from_secs(60)).succeeded().json();
    let rms = answer["clips"][0]["joint_rms_rad"].as_array().expect("a number a joint").clone();
    assert_eq!(rms.len(), 7, "{answer}");
    // Encoder noise, single precision, and a law that acts on both: microradians where the motion is tenths of a radian.
    assert!(rms.iter().all(|rms| rms.as_f64() < Some(5e-5)), "{answer}");
}

#[test]
fn a_reflex_in_mid_motion_ends_a_capture_that_the_same_command_continues() {
    let cell = Cell::shipped();
    // Too heavy to be moved about, not to be held: the robot takes it for a collision as soon as it accelerates.
    std::fs::write(cell.path("heavy.toml"), "[[effect]]\nname = \"payload\"\nmass = 3.6\n").expect("a file");
    let capture = |address: &str| {
        let arm = format!("fci://{address}");
        let fixed = ["capture", "excitation", "--cell", "{cell}", "--clips", "1", "--out", "{dir}/session", "--json"];
        let more = ["--realtime", "ignore", "--arm", arm.as_str()];
        cell.start("calibration", &[&fixed[..], &more].concat()).wait(Duration::from_secs(120))
    };
    let (robot, address) = serve(&cell, &["--effects", &cell.text("heavy.toml")]);
    // It sinks under the load until its controller holds it; a motion that began meanwhile would be stopped at once.
    std::thread::sleep(Duration::from_secs(4));
    let stopped = capture(&address);
    assert_eq!(stopped.status.code(), Some(1), "{}", stopped.stderr);
    assert!(stopped.stderr.contains("reflex") && stopped.stderr.contains("is continued"), "{}", stopped.stderr);
    assert_eq!(robot.interrupt().succeeded().json()["reflexes"], 1);
    let clip = cell.start("twin", &["replay", "{dir}/session/clip_00.mcap", "--json"]);
    let left = clip.wait(Duration::from_secs(60)).succeeded().json();
    assert!(
        left["clips"][0]["joint_rms_rad"][1].as_f64() > Some(1e-3),
        "the load is seen in what was recorded: {left}"
    );

    let (robot, address) = serve(&cell, &[]);
    let answer = capture(&address).succeeded().json();
    assert_eq!(answer["clips"][0]["file"], "clip_01.mcap", "{answer}");
    assert_eq!(answer["clips"][0]["kept"], true, "{answer}");
    assert_eq!(robot.interrupt().succeeded().json()["reflexes"], 0);
    let listed = std::fs::read_to_string(cell.path("session/cell.toml")).expect("the session's cell.toml");
    assert!(listed.contains("clip_01.mcap") && !listed.contains("clip_00.mcap"), "{listed}");
}
