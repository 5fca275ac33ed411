//! `calibration diagnose A --against B`: files, and what is printed.

use super::diagnose::{Arguments, theta_file};
use crate::check::gate;
use crate::diagnose::Options;
use crate::diagnose::against::{Comparison, compare_kept};
use crate::report;
use inference::interrupt::Interrupt;
use shared_mem::console;
use shared_mem::output::Destination;
use shared_mem::recording::Session;
use shared_mem::theta::Theta;

/// Runs the verb; the caller prints what was found.
///
/// # Errors
/// What cannot be read, compared or written, in one line with the remedy.
pub(super) fn run(arguments: &Arguments, interrupt: &Interrupt) -> anyhow::Result<Comparison> {
    let Arguments { out, report, force, cell, .. } = arguments;
    let page = Destination::of(report.as_deref(), *force)?;
    let answer = Destination::of(out.as_deref(), *force)?;
    let theta_file = theta_file(arguments)?;
    Destination::apart(&[out.as_deref(), report.as_deref(), theta_file.as_deref()])?;
    let against = arguments.against.as_ref().unwrap_or(&arguments.session);
    let (mut a, mut b) =
        (Session::open_with(&arguments.session, cell.as_deref())?, Session::open_with(against, cell.as_deref())?);
    if let Some(subject) = a.about(arguments.object.as_deref())? {
        console::line(&subject);
        b.about(Some(&subject.name))?;
    }
    let looked = [gate::look(&a, arguments.allowed())?, gate::look(&b, arguments.allowed())?];
    // What changed is asked of one robot.
    let [of_a, of_b] = &looked;
    if of_a.provenance.mixture().is_none() && of_b.provenance.mixture().is_none() {
        gate::unmixed(&of_a.provenance.clone().with(of_b.provenance.clone()), arguments.mix)?;
    }
    let theta = arguments.parameters.as_deref().map(Theta::read).transpose()?.map(|theta| theta.about(&a.cell));
    let (seed, torques) = (arguments.seed, arguments.torques);
    let options = Options { theta, seed, torques, out: out.clone(), report: report.clone(), ..Options::default() };
    let (mut found, kept) = compare_kept([&a, &b], &options, interrupt)?;
    looked.iter().for_each(|looked| gate::add(&mut found.warnings, looked));
    if let Some(file) = theta_file {
        found.theta.write(&file)?;
        found.theta_file = Some(file);
    }
    if let Some(answer) = answer {
        answer.write(serde_json::to_string_pretty(&found)?)?;
    }
    if let Some(page) = page {
        page.write(report::against::page(&found))?;
    }
    kept.done();
    Ok(found)
}
