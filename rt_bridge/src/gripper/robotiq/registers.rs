//! What the registers of a Robotiq 2F mean. Pure.
//!
//! Source: Robotiq 2F-85 & 2F-140 Instruction Manual, "Register Mapping": three registers of two bytes each, high byte
//! first. Written at 1000: action, -, -, position, speed, force. Read at 2000: status, -, fault, position echo, position,
//! current. Position counts grow as the fingers close.

/// First register of what is written.
pub const OUTPUT: u16 = 0x03E8;
/// First register of what is read.
pub const INPUT: u16 = 0x07D0;
/// Registers of each.
pub const COUNT: u16 = 3;

/// Bit of "be active" in the action.
const ACTIVE: u16 = 1;
/// Bit of "go to the position asked for".
const GO: u16 = 1 << 3;

/// An action of the gripper, as it is sent.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Action {
    /// Be active; the change from `false` to `true` makes the gripper find its range.
    pub active: bool,
    /// Go to `position`; `false` stops where it is.
    pub go: bool,
    /// 0 open, 255 closed.
    pub position: u8,
    /// 0 slowest, 255 fastest.
    pub speed: u8,
    /// 0 gentlest, 255 hardest.
    pub force: u8,
}

/// How far activation has come.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Activation {
    /// It has to be activated.
    Reset,
    /// It finds its range.
    UnderWay,
    /// It can be used.
    Done,
}

/// What the fingers do.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Fingers {
    Moving,
    /// They were stopped by something while they opened.
    StoppedOpening,
    /// They were stopped by something while they closed.
    StoppedClosing,
    /// They are where they were sent.
    Arrived,
}

/// What the gripper reports.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Status {
    pub activation: Activation,
    /// Whether it goes to the position asked for.
    pub going: bool,
    /// What the fingers do; means something only while `going`.
    pub fingers: Fingers,
    /// Fault code, 0 for none.
    pub fault: u8,
    /// Where the fingers are, 0 open to 255 closed.
    pub position: u8,
    /// Motor current [10 mA].
    pub current: u8,
}

impl Action {
    /// The three registers to write.
    pub fn registers(&self) -> [u16; 3] {
        let bit = |set: bool, bit: u16| if set { bit } else { 0 };
        let action = bit(self.active, ACTIVE) | bit(self.go, GO);
        [action << 8, u16::from(self.position), u16::from(self.speed) << 8 | u16::from(self.force)]
    }
}

impl Status {
    /// From the three registers read.
    pub fn from_registers(registers: [u16; 3]) -> Self {
        let [status, fault, position] = registers.map(|register| register.to_be_bytes());
        Self {
            activation: match status[0] >> 4 & 0b11 {
                0 => Activation::Reset,
                3 => Activation::Done,
                _ => Activation::UnderWay,
            },
            going: status[0] >> 3 & 1 == 1,
            fingers: match status[0] >> 6 {
                0 => Fingers::Moving,
                1 => Fingers::StoppedOpening,
                2 => Fingers::StoppedClosing,
                _ => Fingers::Arrived,
            },
            fault: fault[0],
            position: position[0],
            current: position[1],
        }
    }

    /// Whether something is between the fingers.
    pub fn holds(&self) -> bool {
        self.going && matches!(self.fingers, Fingers::StoppedClosing | Fingers::StoppedOpening)
    }
}

/// What a fault code means and what to do about it; `None` for codes that pass by themselves and for none.
pub fn fault_in_words(code: u8) -> Option<&'static str> {
    // The upper half is the controller's own code, which says nothing a user could act on.
    Some(match code & 0x0F {
        0x08 => "is too hot; let it cool below 80 °C",
        0x0A => "has too little voltage; check its 24 V supply",
        0x0B => "releases what it holds by itself; wait for its end, then home it",
        0x0C => "has an internal fault; switch its power off and on",
        0x0D => "could not find its range; take what blocks its fingers out and home it",
        0x0E => "drew too much current; switch its power off and on",
        0x0F => "released what it held by itself; home it",
        _ => return None,
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    #[test]
    fn registers_are_those_of_the_manual() {
        // Manual: close at full speed and force is 09 00 00 FF FF FF.
        let close = Action { active: true, go: true, position: 255, speed: 255, force: 255 };
        assert_eq!(close.registers(), [0x0900, 0x00FF, 0xFFFF]);
        // Manual: B9 .. 00 FF BD 00 tells an object that was met while closing at 189.
        let held = Status::from_registers([0xB900, 0x00FF, 0xBD00]);
        assert_eq!((held.activation, held.going, held.fingers), (Activation::Done, true, Fingers::StoppedClosing));
        assert_eq!((held.fault, held.position, held.holds()), (0, 189, true));
        let reset = Status::from_registers([0, 0, 0]);
        assert_eq!((reset.activation, reset.holds()), (Activation::Reset, false));
    }

    proptest! {
        #[test]
        fn any_registers_are_a_status(registers: [u16; 3]) {
            let status = Status::from_registers(registers);
            let _words = fault_in_words(status.fault);
            prop_assert!(!status.holds() || status.going);
        }
    }
}
