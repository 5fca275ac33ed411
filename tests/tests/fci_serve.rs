//! The bridge on the served robot, in processes of their own: what is captured over the Franka Control Interface is what
//! the twin of that cell does under the same commands.

use std::net::{TcpListener, TcpStream};
use std::time::Duration;
use tests::{Cell, Program};

/// Starts a robot that waits for its client, and returns where it listens.
fn serve(cell: &Cell) -> (Program, String) {
    let port = TcpListener::bind("127.0.0.1:0").and_then(|l| l.local_addr()).expect("a free port").port().to_string();
    let arguments = ["serve", "--cell", "{cell}", "--port", &port, "--no-hand", "--lock-step", "--json"];
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
    let (robot, address) = serve(&cell);
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
