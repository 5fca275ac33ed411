//! The doctor of a recording in small: clean sessions get no remark, every fault that is put into them is found, and every
//! remark stands in the documents.

use calibration::check::{Fault, Remark, Severity, check_clips};
use shared_mem::cell::Cell;
use shared_mem::recording::Clip;
use shared_mem::toml_file;
use std::path::Path;
use std::sync::LazyLock;
use tools::injected::{Clean, Injected, Sort, Trial};

const SORTS: [Sort; 4] = [Sort::Motions, Sort::Paces, Sort::Strokes, Sort::Tosses];
static SHIPPED: LazyLock<Cell> = LazyLock::new(|| {
    let text = include_str!("../../../config/fr3_cell.toml");
    toml_file::parse(text, Path::new("fr3_cell.toml")).expect("the shipped file")
});
static CLEAN: LazyLock<Vec<Clean>> =
    LazyLock::new(|| SORTS.map(|sort| Clean::of(sort, 5, &SHIPPED).expect("a session")).into_iter().collect());

fn remarks(session: &Clean) -> Vec<Remark> {
    check_clips(&session.cell, &session.clips).remarks
}

/// A clean session whose clips were changed, as they are after reading.
fn changed(sort: usize, change: impl Fn(&mut Clip)) -> Vec<Remark> {
    let mut session = CLEAN[sort].clone();
    for (_, clip) in &mut session.clips {
        change(clip);
        *clip = clip.clone().checked().expect("a usable clip");
    }
    remarks(&session)
}

#[test]
fn clean_sessions_and_sessions_with_a_cause_get_no_remark() {
    let causes = [0, 1, 10, 11].map(|number| Clean::of(Sort::Causes, number, &SHIPPED).expect("a session"));
    for session in CLEAN.iter().chain(&causes) {
        let said: Vec<String> = remarks(session).iter().map(ToString::to_string).collect();
        assert!(said.is_empty(), "{said:?}");
    }
}

#[test]
fn every_fault_is_found_where_it_was_put_in() {
    for fault in Injected::ALL {
        let tried: Vec<Trial> = CLEAN.iter().filter_map(|session| Trial::with(fault, session, 3)).collect();
        assert!(!tried.is_empty(), "{}: no session can have it", fault.name());
        for trial in &tried {
            assert!(trial.right, "{}: found {:?}", fault.name(), trial.beside);
        }
    }
}

#[test]
fn a_delay_stays_a_delay_and_a_lag_that_goes_with_speed_does_not() {
    let later = |clip: &mut Clip, by: u64| clip.measured.stamps_ns.iter_mut().for_each(|stamp| *stamp += by);
    let delayed = changed(1, |clip| later(clip, 90_000_000));
    assert!(delayed.is_empty(), "{delayed:?}");
    // 0.15 s in a clip of 6 s, twice that in one that takes twice as long.
    let shifted = changed(1, |clip| later(clip, (clip.desired.duration() * 25e6) as u64));
    let found = shifted.iter().find(|r| r.fault == Fault::MisalignedLogs).expect("a remark");
    assert_eq!((found.severity, found.clips.len()), (Severity::Wrong, 4));
    assert!(found.what.contains("goes with 1 / speed"), "{}", found.what);
}

#[test]
fn commands_divided_by_57_twice_are_blamed_and_not_the_measurement() {
    let found = changed(0, |clip| clip.desired.q.iter_mut().for_each(|q| *q = q.to_radians()));
    let remark = found.iter().find(|r| r.fault == Fault::CommandUnit).expect("a remark");
    assert_eq!(remark.channel, "desired q", "{remark}");
    let size = remark.size.expect("a size");
    assert!(
        (size.value / 57.2958 - 1.0).abs() < 0.05 && remark.remedy.contains("multiply the commands by 57.29"),
        "{remark}"
    );
    assert!(!found.iter().any(|r| r.fault == Fault::Degrees), "{found:?}");
}

#[test]
fn one_fault_is_one_remark_for_all_clips_that_have_it() {
    let found = changed(0, |clip| clip.measured.dq.iter_mut().for_each(|dq| *dq = dq.to_degrees()));
    assert_eq!(found.len(), 1, "{found:?}");
    assert_eq!((found[0].fault, found[0].clips.len()), (Fault::VelocityUnit, 3));
    assert!(!found[0].remedy.is_empty());
}

#[test]
fn every_remark_stands_in_the_documents_and_no_other() {
    let text = include_str!("../../../docs/check.md");
    let table = text.split("## Remarks").nth(1).and_then(|rest| rest.split("\n## ").next()).expect("the table");
    let rows = table.lines().filter_map(|line| line.strip_prefix("| `"));
    let named: Vec<&str> = rows.filter_map(|row| row.split('`').next()).collect();
    assert_eq!(named, Fault::ALL.map(Fault::key));
}

#[test]
fn numbers_of_no_size_that_can_be_end_in_sentences() {
    let odd = [f64::NAN, f64::INFINITY, f64::NEG_INFINITY, 1e308, -1e308, 1e-310, -0.0];
    for seed in 0..24_usize {
        let mut session = CLEAN[seed % CLEAN.len()].clone();
        // Places and values go on by steps that have no common factor with what they walk through.
        let mut place = 7919 * (seed + 1);
        for (_, clip) in &mut session.clips {
            let Clip { measured, desired, .. } = clip;
            for values in [&mut measured.q, &mut measured.dq, &mut measured.tau, &mut desired.q, &mut desired.tau] {
                for _ in 0..=seed % 5 {
                    place = place.wrapping_mul(31).wrapping_add(104_729) % 1_000_003;
                    let at = place % values.len().max(1);
                    if let Some(value) = values.get_mut(at) {
                        *value = odd[place % odd.len()];
                    }
                }
            }
        }
        let as_it_is = remarks(&session);
        session.clips.retain_mut(|(_, clip)| clip.clone().checked().map(|whole| *clip = whole).is_ok());
        for remark in as_it_is.iter().chain(&remarks(&session)) {
            assert!(!remark.what.is_empty() && !remark.what.contains('\n'), "{remark}");
        }
    }
}
