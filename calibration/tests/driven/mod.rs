//! Sessions on disk of an arm alone that swings with three sines a joint, different ones in each clip, integrated in finer steps than
//! the twin's. SI units.

use shared_mem::cell::Cell;
use shared_mem::msg::MAX_JOINTS;
use shared_mem::msg::arm::ArmState;
use shared_mem::recording::{ClipInfo, ClipWriter, Session};
use shared_mem::theta::Theta;
use std::path::Path;
use twin::control::Drive;
use twin::sim::SimCell;

/// Control periods in which the arm comes to rest before a clip.
const STILL: u64 = 500;

/// What is recorded.
pub(crate) struct Driven<'a> {
    /// What the laboratory knows.
    pub(crate) cell: &'a Cell,
    /// What is true besides.
    pub(crate) hidden: &'a str,
    pub(crate) clips: u32,
    /// Control periods of each.
    pub(crate) periods: u64,
    /// Control periods from one recorded row to the next.
    pub(crate) row_every: u64,
    /// Amplitude of one sine [rad].
    pub(crate) amplitude: f64,
    /// Torque at the joint over what is recorded as torque.
    pub(crate) torque_constant: [f64; MAX_JOINTS],
}

impl Driven<'_> {
    /// Records the session in `folder`.
    pub(crate) fn session(&self, folder: &Path) -> Session {
        let hidden: Theta = shared_mem::toml_file::parse(self.hidden, Path::new("hidden.toml")).expect("a theta");
        let mut entries = String::new();
        for number in 0..self.clips {
            let file = format!("clip_{number:02}.mcap");
            self.clip(&folder.join(&file), &hidden, number);
            entries += &format!("\n[[clip]]\nfile = \"{file}\"\nkind = \"excitation\"\n");
        }
        std::fs::write(folder.join("cell.toml"), self.cell.to_toml() + &entries).expect("room");
        Session::open(folder).expect("a session")
    }

    fn clip(&self, file: &Path, hidden: &Theta, number: u32) {
        let mut sim = SimCell::new(self.cell, Some(hidden)).expect("a cell");
        sim.refine(3);
        let dof = sim.arm_model().expect("an arm").dof();
        let mut writer = ClipWriter::create(file, &ClipInfo::default()).expect("a file");
        let mut state = ArmState::default();
        sim.read(&mut state);
        let home = state.q;
        (0..STILL).for_each(|_| sim.step(&Drive::JointImpedance { q_d: home, dq_d: [0.0; MAX_JOINTS] }));
        sim.read(&mut state);
        for tick in 0..self.periods {
            let (mut q_d, mut dq_d) = (home, [0.0; MAX_JOINTS]);
            let t = tick as f64 * 1e-3;
            for joint in 0..dof {
                for wave in 0..3 {
                    let omega = 2.0 + 1.7 * f64::from(wave) + 0.37 * joint as f64 + 0.53 * f64::from(number);
                    q_d[joint] += self.amplitude * (1.0 - (omega * t).cos());
                    dq_d[joint] += self.amplitude * omega * (omega * t).sin();
                }
            }
            if tick.is_multiple_of(self.row_every) {
                (state.q_d, state.dq_d) = (q_d, dq_d);
                (state.stamp_ns, state.cycle) = (1_000_000_000_000 + tick * 1_000_000, tick / self.row_every);
                state.tau_J.iter_mut().zip(self.torque_constant).for_each(|(torque, constant)| *torque /= constant);
                writer.arm_state(&state).expect("room");
            }
            sim.step(&Drive::JointImpedance { q_d, dq_d });
            sim.read(&mut state);
        }
        writer.finish().expect("room");
    }
}
