//! The page of the first day with a robot, typed as it stands against the served robot.

use std::net::{TcpListener, TcpStream};
use std::time::Duration;
use tests::{Cell, Finished, Program};

const PAGE: &str = include_str!("../../docs/first_day.md");
/// Where the page's robot is.
const ROBOT: &str = "fci://172.16.0.2";
/// What the page's commands write: it lies in the folder of the test.
const FILES: [&str; 4] = ["cell.toml", "session", "arm.toml", "report.html"];

/// The words of each command of the page.
fn commands() -> Vec<Vec<&'static str>> {
    let blocks = PAGE.split("```sh\n").skip(1).filter_map(|rest| rest.split("```").next());
    blocks.flat_map(str::lines).map(|line| line.split_whitespace().collect()).collect()
}

/// A laboratory in which the page is typed.
struct Lab {
    cell: Cell,
    robot: String,
}

impl Lab {
    fn start(&self, words: &[&str], more: &[&str]) -> Program {
        let typed = words[1..].iter().map(|word| match *word {
            ROBOT => self.robot.clone(),
            file if FILES.contains(&file) => self.cell.text(&format!("lab/{file}")),
            word => word.to_owned(),
        });
        let typed: Vec<String> = typed.chain(more.iter().map(|word| (*word).to_owned())).collect();
        self.cell.start(words[0], &typed.iter().map(String::as_str).collect::<Vec<_>>())
    }

    fn done(&self, words: &[&str], more: &[&str]) -> Finished {
        self.start(words, more).wait(Duration::from_secs(300))
    }
}

#[test]
fn every_command_of_the_page_does_what_the_page_says() {
    let cell = Cell::shipped();
    std::fs::create_dir(cell.path("lab")).expect("a folder");
    let port = TcpListener::bind("127.0.0.1:0").and_then(|l| l.local_addr()).expect("a free port").port().to_string();
    let served =
        cell.start("rt_bridge", &["serve", "--cell", "{cell}", "--port", &port, "--no-hand", "--lock-step", "--json"]);
    let address = format!("127.0.0.1:{port}");
    Cell::until("a robot that listens", Duration::from_secs(20), || TcpStream::connect(&address).is_ok());
    let lab = Lab { cell, robot: format!("fci://{address}") };

    let (mut bridge, mut moving): (Option<Program>, Option<Program>) = (None, None);
    let mut typed = Vec::new();
    let commands = commands();
    for (words, next) in commands.iter().zip(commands.iter().skip(1).map(Some).chain([None])) {
        let verb = words[..2].join(" ");
        match verb.as_str() {
            // Whether this machine is one for robots is no question of this test; that it is answered is.
            "rt_bridge doctor" => {
                let said = lab.done(words, &[]).stdout;
                let last = said.trim_end().lines().last().unwrap_or_default().to_owned();
                assert!(last.starts_with("ready") || last.starts_with("not ready"), "{said}");
            }
            "rt_bridge run" => {
                bridge = Some(lab.start(words, &["--realtime", "ignore", "--json"]));
                assert!(lab.cell.wait_for_states(Duration::from_secs(20)), "no states of the served robot");
            }
            "rt_bridge target" if next.is_some_and(|next| next[..2] == ["rt_bridge", "stop"]) => {
                moving = Some(lab.start(words, &[]));
                std::thread::sleep(Duration::from_millis(1500));
            }
            "rt_bridge stop" => {
                lab.done(words, &[]).succeeded();
                let ended = moving.take().expect("something to stop").wait(Duration::from_secs(20));
                assert_eq!(
                    ended.status.code(),
                    Some(1),
                    "what moved the arm says that it was stopped: {}",
                    ended.stderr
                );
                std::thread::sleep(Duration::from_millis(600));
            }
            "calibration capture" => {
                let answer = lab.done(words, &["--duration", "3", "--json"]).succeeded().json();
                assert_eq!(answer["clips"].as_array().map(Vec::len), Some(8), "{answer}");
            }
            "calibration diagnose" => {
                let said = lab.done(words, &[]).succeeded().stdout;
                assert!(said.contains("No gap"), "the twin and the served robot are one cell: {said}");
            }
            _ => drop(lab.done(words, &[]).succeeded()),
        }
        typed.push(verb);
    }
    let run = bridge.expect("a bridge").interrupt().succeeded().json();
    assert_eq!(run["faults"].as_array().map(Vec::len), Some(0), "{run}");
    assert_eq!(served.interrupt().succeeded().json()["reflexes"], 0);
    assert!(typed.len() >= 9, "{typed:?}");
    for file in FILES {
        assert!(lab.cell.path(&format!("lab/{file}")).exists(), "the page makes {file}");
    }
}
