//! Where the arm's states come from, as plain bytes inside [`super::arm::ArmState`].

use super::check::Wrong;
use super::wire::Field;
use crate::origin::Origin;

/// Room for an origin [bytes]: a host's longest name behind `fci://`.
const LENGTH: usize = 264;

/// What a bridge drives, as `--arm` takes it: `sim`, `fci://HOST`, `replay://CLIP`; empty where nobody says.
#[derive(Clone, Copy, PartialEq, Eq)]
pub struct ArmOrigin([u8; LENGTH]);

impl Default for ArmOrigin {
    fn default() -> Self {
        Self([0; LENGTH])
    }
}

impl std::fmt::Debug for ArmOrigin {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "{:?}", self.text())
    }
}

impl ArmOrigin {
    /// The arm of this text, as `--arm` takes it; a recording's name is cut where it is too long. Empty for a text that is no arm.
    pub fn new(arm: &str) -> Self {
        let text = match arm.parse() {
            Ok(Origin::Replay { clip }) => format!("replay://{clip}"),
            Ok(origin) => origin.arm().unwrap_or_default(),
            Err(()) => String::new(),
        };
        let mut bytes = [0; LENGTH];
        let mut end = text.len().min(LENGTH);
        while !text.is_char_boundary(end) {
            end -= 1;
        }
        bytes[..end].copy_from_slice(&text.as_bytes()[..end]);
        Self(bytes)
    }

    /// Its text; empty where nobody says.
    pub fn text(&self) -> &str {
        let end = self.0.iter().position(|byte| *byte == 0).unwrap_or(LENGTH);
        std::str::from_utf8(&self.0[..end]).unwrap_or("")
    }

    /// The origin; `None` where nobody says.
    pub fn origin(&self) -> Option<Origin> {
        self.text().parse().ok()
    }
}

impl Field for ArmOrigin {
    type Wire = [u8; LENGTH];

    fn to_wire(self) -> Self::Wire {
        self.0
    }

    fn from_wire(field: &'static str, wire: Self::Wire) -> Result<Self, Wrong> {
        let end = wire.iter().position(|byte| *byte == 0).unwrap_or(LENGTH);
        let (text, behind) = wire.split_at(end);
        // Nothing here is parsed: that allocates, and states come a thousand times a second.
        let is_text = std::str::from_utf8(text).is_ok_and(|text| !text.contains(char::is_control));
        let is_wrong = !is_text || behind.iter().any(|byte| *byte != 0);
        if is_wrong { Err(Wrong::Line { field }) } else { Ok(Self(wire)) }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_arm_goes_there_and_back_and_what_is_none_is_not_believed() {
        for arm in ["sim", "fci://172.16.0.2", "replay://clip_00.mcap"] {
            let there = ArmOrigin::from_wire("origin", ArmOrigin::new(arm).to_wire()).expect("an origin");
            assert_eq!((there.text(), there.origin()), (arm, arm.parse().ok()));
        }
        assert_eq!(ArmOrigin::new("nonsense").origin(), None);
        let longest = format!("fci://{}", "a".repeat(253));
        assert_eq!(ArmOrigin::new(&longest).text(), longest);
        let cut = ArmOrigin::new(&format!("replay://{}", "ä".repeat(1000)));
        assert!(cut.origin().is_some() && cut.text().starts_with("replay://ä"), "{cut:?}");
        let mut behind = ArmOrigin::new("sim").to_wire();
        behind[10] = b'x';
        let mut steering = ArmOrigin::new("sim").to_wire();
        steering[1] = 0x1b;
        let mut broken = ArmOrigin::new("sim").to_wire();
        broken[1] = 0xff;
        for wire in [behind, steering, broken] {
            assert!(ArmOrigin::from_wire("origin", wire).is_err());
        }
        assert_eq!(ArmOrigin::from_wire("origin", [0; LENGTH]), Ok(ArmOrigin::default()));
    }
}
