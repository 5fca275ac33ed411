//! Whether a diagnosis is as right under other control laws as under joint impedance: sealed worlds, each with one effect hidden in
//! its arm, whose robot is led by each law in turn.
//!
//! `cargo run --release -p tools --example laws -- --worlds 4 --seed 1 [--clips 6] [--law joint_pd]`

#![allow(clippy::print_stdout, reason = "its output is the measurement")]

use calibration::benchmark::trial::examine;
use clap::Parser;
use shared_mem::cell::{Cell, Controller, ControllerKind};
use shared_mem::console;
use shared_mem::interrupt::Interrupt;
use std::path::PathBuf;
use worlds::session::record;
use worlds::world::{Fault, Kind, World};

#[derive(Debug, Parser)]
struct Arguments {
    /// Worlds under each law.
    #[arg(long, default_value_t = 4)]
    worlds: u64,
    /// Number of the first world.
    #[arg(long, default_value_t = 1)]
    seed: u64,
    /// Clips of each.
    #[arg(long, default_value_t = 6)]
    clips: usize,
    /// One law alone, by its name in the table.
    #[arg(long)]
    law: Option<String>,
    /// Cell whose controller is changed.
    #[arg(long, default_value = "config/fr3_cell.toml")]
    cell: PathBuf,
}

/// Effects that any law leaves to be seen, by their places among the candidates of an arm.
const EFFECTS: [&str; 4] = ["joint_coulomb_friction", "command_delay", "payload", "joint_viscous_friction"];

fn main() -> anyhow::Result<()> {
    let _last_lines = console::start();
    let Arguments { worlds, seed, clips, law, cell } = Arguments::parse();
    let (cell, interrupt) = (Cell::read(&cell)?, Interrupt::listen()?);
    println!("| law | worlds | named alone | in a class | not named | wrong name |\n|---|---|---|---|---|---|");
    for (name, change) in laws().into_iter().filter(|(name, _)| law.as_deref().is_none_or(|only| only == *name)) {
        let mut cell = cell.clone();
        cell.controller.iter_mut().for_each(change);
        let mut count = [0; 4];
        for number in seed..seed + worlds {
            let hidden = EFFECTS[number as usize % EFFECTS.len()];
            let which = twin::effects::registry().iter().position(|effect| effect.name == hidden);
            let world = World::draw(number, Kind::Excitation, Fault::Single(which.unwrap_or(0)), &cell);
            let session = record(&world, clips)?;
            let said = examine(&world, session, &interrupt)?.swap_remove(0).said;
            let right = said.effects.iter().any(|effect| effect == hidden);
            let place = match said.verdict.as_str() {
                "named" if right && said.effects.len() == 1 => 0,
                "named" | "class" if right => 1,
                "named" | "class" => 3,
                _ => 2,
            };
            count[place] += 1;
            eprintln!("{name}, world {number}, {hidden}: {} {}", said.verdict, said.effects.join(", "));
        }
        let [alone, class, not, wrong] = count;
        println!("| {name} | {worlds} | {alone} | {class} | {not} | {wrong} |");
    }
    Ok(())
}

/// What makes a law of the joint impedance that the cell has.
type Law = (&'static str, fn(&mut Controller));

fn laws() -> [Law; 7] {
    [
        ("joint_impedance", |_| {}),
        ("inverse_dynamics", |law| law.kind = ControllerKind::InverseDynamics),
        ("compensated_pd", |law| law.kind = ControllerKind::CompensatedPd),
        ("joint_velocity", |law| law.kind = ControllerKind::JointVelocity),
        ("joint_pd", |law| {
            // A servo that compensates nothing has to be stiff, or it hangs.
            law.kind = ControllerKind::JointPd;
            law.stiffness.iter_mut().for_each(|k| *k *= 8.0);
            law.damping.iter_mut().for_each(|d| *d *= 3.0);
        }),
        ("integral action", |law| law.integral_rate = vec![3.0; law.stiffness.len()]),
        ("voltage limit", |law| law.voltage_limit = law.stiffness.iter().map(|k| 0.15 * k).collect()),
    ]
}
