//! From the words of the command line to devices that run.

use super::Settings;
use crate::arm::Arm;
use crate::camera::CameraSource;
use crate::fr3;
use crate::replay::{ReplayArm, ReplayClock};
use crate::rt::cycle::Plan;
use crate::rt::law::TorquePd;
use crate::safety::{Guard, Limits, Trailing, Workspace};
use crate::sighting::Sighting;
use crate::sim::{World, hidden};
use crate::tracker::TrackerChoice;
use crate::wrench::WrenchChoice;
use anyhow::{Result, bail};
use rtrb::Consumer;
use shared_mem::cell::{Cell, ControllerKind};
use shared_mem::msg::arm::CommandInterface;
use shared_mem::msg::wrench::Wrench;
use shared_mem::theta::Theta;
use shared_mem::time::TICK;
use std::fmt;
use std::path::PathBuf;
use std::str::FromStr;
use std::time::{SystemTime, UNIX_EPOCH};
use twin::arm::{ArmModel, ControlLaw, HeldJoint};
use twin::effects::CameraEffects;
use twin::scene::SceneSnapshot;

#[derive(Debug, Clone, PartialEq, Eq)]
pub enum ArmChoice {
    /// The simulated cell.
    Sim,
    /// A Franka robot at this address.
    Fci(String),
    Replay(PathBuf),
}

impl FromStr for ArmChoice {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        match text.split_once("://") {
            None if text == "sim" => Ok(Self::Sim),
            Some(("fci", host)) if !host.is_empty() => Ok(Self::Fci(host.to_owned())),
            Some(("replay", path)) if !path.is_empty() => Ok(Self::Replay(path.into())),
            _ => Err("use sim, fci://HOST (for example fci://172.16.0.2) or replay://CLIP.mcap".into()),
        }
    }
}

impl fmt::Display for ArmChoice {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Sim => f.write_str("sim"),
            Self::Fci(host) => write!(f, "fci://{host}"),
            Self::Replay(clip) => write!(f, "replay://{}", clip.display()),
        }
    }
}

/// Who computes the torque.
#[derive(Debug, Clone, Copy, PartialEq, Eq, clap::ValueEnum)]
#[value(rename_all = "snake_case")]
pub enum ControllerChoice {
    /// The bridge: joint impedance with the gains of cell.toml; the arm adds gravity.
    TorquePd,
    /// The arm's own controller follows desired positions.
    JointImpedance,
}

#[derive(Debug, Clone, PartialEq, Eq)]
pub enum CameraChoice {
    /// Rendered from the simulated cell.
    Sim,
    /// A RealSense camera, or a recording of one.
    RealSense(CameraSource),
    /// The pictures of the recording.
    Replay,
    Off,
}

impl FromStr for CameraChoice {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        match text.split_once("://") {
            None if text == "sim" => Ok(Self::Sim),
            None if text == "realsense" => Ok(Self::RealSense(CameraSource::Device)),
            None if text == "replay" => Ok(Self::Replay),
            None if text == "off" => Ok(Self::Off),
            Some(("bag", file)) if !file.is_empty() => Ok(Self::RealSense(CameraSource::Bag(file.into()))),
            _ => Err("use sim, realsense, bag://FILE.bag, replay or off".into()),
        }
    }
}

impl fmt::Display for CameraChoice {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Sim => f.write_str("sim"),
            Self::RealSense(CameraSource::Device) => f.write_str("realsense"),
            Self::RealSense(CameraSource::Bag(file)) => write!(f, "bag://{}", file.display()),
            Self::Replay => f.write_str("replay"),
            Self::Off => f.write_str("off"),
        }
    }
}

pub(super) struct Devices {
    pub(super) arm: Box<dyn Arm>,
    /// As cell.toml describes it.
    pub(super) model: ArmModel,
    pub(super) plan: Plan,
    pub(super) guard: Guard,
    pub(super) world: Option<World>,
    pub(super) pictures: Pictures,
    /// From the simulated tracker, or of the recording, unless another one tracks. They come with the camera off, too.
    pub(super) poses: Option<Consumer<Sighting>>,
    /// The recording that is replayed, and its clock.
    pub(super) replay: Option<(PathBuf, ReplayClock)>,
    /// Of the simulated cell's force sensor, where it is to be there.
    pub(super) wrenches: Option<Consumer<Wrench>>,
}

/// Where pictures come from.
pub(super) enum Pictures {
    None,
    Scenes(Consumer<SceneSnapshot>, CameraEffects),
    Clip(PathBuf, ReplayClock),
    RealSense(CameraSource),
}

impl Pictures {
    /// Those of a camera that knows nothing of the arm.
    fn beside_the_arm(camera: CameraChoice) -> Self {
        match camera {
            CameraChoice::RealSense(source) => Self::RealSense(source),
            _ => Self::None,
        }
    }
}

impl Devices {
    pub(super) fn open(settings: &Settings, cell: &Cell) -> Result<Self> {
        let model = ArmModel::from_cell(cell)?;
        if let held @ [_, ..] = model.held_joints() {
            tracing::info!("no joints of the arm, and held where they are: {}", HeldJoint::in_words(held));
        }
        if settings.arm != ArmChoice::Sim && (settings.effects.is_some() || settings.parameters.is_some()) {
            bail!("--effects and --parameters change the simulated cell only; use them with --arm sim");
        }
        let hidden = hidden::read(cell, settings.parameters.as_deref(), settings.effects.as_deref())?;
        let plan = plan(settings, cell, &model, hidden.as_ref())?;
        let guard = guard(&settings.arm, &plan, cell, &model);
        let camera = settings.camera(cell)?;
        let tracker = settings.tracker(cell)?;
        let devices = match &settings.arm {
            ArmChoice::Sim => {
                let (world, arm, views) = World::start(cell, hidden.as_ref())?;
                if tracker == TrackerChoice::Rgbd
                    && let [name, ..] = views.camera_effects.of_the_tracker()[..]
                {
                    bail!(
                        "{name} is an effect of the simulated tracker, which no picture shows; use it with --tracker sim"
                    );
                }
                Self {
                    arm: Box::new(arm),
                    model,
                    plan,
                    guard,
                    world: Some(world),
                    replay: None,
                    pictures: match camera {
                        CameraChoice::Sim => Pictures::Scenes(views.scenes, views.camera_effects),
                        other => Pictures::beside_the_arm(other),
                    },
                    poses: (tracker == TrackerChoice::Sim).then_some(views.poses),
                    wrenches: (settings.wrench(cell)? == WrenchChoice::Sim).then_some(views.wrenches),
                }
            }
            ArmChoice::Fci(host) => {
                let arm = fr3::connect(host, settings.realtime, cell)?;
                let pictures = Pictures::beside_the_arm(camera);
                Self { arm, model, plan, guard, world: None, pictures, poses: None, replay: None, wrenches: None }
            }
            ArmChoice::Replay(clip) => {
                let (arm, poses, clock) = ReplayArm::open(clip, cell, &model)?;
                let pictures = match camera {
                    CameraChoice::Replay => Pictures::Clip(clip.clone(), clock.clone()),
                    other => Pictures::beside_the_arm(other),
                };
                let poses = (tracker == TrackerChoice::Replay).then_some(poses);
                let replay = Some((clip.clone(), clock));
                let arm = Box::new(arm);
                Self { arm, model, plan, guard, world: None, pictures, poses, replay, wrenches: None }
            }
        };
        let (has, described) = (devices.arm.dof(), devices.model.dof());
        if has != described {
            bail!("the arm has {has} joints, cell.toml describes {described}; correct [robot] in cell.toml");
        }
        Ok(devices)
    }
}

/// What of `hidden` acts in the arm's own controller or on the way there: where the bridge computes the torque, nothing shows it.
fn inside_the_controller(hidden: &Theta) -> Option<&str> {
    let gains = hidden.arm.as_ref().map(|_| "the controller's gains in --parameters");
    gains.or_else(|| hidden::on_the_way(hidden).next())
}

/// What lets commands pass. How the arm comes after them follows from the law that computes its torques: the bridge's own, else
/// that of cell.toml. A robot that cell.toml gives no stiffness to keeps its own, which nobody knows.
fn guard(arm: &ArmChoice, plan: &Plan, cell: &Cell, model: &ArmModel) -> Guard {
    let controller = cell.controller.as_ref().filter(|c| *arm == ArmChoice::Sim || !c.stiffness.is_empty());
    let trailing = match &plan.law {
        Some(law) => law.trailing(),
        None => ControlLaw::new(controller, None, model).ok().and_then(|law| Trailing::new(model, &law)),
    };
    Guard { limits: plan.limits, workspace: Workspace::of(cell, model), trailing, period_s: TICK }
}

fn plan(settings: &Settings, cell: &Cell, model: &ArmModel, hidden: Option<&Theta>) -> Result<Plan> {
    let servo = cell.controller.as_ref().is_some_and(|c| c.kind == ControllerKind::JointPd);
    let replay = matches!(settings.arm, ArmChoice::Replay(_));
    let inside = hidden.and_then(inside_the_controller);
    if let (Some(what), Some(ControllerChoice::TorquePd)) = (inside, settings.controller) {
        bail!(
            "{what}: that acts in the arm's own controller, and --controller torque_pd has the bridge compute the torque; use \
             --controller joint_impedance"
        );
    }
    let torque = match settings.controller {
        Some(ControllerChoice::TorquePd) if servo => bail!(
            "[controller] in cell.toml is a servo (joint_pd), which computes its own torque; use --controller joint_impedance"
        ),
        Some(choice) => choice == ControllerChoice::TorquePd,
        None => !servo && inside.is_none(),
    };
    let law = match torque && !replay {
        true => Some(TorquePd::new(&ControlLaw::new(cell.controller.as_ref(), None, model)?, model.clone())),
        false => None,
    };
    let session = SystemTime::now().duration_since(UNIX_EPOCH).map_or(1, |d| d.as_nanos() as u64);
    Ok(Plan {
        interface: if law.is_some() { CommandInterface::Torque } else { CommandInterface::JointPosition },
        law,
        limits: limits(&settings.arm, cell, model)?,
        session,
    })
}

/// Limits in force: the cell's, and over the network those of the robot that is there, whichever are narrower.
fn limits(arm: &ArmChoice, cell: &Cell, model: &ArmModel) -> Result<Limits> {
    let described = Limits::of(cell, model);
    let ArmChoice::Fci(_) = arm else { return Ok(described) };
    if let Some(what) = unlike_an_fr3(model) {
        bail!(
            "fci:// drives a Franka Research 3, and [robot] in cell.toml {what}: table and limits would not be kept; write \
             `model = \"fr3\"` there, or give the FR3's own URDF"
        );
    }
    let narrower = described.within(&Limits::fr3());
    narrower.map_err(|joint| {
        anyhow::anyhow!(
            "joint {joint} of [robot] in cell.toml has no position that an FR3's joint {joint} can take; correct its <limit> in \
             the URDF, or write `model = \"fr3\"`"
        )
    })
}

/// What a described arm has that an FR3 has not.
fn unlike_an_fr3(model: &ArmModel) -> Option<String> {
    let fr3 = ArmModel::fr3();
    if !model.has_geometry() {
        return Some("names joints only".into());
    }
    if model.dof() != fr3.dof() {
        return Some(format!("describes {} joints", model.dof()));
    }
    (!model.is_built_like(&fr3)).then(|| "describes other links".into())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_arm_is_named_by_its_kind_and_address() {
        assert_eq!("sim".parse(), Ok(ArmChoice::Sim));
        assert_eq!("fci://172.16.0.2".parse(), Ok(ArmChoice::Fci("172.16.0.2".into())));
        assert_eq!("replay://a/b.mcap".parse(), Ok(ArmChoice::Replay("a/b.mcap".into())));
        for wrong in ["", "fci://", "simulated", "tcp://x"] {
            assert!(wrong.parse::<ArmChoice>().is_err(), "{wrong}");
        }
    }

    /// What a run with this `[robot]` is held to, or why there is none.
    fn limits_over(arm: &str, robot: &str) -> Result<Limits, String> {
        let folder = tempfile::tempdir().expect("a folder");
        let at = |name: &str| folder.path().join(name);
        // The vendor's own, and one that an optimist wrote.
        let urdf = include_str!("../serve/fr3.urdf");
        std::fs::write(at("fr3.urdf"), urdf).expect("a file");
        let generous = urdf.replace("effort=\"87", "effort=\"870").replace("velocity=\"2.62", "velocity=\"26.2");
        assert_ne!(generous, urdf);
        std::fs::write(at("generous.urdf"), generous.replace("lower=\"-2.9", "lower=\"-9.9")).expect("a file");
        std::fs::write(at("elsewhere.urdf"), urdf.replace("0.316", "0.516")).expect("a file");
        std::fs::write(at("cell.toml"), format!("[robot]\n{robot}\n")).expect("a file");
        let cell = Cell::read(&at("cell.toml")).expect("a cell");
        let model = ArmModel::from_cell(&cell).expect("an arm");
        limits(&arm.parse().expect("an arm"), &cell, &model).map_err(|error| error.to_string())
    }

    #[test]
    fn a_robot_on_the_network_is_held_to_its_own_limits_whatever_cell_toml_describes() {
        let (fr3, fci) = (Limits::fr3(), "fci://127.0.0.1");
        assert_eq!(limits_over(fci, "model = \"fr3\""), Ok(fr3));
        let generous = limits_over("sim", "urdf = \"generous.urdf\"").expect("a simulated arm may be anything");
        assert!(generous.joints[0].torque > 800.0 && generous.joints[0].q_min < -9.0, "{generous:?}");
        let held = limits_over(fci, "urdf = \"generous.urdf\"").expect("an FR3");
        for (held, own) in held.counted().zip(fr3.counted()) {
            assert!(held.q_min >= own.q_min && held.q_max <= own.q_max && held.velocity <= own.velocity);
            assert!(held.torque <= own.torque && held.torque_rate <= own.torque_rate && held.jerk <= own.jerk);
            assert!(held.deceleration <= own.deceleration && held.velocity_offset >= own.velocity_offset);
        }
        for (robot, what) in [
            ("joints = [\"a\", \"b\", \"c\", \"d\", \"e\", \"f\", \"g\"]", "names joints only"),
            ("urdf = \"elsewhere.urdf\"", "describes other links"),
        ] {
            let error = limits_over(fci, robot).expect_err("not an FR3");
            assert!(error.contains(what) && error.contains("model = \"fr3\""), "{error}");
        }
    }

    #[test]
    fn what_is_hidden_in_the_arms_own_controller_is_told_from_what_any_controller_shows() {
        let inside = |text: &str| {
            let theta = shared_mem::toml_file::parse(text, "hidden.toml".as_ref()).expect("a theta.toml");
            inside_the_controller(&theta).map(str::to_owned)
        };
        let delay = "[[effect]]\nname = \"payload\"\nmass = 0.3\n[[effect]]\nname = \"command_delay\"\ndelay = 0.012\n";
        assert_eq!(inside(delay).as_deref(), Some("command_delay"));
        assert!(inside("[arm]\nstiffness = [500.0]\ndamping = [40.0]\n").is_some_and(|what| what.contains("gains")));
        assert_eq!(inside("[[effect]]\nname = \"torque_delay\"\ndelay = 0.002\n[object]\nmass = 0.3\n"), None);
    }

    #[test]
    fn a_camera_is_named_as_it_is_printed() {
        for text in ["sim", "realsense", "bag://a/b.bag", "replay", "off"] {
            assert_eq!(text.parse::<CameraChoice>().map(|choice| choice.to_string()).as_deref(), Ok(text));
        }
        for wrong in ["", "bag://", "d455", "sim://x"] {
            assert!(wrong.parse::<CameraChoice>().is_err(), "{wrong}");
        }
    }
}
