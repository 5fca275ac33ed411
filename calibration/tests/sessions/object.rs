//! The object from simulated strokes of which the truth is known, and from recordings of another engine.

use calibration::identify::object::{Options, identify, identify_clips};
use calibration::identify::{Identification, Optimizer};
use inference::estimate::ClipModel as _;
use inference::interrupt::Interrupt;
use inference::likelihood::Settings;
use inference::likelihood::object::{Channel, Nuisance, ObjectClips, Part, Row, diagnosed};
use inference::likelihood::setting::{complete, object_parameters};
use shared_mem::cell::ClipKind;
use std::path::{Path, PathBuf};
use worlds::session::record;
use worlds::world::{Fault, Kind, World};

fn world(number: u64) -> World {
    let text = include_str!("../../../config/fr3_cell.toml");
    let cell = shared_mem::toml_file::parse(text, Path::new("fr3_cell.toml")).expect("the shipped file");
    World::draw(number, Kind::Strokes, Fault::Nothing, &cell)
}

fn strokes(world: &World, count: usize) -> ObjectClips {
    let clips = record(world, count).expect("a session");
    let base = complete(&world.cell, Some(&world.hidden)).expect("a cell");
    let settings = object_parameters(&world.cell, &base).into_iter().map(|(setting, _)| setting).collect();
    ObjectClips::new(&world.cell, clips, Settings::new(base, settings)).expect("a cell that can be simulated")
}

fn truth(world: &World) -> Vec<f64> {
    let base = complete(&world.cell, Some(&world.hidden)).expect("a cell");
    object_parameters(&world.cell, &base).into_iter().map(|(_, unknown)| unknown.start).collect()
}

#[test]
fn at_the_true_numbers_strokes_are_predicted_to_a_few_millimetres() {
    let world = world(3);
    let (clips, truth) = (strokes(&world, 3), truth(&world));
    for clip in 0..clips.clips() {
        let predicted = clips.predict(clip, &truth, &[]).expect("an answer");
        let (end, measured) = (predicted.poses.last(), clips.clip(clip).object.poses.last());
        let place = |pose: Option<&shared_mem::frames::Pose<_, _>>| {
            nalgebra::Vector3::from(pose.map(shared_mem::frames::Pose::position).expect("a pose"))
        };
        let off = (place(end) - place(measured)).norm();
        assert!(predicted.contact_ns.is_some(), "clip {clip} is not hit");
        assert!(off < 0.03, "clip {clip} ends {off} m off");
    }
}

#[test]
fn what_is_kept_of_a_clip_gives_the_same_bits_as_simulating_it_anew() {
    let world = world(3);
    let truth = truth(&world);
    let mut heavier = truth.clone();
    heavier[1] *= 1.1;
    let (kept, fresh) = (strokes(&world, 1), strokes(&world, 1));
    let first = kept.predict(0, &truth, &[]).expect("an answer");
    kept.predict(0, &heavier, &[]).expect("an answer");
    assert!(kept.predict(0, &truth, &[]).expect("an answer") == first, "from memory");
    assert!(fresh.predict(0, &heavier, &[]).expect("an answer") == kept.predict(0, &heavier, &[]).expect("an answer"));
}

#[test]
fn a_path_that_deviates_is_off_by_nothing_before_the_hit_and_by_all_of_it_where_the_object_rests() {
    let own = diagnosed(ClipKind::ControlHitSlide);
    let clips = strokes(&world(3), 1).with_nuisance(own.clone());
    let (paths, noise) = (clips.path_slopes(0), clips.noise());
    let rows: Vec<Row> = clips.rows(0).into_iter().filter(|row| !matches!(row.channel, Channel::Joint(_))).collect();
    let of = |name: &str| {
        let before = own.iter().take_while(|own| own.name() != name);
        &paths[before.filter(|own| matches!(own, Nuisance::Path(_))).count()]
    };
    for (name, channel, sigma) in [
        ("x when let go", Channel::Position(0), noise.position),
        ("y when let go", Channel::Position(1), noise.position),
        ("yaw when let go", Channel::Rotation(2), noise.rotation),
        ("yaw of the slide", Channel::Rotation(2), noise.rotation),
    ] {
        assert_eq!(of(name).len(), rows.len());
        for (row, slope) in rows.iter().zip(of(name)) {
            let sigmas = match row.part {
                _ if row.channel != channel => 0.0,
                Part::Before => 0.0,
                Part::After => -1.0,
                Part::Hit | Part::Slide => (slope * sigma).clamp(-1.0, 0.0),
            };
            assert!((slope * sigma - sigmas).abs() < 1e-12, "{name}: {slope} at {row:?}");
        }
    }
}

/// An answer to a session of another engine.
fn recorded(name: &str, parameters: Option<PathBuf>) -> Identification {
    let data = PathBuf::from(std::env::var_os("TWINALIGN_DATA").expect("TWINALIGN_DATA"));
    let optimizer = Optimizer::LeastSquares;
    let session = data.join("gap_dev").join(name);
    let options = Options { session, optimizer, parameters, ..Options::default() };
    identify(&options, &Interrupt::listen().expect("signals")).expect("an answer")
}

#[test]
#[ignore = "needs recorded sessions: TWINALIGN_DATA=FOLDER cargo test --release -p calibration --test sessions object:: -- --ignored --nocapture"]
fn strokes_of_another_engine_tell_friction_mass_and_centre_of_mass() {
    let found = recorded("none_slide", None);
    let value = |name: &str| found.parameters[name].value.clone();
    assert!((value("friction")[0] / 0.278_044 - 1.0).abs() < 0.03, "{:?}", value("friction"));
    assert!((value("mass")[0] / 0.306_635 - 1.0).abs() < 0.15, "{:?}", value("mass"));
    let centre = value("centre_of_mass");
    assert!((centre[0] + 0.007_316).abs() < 1.5e-3 && (centre[1] - 0.001_015).abs() < 1.5e-3, "{centre:?}");
    assert!(found.gap.holdout.object_add_m.is_some_and(|add| add < 3e-3), "{:?}", found.gap.holdout);
}

#[test]
fn where_an_object_lies_still_no_number_is_told_and_that_is_said() {
    use nalgebra::Isometry3;
    use shared_mem::cell::ClipKind;
    use shared_mem::recording::{Clip, JointSeries, ObjectSeries};
    let text = "[table]\nheight = 0.0\n[object]\nshape = \"box\"\nsize = [0.08, 0.06, 0.1]\n";
    let cell = shared_mem::toml_file::parse(text, Path::new("cell.toml")).expect("a cell.toml");
    let clip = |number: u64| {
        let place = shared_mem::frames::Pose::from_isometry(Isometry3::translation(0.5, 0.02 * number as f64, 0.05));
        let stamps_ns: Vec<u64> = (0..60).map(|row| row * 16_666_667).collect();
        Clip {
            file: format!("clip_{number:02}.mcap").into(),
            kind: ClipKind::FreeMotion,
            torques_end_at_rows: false,
            origins: shared_mem::origin::Origins::default(),
            joint_names: Vec::new(),
            desired: JointSeries::default(),
            measured: JointSeries::default(),
            object: ObjectSeries { poses: vec![place; stamps_ns.len()], stamps_ns },
            others: Vec::new(),
            warnings: Vec::new(),
            damage: None,
        }
    };
    let found = identify_clips(&cell, (0..3).map(clip).collect(), &Options::default(), &Interrupt::default());
    let found = found.expect("an answer");
    assert_eq!(found.not_identifiable.len(), found.names.len(), "{:?}", found.not_identifiable);
    assert!(found.warnings.iter().any(|warning| warning.contains("nothing in these clips depends")), "{found:?}");
    assert!(found.parameters.values().all(|parameter| parameter.value == parameter.start), "{:?}", found.parameters);
}
