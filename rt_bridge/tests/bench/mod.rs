//! A control loop around any arm, put together as the bridge's control thread does it, for tests that turn it by hand.

use rt_bridge::arm::Arm;
use rt_bridge::motion::Player;
use rt_bridge::remark::Remark;
use rt_bridge::rt::cycle::{Beat, Cycle, Link, Plan, Turn};
use rt_bridge::rt::law::TorquePd;
use rt_bridge::rt::orders::{OrderSender, orders};
use rt_bridge::safety::{Guard, Limits, Workspace};
use rtrb::{Consumer, RingBuffer};
use shared_mem::cell::Cell;
use shared_mem::msg::arm::CommandInterface;
use twin::arm::{ArmModel, ControlLaw, Trailing};

/// Chunks of a motion that wait at most.
const WAITING: usize = 128;

/// The loop, and the other ends of its rings.
#[allow(dead_code)] // not every test looks at every end
pub(crate) struct Bench {
    pub(crate) cycle: Cycle,
    pub(crate) beats: Consumer<Beat>,
    pub(crate) remarks: Consumer<Remark>,
    pub(crate) orders: OrderSender,
}

impl Bench {
    /// A loop that has taken command of `arm` and holds.
    pub(crate) fn around(arm: impl Arm + 'static, cell: &Cell, interface: CommandInterface) -> Self {
        let model = ArmModel::from_cell(cell).expect("a model");
        let law =
            || TorquePd::new(&ControlLaw::new(cell.controller.as_ref(), None, &model).expect("gains"), model.clone());
        let plan = Plan {
            interface,
            law: (interface == CommandInterface::Torque).then(law),
            limits: Limits::fr3(),
            session: 1,
        };
        let trailing = match &plan.law {
            Some(law) => law.trailing(),
            // A cell that says nothing of a controller has no law.
            None => {
                ControlLaw::new(cell.controller.as_ref(), None, &model).ok().and_then(|law| Trailing::new(&model, &law))
            }
        };
        let guard = Guard { limits: Limits::fr3(), workspace: Workspace::of(cell, &model), trailing, period_s: 1e-3 };
        let (to_pump, beats) = RingBuffer::new(64);
        let (to_words, remarks) = RingBuffer::new(64);
        let (sender, from_pump) = orders(WAITING, 0);
        let link = Link { beats: to_pump, remarks: to_words, orders: from_pump, pump: std::thread::current() };
        let mut cycle = Cycle::new(Box::new(arm), plan, Player::new(guard, [0.0; 8]), link);
        assert_eq!(cycle.take_command(), Turn::Continue);
        Self { cycle, beats, remarks, orders: sender }
    }
}
