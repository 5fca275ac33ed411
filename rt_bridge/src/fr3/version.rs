//! Which FCI version goes with which robot software, and what to do when it is not ours. Called by the handshake.
//!
//! An FCI server answers a client of another version with its own number and nothing else; there is no downgrade within a
//! connection. The table is libfranka's compatibility list (version of the interface, of libfranka, of the robot system).

/// The version this bridge speaks: Franka Research 3 with system image 5.9.0 or later (libfranka 0.18 to 0.21).
pub(super) const FCI_VERSION: u16 = 10;

/// What a robot that speaks `version` is, in words: system image and matching libfranka.
fn described(version: u16) -> &'static str {
    match version {
        0..=3 => "a Panda with a system image before 4.0.0",
        4 => "a Panda with system image 4.0.0 (libfranka 0.8)",
        5 => "a Panda (FER) with system image 4.2.1 (libfranka 0.9)",
        6 => "system image 5.2.0 (libfranka 0.10 to 0.13.2)",
        7 => "system image 5.5.0 (libfranka 0.13.3 to 0.13.6)",
        8 => "system image 5.7.0 (libfranka 0.14)",
        9 => "system image 5.7.2 (libfranka 0.15 to 0.17)",
        10 => "system image 5.9.0 (libfranka 0.18 to 0.21)",
        _ => "a system image newer than this bridge knows",
    }
}

/// One sentence: what the robot runs, and what to do about it.
pub(super) fn remedy(theirs: u16) -> String {
    let what_to_do = match theirs {
        0..=5 => "that robot is no Franka Research 3 and cannot be updated to one",
        6..=9 => "update the robot to system image 5.9.0 or later in its web page",
        _ => "update this bridge",
    };
    format!("the robot's is that of {}: {what_to_do}", described(theirs))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_older_robot_is_to_be_updated_and_a_newer_one_asks_for_a_newer_bridge() {
        assert!(remedy(9).contains("5.7.2") && remedy(9).contains("update the robot"), "{}", remedy(9));
        assert!(remedy(11).contains("update this bridge"), "{}", remedy(11));
        assert!(remedy(5).contains("Panda"), "{}", remedy(5));
    }
}
