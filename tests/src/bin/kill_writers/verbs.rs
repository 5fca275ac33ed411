//! The verbs that write, and what they need to be given.

use std::path::Path;
use std::time::Duration;
use tests::{Program, lab_cell};

/// Clips of the session that everything is made from: a diagnosis needs as many.
const CLIPS: &str = "5";

/// What a verb does where its outputs are there already.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Again {
    /// It replaces them.
    Replaces,
    /// It refuses; they have to be removed.
    WantsNewOutputs,
    /// It refuses a folder in which anything is.
    WantsNewFolder,
    /// It goes on with them.
    GoesOn,
}

/// A verb with arguments; `{out}` in them is the folder of its outputs.
pub(crate) struct Verb {
    pub(crate) name: &'static str,
    pub(crate) program: &'static str,
    pub(crate) arguments: Vec<String>,
    /// Files, and folders that are sessions.
    pub(crate) outputs: &'static [&'static str],
    pub(crate) again: Again,
    /// Earliest kill [share of its duration].
    pub(crate) from: f64,
    pub(crate) kills: u32,
    pub(crate) full: u32,
}

impl Verb {
    fn new(name: &'static str, program: &'static str, line: &str, outputs: &'static [&'static str]) -> Self {
        let arguments = line.split_whitespace().map(str::to_owned).collect();
        Self { name, program, arguments, outputs, again: Again::Replaces, from: 0.7, kills: 4, full: 2 }
    }

    /// A verb whose outputs have to be new.
    fn anew(self) -> Self {
        Self { again: Again::WantsNewOutputs, ..self }
    }

    fn times(self, kills: u32, full: u32) -> Self {
        Self { kills, full, ..self }
    }
}

/// Records the session that the verbs work on, and exports it once.
pub(crate) fn material(inputs: &Path, domain: &str) {
    std::fs::create_dir_all(inputs).expect("a folder");
    std::fs::write(inputs.join("cell.toml"), lab_cell()).expect("cell.toml");
    let at = |name: &str| inputs.join(name).display().to_string();
    let run = |program: &str, line: &str| {
        println!("{program} {line}");
        let arguments: Vec<&str> = line.split_whitespace().collect();
        let _done = Program::start(program, domain, &arguments).wait(Duration::from_secs(400)).succeeded();
    };
    let (cell, session) = (at("cell.toml"), at("session"));
    let motion = format!("--clips {CLIPS} --duration 3 --realtime ignore");
    run("calibration", &format!("capture excitation --cell {cell} --out {session} {motion}"));
    run("calibration", &format!("export {session} --to ros2 --out {}", at("bags")));
}

/// Every verb that writes.
pub(crate) fn verbs(inputs: &Path) -> Vec<Verb> {
    let at = |name: &str| inputs.join(name).display().to_string();
    let (cell, session, bags) = (at("cell.toml"), at("session"), at("bags"));
    let scan = std::env::var("TWINALIGN_SCAN").ok().map(|scan| splats(&scan, &cell));
    let mut verbs = clips_and_pictures(&session, &bags);
    verbs.extend(answers(&session, &cell, &at("strokes")));
    verbs.extend(live(&cell));
    verbs.extend(scan);
    verbs
}

/// Verbs that write clips and pictures of a session.
fn clips_and_pictures(session: &str, bags: &str) -> Vec<Verb> {
    let clips: &[&str] =
        &["twin/clip_00.mcap", "twin/clip_01.mcap", "twin/clip_02.mcap", "twin/clip_03.mcap", "twin/clip_04.mcap"];
    let export = |name, from: &str, to: &str| {
        let line = format!("export {from} --to {to} --out {{out}}/new");
        Verb::new(name, "calibration", &line, &["new"]).anew()
    };
    vec![
        Verb::new("replay", "twin", &format!("replay {session} --out {{out}}/twin"), clips).anew().times(6, 2),
        Verb::new(
            "render",
            "twin",
            &format!("render {session} --every 40 --out {{out}} --force"),
            &["frame_00000.png"],
        )
        .times(5, 2),
        export("export-ros2", session, "ros2").times(5, 2),
        export("export-own", bags, "own"),
        export("export-twinaligner", &format!("{session}/clip_00.mcap"), "twinaligner"),
    ]
}

/// Verbs that write what they found.
fn answers(session: &str, cell: &str, strokes: &str) -> Vec<Verb> {
    let verb = |name, line: &str, outputs| Verb::new(name, "calibration", line, outputs);
    let stroke = format!("capture control-hit-slide --cell {cell} --clips 1 --out {strokes} --realtime ignore");
    vec![
        verb(
            "identify-arm",
            &format!("identify arm {session} --out {{out}}/theta.toml --report {{out}}/page.html --force"),
            &["theta.toml", "page.html"],
        )
        .times(6, 2),
        verb(
            "diagnose",
            &format!(
                "diagnose {session} --out {{out}}/diagnosis.json --theta {{out}}/theta.toml --report {{out}}/report.html \
                 --force"
            ),
            &["theta.toml", "diagnosis.json", "report.html"],
        ),
        verb(
            "viewpoint",
            &format!("viewpoint {session} --frames 2 --out {{out}}/cell.toml --picture {{out}}/outline.png --force"),
            &["cell.toml", "outline.png"],
        ),
        verb("preview", &format!("{stroke} --preview {{out}}/next.svg --force"), &["next.svg"]).times(3, 1),
        verb(
            "benchmark",
            &format!("benchmark --cell {cell} --null 1 --report {{out}}/benchmark.html --force"),
            &["benchmark.html"],
        )
        .times(2, 1),
    ]
}

/// Verbs that move the simulated arm. What they record grows, and is judged as far as it was entered into the session.
fn live(cell: &str) -> Vec<Verb> {
    let capture = format!(
        "capture excitation --cell {cell} --arm sim --clips 1 --duration 2 --out {{out}}/session --realtime ignore"
    );
    let run = format!("run --cell {cell} --arm sim --realtime ignore --duration 3 --record {{out}}/clip.mcap");
    let demo: &[&str] = &[
        "demo/cell.toml",
        "demo/hidden_theta.toml",
        "demo/hidden_effect.toml",
        "demo/theta.toml",
        "demo/diagnosis.html",
        "demo/report.html",
        "demo/twin_cell.mcap",
        "demo/twin_found.mcap",
    ];
    let capture = Verb::new("capture", "calibration", &capture, &["session"]).times(5, 0);
    let record = Verb::new("run-record", "rt_bridge", &run, &["clip.mcap"]).anew().times(3, 0);
    let demo = Verb::new("demo", "calibration", "demo --clips 4 --out {out}/demo", demo).times(2, 0);
    vec![
        Verb { again: Again::GoesOn, from: 0.05, ..capture },
        Verb { from: 0.4, ..record },
        Verb { again: Again::WantsNewFolder, from: 0.2, ..demo },
    ]
}

/// The links of a scanned robot.
fn splats(scan: &str, cell: &str) -> Verb {
    let place = "--joints 0.2,-0.6,0.1,-2.2,0.1,1.7,0.6 --start 0,0,0,1,0,0,0,0.41";
    let line = format!("label-splats {scan} --cell {cell} {place} --out {{out}} --force");
    let links: &[&str] = &[
        "link0.ply",
        "link1.ply",
        "link2.ply",
        "link3.ply",
        "link4.ply",
        "link5.ply",
        "link6.ply",
        "link7.ply",
        "scene.ply",
    ];
    Verb::new("label-splats", "twin", &line, links)
}
