//! The plan of the house: what stands at the top of the tree, who may need whom, and of what there is only one.

use std::collections::BTreeSet;
use tests::modules::{module, needed, paths};
use tests::sources::{Source, below, product_without_tests};
use tests::texts::root;

/// What stands at the top of the tree and may hold code.
const TOP: [&str; 11] = [
    "adapters",
    "calibration",
    "config",
    "docs",
    "fuzz",
    "python",
    "rt_bridge",
    "shared_mem",
    "tests",
    "twin",
    "twinalign",
];
/// How files with code end.
const CODE: [&str; 7] = ["c", "cpp", "js", "py", "rs", "sh", "wgsl"];

/// A crate of the product.
struct Crate {
    folder: &'static str,
    /// As paths call it.
    name: &'static str,
    /// The crates of the house that it may need.
    needs: &'static [&'static str],
}

/// The crates from the ground up: each needs those before it alone, and of them the listed ones.
const CRATES: [Crate; 18] = [
    Crate { folder: "shared_mem", name: "shared_mem", needs: &[] },
    Crate { folder: "shared_mem/import", name: "import", needs: &["shared_mem"] },
    Crate { folder: "twin/urdf", name: "urdf_rs", needs: &[] },
    Crate { folder: "twin/splat", name: "splat", needs: &["shared_mem"] },
    Crate { folder: "twin/fusion", name: "fusion", needs: &["splat"] },
    Crate { folder: "twin/depth", name: "depth", needs: &["shared_mem"] },
    Crate { folder: "twin/reconstruct", name: "reconstruct", needs: &["depth", "fusion", "shared_mem", "splat"] },
    Crate { folder: "twin", name: "twin", needs: &["reconstruct", "shared_mem", "splat", "urdf_rs"] },
    Crate { folder: "rt_bridge/link", name: "link", needs: &["shared_mem"] },
    Crate { folder: "rt_bridge", name: "rt_bridge", needs: &["link", "shared_mem", "twin"] },
    Crate { folder: "calibration/inference", name: "inference", needs: &["shared_mem", "twin"] },
    Crate { folder: "calibration/vision", name: "vision", needs: &["inference", "shared_mem", "twin"] },
    Crate { folder: "calibration/capture", name: "capture", needs: &["inference", "shared_mem", "twin"] },
    Crate { folder: "calibration/evaluation", name: "evaluation", needs: &["shared_mem", "twin"] },
    Crate { folder: "calibration/worlds", name: "worlds", needs: &["capture", "shared_mem", "twin"] },
    Crate {
        folder: "calibration",
        name: "calibration",
        needs: &["capture", "evaluation", "import", "inference", "shared_mem", "twin", "vision", "worlds"],
    },
    Crate {
        folder: "calibration/tools",
        name: "tools",
        needs: &["calibration", "inference", "shared_mem", "twin", "vision", "worlds"],
    },
    Crate { folder: "twinalign", name: "twinalign", needs: &["calibration", "rt_bridge", "shared_mem", "twin"] },
];

/// The rooms of `inference` and `calibration` from the ground up: a room needs those of the lines above it, and none of its own
/// line. What lies in a room belongs to it unless it is a room itself.
const FLOORS: &[&[&str]] = &[
    &["inference/statistics", "inference/seed", "inference/interrupt"],
    &["inference/kept"],
    &["inference/engine", "inference/estimate"],
    &["inference/likelihood"],
    &["inference/admit", "inference/controller", "inference/object_fit", "inference/witness"],
    &["calibration/words"],
    &["calibration/answer"],
    &["calibration/identify/error"],
    &["calibration/identify/options", "calibration/identify/used"],
    &["calibration/identify/work", "calibration/identify/finding", "calibration/identify/figures"],
    &["calibration/identify/run"],
    &["calibration/identify/arm", "calibration/identify/joint", "calibration/identify/object"],
    &["calibration/diagnose/ground"],
    &["calibration/diagnose/criteria", "calibration/diagnose/known_gains"],
    &["calibration/diagnose/library"],
    &["calibration/diagnose/fit"],
    &["calibration/diagnose/work"],
    &["calibration/diagnose/select"],
    &["calibration/diagnose/judge"],
    &["calibration/diagnose/propose"],
    &["calibration/diagnose/search"],
    &["calibration/diagnose/conclude"],
    &["calibration/diagnose/against"],
    &["calibration/identify", "calibration/diagnose"],
    &["calibration/page"],
    &["calibration/benchmark"],
    &["calibration/check", "calibration/study", "calibration/model", "calibration/init", "calibration/acting"],
    &["calibration/report", "calibration/sweep", "calibration/demonstrations", "calibration/keys"],
    &["calibration/demo"],
    &["calibration/cli"],
];

/// Clients of the same engine: neither needs the other.
const PEERS: [&str; 2] = ["calibration/identify", "calibration/diagnose"];

/// An idea that is to stand in one file of the product.
struct One {
    idea: &'static str,
    /// Where it stands in code.
    said: &'static str,
    /// Files that hold it today: one more is refused.
    files: usize,
}

const ONES: &[One] = &[
    // A check asks for a value that was measured, and not for the mean of two.
    One { idea: "the median", said: "fn median(", files: 2 },
    One { idea: "Student's t", said: "StudentsT::new(", files: 1 },
    One { idea: "the penalty of random effects", said: "fn penalty(", files: 2 },
    One { idea: "the rows of an arm's clips", said: "struct ArmClips", files: 1 },
    One { idea: "the loop of damped steps", said: "fn descend<", files: 1 },
    One { idea: "admission", said: "fn admit(", files: 1 },
    One { idea: "the rule of the same command", said: "fn by_command", files: 1 },
    One { idea: "forward selection", said: "fn forward<", files: 1 },
    One { idea: "the damped step within bounds", said: "fn bounded_step(", files: 1 },
    One { idea: "the fit of a pose", said: "pub struct Equations", files: 1 },
    One { idea: "inverse kinematics", said: "fn pose_difference(", files: 1 },
    One { idea: "the distortion of a lens", said: "enum Distortion", files: 1 },
];

/// The longest room that a module lies in.
fn room(path: &str) -> Option<&'static str> {
    let holds = |room: &str| path == room || path.strip_prefix(room).is_some_and(|rest| rest.starts_with('/'));
    FLOORS.iter().copied().flatten().copied().filter(|room| holds(room)).max_by_key(|room| room.len())
}

fn floor(room: &str) -> usize {
    FLOORS.iter().position(|rooms| rooms.contains(&room)).expect("a room of the table")
}

/// The module of a file with the name of its crate before it, for the two crates that have rooms.
fn module_of(file: &str) -> Option<Vec<String>> {
    let rooms = [("inference", "calibration/inference/src/"), ("calibration", "calibration/src/")];
    let (name, own) = rooms.iter().find_map(|(name, folder)| Some((*name, module(file.strip_prefix(folder)?)?)))?;
    Some([vec![name.to_owned()], own].concat())
}

/// Every arrow between rooms, each with a file that it starts in.
fn arrows() -> BTreeSet<[String; 3]> {
    let files = product_without_tests(&root());
    let modules: Vec<(Vec<String>, &Source)> =
        files.iter().filter_map(|source| Some((module_of(&source.file)?, source))).collect();
    let known: BTreeSet<&[String]> =
        modules.iter().flat_map(|(own, _)| (1..=own.len()).map(|length| &own[..length])).collect();
    let mut found = BTreeSet::new();
    for (own, source) in &modules {
        let text = source.code_text();
        let inside = needed(&own[1..], &text).into_iter().map(|path| [vec![own[0].clone()], path].concat());
        let of_inference = paths(&text, "inference").into_iter();
        let Some(from) = room(&own.join("/")) else { continue };
        for mut to in inside.chain(of_inference) {
            while !known.contains(&to[..]) {
                to.pop();
            }
            if let Some(to) = room(&to.join("/")).filter(|to| *to != from) {
                found.insert([from.to_owned(), to.to_owned(), source.file.clone()]);
            }
        }
    }
    found
}

/// Whether the plan allows an arrow: downwards, and from no peer to another.
fn is_allowed(from: &str, to: &str) -> bool {
    let [own, other] = [from, to].map(|room| PEERS.iter().position(|peer| room.starts_with(peer)));
    floor(to) < floor(from) && (own == other || own.is_none() || other.is_none())
}

#[test]
fn code_stands_in_the_houses_of_the_plan_alone() {
    let ends_as_code = |name: &str| name.rsplit_once('.').is_some_and(|(_, end)| CODE.contains(&end));
    for entry in std::fs::read_dir(root()).expect("the tree").map(|entry| entry.expect("an entry")) {
        let name = entry.file_name().to_string_lossy().into_owned();
        if entry.path().is_dir() {
            let is_known = TOP.contains(&name.as_str()) || name.starts_with('.') || name == "target";
            assert!(is_known, "{name}/ stands at the top of the tree; houses are {}", TOP.join(", "));
        } else {
            assert!(!ends_as_code(&name), "{name} is code at the top of the tree");
        }
    }
    for house in ["config", "docs"] {
        let code = below(&root(), house);
        assert!(code.is_empty(), "{house} holds code: {:?}", code.iter().map(|s| &s.file).collect::<Vec<_>>());
    }
}

#[test]
fn every_crate_stands_in_the_table_and_needs_what_it_says() {
    let files = product_without_tests(&root());
    for (number, own) in CRATES.iter().enumerate() {
        if !root().join(own.folder).exists() {
            eprintln!("{} is not there: its line can go", own.folder);
            continue;
        }
        let manifest = std::fs::read_to_string(root().join(own.folder).join("Cargo.toml")).expect("a manifest");
        let before = &CRATES[..number];
        for need in own.needs {
            assert!(before.iter().any(|other| other.name == *need), "{} needs {need}, which stands above it", own.name);
        }
        // A program alone is needed by nobody.
        let is_needed = |other: &&Crate| root().join(other.folder).join("src/lib.rs").exists();
        let foreign = |other: &&Crate| other.name != own.name && !own.needs.contains(&other.name);
        for other in CRATES.iter().filter(is_needed).filter(foreign) {
            // What features are called is no need.
            let features = manifest
                .split_once("[features]")
                .map_or("", |(_, rest)| rest.split_once("\n[").map_or(rest, |(features, _)| features));
            let declared = manifest.replace(features, "").lines().any(|line| {
                let name = line.split(['.', ' ', '=']).next().unwrap_or("").replace('-', "_");
                name == other.name && line.contains('=')
            });
            assert!(!declared, "{}/Cargo.toml names {}, which {} may not need", own.folder, other.name, own.name);
            let sources = format!("{}/src/", own.folder);
            for source in files.iter().filter(|source| source.file.starts_with(&sources)) {
                // A module may have a crate's name, as in `crate::link`.
                let text = source.code_text();
                let used = text.lines().any(|line| {
                    let path = format!("{}::", other.name);
                    let used = line.trim_start().strip_prefix("use ").is_some_and(|used| used.starts_with(&path));
                    used && !text.contains(&format!("mod {};", other.name))
                });
                assert!(!used, "{} needs {}, which {} may not", source.file, other.name, own.name);
            }
        }
    }
    let members = std::fs::read_to_string(root().join("Cargo.toml")).expect("Cargo.toml");
    let members = members.split_once("members = [").and_then(|(_, rest)| rest.split_once(']')).expect("members").0;
    for member in members.split('"').skip(1).step_by(2).filter(|member| *member != "tests") {
        assert!(CRATES.iter().any(|own| own.folder == member), "{member} stands in no line of the table");
    }
}

#[test]
fn every_module_of_inference_and_calibration_lies_in_a_room() {
    for source in product_without_tests(&root()) {
        let Some(own) = module_of(&source.file).filter(|own| own.len() > 1) else { continue };
        assert!(room(&own.join("/")).is_some(), "{} lies in no room of the table", source.file);
    }
}

#[test]
fn rooms_need_those_below_them_alone() {
    let arrows = arrows();
    let against = arrows.iter().filter(|[from, to, _]| !is_allowed(from, to));
    let against: Vec<String> = against.map(|[from, to, file]| format!("{from} -> {to} ({file})")).collect();
    assert!(against.is_empty(), "arrows against the plan:\n{}", against.join("\n"));
}

#[test]
fn of_each_idea_there_is_one() {
    let files = product_without_tests(&root());
    for One { idea, said, files: known } in ONES {
        let says = |source: &&Source| source.code().any(|line| line.contains(said));
        let found: Vec<&str> = files.iter().filter(says).map(|source| source.file.as_str()).collect();
        assert!(found.len() <= *known, "{idea} stands once more: {}", found.join(", "));
        if found.len() < *known {
            eprintln!("{idea} stands in {} files, and not in {known}: its number can go down", found.len());
        }
    }
}
