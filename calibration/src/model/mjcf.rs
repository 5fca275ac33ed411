//! MuJoCo: the cell as one MJCF file that loads as it stands, its elements named as in the robot's own model.

mod arm;
mod look;
mod scene;

use super::cell_model::CellModel;
use super::known::{Line, number, numbers};
use super::sheet::Sheet;
use nalgebra::{Isometry3, Matrix3, UnitQuaternion};

/// Of the file [s]: a tenth of the controller's period, short enough for the contact of a hard tip.
pub(super) const STEP: f64 = 1e-4;

/// The file, what stands in it, and what it cannot hold.
pub(super) fn write(model: &CellModel) -> Sheet {
    let mut file = File { sheet: Sheet::new() };
    file.sheet.xml.open("mujoco", &[("model", "cell".into())]);
    file.sheet.xml.leaf(
        "compiler",
        &[("angle", "radian".into()), ("autolimits", "true".into()), ("balanceinertia", "true".into())],
    );
    file.option(model);
    file.sheet.xml.open("default", &[]);
    file.sheet.xml.comment("only the contact pairs below touch");
    file.sheet.xml.leaf("geom", &[("contype", "0".into()), ("conaffinity", "0".into())]);
    file.sheet.xml.close();
    file.meshes(model);
    file.sheet.xml.open("worldbody", &[]);
    file.light(model);
    if let Some(height) = model.table {
        file.sheet.xml.comment("the table's surface [m], from cell.toml");
        file.sheet.xml.leaf(
            "geom",
            &[
                ("name", "table".into()),
                ("type", "plane".into()),
                ("pos", numbers([0.0, 0.0, height])),
                ("size", "3 3 0.1".into()),
            ],
        );
    }
    if let Some(arm) = &model.arm {
        file.shapes(model, 0);
        file.arm(arm, model);
    }
    if let Some(object) = &model.object {
        file.object(object, model.table.unwrap_or(0.0));
    }
    if let Some(camera) = &model.camera {
        file.camera(camera);
    }
    file.sheet.xml.close();
    file.contacts(model);
    if let Some(arm) = &model.arm {
        file.actuators(arm);
    }
    file.sensors(model);
    file.home(model);
    file.sheet
}

struct File {
    sheet: Sheet,
}

fn quaternion(q: &UnitQuaternion<f64>) -> String {
    numbers([q.w, q.i, q.j, q.k])
}

fn place(at: &Isometry3<f64>) -> [(&'static str, String); 2] {
    [("pos", numbers(at.translation.vector.iter().copied())), ("quat", quaternion(&at.rotation))]
}

fn full(inertia: &Matrix3<f64>) -> String {
    let i = |r, c| inertia[(r, c)];
    numbers([i(0, 0), i(1, 1), i(2, 2), i(0, 1), i(0, 2), i(1, 2)])
}

impl File {
    fn option(&mut self, model: &CellModel) {
        self.sheet.xml.comment(
            "timestep [s]: a contact whose time constant in solref is shorter than two steps is made softer by MuJoCo",
        );
        let gravity = &model.gravity;
        if let Some(known) = gravity.iter().find(|known| known.is_known()) {
            let line = Line {
                values: gravity.iter().map(|g| g.value).collect(),
                ..Line::new("world", "gravity in the base frame", "m/s^2", known)
            };
            let comment = self.sheet.note("gravity", line);
            self.sheet.xml.comment(&comment);
        }
        self.sheet.xml.leaf(
            "option",
            &[
                ("timestep", number(STEP)),
                ("integrator", "implicitfast".into()),
                ("cone", "elliptic".into()),
                ("impratio", "100".into()),
                ("iterations", "100".into()),
                ("tolerance", "1e-10".into()),
                ("gravity", numbers(gravity.iter().map(|g| g.value))),
            ],
        );
    }
}
