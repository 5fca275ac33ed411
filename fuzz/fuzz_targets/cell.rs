//! cell.toml, theta.toml and the effects in it. What is accepted can be written and read again.
#![no_main]

use libfuzzer_sys::fuzz_target;
use shared_mem::cell::Cell;
use shared_mem::theta::Theta;
use shared_mem::toml_file;
use std::path::Path;
use twin::effects::Effects;

const EFFECTS: &str = "[arm]\nstiffness = [1.0, 2.0]\ndamping = [0.1, 0.2]\n[object]\nfriction = 0.3\n[[effect]]\nname = \"joint_viscous_friction\"\nviscous = [0.1, 0.2, 0.3, 0.4, 0.5, 0.6, 0.7]\n";

fuzz_target!(
    init: fuzz::seeds([include_bytes!("../../config/fr3_cell.toml").to_vec(), EFFECTS.into()]),
    |text: &str| {
        let path = Path::new("cell.toml");
        if let Some(cell) = fuzz::accepted(Cell::parse(text, path)) {
            let written = cell.to_toml();
            let read = Cell::parse(&written, path).unwrap_or_else(|e| panic!("{e}\n{written}"));
            assert_eq!(read.to_toml(), written);
        }
        if let Some(theta) = fuzz::accepted(toml_file::parse::<Theta>(text, path)) {
            let written = theta.to_toml();
            toml_file::parse::<Theta>(&written, path).unwrap_or_else(|e| panic!("{e}\n{written}"));
            for dof in [2, 7] {
                fuzz::accepted(Effects::from_theta(&theta.effects, dof));
            }
        }
    }
);
