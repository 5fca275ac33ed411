//! What the house must look like: one door per big dependency, files that own one idea, a README that tells the truth.

use tests::modules::{circles, module, needs};
use tests::sources;
use tests::texts::{PRODUCT, root};

/// Every Rust file below `folder`, with its path from the workspace's root.
fn sources(folder: &str) -> Vec<(String, String)> {
    sources::below(&root(), folder).into_iter().map(|source| (source.file, source.text)).collect()
}

fn product_sources() -> Vec<(String, String)> {
    PRODUCT.iter().flat_map(|folder| sources(folder)).collect()
}

/// The lines of every product file that are neither tests nor comments.
fn product_lines() -> Vec<(String, Vec<String>)> {
    let lines = |source: &sources::Source| source.code().map(str::to_owned).collect();
    let files = sources::product_without_tests(&root());
    files.iter().map(|source| (source.file.clone(), lines(source))).collect()
}

/// Whether a path begins with `name`: `libfranka::` is another crate than `franka::`.
fn is_named(line: &str, name: &str) -> bool {
    line.match_indices(name).any(|(at, _)| !line[..at].ends_with(|c: char| c.is_alphanumeric() || c == '_'))
}

#[test]
fn each_big_dependency_has_one_door() {
    let doors: [(&str, &[&str]); 35] = [
        ("iceoryx2", &["shared_mem/src/transport/", "shared_mem/src/msg/"]),
        ("iceoryx2_cal", &["shared_mem/src/transport/"]),
        ("mcap", &["shared_mem/src/recording/"]),
        ("parry3d_f64", &["twin/src/physics/"]),
        ("urdf_rs", &["twin/src/arm/urdf.rs", "twin/src/arm/urdf/"]),
        ("quick_xml", &["twin/urdf/src/", "twin/src/xml.rs", "twin/src/xml/"]),
        ("axum", &["twin/src/web/", "twin/src/teleop/server.rs", "twin/src/show/server.rs"]),
        ("tokio", &["twin/src/web/", "twin/src/teleop/server.rs"]),
        ("foxglove", &["twin/src/viewer", "shared_mem/src/recording/"]),
        ("franka", &["rt_bridge/src/fr3/", "rt_bridge/src/serve/"]),
        ("serialport", &["rt_bridge/src/gripper/robotiq/port.rs"]),
        ("socketcan", &["rt_bridge/src/wrench/can.rs"]),
        ("realsense_rust", &["rt_bridge/src/camera/realsense/stream.rs"]),
        ("wgpu", &["twin/src/render/device/"]),
        ("rstar", &["twin/src/reconstruct/nearest.rs"]),
        ("chess_corners", &["calibration/vision/src/viewpoint/board.rs"]),
        ("clap_complete", &["shared_mem/src/command_line/"]),
        ("clap_mangen", &["shared_mem/src/command_line/"]),
        // Whatever asks for the commit is built again after each.
        (
            "git_version",
            &["twin/src/main.rs", "rt_bridge/src/main.rs", "calibration/src/main.rs", "twinalign/src/main.rs"],
        ),
        (
            "rsruckig",
            &["twin/src/arm/follower.rs", "rt_bridge/src/motion/brake.rs", "calibration/capture/src/transit.rs"],
        ),
        ("parquet", &["shared_mem/import/src/sources/parquet_file.rs", "shared_mem/import/src/data_set/table.rs"]),
        ("rusqlite", &["shared_mem/import/src/sources/sqlite.rs"]),
        ("bzip2", &["shared_mem/src/input/packing.rs"]),
        ("flate2", &["shared_mem/src/input/packing.rs"]),
        ("lz4_flex", &["shared_mem/src/input/packing.rs"]),
        ("zstd", &["shared_mem/src/input/packing.rs"]),
        ("csv", &["shared_mem/import/src/sources/table/cells.rs", "calibration/evaluation/src/trial.rs"]),
        (
            "statrs",
            &[
                "calibration/evaluation/src/statistics/",
                "calibration/inference/src/statistics.rs",
                // Penalties are held against the densities that they come from.
                "calibration/inference/src/likelihood/test_random_effects.rs",
            ],
        ),
        ("rmpv", &["calibration/evaluation/src/policy/"]),
        ("tungstenite", &["calibration/evaluation/src/policy/served.rs"]),
        ("ort", &["calibration/evaluation/src/policy/onnx.rs", "calibration/evaluation/src/policy/onnx/"]),
        ("zip", &["shared_mem/import/src/sources/npz.rs"]),
        ("zenoh", &["rt_bridge/link/src/network/"]),
        ("schemars", &["shared_mem/src/cell/"]),
        ("base64", &["twin/reconstruct/src/assets/page.rs", "calibration/src/page/picture.rs"]),
    ];
    for (file, text) in product_sources() {
        for (dependency, allowed) in doors {
            let enters = text.lines().any(|line| {
                let line = line.trim_start();
                !line.starts_with("//")
                    && (is_named(line, &format!("{dependency}::")) || line.contains(&format!("use {dependency};")))
            });
            assert!(
                !enters || allowed.iter().any(|door| file.starts_with(door)),
                "{file} uses {dependency}; its door is {}",
                allowed.join(" or ")
            );
        }
    }
}

#[test]
fn files_come_in_by_one_door() {
    let doors = ["shared_mem/src/input.rs", "shared_mem/src/output", "rt_bridge/src/doctor/"];
    let ways = ["fs::read(", "fs::read_to_string(", "File::open("];
    for (file, lines) in product_lines() {
        let enters = lines.iter().any(|line| ways.iter().any(|way| line.contains(way)));
        assert!(
            !enters || doors.iter().any(|door| file.starts_with(door)),
            "{file} reads a file by itself; shared_mem::input refuses pipes, devices and files without end"
        );
    }
}

#[test]
fn every_file_says_what_it_owns_and_stays_readable() {
    for (file, text) in product_sources() {
        assert!(text.starts_with("//!"), "{file} does not begin by saying what it owns (`//!`)");
        let lines = text.lines().count();
        assert!(lines <= 450, "{file} has {lines} lines; split it by idea");
    }
}

#[test]
fn unsafe_code_lives_in_two_files() {
    let homes = ["rt_bridge/src/rt/process.rs", "shared_mem/src/transport/storage.rs"];
    for (file, text) in product_sources() {
        let uses = text.lines().any(|l| {
            !l.trim_start().starts_with("//")
                && (l.contains("unsafe {") || l.contains("unsafe fn") || l.contains("unsafe impl"))
        });
        assert!(
            !uses || homes.contains(&file.as_str()),
            "{file} holds unsafe code; it belongs into {}",
            homes.join(" or ")
        );
    }
}

#[test]
fn outputs_are_written_whole_or_not_at_all() {
    // A live recording is there from the beginning, and grows.
    let doors = ["shared_mem/src/output", "shared_mem/src/recording/writer.rs"];
    let writes = ["fs::write(", "File::create", ".write(true)", "fs::rename(", "fs::copy("];
    for (file, lines) in product_lines() {
        let found = lines.iter().flat_map(|line| writes.iter().filter(|word| line.contains(**word))).next();
        assert!(
            found.is_none() || doors.iter().any(|door| file.starts_with(door)),
            "{file} writes a file by `{}`; outputs go through shared_mem::output",
            found.unwrap_or(&"")
        );
    }
}

#[test]
fn the_control_path_reaches_for_no_files_locks_or_logs() {
    let forbidden =
        ["std::fs", "println!", "eprintln!", "tracing::", "Mutex", "RwLock", ".unwrap()", ".expect(", "format!("];
    for (file, text) in sources("rt_bridge/src/rt").into_iter().chain(sources("rt_bridge/src/safety")) {
        let product = text.split("#[cfg(test)]").next().unwrap_or("");
        for word in forbidden {
            let found = product.lines().any(|l| !l.trim_start().starts_with("//") && l.contains(word));
            assert!(!found, "{file} uses `{word}`, which the control thread must not");
        }
    }
}

#[test]
fn one_file_writes_to_standard_error_and_one_to_standard_output() {
    let homes = [
        ("eprint", "shared_mem/src/console.rs"),
        ("io::stderr", "shared_mem/src/console.rs"),
        ("io::stdout", "shared_mem/src/answer.rs"),
    ];
    for (file, lines) in product_lines() {
        for (word, home) in homes {
            let found = lines.iter().any(|line| line.contains(word));
            assert!(!found || file == home, "{file} uses `{word}`; {home} writes without stopping or ending anything");
        }
    }
}

#[test]
fn a_thread_that_panics_takes_no_other_along() {
    for (file, lines) in product_lines() {
        let product = lines.join("\n");
        let joined = product.split(".join()").skip(1).map(str::trim_start);
        for after in joined {
            let panics = [".expect(", ".unwrap()"].iter().any(|call| after.starts_with(call));
            assert!(!panics, "{file} panics when a thread did; report it as an error");
        }
    }
}

#[test]
fn what_identifies_and_diagnoses_names_no_effect() {
    let of = |(_, text): (String, String)| {
        let (_, after) = text.split_once("EffectInfo = EffectInfo {\n    name: \"")?;
        after.split_once('"').map(|(name, _)| format!("\"{name}\""))
    };
    let effects: Vec<String> = sources("twin/src/effects").into_iter().filter_map(of).collect();
    assert!(effects.len() > 30, "{effects:?}");
    let folders = ["src/check/", "src/diagnose/", "src/identify/", "inference/src/"]
        .map(|folder| format!("calibration/{folder}"));
    for (file, text) in product_sources().into_iter().filter(|(file, _)| folders.iter().any(|f| file.starts_with(f))) {
        let is_test = file.contains("test_") || file.ends_with("/tests.rs");
        let product = text.split("#[cfg(test)]").next().unwrap_or("").lines();
        for line in product.filter(|line| !is_test && !line.trim_start().starts_with("//")) {
            let named = effects.iter().find(|name| line.contains(name.as_str()));
            assert!(
                // An engine calls a parameter of the object as the effect is called.
                named.is_none() || line.contains("Self::TipFriction") || file.contains("/engine/"),
                "{file}: {line}: an effect speaks for itself"
            );
        }
    }
}

#[test]
fn the_laws_of_motion_know_no_effect() {
    let laws = ["arm/", "sliding/", "physics/", "world/", "contact_law.rs"].map(|law| format!("twin/src/{law}"));
    for (file, lines) in product_lines() {
        let known = lines.iter().find(|line| line.contains("crate::effects"));
        let is_law = laws.iter().any(|law| file.starts_with(law));
        assert!(
            !is_law || known.is_none(),
            "{file} knows effects; they fill in its numbers or implement its traits: {known:?}"
        );
    }
}

#[test]
fn modules_beside_each_other_need_each_other_in_no_circle() {
    let lines = product_lines();
    let mut found = Vec::new();
    for package in PRODUCT {
        let of_package = |(file, lines): &(String, Vec<String>)| {
            let own = module(file.strip_prefix(package)?.strip_prefix('/')?)?;
            Some((own, lines.join("\n")))
        };
        let files: Vec<(Vec<String>, String)> = lines.iter().filter_map(of_package).collect();
        let left = needs(&files).into_iter().map(|(folder, needs)| (folder, circles(needs)));
        let left = left.filter(|(_, circles)| !circles.is_empty());
        found.extend(left.map(|(folder, circles)| format!("{package}/{}: {circles:?}", folder.join("/"))));
    }
    assert!(found.is_empty(), "modules that need each other, by way of these:\n{}", found.join("\n"));
}

#[test]
fn the_page_of_the_house_names_every_folder_and_only_existing_files() {
    let page = std::fs::read_to_string(root().join("docs/architecture.md")).expect("docs/architecture.md");
    for folder in [
        "shared_mem/",
        "shared_mem/import/",
        "twin/",
        "twin/splat/",
        "twin/fusion/",
        "twin/depth/",
        "twin/reconstruct/",
        "twin/urdf/",
        "twin/tasks/",
        "rt_bridge/",
        "rt_bridge/link/",
        "calibration/",
        "calibration/inference/",
        "calibration/vision/",
        "calibration/capture/",
        "calibration/evaluation/",
        "calibration/worlds/",
        "calibration/tools/",
        "tests/",
        "fuzz/",
        "config/",
        "docs/",
        "adapters/",
        "python/",
        "twinalign/",
    ] {
        assert!(page.contains(&format!("`{folder}`")), "docs/architecture.md does not mention {folder}");
    }
    let mentioned = page.split('`').skip(1).step_by(2).filter(|code| {
        let known = ["shared_mem/", "twin/", "rt_bridge/", "calibration/", "tests/", "config/", "docs/"];
        known.iter().any(|start| code.starts_with(start)) && !code.contains(' ') && !code.contains('{')
    });
    for path in mentioned {
        assert!(root().join(path).exists(), "docs/architecture.md names {path}, which does not exist");
    }
}

/// What follows `](` of each link of a document, without those to other hosts.
fn links(text: &str) -> Vec<&str> {
    let targets = text.split("](").skip(1).filter_map(|rest| rest.split([')', '\n']).next());
    targets.filter(|target| !target.contains("://") && !target.is_empty()).collect()
}

/// The anchors of a document's headings, as forges make them.
fn anchors(text: &str) -> Vec<String> {
    let headings = text.lines().filter(|line| line.starts_with('#')).map(|line| line.trim_start_matches('#').trim());
    let anchor = |heading: &str| {
        let kept = heading.to_lowercase();
        let kept = kept.chars().filter(|c| c.is_alphanumeric() || matches!(c, ' ' | '-' | '_'));
        kept.map(|c| if c == ' ' { '-' } else { c }).collect()
    };
    headings.map(anchor).collect()
}

#[test]
fn every_link_of_the_documents_leads_somewhere() {
    let mut dead = Vec::new();
    for (name, text) in tests::texts::documents() {
        let file = root().join(&name);
        for link in links(&text) {
            let (path, anchor) = link.split_once('#').map_or((link, None), |(path, anchor)| (path, Some(anchor)));
            let there = if path.is_empty() { file.clone() } else { file.with_file_name(path) };
            let found = there.exists()
                && anchor.is_none_or(|anchor| {
                    std::fs::read_to_string(&there).is_ok_and(|text| anchors(&text).iter().any(|known| known == anchor))
                });
            if !found {
                dead.push(format!("{name}: {link}"));
            }
        }
    }
    assert!(dead.is_empty(), "links that lead nowhere:\n{}", dead.join("\n"));
}

#[test]
fn ci_and_readme_agree_on_the_test_command() {
    let command = "cargo test --release --workspace";
    let readme = std::fs::read_to_string(root().join("README.md")).expect("README.md");
    let ci = std::fs::read_to_string(root().join(".ci/run")).expect(".ci/run");
    assert!(readme.contains(command) && ci.contains(command), "README.md and .ci/run must both hold `{command}`");
}
