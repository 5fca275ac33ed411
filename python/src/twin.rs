//! The twin, step by step.

use crate::arrays::{list, rows};
use crate::failed;
use ::twin::arm::JointState;
use ::twin::control::Drive;
use ::twin::sensors::camera::SimCamera;
use ::twin::sim::{SceneState, SimScene};
use nalgebra::{Isometry3, Quaternion, Translation3, UnitQuaternion, Vector3};
use numpy::{PyArray1, PyArray2, PyArray3, PyArrayMethods as _, PyReadonlyArray1, PyReadonlyArray2};
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;
use shared_mem::cell::Cell;
use shared_mem::frames::Pose;
use shared_mem::msg::object::ObjectName;
use shared_mem::msg::{Joints, joints_from};
use shared_mem::theta::Theta;
use std::collections::BTreeMap;
use std::path::PathBuf;

/// Positions [rows, 3] and orientations [rows, 4] of an object; None without one.
type Way = (Option<Py<PyArray2<f64>>>, Option<Py<PyArray2<f64>>>);
/// Joint arrays of a roll-out: q, dq [rows, joints], then object position and orientation.
type RolledOut = (Py<PyArray2<f64>>, Py<PyArray2<f64>>, Option<Py<PyArray2<f64>>>, Option<Py<PyArray2<f64>>>);
/// The same with the way of each object by its name.
type RolledOutNamed = (Py<PyArray2<f64>>, Py<PyArray2<f64>>, BTreeMap<String, Way>);
/// Joint arrays of a roll-out, and the ways of the bodies in their order.
type Played = (Py<PyArray2<f64>>, Py<PyArray2<f64>>, Vec<Way>);
/// Position [3], m, and quaternion w, x, y, z [4].
type Place = (Py<PyArray1<f64>>, Py<PyArray1<f64>>);
/// Colour [rows, columns, 3] and depth [rows, columns], mm.
type Picture = (Py<PyArray3<u8>>, Py<PyArray2<u16>>);

/// How the one object of a cell is called that names none.
const UNNAMED: &str = "object";
/// A body that was put somewhere is there to this [m].
const THERE: f64 = 1e-6;

/// The simulated cell under its joint impedance controller, 1 ms a step.
#[pyclass(subclass, module = "twinalign._twinalign")]
pub(crate) struct Twin {
    described: Cell,
    scene: SimScene,
    begun: SceneState,
    camera: Option<SimCamera>,
    dof: usize,
}

#[pymethods]
impl Twin {
    /// The cell of a cell.toml; `theta`: what was identified, as JSON.
    #[new]
    #[pyo3(signature = (cell, theta=None))]
    fn new(cell: PathBuf, theta: Option<&str>) -> PyResult<Self> {
        let theta = theta.map(serde_json::from_str::<Theta>).transpose();
        let theta = theta.map_err(|error| PyValueError::new_err(format!("parameters: {error}")))?;
        let described = Cell::read(&cell).map_err(failed)?;
        let scene = SimScene::new(&described, theta.as_ref()).map_err(failed)?;
        let dof = scene.cell().arm_model().map_or(0, |arm| arm.dof());
        Ok(Self { described, begun: scene.state(), camera: None, dof, scene })
    }

    /// Number of joints.
    #[getter]
    fn dof(&self) -> usize {
        self.dof
    }

    /// Puts everything back where cell.toml has it, or where it is given: the first object, and any by its name.
    #[pyo3(signature = (*, q=None, dq=None, object_position=None, object_orientation=None, objects=None))]
    fn reset(
        &mut self,
        q: Option<PyReadonlyArray1<'_, f64>>,
        dq: Option<PyReadonlyArray1<'_, f64>>,
        object_position: Option<[f64; 3]>,
        object_orientation: Option<[f64; 4]>,
        objects: Option<BTreeMap<String, ([f64; 3], [f64; 4])>>,
    ) -> PyResult<()> {
        self.scene.resume(&self.begun);
        if let Some(camera) = &mut self.camera {
            camera.restart(&self.described);
        }
        if q.is_some() || dq.is_some() {
            let now = self.scene.cell().joint_reading().q;
            let q = q.map_or(Ok(now), |q| self.joints(&q))?;
            let dq = dq.map_or(Ok([0.0; 8]), |dq| self.joints(&dq))?;
            self.scene.set_arm(&JointState { q, dq }, self.dof);
        }
        let mut poses = BTreeMap::new();
        if object_position.is_some() || object_orientation.is_some() {
            let Some(now) = self.scene.object(0) else { return Err(PyValueError::new_err("cell.toml has no object")) };
            let position = object_position.unwrap_or_else(|| now.position());
            poses.insert(0, pose(position, object_orientation.unwrap_or_else(|| now.wxyz()))?);
        }
        for (name, (position, orientation)) in objects.unwrap_or_default() {
            poses.insert(self.number(&name)?, pose(position, orientation)?);
        }
        self.put(&poses).inspect_err(|_| self.scene.resume(&self.begun))
    }

    /// Lets `periods` control periods of 1 ms pass under desired positions and velocities.
    #[pyo3(signature = (q_d, dq_d=None, periods=1))]
    fn step(
        &mut self,
        q_d: PyReadonlyArray1<'_, f64>,
        dq_d: Option<PyReadonlyArray1<'_, f64>>,
        periods: usize,
    ) -> PyResult<()> {
        let q_d = self.joints(&q_d)?;
        let dq_d = dq_d.map_or(Ok([0.0; 8]), |dq_d| self.joints(&dq_d))?;
        let drive = Drive::JointImpedance { q_d, dq_d };
        (0..periods).for_each(|_| self.scene.step(&drive));
        Ok(())
    }

    /// Plays a series of commands, one a control period; states at the end of each.
    fn roll_out(
        &mut self,
        py: Python<'_>,
        q_d: PyReadonlyArray2<'_, f64>,
        dq_d: PyReadonlyArray2<'_, f64>,
    ) -> PyResult<RolledOut> {
        let count = usize::from(!self.scene.names().is_empty());
        let (q, dq, mut ways) = self.play(py, &q_d, &dq_d, count)?;
        let (place, turn) = ways.pop().unwrap_or((None, None));
        Ok((q, dq, place, turn))
    }

    /// The same with the ways of all objects by their names.
    fn roll_out_named(
        &mut self,
        py: Python<'_>,
        q_d: PyReadonlyArray2<'_, f64>,
        dq_d: PyReadonlyArray2<'_, f64>,
    ) -> PyResult<RolledOutNamed> {
        let (q, dq, ways) = self.play(py, &q_d, &dq_d, self.scene.names().len())?;
        Ok((q, dq, self.object_names().into_iter().zip(ways).collect()))
    }

    /// What the cell's camera shows now: colour [rows, columns, 3] and depth [rows, columns], mm, 0 where nothing is measured.
    fn render(&mut self, py: Python<'_>) -> PyResult<Picture> {
        if self.camera.is_none() {
            let camera = SimCamera::new(&self.described).map_err(failed)?;
            self.camera = Some(camera.with_effects(&self.scene.cell().camera_effects()));
        }
        let Some(camera) = &mut self.camera else { return Err(failed("there is no camera")) };
        let scene = self.scene.snapshot();
        let (mut colour, mut depth) = (vec![0; camera.color_bytes()], vec![0; camera.depth_bytes()]);
        py.detach(|| camera.render(&scene, &mut colour, &mut depth));
        let depth: Vec<u16> = depth.chunks_exact(2).map(|pair| u16::from_le_bytes([pair[0], pair[1]])).collect();
        let [columns, rows] = camera.size();
        let colour = PyArray1::from_vec(py, colour).reshape([rows, columns, 3])?.unbind();
        Ok((colour, PyArray1::from_vec(py, depth).reshape([rows, columns])?.unbind()))
    }

    /// Simulated time since the last reset, s.
    #[getter]
    fn time(&self) -> f64 {
        self.scene.cell().time_ns() as f64 * 1e-9
    }

    /// What the encoders read [joints], rad.
    #[getter]
    fn q(&self, py: Python<'_>) -> Py<PyArray1<f64>> {
        self.array(py, &self.scene.cell().joint_reading().q)
    }

    /// The same as velocities [joints], rad/s.
    #[getter]
    fn dq(&self, py: Python<'_>) -> Py<PyArray1<f64>> {
        self.array(py, &self.scene.cell().joint_reading().dq)
    }

    /// Torques behind the gears, gravity included, mean over the last period [joints], N m.
    #[getter(tau_J)]
    fn tau(&self, py: Python<'_>) -> Py<PyArray1<f64>> {
        self.array(py, &self.scene.cell().reading().tau_J)
    }

    /// Torques asked for in the last period, without gravity [joints], N m.
    #[getter(tau_J_d)]
    fn tau_d(&self, py: Python<'_>) -> Py<PyArray1<f64>> {
        self.array(py, &self.scene.cell().reading().tau_J_d)
    }

    /// Geometric centre of the first object in the base frame [3], m; None without one.
    #[getter]
    fn object_position(&self, py: Python<'_>) -> Option<Py<PyArray1<f64>>> {
        self.scene.object(0).map(|pose| list(py, pose.position().to_vec()))
    }

    /// The first object's quaternion w, x, y, z in the base frame [4]; None without one.
    #[getter]
    fn object_orientation(&self, py: Python<'_>) -> Option<Py<PyArray1<f64>>> {
        self.scene.object(0).map(|pose| list(py, pose.wxyz().to_vec()))
    }

    /// Names of all objects in the order of cell.toml, with the links of those that move in themselves.
    #[getter]
    fn object_names(&self) -> Vec<String> {
        self.scene.names().iter().map(named).collect()
    }

    /// Where each object is, by name: geometric centre in the base frame [3], m, and quaternion w, x, y, z [4].
    #[getter]
    fn objects(&self, py: Python<'_>) -> BTreeMap<String, Place> {
        let names = self.scene.names().iter().enumerate();
        let placed = names.filter_map(|(number, name)| {
            let pose = self.scene.object(number)?;
            Some((named(name), (list(py, pose.position().to_vec()), list(py, pose.wxyz().to_vec()))))
        });
        placed.collect()
    }

    /// Force between tool and objects, N.
    #[getter]
    fn contact_force(&self) -> f64 {
        self.scene.contact_force()
    }
}

impl Twin {
    /// Number of the body of this name.
    fn number(&self, name: &str) -> PyResult<usize> {
        let names = self.object_names();
        names.iter().position(|known| known == name).ok_or_else(|| match names.is_empty() {
            true => PyValueError::new_err("cell.toml has no object"),
            false => PyValueError::new_err(format!("cell.toml has no object `{name}`; it has {}", names.join(", "))),
        })
    }

    /// Puts bodies somewhere, at rest, those first that others hang on.
    fn put(&mut self, poses: &BTreeMap<usize, Isometry3<f64>>) -> PyResult<()> {
        for (number, pose) in poses {
            self.scene.set_object(*number, &Pose::from_isometry(*pose), Vector3::zeros(), Vector3::zeros());
        }
        let names = self.object_names();
        for (number, pose) in poses.iter().filter(|(number, _)| !self.scene.is_on_joint(**number)) {
            let there = self.scene.object(*number).map(|there| there.isometry().translation.vector);
            if there.is_none_or(|there| (there - pose.translation.vector).norm() > THERE) {
                let name = &names[*number];
                return Err(PyValueError::new_err(format!(
                    "`{name}` cannot be put elsewhere: cell.toml holds it (`hold = \"fixed\"`)"
                )));
            }
        }
        match self.scene.overlap().filter(|_| !poses.is_empty()) {
            None => Ok(()),
            Some(both) => {
                let [a, b] = both.map(|name| named(&name));
                Err(PyValueError::new_err(format!("`{a}` and `{b}` overlap there; put one of them elsewhere")))
            }
        }
    }

    /// Plays commands; the joints and the ways of so many bodies.
    fn play(
        &mut self,
        py: Python<'_>,
        q_d: &PyReadonlyArray2<'_, f64>,
        dq_d: &PyReadonlyArray2<'_, f64>,
        count: usize,
    ) -> PyResult<Played> {
        let dof = self.dof;
        let (told, turning) = (q_d.as_array(), dq_d.as_array());
        if told.shape() != turning.shape() || told.ncols() != dof {
            return Err(PyValueError::new_err(format!("q_d and dq_d have to be of one shape, [rows, {dof}]")));
        }
        let (told, turning): (Vec<f64>, Vec<f64>) = (told.iter().copied().collect(), turning.iter().copied().collect());
        let scene = &mut self.scene;
        let (mut q, mut dq, mut ways) = (Vec::new(), Vec::new(), vec![(Vec::new(), Vec::new()); count]);
        py.detach(|| {
            for (q_d, dq_d) in told.chunks(dof).zip(turning.chunks(dof)) {
                scene.step(&Drive::JointImpedance { q_d: joints_from(q_d), dq_d: joints_from(dq_d) });
                let state = scene.cell().joint_reading();
                q.extend_from_slice(&state.q[..dof]);
                dq.extend_from_slice(&state.dq[..dof]);
                for (number, (place, turn)) in ways.iter_mut().enumerate() {
                    if let Some(pose) = scene.object(number) {
                        place.extend(pose.position());
                        turn.extend(pose.wxyz());
                    }
                }
            }
        });
        let none = || PyValueError::new_err("there are no commands");
        let q = rows(py, q, dof)?.ok_or_else(none)?;
        let dq = rows(py, dq, dof)?.ok_or_else(none)?;
        let ways = ways.into_iter().map(|(place, turn)| Ok((rows(py, place, 3)?, rows(py, turn, 4)?)));
        Ok((q, dq, ways.collect::<PyResult<_>>()?))
    }

    fn joints(&self, given: &PyReadonlyArray1<'_, f64>) -> PyResult<Joints> {
        let view = given.as_array();
        if view.len() != self.dof {
            return Err(PyValueError::new_err(format!("{} numbers for {} joints", view.len(), self.dof)));
        }
        let mut joints = [0.0; 8];
        joints.iter_mut().zip(view).for_each(|(joint, value)| *joint = *value);
        Ok(joints)
    }

    fn array(&self, py: Python<'_>, joints: &Joints) -> Py<PyArray1<f64>> {
        list(py, joints[..self.dof].to_vec())
    }
}

/// What a body is called here.
fn named(name: &ObjectName) -> String {
    if name.is_empty() { UNNAMED.to_owned() } else { name.text().to_owned() }
}

/// A pose of a position [m] and a quaternion w, x, y, z of any length.
fn pose([x, y, z]: [f64; 3], [w, i, j, k]: [f64; 4]) -> PyResult<Isometry3<f64>> {
    let turn = UnitQuaternion::try_new(Quaternion::new(w, i, j, k), f64::MIN_POSITIVE);
    let turn = turn.filter(|_| [x, y, z, w, i, j, k].iter().all(|number| number.is_finite()));
    let turn = turn
        .ok_or_else(|| PyValueError::new_err("a pose is 3 finite numbers and a quaternion w, x, y, z that is not 0"))?;
    Ok(Isometry3::from_parts(Translation3::new(x, y, z), turn))
}
