//! Whole clips a second: `cargo run --release -p twin --example throughput -- SESSION [theta.toml]`.
//!
//! Every Control-Hit-Slide clip of a session is rolled out again and again, from its first row to its last, with all
//! joint rows and object poses answered, on one core and on all of them. Then the part alone from just before the hit
//! until the object rests.

use shared_mem::cell::ClipKind;
use shared_mem::recording::{Clip, Session};
use shared_mem::theta::Theta;
use std::path::PathBuf;
use std::time::Instant;
use twin::arm::JointState;
use twin::control::CommandTrack;
use twin::replay::object_start;
use twin::rollout::{CellRollout, CellTrace, Checkpoint, Course, ObjectState, Workers};
use twin::scene::ObjectModel;

/// A clip with everything a rollout of it starts from.
struct Prepared {
    clip: Clip,
    commands: CommandTrack,
    arm: JointState,
    object: ObjectState,
}

impl Prepared {
    fn new(clip: Clip, worker: &CellRollout, model: &ObjectModel, session: &Session) -> Option<Self> {
        let arm = worker.arm()?;
        let clip = clip.reorder(arm.arm.joint_names()).ok()?;
        let commands = CommandTrack::new(&clip.desired)?;
        let arm = arm.start_state(&clip.measured, 0, &commands)?;
        let object = ObjectState::at_rest(object_start::resting(&clip.object, model, &session.cell)?);
        Some(Self { clip, commands, arm, object })
    }

    fn run(&self, worker: &mut CellRollout, trace: &mut CellTrace) {
        worker.start(self.clip.measured.stamps_ns[0], Some(&self.arm), Some(&self.object), Some(&self.commands));
        trace.clear();
        worker.run(&self.course(), trace);
    }

    /// The worker just before the hit, when that is, and when the object rests that the tool has left [ns]; `None` where
    /// nothing is hit.
    fn hit(&self, worker: &mut CellRollout, trace: &mut CellTrace) -> Option<(Checkpoint, u64, u64)> {
        worker.start(self.clip.measured.stamps_ns[0], Some(&self.arm), Some(&self.object), Some(&self.commands));
        trace.clear();
        let start_ns = worker.run_until_contact(&self.course(), trace)?;
        let before = worker.checkpoint();
        let end_ns = self.clip.object.stamps_ns.last()?;
        let left = |worker: &CellRollout| worker.contact().is_some_and(|c| c.end_ns < worker.now_ns());
        while worker.now_ns() < *end_ns && !(left(worker) && worker.cell().object_rests()) {
            worker.tick(Some(&self.commands));
        }
        Some((before, start_ns, worker.now_ns()))
    }

    fn course(&self) -> Course<'_> {
        let joints_ns = &self.clip.measured.stamps_ns;
        Course { commands: Some(&self.commands), joints_ns, poses_ns: &self.clip.object.stamps_ns }
    }

    fn seconds(&self) -> f64 {
        let stamps = &self.clip.measured.stamps_ns;
        (stamps[stamps.len() - 1] - stamps[0]) as f64 * 1e-9
    }
}

fn main() -> anyhow::Result<()> {
    let mut arguments = std::env::args_os().skip(1).map(PathBuf::from);
    let folder = arguments.next().ok_or_else(|| anyhow::anyhow!("which session? give its folder"))?;
    let theta = arguments.next().map(|file| Theta::read(&file)).transpose()?;
    let session = Session::open(&folder)?;
    let worker = CellRollout::new(&session.cell, theta.as_ref())?;
    let model = ObjectModel::new(&session.cell, theta.as_ref())?.ok_or_else(|| anyhow::anyhow!("no [object]"))?;
    let entries = session.clips.iter().filter(|entry| entry.kind == ClipKind::ControlHitSlide);
    let clips = entries.map(|entry| session.read(entry)).collect::<Result<Vec<_>, _>>()?;
    let clips: Vec<_> = clips.into_iter().filter_map(|clip| Prepared::new(clip, &worker, &model, &session)).collect();
    anyhow::ensure!(!clips.is_empty(), "no Control-Hit-Slide clip in this session");
    let jobs: Vec<usize> = (0..40 * clips.len()).map(|i| i % clips.len()).collect();
    let simulated: f64 = jobs.iter().map(|i| clips[*i].seconds()).sum();
    let mut single = 0.0;
    for threads in 1..=std::thread::available_parallelism()?.get() {
        let workers = Workers::new((worker.clone(), CellTrace::default()), Some(threads))?;
        let time = (0..3)
            .map(|_| {
                let start = Instant::now();
                workers.run(&jobs, |(worker, trace), job| clips[*job].run(worker, trace));
                start.elapsed().as_secs_f64()
            })
            .fold(f64::INFINITY, f64::min);
        single = if threads == 1 { time } else { single };
        eprintln!(
            "{threads} threads: {:6.0} rollouts/s of {:.2} s, {:5.2} us per simulated ms and core, {:.2} times one thread",
            jobs.len() as f64 / time,
            simulated / jobs.len() as f64,
            time / simulated * 1e3 * threads as f64,
            single / time
        );
    }
    from_hit_to_rest(&clips, worker);
    Ok(())
}

/// Microseconds per simulated millisecond of hit and slide alone, one thread.
fn from_hit_to_rest(clips: &[Prepared], mut worker: CellRollout) {
    let mut trace = CellTrace::default();
    let hits: Vec<_> = clips.iter().filter_map(|clip| Some((clip, clip.hit(&mut worker, &mut trace)?))).collect();
    let simulated: f64 = hits.iter().map(|(_, (_, start_ns, end_ns))| (end_ns - start_ns) as f64 * 1e-6).sum();
    let time = (0..20)
        .map(|_| {
            let start = Instant::now();
            for (clip, (before, _, end_ns)) in &hits {
                worker.resume(before);
                while worker.now_ns() < *end_ns {
                    worker.tick(Some(&clip.commands));
                }
            }
            start.elapsed().as_secs_f64()
        })
        .fold(f64::INFINITY, f64::min);
    eprintln!(
        "hit to rest: {:.0} ms of each clip, {:5.2} us per simulated ms",
        simulated / hits.len() as f64,
        time * 1e6 / simulated
    );
}
