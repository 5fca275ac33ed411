//! The object for other programs: a URDF of one link, and the block that cell.toml takes.

use super::Summary;
use std::fmt::Write as _;

pub(super) fn piece_file(number: usize) -> String {
    format!("pieces/piece_{number:02}.obj")
}

/// A name as XML may hold it.
pub(super) fn escaped(name: &str) -> String {
    name.replace('&', "&amp;").replace('<', "&lt;").replace('>', "&gt;").replace('"', "&quot;")
}

/// One link: the fine mesh to see, the convex pieces to touch.
pub(super) fn urdf(summary: &Summary, pieces: usize) -> String {
    let name = escaped(&summary.name);
    let [x, y, z] = summary.centre_of_mass_m;
    let [xx, xy, xz, yy, yz, zz] = summary.inertia_kg_m2;
    let mut text = format!(
        "<?xml version=\"1.0\"?>\n<robot name=\"{name}\">\n  <link name=\"{name}\">\n    <inertial>\n      \
         <origin xyz=\"{x:.6} {y:.6} {z:.6}\" rpy=\"0 0 0\"/>\n      <mass value=\"{:.6}\"/>\n      \
         <inertia ixx=\"{xx:e}\" ixy=\"{xy:e}\" ixz=\"{xz:e}\" iyy=\"{yy:e}\" iyz=\"{yz:e}\" izz=\"{zz:e}\"/>\n    </inertial>\n    \
         <visual>\n      <geometry><mesh filename=\"object_fine.obj\"/></geometry>\n    </visual>\n",
        summary.mass_kg
    );
    for number in 0..pieces {
        let file = piece_file(number);
        write!(text, "    <collision>\n      <geometry><mesh filename=\"{file}\"/></geometry>\n    </collision>\n")
            .expect("a string takes all text");
    }
    text.push_str("  </link>\n</robot>\n");
    text
}

/// The `[object]` block of cell.toml.
pub(super) fn block(summary: &Summary) -> String {
    // To a tenth of a millimetre, and zero without a sign.
    let [x, y, z] = summary.centre_of_mass_m.map(|v| (1e4 * v).round() * 1e-4 + 0.0);
    let mass = if summary.weighed {
        format!("mass = {:.4}\n", summary.mass_kg)
    } else {
        let guess = summary.mass_kg;
        format!(
            "# Nobody weighed it: a body of 200 to 2000 kg/m^3.\nmass_range = [{:.4}, {:.4}]\n",
            0.4 * guess,
            4.0 * guess
        )
    };
    let range = |v: f64| format!("[{:.4}, {:.4}]", v - 0.01, v + 0.01);
    format!(
        "# Of a scan: {} views, volume {:.1} cm^3, of one material its centre of mass is at [{x:.4}, {y:.4}, {z:.4}].\n\
         [object]\nmesh = \"object.obj\"\nsplats = \"splats.ply\"\n{mass}centre_of_mass_range = [{}, {}, {}]\n",
        summary.views,
        summary.volume_m3 * 1e6,
        range(x),
        range(y),
        range(z)
    )
}

#[cfg(test)]
mod tests {
    use super::super::summary::UnknownNumbers;
    use super::*;
    use crate::mesh::Topology;
    use crate::scan::{Scale, ScaleSource};
    use shared_mem::cell::Object;

    fn summary() -> Summary {
        Summary {
            name: "a <box>".into(),
            size_m: [0.1, 0.2, 0.3],
            origin_in_scan_m: [0.0; 3],
            volume_m3: 6e-3,
            pieces_volume_m3: 6e-3,
            pieces: 2,
            mass_kg: 3.0,
            weighed: false,
            centre_of_mass_m: [0.01, 0.0, -0.02],
            inertia_kg_m2: [1e-3, 0.0, 0.0, 2e-3, 0.0, 3e-3],
            surface: Topology { corners: 8, triangles: 12, genus: 0, parts: 1 },
            coarse_triangles: 12,
            splats: 8,
            scale: Scale { metres: 1.0, source: ScaleSource::Given, spread: 0.0 },
            views: 52,
            with_depth: true,
            computed_depth: None,
            cameras_moved_m: 0.0,
            held_out: Vec::new(),
            psnr_db: 33.0,
            psnr_splats_db: 35.0,
            voxel_m: 1e-3,
            table: None,
            unknown: UnknownNumbers { unseen: 0.0, contradicted: 0.0, ambiguous: 0.0 },
            remarks: Vec::new(),
        }
    }

    #[test]
    fn the_block_is_one_that_cell_toml_takes() {
        let mut weighed = summary();
        (weighed.weighed, weighed.mass_kg) = (true, 0.4);
        for (summary, mass) in [(summary(), None), (weighed, Some(0.4))] {
            #[derive(serde::Deserialize)]
            struct Cell {
                object: Object,
            }
            let cell: Cell = toml::from_str(&block(&summary)).expect("a block");
            assert_eq!((cell.object.mass, cell.object.mesh), (mass, Some("object.obj".into())));
            assert_eq!(cell.object.centre_of_mass_range.map(|r| r[2][0] < -0.02 && r[2][1] > -0.02), Some(true));
        }
    }

    #[test]
    fn the_urdf_has_one_collision_for_each_piece_and_escaped_names() {
        let text = urdf(&summary(), 2);
        assert_eq!(text.matches("<collision>").count(), 2);
        assert!(text.contains("a &lt;box&gt;") && text.contains("ixx=\"1e-3\""), "{text}");
    }
}
