//! A robot is found in a made scan of a cell, of another scale and from elsewhere, and parted into its links.

use crate::robot_splats::robot_splats;
use nalgebra::{Point3, Similarity3, Translation3, UnitQuaternion, Vector3};
use rand::{RngExt as _, SeedableRng as _};
use rand_pcg::Pcg64Mcg;
use shared_mem::cell::Cell;
use splat::{Splat, SplatCloud};
use std::path::{Path, PathBuf};
use std::process::Command;
use twin::arm::Joints;
use twin::reconstruct::{SurfacePoints, align, label};
use twin::render::{Hand, RobotSurface};

const JOINTS: &str = "0.2,-0.6,0.1,-2.2,0.1,1.7,0.6";

fn cell_file() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../config/fr3_cell.toml")
}

fn robot() -> (RobotSurface, Joints) {
    let mut cell = Cell::read(&cell_file()).expect("the shipped cell");
    cell.tool = None;
    let mut q = [0.0; 8];
    q.iter_mut().zip(JOINTS.split(',')).for_each(|(q, text)| *q = text.parse().expect("a number"));
    (RobotSurface::new(&cell, Hand::None).expect("a robot"), q)
}

/// The robot's upper sides with a millimetre of noise, a table and things around it, in the base frame; for each splat the
/// link, or none.
fn scanned_cell() -> (SplatCloud, Vec<Option<usize>>) {
    let (robot, q) = robot();
    let (clouds, links) = (robot_splats(&robot, 24_000), robot.links());
    let mut random = Pcg64Mcg::seed_from_u64(7);
    let mut noise = move |by: f32| [(); 3].map(|()| random.random_range(-by..by));
    let mut scan = SplatCloud { degree: 3, ..SplatCloud::default() };
    let mut truth = Vec::new();
    robot.for_each(&q, |part, pose| {
        let cloud = clouds[part].moved(&Similarity3::from_isometry(pose, 1.0));
        // A splat is flat: its own z is the surface's normal, and what looks down or away was not photographed.
        let seen = |splat: &Splat| {
            let normal = splat.rotation * Vector3::z();
            normal.z > -0.6 && normal.dot(&Vector3::new(0.8, 0.5, 0.3)) > -0.5
        };
        for (splat, colors) in cloud.splats.iter().zip(cloud.harmonics.chunks_exact(16)) {
            if seen(splat) {
                let centre = splat.centre + Vector3::from(noise(0.0015));
                scan.splats.push(Splat { centre, ..*splat });
                scan.harmonics.extend_from_slice(colors);
                truth.push(Some(links[part]));
            }
        }
    });
    let mut clutter = |centre: Point3<f32>| {
        let (rotation, sigma) = (UnitQuaternion::identity(), Vector3::repeat(0.004));
        scan.splats.push(Splat { centre, rotation, sigma, opacity: 0.9 });
        scan.harmonics.extend([[0.1; 3]; 16]);
        truth.push(None);
    };
    for i in 0..12_000 {
        let [x, y, z] = noise(1.0);
        match i % 4 {
            0 => clutter(Point3::new(0.6 + 0.1 * x, 0.4 + 0.1 * y, 0.1 + 0.1 * z)),
            1 => clutter(Point3::new(-0.5 + 0.05 * x, 0.8 * y, 0.5 + 0.5 * z)),
            _ => clutter(Point3::new(0.2 + 0.8 * x, 0.9 * y, 0.001 * z)),
        }
    }
    (scan, truth)
}

/// The scan's frame: turned by 12 degrees, 6 cm away, one unit 0.41 m.
fn base_from_scan() -> Similarity3<f64> {
    let turn = UnitQuaternion::from_scaled_axis(Vector3::new(0.1, -0.12, 0.14));
    Similarity3::from_parts(Translation3::new(0.05, -0.03, 0.02), turn, 0.41)
}

#[test]
fn a_scan_of_another_scale_is_laid_onto_the_robot_and_parted() {
    let ((robot, q), (in_base, truth)) = (robot(), scanned_cell());
    let wanted = base_from_scan();
    let scan = in_base.moved(&wanted.inverse());
    let points: Vec<Point3<f64>> = scan.splats.iter().map(|splat| splat.centre.cast()).collect();
    let surface = SurfacePoints::new(&robot, &q, |_| true);
    let start = Similarity3::from_scaling(0.45);
    let found = align(&points, &surface, &start, |_| ()).expect("a robot");
    let off = wanted.inverse() * found.base_from_scan;
    let (angle, scale) = (off.isometry.rotation.angle().to_degrees(), off.scaling() - 1.0);
    let flange = Point3::new(0.45, 0.1, 0.5);
    let moved = (found.base_from_scan * (wanted.inverse() * flange) - flange).norm();
    eprintln!("{angle:.3} degrees, {:.3} % of scale, {:.2} mm at the flange", scale * 100.0, moved * 1e3);
    assert!(angle < 0.3 && scale.abs() < 0.003 && moved < 0.003, "{angle} {scale} {moved}");
    let parts = label(&scan, &found.base_from_scan, &surface, 0.015, Some(0.004));
    let whole = |parts: &[SplatCloud]| parts.iter().map(|part| part.splats.len()).sum::<usize>();
    assert_eq!(whole(&parts.links) + parts.rest.splats.len(), scan.splats.len());
    // Every splat is found again by its place, in the part that it belongs to.
    let by_place = |cloud: &SplatCloud, at: &Point3<f32>| cloud.splats.iter().any(|s| (s.centre - at).norm() < 0.004);
    let asked: Vec<usize> = (0..truth.len()).step_by(97).collect();
    let right = asked.iter().filter(|i| match truth[**i] {
        Some(link) => by_place(&parts.links[link], &in_base.splats[**i].centre),
        None => by_place(&parts.rest, &in_base.splats[**i].centre),
    });
    let share = right.count() as f64 / asked.len() as f64;
    assert!(share > 0.95, "only {share} in the right part");
}

#[test]
fn the_command_writes_links_that_can_be_drawn_and_refuses_what_shows_no_robot() {
    let folder = tempfile::tempdir().expect("a folder");
    let (file, out) = (folder.path().join("scan.ply"), folder.path().join("links"));
    let (in_base, _) = scanned_cell();
    in_base.moved(&base_from_scan().inverse()).write(&file).expect("written");
    let run = |out: &Path, joints: &str, start: &str| {
        let mut command = Command::new(env!("CARGO_BIN_EXE_twin"));
        command.arg("label-splats").arg(&file).arg("--cell").arg(cell_file());
        command.args(["--joints", joints, "--start", start, "--json", "--out"]).arg(out);
        command.output().expect("the twin binary")
    };
    // As a trainer on another system leaves it: CR LF in the header, and one place that is none.
    let clean = std::fs::read(&file).expect("the scan");
    let end = clean.windows(11).position(|window| window == b"end_header\n").expect("an end") + 11;
    let header = String::from_utf8_lossy(&clean[..end]).replace('\n', "\r\n");
    std::fs::write(&file, [header.as_bytes(), &f32::NAN.to_le_bytes(), &clean[end + 4..]].concat()).expect("written");
    let good = run(&out, JOINTS, "0,0,0,1,0,0,0,0.41");
    std::fs::write(&file, &clean).expect("written");
    let said = String::from_utf8_lossy(&good.stderr).into_owned();
    assert!(good.status.success(), "{said}");
    assert!(said.contains(&format!("1 of {} splats left out", in_base.splats.len())), "{said}");
    let json: serde_json::Value = serde_json::from_slice(&good.stdout).expect("one JSON object");
    assert!((json["scale"].as_f64().expect("a scale") - 0.41).abs() < 0.002, "{json}");
    let mut links = 0;
    for link in 0..8 {
        let cloud = SplatCloud::read(&out.join(format!("link{link}.ply"))).expect("a link");
        assert_eq!(cloud.degree, 3);
        links += cloud.splats.len();
    }
    let scene = SplatCloud::read(&out.join("scene.ply")).expect("the rest");
    assert_eq!(links + scene.splats.len(), in_base.splats.len() - 1);
    for (joints, start, told) in [
        (JOINTS, "5,5,5,1,0,0,0,0.41", "points near where the robot should be"),
        ("0,0,0", "0,0,0,1,0,0,0,0.41", "7 joints"),
        (JOINTS, "0,0,0,0,0,0,0", "no pose"),
    ] {
        let bad = run(&folder.path().join("none"), joints, start);
        let line = String::from_utf8_lossy(&bad.stderr).into_owned();
        assert!(!bad.status.success() && line.contains(told) && line.lines().count() == 1, "{line}");
    }
}
