//! How an arm fails: `Copy` numbers for the control thread, sentences with a remedy for people.

use super::ReflexErrors;
use shared_mem::msg::arm::ArmMode;
use std::fmt;

/// Why commanding ended. Holds numbers only, so that it can be made and handed on without allocation.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum ArmFault {
    /// The arm's own safety functions stopped it.
    Reflex {
        /// What they object to.
        errors: ReflexErrors,
    },
    /// The user's button was pressed.
    UserStopped,
    /// No state for this long [ms].
    Silent {
        /// How long [ms].
        ms: u32,
    },
    /// The arm's side closed the connection.
    Disconnected,
    /// The arm refused a request; the number is its own status byte.
    Refused {
        /// Status byte of the reply.
        status: u8,
    },
    /// The arm is in a mode in which it takes no commands.
    NotReady {
        /// The mode it reports.
        mode: ArmMode,
    },
    /// The operating system refused to send or receive.
    Socket {
        /// Its error number.
        errno: i32,
    },
    /// A state held a number that is not finite.
    BadState {
        /// Joint it was found in, counted from 1; 0: outside the joint arrays.
        joint: u8,
    },
}

impl ArmFault {
    /// `true` when nothing more will come from this arm: the run ends. Otherwise states go on being read and published.
    pub fn is_final(self) -> bool {
        matches!(self, Self::Silent { .. } | Self::Disconnected | Self::Socket { .. })
    }
}

impl fmt::Display for ArmFault {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Reflex { errors } => write!(
                f,
                "the robot stopped itself ({errors}); free it if it is pressed against something, then start `rt_bridge run` again: it asks for error recovery first"
            ),
            Self::UserStopped => {
                f.write_str("the user stop was pressed; release it, then start `rt_bridge run` again")
            }
            Self::Silent { ms } => write!(
                f,
                "no state from the robot for {ms} ms; check that its controller is on and the cable is in, then start `rt_bridge run` again (`rt_bridge doctor --arm fci://HOST` tests the line)"
            ),
            Self::Disconnected => f.write_str(
                "the robot's side closed the connection; see that its controller runs and no other client took over, then start `rt_bridge run` again",
            ),
            Self::Refused { status } => write!(
                f,
                "the robot refused the request (status {status}); release its brakes, activate FCI in its web page and start again"
            ),
            Self::NotReady { mode } => write!(
                f,
                "the robot is in mode {mode:?} and takes no commands; unlock its joints and activate FCI in its web page, leave guiding, then start again"
            ),
            Self::Socket { errno } => write!(
                f,
                "the network refused to carry the command ({}); check the interface towards the robot and start again",
                std::io::Error::from_raw_os_error(*errno)
            ),
            Self::BadState { joint } => write!(
                f,
                "the arm reported a number that is not finite (joint {joint}); commanding stopped: look at /arm/state, then start again"
            ),
        }
    }
}

impl std::error::Error for ArmFault {}

/// An arm cannot be reached. Made before the control thread runs.
#[derive(Debug, thiserror::Error)]
pub enum ConnectError {
    /// Nobody answers there.
    #[error(
        "no robot answers at {host} ({what}); check the address, the cable and that FCI is activated in the robot's web page"
    )]
    NoAnswer {
        /// Address as given.
        host: String,
        /// The network's reason.
        what: String,
    },
    /// Somebody answers, in another dialect.
    #[error(
        "the robot at {host} speaks FCI version {theirs}, this bridge speaks {ours} (system image 5.9.0 or later); {remedy}"
    )]
    Version {
        /// Address as given.
        host: String,
        theirs: u16,
        ours: u16,
        /// What theirs belongs to, and what to do.
        remedy: String,
    },
    /// The machine does not allow what real-time control needs.
    #[error("{what}; run `rt_bridge doctor`, or accept a lesser clock with `--realtime ignore`")]
    Realtime {
        /// What is missing.
        what: String,
    },
    /// The robot refused a setting.
    #[error("the robot at {host} refused: {what}; release its brakes, activate FCI in its web page and start again")]
    Refused {
        /// Address as given.
        host: String,
        what: String,
    },
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_reflex_names_its_cause_and_the_way_back() {
        let text = ArmFault::Reflex { errors: ReflexErrors::from_bits(1 << 25 | 1 << 6) }.to_string();
        assert!(text.contains("joint_reflex, communication_constraints_violation"), "{text}");
        assert!(text.contains("start `rt_bridge run` again"), "{text}");
    }

    #[test]
    fn only_a_lost_connection_ends_the_run() {
        assert!(ArmFault::Disconnected.is_final() && ArmFault::Silent { ms: 1000 }.is_final());
        assert!(!ArmFault::UserStopped.is_final());
        assert!(!ArmFault::Reflex { errors: ReflexErrors::from_bits(1) }.is_final());
    }
}
